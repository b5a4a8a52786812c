// acva: collision Verlet with a time mesh of its own for each particle.
//
// Every particle flies on its own parabola from its last node, with the acceleration it had there. At a collision only
// the colliders get a node: their accelerations are evaluated there, among neighbours on their parabolas, and they
// arrive with v⁻ = v⁺ + I/m, where I sums over the particle's pairs the trapezoidal rule on the union of both partners'
// nodes since the particle's last one. Both partners use the same trapezoids, so what one receives the other gives.
// Without collisions a slab is a kick-drift-kick step.

#include <algorithm>
#include <optional>
#include <utility>

#include "engine/integrators/kicks.h"
#include "engine/integrators/part_sweeps.h"
#include "engine/integrators/registry.h"
#include "engine/shared_contacts.h"
#include "engine/slab_core.h"

namespace carom::integrator {
namespace {

/// Nodes by the trapezoidal rule.
template <int D>
class TrapezoidRule : public NodeRule<D> {
 public:
  TrapezoidRule(const System<D>& system, const PartSweeps<D>& others) : system_(system), others_(others) {}

  void node(const Histories<D>& paths, Id i, double t, const EventKey<D>&, Vec<D>& v, Vec<D>& a) override {
    Vec<D> impulse = Vec<D>::Zero(), force = Vec<D>::Zero();
    for (const auto& term : system_.interactions) count(i, term->add_trapezoids(paths, i, t, impulse, force));
    v = paths.v[paths.last[i]] + impulse / system_.particles.mass[i];
    a = force / system_.particles.mass[i];
  }

  /// See Interaction::add_corrections.
  void correct(const Histories<D>& paths, Id i, std::vector<Vec<D>>& impulse) {
    for (const auto& term : system_.interactions) count(i, term->add_corrections(paths, i, impulse));
  }

  /// Evaluations of pair forces since this was asked last; of this rank's own particles, where it knows only some.
  std::uint64_t take_evaluations() { return std::exchange(evaluations_, 0); }

 private:
  void count(Id i, std::uint64_t evaluations) { evaluations_ += others_.counts(i) ? evaluations : 0; }

  const System<D>& system_;
  const PartSweeps<D>& others_;
  std::uint64_t evaluations_ = 0;
};

template <int D>
class AsynchronousCollisionVerlet : public Integrator<D> {
 public:
  explicit AsynchronousCollisionVerlet(const Parameters& parameters)
      : max_events_(static_cast<std::uint64_t>(parameters.integer("max_events_per_step"))) {}

  void start(System<D>& system, Counters& counters) override {
    regroup(system);
    accelerations_.update(system, counters);
  }

  bool local() const override { return true; }
  void pack(Id i, Bytes& to) const override { accelerations_.pack(i, to); }
  void unpack(Id i, Reader& from) override { accelerations_.unpack(i, from); }
  void release() override {
    core_.reset();
    scan_.reset();
    paths_ = Histories<D>();
    for (auto* vectors : {&flight_, &first_, &correction_}) *vectors = std::vector<Vec<D>>();
  }
  void regroup(System<D>& system) override {
    scan_.emplace(system, max_events_);
    core_.emplace(system, *scan_, max_events_);
    others_ = PartSweeps<D>(system);
    rule_.emplace(system, others_);
    accelerations_.a.resize(system.particles.size());
  }

  void slab(System<D>& system, const Slab& slab, SlabReport<D>& report) override {
    auto& p = system.particles;
    scan_->begin_slab(report.counters, report.contacts, accelerations_.a, slab.length);
    if (!others_) {
      advance_all(system, slab, report);
    } else if (!advance_some(system, slab, report)) {
      report.unsure = true;
      return;
    }
    std::uint64_t evaluations = rule_->take_evaluations();
    if (others_) others_.ranks().sum({&evaluations, 1});
    if (slab.index % kCountPairs == 0 || pairs_ == 0) {
      pairs_ = 0;
      for (const auto& term : system.interactions) pairs_ += term->interacting_pairs(p.x);
      if (system.part) system.part->ranks().sum({&pairs_, 1});
    }
    if (pairs_ > 0) report.counters.force_passes += static_cast<double>(evaluations) / static_cast<double>(pairs_);
    system.wrap();
    report.reached = slab.length;
  }

 private:
  void advance_all(System<D>& system, const Slab& slab, SlabReport<D>& report) {
    auto& p = system.particles;
    auto elastic = [&](const Touch<D>& touch) { collide_elastically(touch, p); };
    for (double done = 0; done < slab.length;) {
      scan_->resolve(done, p.x, p.v, elastic);
      flight_ = accelerations_.a;
      const double rest = slab.length - done;
      if (!scan_->resting().empty()) scan_->hold(p.v, flight_, rest);
      const double piece = fly(system, rest);
      scan_->commit(done, core_->contacts());
      finish(system, report.counters);
      done = piece == rest ? slab.length : done + piece;
    }
  }

  /// A slab of the particles that this rank knows. False, and nothing has been done, where it takes more than that: an
  /// earlier end, contacts at its start, or more particles.
  bool advance_some(System<D>& system, const Slab& slab, SlabReport<D>& report) {
    auto& p = system.particles;
    rule_->take_evaluations();
    if (others_.any(!scan_->quiet(p.x, p.v))) return false;
    flight_ = accelerations_.a;
    const double margin = kRoom * others_.largest(farthest(p, slab.length));
    if (!system.part->covers(margin)) return false;
    begin(system, slab.length, margin);
    if (others_.any(core_->run(paths_, *rule_).end != SlabRun<D>::End::complete)) return false;
    if (!others_.agree(paths_)) {
      system.part->deepen();
      return false;
    }
    if (!commit_contacts<D>(system, core_->contacts(), max_events_, report.counters, report.contacts)) return false;
    finish(system, report.counters);
    system.part->refresh(p.v);
    return true;
  }

  /// How far anybody would come [length].
  double farthest(const Particles<D>& p, double length) const {
    double farthest = 0;
    for (std::size_t i = 0; i < p.size(); ++i)
      farthest = std::max(farthest, length * (p.v[i].norm() + 0.5 * length * flight_[i].norm()));
    return farthest;
  }

  /// Gets ready for a slab in which nobody strays farther than `margin`.
  void begin(const System<D>& system, double length, double margin) {
    const auto& p = system.particles;
    core_->begin(p.x, margin);
    for (const auto& term : system.interactions) term->begin_slab(p.x, margin);
    reset(p, length);
  }
  void reset(const Particles<D>& p, double length) {
    paths_.reset(length, p.x, p.v);
    std::ranges::copy(flight_, paths_.a.begin());
  }

  /// Flies everybody through a slab of this length, or a shorter one where it has to end for everybody; returns its
  /// length and leaves the histories in paths_.
  double fly(const System<D>& system, double length) {
    using End = typename SlabRun<D>::End;
    const auto& p = system.particles;
    double margin = farthest(p, length);
    for (;;) {
      begin(system, length, kRoom * margin);
      SlabRun<D> run;
      while ((run = core_->run(paths_, *rule_)).end == End::cut) {
        scan_->count_event(run.key);
        length = run.time;
        reset(p, length);
      }
      if (run.end == End::complete) return length;
      if (run.end == End::crowded) scan_->too_many(run.key);
      margin = run.margin;
    }
  }

  /// Moves everybody to the end of the slab in paths_, with the second half of the kick.
  void finish(System<D>& system, Counters& counters) {
    auto& p = system.particles;
    const auto n = static_cast<Id>(p.size());
    correction_.assign(n, Vec<D>::Zero());
    for (Id i = 0; i < n; ++i)
      if (!paths_.simple(i)) rule_->correct(paths_, i, correction_);
    for (Id i = 0; i < n; ++i) p.x[i] = paths_.position_in(paths_.last[i], paths_.length);
    if (others_) system.part->refresh(p.x);
    first_.swap(accelerations_.a);
    accelerations_.update(system, counters);
    for (Id i = 0; i < n; ++i) {
      // The first half of the kick without what presses resting contacts together.
      const Vec<D>& before = paths_.simple(i) ? flight_[i] : first_[i];
      p.v[i] = paths_.v[paths_.last[i]] + (0.5 * paths_.length) * (before + accelerations_.a[i]) +
               correction_[i] / p.mass[i];
    }
    if (!scan_->resting().empty()) scan_->stop_approach(p.x, p.v);
  }

  static constexpr double kRoom = 1.25;            // margins in units of the farthest path
  static constexpr std::int64_t kCountPairs = 64;  // slabs between counts of the pairs within reach

  std::uint64_t max_events_;
  std::optional<ContactScan<D>> scan_;
  std::optional<SlabCore<D>> core_;
  PartSweeps<D> others_;
  std::optional<TrapezoidRule<D>> rule_;
  Accelerations<D> accelerations_;
  Histories<D> paths_;
  std::vector<Vec<D>> flight_, first_, correction_;
  std::uint64_t pairs_ = 0;
};

}  // namespace

IntegratorInfo acva() {
  return {.name = "acva",
          .title = "Asynchronous Collision Verlet Algorithm",
          .order = "2",
          .conserves = "linear momentum to rounding; energy to order 2, with a random walk from collision to collision",
          .parameters = {parameter::step(), parameter::max_events_per_step()},
          .documentation =
              "Collision Verlet in which each particle has a time mesh of its own: a collision cuts the step of the "
              "colliders only, and costs the forces on them instead of a whole force pass.",
          .source =
              "this project; relatives: Houndonougbo, Laird, Leimkuhler, Mol. Phys. 98 (2000) 309; Lew, Marsden, "
              "Ortiz, West, Arch. Ration. Mech. Anal. 167 (2003) 85",
          .shadow = true,
          .in_2d = make<AsynchronousCollisionVerlet, 2>,
          .in_3d = make<AsynchronousCollisionVerlet, 3>};
}

}  // namespace carom::integrator
