#pragma once
// A text file written piece by piece, each piece handed to the operating system at once and checked.
//
// What has been appended survives the end of the process. A piece goes in as a whole or not at all: if the disk fills
// up in the middle of one, its beginning is taken back. All failures throw Error(Failure::file) with the file's name.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string_view>

namespace carom {

class TextFile {
 public:
  /// A new, empty file, or one that is there, to go on behind its first `size` bytes.
  explicit TextFile(std::filesystem::path path, std::optional<std::uint64_t> size = {});
  ~TextFile();
  TextFile(const TextFile&) = delete;
  TextFile& operator=(const TextFile&) = delete;

  void append(std::string_view piece);
  /// In bytes.
  std::uint64_t size() const { return size_; }
  /// Puts everything on the disk and closes; network file systems report a full disk only here.
  void close();

 private:
  [[noreturn]] void fail(int error_number) const;
  std::filesystem::path path_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

/// Gives a finished file its name, in place of an older one, so that this survives a power failure too. Throws
/// Error(Failure::file).
void put_in_place(const std::filesystem::path& aside, const std::filesystem::path& path);

/// Writes a file so that a reader sees the old one or the new one, never a part: aside, then renamed.
void write_aside(const std::filesystem::path& path, const std::function<void(TextFile&)>& write);
void write_file_atomically(const std::filesystem::path& path, std::string_view text);

}  // namespace carom
