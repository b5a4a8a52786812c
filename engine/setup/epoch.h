// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The length of an epoch of free flight, unless it is given.

#include <optional>
#include <string>

#include "engine/base/parameters.h"
#include "engine/ranks/system.h"

namespace carom {

/// The strain of a sheared box in a slab of free flight. Lists of neighbours hold for a slab: with a longer one they
/// are longer, with a shorter one they are made more often (engine/search/flow_frame.h). With 10,976 spheres in
/// inputs/sheared-fluid.toml, restitution 0.9 and rate 1, strains of 0.25, 0.5 and 1 gave 170, 191 and 179 thousand
/// collisions a second, and elastic spheres at rate 0.1 251, 240 and 246 thousand.
inline constexpr double kStrainOfSlab = 0.5;
/// The longest slab of a sheared box from this time on, shorter for a box that is so high that its images slide far;
/// infinite if the images do not slide then.
template <int D>
double longest_slab(const System<D>& system, double start);

/// Why this system cannot be sheared at this rate, as "what is wrong; what to do"; empty if it can. `step`: of a method
/// with fixed steps, the first of which starts at `start`; 0: of others.
template <int D>
std::string shear_problem(const System<D>& system, std::optional<double> end_time, double step = 0, double start = 0);

/// The contacts of a sphere with others in a unit of time in equilibrium at this density and temperature, that of the
/// bath if it is higher (Enskog's theory); 0 if nothing moves. Collective; the particles must be in blocks of ids.
template <int D>
double contact_rate(const System<D>& system);

/// Forty mean free times of the fluid at this density (Enskog's theory), but at most the time in which the lightest
/// spheres move four times the longest edge in equilibrium, and less if light or fast ones could cross more boxes than
/// can be counted, and at most a strain of forty; rounded to two digits; 1 if nothing moves. Longer epochs lose digits,
/// because times and unwrapped positions grow.
template <int D>
double default_epoch(const System<D>& system);

/// Completes the parameters of free flight if no step is given: the default epoch (or `step`, which was the default
/// when the run began), and that epochs may become longer.
template <int D>
void choose_epoch(const System<D>& system, Parameters& given, double step = 0);

/// What happened in an epoch of free flight.
struct PastEpoch {
  double length = 0;  ///< [time]
  double events = 0;  ///< contacts of a sphere, on average
  /// How far a sphere came beyond a periodic face before positions were wrapped: the largest number of boxes.
  double boxes = 0;
};

/// How long the epoch after this one should be: forty events of a sphere, if the spheres then neither fly through more
/// boxes than can be counted nor so far that times and positions lose digits; 0 if walls or a field give spheres
/// energy, so that their speeds are unknown. The default epoch is shorter if few spheres have most of the energy, since
/// it allows for the equilibrium to come. Collective.
template <int D>
double next_epoch(const System<D>& system, const PastEpoch& past);

}  // namespace carom
