// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Initial positions and velocities: lattices that fill a box, random sequential insertion, Maxwell–Boltzmann
// velocities, and the check for overlaps.
//
//   const auto sites = lattice_sites(Lattice::fcc, box, n, largest_radius);
//   const auto worst = find_overlaps(box, sites, radius);        // no overlap if worst.pairs == 0
//
// All functions are pure functions of their arguments and a seed. Lengths, masses and temperatures are in the deck's
// units (k_B = 1).

#include <cstddef>
#include <functional>
#include <span>
#include <tuple>
#include <vector>

#include "engine/base/particles.h"
#include "engine/base/random.h"
#include "engine/laws/box.h"
#include "engine/ranks/communicator.h"

namespace carom {

enum class Lattice { simple, centred };  ///< simple: cubic, square; centred: face-centred cubic, hexagonal

/// The number of unit cells along each axis, and their number of sites.
template <int D>
struct LatticeCells {
  std::array<int, D> cells{};
  std::size_t sites = 0;
};

/// The numbers of unit cells with at least `count` sites in this box and the largest distance between neighbouring
/// sites. On axes with walls the outer layers are at least `margin` from the wall.
template <int D>
LatticeCells<D> fit_lattice(Lattice lattice, const Box<D>& box, std::size_t count, double margin);

/// Calls visit(x) for all sites of the lattice (at least `count`), in the order of their coordinates; returns their
/// number.
template <int D>
std::size_t for_each_site(Lattice lattice, const Box<D>& box, std::size_t count, double margin,
                          const std::function<void(const Vec<D>&)>& visit);
template <int D>
std::vector<Vec<D>> lattice_sites(Lattice lattice, const Box<D>& box, std::size_t count, double margin);

/// Edges of a box of this volume in which `count` sites form an undistorted lattice: a cube or square; for the
/// hexagonal lattice (centred, 2-D) a rectangle with the proportions of its cells.
template <int D>
Vec<D> commensurate_edges(Lattice lattice, std::size_t count, double volume);

/// The group of each site: `counts[g]` sites, drawn at random, are in group g, the remaining ones in group −1.
std::vector<int> distribute(std::size_t sites, std::span<const std::size_t> counts, std::uint64_t seed);

/// Called now and then during long work, at least several times a second; it may throw to end the work.
using Pause = std::function<void()>;

/// Random sequential insertion (Widom, J. Chem. Phys. 44 (1966) 3888): sets x[i] for every i in `ids`, large spheres
/// first, at random positions without overlap with walls or placed spheres (all spheres not in `ids` are placed).
/// Returns the number of spheres placed; insertion ends when a sphere fails in `tries` trials. No diameter may exceed a
/// periodic edge.
template <int D>
std::size_t insert_at_random(const Box<D>& box, std::span<Vec<D>> x, std::span<const double> radius,
                             std::span<const Id> ids, std::uint64_t seed, const Pause& pause = {},
                             std::uint64_t tries = 20000);

/// Pairs closer than their contact distance by more than the gap tolerance (engine/laws/wall.h), also through periodic
/// images; pairs are ignored if `beyond` marks the sphere with the larger index, or `fixed` both.
struct Overlaps {
  std::size_t pairs = 0;
  Id lo = 0, hi = 0;    ///< the pair that overlaps most, relative to its contact distance; the first one in a tie
  double distance = 0;  ///< distance of that pair [length]
  double contact = 1;   ///< contact distance of that pair [length]

  /// The overlap of that pair, relative to its contact distance; 0 if there is none.
  double depth() const { return pairs == 0 ? 0 : 1 - distance / contact; }
  void add(const Overlaps& other) {
    const auto order = [](const Overlaps& o) { return std::tuple(o.distance / o.contact, o.lo, o.hi); };
    const std::size_t all = pairs + other.pairs;
    if (pairs == 0 || (other.pairs > 0 && order(other) < order(*this))) *this = other;
    pairs = all;
  }
};
template <int D>
Overlaps find_overlaps(const Box<D>& box, std::span<const Vec<D>> x, std::span<const double> radius,
                       std::span<const char> beyond = {}, std::span<const char> fixed = {},
                       std::span<const Id> id = {});

/// Spheres not marked in `fixed` that extend beyond a wall by more than the gap tolerance.
struct Outsiders {
  std::size_t spheres = 0;
  Id worst = 0;
  Id wall = 0;       ///< its number
  double depth = 0;  ///< how far the worst one extends beyond the wall [length]
};
template <int D>
Outsiders find_outsiders(const Box<D>& box, std::span<const Vec<D>> x, std::span<const double> radius,
                         std::span<const char> fixed = {});

/// Maxwell–Boltzmann velocities for the particles `chosen`, with a temperature for each: drawn at random, shifted to
/// zero total momentum (unless there is only one particle) and scaled so that 2K = D Σ temperature up to rounding. With
/// `ranks`, each rank sets its block of the particles, with the same bits; collective.
template <int D>
void draw_velocities(Particles<D>& particles, std::span<const Id> chosen, std::span<const double> temperature,
                     std::uint64_t seed, RandomPurpose purpose = RandomPurpose::velocity,
                     Communicator* ranks = nullptr);

/// Spins for the particles `chosen`, with a rotational temperature for each: components drawn at random with the
/// variance T/I, I the moment of inertia, and scaled so that Σ I w² = (1 or, in three dimensions, 3) Σ T up to
/// rounding. With `ranks`, each rank sets its block of the particles, with the same bits; collective.
template <int D>
void draw_spins(Particles<D>& particles, const ContactLaws& laws, std::span<const Id> chosen,
                std::span<const double> temperature, std::uint64_t seed, Communicator* ranks = nullptr);

/// The fraction of the box filled by spheres, 0 … 1; with `ranks`, by the spheres of all ranks.
template <int D>
double packing_fraction(double volume, std::span<const double> radius, Communicator* ranks = nullptr);

}  // namespace carom
