#include "io/files/text_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include "engine/base/error.h"

namespace carom {

TextFile::TextFile(std::filesystem::path path)
    : path_(std::move(path)), descriptor_(::open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666)) {
  if (descriptor_ < 0) fail(errno);
}

TextFile::~TextFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void TextFile::append(std::string_view piece) {
  const off_t start = ::lseek(descriptor_, 0, SEEK_CUR);
  for (std::size_t done = 0; done < piece.size();) {
    const ssize_t n = ::write(descriptor_, piece.data() + done, piece.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      const int error_number = n < 0 ? errno : ENOSPC;
      if (::ftruncate(descriptor_, start) == 0) ::lseek(descriptor_, start, SEEK_SET);
      fail(error_number);
    }
    done += static_cast<std::size_t>(n);
  }
}

void TextFile::close() {
  // EINVAL: a file that cannot be synchronised, such as a pipe.
  if (::fsync(descriptor_) != 0 && errno != EINVAL) fail(errno);
  if (::close(std::exchange(descriptor_, -1)) != 0) fail(errno);
}

void TextFile::fail(int error_number) const {
  throw Error(Failure::file,
              path_.string() + ": cannot write: " + std::strerror(error_number) +
                  "; check free space, quota and permissions there, or choose another directory with -o");
}

void write_file_atomically(const std::filesystem::path& path, std::string_view text) {
  std::filesystem::path aside = path;
  aside += ".part";
  try {
    TextFile file(aside);
    file.append(text);
    file.close();
    std::filesystem::rename(aside, path);
  } catch (const std::filesystem::filesystem_error& e) {
    throw Error(Failure::file, path.string() + ": cannot put the new file in place: " + e.code().message());
  } catch (const Error&) {
    std::error_code ignored;
    std::filesystem::remove(aside, ignored);
    throw;
  }
}

}  // namespace carom
