// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The states that `carom bench` measures: a lattice with Maxwell–Boltzmann velocities, or a file.
//
// The file is plain text, so that any other program can be measured on the same state: the number of spheres; the edges
// of the periodic box (their number is the dimension); then a line for each sphere with position, velocity and radius.
// Masses are 1. Numbers have 17 digits: what is read is what was written, bit for bit.

#include <cstdint>
#include <filesystem>
#include <memory>

#include "engine/ranks/system.h"

namespace carom {

/// `n` spheres of diameter 1 and mass 1 at temperature 1 on a lattice in the periodic box of this packing fraction: the
/// simple cubic (2-D: square) lattice where it holds them, since that is unstable and melts at once, else the
/// face-centred (hexagonal) one, which takes hundreds of collisions a particle to melt near freezing. The box is a cube
/// (square), but for hexagonal lattices only near one. Throws Error(Failure::initial_state) where spheres overlap.
template <int D>
std::unique_ptr<System<D>> lattice_state(std::uint64_t n, double packing_fraction, std::uint64_t seed);

/// 2 or 3. Throws Error, as read_state() does.
int state_dimension(const std::filesystem::path& file);

/// Throws Error with the line where the file is not such a state, Failure::initial_state where spheres overlap.
template <int D>
std::unique_ptr<System<D>> read_state(const std::filesystem::path& file);

template <int D>
void write_state(const std::filesystem::path& file, const System<D>& system);

}  // namespace carom
