#pragma once
// A text file written piece by piece, each piece handed to the operating system at once and checked.
//
// What has been appended survives the end of the process. A piece goes in as a whole or not at all: if the disk fills
// up in the middle of one, its beginning is taken back. All failures throw Error(Failure::file) with the file's name.

#include <filesystem>
#include <string_view>

namespace carom {

class TextFile {
 public:
  /// A new, empty file.
  explicit TextFile(std::filesystem::path path);
  ~TextFile();
  TextFile(const TextFile&) = delete;
  TextFile& operator=(const TextFile&) = delete;

  void append(std::string_view piece);
  /// Puts everything on the disk and closes; network file systems report a full disk only here.
  void close();

 private:
  [[noreturn]] void fail(int error_number) const;
  std::filesystem::path path_;
  int descriptor_ = -1;
};

/// Writes a whole file so that a reader sees the old one or the new one, never a part: aside, then renamed.
void write_file_atomically(const std::filesystem::path& path, std::string_view text);

}  // namespace carom
