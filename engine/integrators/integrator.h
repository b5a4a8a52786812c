// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The interface of all integrators and the declaration that makes one known.

#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "engine/base/contact_log.h"
#include "engine/base/counters.h"
#include "engine/base/parameters.h"
#include "engine/ranks/system.h"
#include "engine/slabs/slab_watch.h"

namespace carom {

/// One step of a stepping integrator; an epoch of free flight, or what is left of it.
struct Slab {
  std::int64_t index = 0;  ///< of the step or epoch
  double start = 0;        ///< simulated time at its start
  double length = 0;       ///< > 0
  /// Free flight stops at this many pair collisions (counted by Counters::sphere_sphere from the start of the run).
  std::uint64_t collision_limit = std::numeric_limits<std::uint64_t>::max();
};

/// What happens beside the motion in a slab.
template <int D>
struct SlabReport {
  Counters& counters;
  std::vector<Contact<D>>* contacts = nullptr;  ///< where to put the executed contacts, in key order; null: not wanted
  std::span<const double> observe{};  ///< ascending times within the slab at which to observe (free flight only)
  std::function<void(double, const Particles<D>&)> observer{};  ///< given copies flown to each of these times
  SlabWatch* watch = nullptr;  ///< lets stepping methods leave a slab that takes long; null: it is ended
  double reached =
      0;  ///< set by the integrator: the time within the slab it came to; less than its length only at collision_limit
};

template <int D>
class Integrator {
 public:
  virtual ~Integrator() = default;

  /// Called once before the first slab. What it keeps of each particle from slab to slab it registers as fields of the
  /// system here. Where the system has several ranks each of them makes the same calls.
  virtual void start(System<D>&, Counters&) {}

  /// Advances the system from the start to the end of the slab; afterwards all particles are at its end, wrapped.
  /// Throws Error(Failure::numerical) with the particles' names where a step cannot be done.
  virtual void slab(System<D>& system, const Slab& slab, SlabReport<D>& report) = 0;

  /// The state at which energies are to be measured, where this is not the system itself (mcva, variant restart).
  virtual const Particles<D>* energy_state() const { return nullptr; }

  /// V and its companions in that state, over what this rank owns, where the last force pass was there; else null.
  virtual const PotentialSums* potential() const { return nullptr; }
  /// a = −M⁻¹∇V there; Verlet types have it.
  virtual Positions<D> accelerations() const { return {}; }
};

/// The declaration of an integrator; engine/integrators/registry.cc lists them all.
struct IntegratorInfo {
  std::string_view name;  ///< as in the deck: `type = "…"`
  std::string_view title;
  std::string_view order;      ///< order of accuracy, in words: "2", "exact", "2 or 4"
  std::string_view conserves;  ///< what it keeps, and how well
  std::vector<Parameter> parameters;
  std::string_view documentation;  ///< a paragraph for the manual
  std::string_view source;         ///< papers
  bool hard_cores = true;          ///< spheres collide; false: points
  bool stepping = true;  ///< advances by steps of fixed length and observes at their ends; false: exact at any time
  bool smooth_forces = true;  ///< knows any interaction; false: none but a common acceleration
  bool exact = false;         ///< keeps the energy to rounding, whatever the step: a jump of it ends the run
  bool local = false;   ///< on several ranks each can do with its own particles and those near them; else with all
  bool shadow = false;  ///< a Verlet type: report the shadow energy S_h
  std::unique_ptr<Integrator<2>> (*in_2d)(const Parameters&) = nullptr;
  std::unique_ptr<Integrator<3>> (*in_3d)(const Parameters&) = nullptr;

  template <int D>
  std::unique_ptr<Integrator<D>> make(const Parameters& p) const {
    if constexpr (D == 2)
      return in_2d(p);
    else
      return in_3d(p);
  }
};

/// Every integrator there is, in the order of the manual.
const std::vector<IntegratorInfo>& integrators();

/// The one of that name; throws Error(Failure::deck), which lists the names.
const IntegratorInfo& find_integrator(std::string_view name);

/// It, made with these parameters and defaults for those left out. Throws Error(Failure::deck).
template <int D>
std::unique_ptr<Integrator<D>> make_integrator(std::string_view name, Parameters given) {
  const IntegratorInfo& info = find_integrator(name);
  return info.make<D>(completed(info.name, info.parameters, std::move(given)));
}

/// Parameters that several integrators share.
namespace parameter {
Parameter step();
Parameter max_events_per_step();
}  // namespace parameter

}  // namespace carom
