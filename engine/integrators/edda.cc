// edda: event-driven discrete gradients.
//
// In a slab [0, h] particle i moves under a constant acceleration of its own, a_i: parabolas, cut by collisions, which
// change velocities and never a_i. That flow keeps K − Σ m_i a_i·x_i, whatever the a_i and whatever collides. With
//
//   m_i a_i = −∇̄_i V(x(0), x(h)),
//
// the discrete gradient between the slab's two ends, Σ m_i a_i·Δx_i = −(V(x(h)) − V(x(0))), so H is exact. The equation
// is solved by sweeps: fly on a, evaluate a′ at the ends, go on with a′. What the last sweep leaves, e = a′ − a, is
// given as a kick, so that momentum is exact; the energy that lacks then,
//
//   r = Σ m [e·(Δx − h v′) − ½ h² e²],   v′ before the kick,
//
// is folded into the velocities by a common factor.

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "engine/error.h"
#include "engine/forces.h"
#include "engine/integrators/chebyshev.h"
#include "engine/integrators/extrapolation.h"
#include "engine/integrators/fold.h"
#include "engine/integrators/registry.h"
#include "engine/slab_core.h"
#include "engine/stiffness.h"

namespace carom::integrator {
namespace {

constexpr int kMostSweeps = 60;
constexpr int kMostPieces = 1 << 14;      // of a step
constexpr std::uint64_t kFew = 5;         // one particle in so many has changed: only its pairs are evaluated
constexpr int kPatience = 6;              // sweeps before particles may be frozen
constexpr int kSwaps = 3;                 // of partners after that, until a particle is frozen
constexpr int kStart = 4;                 // sweeps after which contraction tells of stiffness
constexpr double kSlow = 0.04;            // contraction of two sweeps that tells of it
constexpr double kRoom = 1.1;             // for frequencies above the one found
constexpr std::int64_t kMeasured = 1000;  // slabs for which it is good
constexpr std::size_t kSmooth = 3;        // past slabs that the start is extrapolated from
constexpr double kWild = 4;               // mean distances of ½ h² a: such a step is halved before it is flown
constexpr double kStalled = 0.1;          // contraction of kPatience sweeps that is too little
constexpr double kTooStiff = 0.5;  // contraction of kPatience sweeps that is expected: nothing is frozen for stiffness
constexpr double kMostFolded = 0.1;  // of the kinetic energy, for frozen particles
constexpr double kSettled = 0.5;     // of the tolerance: such a particle keeps its path
constexpr double kRounding = 1e-13;  // of the speed scale: increments below it that do not shrink are rounding

template <int D>
class EventDrivenDiscreteGradient : public Integrator<D> {
 public:
  explicit EventDrivenDiscreteGradient(const Parameters& parameters)
      : max_events_(static_cast<std::uint64_t>(parameters.integer("max_events_per_step"))),
        tolerance_(parameters.real("tolerance")) {}

  bool local() const override { return true; }
  void pack(Id i, Bytes& to) const override { past_.pack(i, to); }
  void unpack(Id i, Reader& from) override { past_.unpack(i, from); }
  void release() override {
    core_.reset();
    past_.release();
    for (auto* each : {&a_, &mean_, &move_}) *each = {};
    forces_ = {};
  }
  void regroup(System<D>& system) override {
    core_.emplace(system, max_events_);
    const std::size_t n = system.particles.size();
    past_.resize(n);
    for (auto* each : {&a_, &mean_, &move_}) each->resize(n, Vec<D>::Zero());
    swaps_.assign(n, 0);
    swapping_.clear();
  }

  void start(System<D>& system, Counters& counters) override {
    regroup(system);
    const auto& p = system.particles;
    evaluate_forces<D>(system, p.x, a_, counters);
    for (std::size_t i = 0; i < a_.size(); ++i) a_[i] /= p.mass[i];
    past_.start(a_);
    const auto n = static_cast<double>(std::max<std::size_t>(1, system.part ? system.part->total() : system.size()));
    bool free = n > 1;  // the total momentum is kept, and more than it moves
    for (int k = 0; k < D; ++k) free = free && !system.box.walled(k);
    for (const auto& term : system.interactions) free = free && term->keeps_momentum();
    ExactSum squares, mass, forces;
    std::array<ExactSum, D> momentum;
    for (Id i = 0; i < p.size(); ++i) {
      if (!p.owns(i)) continue;
      squares.add(p.v[i].squaredNorm());
      forces.add(a_[i].squaredNorm());
      mass.add(p.mass[i]);
      for (int k = 0; k < D; ++k) momentum[k].add(p.mass[i] * p.v[i][k]);
    }
    speed_ = std::sqrt(of_all_ranks(system, squares).value() / n);
    strength_ = std::sqrt(of_all_ranks(system, forces).value() / n);
    const double total = of_all_ranks(system, mass).value();
    for (int k = 0; k < D; ++k) centre_[k] = free ? of_all_ranks(system, momentum[k]).value() / total : 0.0;
  }

  void slab(System<D>& system, const Slab& slab, SlabReport<D>& report) override {
    counters_ = &report.counters;
    slab_ = slab.index;
    core_->begin_step(report.counters, report.contacts, past_.last(), slab.length);
    const auto before = found_;
    try {
      advance(system, slab);
    } catch (HaloTooSmall) {
      found_ = before;  // the step is done again as if this had not been tried
      throw;
    }
    system.wrap();
    report.reached = slab.length;
  }

 private:
  enum class Outcome { settled, cut, diverged };

  /// What one step finds out and later ones use.
  struct Found {
    bool touching = true;                // contacts at the slab's start may need to be resolved
    double squared_frequency = 0;        // the largest, once it matters
    std::int64_t measured = -kMeasured;  // the slab in which it was found
  };

  /// The pieces of a step.
  void advance(System<D>& system, const Slab& slab) {
    auto& p = system.particles;
    double done = 0, longest = slab.length;
    while (done < slab.length) {
      resolved_ = found_.touching;
      if (found_.touching) found_.touching = resolve(system, done);
      const double rest = slab.length - done, piece = std::min(longest, rest);
      Outcome outcome = solve(system, piece);
      if (outcome == Outcome::settled && any_freezes_ && !can_fold(system, piece)) outcome = Outcome::diverged;
      if (outcome == Outcome::settled) {
        core_->commit(done);
        finish(system, piece);
        if (found_.touching) core_->scan().slide(p.x, p.v);
        ++counters_->pieces;
        done = piece == rest ? slab.length : done + piece;
        longest = std::max(2 * piece, slab.length / kMostPieces);
        found_.touching = found_.touching || cut_.time > 0;
        cut_ = {};
        continue;
      }
      need_all(system);
      if (outcome == Outcome::cut) {
        core_->scan().count_event(cut_.key);
        found_.touching = found_.touching || cut_.time == 0;
        longest = cut_.time > 0 ? cut_.time : longest;
        continue;
      }
      ++counters_->slabs_halved;
      longest = 0.5 * piece;
      if (longest * kMostPieces < slab.length)
        throw Error(Failure::numerical, "the sweeps do not settle even in " + std::to_string(kMostPieces) +
                                            " pieces; the forces, strongest on particle " +
                                            std::to_string(p.id_of(most_accelerated())) +
                                            ", are not finite or far too stiff for step = " + short_text(slab.length) +
                                            "; use a smaller integrator.step");
    }
  }

  /// Impulses of what touches and approaches now, and which contacts rest. Returns whether any do.
  bool resolve(System<D>& system, double done) {
    auto& p = system.particles;
    auto& scan = core_->scan();
    if (!any_rank(system, !scan.quiet(p.x, p.v))) return false;
    need_all(system);
    scan.resolve(done, p.x, p.v, [&](const Touch<D>& touch) { collide_elastically(touch, p); });
    return !scan.resting().empty();
  }

  /// Sweeps over a slab from the present state. settled: core_ has the flight on a_, mean_ the accelerations it gives.
  Outcome solve(System<D>& system, double h) {
    const Stopwatch watch(counters_->seconds.sweep);
    auto& p = system.particles;
    const std::size_t n = p.size();
    Chebyshev chebyshev(0.25 * h * h * found_.squared_frequency);
    past_.expect(h, a_, chebyshev.plain() ? kSmooth : 1);  // stiff motion is not smooth from slab to slab
    double strongest = 0;  // acceleration to be flown on
    for (Id i = 0; i < n; ++i)
      if (p.owns(i)) strongest = std::max(strongest, finite(a_[i].squaredNorm()));
    largest_of_all<D>(system, {&strongest, 1});
    strongest = std::sqrt(strongest);
    core_->begin(p.v, a_, h, resolved_);
    for (const Id i : swapping_) swaps_[i] = 0;
    swapping_.clear();
    any_freezes_ = false;
    const double scale = std::max(speed_, h * strength_);
    const double wanted = core_->scan().resting().empty() ? tolerance_ * scale : 0;  // else contacts would open
    double last = 0, before = 0, earlier = 0;  // largest, one, two and kPatience sweeps ago
    for (int sweep = 1; sweep <= kMostSweeps; ++sweep) {
      if (!(0.5 * h * h * strongest <= kWild * mean_distance(system))) return Outcome::diverged;
      const FlightEnd<D> end = core_->fly(a_);
      if (!end.complete) {
        cut_ = end;
        return Outcome::cut;
      }
      evaluate(system, sweep == 1);
      if (!core_->scan().resting().empty()) hold(system, h);
      std::array<double, 2> most{};  // |e|² and |a′|²
      for (Id i = 0; i < n; ++i) {
        if (frozen(i) || !p.owns(i)) continue;
        const Vec<D> e = mean_[i] - a_[i];
        most[0] = std::max(most[0], finite(e.squaredNorm()));
        // Of what is flown on next: Chebyshev's step may lead far beyond mean_.
        most[1] = std::max(most[1], chebyshev.plain() ? mean_[i].squaredNorm()
                                                      : std::pow(a_[i].norm() + move_[i].norm() + e.norm(), 2));
      }
      largest_of_all<D>(system, most);
      const double largest = h * std::sqrt(most[0]);
      strongest = std::sqrt(most[1]);
      if (!std::isfinite(largest)) return Outcome::diverged;
      if (largest <= wanted) return Outcome::settled;
      if (sweep > 2 && largest <= kRounding * scale && largest > 0.25 * last) return Outcome::settled;
      if (sweep >= kPatience && any_rank(system, swaps_among_unfrozen())) freeze();
      if (sweep % kPatience == 0) {
        const double slow = std::max(kStalled, 2 * std::pow(chebyshev.rate(), kPatience));
        if (sweep > kPatience && slow < kTooStiff && largest > slow * earlier) freeze_stalled(largest / h);
        earlier = largest;
      }
      if (sweep > kStart && chebyshev.plain() && largest > std::max(10 * wanted, kSlow * before) && measure(system)) {
        chebyshev = Chebyshev(0.25 * h * h * found_.squared_frequency);
        ++counters_->fallbacks;
      }
      chebyshev.next();
      before = last;
      last = largest;
      const double settled = std::pow(kSettled * wanted / h, 2);
      for (Id i = 0; i < n; ++i) {
        if (frozen(i)) continue;
        const Vec<D> e = mean_[i] - a_[i];
        if (!chebyshev.plain()) {
          move_[i] = chebyshev.memory() * move_[i] + chebyshev.gain() * e;
          a_[i] += move_[i];
        } else if (e.squaredNorm() > settled) {
          move_[i] = e;
          a_[i] = mean_[i];
        }
      }
    }
    return Outcome::diverged;
  }

  /// The accelerations that the flight gives. Where the ends of few particles have changed only their pairs are
  /// evaluated again: sums of integers let them be subtracted exactly.
  void evaluate(const System<D>& system, bool first) {
    const Stopwatch watch(counters_->seconds.force);
    const auto& p = system.particles;
    const auto &x = core_->x(), &before = core_->last_x();
    std::array<std::uint64_t, 3> count{};  // own particles, those of them that have changed, and pairs evaluated
    changed_.resize(x.size());
    for (Id i = 0; i < x.size(); ++i) {
      changed_[i] = first || x[i] != before[i];
      if (p.owns(i)) ++count[0], count[1] += changed_[i];
    }
    sum_over_ranks(system, count);
    const bool all = first || kFew * count[1] > count[0];
    count[2] = all ? forces_.evaluate(system, p.x, x) : forces_.update(system, p.x, before, x, changed_.data());
    sum_over_ranks(system, {&count[2], 1});
    if (first) pairs_ = count[2];
    counters_->force_passes += pairs_ > 0 ? static_cast<double>(count[2]) / static_cast<double>(pairs_) : 0.0;
    ++counters_->sweeps;
    for (Id i = 0; i < x.size(); ++i) mean_[i] = forces_[i];
    if (system.part) system.part->refresh(mean_);
    for (Id i = 0; i < x.size(); ++i) mean_[i] /= p.mass[i];
  }

  /// Finds the highest frequency, not more often than it pays. Returns whether it did.
  bool measure(const System<D>& system) {
    if (slab_ < found_.measured + kMeasured) return false;
    found_.measured = slab_;
    found_.squared_frequency = kRoom * largest_squared_frequency(system);
    return true;
  }

  /// Particles in collisions whose paths do not settle: a grazing contact may turn a small change into a larger one.
  void freeze_stalled(double largest) {
    any_freezes_ = true;
    for (Id i = 0; i < a_.size(); ++i)
      if (core_->collides(i) && !frozen(i) && (mean_[i] - a_[i]).norm() >= kStalled * largest) {
        if (swaps_[i] == 0) swapping_.push_back(i);
        swaps_[i] = kSwaps + 1;
      }
  }

  Id most_accelerated() const {
    const auto most = std::ranges::max_element(a_, {}, [](const Vec<D>& a) { return finite(a.squaredNorm()); });
    return static_cast<Id>(most - a_.begin());
  }

  bool frozen(Id i) const { return swaps_[i] > kSwaps; }
  static double finite(double value) { return std::isnan(value) ? kNever : value; }
  bool swaps_among_unfrozen() const {
    return std::ranges::any_of(core_->swapped(), [&](Id i) { return !frozen(i); });
  }

  /// Counts the swaps of partners of each particle. One which swaps again and again keeps its acceleration from then
  /// on, and where it still swaps, so do its partners.
  void freeze() {
    any_freezes_ = true;
    const auto note = [&](Id i) {
      if (++swaps_[i] == 1) swapping_.push_back(i);
    };
    for (const Id i : core_->swapped()) {
      if (frozen(i) && ++swaps_[i] > 2 * kSwaps)
        for (const Contact<D>& contact : core_->contacts())
          if (contact.key.kind == EventKind::pair && (contact.key.lo == i || contact.key.hi == i))
            for (const Id j : {contact.key.lo, contact.key.hi})
              if (!frozen(j)) note(j);
      if (!frozen(i)) note(i);
    }
  }

  /// Adds the reactions λ(d + d′) of resting contacts, which do no work because they hold |d′| = |d|, to mean_.
  void hold(const System<D>& system, double h) {
    const auto& p = system.particles;
    std::vector<Vec<D>> w(p.size());  // mean velocities; what rests has no collision in the slab
    for (Id i = 0; i < p.size(); ++i) w[i] = p.v[i] + (0.5 * h) * mean_[i];
    for (auto& contact : core_->scan().resting()) {
      const Id lo = contact.key.lo, hi = contact.key.hi;
      if (contact.key.kind == EventKind::pair)
        contact.normal = 2 * (p.x[lo] - p.x[hi] + system.box.shift(contact.key.image)) +
                         ((core_->x()[lo] - p.x[lo]) - (core_->x()[hi] - p.x[hi]));
      contact.lambda = contact.bound = 0;
    }
    press_apart<D>(core_->scan().resting(), p.mass, w);
    for (const auto& contact : core_->scan().resting())
      for (const Id i : {contact.key.lo, contact.key.hi})
        if (i == contact.key.lo || contact.key.kind == EventKind::pair) mean_[i] = 2 / h * (w[i] - p.v[i]);
  }

  /// What the energy lacks for the kick of a particle.
  double lack(const Particles<D>& p, Id i, double h) const {
    const Vec<D> e = mean_[i] - a_[i];
    return p.mass[i] * (e.dot(core_->x()[i] - p.x[i] - h * core_->v()[i]) - 0.5 * h * h * e.squaredNorm());
  }

  /// Whether what frozen particles lack is little beside the kinetic energy.
  bool can_fold(const System<D>& system, double h) const {
    const auto& p = system.particles;
    ExactSum lacks, kinetic;
    for (Id i = 0; i < p.size(); ++i) {
      if (!p.owns(i)) continue;
      if (frozen(i)) lacks.add(std::min(std::abs(lack(p, i, h)), std::numeric_limits<double>::max()));
      kinetic.add(0.5 * p.mass[i] * (p.v[i] - centre_).squaredNorm());
    }
    return of_all_ranks(system, lacks).value() <= kMostFolded * of_all_ranks(system, kinetic).value();
  }

  /// Moves the particles to the slab's end, with the kick h e and what the energy still lacks.
  void finish(System<D>& system, double h) {
    auto& p = system.particles;
    ExactSeries sum;
    std::vector<Lack<D>> of_frozen;
    for (Id i = 0; i < p.size(); ++i) {
      if (!p.owns(i)) continue;
      const double r = lack(p, i, h);
      if (frozen(i))
        of_frozen.push_back({p.id_of(i), core_->x()[i], r});
      else
        sum.add(r);
    }
    core_->finish(p);
    for (Id i = 0; i < p.size(); ++i) p.v[i] += h * (mean_[i] - a_[i]);
    double rest = of_all_ranks(system, sum.sum()).value();
    if (any_freezes_) {
      rest += fold_near(system, of_frozen, counters_->folded);
      std::uint64_t frozen_here = of_frozen.size();
      sum_over_ranks(system, {&frozen_here, 1});
      counters_->frozen += frozen_here;
    }
    if (fold(system, centre_, rest)) counters_->folded += std::abs(rest);
    update_copies(system);
    past_.pass(h);
    past_.last() = mean_;
  }

  std::uint64_t max_events_;
  double tolerance_;                 // what sweeps may leave of h a, relative to the speed scale
  double speed_ = 0, strength_ = 0;  // root mean square velocity and acceleration at the start of the run
  Vec<D> centre_ = Vec<D>::Zero();   // velocity of the centre of mass, where it is kept
  std::optional<SlabCore<D>> core_;
  Extrapolation<D> past_;
  MeanForces<D> forces_;
  std::vector<char> changed_;         // by the last sweep
  std::uint64_t pairs_ = 0;           // within reach
  std::vector<Vec<D>> a_, mean_;      // flown on, and what that gives
  std::vector<std::uint32_t> swaps_;  // of partners, by particle
  std::vector<Id> swapping_;          // particles with any
  bool any_freezes_ = false;          // on any rank, in this slab
  Found found_;
  bool resolved_ = false;  // contacts at the slab's start have been resolved
  FlightEnd<D> cut_;       // why the last slab was cut
  std::int64_t slab_ = 0;
  std::vector<Vec<D>> move_;  // of a_ by the last sweep
  Counters* counters_ = nullptr;
};

}  // namespace

IntegratorInfo edda() {
  return {
      .name = "edda",
      .title = "Event-Driven Discrete gradients",
      .order = "2",
      .conserves =
          "energy and linear momentum to rounding, for any step; angular momentum to the tolerance in slabs "
          "without collisions",
      .parameters = {parameter::step(),
                     {.name = "tolerance",
                      .type = Parameter::Type::real,
                      .fallback = "1e-10",
                      .unit = "-",
                      .meaning = "what sweeps may leave of a step's impulses, as a velocity and relative to the root "
                                 "mean square velocity at the start; the energy stays exact: what it lacks is folded "
                                 "into the velocities (energy.folded of summary.json); 0: rounding",
                      .range = Parameter::Range::non_negative},
                     parameter::max_events_per_step()},
      .documentation =
          "Each particle moves under a constant acceleration of its own over the step, through all its collisions; the "
          "accelerations are the discrete gradient between the step's two ends, found by sweeps that cost a force pass "
          "and the collisions each. Energy is exact whatever the step and the number of collisions.",
      .source =
          "this project; relatives: LaBudde, Greenspan, Numer. Math. 25 (1976) 323; Gonzalez, J. Nonlinear Sci. "
          "6 (1996) 449; Gonzalez, Schmidt, Ortiz, Int. J. Numer. Methods Eng. 84 (2010) 1085",
      .in_2d = make<EventDrivenDiscreteGradient, 2>,
      .in_3d = make<EventDrivenDiscreteGradient, 3>};
}

}  // namespace carom::integrator
