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
#include <array>
#include <cmath>
#include <optional>
#include <tuple>

#include "engine/error.h"
#include "engine/forces.h"
#include "engine/integrators/extrapolation.h"
#include "engine/integrators/mixing.h"
#include "engine/integrators/part_sweeps.h"
#include "engine/integrators/registry.h"
#include "engine/integrators/sweep_rule.h"
#include "engine/shared_contacts.h"
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

template <int D>
class AsynchronousDiscreteDerivative : public Integrator<D> {
 public:
  explicit AsynchronousDiscreteDerivative(const Parameters& parameters)
      : max_events_(static_cast<std::uint64_t>(parameters.integer("max_events_per_step"))),
        accepted_(parameters.has("tolerance") ? parameters.real("tolerance") : 0),
        adaptive_(parameters.has("adaptive") ? parameters.real("adaptive") : 0) {}

  bool local() const override { return adaptive_ == 0; }
  void pack(Id i, Bytes& to) const override { extrapolation_.pack(i, to); }
  void unpack(Id i, Reader& from) override { extrapolation_.unpack(i, from); }
  void regroup(System<D>& system) override {
    scan_.emplace(system, max_events_);
    core_.emplace(system, *scan_, max_events_);
    others_ = PartSweeps<D>(system);
    extrapolation_.resize(system.particles.size());
    impulse_.clear();
  }

  void start(System<D>& system, Counters& counters) override {
    regroup(system);
    total_ = system.particles.size();
    const auto& mass = system.particles.mass;
    std::vector<Vec<D>> a(mass.size());
    evaluate_forces<D>(system, system.particles.x, a, counters);
    for (std::size_t i = 0; i < mass.size(); ++i) a[i] /= mass[i];
    extrapolation_.start(a);
    memories_.resize(system.interactions.size());
    for (const auto& term : system.interactions) remembers_ = remembers_ && term->remembers();
  }

  void slab(System<D>& system, const Slab& slab, SlabReport<D>& report) override {
    counters_ = &report.counters;
    scan_->begin_slab(report.counters, report.contacts, extrapolation_.last(), slab.length);
    auto& p = system.particles;
    auto elastic = [&](const Touch<D>& touch) { collide_elastically(touch, p); };
    double done = 0, longest = slab.length;
    if (others_) {
      report.unsure = !advance_some(system, slab, report);
      return;
    }
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

  /// A slab in one piece, of the particles that this rank knows. False, and nothing has been done, where it takes more
  /// than that: pieces, contacts at its start, acceleration, or more particles.
  bool advance_some(System<D>& system, const Slab& slab, SlabReport<D>& report) {
    auto& p = system.particles;
    if (others_.any(!scan_->quiet(p.x, p.v))) return false;
    if (!solve(system, slab.length).settled) return false;
    if (!commit_contacts<D>(system, core_->contacts(), max_events_, *counters_, report.contacts)) return false;
    finish(p);
    system.part->tell(
        [&](Id i, Bytes& to) {
          put(to, p.x[i]);
          put(to, p.v[i]);
          put(to, extrapolation_.last()[i]);
          put(to, extrapolation_.time()[i]);
        },
        [&](Id i, Reader& from) {
          p.x[i] = from.get<Vec<D>>();
          p.v[i] = from.get<Vec<D>>();
          const auto a = from.get<Vec<D>>();
          extrapolation_.add(i, a, from.get<double>());
        });
    ++counters_->pieces;
    system.wrap();
    report.reached = slab.length;
    return true;
  }

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
    const Histories<D>& paths = paths_;
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
    Histories<D>& paths = paths_;
    auto reset = [&] {
      paths.reset(length, p.x, p.v);
      extrapolation_.expect(length, paths.a);
    };
    reset();
    double margin = 0;
    for (Id i = 0; i < n; ++i) margin = std::max(margin, length * (p.v[i].norm() + 0.5 * length * paths.a[i].norm()));
    margin = others_.largest(margin);
    if (others_ && !system.part->covers(kRoom * margin)) return {};
    begin(system, kRoom * margin);
    extra_.clear();
    tolerance_ = std::max(kLastAtLeast, accepted_);
    bool mixes = false, first = true;
    double last_change = 0, last_unsettled = 0, earlier_unsettled = 0, last_smooth = 0, earlier_smooth = 0;
    bool more_nodes = false;             // than the sweep before had
    int tries = 0, slow = 0, since = 0;  // since: sweeps since the last node was added
    for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
      bool late = !first && !mixes && remembers_ && scan_->resting().empty() && !more_nodes && few_;
      SlabRun<D> run;
      const bool run_late = late;
      if (late) {
        run = core_->repair(paths, rule_, extra_, unsettled_);
        late = run.end != End::lost;
      }
      if (!late) {
        rule_.follow(first, n);
        run = core_->run(paths, rule_, extra_);
      }
      if (others_ && others_.any(run.end != End::complete || late != run_late)) return {};
      if (run.end == End::cut) return {.cut = run.time, .key = run.key};
      if (run.end == End::crowded) return {.crowd = true, .key = run.key};
      if (run.end == End::strayed) {
        if (!std::isfinite(run.margin)) return {};
        begin(system, kRoom * run.margin);
        reset();
        first = true;
        continue;
      }
      more_nodes = false;
      const bool alike = !first && !others_.any(!all_alike(paths, late));
      Change change;
      if (late) {
        reevaluate(system);
        change = compare_some(p);
      } else {
        evaluate(system);
        if (mixes) mix(p, alike);
        change = compare_all(p, mixes ? 0 : last_change, mixes);
      }
      if (change.lost) {
        system.part->deepen();
        return {};
      }
      if (change.settled) return {.settled = true};
      if (!std::isfinite(change.largest)) return {};
      const bool patient = ++since > kPatience;
      const bool crawls = since > 2 && change.unsettled > kWorstContraction * kWorstContraction * earlier_unsettled;
      if (crawls && change.unsettled <= kStalled * change.speed) return {.settled = true};
      slow = crawls ? slow + 1 : 0;
      if (!mixes && alike && since > 2 &&
          change.smooth > std::max(kMixed * kMixed * earlier_smooth, 0.1 * change.unsettled)) {
        if (others_) return {};
        mixes = true;
        since = slow = 0;
        mixing_.clear();
        ++counters_->fallbacks;
      }
      const bool parted = (patient || slow > 2) && !first && separate(late);
      if (parted || (slow > 2 && steady(p, change))) {
        more_nodes = true;
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
      first = false;
    }
    return {};
  }

  void begin(const System<D>& system, double margin) {
    core_->begin(system.particles.x, margin);
    for (const auto& term : system.interactions) term->begin_slab(system.particles.x, margin);
    for (auto& memory : memories_) memory.clear();
    pairs_ = 0;
  }

  /// Whether everybody has the same partners as in the sweep before; after a repair the others have anyway.
  bool all_alike(const Histories<D>& paths, bool repaired) const {
    const auto same = [&](Id i) { return !others_.counts(i) || same_meetings(paths, i); };
    if (repaired) return std::ranges::all_of(core_->awake(), same);
    return std::ranges::all_of(paths.noded(), same) && std::ranges::all_of(paths.had_nodes(), same);
  }

  /// impulse_[n]: what interval n receives on these paths.
  void evaluate(const System<D>& system) {
    const Stopwatch watch(counters_->seconds.force);
    impulse_.assign(paths_.intervals(), Vec<D>::Zero());
    PairCounts counts;
    for (std::size_t k = 0; k < memories_.size(); ++k) {
      const PairCounts more = system.interactions[k]->add_impulses(paths_, memories_[k], impulse_);
      counts.evaluations += more.evaluations;
      counts.pairs += more.pairs;
    }
    refresh(system, counts, false);
    pairs_ = std::max(pairs_, counts.pairs);  // in the first sweep nothing is remembered
    count(counts.evaluations);
    if (!scan_->resting().empty()) hold(system, paths_);
  }

  /// The same after a repair: only of those who have changed, and their partners.
  void reevaluate(const System<D>& system) {
    const Stopwatch watch(counters_->seconds.force);
    impulse_.resize(paths_.intervals(), Vec<D>::Zero());
    changed_.clear();
    for (const Id i : core_->awake())
      if (paths_.changed[i]) changed_.push_back(i);
    affected_.assign(core_->awake().begin(), core_->awake().end());  // their intervals may stand in other places
    PairCounts counts;
    for (std::size_t k = 0; k < memories_.size(); ++k)
      counts.evaluations += system.interactions[k]->renew_impulses(paths_, changed_, memories_[k], affected_);
    std::ranges::sort(affected_);
    affected_.erase(std::ranges::unique(affected_).begin(), affected_.end());
    for (const Id i : affected_)
      if (system.particles.owns(i))
        for (std::uint32_t n = i; n != Histories<D>::kNone; n = paths_.next[n]) impulse_[n].setZero();
    for (std::size_t k = 0; k < memories_.size(); ++k)
      for (const Id i : affected_)
        if (system.particles.owns(i)) system.interactions[k]->add_impulses_on(paths_, i, memories_[k], impulse_);
    refresh(system, counts, true);
    count(counts.evaluations);
  }

  /// Of several ranks: ghosts get the impulses of their owners and are affected where these are new, and everybody
  /// gets the counts of all.
  void refresh(const System<D>& system, PairCounts& counts, bool some) {
    if (!system.part) return;
    told_.clear();
    agreed_ = others_.refresh(paths_, impulse_, told_);
    if (some) {
      affected_.insert(affected_.end(), told_.begin(), told_.end());
      std::ranges::sort(affected_);
      affected_.erase(std::ranges::unique(affected_).begin(), affected_.end());
    }
    std::array<std::uint64_t, 2> totals{counts.evaluations, counts.pairs};
    system.part->ranks().sum(totals);
    counts = {totals[0], totals[1]};
  }

  void count(std::uint64_t evaluations) {
    if (pairs_ > 0) counters_->force_passes += static_cast<double>(evaluations) / static_cast<double>(pairs_);
    ++counters_->sweeps;
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
  void mix(const Particles<D>& p, bool alike) {
    if (!alike) mixing_.clear();
    Eigen::Index size = 0, at = 0;
    for (Id i = 0; i < paths_.particles(); ++i)
      for (std::uint32_t n = i; n != Histories<D>::kNone; n = paths_.next[n]) size += D;
    Eigen::VectorXd flown(size), lacking(size);
    for (Id i = 0; i < paths_.particles(); ++i)
      for (std::uint32_t n = i; n != Histories<D>::kNone; n = paths_.next[n], at += D) {
        flown.segment<D>(at) = paths_.duration(n) * paths_.a[n];
        lacking.segment<D>(at) = impulse_[n] / p.mass[i] - paths_.duration(n) * paths_.a[n];
      }
    mixing_.add(flown, lacking);
  }

  struct Change {
    double largest = 0;       ///< of an impulse from the one flown on, as a velocity
    double unsettled = 0;     ///< the same among those who have not settled
    double smooth = 0;        ///< and have no inner nodes
    double speed = 0;         ///< of the system
    std::uint64_t count = 0;  ///< of those who have not settled
    bool settled = true;
    bool lost = false;  ///< ghosts did not do what they should have
    void note(double difference) { largest = difference > largest || std::isnan(difference) ? difference : largest; }
  };

  double difference(const Particles<D>& p, Id i, std::uint32_t n) const {
    return (impulse_[n] / p.mass[i] - paths_.duration(n) * paths_.a[n]).norm();
  }

  /// Compares the impulses with those flown on, and replaces the accelerations of paths by the new ones where there is
  /// a difference that matters: who has settled keeps his path bit for bit. Who has not is left in unsettled_.
  Change compare_all(const Particles<D>& p, double last_change, bool mixes) {
    Change change;
    const auto particles = static_cast<Id>(paths_.particles());
    double squared_speed = 0;
    differences_.resize(particles);
    for (Id i = 0; i < particles; ++i) {
      differences_[i] = difference(p, i, i);
      if (!others_.counts(i)) continue;
      squared_speed =
          std::max({squared_speed, paths_.v[i].squaredNorm(), impulse_[i].squaredNorm() / (p.mass[i] * p.mass[i])});
      change.note(differences_[i]);
    }
    for (const Id i : paths_.noded())
      for (std::uint32_t n = paths_.next[i]; n != Histories<D>::kNone && others_.counts(i); n = paths_.next[n])
        change.note(difference(p, i, n));
    std::array<double, 2> all{squared_speed, change.largest};
    others_.largest(all);
    std::tie(squared_speed, change.largest) = std::tie(all[0], all[1]);
    speed_ = std::sqrt(squared_speed);
    // What the newest impulses still lack is the change times the contraction, this change over the last. It is known
    // best while nobody has settled.
    if (last_change > 0)
      tolerance_ = std::max(tolerance_, std::min(kRounding * last_change / change.largest, kLastAtMost));
    unsettled_.clear();
    Eigen::Index at = 0;
    for (Id i = 0; i < particles; ++i) settle(p, i, differences_[i], mixes ? &at : nullptr, change);
    change.speed = speed_;
    agree_on(change);
    return change;
  }

  /// Makes a change that of all ranks.
  void agree_on(Change& change) {
    if (others_) {
      std::array<double, 5> most{change.largest, change.unsettled, change.smooth, change.settled ? 0.0 : 1.0,
                                 agreed_ ? 0.0 : 1.0};
      others_.largest(most);
      std::tie(change.largest, change.unsettled, change.smooth) = std::tie(most[0], most[1], most[2]);
      change.settled = most[3] == 0;
      change.lost = most[4] > 0;
      others_.ranks().sum({&change.count, 1});
    }
    few_ = kFew * change.count <= total_;
  }

  /// The same after a repair.
  Change compare_some(const Particles<D>& p) {
    Change change{.speed = speed_};
    unsettled_.clear();
    for (const Id i : affected_) {
      for (std::uint32_t n = i; n != Histories<D>::kNone && others_.counts(i); n = paths_.next[n])
        change.note(difference(p, i, n));
      settle(p, i, difference(p, i, i), nullptr, change);
    }
    agree_on(change);
    return change;
  }

  /// `first`: the difference of the first interval; `mixed`: where the correction of i by mixing stands, if there is
  /// one; moved on to that of the next particle.
  void settle(const Particles<D>& p, Id i, double first, Eigen::Index* mixed, Change& change) {
    const double last = tolerance_ * speed_, inner = std::max(kInner, accepted_) * speed_;
    bool settled = true;
    for (std::uint32_t n = i; n != Histories<D>::kNone; n = paths_.next[n]) {
      const double d = n == i ? first : difference(p, i, n);
      if (!(d <= (paths_.next[n] == Histories<D>::kNone ? last : inner))) {
        const double time = paths_.duration(n);
        if (others_.counts(i)) {
          change.unsettled = std::max(change.unsettled, d);
          if (paths_.simple(i)) change.smooth = std::max(change.smooth, d);
        }
        paths_.a[n] = impulse_[n] / (p.mass[i] * time);
        if (mixed) paths_.a[n] += mixing_.correction().template segment<D>(*mixed) / time;
        settled = false;
      }
      if (mixed) *mixed += D;
    }
    if (settled) return;
    unsettled_.push_back(i);
    if (!others_.counts(i)) return;
    ++change.count;
    change.settled = false;
  }

  /// Gives everybody whose partners differ from sweep to sweep a node where they first do; whether there was anyone.
  bool separate(bool repaired) {
    bool parted = false;
    constexpr auto kNone = Histories<D>::kNone;
    auto part = [&](Id i) {
      std::uint32_t m = paths_.next[i], n = paths_.past[i];
      while (m != kNone && n != kNone && same_partners(paths_.opening(m), paths_.opening(n))) {
        m = paths_.next[m];
        n = paths_.next[n];
      }
      if (m == kNone && n == kNone) return;
      const double time = std::min(m == kNone ? kNever : paths_.start[m], n == kNone ? kNever : paths_.start[n]);
      extra_.push_back({i, time});
      parted = parted || others_.counts(i);
    };
    if (repaired) {
      for (const Id i : core_->awake()) part(i);
    } else {
      for (const Id i : paths_.had_nodes()) part(i);
      for (const Id i : paths_.noded())
        if (paths_.past[i] == kNone) part(i);
    }
    return others_.any(parted);
  }

  /// Gives colliders whose impulses change slowly a node a little before their first collision, so that the force on
  /// the way to it hardly depends on when it comes; whether there was anyone. (A grazing contact moves much with the
  /// force.) Paths have their new accelerations already: where these differ, the chord tells.
  bool steady(const Particles<D>& p, const Change& change) {
    constexpr double kBefore = 0.1;  // in parts of the way
    bool steadied = false;
    for (const Id i : paths_.noded()) {
      if (paths_.simple(i)) continue;
      double moved = 0;
      std::uint32_t first = Histories<D>::kNone;
      for (std::uint32_t n = i; n != Histories<D>::kNone; n = paths_.next[n]) {
        moved = std::max(moved, (impulse_[n] / p.mass[i] - 2 * (paths_.chord[n] - paths_.v[n])).norm());
        const std::uint32_t next = paths_.next[n];
        if (first == Histories<D>::kNone && next != Histories<D>::kNone && !is_extra(paths_.opening(next))) first = n;
      }
      if (first == Histories<D>::kNone || !(moved > 0.1 * change.unsettled)) continue;
      extra_.push_back({i, paths_.end(first) - kBefore * paths_.duration(first)});
      steadied = steadied || others_.counts(i);
    }
    return others_.any(steadied);
  }

  /// Moves the particles to the end of the slab: last intervals with the newest impulses. What inner ones lack of
  /// theirs is added to the last velocity, so that no momentum is lost.
  void finish(Particles<D>& p) {
    const Histories<D>& paths = paths_;
    extrapolation_.pass(paths.length);
    for (Id i = 0; i < p.size(); ++i) {
      if (!others_.counts(i)) continue;
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

  static constexpr std::size_t kFew = 8;  // a repair pays where no more than one in so many changes
  static constexpr double kRoom = 1.25;   // margins in units of the farthest path

  std::uint64_t max_events_;
  double accepted_;  // for what the sweeps may leave, relative; 0: rounding
  double adaptive_;  // local error of paths that pieces are fitted to; 0: they are not
  double wanted_ = std::numeric_limits<double>::infinity();  // length of the next piece
  std::optional<ContactScan<D>> scan_;
  std::optional<SlabCore<D>> core_;
  Extrapolation<D> extrapolation_;
  SweepRule<D> rule_;
  Histories<D> paths_;
  std::vector<Vec<D>> impulse_, mean_;
  std::vector<double> differences_;     // of first intervals, from what was flown on
  std::vector<Id> unsettled_;           // after a sweep
  std::vector<Id> changed_, affected_;  // by a repair; affected: with the partners of the changed
  PartSweeps<D> others_;
  std::vector<Id> told_;     // ghosts whose impulses the last sweep changed
  bool agreed_ = true;       // with the owners of ghosts, after the last sweep
  bool few_ = false;         // of all have not settled
  std::uint64_t total_ = 0;  // particles, of all ranks
  bool remembers_ = true;    // what pairs receive: every interaction
  std::vector<PairMemory<D>> memories_;
  std::vector<ExtraNode> extra_;
  std::uint64_t pairs_ = 0;  // within reach
  double tolerance_ = 0;     // of last intervals, relative
  double speed_ = 0;         // of the system, at the last sweep of everybody
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
