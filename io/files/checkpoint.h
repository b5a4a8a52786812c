// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// checkpoint.h5: the state of a run, from which `carom run --continue` goes on with the same bits.
//
// A checkpoint is written aside, synced, and renamed; the one before it stays as checkpoint.previous.h5. So at whatever
// instant a run is killed, one good checkpoint remains. The file is HDF5 behind a block of 512 bytes, which says the
// format, the length and the CRC-32 of all that follows; nothing of a file that does not have them is used.
//
//   /origin/deck          the deck as resolved, TOML
//   /origin/head          the rest of CheckpointHead, as bytes (engine/base/archive.h)
//   /particles/NAME       a field of particles, in the order of ids (engine/base/fields.h)
//   /run/NAME             what there is one of a run, as bytes

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

/// What a checkpoint says beside the state.
struct CheckpointHead {
  std::string deck;        ///< as resolved, TOML
  std::string deck_file;   ///< that the run was started with
  std::string version;     ///< of the program that wrote it
  std::string integrator;  ///< its name
  std::int32_t dimension = 0;
  std::uint64_t particles = 0;
  std::int64_t step = 0;  ///< slabs completed
  double time = 0;        ///< simulated time of the last slab's end
  FileMarks files{};      ///< where the files of the run stood
  FileMark log{};
  std::uint64_t log_rows = 0;
  std::vector<PairList> bonds;        ///< of each interaction that finds them in the initial state, in their order
  std::vector<std::string> warnings;  ///< of the deck, issued when the run began
  std::string branched_from;          ///< the checkpoint that a branch started from; else empty

  void archive(Archive& archive) {
    archive(deck_file, version, integrator, dimension, particles, step, time, files, log, log_rows, bonds, warnings,
            branched_from);
  }
};

/// Writes the state of the run to the directory; the head of rank 0 counts. To be called in
/// Simulation::Hooks::should_stop. Throws Error(Failure::file), and the checkpoints that were there stay. Collective.
template <int D>
void write_checkpoint(const std::filesystem::path& directory, CheckpointHead head, System<D>& system);

class Checkpoint {
 public:
  /// Throws Error(Failure::file) with the reason where it cannot be used.
  explicit Checkpoint(const std::filesystem::path& file);
  Checkpoint(Checkpoint&&) noexcept;
  ~Checkpoint();

  const std::filesystem::path& file() const { return path_; }
  const CheckpointHead& head() const { return head_; }
  /// A field or what there is one of a run. Throws Error(Failure::file) where it is missing.
  Bytes read(const std::string& name) const;

 private:
  std::filesystem::path path_;
  std::unique_ptr<hdf5::File> contents_;
  CheckpointHead head_;
};

/// The last good checkpoint in a directory; `warning` says what is wrong with a later one. Throws Error(Failure::file)
/// where there is none.
Checkpoint last_checkpoint(const std::filesystem::path& directory, std::string& warning);

/// Whether a file begins like a checkpoint.
bool is_checkpoint(const std::filesystem::path& file);

}  // namespace carom
