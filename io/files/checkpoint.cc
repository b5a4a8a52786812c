// SPDX-License-Identifier: BSD-3-Clause
#include "io/files/checkpoint.h"

#include <fcntl.h>
#include <libdeflate.h>
#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <optional>
#include <span>

#include "engine/base/error.h"
#include "io/files/descriptor.h"
#include "io/files/hdf5.h"
#include "io/files/output_directory.h"
#include "io/files/text_file.h"

namespace carom {
namespace {

constexpr std::size_t kHeadBlock = 512;  // before HDF5's own bytes
constexpr int kFormat = 8;
constexpr std::string_view kBegin = "carom checkpoint ";

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& why) {
  throw Error(Failure::file, path.string() + ": " + why);
}

[[noreturn]] void refuse_with_reason(const std::filesystem::path& path) { refuse(path, std::strerror(errno)); }

Descriptor open_file(const std::filesystem::path& path, int flags) {
  Descriptor file(::open(path.c_str(), flags | O_CLOEXEC));
  if (!file.is_open()) refuse_with_reason(path);
  return file;
}

struct Sum {
  std::uint64_t bytes = 0;
  std::uint32_t crc = 0;
};

/// The checksum of everything after the block.
Sum sum_of(const std::filesystem::path& path, const Descriptor& file) {
  Sum sum;
  std::vector<unsigned char> piece(1 << 16);
  for (;;) {
    const ssize_t got = ::pread(file.number(), piece.data(), piece.size(), static_cast<off_t>(kHeadBlock + sum.bytes));
    if (got < 0) refuse_with_reason(path);
    if (got == 0) return sum;
    sum.crc = libdeflate_crc32(sum.crc, piece.data(), static_cast<std::size_t>(got));
    sum.bytes += static_cast<std::uint64_t>(got);
  }
}

std::array<char, kHeadBlock> block_of(const Sum& sum) {
  std::array<char, kHeadBlock> block{};
  fmt::format_to_n(block.data(), kHeadBlock, "{}{}\nbytes {}\ncrc32 {:08x}\n", kBegin, kFormat, sum.bytes, sum.crc);
  return block;
}

/// Throws unless the block matches the contents that follow it.
void verify(const std::filesystem::path& path) {
  const Descriptor file = open_file(path, O_RDONLY);
  std::array<char, kHeadBlock> block{};
  const ssize_t got = ::pread(file.number(), block.data(), kHeadBlock, 0);
  if (got < 0) refuse_with_reason(path);
  const std::string_view text(block.data(), static_cast<std::size_t>(got));
  if (!text.starts_with(kBegin)) refuse(path, "not a checkpoint of carom");
  int format = 0;
  if (std::sscanf(block.data() + kBegin.size(), "%d", &format) == 1 && format != kFormat)
    refuse(path, fmt::format("a checkpoint of format {}, written by {} carom; this one reads format {}", format,
                             format > kFormat ? "a newer" : "an older", kFormat));
  if (static_cast<std::size_t>(got) < kHeadBlock || block != block_of(sum_of(path, file)))
    refuse(path, "the checkpoint is damaged or cut off: its checksum is not that of its contents");
}

hid_t type_of(Fields::Scalar scalar) {
  switch (scalar) {
    case Fields::Scalar::float64:
      return H5T_NATIVE_DOUBLE;
    case Fields::Scalar::int32:
      return H5T_NATIVE_INT32;
    case Fields::Scalar::uint32:
      return H5T_NATIVE_UINT32;
    case Fields::Scalar::uint16:
      return H5T_NATIVE_UINT16;
    case Fields::Scalar::bytes:
      break;
  }
  return H5T_NATIVE_UINT8;
}

/// Signs a complete file and replaces the last checkpoint by it.
void sign_and_rename(const std::filesystem::path& aside, const std::filesystem::path& directory) {
  {
    const Descriptor file = open_file(aside, O_RDWR);
    ::sync_file_range(file.number(), 0, 0, SYNC_FILE_RANGE_WRITE);  // the disk writes while the sum is computed
    const auto block = block_of(sum_of(aside, file));
    if (::pwrite(file.number(), block.data(), kHeadBlock, 0) != static_cast<ssize_t>(kHeadBlock) ||
        ::fsync(file.number()) != 0)
      refuse_with_reason(aside);
  }
  const auto last = directory / run_file::checkpoint;
  if (std::filesystem::exists(last)) rename_file(last, directory / run_file::previous_checkpoint);
  put_in_place(aside, last);
}

}  // namespace

template <int D>
void write_checkpoint(const std::filesystem::path& directory, CheckpointHead head, System<D>& system) {
  const auto aside = directory / (std::string(run_file::checkpoint) + ".part");
  std::optional<hdf5::File> file;
  std::optional<hdf5::Handle> particles, run;
  const auto write = [&](const hdf5::Handle& group, const std::string& name, hid_t type,
                         std::span<const std::byte> bytes, const std::vector<hsize_t>& shape) {
    file->write_array(group, name, type, bytes.data(), shape);
  };
  const StateWriter writer{
      [&](const Fields::Field& field, std::span<const std::byte> bytes) {
        std::vector<hsize_t> shape = {bytes.size() / field.size};
        if (field.columns > 1) shape.push_back(field.columns);
        write(*particles, field.name, type_of(field.scalar), bytes, shape);
      },
      [&](const std::string& name, const Bytes& bytes) { write(*run, name, H5T_NATIVE_UINT8, bytes, {bytes.size()}); }};
  try {
    if (system.decomposition.ranks().rank() == 0) {
      file.emplace(hdf5::File::create_plain(aside, kHeadBlock));
      particles.emplace(file->group("particles"));
      run.emplace(file->group("run"));
      const hdf5::Handle origin = file->group("origin");
      file->write_text(origin, "deck", head.deck);
      Archive archive;
      head.archive(archive);
      write(origin, "head", H5T_NATIVE_UINT8, archive.bytes(), {archive.bytes().size()});
    }
    save_state(system, writer);
    if (!file) return;
    particles.reset();
    run.reset();
    file->close();
    sign_and_rename(aside, directory);
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(aside, ignored);
    throw;
  }
}

template void write_checkpoint(const std::filesystem::path&, CheckpointHead, System<2>&);
template void write_checkpoint(const std::filesystem::path&, CheckpointHead, System<3>&);

Checkpoint::Checkpoint(const std::filesystem::path& file) : path_(file) {
  verify(file);
  contents_ = std::make_unique<hdf5::File>(hdf5::File::open(file));
  Archive archive(hdf5::bytes(*contents_, "/origin/head"));
  head_.archive(archive);
  archive.finish();
  head_.deck = hdf5::text(*contents_, "/origin/deck");
}
Checkpoint::Checkpoint(Checkpoint&&) noexcept = default;
Checkpoint::~Checkpoint() = default;

bool Checkpoint::has(const std::string& name) const {
  return hdf5::exists(*contents_, "/particles/" + name) || hdf5::exists(*contents_, "/run/" + name);
}

Bytes Checkpoint::read(const std::string& name) const {
  for (const char* group : {"/particles/", "/run/"})
    if (hdf5::exists(*contents_, group + name)) return hdf5::bytes(*contents_, group + name);
  refuse(path_, "there is no '" + name + "' in the checkpoint; it was written by another version of carom, or for " +
                    "another deck");
}

Checkpoint last_checkpoint(const std::filesystem::path& directory, std::string& warning) {
  std::string wrong;
  for (const char* name : {run_file::checkpoint, run_file::previous_checkpoint}) {
    if (!std::filesystem::exists(directory / name)) continue;
    try {
      Checkpoint found(directory / name);
      if (!wrong.empty())
        warning = wrong + "; going on from " + std::string(run_file::previous_checkpoint) + ", the one before it";
      return found;
    } catch (const Error& e) {
      wrong += (wrong.empty() ? "" : "\n") + std::string(e.what());
    }
  }
  if (!wrong.empty()) throw Error(Failure::file, wrong);
  refuse(directory, "there is no checkpoint.h5 to go on from; give the directory of a run that was interrupted");
}

bool is_checkpoint(const std::filesystem::path& file) {
  std::array<char, kBegin.size()> begin{};
  const Descriptor descriptor = open_file(file, O_RDONLY);
  return ::pread(descriptor.number(), begin.data(), begin.size(), 0) == static_cast<ssize_t>(begin.size()) &&
         std::string_view(begin.data(), begin.size()) == kBegin;
}

}  // namespace carom
