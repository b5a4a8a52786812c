// SPDX-License-Identifier: BSD-3-Clause
// edda: event-driven discrete gradients.
//
// In a piece [0, h] of a step, usually the whole step, particle i moves under a constant acceleration of its own, a_i:
// parabolas, cut by collisions, which change velocities and never a_i. That flow keeps K − Σ m_i a_i·x_i, whatever the
// a_i and whatever collides. With
//
//   m_i a_i = −∇̄_i V(x(0), x(h)),
//
// the discrete gradient between the piece's two ends, Σ m_i a_i·Δx_i = −(V(x(h)) − V(x(0))), so H is exact. The
// equation is solved by sweeps: fly on a, evaluate a′ at the ends, continue with a′. The residual of the last sweep, e
// = a′ − a, is applied as a kick, so that momentum is exact; the energy that is missing then,
//
//   r = Σ m [e·(Δx − h v′) − ½ h² e²],   v′ before the kick,
//
// is folded into the velocities by a common factor. If the kinetic energy is too small for that, the sweeps continue to
// rounding, or the piece is shortened; the energy that rounding then leaves is carried over to the next piece or, if
// contacts dissipate, is dissipated: a pile at rest has no velocities that it could be folded into.
//
// Contacts at rest are held by reactions (engine/stepping/resting.h), which are part of m a′; their work, zero once the
// sweeps have converged, is part of r.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "engine/base/error.h"
#include "engine/events/meeting.h"
#include "engine/forces/forces.h"
#include "engine/forces/stiffness.h"
#include "engine/integrators/chebyshev.h"
#include "engine/integrators/extrapolation.h"
#include "engine/integrators/flow.h"
#include "engine/integrators/registry.h"
#include "engine/integrators/sweep_control.h"
#include "engine/stepping/local_error.h"
#include "engine/stepping/slab_core.h"

namespace carom::integrator {
namespace {

constexpr int kMostPieces = 1 << 17;    // of a step
constexpr int kPiecesBeforeGrowth = 4;  // pieces that take few sweeps, before twice the length is tried
// After pieces with at most this many sweeps, a piece of twice the length is tried.
constexpr int kFewSweeps = SweepControl::kMostSweeps / 3;
constexpr std::uint64_t kPartialUpdate = 5;  // if fewer than one particle in 5 moved, only its pairs are evaluated
constexpr int kSwapsBeforeFreezing = 3;   // a particle is frozen at the next swap; swaps count once freezing may begin
constexpr double kFrequencyMargin = 1.1;  // for frequencies above the estimate
constexpr std::int64_t kStepsPerFrequency = 1000;  // steps for which the estimate is used
/// The number of contacts of a sphere in a slab at which a unit of time of the Yukawa fluid costs least (README.md).
constexpr double kMostContacts = 0.5;
constexpr std::int64_t kStepsPerEstimate = 16;  // steps of fixed length for one estimate of the local error
constexpr double kMostFolded = 0.1;             // of the kinetic energy
// The rounding of positions changes the energy by this fraction of Σ |F| |x|, in any method.
constexpr double kRoundingOfForces = 16 * std::numeric_limits<double>::epsilon();
constexpr double kConverged = 0.5;              // of the tolerance: a particle with a smaller residual keeps its path
constexpr double kConvergedInCollision = 0.05;  // the same after a collision: r is then of first order in e
constexpr double kForceRounding = 0x1p-43;      // two quanta of the forces, relative

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
          for (auto* each : {&a_, &mean_, &move_, &smooth_, &flown_, &w_, &lab_, &v_end_})
            std::vector<Vec<D>>().swap(*each);
          forces_ = {};
        },
        [this, &p] {
          for (auto* each : {&a_, &mean_, &move_, &v_end_}) each->resize(p.size(), Vec<D>::Zero());
          swaps_.resize(p.size());
        });
    evaluate_forces<D>(system, p.x, a_, counters);
    for (std::size_t i = 0; i < a_.size(); ++i) a_[i] /= p.mass[i];
    past_.start(system.fields, a_);
    system.fields.add_value("edda", scales_);
    system.fields.add_value("edda found", kept_);
    system.fields.add_value("edda owed", owed_);
    set_scales(system);
    const Vec<D> centre = velocity_of_centre(system);
    std::ranges::copy(centre, scales_.centre.begin());
  }

  void slab(System<D>& system, const Slab& slab, SlabReport<D>& report) override {
    counters_ = &report.counters;
    report_ = &report;
    const std::uint64_t counted = report.counters.contacts();
    if (slab.index != step_) counted_ = counted;
    most_contacts_ = slab.most_contacts;
    step_ = slab.index;
    if (!system.box.contacts.elastic()) set_scales(system);
    watch_ = report.watch;
    core_->begin_step(report.counters, report.contacts, &past_.last(), slab.length, watch_, counted - counted_);
    found_ = kept_;  // a step that is repeated forgets what its first attempt found
    advance(system, slab);
    kept_ = found_;
    system.wrap();
    report.reached = slab.length;
  }

 private:
  /// Results of one step that later steps use.
  struct Found {
    bool touching = true;                         // contacts at the start of the next piece may have to be resolved
    double squared_frequency = 0;                 // the largest; 0 as long as the sweeps contract fast
    std::int64_t measured = -kStepsPerFrequency;  // the step in which squared_frequency was estimated
    double longest = kNever;                      // the longest piece in which the sweeps converge
    int converged = 0;                            // pieces of this length that took few sweeps
  };

  /// Sets the scales of velocities and accelerations from the present ones.
  void set_scales(const System<D>& system) {
    const auto mean = [&](Positions<D> w) {
      const double n = static_cast<double>(std::max<std::size_t>(1, system.size()));
      return std::sqrt(sum_over_all<D>(system, [&](Id i) { return w[i].squaredNorm(); }) / n);
    };
    scales_.speed = mean(system.particles.v);
    scales_.strength = mean(past_.last());
  }

  /// The pieces of a step.
  void advance(System<D>& system, const Slab& slab) {
    auto& p = system.particles;
    auto& scan = core_->scan();
    // A piece is no longer than the sweeps converge in, and ends where a contact comes to rest or a resting one is hit.
    double done = 0, until_contact = kNever;
    double& longest = found_.longest;
    bool looked = false;  // at the contacts at the start of the piece, which must be resolved only once
    while (done < slab.length) {
      if (found_.touching && !looked && !system.box.sheared()) {
        looked = true;
        found_.touching = system.decomposition.any(scan.find_contacts(done, p.x, p.v));
        if (found_.touching) {
          system.decomposition.need_all();
          owed_ += scan.resolve(done, p.x, p.v, [&](const Touch<D>& touch) {
            return resolve_contact<D>(touch.key, touch.normal, system.box, p, touch.tether);
          });
          found_.touching = !scan.resting().empty();
        }
      }
      const double time_left = slab.length - done, piece = std::min({longest, until_contact, time_left});
      if (solve(system, piece, looked)) {
        judge(system, slab, piece);
        core_->commit(done);
        if (piece < time_left && watch_) watch_->before_change();
        finish(system, piece);
        ++counters_->pieces;
        done = piece == time_left ? slab.length : done + piece;
        if (piece == longest && sweeps_ <= kFewSweeps && ++found_.converged >= kPiecesBeforeGrowth) {
          longest = std::max(2 * piece, slab.length / kMostPieces);
          found_.converged = 0;
        }
        found_.touching = found_.touching || until_contact < kNever;
        until_contact = kNever;
        looked = false;
        continue;
      }
      system.decomposition.need_all();
      if (!end_.complete && !end_.too_strong && system.box.sheared())
        throw Error(Failure::numerical, partners(end_.key, system.box) +
                                            " come to rest on each other, and 'edda' does not hold contacts in a "
                                            "sheared box yet; take forces that press no spheres together");
      if (!end_.complete && !end_.too_strong) {
        scan.count_event(end_.key);
        until_contact = end_.time > 0 ? end_.time : kNever;
        found_.touching = found_.touching || until_contact == kNever;
        looked = looked && until_contact < kNever;
        continue;
      }
      if (slab.accuracy > 0 && !resting() && !(end_.time > 0)) throw StepTooLong{.length = 0.5 * slab.length};
      ++counters_->slabs_halved;
      longest = 0.5 * piece;
      found_.converged = 0;
      until_contact = kNever;
      if (longest * kMostPieces < slab.length && !end_.complete && end_.too_strong && end_.time > 0)
        throw Error(Failure::numerical,
                    partners(end_.key, system.box) + " collide again and again without moving, even in pieces of 1/" +
                        std::to_string(kMostPieces) +
                        " of the step: they have no room between their neighbours or walls; leave gaps between "
                        "spheres that fill a box from wall to wall, or use a smaller integrator.step");
      if (longest * kMostPieces < slab.length && resting() && !system.box.contacts.elastic())
        throw Error(Failure::numerical, "the sweeps do not converge even in " + std::to_string(kMostPieces) +
                                            " pieces of a step with " + std::to_string(scan.resting().size()) +
                                            " contacts at rest" + (held_ ? "" : ", whose reactions are not found") +
                                            "; give the contacts a larger rest_speed, for instance a thousandth of the "
                                            "speeds of impacts, or, if the forces are stiff, use a smaller step");
      if (longest * kMostPieces < slab.length)
        throw Error(Failure::numerical, "the sweeps do not converge even in " + std::to_string(kMostPieces) +
                                            " pieces; the forces, strongest on particle " +
                                            std::to_string(p.id_of(most_accelerated())) +
                                            ", are not finite or far too stiff for step = " + short_text(slab.length) +
                                            "; use a smaller integrator.step");
    }
  }

  /// Estimates the local error of a piece that has been solved. Throws StepTooLong.
  void judge(const System<D>& system, const Slab& slab, double piece) {
    if (slab.accuracy == 0 && slab.index % kStepsPerEstimate != 0) return;
    // A residual h |e| of at most tolerance_ · scale is left in both accelerations.
    const double scale = std::max(scales_.speed, piece * scales_.strength), before = past_.last_length();
    const double noise = tolerance_ * scale * (1 / piece + (before > 0 ? 1 / before : 0));
    const LocalError error = local_error<D>(system, resting() ? smooth_ : mean_, past_.last(), piece, before, noise);
    report_->error.add(error);
    need_accuracy(error, slab.accuracy, piece, slab.length);
  }

  /// Sweeps over a piece from the present state. If it returns true, core_ holds the flight on a_, mean_ the resulting
  /// accelerations, and balance_ the missing energy; if false, the piece must be shorter: it ends at a contact if end_
  /// is an incomplete flight that is not too strong, else it is halved. `resolved`: the contacts at its start have been
  /// handled.
  bool solve(System<D>& system, double h, bool resolved) {
    const Stopwatch watch(counters_->seconds.sweep);
    auto& p = system.particles;
    const std::size_t n = p.size();
    Chebyshev chebyshev(0.25 * h * h * found_.squared_frequency);
    // Stiff motion is not smooth from piece to piece.
    past_.expect(h, a_, chebyshev.plain() ? Extrapolation<D>::kOrder + 1 : 1);
    held_ = true;
    if (resting()) {
      mean_ = a_;
      hold(system, h, true);
      a_ = mean_;
    }
    const bool flows = system.box.shear_rate != 0;
    if (flows) {
      lab_ = p.v;
      from_start_ = {};
      from_start_.join(system, p.x, lab_, 1);
    }
    system.box.next_tilt = system.box.tilt + system.box.slide() * h;
    core_->begin(flows ? lab_ : p.v, a_, h, resolved);
    std::ranges::fill(swaps_, 0);
    std::ranges::fill(move_, Vec<D>::Zero());
    any_freezes_ = false;
    const double scale = std::max(scales_.speed, h * scales_.strength);
    SweepControl control(resting() ? 0 : tolerance_ * scale);  // 0: rounding, else contacts at rest would open
    while (control.below_limit()) {
      if (watch_) watch_->look();
      end_ = core_->fly(a_);
      sweeps_ = control.sweep() + 1;
      if (!end_.complete) return false;
      if (const auto contacts = static_cast<double>(core_->all_contacts());
          contacts > most_contacts_ && control.sweep() == 0) {
        core_->scan().list().drop();  // it has far too many pairs for a shorter slab
        throw StepTooLong{.length = h * 0.5 * most_contacts_ / contacts};
      }
      const auto [squared, swaps] = evaluate(system, h, control.sweep() == 0);
      const double largest = h * std::sqrt(squared);
      if (!std::isfinite(largest) || !held_) return false;
      control.note(largest, kForceRounding * (resting() ? std::max(scale, pressed_) : scale));
      if (control.good_enough()) {
        if (balance(system, h)) return true;
        if (control.converged() || any_freezes_) return false;
        control.want_rounding();
      }
      if (control.may_freeze() && swaps > 0) freeze();
      if (control.stalls(chebyshev.rate())) {
        if (!control.may_stall_again()) return false;
        freeze_stalled(largest / h);
      }
      if (chebyshev.plain() && control.slow() && step_ >= found_.measured + kStepsPerFrequency) {
        found_.measured = step_;
        found_.squared_frequency = kFrequencyMargin * largest_squared_frequency(system);
        chebyshev = Chebyshev(0.25 * h * h * found_.squared_frequency);
        ++counters_->fallbacks;
      }
      chebyshev.next();
      const double small = kConverged * control.wanted() / h,
                   in_collision = kConvergedInCollision * control.wanted() / h;
      for (Id i = 0; i < n; ++i) {
        if (frozen(i)) continue;
        const Vec<D> e = mean_[i] - a_[i];
        if (!chebyshev.plain())
          a_[i] += move_[i] = chebyshev.memory() * move_[i] + chebyshev.gain() * e;
        else if (e.squaredNorm() > (core_->collides(i) ? in_collision * in_collision : small * small))
          a_[i] = mean_[i];
      }
    }
    return false;
  }

  /// Computes the accelerations that result from the flight. If the ends of few particles have changed, only their
  /// pairs are evaluated again: integer sums allow the old terms to be subtracted exactly. Returns, over all particles
  /// that are not frozen, the largest |e|² and a positive number if partners are still swapped.
  std::array<double, 2> evaluate(const System<D>& system, double h, bool first) {
    const Stopwatch watch(counters_->seconds.force);
    const auto& p = system.particles;
    const auto& x = core_->x();
    const bool all = first || kPartialUpdate * core_->all_moved() > system.size();
    std::uint64_t pairs =
        all ? forces_.evaluate(system, p.x, x) : forces_.update(system, p.x, core_->last_x(), x, core_->moved().data());
    for (Id i = 0; i < x.size(); ++i) mean_[i] = forces_[i];
    system.decomposition.copy_to_ghosts(std::span(mean_));
    for (Id i = 0; i < x.size(); ++i) mean_[i] /= p.mass[i];
    if (resting()) hold(system, h, false);
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

  /// Freezes colliding particles whose paths do not converge: a grazing contact may amplify a small change.
  void freeze_stalled(double largest) {
    any_freezes_ = true;
    for (Id i = 0; i < a_.size(); ++i)
      if (core_->collides(i) && !frozen(i) && (mean_[i] - a_[i]).norm() >= SweepControl::kStalled * largest)
        swaps_[i] = kSwapsBeforeFreezing + 1;
  }

  Id most_accelerated() const {
    const auto most = std::ranges::max_element(a_, {}, [](const Vec<D>& a) { return finite(a.squaredNorm()); });
    return static_cast<Id>(most - a_.begin());
  }

  Vec<D> centre() const { return Vec<D>(scales_.centre.data()); }
  bool frozen(Id i) const { return swaps_[i] > kSwapsBeforeFreezing; }
  static double finite(double value) { return std::isnan(value) ? kNever : value; }

  /// Counts the swaps of partners of each particle. A particle that swaps repeatedly keeps its acceleration from then
  /// on; if it still swaps, its partners are counted as swapping, too.
  void freeze() {
    any_freezes_ = true;
    std::vector<std::pair<Id, Id>> met;  // partners in the last flight, once they matter
    for (const Id i : core_->swapped()) {
      if (++swaps_[i] <= 2 * kSwapsBeforeFreezing) continue;
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

  bool resting() { return !core_->scan().resting().empty(); }

  /// Adds the reactions of resting contacts to mean_, the accelerations caused by forces. `first`: there is no flight
  /// yet.
  void hold(const System<D>& system, double h, bool first) {
    const auto& p = system.particles;
    auto& scan = core_->scan();
    smooth_ = mean_;
    flown_.resize(p.size());
    w_.resize(p.size());
    const auto for_each_body = [](const RestingContact<D>& contact, auto&& visit) {
      visit(contact.key.lo);
      if (contact.key.kind == EventKind::pair) visit(contact.key.hi);
    };
    const auto for_each_held = [&](auto&& visit) {
      for (const auto& contact : scan.resting()) for_each_body(contact, visit);
    };
    for_each_held([&](Id i) {
      flown_[i] =
          first ? p.v[i] : Vec<D>(p.v[i] + (0.5 * h) * a_[i]);  // resting particles have no collision in the piece
      w_[i] = p.v[i] + (0.5 * h) * mean_[i];
    });
    held_ = scan.hold_means(p.x, flown_, w_, h);
    pressed_ = 0;  // the largest speed that a single reaction causes
    for (const auto& contact : scan.resting())
      for_each_body(contact, [&](Id i) { pressed_ = std::max(pressed_, h * contact.force / p.mass[i]); });
    for_each_held([&](Id i) { mean_[i] = 2 / h * (w_[i] - p.v[i]); });
  }

  /// Computes the velocities at the piece's end, with the kick h e, and the energy that is missing then. Returns false
  /// if that energy can neither be folded into the velocities nor be carried over as rounding. Collective.
  bool balance(System<D>& system, double h) {
    struct Sums {
      ExactSum missing, kinetic;
      void add(const Sums& other) { missing.add(other.missing), kinetic.add(other.kinetic); }
    };
    const auto& p = system.particles;
    const auto &x = core_->x(), &v = core_->v();
    for (Id i = 0; i < p.size(); ++i) v_end_[i] = v[i] + h * (mean_[i] - a_[i]);
    if (system.box.shear_rate != 0) {
      FlowEnergy<D> flow = from_start_;
      flow.join(system, x, v_end_, -1);
      from_flow_ = system.decomposition.sum(flow).booked;
      from_flow_.add((system.box.next_tilt - system.box.tilt) * system.decomposition.sum(forces_.by_tilt()).value());
    }
    ExactSeries missing_here, kinetic;
    double pressing = 0;  // Σ |F| |x| of reactions
    double stopped = 0;   // energy that held contacts have dissipated
    if (resting()) {      // then every rank has all particles
      const auto hit = [&](Id i) { return core_->collides(i); };
      const bool slow = core_->scan().held_slowly(x, v_end_, h, hit);
      const double lost = core_->scan().slide(x, v_end_, h, hit);
      if (slow && lost > 0) stopped = lost;
      if (system.decomposition.ranks().rank() == 0) {
        missing_here.add(lost - stopped);
        for (const auto& contact : core_->scan().resting()) {
          const Id lo = contact.key.lo, hi = contact.key.hi;
          Vec<D> moved = x[lo] - p.x[lo];
          if (contact.key.kind == EventKind::pair)
            moved -= x[hi] - p.x[hi];
          else
            moved -= h * core_->scan().mean_speed(hi, h) * contact.normal;
          missing_here.add(-contact.force * contact.normal.dot(moved) / contact.normal.norm());
        }
      }
      for (const auto& contact : core_->scan().resting()) pressing += contact.force * p.x[contact.key.lo].norm();
    }
    for (Id i = 0; i < p.size(); ++i) {
      if (!p.owns(i)) continue;
      const Vec<D> e = mean_[i] - a_[i];
      missing_here.add(moving_mass(p.mass[i]) * (e.dot(x[i] - p.x[i] - h * v[i]) - 0.5 * h * h * e.squaredNorm()));
      kinetic.add(0.5 * moving_mass(p.mass[i]) * (v_end_[i] - centre()).squaredNorm());
    }
    const Sums sums = system.decomposition.sum(Sums{missing_here.sum(), kinetic.sum()});
    const double missing = sums.missing.value(), most = kMostFolded * sums.kinetic.value();
    const bool folds_all = std::abs(missing + owed_) <= most, folds = folds_all || std::abs(missing) <= most;
    const double r = folds_all ? missing + owed_ : missing, share = r / sums.kinetic.value();
    const double left = folds_all ? 0 : folds ? owed_ : owed_ + missing;
    const bool dissipates = !system.box.contacts.elastic();
    // The stretch is √(1 + share) − 1, computed without cancellation.
    balance_ = {.owed = dissipates ? 0 : left,
                .dissipated = dissipates ? left + stopped : 0,
                .folded = folds ? std::abs(r) : 0,
                .stretch = folds && r != 0 ? share / (1 + std::sqrt(1 + share)) : 0};
    if (any_freezes_)
      balance_.frozen =
          static_cast<std::uint64_t>(sum_over_all<D>(system, [&](Id i) { return frozen(i) ? 1.0 : 0.0; }));
    if (folds) return true;
    const double forces = sum_over_all<D>(system, [&](Id i) {
      return moving_mass(p.mass[i]) * std::sqrt(mean_[i].squaredNorm() * p.x[i].squaredNorm());
    });
    return std::abs(missing) <= kRoundingOfForces * (forces + pressing);
  }

  /// Moves the particles to the piece's end and folds in the missing energy.
  void finish(System<D>& system, double h) {
    auto& p = system.particles;
    core_->scan().remember(h);
    core_->finish(p);
    p.v.swap(v_end_);
    if (balance_.stretch != 0)
      for (auto& v : p.v) v += balance_.stretch * (v - centre());
    owed_ = balance_.owed;
    if (balance_.dissipated != 0) counters_->dissipated.add(balance_.dissipated);
    counters_->folded += balance_.folded;
    if (system.box.shear_rate != 0) counters_->shear.add(from_flow_);
    counters_->frozen += balance_.frozen;
    system.decomposition.update_halo();
    past_.pass(h, resting() ? smooth_ : mean_);
  }

  std::uint64_t max_events_;
  double tolerance_;  // largest residual h |e|, relative to the speed scale
  struct Scales {
    double speed = 0, strength = 0;  // root mean square velocity and acceleration at the start of the run or, if
                                     // contacts dissipate, of the step
    std::array<double, D> centre{};  // velocity of the centre of mass, if momentum is conserved
  } scales_;
  std::optional<SlabCore<D>> core_;
  Extrapolation<D> past_;
  MeanForces<D> forces_;
  std::uint64_t pairs_ = 0;        // within the cutoff
  std::vector<Vec<D>> a_, mean_;   // accelerations of the flight, and those that result from it
  std::vector<Vec<D>> smooth_;     // mean_ without reactions, if contacts rest
  std::vector<Vec<D>> flown_, w_;  // mean velocities of particles in contacts at rest
  std::vector<Vec<D>> lab_;        // velocities in the laboratory at the start of a piece, in a sheared box
  FlowEnergy<D> from_start_;       // the part of the energy that the flow gives in the piece that its start determines
  ExactSum from_flow_;             // all of this energy
  std::vector<Vec<D>> v_end_;      // relative to the flow
  struct Balance {
    double owed = 0, dissipated = 0, folded = 0, stretch = 0;
    std::uint64_t frozen = 0;
  } balance_;                         // of the last piece that was solved
  double owed_ = 0;                   // missing energy that is carried over
  double pressed_ = 0;                // the largest speed that a single reaction causes in the piece
  bool held_ = true;                  // the reactions were found
  std::vector<std::uint32_t> swaps_;  // of partners, by particle
  bool any_freezes_ = false;          // on any rank, in this piece
  Found found_, kept_;                // kept_: at the end of the last step
  int sweeps_ = 0;                    // of the last piece
  FlightEnd<D> end_;                  // of the last flight
  std::int64_t step_ = -1;
  std::vector<Vec<D>> move_;  // change of a_ in the last sweep
  Counters* counters_ = nullptr;
  SlabReport<D>* report_ = nullptr;
  double most_contacts_ = 0;
  std::uint64_t counted_ = 0;  // contacts of the run before this step
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
      .parameters = parameter::with_adaptive_steps(
          {{.name = "tolerance",
            .type = Parameter::Type::real,
            .fallback = "1e-10",
            .unit = "-",
            .meaning = "largest residual of a step's impulses, as a velocity relative to the root mean square velocity "
                       "at the start; the energy stays exact: the missing energy is folded into the velocities "
                       "(energy.folded of summary.json); 0: rounding",
            .range = Parameter::Range::non_negative}}),
      .documentation =
          "Each particle moves under a constant acceleration of its own over the step, through all its collisions; the "
          "accelerations are the discrete gradient between the step's two ends. Sweeps find them; each sweep costs a "
          "force pass and the collisions. Energy is exact whatever the step and the number of collisions.",
      .source =
          "this project; relatives: LaBudde, Greenspan, Numer. Math. 25 (1976) 323; Gonzalez, J. Nonlinear Sci. "
          "6 (1996) 449; Gonzalez, Schmidt, Ortiz, Int. J. Numer. Methods Eng. 82 (2010) 205 and 84 (2010) 1407",
      .exact = true,
      .local = true,
      .steps = true,
      .shear = true,
      .adapts = true,
      .most_contacts = kMostContacts,
      .in_2d = make<EventDrivenDiscreteGradient, 2>,
      .in_3d = make<EventDrivenDiscreteGradient, 3>};
}

}  // namespace carom::integrator
