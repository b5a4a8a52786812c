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
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "engine/base/error.h"
#include "engine/forces/forces.h"
#include "engine/forces/stiffness.h"
#include "engine/integrators/chebyshev.h"
#include "engine/integrators/extrapolation.h"
#include "engine/integrators/fold.h"
#include "engine/integrators/registry.h"
#include "engine/slabs/slab_core.h"

namespace carom::integrator {
namespace {

constexpr int kMostSweeps = 60;
constexpr int kMostPieces = 1 << 14;          // of a step
constexpr std::uint64_t kFew = 5;             // one particle in so many has changed: only its pairs are evaluated
constexpr int kSweepsBeforeFreezing = 6;      // sweeps before particles may be frozen
constexpr int kSwaps = 3;                     // of partners after that, until a particle is frozen
constexpr int kStart = 4;                     // sweeps after which contraction tells of stiffness
constexpr double kSlow = 0.04;                // contraction of two sweeps that tells of it
constexpr double kRoom = 1.1;                 // for frequencies above the one found
constexpr std::int64_t kMeasured = 1000;      // slabs for which it is good
constexpr std::size_t kSmooth = 3;            // past slabs that the start is extrapolated from
constexpr double kStalled = 0.1;              // contraction of kSweepsBeforeFreezing sweeps that is too little
constexpr double kTooStiff = 0.5;             // such a contraction expected: nothing is frozen for stiffness
constexpr double kMostFolded = 0.1;           // of the kinetic energy, for frozen particles
constexpr double kSettled = 0.5;              // of the tolerance: such a particle keeps its path
constexpr double kSettledInCollision = 0.05;  // the same where it collides: its lack of energy is of first order in e
constexpr double kRounding = 1e-13;           // of the speed scale: increments below it that do not shrink are rounding

template <int D>
class EventDrivenDiscreteGradient : public Integrator<D> {
 public:
  explicit EventDrivenDiscreteGradient(const Parameters& parameters)
      : max_events_(static_cast<std::uint64_t>(parameters.integer("max_events_per_step"))),
        tolerance_(parameters.real("tolerance")) {}

  void start(System<D>& system, Counters& counters) override {
    const auto& p = system.particles;
    core_.emplace(system, max_events_);
    system.fields.add_working(
        this,
        [this] {
          for (auto* each : {&a_, &mean_, &move_}) std::vector<Vec<D>>().swap(*each);
          forces_ = {};
        },
        [this, &p] {
          for (auto* each : {&a_, &mean_, &move_}) each->resize(p.size(), Vec<D>::Zero());
          swaps_.resize(p.size());
        });
    evaluate_forces<D>(system, p.x, a_, counters);
    for (std::size_t i = 0; i < a_.size(); ++i) a_[i] /= p.mass[i];
    past_.start(system.fields, a_);
    system.fields.add_value("edda", scales_);
    system.fields.add_value("edda found", kept_);
    const auto sum = [&](auto&& term) { return sum_over_all<D>(system, term); };
    const double n = static_cast<double>(std::max<std::size_t>(1, system.size()));
    scales_.speed = std::sqrt(sum([&](Id i) { return p.v[i].squaredNorm(); }) / n);
    scales_.strength = std::sqrt(sum([&](Id i) { return a_[i].squaredNorm(); }) / n);
    const double mass = sum([&](Id i) { return p.mass[i]; });
    const bool free = n > 1 && system.keeps_momentum();  // and more than it moves
    for (int k = 0; k < D; ++k)
      scales_.centre[k] = free ? sum([&](Id i) { return p.mass[i] * p.v[i][k]; }) / mass : 0.0;
  }

  void slab(System<D>& system, const Slab& slab, SlabReport<D>& report) override {
    counters_ = &report.counters;
    slab_ = slab.index;
    watch_ = report.watch;
    core_->begin_step(report.counters, report.contacts, past_.last(), slab.length, watch_);
    found_ = kept_;  // of a step that is done again nothing is known
    advance(system, slab);
    kept_ = found_;
    system.wrap();
    report.reached = slab.length;
  }

 private:
  /// What one step finds out and later ones use.
  struct Found {
    bool touching = true;                // contacts at the slab's start may need to be resolved
    double squared_frequency = 0;        // the largest, once it matters
    std::int64_t measured = -kMeasured;  // the slab in which it was found
  };

  /// The pieces of a step.
  void advance(System<D>& system, const Slab& slab) {
    auto& p = system.particles;
    auto& scan = core_->scan();
    double done = 0, longest = slab.length;
    bool to_contact = false;  // `longest` ends where a contact at rest is met or begins
    while (done < slab.length) {
      const bool resolved = found_.touching;
      if (resolved && (found_.touching = system.decomposition.any(!scan.quiet(p.x, p.v)))) {
        system.decomposition.need_all();
        scan.resolve(done, p.x, p.v, [&](const Touch<D>& touch) { collide_elastically(touch, p); });
        found_.touching = !scan.resting().empty();
      }
      const double rest = slab.length - done, piece = std::min(longest, rest);
      if (solve(system, piece, resolved) && (!any_freezes_ || can_fold(system, piece))) {
        core_->commit(done);
        if (piece < rest && watch_) watch_->cut();
        finish(system, piece);
        if (found_.touching) scan.slide(p.x, p.v);
        ++counters_->pieces;
        done = piece == rest ? slab.length : done + piece;
        longest = std::max(2 * piece, slab.length / kMostPieces);
        found_.touching = found_.touching || std::exchange(to_contact, false);
        continue;
      }
      system.decomposition.need_all();
      if (!end_.complete && !end_.too_strong) {
        scan.count_event(end_.key);
        to_contact = end_.time > 0;
        longest = to_contact ? end_.time : longest;
        found_.touching = found_.touching || !to_contact;
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

  /// Sweeps over a slab from the present state. True: core_ has the flight on a_, mean_ the accelerations it gives;
  /// false: it is to be shorter. `resolved`: what touches now has been seen to.
  bool solve(System<D>& system, double h, bool resolved) {
    const Stopwatch watch(counters_->seconds.sweep);
    auto& p = system.particles;
    const std::size_t n = p.size();
    Chebyshev chebyshev(0.25 * h * h * found_.squared_frequency);
    past_.expect(h, a_, chebyshev.plain() ? kSmooth : 1);  // stiff motion is not smooth from slab to slab
    core_->begin(p.v, a_, h, resolved);
    std::ranges::fill(swaps_, 0);
    std::ranges::fill(move_, Vec<D>::Zero());
    any_freezes_ = false;
    const double scale = std::max(scales_.speed, h * scales_.strength);
    const double wanted = core_->scan().resting().empty() ? tolerance_ * scale : 0;  // else contacts would open
    std::array<double, kMostSweeps + 1> residual{};                                  // by sweep
    for (int sweep = 1; sweep <= kMostSweeps; ++sweep) {
      if (watch_) watch_->look();
      end_ = core_->fly(a_);
      if (!end_.complete) return false;
      const auto [squared, swaps] = evaluate(system, h, sweep == 1);
      const double largest = residual[sweep] = h * std::sqrt(squared);
      if (!std::isfinite(largest)) return false;
      if (largest <= wanted) return true;
      if (sweep > 2 && largest <= kRounding * scale && largest > 0.25 * residual[sweep - 1]) return true;
      if (sweep >= kSweepsBeforeFreezing && swaps > 0) freeze();
      const double stalled = std::max(kStalled, 2 * std::pow(chebyshev.rate(), kSweepsBeforeFreezing));
      if (sweep > kSweepsBeforeFreezing && sweep % kSweepsBeforeFreezing == 0 && stalled < kTooStiff &&
          largest > stalled * residual[sweep - kSweepsBeforeFreezing])
        freeze_stalled(largest / h);
      const bool slow =
          sweep > kStart && chebyshev.plain() && largest > std::max(10 * wanted, kSlow * residual[sweep - 2]);
      if (slow && slab_ >= found_.measured + kMeasured) {
        found_.measured = slab_;
        found_.squared_frequency = kRoom * largest_squared_frequency(system);
        chebyshev = Chebyshev(0.25 * h * h * found_.squared_frequency);
        ++counters_->fallbacks;
      }
      chebyshev.next();
      const double settled = std::pow(kSettled * wanted / h, 2);
      const double in_collision = std::pow(kSettledInCollision * wanted / h, 2);
      for (Id i = 0; i < n; ++i) {
        if (frozen(i)) continue;
        const Vec<D> e = mean_[i] - a_[i];
        if (!chebyshev.plain())
          a_[i] += move_[i] = chebyshev.memory() * move_[i] + chebyshev.gain() * e;
        else if (e.squaredNorm() > (core_->collides(i) ? in_collision : settled))
          a_[i] = mean_[i];
      }
    }
    return false;
  }

  /// The accelerations that the flight gives. Where the ends of few particles have changed only their pairs are
  /// evaluated again: sums of integers let them be subtracted exactly. Returns the largest |e|² and, above 0, whether
  /// partners are still swapped, of all particles that are not frozen.
  std::array<double, 2> evaluate(const System<D>& system, double h, bool first) {
    const Stopwatch watch(counters_->seconds.force);
    const auto& p = system.particles;
    const auto& x = core_->x();
    const bool all = first || kFew * core_->all_moved() > system.size();
    std::uint64_t pairs =
        all ? forces_.evaluate(system, p.x, x) : forces_.update(system, p.x, core_->last_x(), x, core_->moved().data());
    for (Id i = 0; i < x.size(); ++i) mean_[i] = forces_[i];
    system.decomposition.update(std::span(mean_));
    for (Id i = 0; i < x.size(); ++i) mean_[i] /= p.mass[i];
    if (!core_->scan().resting().empty()) hold(system, h);
    std::array<double, 2> most{};
    for (Id i = 0; i < x.size(); ++i)
      if (p.owns(i) && !frozen(i)) most[0] = std::max(most[0], finite((mean_[i] - a_[i]).squaredNorm()));
    for (const Id i : core_->swapped()) most[1] = std::max(most[1], frozen(i) ? 0.0 : 1.0);
    system.decomposition.ranks().combine(most, {&pairs, 1});
    if (first) pairs_ = pairs;
    counters_->force_passes += pairs_ > 0 ? static_cast<double>(pairs) / static_cast<double>(pairs_) : 0.0;
    ++counters_->sweeps;
    return most;
  }

  /// Particles in collisions, of which the paths do not settle: a grazing contact may turn a small change into a larger
  /// one.
  void freeze_stalled(double largest) {
    any_freezes_ = true;
    for (Id i = 0; i < a_.size(); ++i)
      if (core_->collides(i) && !frozen(i) && (mean_[i] - a_[i]).norm() >= kStalled * largest) swaps_[i] = kSwaps + 1;
  }

  Id most_accelerated() const {
    const auto most = std::ranges::max_element(a_, {}, [](const Vec<D>& a) { return finite(a.squaredNorm()); });
    return static_cast<Id>(most - a_.begin());
  }

  Vec<D> centre() const { return Vec<D>(scales_.centre.data()); }
  bool frozen(Id i) const { return swaps_[i] > kSwaps; }
  static double finite(double value) { return std::isnan(value) ? kNever : value; }

  /// Counts the swaps of partners of each particle. One which swaps again and again keeps its acceleration from then
  /// on, and where it still swaps, so do its partners.
  void freeze() {
    any_freezes_ = true;
    std::vector<std::pair<Id, Id>> met;  // partners in the last flight, once they matter
    for (const Id i : core_->swapped()) {
      if (++swaps_[i] <= 2 * kSwaps) continue;
      if (met.empty()) {
        for (const Contact<D>& contact : core_->contacts())
          if (const EventKey<D>& key = contact.key; key.kind == EventKind::pair)
            met.insert(met.end(), {{key.lo, key.hi}, {key.hi, key.lo}});
        std::ranges::sort(met);
      }
      for (auto at = std::ranges::lower_bound(met, std::pair<Id, Id>{i, 0}); at != met.end() && at->first == i; ++at)
        swaps_[at->second] += frozen(at->second) ? 0 : 1;
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
    const double lacks = sum_over_all<D>(system, [&](Id i) {
      return frozen(i) ? std::min(std::abs(lack(p, i, h)), std::numeric_limits<double>::max()) : 0.0;
    });
    return lacks <= kMostFolded * sum_over_all<D>(system, [&](Id i) {
                      return 0.5 * p.mass[i] * (p.v[i] - centre()).squaredNorm();
                    });
  }

  /// Moves the particles to the slab's end, with the kick h e and what the energy still lacks.
  void finish(System<D>& system, double h) {
    auto& p = system.particles;
    ExactSeries lacks;
    std::vector<Lack<D>> of_frozen;
    for (Id i = 0; i < p.size(); ++i) {
      if (!p.owns(i)) continue;
      const double r = lack(p, i, h);
      if (frozen(i))
        of_frozen.push_back({p.id_of(i), core_->x()[i], r});
      else
        lacks.add(r);
    }
    core_->finish(p);
    for (Id i = 0; i < p.size(); ++i) p.v[i] += h * (mean_[i] - a_[i]);
    const double left = any_freezes_ ? fold_near(system, of_frozen, *counters_) : 0;
    fold(system, centre(), lacks.sum(), left, *counters_);
    system.decomposition.update_halo();
    past_.pass(h, mean_);
  }

  std::uint64_t max_events_;
  double tolerance_;  // what sweeps may leave of h a, relative to the speed scale
  struct Scales {
    double speed = 0, strength = 0;  // root mean square velocity and acceleration at the start of the run
    std::array<double, D> centre{};  // velocity of the centre of mass, where it is kept
  } scales_;
  std::optional<SlabCore<D>> core_;
  Extrapolation<D> past_;
  MeanForces<D> forces_;
  std::uint64_t pairs_ = 0;           // within reach
  std::vector<Vec<D>> a_, mean_;      // flown on, and what that gives
  std::vector<std::uint32_t> swaps_;  // of partners, by particle
  bool any_freezes_ = false;          // on any rank, in this slab
  Found found_, kept_;                // kept_: at the end of the last step
  FlightEnd<D> end_;                  // of the last flight
  std::int64_t slab_ = 0;
  std::vector<Vec<D>> move_;  // of a_ by the last sweep
  Counters* counters_ = nullptr;
  SlabWatch* watch_ = nullptr;
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
      .exact = true,
      .local = true,
      .in_2d = make<EventDrivenDiscreteGradient, 2>,
      .in_3d = make<EventDrivenDiscreteGradient, 3>};
}

}  // namespace carom::integrator
