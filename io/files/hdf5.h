// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A thin layer over the HDF5 C library: identifiers that close themselves, errors with their cause, data sets that grow
// row by row.
//
//   hdf5::File file = hdf5::File::create("a.h5");
//   hdf5::Handle group = file.group("observables");
//   hdf5::Series<double> energy(file, group, "energy");
//   energy.append(std::array{1.5});
//   file.flush();
//
// Every failure throws Error(Failure::file) that names the file and holds the reason from HDF5's error stack.
//
// Writes go through a journal (journal.h): whenever the process ends, the file has the state of a flush.

#include <hdf5.h>

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "io/files/file_mark.h"

namespace carom::hdf5 {

/// Starts the library: no printing to stderr, no work of its own when the process ends. To be called before MPI starts:
/// otherwise HDF5 closes all files again in MPI_Finalize, and crashes there if a file could not be written.
void start_library();

/// Owns one identifier, closed by the function that belongs to its kind.
class Handle {
 public:
  using Close = herr_t (*)(hid_t);
  Handle() = default;
  Handle(hid_t id, Close close) : id_(id), close_(close) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_(other.close_) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  hid_t id() const { return id_; }
  /// Gives the identifier up: the caller closes it.
  hid_t release() { return std::exchange(id_, H5I_INVALID_HID); }

 private:
  hid_t id_ = H5I_INVALID_HID;
  Close close_ = nullptr;
};

/// The HDF5 type of a C++ number.
template <class T>
hid_t native_type() {
  if constexpr (std::is_same_v<T, double>) return H5T_NATIVE_DOUBLE;
  if constexpr (std::is_same_v<T, float>) return H5T_NATIVE_FLOAT;
  if constexpr (std::is_same_v<T, std::uint8_t>) return H5T_NATIVE_UINT8;
  if constexpr (std::is_same_v<T, std::int32_t>) return H5T_NATIVE_INT32;
  if constexpr (std::is_same_v<T, std::uint32_t>) return H5T_NATIVE_UINT32;
  if constexpr (std::is_same_v<T, std::int64_t>) return H5T_NATIVE_INT64;
  if constexpr (std::is_same_v<T, std::uint64_t>) return H5T_NATIVE_UINT64;
}

/// A file of HDF5, written by this process alone.
class File {
 public:
  /// A new, empty file, which replaces an existing file of that name.
  static File create(const std::filesystem::path& path);
  /// A new file without a journal, after a user block of `block` bytes; to be renamed once it is closed.
  static File create_plain(const std::filesystem::path& path, std::uint64_t block);
  /// An existing file, to be changed; its groups and series are opened where they would be created.
  static File append(const std::filesystem::path& path);
  /// An existing file, to be read.
  static File open(const std::filesystem::path& path);
  /// An existing file, read without locks while another process may be writing it: to be used in read_between_flushes
  /// (journal.h).
  static File open_unlocked(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }
  hid_t id() const { return file_.id(); }

  /// A group; creates it and the groups on its path if they are missing.
  Handle group(const std::string& name);
  /// Throws Error(Failure::file) with the reason from HDF5 if `result` (an identifier or status) is a failure; else
  /// returns it.
  template <class R>
  R check(R result, const std::string& action) const {
    if (result < 0) fail(action);
    return result;
  }
  /// Passes all data to the operating system: they then survive the end of this process.
  void flush();
  /// Flushes and closes the file and every object open in it. The destructor does too, but cannot report errors.
  void close();

  /// Attributes and small data sets of a group or of the file; texts are stored with fixed length.
  void write_attribute(const Handle& where, const std::string& name, const std::string& text);
  void write_attribute(const Handle& where, const std::string& name, const std::vector<std::string>& texts);
  void write_attribute(const Handle& where, const std::string& name, const std::vector<std::int32_t>& numbers);
  void write_attribute(const Handle& where, const std::string& name, std::int32_t number);
  void write_text(const Handle& where, const std::string& name, const std::string& text);
  void write_texts(const Handle& where, const std::string& name, const std::vector<std::string>& texts);
  template <class T>
  void write_number(const Handle& where, const std::string& name, T number) {
    write_array(where, name, native_type<T>(), &number, {});
  }
  void write_array(const Handle& where, const std::string& name, hid_t type, const void* data,
                   const std::vector<hsize_t>& shape);
  /// Writes `count` entries along each axis, from `start` on, of an existing data set.
  void write_part(const Handle& set, hid_t type, const void* data, const std::vector<hsize_t>& start,
                  const std::vector<hsize_t>& count, const std::string& action) const;
  /// A new data set of this shape; if `chunk` gives the shape of its chunks, its first axis can grow. Its creation time
  /// is not stored, so that equal runs write equal bytes.
  Handle create_data_set(const Handle& where, const std::string& name, hid_t type, const std::vector<hsize_t>& shape,
                         const std::vector<hsize_t>& chunk = {}) const;
  /// Makes `alias` a second name of the data set `name`, unless `alias` exists.
  void link(const Handle& from, const std::string& name, const Handle& to, const std::string& alias);

 private:
  static File writable(const std::filesystem::path& path, const char* action,
                       hid_t (*open)(const char* path, hid_t access));
  File(std::filesystem::path path, hid_t id, bool writable)
      : path_(std::move(path)), file_(id, H5Fclose), writable_(writable) {}
  [[noreturn]] void fail(const std::string& action) const;
  void write_attribute(const Handle& where, const std::string& name, hid_t type, const void* data,
                       const std::vector<hsize_t>& shape);

  std::filesystem::path path_;
  Handle file_;
  bool writable_;
};

/// The untyped part of Series.
class SeriesBase {
 public:
  std::uint64_t rows() const { return rows_; }
  /// Keeps the first `rows` rows. Throws Error(Failure::file) if there are fewer.
  void cut(std::uint64_t rows);

 protected:
  SeriesBase(const File& file, const Handle& where, const std::string& name, hid_t type,
             std::vector<hsize_t> row_shape);
  void append(hid_t type, const void* data, std::size_t elements);
  void append_row();
  void drop_row();
  void write_part(hid_t type, const void* data, std::size_t first, std::size_t elements);

 private:
  void extend(std::uint64_t rows);

  std::string label_;  // what is being done, for messages
  const File* file_;
  Handle dataset_;
  std::vector<hsize_t> shape_;  // shape of one row, with a leading axis for the rows
  std::uint64_t row_elements_ = 1, rows_ = 0;
};

/// A data set with a first axis that grows by one or more rows per append. An existing one is opened and continued
/// after its last row. The file must outlive it and not move.
template <class T>
class Series : public SeriesBase {
 public:
  /// `stored`: the type in the file, to which the values are converted.
  Series(const File& file, const Handle& where, const std::string& name, std::vector<hsize_t> row_shape = {},
         hid_t stored = native_type<T>())
      : SeriesBase(file, where, name, stored, std::move(row_shape)) {}
  /// `values`: whole rows, the last axis fastest.
  void append(std::span<const T> values) { SeriesBase::append(native_type<T>(), values.data(), values.size()); }
  void append(T value) { SeriesBase::append(native_type<T>(), &value, 1); }
  /// Writing in parts: appends an empty row, writes into it from index `first` of its first axis on, or drops the row.
  using SeriesBase::append_row;
  using SeriesBase::drop_row;
  void write_part(std::size_t first, std::span<const T> values) {
    SeriesBase::write_part(native_type<T>(), values.data(), first, values.size());
  }
};

/// A data set of a fixed number of values, to be written in parts. The file must outlive it and not move.
template <class T>
class Array {
 public:
  Array(const File& file, const Handle& where, const std::string& name, std::size_t size)
      : file_(file),
        label_("write to data set " + name),
        set_(file.create_data_set(where, name, native_type<T>(), {size})) {}
  void write(std::size_t first, std::span<const T> values) const {
    if (!values.empty()) file_.write_part(set_, native_type<T>(), values.data(), {first}, {values.size()}, label_);
  }

 private:
  const File& file_;
  std::string label_;
  Handle set_;
};

/// Reading; throws Error(Failure::file) if the object is missing, of another kind, or claims more data than the file
/// can hold.
bool exists(const File& file, const std::string& path);
std::vector<hsize_t> shape(const File& file, const std::string& dataset);
std::vector<hsize_t> shape(const File& file, const std::string& dataset, std::size_t axes);
/// Element `index` of a data set with one axis (of a scalar one: 0), as a double.
double number_at(const File& file, const std::string& dataset, hsize_t index);
/// Element [row][k][k] of a data set with three axes.
double diagonal_at(const File& file, const std::string& dataset, hsize_t row, int k);
std::string text(const File& file, const std::string& dataset);
/// All numbers of a data set, the last axis fastest.
template <class T>
std::vector<T> numbers(const File& file, const std::string& dataset);
/// `count` rows of a data set, from row `first` on, the last axis fastest; of the second axis at most `most` entries,
/// from entry `column` on.
template <class T>
std::vector<T> rows(const File& file, const std::string& dataset, hsize_t first, hsize_t count,
                    hsize_t most = HSIZE_UNDEF, hsize_t column = 0);
/// A data set as it is stored.
std::vector<std::byte> bytes(const File& file, const std::string& dataset);
std::vector<std::string> texts(const File& file, const std::string& dataset);
std::vector<std::string> attribute_texts(const File& file, const std::string& object, const std::string& name);
/// The numbers of an attribute, which must have at least `count`.
std::vector<std::int32_t> attribute_numbers(const File& file, const std::string& object, const std::string& name,
                                            std::size_t count);

/// The number of rows of some data sets, and the CRC-32 of the deck and of their last row (of a long row, its
/// beginning).
FileMark mark(const File& file, std::span<const char* const> datasets, hsize_t rows);
/// Throws Error(Failure::file) unless the file is there and its rows begin with those at the mark.
void check_rows(const std::filesystem::path& path, std::span<const char* const> datasets, const FileMark& mark);

}  // namespace carom::hdf5
