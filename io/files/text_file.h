// SPDX-License-Identifier: BSD-3-Clause
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

#include "io/files/file_mark.h"

namespace carom {

class TextFile {
 public:
  /// A new, empty file, or one that was there at the mark, from which it goes on: what is behind the mark is cut off.
  explicit TextFile(std::filesystem::path path, const std::optional<FileMark>& mark = {});
  ~TextFile();
  TextFile(const TextFile&) = delete;
  TextFile& operator=(const TextFile&) = delete;

  void append(std::string_view piece);
  const FileMark& mark() const { return mark_; }
  /// Puts everything on the disk and closes; network file systems report a full disk only here.
  void close();

 private:
  [[noreturn]] void fail(int error_number) const;
  std::filesystem::path path_;
  int descriptor_ = -1;
  FileMark mark_;
};

/// Throws Error(Failure::file) unless the file is there and has, up to the mark, what was written to it.
void check_text(const std::filesystem::path& path, const FileMark& mark);

/// Renames a file; a file or a link of that name is replaced. Throws Error(Failure::file).
void rename_file(const std::filesystem::path& from, const std::filesystem::path& to);

/// Gives a finished file its name, in place of an older one, so that this survives a power failure too. Throws
/// Error(Failure::file).
void put_in_place(const std::filesystem::path& aside, const std::filesystem::path& path);

/// The file that a name stands for: where a chain of symbolic links ends, whether a file is there or not.
std::filesystem::path behind_links(std::filesystem::path path);

/// Whether a name leads to where standard output goes.
bool is_standard_output(const std::filesystem::path& path);

/// Writes a file so that a reader sees the old one or the new one, never a part: aside, then renamed. Where the name is
/// a symbolic link, this happens beside the file that it leads to, and the link stays. What is no file but a pipe or a
/// device is written to.
void write_aside(const std::filesystem::path& path, const std::function<void(TextFile&)>& write);
void write_file_atomically(const std::filesystem::path& path, std::string_view text);

}  // namespace carom
