#include "engine/simulation.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "engine/error.h"
#include "engine/forces.h"
#include "engine/neighbour_list.h"

namespace carom {

namespace {
/// Due times and ends are met up to this share of a step.
constexpr double kTimeSlack = 1e-9;

/// S_h costs two passes over all pairs. Systems larger than this are measured at thermo rows and frames only.
constexpr std::size_t kShadowAtEveryStep = 100;

/// The next of the times 0, interval, 2·interval, …; never, where there is no interval.
struct Schedule {
  double interval;
  std::int64_t next = 1;  // the first output is made at the start, whatever the interval
  double due() const {
    return interval > 0 ? static_cast<double>(next) * interval : std::numeric_limits<double>::infinity();
  }
  bool reached(double time, double slack) const { return due() <= time + slack; }
  void pass(double time, double slack) {
    while (reached(time, slack)) ++next;
  }
};
}  // namespace

/// Everything that is measured on the way.
template <int D>
struct Simulation<D>::Monitor {
  explicit Monitor(Simulation& run)
      : simulation(run), frames{run.plan_.frame_interval}, thermo{run.plan_.thermo_interval} {
    const auto& box = run.system_->box;
    for (int k = 0; k < D; ++k) momentum_kept = momentum_kept && !box.walled(k);
    for (const auto& term : run.system_->interactions) momentum_kept = momentum_kept && term->keeps_momentum();
    const std::size_t n = run.system_->particles.size();
    if (run.info_.shadow) force.resize(n), scratch.resize(n);
    if (run.info_.hard_cores) touching.emplace(box, run.system_->particles.radius);
  }

  /// The deepest overlap of any two spheres, relative to their contact distance: an independent check that no contact
  /// was missed. Not positive where none overlap.
  double deepest_overlap() {
    const System<D>& system = *simulation.system_;
    const auto& p = system.particles;
    double deepest = 0;
    for (const auto& pair : touching->cover(p.x)) {
      const double sigma = p.radius[pair.i] + p.radius[pair.j];
      const double squared = (p.x[pair.i] - p.x[pair.j] + system.box.shift(pair.image)).squaredNorm();
      if (squared < sigma * sigma) deepest = std::max(deepest, 1 - std::sqrt(squared) / sigma);
    }
    return deepest;
  }

  /// Energies, momentum, temperature and instantaneous pressure of a state; `energies_at` where energies are measured.
  Snapshot<D> measure(double time, std::int64_t step, const Particles<D>& state, const Particles<D>& energies_at,
                      bool with_shadow) {
    const Stopwatch watch(simulation.statistics_.counters.seconds.output);
    const System<D>& system = *simulation.system_;
    Snapshot<D> shot;
    shot.time = time;
    shot.step = step;
    shot.collisions = simulation.statistics_.counters.sphere_sphere;
    shot.particles = &state;
    const PotentialSums sums = evaluate_energy<D>(system, energies_at.x);
    shot.kinetic = kinetic_energy(energies_at);
    shot.potential = sums.energy.value();
    magnitude = shot.kinetic + sums.magnitude.value();
    if (simulation.info_.shadow && with_shadow) {
      Counters uncounted;
      evaluate_forces<D>(system, energies_at.x, force, uncounted);
      const double g = shadow_term<D>(system, energies_at, force, scratch, uncounted);
      shot.shadow = shot.total() + simulation.plan_.step * simulation.plan_.step * g;
    }
    shot.momentum = total_momentum(state);
    const double dof = static_cast<double>(D) * static_cast<double>(state.size());
    shot.temperature = dof > 0 ? 2 * shot.kinetic / dof : 0;
    smooth_virial = 2 * shot.kinetic + sums.virial.value();
    if (!std::isfinite(shot.total()))
      throw Error(Failure::numerical, "the energy is not finite at step " + std::to_string(step) + ", time " +
                                          std::to_string(time) + "; use a smaller integrator.step");
    return shot;
  }

  /// The virial pressure, collisions taken since the last thermo row.
  double pressure(double time, double collision_virial) const {
    const double interval = time - last_row_time;
    const double collisions = interval > 0 ? (collision_virial - last_row_virial) / interval : 0;
    return (smooth_virial + collisions) / (D * simulation.system_->box.volume());
  }

  /// Shows a state to the observers whose time has come.
  void show(Snapshot<D> shot, double slack, bool last) {
    const bool frame = frames.reached(shot.time, slack) || (last && shot.time > last_frame_time);
    const bool row = thermo.reached(shot.time, slack) || (last && shot.time > last_row_time);
    if (!frame && !row) return;
    const Stopwatch watch(simulation.statistics_.counters.seconds.output);
    const double virial = simulation.statistics_.counters.collision_virial.value();
    shot.max_energy_error = simulation.statistics_.max_energy_error;
    shot.pressure = pressure(shot.time, virial);
    if (row) {
      for (auto* observer : simulation.observers_) observer->thermo(shot);
      thermo.pass(shot.time, slack);
      last_row_time = shot.time;
      last_row_virial = virial;
    }
    if (frame) {
      for (auto* observer : simulation.observers_) observer->frame(shot);
      frames.pass(shot.time, slack);
      last_frame_time = shot.time;
    }
  }

  /// The next time at which anybody wants to see something.
  double next_due() const { return std::min(frames.due(), thermo.due()); }

  Simulation& simulation;
  Schedule frames, thermo;
  bool momentum_kept = true;
  Vec<D> first_momentum = Vec<D>::Zero();
  double first_energy = 0, first_shadow = 0;  // H₁ and S_h,1
  double magnitude = 0, smooth_virial = 0;    // of the last measurement: K + Σ|V|, 2K + Σ d·F
  double last_row_time = -1, last_frame_time = -1, last_row_virial = 0;
  double virial_time = 0;  // ∫ (2K + Σ d·F) dt
  std::vector<Vec<D>> force, scratch;
  std::optional<NeighbourList<D>> touching;  // pairs that may overlap
};

template <int D>
Simulation<D>::Simulation(std::unique_ptr<System<D>> system, const IntegratorInfo& info,
                          std::unique_ptr<Integrator<D>> integrator, Plan plan)
    : system_(std::move(system)), info_(info), integrator_(std::move(integrator)), plan_(plan) {
  if (!(plan_.step > 0)) throw Error(Failure::deck, "the step must be positive");
  if (!plan_.steps && !plan_.end_time && !plan_.collisions)
    throw Error(Failure::deck, "the plan has no end; give steps, end_time or collisions");
}

template <int D>
Simulation<D>::~Simulation() = default;

template <int D>
void Simulation<D>::run(const std::function<bool()>& should_stop) {
  const auto clock_start = std::chrono::steady_clock::now();
  Statistics& s = statistics_;
  const double slack = kTimeSlack * plan_.step;
  Monitor monitor(*this);
  auto& counters = s.counters;

  integrator_->start(*system_, counters);
  const auto& particles = system_->particles;
  auto energy_state = [&]() -> const Particles<D>& {
    const auto* nodes = integrator_->energy_state();
    return nodes ? *nodes : particles;
  };
  Snapshot<D> shot = monitor.measure(0, 0, particles, energy_state(), true);
  s.energy_initial = s.energy_final = monitor.first_energy = shot.total();
  s.energy_reference = std::max(std::abs(shot.total()), monitor.magnitude);
  monitor.first_shadow = shot.shadow;
  monitor.first_momentum = shot.momentum;
  s.energy_after_first_step = shot.total();
  if (info_.shadow) s.max_shadow_energy_error = 0;
  if (monitor.momentum_kept) s.max_momentum_error = 0;
  monitor.show(shot, slack, true);

  std::vector<Contact<D>> contacts;
  std::vector<double> observe;
  auto finished = [&] {
    return (plan_.steps && s.steps >= *plan_.steps) || (plan_.end_time && s.end_time >= *plan_.end_time - slack) ||
           (plan_.collisions && counters.sphere_sphere >= *plan_.collisions);
  };
  while (!finished()) {
    if (should_stop && should_stop()) {
      s.stopped_early = true;
      break;
    }
    Slab slab;
    slab.index = s.steps;
    slab.start = static_cast<double>(s.steps) * plan_.step;
    slab.length = plan_.step;
    if (plan_.end_time && slab.start + plan_.step > *plan_.end_time - slack) slab.length = *plan_.end_time - slab.start;
    if (plan_.collisions && !info_.stepping) slab.collision_limit = *plan_.collisions;

    SlabReport<D> report{.counters = counters};
    contacts.clear();
    if (plan_.events) report.contacts = &contacts;
    observe.clear();
    if (!info_.stepping) {
      Schedule frames = monitor.frames, thermo = monitor.thermo;
      for (double due; (due = std::min(frames.due(), thermo.due())) < slab.start + slab.length - slack;) {
        observe.push_back(due - slab.start);
        frames.pass(due, slack);
        thermo.pass(due, slack);
      }
    }
    report.observe = observe;
    report.observer = [&](double offset, const Particles<D>& copies) {
      monitor.show(monitor.measure(slab.start + offset, s.steps, copies, copies, false), slack, false);
    };
    integrator_->slab(*system_, slab, report);
    ++s.steps;
    // Whole slabs end at whole multiples of the step, a shortened one at the end of the plan: no rounding piles up.
    if (report.reached < slab.length)
      s.end_time = slab.start + report.reached;
    else
      s.end_time = slab.length == plan_.step ? static_cast<double>(s.steps) * plan_.step : *plan_.end_time;
    s.force_passes = counters.force_passes;

    const bool with_shadow = particles.size() <= kShadowAtEveryStep || s.steps == 1 ||
                             monitor.next_due() <= s.end_time + slack || finished();
    shot = monitor.measure(s.end_time, s.steps, particles, energy_state(), with_shadow);
    s.energy_final = shot.total();
    if (info_.hard_cores) counters.max_overlap = std::max(counters.max_overlap, monitor.deepest_overlap());
    if (s.steps == 1 && info_.stepping) {
      monitor.first_energy = shot.total();
      monitor.first_shadow = shot.shadow;
      s.energy_after_first_step = shot.total();
      s.energy_reference = std::max(std::abs(shot.total()), monitor.magnitude);
    }
    s.max_energy_error = std::max(s.max_energy_error, std::abs(shot.total() - monitor.first_energy));
    if (info_.shadow && with_shadow)
      s.max_shadow_energy_error = std::max(*s.max_shadow_energy_error, std::abs(shot.shadow - monitor.first_shadow));
    if (monitor.momentum_kept)
      s.max_momentum_error = std::max(*s.max_momentum_error, (shot.momentum - monitor.first_momentum).norm());
    monitor.virial_time += report.reached * monitor.smooth_virial;
    if (s.end_time > 0) {
      s.mean_pressure =
          (monitor.virial_time + counters.collision_virial.value()) / (s.end_time * D * system_->box.volume());
      s.collision_rate =
          2.0 * static_cast<double>(counters.sphere_sphere) / (static_cast<double>(particles.size()) * s.end_time);
    }
    s.fraction_done = std::max(
        {plan_.steps ? static_cast<double>(s.steps) / static_cast<double>(*plan_.steps) : 0.0,
         plan_.end_time ? s.end_time / *plan_.end_time : 0.0,
         plan_.collisions ? static_cast<double>(counters.sphere_sphere) / static_cast<double>(*plan_.collisions)
                          : 0.0});
    s.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - clock_start).count();

    if (plan_.events) {
      const Stopwatch watch(counters.seconds.output);
      for (auto* observer : observers_) observer->contacts(slab.start, contacts);
    }
    monitor.show(shot, slack, finished());
    for (auto* observer : observers_) observer->progress(s);
  }
  if (s.stopped_early) monitor.show(shot, slack, true);
  s.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - clock_start).count();
}

template class Simulation<2>;
template class Simulation<3>;

}  // namespace carom
