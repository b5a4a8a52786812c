// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Initial positions and velocities: lattices spread over a box, random sequential insertion, Maxwell–Boltzmann
// velocities, and the check that no two spheres overlap.
//
//   const auto sites = lattice_sites(Lattice::fcc, box, n, largest_radius);
//   const auto worst = find_overlaps(box, sites, radius);        // worst.pairs == 0: there are none
//
// Everything is a pure function of its arguments and a seed. Lengths, masses and temperatures are in the deck's units
// (k_B = 1).

#include <cstddef>
#include <functional>
#include <span>
#include <tuple>
#include <vector>

#include "engine/base/box.h"
#include "engine/base/particles.h"
#include "engine/base/random.h"
#include "engine/ranks/communicator.h"

namespace carom {

enum class Lattice { simple, centred };  ///< simple cubic and square; face-centred cubic and hexagonal

/// How many unit cells along each axis, and how many sites that makes.
template <int D>
struct LatticeCells {
  std::array<int, D> cells{};
  std::size_t sites = 0;
};

/// The numbers of unit cells that hold at least `count` sites in a box of these edges with the largest distance between
/// neighbouring sites. On axes with walls the outer layers stay `margin` away from the wall.
template <int D>
LatticeCells<D> fit_lattice(Lattice lattice, const Box<D>& box, std::size_t count, double margin);

/// Calls visit(x) for all sites (at least `count`) of that lattice, in the order of their coordinates; returns how
/// many.
template <int D>
std::size_t for_each_site(Lattice lattice, const Box<D>& box, std::size_t count, double margin,
                          const std::function<void(const Vec<D>&)>& visit);
template <int D>
std::vector<Vec<D>> lattice_sites(Lattice lattice, const Box<D>& box, std::size_t count, double margin);

/// Edges of a box of this volume in which `count` sites make an undistorted lattice: a cube or square, except for the
/// hexagonal lattice (centred, 2-D): its box has the proportions of its cells.
template <int D>
Vec<D> commensurate_edges(Lattice lattice, std::size_t count, double volume);

/// Which group each site belongs to: `counts[g]` sites drawn at random for every group g, the others get −1.
std::vector<int> distribute(std::size_t sites, std::span<const std::size_t> counts, std::uint64_t seed);

/// Random sequential insertion (Widom, J. Chem. Phys. 44 (1966) 3888): x[i] for every i in `ids`, large spheres first,
/// each at a random place where it touches none that stand already (those not in `ids` do) and no wall. Returns how
/// many could be placed: fewer than all where one found no place in `tries` trials.
template <int D>
std::size_t insert_at_random(const Box<D>& box, std::span<Vec<D>> x, std::span<const double> radius,
                             std::span<const Id> ids, std::uint64_t seed, std::uint64_t tries = 20000);

/// Pairs closer than their contact distance by more than the gap tolerance (engine/base/wall.h), through periodic
/// images too; without those with the later sphere `beyond` what is looked at.
struct Overlaps {
  std::size_t pairs = 0;
  Id lo = 0, hi = 0;    ///< the pair that overlaps most, relative to its contact distance; of equals the lowest ids
  double distance = 0;  ///< of that pair [length]
  double contact = 1;   ///< its contact distance [length]

  /// Of that pair, relative to its contact distance; 0 where there is none.
  double depth() const { return pairs == 0 ? 0 : 1 - distance / contact; }
  void add(const Overlaps& other) {
    const auto order = [](const Overlaps& o) { return std::tuple(o.distance / o.contact, o.hi, o.lo); };
    const std::size_t all = pairs + other.pairs;
    if (pairs == 0 || (other.pairs > 0 && order(other) < order(*this))) *this = other;
    pairs = all;
  }
};
template <int D>
Overlaps find_overlaps(const Box<D>& box, std::span<const Vec<D>> x, std::span<const double> radius,
                       std::span<const char> beyond = {});

/// Spheres that reach through a wall by more than the gap tolerance.
struct Outsiders {
  std::size_t spheres = 0;
  Id worst = 0;
  int axis = 0;
  double depth = 0;  ///< how far the worst one reaches through [length]
};
template <int D>
Outsiders find_outsiders(const Box<D>& box, std::span<const Vec<D>> x, std::span<const double> radius);

/// Maxwell–Boltzmann velocities for the particles `chosen`, one temperature each: drawn, freed of total momentum (not
/// so a single particle) and scaled so that 2K = D Σ temperature exactly, up to rounding. With `ranks`, each does so
/// for its block of the particles, with the same bits; collective.
template <int D>
void draw_velocities(Particles<D>& particles, std::span<const Id> chosen, std::span<const double> temperature,
                     std::uint64_t seed, RandomPurpose purpose = RandomPurpose::velocity,
                     Communicator* ranks = nullptr);

/// The part of the box that the spheres fill, 0 … 1; with `ranks`, those of all of them.
template <int D>
double packing_fraction(double volume, std::span<const double> radius, Communicator* ranks = nullptr);

}  // namespace carom
