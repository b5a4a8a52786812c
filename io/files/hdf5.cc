// SPDX-License-Identifier: BSD-3-Clause
#include "io/files/hdf5.h"

#include <algorithm>
#include <functional>
#include <numeric>

#include "engine/base/error.h"
#include "io/files/descriptor.h"
#include "io/files/journal.h"

namespace carom::hdf5 {

namespace {

/// The innermost entry of HDF5's error stack, or the operating system's message in it.
std::string reason() {
  std::string innermost;
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_UPWARD,
      [](unsigned n, const H5E_error2_t* entry, void* out) -> herr_t {
        if (n == 0 && entry->desc != nullptr) *static_cast<std::string*>(out) = entry->desc;
        return 0;
      },
      &innermost);
  H5Eclear2(H5E_DEFAULT);
  const std::string key = "error message = '";
  if (const auto at = innermost.find(key); at != std::string::npos) {
    const auto start = at + key.size();
    return innermost.substr(start, innermost.find('\'', start) - start);
  }
  return innermost.empty() ? "unknown reason" : innermost;
}

[[noreturn]] void throw_write_error(const std::filesystem::path& path, const std::string& action,
                                    const std::string& why) {
  throw Error(Failure::file,
              path.string() + ": cannot " + action + ": " + why +
                  "; check free space, quota and permissions there, or choose another directory with -o");
}

Handle fixed_text_type(std::size_t length) {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.id(), std::max<std::size_t>(length, 1));
  H5Tset_strpad(type.id(), H5T_STR_NULLPAD);
  return type;
}

/// `limit`: the largest shape to which it can grow; empty: fixed.
Handle space_of(const std::vector<hsize_t>& shape, const std::vector<hsize_t>& limit = {}) {
  if (shape.empty()) return Handle(H5Screate(H5S_SCALAR), H5Sclose);
  const hsize_t* most = limit.empty() ? nullptr : limit.data();
  return Handle(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), most), H5Sclose);
}

/// Texts one after the other, padded with zeros to the longest.
std::pair<std::string, std::size_t> packed(const std::vector<std::string>& texts) {
  std::size_t width = 1;
  for (const std::string& t : texts) width = std::max(width, t.size());
  std::string all;
  for (const std::string& t : texts) all.append(t).append(width - t.size(), '\0');
  return {all, width};
}

}  // namespace

void start_library() {
  static const bool once = [] {
    H5dont_atexit();
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    return true;
  }();
  static_cast<void>(once);
}

File File::writable(const std::filesystem::path& path, const char* action,
                    hid_t (*open)(const char* path, hid_t access)) {
  start_library();
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  const bool with_journal = H5Pset_driver(access.id(), journal_driver(), nullptr) >= 0;
  const hid_t id = with_journal ? open(path.c_str(), access.id()) : H5I_INVALID_HID;
  if (id < 0) throw_write_error(path, action, reason());
  return {path, id, true};
}

File File::create(const std::filesystem::path& path) {
  std::error_code ignored;
  if (const auto is = std::filesystem::status(path, ignored); exists(is) && !is_regular_file(is))
    throw Error(Failure::file, path.string() +
                                   ": is a directory, a pipe or a device; an HDF5 file cannot be written there, "
                                   "because it is not written in order; name another file");
  return writable(path, "create the file",
                  [](const char* name, hid_t access) { return H5Fcreate(name, H5F_ACC_TRUNC, H5P_DEFAULT, access); });
}

File File::create_plain(const std::filesystem::path& path, std::uint64_t block) {
  start_library();
  const Handle creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
  H5Pset_userblock(creation.id(), block);
  const hid_t id = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, creation.id(), H5P_DEFAULT);
  if (id < 0) throw_write_error(path, "create the file", reason());
  return {path, id, true};
}

File File::append(const std::filesystem::path& path) {
  replay_journal(path);
  return writable(path, "open the file",
                  [](const char* name, hid_t access) { return H5Fopen(name, H5F_ACC_RDWR, access); });
}

File File::open(const std::filesystem::path& path) {
  start_library();
  replay_journal(path);
  const hid_t id = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  if (id < 0) throw Error(Failure::file, path.string() + ": cannot read it as an HDF5 file: " + reason());
  return {path, id, false};
}

File File::open_unlocked(const std::filesystem::path& path) {
  start_library();
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_file_locking(access.id(), 0, 1);
  const hid_t id = H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.id());
  if (id < 0) throw Error(Failure::file, path.string() + ": cannot read it as an HDF5 file: " + reason());
  return {path, id, false};
}

void File::fail(const std::string& action) const {
  if (writable_) throw_write_error(path_, action, reason());
  throw Error(Failure::file, path_.string() + ": cannot " + action + ": " + reason());
}

Handle File::group(const std::string& name) {
  if (exists(*this, name))
    return {check(H5Gopen2(file_.id(), name.c_str(), H5P_DEFAULT), "open group " + name), H5Gclose};
  const Handle link(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
  H5Pset_create_intermediate_group(link.id(), 1);
  const hid_t id = H5Gcreate2(file_.id(), name.c_str(), link.id(), H5P_DEFAULT, H5P_DEFAULT);
  return {check(id, "create group " + name), H5Gclose};
}

void File::flush() { check(H5Fflush(file_.id(), H5F_SCOPE_LOCAL), "flush the file"); }

void File::close() {
  try {
    flush();
  } catch (const Error&) {  // closed anyway, to free the space of what could not be written
    H5Fclose(file_.release());
    throw;
  }
  check(H5Fclose(file_.release()), "close the file");
}

Handle File::create_data_set(const Handle& where, const std::string& name, hid_t type,
                             const std::vector<hsize_t>& shape, const std::vector<hsize_t>& chunk) const {
  std::vector<hsize_t> limit;
  const Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_obj_track_times(creation.id(), false);
  if (!chunk.empty()) {
    limit = shape;
    limit[0] = H5S_UNLIMITED;
    H5Pset_chunk(creation.id(), static_cast<int>(chunk.size()), chunk.data());
  }
  const Handle space = space_of(shape, limit);
  const hid_t id = H5Dcreate2(where.id(), name.c_str(), type, space.id(), H5P_DEFAULT, creation.id(), H5P_DEFAULT);
  return {check(id, "create data set " + name), H5Dclose};
}

void File::write_array(const Handle& where, const std::string& name, hid_t type, const void* data,
                       const std::vector<hsize_t>& shape) {
  const Handle set = create_data_set(where, name, type, shape);
  const std::string action = "write data set " + name;
  if (shape.empty()) {
    check(H5Dwrite(set.id(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data), action);
    return;
  }
  const hsize_t row = std::accumulate(shape.begin() + 1, shape.end(), H5Tget_size(type), std::multiplies<>());
  const hsize_t most = std::max<hsize_t>(kLargestWrite / std::max<hsize_t>(row, 1), 1);
  std::vector<hsize_t> start(shape.size(), 0), count = shape;
  for (; start[0] < shape[0]; start[0] += most) {
    count[0] = std::min(most, shape[0] - start[0]);
    write_part(set, type, static_cast<const std::byte*>(data) + start[0] * row, start, count, action);
  }
}

void File::write_part(const Handle& set, hid_t type, const void* data, const std::vector<hsize_t>& start,
                      const std::vector<hsize_t>& count, const std::string& action) const {
  const Handle in_file(H5Dget_space(set.id()), H5Sclose), in_memory = space_of(count);
  H5Sselect_hyperslab(in_file.id(), H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr);
  check(H5Dwrite(set.id(), type, in_memory.id(), in_file.id(), H5P_DEFAULT, data), action);
}

void File::write_attribute(const Handle& where, const std::string& name, hid_t type, const void* data,
                           const std::vector<hsize_t>& shape) {
  const Handle space = space_of(shape);
  const Handle attribute(check(H5Acreate2(where.id(), name.c_str(), type, space.id(), H5P_DEFAULT, H5P_DEFAULT),
                               "create attribute " + name),
                         H5Aclose);
  check(H5Awrite(attribute.id(), type, data), "write attribute " + name);
}

void File::write_attribute(const Handle& where, const std::string& name, const std::string& text) {
  write_attribute(where, name, fixed_text_type(text.size()).id(), packed({text}).first.data(), {});
}

void File::write_attribute(const Handle& where, const std::string& name, const std::vector<std::string>& texts) {
  const auto [all, width] = packed(texts);
  write_attribute(where, name, fixed_text_type(width).id(), all.data(), {texts.size()});
}

void File::write_attribute(const Handle& where, const std::string& name, const std::vector<std::int32_t>& numbers) {
  write_attribute(where, name, H5T_NATIVE_INT32, numbers.data(), {numbers.size()});
}

void File::write_attribute(const Handle& where, const std::string& name, std::int32_t number) {
  write_attribute(where, name, H5T_NATIVE_INT32, &number, {});
}

void File::write_text(const Handle& where, const std::string& name, const std::string& text) {
  write_array(where, name, fixed_text_type(text.size()).id(), packed({text}).first.data(), {});
}

void File::write_texts(const Handle& where, const std::string& name, const std::vector<std::string>& texts) {
  const auto [all, width] = packed(texts);
  write_array(where, name, fixed_text_type(width).id(), all.data(), {texts.size()});
}

void File::link(const Handle& from, const std::string& name, const Handle& to, const std::string& alias) {
  if (H5Lexists(to.id(), alias.c_str(), H5P_DEFAULT) > 0) return;
  check(H5Lcreate_hard(from.id(), name.c_str(), to.id(), alias.c_str(), H5P_DEFAULT, H5P_DEFAULT), "link " + alias);
}

}  // namespace carom::hdf5
