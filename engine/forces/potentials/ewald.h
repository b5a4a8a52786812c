// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Charges in a periodic box: the Ewald sum.
//
//   V = C { Σ_{i<j, images} q_i q_j erfc(αr)/r + (1/2Ω) Σ_{k≠0} (4π/k²) e^(−k²/4α²) |S(k)|² − (α/√π) Σ q_i²
//           − π Q²/(2α²Ω) + (2π/3Ω) |Σ q_i x_i|² },   S(k) = Σ q_j e^(ik·x_j),   Q = Σ q_i
//
// The fourth term is the uniform background of a charged cell; the last one, with unwrapped positions, is there only if
// the surface is "vacuum" (de Leeuw, Perram, Smith, Proc. R. Soc. A 373 (1980) 27). The first one is a PairTerm.
//
// Between two walls the sum is that over all images along the other two axes: the box that is repeated has empty room
// between the walls of neighbouring images, and the dipole term (2π/Ω) M_z², z along the normal of the walls, takes off
// the field of the images (Yeh, Berkowitz, J. Chem. Phys. 111 (1999) 3155). What remains of that field decreases by
// e^(−2π/L) per length of empty room, L the longer edge of the walls (slab_gap()). If the walls carry charges, those of
// the particles need not add up to zero; the dipole term is then (2π/Ω) (M_z² − Q Σ q_i z_i² − Q² L_z²/12), L_z the
// edge of the box that is repeated (Ballenegger, Arnold, Cerdà, J. Chem. Phys. 131 (2009) 094107). The field of two
// walls of charge σ and σ' per area is uniform, 2πC (σ − σ').
//
// Pairs that are excluded have the term −C q_i q_j erf(αr)/r, which takes them out of the waves.
//
// Masses, with C = −G and a background of negative mass, are summed like charges.
//
// The discrete gradient of the sum over k follows from |S′|² − |S|² = Re (S′ − S)(S′ + S)* and
//
//   e^(ik·x′) − e^(ik·x) = i k·Δ sinc(k·Δ/2) e^(ik·(x + x′)/2),   Δ = x′ − x:
//   F̄_j = (q_j/Ω) Σ_k A(k) k sinc(k·Δ_j/2) Im[½(S + S′)* e^(ik·(x_j + x′_j)/2)],   A = C (4π/k²) e^(−k²/4α²).
//
// |S|² is invariant under translation, so x′ is taken relative to the motion of the charges' centre of mass, and the
// share (m_j/M) Σ F̄ is taken off each F̄_j; the work remains exact, because Σ m_j Δ_j = 0, and the net force is zero.
//
// Each rank sums over its own charges, and then adds up S(k), the motion of the centre of mass and the net force of all
// ranks. S(k) and forces are summed in fixed point, other sums are exact, so no bit depends on the order of the
// particles or on how they are divided among ranks.

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/forces/potentials/options.h"
#include "engine/laws/interaction.h"

namespace carom {

/// The parameters of the two sums.
struct EwaldSplit {
  double alpha;        ///< [1/length]
  double switch_from;  ///< up to here the pair term is erfc(αr)/r [length]
  double cutoff;       ///< where the switched pair term ends [length]
  double wave_cutoff;  ///< the largest |k| [1/length]
  double pair_error;   ///< the largest error of dE/du of the pair term, see EwaldPair
};

/// The charges of a system.
struct ChargeSums {
  ExactSum total;                             ///< Σ q
  ExactSum absolute;                          ///< Σ |q|
  ExactSum squares;                           ///< Σ q²
  ExactSum count;                             ///< number of charged particles
  ExactSum mass;                              ///< of those that are not fixed
  double fixed = 0;                           ///< number of fixed ones
  double largest = 0;                         ///< |q|
  Id first = std::numeric_limits<Id>::max();  ///< the lowest id of a charged particle

  void add(const Particles<3>& particles, Id i, double q) {
    if (q == 0) return;
    total.add(q);
    absolute.add(std::abs(q));
    squares.add(q * q);
    count.add(1.0);
    if (particles.fixed(i))
      ++fixed;
    else
      mass.add(particles.mass[i]);
    largest = std::max(largest, std::abs(q));
    first = std::min(first, particles.id_of(i));
  }
  void add(const ChargeSums& other) {
    total.add(other.total);
    absolute.add(other.absolute);
    squares.add(other.squares);
    count.add(other.count);
    mass.add(other.mass);
    fixed += other.fixed;
    largest = std::max(largest, other.largest);
    first = std::min(first, other.first);
  }
};

/// The split in which the root mean square error of the forces, by the estimates of Kolafa and Perram (Mol. Simul. 9
/// (1992) 351), is at most `accuracy` times the force between two charges at their mean distance, q²/(Ω/N)^(2/3), q²
/// the mean of q_i²: each sum gets half,
///
///   pairs: 2 q² √(N/Ωr) e^(−α²r²),   waves: q² α √(8N/Ωk) e^(−k²/4α²),   r and k where the sums end.
///
/// Ω in the second estimate is `repeated`, the volume of the box that is repeated, in which the system's has its place.
/// The pair term reaches at most `longest`.
EwaldSplit ewald_split(double accuracy, const ChargeSums& charges, double volume, double repeated, double longest);

/// The room between two images of a slab in which their forces on a charge, after the dipole term, are at most half the
/// accuracy: the field of N random charges beyond it is that of the longest waves along the walls, four of them from
/// two sides,
///
///   8 q² √N (2π/A) e^(−2π gap/L) ≤ ½ accuracy q²/(Ω/N)^(2/3),   A the area of a wall, L its longer edge.
double slab_gap(double accuracy, double n, double volume, double area, double longer);

/// The term of `form = "ewald"` of the interaction `type`, with the constant C. Refuses boxes that are neither periodic
/// along all axes nor, for charges, between two walls.
std::unique_ptr<Interaction<3>> ewald(std::string_view type, double constant, PairWeight weight,
                                      const Parameters& parameters, const InteractionContext<3>& context);

}  // namespace carom
