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
    throw Error(Failure::file, file.path().string() + ": " + name + " is not a text of fixed length");
  const std::size_t width = H5Tget_size(type.id()), count = product(shape_of_space(space.id()));
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

double number_at(const File& file, const std::string& dataset, hsize_t index) {
  const Handle set = open_set(file, dataset);
  const Handle space(H5Dget_space(set.id()), H5Sclose);
  const std::vector<hsize_t> at(shape_of_space(space.id()).size(), index);
  return one_number(file, dataset, set, space, at);
}

double diagonal_at(const File& file, const std::string& dataset, hsize_t row, int k) {
  const Handle set = open_set(file, dataset);
  const Handle space(H5Dget_space(set.id()), H5Sclose);
  const auto axis = static_cast<hsize_t>(k);
  return one_number(file, dataset, set, space, {row, axis, axis});
}

std::vector<std::byte> bytes(const File& file, const std::string& dataset) {
  const Handle set = open_set(file, dataset);
  const Handle type(H5Dget_type(set.id()), H5Tclose);
  const Handle space(H5Dget_space(set.id()), H5Sclose);
  std::vector<std::byte> all(product(shape_of_space(space.id())) * H5Tget_size(type.id()));
  if (!all.empty())
    file.check(H5Dread(set.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, all.data()), "read " + dataset);
  return all;
}

std::string text(const File& file, const std::string& dataset) { return texts(file, dataset).at(0); }

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

std::vector<std::int32_t> attribute_numbers(const File& file, const std::string& object, const std::string& name) {
  const Handle attribute = open_attribute(file, object, name);
  const Handle space(H5Aget_space(attribute.id()), H5Sclose);
  std::vector<std::int32_t> numbers(product(shape_of_space(space.id())));
  file.check(H5Aread(attribute.id(), H5T_NATIVE_INT32, numbers.data()), "read attribute " + name);
  return numbers;
}

}  // namespace carom::hdf5
