// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The trajectory: an H5MD 1.1 file with one frame per output time (de Buyl, Colberg, Höfling, Comput. Phys. Commun. 185
// (2014) 1546).
//
//   /particles/trajectory   position, velocity, image (value, step, time); id, species, mass, radius, charge; box
//   /observables            kinetic_energy, …: one value per frame
//   /parameters             deck, title, integrator, dimension, boundary, species
//   /parameters/vmd_structure   what VMD's plugin (github.com/h5md/VMD-h5mdplugin) reads besides: for each species that
//                           occurs indexOfSpecies, name, type, radius (the mean of its particles); bonds by the
//                           numbers of their particles, which count from 1, as bond_from and bond_to
//
// Written so that MDAnalysis 2.4 can read it: three columns also in two dimensions (z = 0, a box edge of 1 and no
// boundary along z; the true dimension and boundaries are in /parameters), box edges at every frame, every `step` and
// `time` explicit and shared by hard links, texts of fixed length, observables without subgroups. Units are reduced:
// there are no `unit` attributes, so readers must be set not to convert; `output.units` names the units of length and
// time. Positions are wrapped; unwrapped position = position + image · edge. Every frame is flushed, so that it
// survives the end of the process (journal.h).
//
// If ranks hold blocks of the particles (engine/ranks/id_blocks.h), rank 0 writes one block after the other as a piece
// of the row, and holds only one at a time. Every other rank has a BlockSender.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "engine/ranks/id_blocks.h"
#include "engine/run/simulation.h"
#include "io/deck/deck.h"
#include "io/files/file_mark.h"

namespace carom {

namespace vmd_structure {
inline const std::string group = "parameters/vmd_structure", bond_from = group + "/bond_from",
                         bond_to = group + "/bond_to";
}  // namespace vmd_structure

/// The data sets that distinguish the frames of two runs.
inline constexpr const char* kFrameRows[] = {"particles/trajectory/position/time",
                                             "particles/trajectory/position/value"};

template <int D>
class TrajectoryWriter : public Observer<D> {
 public:
  /// Creates the file, or opens the file of the same run again and continues from the mark. `system` provides the
  /// constant data (box, masses, radii, charges, species) and the ranks. Throws Error(Failure::file).
  TrajectoryWriter(const std::filesystem::path& path, const Deck& deck, const System<D>& system,
                   const std::optional<FileMark>& mark = {});
  ~TrajectoryWriter() override;

  /// Appends a frame and flushes. Throws Error(Failure::file).
  void frame(const Snapshot<D>& snapshot) override;
  FileMark mark() const;

  /// Flushes and closes. Throws Error(Failure::file).
  void close();

 private:
  struct Contents;
  std::unique_ptr<Contents> contents_;
};

/// Sends the particles of all other ranks to the writer on rank 0.
template <int D>
class BlockSender : public Observer<D> {
 public:
  /// `creates`: whether the writer creates the file instead of opening it again.
  BlockSender(Communicator& ranks, const System<D>& system, bool creates = true);
  void frame(const Snapshot<D>& snapshot) override;

 private:
  Communicator& ranks_;
  bool spins_;
};

}  // namespace carom
