// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A text file written piece by piece, each piece passed to the operating system at once and checked.
//
// Appended text survives the end of the process. A piece is written completely or not at all: if the disk fills up in
// the middle of a piece, its beginning is removed. All failures throw Error(Failure::file) with the file's name.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string_view>

#include "io/files/file_mark.h"

namespace carom {

class TextFile {
 public:
  /// A new, empty file; or, with a mark, an existing file, which is cut back to the mark and continued.
  explicit TextFile(std::filesystem::path path, const std::optional<FileMark>& mark = {});
  ~TextFile();
  TextFile(const TextFile&) = delete;
  TextFile& operator=(const TextFile&) = delete;

  void append(std::string_view piece);
  const FileMark& mark() const { return mark_; }
  /// Syncs to the disk and closes; network file systems report a full disk only here.
  void close();

 private:
  [[noreturn]] void fail(int error_number) const;
  std::filesystem::path path_;
  int descriptor_ = -1;
  FileMark mark_;
};

/// Throws Error(Failure::file) unless the file exists and matches the mark.
void check_text(const std::filesystem::path& path, const FileMark& mark);

/// Renames a file; a file or a link of that name is replaced. Throws Error(Failure::file).
void rename_file(const std::filesystem::path& from, const std::filesystem::path& to);

/// Renames a finished file to its final name, replacing an older file, so that the result survives a power failure.
/// Throws Error(Failure::file).
void put_in_place(const std::filesystem::path& aside, const std::filesystem::path& path);

/// The end of a chain of symbolic links, whether or not a file exists there.
std::filesystem::path behind_links(std::filesystem::path path);

/// Whether a path refers to the file of standard output.
bool is_standard_output(const std::filesystem::path& path);

/// Writes a file under another name and renames it, so that a reader sees the old or the new file, never a part. If the
/// path is a symbolic link, the file it points to is replaced, and the link stays. Pipes and devices are written to
/// directly.
void write_aside(const std::filesystem::path& path, const std::function<void(TextFile&)>& write);
void write_file_atomically(const std::filesystem::path& path, std::string_view text);

}  // namespace carom
