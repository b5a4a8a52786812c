// SPDX-License-Identifier: BSD-3-Clause
#include "io/files/journal.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <new>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "engine/base/error.h"
#include "io/files/descriptor.h"
#include "io/files/journal_blocks.h"
#include "io/files/text_file.h"

namespace carom::hdf5 {

namespace {

std::filesystem::path journal_of(const std::filesystem::path& file) { return behind_links(file) += ".journal"; }

/// Repeats a system call that a signal has interrupted.
template <class Call>
auto uninterrupted(Call call) {
  auto result = call();
  while (result < 0 && errno == EINTR) result = call();
  return result;
}

/// Writes all bytes; returns false if that failed, with the reason in errno.
bool write_all(int descriptor, const std::byte* data, std::size_t size, std::uint64_t at) {
  while (size > 0) {
    const ssize_t n = uninterrupted(
        [&] { return ::pwrite(descriptor, data, std::min(size, kLargestWrite), static_cast<off_t>(at)); });
    if (n == 0) errno = ENOSPC;
    if (n <= 0) return false;
    data += n;
    at += static_cast<std::uint64_t>(n);
    size -= static_cast<std::size_t>(n);
  }
  return true;
}

/// Reads up to `size` bytes; returns how many were read.
std::optional<std::size_t> read_up_to(int descriptor, std::byte* data, std::size_t size, std::uint64_t at) {
  std::size_t done = 0;
  while (done < size) {
    const ssize_t n =
        uninterrupted([&] { return ::pread(descriptor, data + done, size - done, static_cast<off_t>(at + done)); });
    if (n < 0) return {};
    if (n == 0) break;
    done += static_cast<std::size_t>(n);
  }
  return done;
}

bool resize(int descriptor, std::uint64_t size) {
  return uninterrupted([&] { return ::ftruncate(descriptor, static_cast<off_t>(size)); }) == 0;
}

/// Reserves space on the disk. File systems that cannot reserve space count as having it.
bool set_aside(int descriptor, int mode, std::uint64_t start, std::uint64_t length) {
  const auto call = [&] {
    return ::fallocate(descriptor, mode, static_cast<off_t>(start), static_cast<off_t>(length));
  };
  return length == 0 || uninterrupted(call) == 0 || errno == EOPNOTSUPP || errno == ENOSYS;
}

bool sync(int descriptor) {
  return uninterrupted([&] { return ::fdatasync(descriptor); }) == 0 || errno == EINVAL;
}

/// Acquires a lock; false if another process has it. File systems without locks count as unlocked.
bool lock(int descriptor, int kind) { return ::flock(descriptor, kind | LOCK_NB) == 0 || errno != EWOULDBLOCK; }

/// A file that the driver has open.
struct Journaled : H5FD_t {
  std::filesystem::path path;
  bool is_new = false;  // still called path.part
  int file = -1, journal = -1;
  haddr_t eoa = 0;            // the end of what HDF5 has allocated
  std::uint64_t size = 0;     // size of the file, as HDF5 sees it
  std::uint64_t on_disk = 0;  // size of the file, as the operating system sees it
  std::uint64_t flushed = 0;  // size of the file after the last flush
  Blocks waiting, last;       // to be written by the next flush; written by the last one
  Bytes buffer;               // the journal of the last flush
  // After a failed write nothing more is written: HDF5 can close the file, which then has the state of the last flush,
  // or a complete journal if the copy of the journal to the file failed.
  bool failed = false, torn = false;
  using Clock = std::chrono::steady_clock;
  Clock::time_point next_sync{};

  std::filesystem::path name_now() const {
    std::filesystem::path name = path;
    return is_new ? name += ".part" : name;
  }

  /// Puts the reason on HDF5's error stack.
  herr_t fail() {
    failed = true;
    H5Epush2(H5E_DEFAULT, __FILE__, __func__, __LINE__, H5E_ERR_CLS, H5E_VFL, H5E_WRITEERROR, "%s",
             std::strerror(errno));
    return -1;
  }

  herr_t write(std::uint64_t address, std::size_t length, const std::byte* data) {
    if (failed) return 0;
    const std::size_t old =
        address >= flushed ? 0 : static_cast<std::size_t>(std::min<std::uint64_t>(flushed - address, length));
    if (old > 0) waiting.put(address, {data, old});
    if (old < length && !write_all(file, data + old, length - old, address + old)) return fail();
    size = std::max(size, address + length);
    if (old < length) on_disk = std::max(on_disk, address + length);
    return 0;
  }

  herr_t read(std::uint64_t address, std::size_t length, std::byte* data) {
    const auto n = read_up_to(file, data, length, address);
    if (!n) return fail();
    std::memset(data + *n, 0, length - *n);
    waiting.overlay(address, {data, length});
    return 0;
  }

  herr_t flush() {
    if (failed || (waiting.empty() && size == flushed)) return 0;
    const bool durable = Clock::now() >= next_sync;
    if (size > flushed) {
      if (!set_aside(file, 0, flushed, size - flushed)) return fail();
      on_disk = std::max(on_disk, size);
    }
    if (!waiting.empty() && !write_journal(durable)) return fail();
    torn = true;
    if (!waiting.empty() && !write_blocks(buffer)) return fail();
    if (on_disk != size && !resize(file, size)) return fail();
    const auto start = Clock::now();
    if (durable && !sync(file)) return fail();
    torn = false;
    if (is_new) {
      std::filesystem::remove(journal_of(path));  // left by an older file
      put_in_place(name_now(), path);
      is_new = false;
      if (!open_journal()) return fail();
    } else if (!waiting.empty()) {
      constexpr std::byte kEmptyHead[8] = {};
      if (!write_all(journal, kEmptyHead, sizeof kEmptyHead, 0)) return fail();
    }
    if (durable) next_sync = Clock::now() + 20 * (Clock::now() - start);
    last = std::exchange(waiting, {});
    flushed = on_disk = size;
    return 0;
  }

  bool open_journal() {
    constexpr std::uint64_t kSpareBytes = 1 << 18;  // also for the summary and log of a run that has filled its disk
    journal = ::open(journal_of(path).c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    return journal >= 0 && set_aside(journal, FALLOC_FL_KEEP_SIZE, 0, kSpareBytes);
  }

  bool write_journal(bool durable) {
    if (journal < 0 && !open_journal()) return false;
    buffer = waiting.journal(size, last);
    return write_all(journal, buffer.data(), buffer.size(), 0) && (!durable || (sync(file) && sync(journal)));
  }

  bool write_blocks(const Bytes& blocks) const {
    return for_each_block(blocks, [&](std::uint64_t address, const std::byte* data, std::size_t length) {
      return write_all(file, data, length, address);
    });
  }

  herr_t close() {
    herr_t result = flush();
    if (failed && !torn) resize(file, flushed);  // frees the space after the last flush
    if (!failed && !sync(file)) result = fail();
    std::error_code ignored;
    if (!torn && journal >= 0) std::filesystem::remove(journal_of(path), ignored);
    if (is_new) std::filesystem::remove(name_now(), ignored);
    ::close(file);
    if (journal >= 0) ::close(journal);
    delete this;
    return result;
  }
};

/// Catches exceptions, which must not pass through HDF5: no memory, or a new file that cannot be renamed.
template <class Action>
herr_t guarded(Journaled& file, Action action) {
  try {
    return action();
  } catch (const std::bad_alloc&) {
    errno = ENOMEM;
  } catch (const std::exception&) {
  }
  return file.fail();
}

Journaled& of(H5FD_t* file) { return *static_cast<Journaled*>(file); }
const Journaled& of(const H5FD_t* file) { return *static_cast<const Journaled*>(file); }

H5FD_t* open_file(const char* name, unsigned flags, hid_t, haddr_t) {
  auto* file = new Journaled{};
  file->path = behind_links(name);
  file->is_new = (flags & H5F_ACC_CREAT) != 0;
  struct stat status {};
  file->file = ::open(file->name_now().c_str(), O_RDWR | O_CLOEXEC | (file->is_new ? O_CREAT | O_TRUNC : 0), 0666);
  if (file->file >= 0 && lock(file->file, LOCK_EX) && ::fstat(file->file, &status) == 0) {
    file->size = file->on_disk = file->flushed = static_cast<std::uint64_t>(status.st_size);
    return file;
  }
  file->fail();
  if (file->file >= 0) ::close(file->file);
  delete file;
  return nullptr;
}

herr_t query(const H5FD_t*, unsigned long* flags) {  // the flags of the library's own driver for regular files
  *flags = H5FD_FEAT_AGGREGATE_METADATA | H5FD_FEAT_ACCUMULATE_METADATA | H5FD_FEAT_DATA_SIEVE |
           H5FD_FEAT_AGGREGATE_SMALLDATA | H5FD_FEAT_DEFAULT_VFD_COMPATIBLE;
  return 0;
}

H5FD_class_t driver_class() {
  H5FD_class_t driver{};
  driver.name = "carom.journal";
  driver.maxaddr = (haddr_t{1} << 63) - 1;
  driver.fc_degree = H5F_CLOSE_STRONG;  // closing a file closes all objects in it, so that it is really closed
  driver.open = open_file;
  driver.close = [](H5FD_t* file) { return of(file).close(); };
  driver.query = query;
  driver.get_eoa = [](const H5FD_t* file, H5FD_mem_t) { return of(file).eoa; };
  driver.set_eoa = [](H5FD_t* file, H5FD_mem_t, haddr_t address) -> herr_t {
    of(file).eoa = address;
    return 0;
  };
  driver.get_eof = [](const H5FD_t* file, H5FD_mem_t) -> haddr_t { return of(file).size; };
  driver.read = [](H5FD_t* file, H5FD_mem_t, hid_t, haddr_t address, size_t size, void* data) {
    return of(file).read(address, size, static_cast<std::byte*>(data));
  };
  driver.write = [](H5FD_t* file, H5FD_mem_t, hid_t, haddr_t address, size_t size, const void* data) {
    return guarded(of(file), [&] { return of(file).write(address, size, static_cast<const std::byte*>(data)); });
  };
  driver.flush = [](H5FD_t* file, hid_t, hbool_t closing) -> herr_t {
    Journaled& f = of(file);
    if (f.failed) return closing ? 0 : -1;
    return guarded(f, [&] { return f.flush(); });
  };
  driver.truncate = [](H5FD_t* file, hid_t, hbool_t) -> herr_t {
    of(file).size = of(file).eoa;
    return 0;
  };
  const H5FD_mem_t one_list_for_each[] = H5FD_FLMAP_DICHOTOMY;
  std::copy(std::begin(one_list_for_each), std::end(one_list_for_each), driver.fl_map);
  return driver;
}

}  // namespace

hid_t journal_driver() {
  static const H5FD_class_t driver = driver_class();
  static const hid_t id = H5FDregister(&driver);
  return id;
}

void replay_journal(const std::filesystem::path& path) {
  const std::filesystem::path beside = journal_of(path);
  const auto fail = [&](const std::string& why) {
    throw Error(Failure::file, path.string() + ": cannot take over what is in " + beside.string() + ": " + why);
  };
  Descriptor file(::open(path.c_str(), O_RDWR | O_CLOEXEC));
  const int not_writable = file.is_open() ? 0 : errno;
  if (not_writable != 0) file = Descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!file.is_open()) return;  // opening the file itself reports the reason
  if (!lock(file.number(), LOCK_SH))
    throw Error(
        Failure::file,
        path.string() + ": a process is writing this file; wait for its end, or read it by Python's carom.open()");
  const Descriptor journal(::open(beside.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat status {};
  if (!journal.is_open() || ::fstat(journal.number(), &status) != 0) return;
  Bytes blocks(static_cast<std::size_t>(status.st_size));
  if (!read_up_to(journal.number(), blocks.data(), blocks.size(), 0)) fail(std::strerror(errno));
  if (const auto size = complete_journal(blocks)) {
    if (not_writable != 0) fail(std::strerror(not_writable));
    if (!lock(file.number(), LOCK_EX)) fail("another process is reading the file; wait for its end");
    const auto write = [&](std::uint64_t address, const std::byte* data, std::size_t length) {
      return write_all(file.number(), data, length, address);
    };
    if (!for_each_block(blocks, write) || !resize(file.number(), *size) || !sync(file.number()))
      fail(std::string(std::strerror(errno)) + "; check free space and permissions there");
  }
  ::unlink(beside.c_str());
}

void read_between_flushes(const std::filesystem::path& path, const std::function<void()>& read) {
  // The head of the journal changes with each flush, and begins with zeros except during a flush.
  using Head = std::array<std::byte, kJournalHead>;
  const auto head = [&] {
    Head bytes{};
    if (const Descriptor journal(::open(journal_of(path).c_str(), O_RDONLY | O_CLOEXEC)); journal.is_open())
      static_cast<void>(read_up_to(journal.number(), bytes.data(), bytes.size(), 0));
    return bytes;
  };
  const auto within_a_flush = [](const Head& bytes) { return bytes[0] != std::byte{0}; };
  const auto last_try = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (true) {
    const bool last = std::chrono::steady_clock::now() > last_try;
    const Head before = head();
    if (within_a_flush(before)) {
      try {
        replay_journal(path);
      } catch (const Error&) {
        if (last) throw;
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
      }
      continue;
    }
    try {
      read();
      if (head() == before) return;
    } catch (const std::exception&) {
      if (head() == before) throw;
    }
    if (last)
      throw Error(Failure::file, path.string() + ": flushes come faster than it can be read; write fewer frames");
  }
}

}  // namespace carom::hdf5
