// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// checkpoint.h5: the state of a run, from which `carom run --continue` continues bit for bit.
//
// A checkpoint is written under another name, synced, and renamed; the previous one stays as checkpoint.previous.h5. So
// one good checkpoint remains whenever a run is killed. The file is HDF5 behind a block of 512 bytes, which says the
// format, the length and the CRC-32 of all that follows; a file that does not match them is not used.
//
//   /origin/deck          the deck as resolved, TOML
//   /origin/head          the rest of CheckpointHead, as bytes (engine/base/archive.h)
//   /particles/NAME       a field of particles, in the order of ids (engine/base/fields.h)
//   /run/NAME             a value of the run as a whole, as bytes

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "engine/run/state.h"
#include "io/files/run_files.h"

namespace carom {

namespace hdf5 {
class File;
}

/// The contents of a checkpoint besides the state.
struct CheckpointHead {
  std::string deck;        ///< as resolved, TOML
  std::string deck_file;   ///< the deck file that the run was started with
  std::string version;     ///< version of the program that wrote it
  std::string integrator;  ///< its name
  std::int32_t dimension = 0;
  std::uint64_t particles = 0;
  std::int64_t step = 0;  ///< slabs completed
  double time = 0;        ///< simulated time of the last slab's end
  FileMarks files{};      ///< positions in the files of the run
  FileMark log{};
  std::uint64_t log_rows = 0;
  std::vector<PairList>
      bonds;  ///< for each interaction that finds its bonds in the initial state, in the order of the deck
  std::vector<std::string> warnings;  ///< warnings of the deck when the run began
  std::string branched_from;          ///< the checkpoint that a branch started from; else empty

  void archive(Archive& archive) {
    archive(deck_file, version, integrator, dimension, particles, step, time, files, log, log_rows, bonds, warnings,
            branched_from);
  }
};

/// Writes the state of the run to the directory, with the head of rank 0. To be called in
/// Simulation::Hooks::should_stop. Throws Error(Failure::file); the earlier checkpoints then stay. Collective.
template <int D>
void write_checkpoint(const std::filesystem::path& directory, CheckpointHead head, System<D>& system);

class Checkpoint {
 public:
  /// Throws Error(Failure::file) with the reason if the file cannot be used.
  explicit Checkpoint(const std::filesystem::path& file);
  Checkpoint(Checkpoint&&) noexcept;
  ~Checkpoint();

  const std::filesystem::path& file() const { return path_; }
  const CheckpointHead& head() const { return head_; }
  /// Whether there is a field or a value of this name.
  bool has(const std::string& name) const;
  /// A field, or a value of the run as a whole. Throws Error(Failure::file) if it is missing.
  Bytes read(const std::string& name) const;

 private:
  std::filesystem::path path_;
  std::unique_ptr<hdf5::File> contents_;
  CheckpointHead head_;
};

/// The last good checkpoint in a directory; `warning` says what is wrong with a later one. Throws Error(Failure::file)
/// if there is no good one.
Checkpoint last_checkpoint(const std::filesystem::path& directory, std::string& warning);

/// Whether a file begins like a checkpoint.
bool is_checkpoint(const std::filesystem::path& file);

}  // namespace carom
