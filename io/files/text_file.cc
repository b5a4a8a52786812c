// SPDX-License-Identifier: BSD-3-Clause
#include "io/files/text_file.h"

#include <fcntl.h>
#include <libdeflate.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>
#include <vector>

#include "io/files/descriptor.h"

namespace carom {

namespace fs = std::filesystem;

TextFile::TextFile(fs::path path, const std::optional<FileMark>& mark)
    : path_(std::move(path)), mark_(mark.value_or(FileMark())) {
  if (mark) check_text(path_, *mark);
  descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CLOEXEC | (mark ? 0 : O_CREAT | O_TRUNC), 0666);
  const auto end = static_cast<off_t>(mark_.length);
  if (descriptor_ < 0 || (mark && (::ftruncate(descriptor_, end) != 0 || ::lseek(descriptor_, end, SEEK_SET) < 0)))
    fail(errno);
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
      const auto start = static_cast<off_t>(mark_.length);
      if (::ftruncate(descriptor_, start) == 0) ::lseek(descriptor_, start, SEEK_SET);
      fail(error_number);
    }
    done += static_cast<std::size_t>(n);
  }
  mark_.length += piece.size();
  mark_.sum = libdeflate_crc32(static_cast<std::uint32_t>(mark_.sum), piece.data(), piece.size());
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

void check_text(const fs::path& path, const FileMark& mark) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));  // does not wait for a pipe
  if (!file.is_open()) refuse_to_go_on(path, std::string("cannot be read: ") + std::strerror(errno));
  std::vector<char> piece(1 << 16);
  FileMark there;
  while (there.length < mark.length) {
    const ssize_t got = ::read(file.number(), piece.data(), std::min(piece.size(), mark.length - there.length));
    if (got < 0) refuse_to_go_on(path, std::string("cannot be read: ") + std::strerror(errno));
    if (got == 0)
      refuse_to_go_on(path, "has " + std::to_string(there.length) + " bytes, and had " + std::to_string(mark.length) +
                                " at the checkpoint");
    there.length += static_cast<std::uint64_t>(got);
    there.sum = libdeflate_crc32(static_cast<std::uint32_t>(there.sum), piece.data(), static_cast<std::size_t>(got));
  }
  if (there.sum != mark.sum)
    refuse_to_go_on(path, "is the file of another run, or was changed: its first " + std::to_string(mark.length) +
                              " bytes are not those that it had at the checkpoint");
}

void rename_file(const fs::path& from, const fs::path& to) {
  std::error_code failed;
  const fs::file_status is = fs::symlink_status(to, failed);
  if (fs::exists(is) && !fs::is_regular_file(is) && !fs::is_symlink(is))
    throw Error(Failure::file, to.string() +
                                   ": is a directory, a pipe or a device, which no new file replaces; move it "
                                   "away");
  fs::rename(from, to, failed);
  if (failed)
    throw Error(Failure::file, to.string() + ": cannot rename " + from.string() + " to this name: " + failed.message() +
                                   "; check the disk and the permissions of the directory");
}

void put_in_place(const fs::path& aside, const fs::path& path) {
  rename_file(aside, path);
  const Descriptor folder(::open(path.has_parent_path() ? path.parent_path().c_str() : ".", O_RDONLY | O_CLOEXEC));
  if (folder.is_open()) ::fsync(folder.number());  // some folders can't be synced
}

fs::path behind_links(fs::path path) {
  constexpr int kMostLinks = 40;  // as in Linux
  std::error_code failed;
  for (int links = 0; links < kMostLinks && fs::is_symlink(path, failed); ++links)
    path = path.parent_path() / fs::read_symlink(path, failed);
  return path;
}

bool is_standard_output(const fs::path& path) {
  struct stat named {
  }, standard{};
  return ::stat(path.c_str(), &named) == 0 && ::fstat(STDOUT_FILENO, &standard) == 0 &&
         named.st_dev == standard.st_dev && named.st_ino == standard.st_ino;
}

void write_aside(const fs::path& path, const std::function<void(TextFile&)>& write) {
  std::error_code ignored;
  const fs::path target = behind_links(path);
  const fs::file_status is = fs::status(path, ignored);
  // The target of a link in /proc/self/fd need not be a path: the file can then exist without that path.
  const bool replace =
      is.type() == fs::file_type::not_found || (fs::is_regular_file(is) && fs::equivalent(path, target, ignored));
  fs::path aside = target;
  if (replace) aside += ".part";
  try {
    TextFile file(replace ? aside : path);
    write(file);
    file.close();
    if (replace) put_in_place(aside, target);
  } catch (...) {
    if (replace) fs::remove(aside, ignored);
    throw;
  }
}

void write_file_atomically(const fs::path& path, std::string_view text) {
  write_aside(path, [&](TextFile& file) { file.append(text); });
}

}  // namespace carom
