// SPDX-License-Identifier: BSD-3-Clause
#include <libdeflate.h>

#include <algorithm>
#include <numeric>

#include "engine/base/error.h"
#include "io/files/hdf5.h"

namespace carom::hdf5 {

namespace {

Handle open_set(const File& file, const std::string& name) {
  return {file.check(H5Dopen2(file.id(), name.c_str(), H5P_DEFAULT), "read data set " + name), H5Dclose};
}

std::vector<hsize_t> shape_of_space(hid_t space) {
  std::vector<hsize_t> size(static_cast<std::size_t>(std::max(0, H5Sget_simple_extent_ndims(space))));
  H5Sget_simple_extent_dims(space, size.data(), nullptr);
  return size;
}

hsize_t product(const std::vector<hsize_t>& shape) {
  return std::accumulate(shape.begin(), shape.end(), hsize_t{1}, std::multiplies<>());
}

[[noreturn]] void refuse(const File& file, const std::string& what) {
  throw Error(Failure::file, file.path().string() + ": " + what);
}

void expect_axes(const File& file, const std::string& name, std::size_t found, std::size_t axes) {
  if (found != axes) refuse(file, name + " has " + std::to_string(found) + " axes, not " + std::to_string(axes));
}

/// The number of elements of a data set or attribute, each of the given size in the file. Throws if the file cannot
/// hold them: a damaged file may claim any number.
std::size_t elements_of(const File& file, const std::string& name, const Handle& space, std::size_t bytes) {
  const std::vector<hsize_t> shape = shape_of_space(space.id());
  const hsize_t elements = product(shape);
  if (std::find(shape.begin(), shape.end(), 0) != shape.end()) return 0;
  hsize_t size = 0;  // size of the open file; its name may belong to another checkpoint meanwhile
  file.check(H5Fget_filesize(file.id(), &size), "measure");
  hsize_t room = bytes == 0 ? 0 : size / bytes;
  for (const hsize_t n : shape) room /= n;
  if (room == 0) refuse(file, name + " claims to be larger than the file; the file is damaged");
  return elements;
}

Handle open_attribute(const File& file, const std::string& object, const std::string& name) {
  return {file.check(H5Aopen_by_name(file.id(), object.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT),
                     "read attribute " + name + " of " + object),
          H5Aclose};
}

double one_number(const File& file, const std::string& name, const Handle& set, const Handle& space,
                  const std::vector<hsize_t>& at) {
  const hsize_t one = 1;
  const Handle memory(H5Screate_simple(1, &one, nullptr), H5Sclose);
  const std::vector<hsize_t> count(at.size(), 1);
  if (!at.empty())
    file.check(H5Sselect_hyperslab(space.id(), H5S_SELECT_SET, at.data(), nullptr, count.data(), nullptr),
               "read " + name);
  double value = 0;
  file.check(H5Dread(set.id(), H5T_NATIVE_DOUBLE, memory.id(), space.id(), H5P_DEFAULT, &value), "read " + name);
  return value;
}

/// Texts of fixed length, as `read` fills them into a buffer.
template <class Read>
std::vector<std::string> fixed_texts(const File& file, const std::string& name, const Handle& type, const Handle& space,
                                     Read&& read) {
  if (H5Tget_class(type.id()) != H5T_STRING || H5Tis_variable_str(type.id()) > 0)
    refuse(file, name + " is not a text of fixed length");
  const std::size_t width = H5Tget_size(type.id()), count = elements_of(file, name, space, width);
  std::string all(width * count, '\0');
  file.check(read(all.data()), "read " + name);
  std::vector<std::string> texts;
  for (auto start = all.begin(); start != all.end(); start += static_cast<std::ptrdiff_t>(width))
    texts.emplace_back(start, std::find(start, start + static_cast<std::ptrdiff_t>(width), '\0'));
  return texts;
}

}  // namespace

bool exists(const File& file, const std::string& path) {
  for (std::size_t slash = path.find('/', 1);; slash = path.find('/', slash + 1)) {
    if (H5Lexists(file.id(), path.substr(0, slash).c_str(), H5P_DEFAULT) <= 0) return false;
    if (slash == std::string::npos) return true;
  }
}

std::vector<hsize_t> shape(const File& file, const std::string& dataset) {
  const Handle set = open_set(file, dataset);
  const Handle space(H5Dget_space(set.id()), H5Sclose);
  return shape_of_space(space.id());
}

std::vector<hsize_t> shape(const File& file, const std::string& dataset, std::size_t axes) {
  auto found = shape(file, dataset);
  expect_axes(file, dataset, found.size(), axes);
  return found;
}

double number_at(const File& file, const std::string& dataset, hsize_t index) {
  const Handle set = open_set(file, dataset);
  const Handle space(H5Dget_space(set.id()), H5Sclose);
  const std::vector<hsize_t> at(shape_of_space(space.id()).size(), index);
  return one_number(file, dataset, set, space, at);
}

double diagonal_at(const File& file, const std::string& dataset, hsize_t row, int k) {
  const Handle set = open_set(file, dataset);
  const Handle space(H5Dget_space(set.id()), H5Sclose);
  expect_axes(file, dataset, shape_of_space(space.id()).size(), 3);
  const auto axis = static_cast<hsize_t>(k);
  return one_number(file, dataset, set, space, {row, axis, axis});
}

template <class T>
std::vector<T> numbers(const File& file, const std::string& dataset) {
  const Handle set = open_set(file, dataset);
  const Handle space(H5Dget_space(set.id()), H5Sclose);
  std::vector<T> all(elements_of(file, dataset, space, 1));
  if (!all.empty())
    file.check(H5Dread(set.id(), native_type<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, all.data()), "read " + dataset);
  return all;
}
template std::vector<double> numbers(const File&, const std::string&);
template std::vector<std::int32_t> numbers(const File&, const std::string&);
template std::vector<std::uint32_t> numbers(const File&, const std::string&);

template <class T>
std::vector<T> rows(const File& file, const std::string& dataset, hsize_t first, hsize_t n, hsize_t most,
                    hsize_t column) {
  const Handle set = open_set(file, dataset);
  const Handle space(H5Dget_space(set.id()), H5Sclose);
  std::vector<hsize_t> count = shape_of_space(space.id()), start(count.size(), 0);
  if (count.empty() || n > count[0] || first > count[0] - n)
    throw Error(Failure::file, file.path().string() + ": " + dataset + " is shorter than the other data sets");
  start[0] = first;
  count[0] = n;
  if (count.size() > 1) {
    start[1] = std::min(count[1], column);
    count[1] = std::min(count[1] - start[1], most);
  }
  std::vector<T> values(product(count));
  if (values.empty()) return values;
  const Handle memory(H5Screate_simple(static_cast<int>(count.size()), count.data(), nullptr), H5Sclose);
  H5Sselect_hyperslab(space.id(), H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr);
  file.check(H5Dread(set.id(), native_type<T>(), memory.id(), space.id(), H5P_DEFAULT, values.data()),
             "read " + dataset);
  return values;
}
template std::vector<float> rows(const File&, const std::string&, hsize_t, hsize_t, hsize_t, hsize_t);
template std::vector<double> rows(const File&, const std::string&, hsize_t, hsize_t, hsize_t, hsize_t);
template std::vector<std::int32_t> rows(const File&, const std::string&, hsize_t, hsize_t, hsize_t, hsize_t);
template std::vector<std::uint32_t> rows(const File&, const std::string&, hsize_t, hsize_t, hsize_t, hsize_t);

std::vector<std::byte> bytes(const File& file, const std::string& dataset) {
  const Handle set = open_set(file, dataset);
  const Handle type(H5Dget_type(set.id()), H5Tclose);
  const Handle space(H5Dget_space(set.id()), H5Sclose);
  if (const H5T_class_t kind = H5Tget_class(type.id()); kind != H5T_INTEGER && kind != H5T_FLOAT)
    refuse(file, dataset + " holds no numbers");
  const std::size_t size = H5Tget_size(type.id());
  std::vector<std::byte> all(elements_of(file, dataset, space, size) * size);
  if (!all.empty())
    file.check(H5Dread(set.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, all.data()), "read " + dataset);
  return all;
}

std::string text(const File& file, const std::string& dataset) {
  const auto all = texts(file, dataset);
  if (all.empty()) refuse(file, dataset + " is empty");
  return all[0];
}

std::vector<std::string> texts(const File& file, const std::string& dataset) {
  const Handle set = open_set(file, dataset);
  const Handle type(H5Dget_type(set.id()), H5Tclose);
  const Handle space(H5Dget_space(set.id()), H5Sclose);
  return fixed_texts(file, dataset, type, space,
                     [&](void* buffer) { return H5Dread(set.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, buffer); });
}

std::vector<std::string> attribute_texts(const File& file, const std::string& object, const std::string& name) {
  const Handle attribute = open_attribute(file, object, name);
  const Handle type(H5Aget_type(attribute.id()), H5Tclose);
  const Handle space(H5Aget_space(attribute.id()), H5Sclose);
  return fixed_texts(file, object + "@" + name, type, space,
                     [&](void* buffer) { return H5Aread(attribute.id(), type.id(), buffer); });
}

std::vector<std::int32_t> attribute_numbers(const File& file, const std::string& object, const std::string& name,
                                            std::size_t count) {
  const Handle attribute = open_attribute(file, object, name);
  const Handle space(H5Aget_space(attribute.id()), H5Sclose);
  std::vector<std::int32_t> numbers(elements_of(file, object + "@" + name, space, 1));
  if (numbers.size() < count)
    refuse(file,
           object + "@" + name + " has " + std::to_string(numbers.size()) + " numbers, not " + std::to_string(count));
  file.check(H5Aread(attribute.id(), H5T_NATIVE_INT32, numbers.data()), "read attribute " + name);
  return numbers;
}

FileMark mark(const File& file, std::span<const char* const> datasets, hsize_t length) {
  constexpr hsize_t kMostSummedEntries = 1000;  // entries of a row
  const std::string deck = text(file, "parameters/deck");
  std::uint32_t sum = libdeflate_crc32(0, deck.data(), deck.size());
  for (const char* name : datasets) {
    if (length == 0) continue;
    const auto row = rows<double>(file, name, length - 1, 1, kMostSummedEntries);
    sum = libdeflate_crc32(sum, row.data(), row.size() * sizeof(double));
  }
  return {length, sum};
}

void check_rows(const std::filesystem::path& path, std::span<const char* const> datasets, const FileMark& then) {
  if (!std::filesystem::is_regular_file(path))
    refuse_to_go_on(path, std::filesystem::exists(path) ? "is not a file" : "is missing");
  FileMark now;
  try {
    const File file = File::open(path);
    now.length = shape(file, datasets[0]).at(0);
    if (now.length >= then.length) now = mark(file, datasets, then.length);
  } catch (const Error& e) {
    refuse_to_go_on(path,
                    std::string(e.what()).substr(path.string().size() + 2));  // without the file name at its beginning
  }
  if (now.length < then.length)
    refuse_to_go_on(path, "has " + std::to_string(now.length) + " rows, and had " + std::to_string(then.length) +
                              " at the checkpoint");
  if (now.sum != then.sum)
    refuse_to_go_on(path, "is the file of another run, or was changed: its deck or row " + std::to_string(then.length) +
                              " is not the one that it had at the checkpoint");
}

}  // namespace carom::hdf5
