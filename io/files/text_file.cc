#include "io/files/text_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include "engine/base/error.h"
#include "io/files/descriptor.h"

namespace carom {

TextFile::TextFile(std::filesystem::path path, std::optional<std::uint64_t> size)
    : path_(std::move(path)),
      descriptor_(::open(path_.c_str(), O_WRONLY | O_CLOEXEC | (size ? 0 : O_CREAT | O_TRUNC), 0666)),
      size_(size.value_or(0)) {
  if (descriptor_ < 0) fail(errno);
  const off_t there = size ? ::lseek(descriptor_, 0, SEEK_END) : 0, end = static_cast<off_t>(size_);
  if (there < end)
    throw Error(Failure::file, path_.string() + ": has " + std::to_string(there) + " bytes of " + std::to_string(end) +
                                   ": it was cut or exchanged since that number was taken");
  if (size && (::ftruncate(descriptor_, end) != 0 || ::lseek(descriptor_, end, SEEK_SET) < 0)) fail(errno);
}

TextFile::~TextFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void TextFile::append(std::string_view piece) {
  for (std::size_t done = 0; done < piece.size();) {
    const ssize_t n = ::write(descriptor_, piece.data() + done, piece.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      const int error_number = n < 0 ? errno : ENOSPC;
      const auto start = static_cast<off_t>(size_);
      if (::ftruncate(descriptor_, start) == 0) ::lseek(descriptor_, start, SEEK_SET);
      fail(error_number);
    }
    done += static_cast<std::size_t>(n);
  }
  size_ += piece.size();
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

void put_in_place(const std::filesystem::path& aside, const std::filesystem::path& path) try {
  std::filesystem::rename(aside, path);
  const Descriptor folder(::open(path.has_parent_path() ? path.parent_path().c_str() : ".", O_RDONLY | O_CLOEXEC));
  if (folder.is_open()) ::fsync(folder.number());  // some folders can't be synced
} catch (const std::filesystem::filesystem_error& e) {
  throw Error(Failure::file, path.string() + ": cannot put the new file in place: " + e.code().message());
}

void write_aside(const std::filesystem::path& path, const std::function<void(TextFile&)>& write) {
  std::filesystem::path aside = path;
  aside += ".part";
  try {
    TextFile file(aside);
    write(file);
    file.close();
    put_in_place(aside, path);
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(aside, ignored);
    throw;
  }
}

void write_file_atomically(const std::filesystem::path& path, std::string_view text) {
  write_aside(path, [&](TextFile& file) { file.append(text); });
}

}  // namespace carom
