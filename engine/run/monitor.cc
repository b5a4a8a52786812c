// SPDX-License-Identifier: BSD-3-Clause
#include "engine/run/monitor.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <string>
#include <utility>

#include "engine/base/error.h"
#include "engine/ranks/close_pairs.h"
#include "engine/run/measurement.h"

namespace carom {

namespace {
/// S_h costs two passes over all pairs: for larger systems it is computed at thermo rows and frames only.
constexpr std::size_t kShadowAtEveryStep = 100;
/// On several ranks the sums of this many steps are made at once, or sooner if they are needed.
constexpr std::size_t kMostWaiting = 16;

// Limits at which a run fails, because it is no longer a motion of the deck's system.

/// |H| relative to its scale at the start. Inexact methods with far too long steps can reach 1e4 and recover.
constexpr double kLargestEnergyGrowth = 1e10;
/// The change of H in a slab relative to K + Σ|V|, for methods that conserve H to rounding. Positions are rounded to
/// 1e-16 of the box; potentials 10⁴ times steeper than the box is long make 1e-12 of this. The limit is six digits
/// above this, and still far below the error of a second-order method.
constexpr double kLargestEnergyJump = 1e-6;
/// Depth relative to the contact distance.
constexpr double kDeepestOverlap = 1e-6;

/// The length of an overlap that rounding may cause, relative to the largest coordinate and the longest path in a slab.
/// Both are rounded by half an ulp, 2^-53, at each operation: positions at the start, the time of the contact, and the
/// place there, of two spheres and an image in each of D axes, less than 2^-49 together. The gap tolerance is 4 ulp of
/// the box, up to 2^-50 of it. This is sixteen times the tolerance; a contact in a box of 10⁶ diameters must be right
/// to 1.4e-8 diameters then.
constexpr double kRoundingOfPositions = 0x1p-46;

/// Replaces an id if there is none; the smallest id of all ranks is found as the largest negative one.
constexpr double kNoId = -std::numeric_limits<double>::infinity();

/// The time integral of the shear stress, by the work of the flow: γ̇ V ∫ −P_xy dt.
template <int D>
double stress_of(double work, const Box<D>& box) {
  return box.shear_rate == 0 ? 0 : work / (box.shear_rate * box.volume());
}

}  // namespace

template <int D>
Monitor<D>::Monitor(System<D>& system, const IntegratorInfo& info, const Plan& plan,
                    const std::vector<Observer<D>*>& observers, Statistics& statistics)
    : system_(system),
      info_(info),
      plan_(plan),
      observers_(observers),
      statistics_(statistics),
      frames_(plan.frame_interval),
      rows_(plan.thermo_interval),
      tail_(tail_of(system)) {
  statistics.shear_rates = system.box.shear_rates;
  statistics.shear_rate = system.box.shear_rates.empty() ? system.box.shear_rate : 0;
  statistics.tail_energy = tail_.energy;
  statistics.tail_pressure = pressure_of(tail_.virial, system.box, system.box.time);
  if (system.keeps_momentum()) statistics.max_momentum_error = 0;
  for (auto* observer : observers)
    if (observer->sampling().interval > 0) samplers_.push_back({observer, Schedule(observer->sampling())});
  if (has_shadow()) statistics.max_shadow_energy_error = 0;
  std::map<std::string, Id> columns;
  for (const Wall<D>& wall : system.box.walls()) {
    column_of_wall_.resize(wall.number + 1);
    column_of_wall_[wall.number] = columns.try_emplace(system.box.name_of(wall.number), wall.number).first->second;
  }
  sampled_walls_.resize(column_of_wall_.size());
  begin_means();
  Fields& fields = system.fields;
  fields.settle = [this] { settle(); };
  fields.add_value("statistics", statistics);
  fields.add_value("account", account_);
  fields.add_value("impulses of walls", last_row_impulses_);
  fields.add_value("sampled walls", sampled_walls_);
  fields.add_value("transient", transient_);
  fields.add_value("end of the transient", transient_end_);
  static_assert(sizeof(Readings<D>) == (11 + D) * sizeof(double) && alignof(Readings<D>) == sizeof(double),
                "a checkpoint holds these bytes: no padding, or a new format");
  fields.add_value<Readings<D>>("last measurement", shot_);
  if (system.box.contacts.rough())
    fields.add_of_run({"last rotation", [this](Archive& archive) {
                         archive(static_cast<SpinReadings&>(shot_));
                         statistics_.rotational_energy = shot_.rotational;
                       }});
  if (!system.box.steps.empty())
    fields.add_of_run(
        {"steps", [this](Archive& archive) { archive(first_step_energy_, static_cast<StepReadings&>(shot_)); }});
  fields.add_value("next frame", frames_.next());
  fields.add_value("next row", rows_.next());
  for (std::size_t k = 0; k < samplers_.size(); ++k) {
    const std::string name = "observer " + std::to_string(k);
    fields.add_value(name + " next", samplers_[k].due.next());
    samplers_[k].observer->add_state(fields, name);
  }
  fields.add_working(
      this,
      [this] {
        touching_.reset();
        std::vector<Vec<D>>().swap(scratch_);
      },
      [this] {
        const Particles<D>& p = system_.particles;
        if (info_.hard_cores && info_.stepping)
          touching_.emplace(system_.box, system_.box.steps.reach()(p.radius), p.ghost, p.all_fixed());
        if (has_shadow()) scratch_.resize(p.size());
      });
}

template <int D>
void Monitor<D>::start(const Integrator<D>& integrator, bool fresh) {
  const double time = statistics_.start_time;
  for (Schedule* schedule : {&frames_, &rows_}) schedule->pass(time - plan_.slack());
  if (!waits())
    for (Sampler& sampler : samplers_) sampler.due.pass(time - plan_.slack());
  shot_ = measure(time, system_.particles, &integrator, has_shadow(), fresh);
  statistics_.energy_initial = statistics_.energy_final = shot_.total();
  if (system_.box.contacts.rough()) statistics_.rotational_energy = shot_.rotational;
  account_.first_momentum = shot_.momentum;
  first_step_energy_ = shot_.step_energy - statistics_.counters.steps.stored.value();
  count_from(shot_);
  statistics_.first_step_error = 0;
  sample(time, system_.particles);
  show(shot_, true);
}

/// Makes this state the reference of energy errors.
template <int D>
void Monitor<D>::count_from(const Snapshot<D>& shot) {
  statistics_.energy_after_first_step = shot.total();
  statistics_.first_step_error = std::abs(account_.energy - account_.first_energy);
  account_.first_energy = account_.energy;
  account_.first_shadow = shot.shadow + statistics_.counters.drained();
  statistics_.energy_reference = std::max(std::abs(account_.energy), account_.magnitude);
  if (statistics_.energy_scale == 0) statistics_.energy_scale = statistics_.energy_reference;
}

/// Throws if the run has failed. The compared numbers are equal on all ranks.
template <int D>
void Monitor<D>::guard(double energy_before, double magnitude_before) {
  const Statistics& s = statistics_;
  const auto fail = [&](const std::string& what) {
    throw Error(Failure::numerical, what + " at step " + std::to_string(shot_.step) + ", time " +
                                        short_text(shot_.time) + "; " + fastest(system_.particles) +
                                        "; use a smaller integrator.step");
  };
  const double energy = std::abs(account_.energy), jump = std::abs(account_.energy - energy_before);
  // If the particles were almost at rest at the start, both energies may be rounding errors.
  if (energy > kLargestEnergyGrowth * s.energy_scale && energy > 0.5 * account_.magnitude)
    fail("the run has blown up: the energy, " + short_text(s.energy_initial) + " at the start, is " +
         short_text(account_.energy));
  if (info_.exact && jump > kLargestEnergyJump * std::max({s.energy_reference, magnitude_before, account_.magnitude}))
    fail("the energy, which " + std::string(info_.name) + " keeps to rounding, jumped by " + short_text(jump) + " to " +
         short_text(account_.energy));
}

/// Names the fastest particle, for messages. Collective.
template <int D>
std::string Monitor<D>::fastest(const Particles<D>& state) const {
  double speed = -1, id = kNoId;
  for (Id i = 0; i < state.size(); ++i) {
    const double each = state.v[i].norm(), finite = std::isfinite(each) ? each : -kNoId;
    if (!state.owns(i) || finite <= speed) continue;
    speed = finite;
    id = -static_cast<double>(state.id_of(i));
  }
  const double most = system_.decomposition.largest(speed);
  id = -system_.decomposition.largest(speed == most ? id : kNoId);
  return "particle " + short_text(id, 10) + " is the fastest, with a speed of " + short_text(most);
}

template <int D>
std::vector<double> Monitor<D>::due_within(const Slab& slab) const {
  std::vector<double> times;
  std::vector<Schedule> all = {frames_, rows_};
  if (!waits())
    for (const Sampler& sampler : samplers_) all.push_back(sampler.due.later(origin()));
  for (;;) {
    double due = std::numeric_limits<double>::infinity();
    for (const Schedule& schedule : all) due = std::min(due, schedule.due());
    if (!(due < slab.start + slab.length - plan_.slack())) break;
    times.push_back(due - slab.start);
    for (Schedule& schedule : all) schedule.pass(due + plan_.slack());
  }
  return times;
}

template <int D>
void Monitor<D>::observe(double time, const Particles<D>& copies) {
  sample(time, copies);
  if (std::min(frames_.due(), rows_.due()) <= time + plan_.slack()) show(measure(time, copies, nullptr, false), false);
}

/// Passes the particles to observers whose own sampling times are due.
template <int D>
void Monitor<D>::sample(double time, const Particles<D>& state) {
  if (waits()) return;
  for (Sampler& sampler : samplers_) {
    const double now = time + plan_.slack() - origin();
    if (sampler.due.due() > now) continue;
    const Stopwatch watch(statistics_.counters.seconds.output);
    sampler.observer->sample(time, sampler.observer->divided() ? state : all_particles(state));
    sampler.due.pass(now);
  }
}

template <int D>
void Monitor<D>::end_of_slab(double elapsed, const Integrator<D>& integrator, bool whole, bool last) {
  const Statistics& s = statistics_;
  const bool due = last || (whole && std::min(frames_.due(), rows_.due()) <= s.end_time + plan_.slack());
  const bool soon = due || s.steps == s.start_steps + 1 || !info_.stepping || !system_.decomposition.joined() ||
                    (waits() && transient_end_);
  const bool with_shadow =
      has_shadow() && (due || s.steps == s.start_steps + 1 || system_.size() <= kShadowAtEveryStep);
  Waiting& slab = waiting_.emplace_back(observed(s.end_time, system_.particles, &integrator, with_shadow));
  slab.elapsed = elapsed;
  OverlapTally& at_contacts = statistics_.counters;
  slab.own.overlaps = at_contacts;
  at_contacts.worst = {};
  if (info_.hard_cores) slab.own.overlaps.add(overlaps(elapsed));
  if (soon || with_shadow || waiting_.size() == kMostWaiting) settle();
  if (whole) sample(s.end_time, system_.particles);
  if (due) show(shot_, false);
}

/// Makes the sums that slabs wait for. Collective.
template <int D>
void Monitor<D>::settle() {
  if (waiting_.empty()) return;
  std::vector<Sums> sums;
  for (const Waiting& slab : waiting_) sums.push_back(slab.own);
  if (system_.decomposition.joined()) {
    const std::vector<Sums> all = gather_values<Sums>(system_.decomposition.ranks(), sums);
    std::ranges::fill(sums, Sums{});
    for (std::size_t k = 0; k < all.size(); ++k) sums[k % sums.size()].add(all[k]);
  }
  const std::vector<Waiting> slabs = std::exchange(waiting_, {});
  for (std::size_t k = 0; k < slabs.size(); ++k) take(slabs[k], sums[k]);
  Statistics& s = statistics_;
  if (const double time = s.end_time - s.start_time; time > 0) {
    if (!system_.box.plain()) account_.virial_time = std::numeric_limits<double>::quiet_NaN();  // the volume varies
    s.mean_pressure = (account_.virial_time + s.counters.collision_virial.value()) / (time * D * system_.box.volume());
    s.collision_rate =
        2.0 * static_cast<double>(s.counters.sphere_sphere) / (static_cast<double>(system_.size()) * time);
  }
  if (s.collision_rate > 0 && !system_.has_fixed()) {
    s.mean_free_time = 1 / s.collision_rate;
    s.mean_free_path = account_.path / (s.end_time - s.start_time) / s.collision_rate;
  }
}

/// Begins the means over time at the present time.
template <int D>
void Monitor<D>::begin_means() {
  statistics_.series = Blocking(Statistics::mean_names.size() + column_of_wall_.size() + (has_mean_stress() ? 1 : 0));
}

/// Adds a slab to the means. `path`: the mean length of the spheres' ways in it.
template <int D>
void Monitor<D>::add_to_series(const Waiting& slab, double path) {
  const ContactTally& tally = slab.tally;
  const double elapsed = slab.elapsed;
  // Most steps of a small system have no contacts, and the value of an exact sum costs more than all the rest here.
  const auto since = [](const ExactSum& sum, Sampled& before) {
    // Different padding only costs time. NOLINTNEXTLINE(bugprone-suspicious-memory-comparison)
    if (std::memcmp(&sum, &before.sum, sizeof sum) == 0) return 0.0;
    before.sum = sum;
    const double value = sum.value();
    return value - std::exchange(before.value, value);
  };
  const auto collisions =
      static_cast<double>(tally.sphere_sphere - std::exchange(account_.sampled_collisions, tally.sphere_sphere));
  const double virial = elapsed * account_.virial + since(tally.collision_virial, account_.sampled_virial);
  const double flights = 2 * collisions / static_cast<double>(system_.size());  // of a sphere
  constexpr double none = std::numeric_limits<double>::quiet_NaN();             // the volume varies
  values_ = {system_.box.plain() ? pressure_of(virial, system_.box, shot_.time) : none,
             shot_.temperature * elapsed,
             shot_.potential * elapsed,
             flights,
             elapsed,
             path};
  weights_ = {elapsed, elapsed, elapsed, elapsed, flights, flights};
  values_.resize(statistics_.series.columns());
  weights_.resize(values_.size(), elapsed);
  for (std::size_t wall = 0; wall < std::min(column_of_wall_.size(), tally.walls.size()); ++wall)
    values_[Statistics::mean_names.size() + column_of_wall_[wall]] +=
        since(tally.walls[wall].impulse, sampled_walls_[wall]);
  if (has_mean_stress()) {
    const double work = since(tally.shear, account_.sampled_shear);
    values_.back() = system_.box.plain() ? stress_of(work, system_.box) : none;
  }
  statistics_.series.add(values_, weights_);
}

/// Adds a slab to the statistics; `sums` are those of all ranks.
template <int D>
void Monitor<D>::take(const Waiting& slab, const Sums& sums) {
  Statistics& s = statistics_;
  const double speed = account_.speed, energy = account_.energy, magnitude = account_.magnitude;
  shot_ = measured(slab, sums);
  s.energy_final = shot_.total();
  if (s.rotational_energy) s.rotational_energy = shot_.rotational;
  if (shot_.step == s.start_steps + 1 && info_.stepping) count_from(shot_);
  s.max_energy_error = std::max(s.max_energy_error, std::abs(account_.energy - account_.first_energy));
  if (s.max_shadow_energy_error)
    s.max_shadow_energy_error =
        std::max(*s.max_shadow_energy_error, std::abs(shot_.shadow + slab.tally.drained() - account_.first_shadow));
  sums.motion.steps.check(
      system_.box.steps, first_step_energy_ + slab.tally.steps.stored.value(),
      "between the times " + short_text(slab.time - slab.elapsed, 10) + " and " + short_text(slab.time, 10));
  guard(energy, magnitude);
  if (s.max_momentum_error)
    s.max_momentum_error = std::max(*s.max_momentum_error,
                                    (Vec<D>(shot_.momentum.data()) - Vec<D>(account_.first_momentum.data())).norm());
  note_overlap(slab, sums);
  account_.virial_time += slab.elapsed * account_.virial;
  const double path = slab.elapsed * 0.5 * (speed + account_.speed);
  account_.path += path;
  add_to_series(slab, path);
  if (waits() && transient_end_) {
    s.equilibrium = {*transient_end_, slab.time};
    begin_means();
  }
}

/// Keeps the worst overlap, unless it may be rounding. Throws if it makes the run meaningless.
template <int D>
void Monitor<D>::note_overlap(const Waiting& slab, const Sums& sums) {
  Statistics& s = statistics_;
  s.counters.max_overlap = std::max(s.counters.max_overlap, sums.overlaps.max_overlap);
  Overlap worst = sums.overlaps.worst;
  const double size = std::max(system_.box.edges.maxCoeff(), sums.motion.farthest);
  if (!(worst.length > kRoundingOfPositions * (size + sums.motion.fastest * slab.elapsed))) return;
  worst.time += slab.time - slab.elapsed;
  if (worst.depth > kDeepestOverlap)
    throw Error(Failure::numerical, overlap_text(worst, system_.box) + ", at step " + std::to_string(shot_.step) +
                                        ", time " + short_text(worst.time) + "; use a smaller integrator.step");
  if (!s.overlap || worst.depth > s.overlap->depth) s.overlap = worst;
}

/// The state of this rank's particles; `integrator` is null if they are not its state.
template <int D>
typename Monitor<D>::Waiting Monitor<D>::observed(double time, const Particles<D>& state,
                                                  const Integrator<D>* integrator, bool with_shadow, bool fresh) {
  const Stopwatch watch(statistics_.counters.seconds.output);
  const Particles<D>* elsewhere = integrator ? integrator->energy_state() : nullptr;
  const Particles<D>& nodes = elsewhere ? *elsewhere : state;
  const PotentialSums* potential = integrator && fresh ? integrator->potential() : nullptr;
  Waiting now{time,
              statistics_.steps,
              &state,
              {own_motion(system_, state, nodes, touching_ ? &*touching_ : nullptr),
               potential ? *potential : own_energy<D>(system_, nodes.x),
               {}},
              statistics_.counters};
  Counters uncounted;
  if (with_shadow) now.shadow_term = shadow_term<D>(system_, nodes, integrator->accelerations(), scratch_, uncounted);
  return now;
}

/// Measures a state; `sums` are those of all ranks.
template <int D>
Snapshot<D> Monitor<D>::measured(const Waiting& at, const Sums& sums) {
  Measurement<D> found = carom::measured(system_, sums.motion, sums.potential, tail_);
  Snapshot<D>& shot = found.shot;
  shot.time = at.time;
  shot.step = at.step;
  shot.particles = at.particles;
  shot.collisions = at.tally.sphere_sphere;
  shot.dissipated = at.tally.dissipated.value();
  shot.work = at.tally.work.value() + at.tally.shear.value();
  shot.heat = at.tally.heat.value();
  shot.step_length = statistics_.step_length;
  // The conserved quantity: the energy of the spheres, what they have lost, and less what walls and baths gave them.
  account_.energy =
      shot.kinetic + (sums.potential.energy.value() + shot.step_energy) + (shot.dissipated - shot.work - shot.heat);
  account_.magnitude = found.magnitude;
  account_.virial = found.virial;
  account_.speed = found.speed;
  shot.shadow = shot.total() + plan_.step * plan_.step * at.shadow_term;
  if (!std::isfinite(shot.total()))
    throw Error(Failure::numerical, "the energy is not finite at step " + std::to_string(shot.step) + ", time " +
                                        short_text(shot.time) + "; " +
                                        fastest(shot.particles ? *shot.particles : system_.particles) +
                                        "; use a smaller integrator.step");
  return shot;
}

template <int D>
void Monitor<D>::show(Snapshot<D> shot, bool last) {
  const double now = shot.time + plan_.slack();
  const bool frame = frames_.due() <= now || (last && shot.time > account_.last_frame);
  const bool row = rows_.due() <= now || (last && shot.time > account_.last_row);
  if (!frame && !row) return;
  const Stopwatch watch(statistics_.counters.seconds.output);
  const double collision_virial = statistics_.counters.collision_virial.value();
  const double collisions = account_.last_row >= 0 && shot.time > account_.last_row
                                ? (collision_virial - account_.last_row_virial) / (shot.time - account_.last_row)
                                : 0;  // no collisions before the start
  shot.pressure = pressure_of(account_.virial + collisions, system_.box, shot.time);
  const double work = statistics_.counters.shear.value();
  if (system_.box.sheared() && account_.last_row >= 0 && shot.time > account_.last_row)
    shot.shear_stress =
        (work - account_.last_row_shear) / (system_.box.strain(account_.last_row, shot.time) * system_.box.volume());
  shot.max_energy_error = statistics_.max_energy_error;
  // Only whole intervals count: the first row has had no collisions, the last one may be early.
  if (row && waits() && !transient_end_ && rows_.due() <= now && shot.time > statistics_.start_time)
    transient_end_ = transient_.add(shot.time, {shot.pressure, shot.potential});
  if (row) {
    shot.walls = wall_loads(shot.time);
    for (auto* observer : observers_) observer->thermo(shot);
    rows_.pass(now);
    account_.last_row = shot.time;
    account_.last_row_virial = collision_virial;
    account_.last_row_shear = work;
  }
  if (frame) {
    if (system_.decomposition.by_place()) shot.particles = &system_.decomposition.block();
    for (auto* observer : observers_) observer->frame(shot);
    frames_.pass(now);
    account_.last_frame = shot.time;
  }
}

/// The loads on all walls since the last row, which ends now.
template <int D>
std::vector<WallLoad> Monitor<D>::wall_loads(double time) {
  std::vector<WallLoad> loads;
  const double elapsed = account_.last_row >= 0 ? time - account_.last_row : 0;  // no force before the start
  const std::vector<WallTally>& tallies = statistics_.counters.walls;
  for (const Wall<D>& wall : system_.box.walls()) {
    const double impulse = wall.number < tallies.size() ? tallies[wall.number].impulse.value() : 0;
    if (last_row_impulses_.size() <= wall.number) last_row_impulses_.resize(wall.number + 1);
    const double since = impulse - std::exchange(last_row_impulses_[wall.number], impulse);
    loads.push_back({wall.number, elapsed > 0 ? since / elapsed : 0, system_.box.area(wall, time)});
  }
  return loads;
}

/// The overlaps of any two spheres that this rank sees, at this time in the slab: an independent check that no contact
/// was missed.
template <int D>
OverlapTally Monitor<D>::overlaps(double time) {
  OverlapTally found;
  const Box<D>& box = system_.box;
  const auto look = [&](const Particles<D>& p, Id i, Id j, const Image<D>& image) {
    const double sigma = box.steps.core_distance(p.id_of(i), p.id_of(j), p.radius[i] + p.radius[j]);
    const double squared = (p.x[i] - p.x[j] + box.shift(image)).squaredNorm();
    if (squared >= sigma * sigma) return;
    const double depth = 1 - std::sqrt(squared) / sigma;
    found.note_overlap(depth, [&] { return Overlap(depth, sigma, pair_key<D>(time, 0, p.id_of(i), p.id_of(j), {})); });
  };
  visit_close_pairs(system_, system_.particles, touching_ ? &*touching_ : nullptr, look);
  return found;
}

/// All particles, from a state of this rank's particles; with several ranks on rank 0 only.
template <int D>
const Particles<D>& Monitor<D>::all_particles(const Particles<D>& state) {
  Decomposition<D>& ranks = system_.decomposition;
  if (!ranks.joined()) return state;
  return gathered_ = gathered(ranks.ranks(), ranks.by_place() ? ranks.block() : state);
}

template class Monitor<2>;
template class Monitor<3>;

}  // namespace carom
