// acdda: discrete gradients on a time mesh of its own for each particle.
//
// In a slab [0, h] each particle has its own nodes, its collisions, and over each of its intervals moves with a mean
// velocity v̄ = v⁺ + I/2m, ending it with v⁻ = v⁺ + I/m. A pair applies to both partners, over each stretch [s, s'] of
// the union of their nodes, the impulse (s' − s) × (its quotient force between the separations at s and at s').
//
// Energy. Over an interval the kinetic energy changes by m v̄·(v⁻ − v⁺) = I·v̄, the sum over stretches of force · (own
// displacement). For the two partners of a pair these add up to force · (change of the separation) = −(V' − V) on every
// stretch. So kinetic plus potential energy telescopes over the slab, for any nodes whatever; collisions keep it too.
// Momentum: what one partner receives the other gives.
//
// The impulses depend on the paths and the paths on the impulses. Sweeps solve for both: sweep k runs the slab event by
// event on parabolas with the mean forces of sweep k − 1, which end where the chords end, and computes the impulses on
// the chords. (With straight flights pairs that bounce again and again make the sweeps diverge.)

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/error.h"
#include "engine/forces.h"
#include "engine/integrators/extrapolation.h"
#include "engine/integrators/mixing.h"
#include "engine/integrators/registry.h"
#include "engine/slab_core.h"

namespace carom::integrator {
namespace {

constexpr int kMostSweeps = 60;
constexpr int kPatience = 5;   // sweeps after which who has other partners than before gets a node of its own
constexpr int kMostTries = 4;  // of such nodes, before the slab is halved
constexpr int kMostPieces = 1 << 14;
constexpr double kWorstContraction = 0.5;
constexpr double kMixed = 0.2;  // contraction from which on sweeps are mixed
// What may be left of a particle's impulse, as a velocity and relative to the system's. In intervals before an inner
// node it enters the energy to first order, in last ones, whose ends are given with the newest impulses, to second.
constexpr double kInner = 2e-16, kLastAtMost = 1e-12, kLastAtLeast = 1e-15, kRounding = 1e-16;
constexpr double kStalled = 1e-13;  // where increments stop shrinking below this, rounding is amplified by collisions

/// Whether two events have the same partners, whenever they happen.
template <int D>
bool same_partners(const EventKey<D>& a, const EventKey<D>& b) {
  return a.kind == b.kind && a.lo == b.lo && a.hi == b.hi && a.image == b.image;
}

/// Whether everybody has the same partners in two sweeps, met in the same order.
template <int D>
bool same_meetings(const Histories<D>& a, const Histories<D>& b) {
  if (a.next != b.next) return false;
  for (std::size_t n = a.particles(); n < a.intervals(); ++n)
    if (!same_partners(a.opening[n], b.opening[n])) return false;
  return true;
}

/// Flights of a sweep: on the mean forces of the same interval in the sweep before.
template <int D>
class SweepRule : public NodeRule<D> {
 public:
  /// Null: no sweep before.
  void follow(const Histories<D>* before, std::size_t particles) {
    before_ = before;
    interval_.resize(particles);
    for (std::uint32_t i = 0; i < particles; ++i) interval_[i] = i;
  }
  void node(const Histories<D>& paths, Id i, double t, const EventKey<D>& key, Vec<D>& v, Vec<D>& a) override {
    const std::uint32_t m = paths.last[i];
    v = paths.velocity_in(m, t);
    a = paths.a[m];
    if (before_ == nullptr) return;
    const std::uint32_t expected = before_->next[interval_[i]];
    const bool same = expected != Histories<D>::kNone && same_partners(before_->opening[expected], key);
    interval_[i] = same ? expected : before_->at(i, t);
    a = before_->a[interval_[i]];
  }

 private:
  const Histories<D>* before_ = nullptr;
  std::vector<std::uint32_t> interval_;  // of the sweep before, where each particle is
};

template <int D>
class AsynchronousDiscreteDerivative : public Integrator<D> {
 public:
  explicit AsynchronousDiscreteDerivative(const Parameters& parameters)
      : max_events_(static_cast<std::uint64_t>(parameters.integer("max_events_per_step"))),
        accepted_(parameters.has("tolerance") ? parameters.real("tolerance") : 0),
        adaptive_(parameters.has("adaptive") ? parameters.real("adaptive") : 0) {}

  void start(System<D>& system, Counters& counters) override {
    scan_.emplace(system, max_events_);
    core_.emplace(system, *scan_, max_events_);
    const auto& mass = system.particles.mass;
    first_.resize(mass.size());
    evaluate_forces<D>(system, system.particles.x, first_, counters);
    for (std::size_t i = 0; i < mass.size(); ++i) first_[i] /= mass[i];
    extrapolation_.start(first_);
    memories_.resize(system.interactions.size());
  }

  void slab(System<D>& system, const Slab& slab, SlabReport<D>& report) override {
    counters_ = &report.counters;
    scan_->begin_slab(report.counters, report.contacts, extrapolation_.last(), slab.length);
    auto& p = system.particles;
    auto elastic = [&](const Touch<D>& touch) { collide_elastically(touch, p); };
    double done = 0, longest = slab.length;
    while (done < slab.length) {
      scan_->resolve(done, p.x, p.v, elastic);
      const double rest = slab.length - done;
      const double piece = std::min(longest, rest / std::max(1.0, std::ceil(rest / wanted_)));
      const Solution solution = solve(system, piece);
      if (!solution.settled) {
        longest = solution.cut > 0 ? solution.cut : 0.5 * piece;
        if (solution.cut > 0) {
          scan_->count_event(solution.key);
          continue;
        }
        ++report.counters.slabs_halved;
        if (longest * kMostPieces < slab.length && solution.crowd) scan_->too_many(solution.key);
        if (longest * kMostPieces < slab.length)
          throw Error(Failure::numerical, "the sweeps do not settle even in " + std::to_string(kMostPieces) +
                                              " pieces; the forces are not finite or far too stiff for step = " +
                                              std::to_string(slab.length));
        continue;
      }
      if (adaptive_ > 0 && !fits(p, piece, slab.length)) continue;
      finish(p);
      ++report.counters.pieces;
      scan_->commit(done, core_->contacts());
      if (!scan_->resting().empty()) scan_->slide(p.x, p.v);
      done = piece == rest ? slab.length : done + piece;
      longest = std::max(2 * piece, slab.length / kMostPieces);
    }
    system.wrap();
    report.reached = slab.length;
  }

 private:
  struct Solution {
    bool settled = false;
    double cut = 0;      ///< > 0: the slab must end there for everybody, by this event
    bool crowd = false;  ///< there were too many events, this one among them
    EventKey<D> key{};
  };

  /// Whether the path of a piece is as good as asked; sets the length to try next.
  bool fits(const Particles<D>& p, double piece, double slab_length) {
    const double error = path_error(p), best = 0.9 * piece * std::cbrt(adaptive_ / error);
    const bool good = error <= adaptive_ || piece * kMostPieces < slab_length;
    wanted_ = good ? std::min(best, 2 * std::max(piece, std::min(wanted_, slab_length))) : std::max(best, 0.2 * piece);
    return good;
  }

  /// The largest error of a position over a piece. Where the acceleration changes at the rate j, seen from one interval
  /// to the next, the parabola on its mean leaves the path by j s³/12 in a time s.
  double path_error(const Particles<D>& p) const {
    const Histories<D>& paths = *now_;
    double largest = 0;
    for (Id i = 0; i < p.size(); ++i) {
      double error = 0, before = extrapolation_.time()[i];
      Vec<D> a_before = extrapolation_.last()[i];
      for (std::uint32_t n = i; n != Histories<D>::kNone; n = paths.next[n]) {
        const double s = paths.duration(n);
        const Vec<D> a = impulse_[n] / (p.mass[i] * s);
        error += (a - a_before).norm() / (0.5 * (before + s)) * (s * s * s / 12);
        a_before = a;
        before = s;
      }
      largest = std::max(largest, error);
    }
    return largest;
  }

  /// Sweeps over a slab from the present positions until impulses and paths agree; leaves them in paths_ and impulse_.
  Solution solve(const System<D>& system, double length) {
    using End = typename SlabRun<D>::End;
    const Stopwatch watch(counters_->seconds.sweep);
    const auto& p = system.particles;
    const std::size_t n = p.size();
    extrapolation_.expect(length, first_);
    double margin = 0;
    for (Id i = 0; i < n; ++i) margin = std::max(margin, length * (p.v[i].norm() + 0.5 * length * first_[i].norm()));
    begin(system, kRoom * margin);
    extra_.clear();
    tolerance_ = std::max(kLastAtLeast, accepted_);
    bool mixes = false;
    const Histories<D>* before = nullptr;
    double last_change = 0, last_unsettled = 0, earlier_unsettled = 0, last_smooth = 0, earlier_smooth = 0;
    int tries = 0, slow = 0, since = 0;  // since: sweeps since the last node was added
    for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
      Histories<D>& paths = paths_[sweep % 2];
      paths.reset(length, p.x, p.v, before ? std::span<const Vec<D>>(before->a.data(), n) : first_);
      rule_.follow(before, n);
      const SlabRun<D> run = core_->run(paths, rule_, extra_);
      if (run.end == End::cut) return {.cut = run.time, .key = run.key};
      if (run.end == End::crowded) return {.crowd = true, .key = run.key};
      if (run.end == End::strayed) {
        if (!std::isfinite(run.margin)) return {};
        begin(system, kRoom * run.margin);
        before = nullptr;
        continue;
      }
      paths.close();
      mark_changed(paths, before);
      evaluate(system, paths);
      const bool alike = before != nullptr && same_meetings(paths, *before);
      if (mixes) mix(p, paths, alike);
      const Change change = compare(p, paths, mixes ? 0 : last_change, mixes);
      now_ = &paths;
      if (change.settled) return {.settled = true};
      if (!std::isfinite(change.largest)) return {};
      const bool patient = ++since > kPatience;
      const bool crawls = since > 2 && change.unsettled > kWorstContraction * kWorstContraction * earlier_unsettled;
      if (crawls && change.unsettled <= kStalled * change.speed) return {.settled = true};
      slow = crawls ? slow + 1 : 0;
      if (!mixes && alike && since > 2 &&
          change.smooth > std::max(kMixed * kMixed * earlier_smooth, 0.1 * change.unsettled)) {
        mixes = true;
        since = slow = 0;
        mixing_.clear();
        ++counters_->fallbacks;
      }
      const bool parted = (patient || slow > 2) && before != nullptr && separate(paths, *before);
      if (parted || (slow > 2 && steady(p, paths, change))) {
        since = slow = 0;
        if (++tries > kMostTries) return {};
      } else if (slow > 2) {
        return {};
      }
      earlier_unsettled = last_unsettled;
      last_unsettled = change.unsettled;
      earlier_smooth = last_smooth;
      last_smooth = change.smooth;
      last_change = change.largest;
      before = &paths;
    }
    return {};
  }

  void begin(const System<D>& system, double margin) {
    core_->begin(system.particles.x, margin);
    for (const auto& term : system.interactions) term->begin_slab(system.particles.x, margin);
    for (auto& memory : memories_) memory.impulse.clear();
    pairs_ = 0;
  }

  /// Whose path is not, bit for bit, that of the sweep before.
  void mark_changed(const Histories<D>& paths, const Histories<D>* before) {
    const std::size_t n = paths.particles();
    changed_.assign(n, 1);
    if (before == nullptr) return;
    for (Id i = 0; i < n; ++i)
      changed_[i] = !(paths.simple(i) && before->simple(i) && paths.chord[i] == before->chord[i]);
  }

  /// impulse_[n]: what interval n receives on these paths.
  void evaluate(const System<D>& system, const Histories<D>& paths) {
    const Stopwatch watch(counters_->seconds.force);
    impulse_.assign(paths.intervals(), Vec<D>::Zero());
    PairCounts counts;
    for (std::size_t k = 0; k < memories_.size(); ++k) {
      const PairCounts more = system.interactions[k]->add_impulses(paths, changed_, memories_[k], impulse_);
      counts.evaluations += more.evaluations;
      counts.pairs += more.pairs;
    }
    pairs_ = std::max(pairs_, counts.pairs);  // in the first sweep nothing is remembered
    if (pairs_ > 0) counters_->force_passes += static_cast<double>(counts.evaluations) / static_cast<double>(pairs_);
    ++counters_->sweeps;
    if (!scan_->resting().empty()) hold(system, paths);
  }

  /// Adds the reactions λ(d + d') of resting contacts, which do no work because they hold |d'| = |d|. Who rests has no
  /// inner nodes.
  void hold(const System<D>& system, const Histories<D>& paths) {
    const auto& mass = system.particles.mass;
    mean_.resize(paths.particles());
    for (Id i = 0; i < mean_.size(); ++i) mean_[i] = paths.v[i] + impulse_[i] / (2 * mass[i]);
    for (auto& contact : scan_->resting()) {
      const Id lo = contact.key.lo, hi = contact.key.hi;
      if (contact.key.kind == EventKind::pair)
        contact.normal = 2 * (paths.x[lo] - paths.x[hi] + system.box.shift(contact.key.image)) +
                         paths.length * (paths.chord[lo] - paths.chord[hi]);
      contact.lambda = contact.bound = 0;
    }
    press_apart<D>(scan_->resting(), mass, mean_);
    for (const auto& contact : scan_->resting()) {
      const Id lo = contact.key.lo, hi = contact.key.hi;
      impulse_[lo] = 2 * mass[lo] * (mean_[lo] - paths.v[lo]);
      if (contact.key.kind == EventKind::pair) impulse_[hi] = 2 * mass[hi] * (mean_[hi] - paths.v[hi]);
    }
  }

  /// Accelerates the sweeps, in terms of the velocities that impulses give, as long as everybody meets the same.
  void mix(const Particles<D>& p, const Histories<D>& paths, bool alike) {
    if (!alike) mixing_.clear();
    const auto size = static_cast<Eigen::Index>(D * paths.intervals());
    Eigen::VectorXd flown(size), lacking(size);
    for (Id i = 0; i < paths.particles(); ++i)
      for (std::uint32_t n = i; n != Histories<D>::kNone; n = paths.next[n]) {
        flown.segment<D>(D * n) = paths.duration(n) * paths.a[n];
        lacking.segment<D>(D * n) = impulse_[n] / p.mass[i] - paths.duration(n) * paths.a[n];
      }
    mixing_.add(flown, lacking);
  }

  struct Change {
    double largest = 0;    ///< of an impulse from the one flown on, as a velocity
    double unsettled = 0;  ///< the same among those who have not settled
    double smooth = 0;     ///< and have no inner nodes
    double speed = 0;      ///< of the system
    bool settled = true;
  };

  /// Compares the impulses with those flown on, and replaces the accelerations of paths by the new ones where there is
  /// a difference that matters: who has settled keeps his path bit for bit.
  Change compare(const Particles<D>& p, Histories<D>& paths, double last_change, bool mixes) {
    Change change;
    const auto particles = static_cast<Id>(paths.particles());
    for (Id i = 0; i < particles; ++i)
      change.speed =
          std::max({change.speed, paths.v[i].squaredNorm(), impulse_[i].squaredNorm() / (p.mass[i] * p.mass[i])});
    change.speed = std::sqrt(change.speed);
    auto difference = [&](Id i, std::uint32_t n, double time) {
      return (impulse_[n] / p.mass[i] - time * paths.a[n]).norm();
    };
    for (Id i = 0; i < particles; ++i)
      for (std::uint32_t n = i; n != Histories<D>::kNone; n = paths.next[n]) {
        const double d = difference(i, n, paths.duration(n));
        change.largest = d > change.largest || std::isnan(d) ? d : change.largest;
      }
    // What the newest impulses still lack is the change times the contraction, this change over the last. It is known
    // best while nobody has settled.
    if (last_change > 0)
      tolerance_ = std::max(tolerance_, std::min(kRounding * last_change / change.largest, kLastAtMost));
    const double last = tolerance_ * change.speed;
    for (Id i = 0; i < particles; ++i)
      for (std::uint32_t n = i; n != Histories<D>::kNone; n = paths.next[n]) {
        const double time = paths.duration(n), inner = std::max(kInner, accepted_) * change.speed;
        const double d = difference(i, n, time);
        if (d <= (paths.next[n] == Histories<D>::kNone ? last : inner)) continue;
        change.unsettled = std::max(change.unsettled, d);
        if (paths.simple(i)) change.smooth = std::max(change.smooth, d);
        paths.a[n] = impulse_[n] / (p.mass[i] * time);
        if (mixes) paths.a[n] += mixing_.correction().template segment<D>(D * n) / time;
        change.settled = false;
      }
    return change;
  }

  /// Gives everybody whose partners differ from sweep to sweep a node where they first do; whether there was anyone.
  bool separate(const Histories<D>& paths, const Histories<D>& before) {
    const std::size_t known = extra_.size();
    constexpr auto kNone = Histories<D>::kNone;
    for (Id i = 0; i < paths.particles(); ++i) {
      std::uint32_t m = paths.next[i], n = before.next[i];
      while (m != kNone && n != kNone && same_partners(paths.opening[m], before.opening[n])) {
        m = paths.next[m];
        n = before.next[n];
      }
      if (m == kNone && n == kNone) continue;
      const double time = std::min(m == kNone ? kNever : paths.start[m], n == kNone ? kNever : before.start[n]);
      extra_.push_back({i, time});
    }
    return extra_.size() > known;
  }

  /// Gives colliders whose impulses change slowly a node a little before their first collision, so that the force on
  /// the way to it hardly depends on when it comes; whether there was anyone. (A grazing contact moves much with the
  /// force.) `paths` have their new accelerations already: where these differ, the chord tells.
  bool steady(const Particles<D>& p, const Histories<D>& paths, const Change& change) {
    constexpr double kBefore = 0.1;  // in parts of the way
    const std::size_t known = extra_.size();
    for (Id i = 0; i < paths.particles(); ++i) {
      if (paths.simple(i)) continue;
      double moved = 0;
      std::uint32_t first = Histories<D>::kNone;
      for (std::uint32_t n = i; n != Histories<D>::kNone; n = paths.next[n]) {
        moved = std::max(moved, (impulse_[n] / p.mass[i] - 2 * (paths.chord[n] - paths.v[n])).norm());
        const std::uint32_t next = paths.next[n];
        if (first == Histories<D>::kNone && next != Histories<D>::kNone && !is_extra(paths.opening[next])) first = n;
      }
      if (first != Histories<D>::kNone && moved > 0.1 * change.unsettled)
        extra_.push_back({i, paths.end(first) - kBefore * paths.duration(first)});
    }
    return extra_.size() > known;
  }

  /// Moves the particles to the end of the slab: last intervals with the newest impulses. What inner ones lack of
  /// theirs is added to the last velocity, so that no momentum is lost.
  void finish(Particles<D>& p) {
    const Histories<D>& paths = *now_;
    extrapolation_.pass(paths.length);
    for (Id i = 0; i < p.size(); ++i) {
      const double mass = p.mass[i];
      Vec<D> lacking = Vec<D>::Zero();
      std::uint32_t n = i;
      for (; paths.next[n] != Histories<D>::kNone; n = paths.next[n])
        lacking += impulse_[n] / mass - (paths.velocity_in(n, paths.end(n)) - paths.v[n]);
      const double time = paths.duration(n);
      p.x[i] = paths.x[n] + time * (paths.v[n] + impulse_[n] / (2 * mass));
      p.v[i] = paths.v[n] + impulse_[n] / mass + lacking;
      extrapolation_.add(i, impulse_[n] / (mass * time), time);
    }
  }

  static constexpr double kRoom = 1.25;  // margins in units of the farthest path

  std::uint64_t max_events_;
  double accepted_;  // for what the sweeps may leave, relative; 0: rounding
  double adaptive_;  // local error of paths that pieces are fitted to; 0: they are not
  double wanted_ = std::numeric_limits<double>::infinity();  // length of the next piece
  std::optional<ContactScan<D>> scan_;
  std::optional<SlabCore<D>> core_;
  Extrapolation<D> extrapolation_;
  SweepRule<D> rule_;
  Histories<D> paths_[2];
  const Histories<D>* now_ = nullptr;
  std::vector<Vec<D>> first_, impulse_, mean_;
  std::vector<char> changed_;
  std::vector<PairMemory<D>> memories_;
  std::vector<ExtraNode> extra_;
  std::uint64_t pairs_ = 0;  // within reach
  double tolerance_ = 0;     // of last intervals, relative
  Mixing mixing_;
  Counters* counters_ = nullptr;
};

}  // namespace

IntegratorInfo acdda() {
  return {
      .name = "acdda",
      .title = "Asynchronous Collision Discrete Derivative Algorithm",
      .order = "2",
      .conserves = "energy and linear momentum to rounding, for any step; angular momentum in slabs without collisions",
      .parameters = {parameter::step(),
                     {.name = "tolerance",
                      .type = Parameter::Type::real,
                      .fallback = "none",
                      .unit = "-",
                      .meaning =
                          "what sweeps may leave of an impulse, as a velocity and relative to the fastest; trades "
                          "exact energy for fewer force passes; absent: rounding",
                      .range = Parameter::Range::positive},
                     {.name = "adaptive",
                      .type = Parameter::Type::real,
                      .fallback = "none",
                      .unit = "length",
                      .meaning = "cuts steps into pieces so short that the estimated error of a position in a piece "
                                 "stays below this; absent: steps are not cut",
                      .range = Parameter::Range::positive},
                     parameter::max_events_per_step()},
      .documentation =
          "Discrete-gradient steps in which each particle has a time mesh of its own: a collision cuts the step of "
          "the colliders only, and the energy is exact for any meshes. Steps are solved by sweeps, each of which "
          "costs a force pass at most and its collisions, whatever the number of particles. Where the forces are stiff "
          "the sweeps are mixed (Anderson 1965).",
      .source =
          "this project; relatives: Lew, Marsden, Ortiz, West, Arch. Ration. Mech. Anal. 167 (2003) 85; Logg, SIAM "
          "J. Sci. Comput. 24 (2003) 1879; Gonzalez, J. Nonlinear Sci. 6 (1996) 449",
      .in_2d = make<AsynchronousDiscreteDerivative, 2>,
      .in_3d = make<AsynchronousDiscreteDerivative, 3>};
}

}  // namespace carom::integrator
