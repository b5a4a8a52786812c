// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The interface of all integrators and the declarations by which they are found by name.

#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/parameters.h"
#include "engine/laws/contact_log.h"
#include "engine/laws/counters.h"
#include "engine/ranks/system.h"
#include "engine/stepping/local_error.h"
#include "engine/stepping/slab_watch.h"

namespace carom {

/// One step of a stepping integrator; an epoch of free flight, or the rest of one.
struct Slab {
  std::int64_t index = 0;  ///< number of the step or epoch
  double start = 0;        ///< simulated time at its start
  double length = 0;       ///< > 0
  std::int64_t steps = 1;  ///< in this length; more than one in epochs of free flight, and with longest_step
  bool ends_step = true;   ///< false: a part of a step, which another slab goes on with
  double accuracy = 0;     ///< Plan::accuracy
  /// StepTooLong if there are more contacts (of two spheres: two).
  double most_contacts = std::numeric_limits<double>::infinity();
  /// Free flight stops at this many pair collisions (counted by Counters::sphere_sphere from the start of the run).
  std::uint64_t collision_limit = std::numeric_limits<std::uint64_t>::max();
  /// Free flight stops at this many contacts in the slab, those with walls and the kicks of a bath included.
  std::uint64_t contact_limit = std::numeric_limits<std::uint64_t>::max();
};

/// The inputs and outputs of a slab beside the motion.
template <int D>
struct SlabReport {
  Counters& counters;
  std::vector<Contact<D>>* contacts = nullptr;  ///< receives the executed contacts in key order; null: not needed
  std::span<const double> observe{};  ///< ascending times within the slab at which to observe (free flight only)
  std::function<void(double, const Particles<D>&)> observer{};  ///< gets copies moved to each of these times
  SlabWatch* watch = nullptr;  ///< lets stepping methods abandon a long slab; null: it is always completed
  double boxes = 0;            ///< set by free flight: PastEpoch::boxes of this slab and rank
  LocalError error{};          ///< set by methods that adapt: the largest one in this slab
  double reached = 0;  ///< set by the integrator: the time reached within the slab; below the length only at a limit
};

template <int D>
class Integrator {
 public:
  virtual ~Integrator() = default;

  /// Called once before the first slab. Registers as fields of the system what the integrator stores for each particle
  /// between slabs. With several ranks every rank makes the same calls.
  virtual void start(System<D>&, Counters&) {}

  /// Advances the system from the start to the end of the slab; afterwards all particles are at its end, wrapped.
  /// Throws Error(Failure::numerical) with the particles' names if a step fails.
  virtual void slab(System<D>& system, const Slab& slab, SlabReport<D>& report) = 0;

  /// Whether the slab after this one may be longer than a step, by a power of four (free flight).
  virtual bool lengthens() const { return false; }

  /// The state at which energies are measured, if it is not the system itself (mcva, variant restart).
  virtual const Particles<D>* energy_state() const { return nullptr; }

  /// The sums of V over this rank's own particles at energy_state(), if the last force pass was there; otherwise null.
  virtual const PotentialSums* potential() const { return nullptr; }
  /// a = −M⁻¹∇V at energy_state(), for Verlet types; otherwise empty.
  virtual Positions<D> accelerations() const { return {}; }
};

/// The declaration of an integrator; engine/integrators/registry.cc lists them all.
struct IntegratorInfo {
  std::string_view name;  ///< as in the deck: `type = "…"`
  std::string_view title;
  std::string_view order;      ///< order of accuracy, in words: "2", "exact", "2 or 4"
  std::string_view conserves;  ///< what it conserves, and how well
  std::vector<Parameter> parameters;
  std::string_view documentation;  ///< a paragraph for the manual
  std::string_view source;         ///< papers
  bool hard_cores = true;          ///< spheres collide; false: points
  bool stepping = true;  ///< advances by steps of fixed length and observes at their ends; false: exact at any time
  bool smooth_forces = true;  ///< handles any interaction; false: only a common acceleration
  bool exact = false;         ///< conserves energy to rounding at any step: a jump ends the run
  bool local = false;         ///< each rank needs only its own particles and nearby ones; false: all particles
  bool shadow = false;        ///< a Verlet type: report the shadow energy S_h
  bool steps = false;         ///< pairs may have steps (laws/steps.h)
  bool shear = false;         ///< the box may be sheared
  bool adapts = false;        ///< steps may have any lengths: SlabReport::error and StepTooLong choose them
  /// Contacts of a sphere in a slab above which shorter slabs are cheaper; infinite: slabs may have any number.
  double most_contacts = std::numeric_limits<double>::infinity();
  std::unique_ptr<Integrator<2>> (*in_2d)(const Parameters&) = nullptr;
  std::unique_ptr<Integrator<3>> (*in_3d)(const Parameters&) = nullptr;

  /// Why the method cannot run with this interaction, as "what is wrong; what to do"; empty if it can. `fixed`: whether
  /// some particles are fixed.
  template <int D>
  std::string refusal(const Interaction<D>& term, bool fixed) const;
  /// Why the method cannot run with steps of the pair energy, in the same form; empty if it can.
  std::string refusal_of_steps() const;
  /// Why the method cannot run with the shear of this system, in the same form; empty if it can, or if there is none.
  /// `fixed`: whether some particles are fixed.
  template <int D>
  std::string refusal_of_shear(const System<D>& system, bool fixed) const;

  template <int D>
  std::unique_ptr<Integrator<D>> make(const Parameters& p) const {
    if constexpr (D == 2)
      return in_2d(p);
    else
      return in_3d(p);
  }
};

/// All integrators, in the order of the manual.
const std::vector<IntegratorInfo>& integrators();

/// The integrator with this name; throws Error(Failure::deck) with a list of the names if there is none.
const IntegratorInfo& find_integrator(std::string_view name);

/// Makes an integrator; parameters that are not given have their defaults. Throws Error(Failure::deck).
template <int D>
std::unique_ptr<Integrator<D>> make_integrator(std::string_view name, Parameters given) {
  const IntegratorInfo& info = find_integrator(name);
  return info.make<D>(completed(info.name, info.parameters, std::move(given)));
}

/// Parameters that several integrators share.
namespace parameter {
Parameter step();
Parameter longest_step();
/// The parameters of a method that may choose its steps: an optional first `step`, `accuracy`, `shortest_step`,
/// `longest_step`, those of its own, and max_events_per_step().
std::vector<Parameter> with_adaptive_steps(std::vector<Parameter> own);
Parameter max_events_per_step();
}  // namespace parameter

}  // namespace carom
