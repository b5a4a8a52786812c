#include "io/files/hdf5.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <functional>
#include <numeric>

#include "engine/base/error.h"

namespace carom::hdf5 {

namespace {

/// The innermost entry of HDF5's error stack, or the operating system's words in it.
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

/// Has the file system set `length` bytes aside from `start` on, beyond the end of the file; returns 0 or an error
/// number.
int set_aside(int descriptor, std::uint64_t start, std::uint64_t length) {
  rlimit limit{};
  if (getrlimit(RLIMIT_FSIZE, &limit) == 0 && start + length > limit.rlim_cur) return EFBIG;
  if (fallocate(descriptor, FALLOC_FL_KEEP_SIZE, static_cast<off_t>(start), static_cast<off_t>(length)) == 0) return 0;
  if (errno != EOPNOTSUPP && errno != ENOSYS) return errno;
  // A file system that cannot: at least look whether there is room now.
  struct statvfs disk {};
  if (fstatvfs(descriptor, &disk) != 0) return 0;
  return disk.f_bavail * disk.f_frsize < length ? ENOSPC : 0;
}

Handle fixed_text_type(std::size_t length) {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.id(), std::max<std::size_t>(length, 1));
  H5Tset_strpad(type.id(), H5T_STR_NULLPAD);
  return type;
}

Handle space_of(const std::vector<hsize_t>& shape) {
  if (shape.empty()) return Handle(H5Screate(H5S_SCALAR), H5Sclose);
  return Handle(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose);
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

template <>
hid_t native_type<double>() {
  return H5T_NATIVE_DOUBLE;
}
template <>
hid_t native_type<std::uint8_t>() {
  return H5T_NATIVE_UINT8;
}
template <>
hid_t native_type<std::int32_t>() {
  return H5T_NATIVE_INT32;
}
template <>
hid_t native_type<std::uint32_t>() {
  return H5T_NATIVE_UINT32;
}
template <>
hid_t native_type<std::int64_t>() {
  return H5T_NATIVE_INT64;
}
template <>
hid_t native_type<std::uint64_t>() {
  return H5T_NATIVE_UINT64;
}

File File::create(const std::filesystem::path& path) {
  start_library();
  const hid_t id = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  if (id < 0) throw_write_error(path, "create the file", reason());
  return {path, id, true};
}

File File::open(const std::filesystem::path& path) {
  start_library();
  const hid_t id = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  if (id < 0) throw Error(Failure::file, path.string() + ": cannot read it as an HDF5 file: " + reason());
  return {path, id, false};
}

File::~File() { give_back_reserve(); }

void File::fail(const std::string& action) const {
  if (writable_) throw_write_error(path_, action, reason());
  throw Error(Failure::file, path_.string() + ": cannot " + action + ": " + reason());
}

Handle File::group(const std::string& name) {
  const Handle link(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
  H5Pset_create_intermediate_group(link.id(), 1);
  const hid_t id = H5Gcreate2(file_.id(), name.c_str(), link.id(), H5P_DEFAULT, H5P_DEFAULT);
  return {check(id, "create group " + name), H5Gclose};
}

void File::reserve(std::uint64_t bytes) {
  constexpr std::uint64_t kMetadata = 1 << 18;  // chunk indices and headers that a flush may add
  hsize_t size = 0;
  check(H5Fget_filesize(file_.id(), &size), "find the size of the file");
  if (size + bytes + kMetadata <= reserved_until_) return;
  void* descriptor = nullptr;
  check(H5Fget_vfd_handle(file_.id(), H5P_DEFAULT, &descriptor), "find the file's descriptor");
  const std::uint64_t length = bytes + 2 * kMetadata;
  if (const int error = set_aside(*static_cast<int*>(descriptor), size, length); error != 0)
    throw_write_error(path_, "write more", std::strerror(error));
  reserved_until_ = size + length;
}

void File::flush() { check(H5Fflush(file_.id(), H5F_SCOPE_LOCAL), "flush the file"); }

void File::close() {
  flush();
  give_back_reserve();
  file_ = Handle();
}

void File::give_back_reserve() {
  if (file_.id() < 0 || reserved_until_ == 0) return;
  void* descriptor = nullptr;
  hsize_t size = 0;
  if (H5Fflush(file_.id(), H5F_SCOPE_LOCAL) < 0 || H5Fget_vfd_handle(file_.id(), H5P_DEFAULT, &descriptor) < 0 ||
      H5Fget_filesize(file_.id(), &size) < 0)
    return;
  // Room beyond the end is given back by cutting the file to the size it has; no harm if that fails.
  if (ftruncate(*static_cast<int*>(descriptor), static_cast<off_t>(size)) == 0) reserved_until_ = 0;
}

void File::write_array(const Handle& where, const std::string& name, hid_t type, const void* data,
                       const std::vector<hsize_t>& shape) {
  const Handle space = space_of(shape);
  const Handle set(check(H5Dcreate2(where.id(), name.c_str(), type, space.id(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                         "create data set " + name),
                   H5Dclose);
  check(H5Dwrite(set.id(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data), "write data set " + name);
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
  check(H5Lcreate_hard(from.id(), name.c_str(), to.id(), alias.c_str(), H5P_DEFAULT, H5P_DEFAULT), "link " + alias);
}

}  // namespace carom::hdf5
