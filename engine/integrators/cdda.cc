// SPDX-License-Identifier: BSD-3-Clause
// cdda: the whole step is cut at each collision; each piece is a discrete-gradient step, exact in energy for any
// length.
//
// The collision time τ* is the length of the piece that ends in contact. It is the zero of c(τ) − τ, where c(τ) is the
// first contact on the chord of the piece of length τ. A bracketed secant method finds it: shorter pieces end before
// the contact, longer ones beyond it. The energy of any accepted piece is exact; the search determines only the gap.

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "engine/base/error.h"
#include "engine/events/meeting.h"
#include "engine/integrators/chord_contacts.h"
#include "engine/integrators/discrete_gradient.h"
#include "engine/integrators/registry.h"
#include "engine/stepping/contact_scan.h"
#include "engine/stepping/local_error.h"

namespace carom::integrator {
namespace {

/// A step that does not converge in this many equal pieces ends the run. Halving a piece divides the contraction by
/// four: forces may be 4¹⁴ = 3·10⁸ times too stiff for the step.
constexpr int kMostPieces = 1 << 14;
/// The velocity that the iteration of a piece leaves undetermined, relative to the largest (discrete_gradient.cc).
constexpr double kRoundingOfPieces = 16 * std::numeric_limits<double>::epsilon();
constexpr double kMostFolded = 0.1;  // of the kinetic energy, as in edda

template <int D>
class CollisionDiscreteDerivative : public Integrator<D> {
 public:
  explicit CollisionDiscreteDerivative(const Parameters& parameters)
      : order_(static_cast<int>(parameters.integer("order"))),
        max_events_(static_cast<std::uint64_t>(parameters.integer("max_events_per_step"))) {}

  void start(System<D>& system, Counters&) override {
    Counters uncounted;
    last_a_.resize(system.size());
    evaluate_forces<D>(system, system.particles.x, last_a_, uncounted);
    for (std::size_t i = 0; i < last_a_.size(); ++i) last_a_[i] /= system.particles.mass[i];
    system.fields.add("last acceleration", last_a_);
    system.fields.add_value("last length", last_length_);
    scan_.emplace(system, max_events_, reactions_);
    scan_->rest().let_open();
    system.fields.add_value("reactions", reactions_);
    system.fields.add_value("cdda owed", owed_);
    piece_.emplace(system, order_);
    contacts_.emplace(system, *scan_);
  }

  void slab(System<D>& system, const Slab& slab, SlabReport<D>& report) override {
    counters_ = &report.counters;
    watch_ = report.watch;
    scan_->begin_step(report.counters, report.contacts, &piece_->a(), slab.length, watch_);
    if (watch_) watch_->before_change();  // a solve changes the accelerations that the next one starts from
    auto& p = system.particles;
    const auto contact = [&](const Touch<D>& touch) {
      return resolve_contact<D>(touch.key, touch.normal, system.box, p, touch.tether);
    };
    double done = 0, longest = slab.length;
    bool ended = false;
    while (!ended) {
      owed_ += scan_->resolve(done, p.x, p.v, contact);
      const double time_left = slab.length - done;
      if (!(time_left > 0)) break;  // the last contact rounds to the end of the slab
      const double wanted = std::min(time_left, longest), tau = find_piece(p, wanted);
      if (tau == 0) {  // no convergence
        longest = 0.5 * wanted;
        if (slab.accuracy > 0) throw StepTooLong{.length = 0.5 * slab.length};
        ++report.counters.slabs_halved;
        if (longest * kMostPieces < slab.length)
          throw Error(
              Failure::numerical,
              "the discrete-gradient step does not converge even in " + std::to_string(kMostPieces) +
                  " pieces; the forces are not finite or far too stiff for step = " + short_text(slab.length) +
                  (scan_->resting().empty()
                       ? ""
                       : ", or " + std::to_string(scan_->resting().size()) +
                             " contacts at rest are wedged between walls or neighbours; take a smaller step, or "
                             "integrator.type = \"edda\""));
        continue;
      }
      judge(system, slab, tau, report);
      ended = tau == time_left;
      if (!ended && done + tau == done) scan_->count_event(violator_);  // limits the number of pieces of length zero
      std::ranges::copy(piece_->x(), p.x.begin());
      std::ranges::copy(piece_->v(), p.v.begin());
      scan_->remember(tau);
      system.box.time += tau;
      owed_ += scan_->slide(p.x, p.v);
      fold(system);
      done += tau;
      for (const Arrival<D>& arrival : contacts_->arrivals()) meet_step(system, arrival, done);
    }
    system.wrap();
    report.reached = slab.length;
  }

 private:
  /// Executes the event of a pair that has arrived at a step, `time` after the start of the slab, unless an earlier one
  /// has turned the pair back.
  void meet_step(System<D>& system, const Arrival<D>& arrival, double time) {
    auto& p = system.particles;
    const Id lo = arrival.key.lo, hi = arrival.key.hi;
    const Vec<D> d = p.x[lo] - p.x[hi] + system.box.shift(arrival.key.image), v = p.v[lo] - p.v[hi];
    if (arrival.side * d.dot(v) >= 0) return;
    const auto partner = [&](Id i) { return Partner<D>{p.mass[i], p.radius[i], p.species[i]}; };
    const PairImpulse<D> impulse = step_impulse<D>(*arrival.step, system.box.contacts, d, v, partner(lo), partner(hi));
    impulse.apply(d, p.mass[lo], p.v[lo], p.mass[hi], p.v[hi]);
    Contact<D> contact{arrival.key, p.x[lo], p.x[hi] - system.box.shift(arrival.key.image), impulse.on_first(d)};
    contact.exchange = {.virial = d.dot(contact.impulse), .stored = impulse.stored, .event = impulse.event};
    contact.v_lo = p.v[lo];
    contact.v_hi = p.v[hi];
    scan_->commit(time, {&contact, 1});
  }

  /// Estimates the local error of the piece in piece_. Throws StepTooLong.
  void judge(const System<D>& system, const Slab& slab, double tau, SlabReport<D>& report) {
    const double noise =
        kRoundingOfPieces * fastest(system.particles) * (1 / tau + (last_length_ > 0 ? 1 / last_length_ : 0));
    const LocalError error = local_error<D>(system, piece_->a(), last_a_, tau, last_length_, noise);
    report.error.add(error);
    need_accuracy(error, slab.accuracy, tau, slab.length);
    last_a_ = piece_->a();
    last_length_ = tau;
  }
  static double fastest(const Particles<D>& p) {
    double squared = 0;
    for (const Vec<D>& v : p.v) squared = std::max(squared, v.squaredNorm());
    return std::sqrt(squared);
  }

  /// Folds what contacts have lost that came to rest, or that were held over a piece, into the velocities relative to
  /// the centre of mass. If it is more than a tenth of the kinetic energy, contacts have dissipated it.
  void fold(System<D>& system) {
    if (system.box.contacts.elastic()) owed_ = 0;  // contacts without a law lose rounding only
    if (owed_ == 0) return;
    auto& p = system.particles;
    const Vec<D> centre = velocity_of_centre(system);
    double kinetic = 0;
    for (Id i = 0; i < p.size(); ++i) kinetic += 0.5 * moving_mass(p.mass[i]) * (p.v[i] - centre).squaredNorm();
    if (!(std::abs(owed_) <= kMostFolded * kinetic)) {
      if (owed_ > 0) counters_->dissipated.add(std::exchange(owed_, 0));
      return;
    }
    const double share = owed_ / kinetic, stretch = share / (1 + std::sqrt(1 + share));
    for (Id i = 0; i < p.size(); ++i)
      if (!p.fixed(i)) p.v[i] += stretch * (p.v[i] - centre);
    counters_->folded += std::abs(std::exchange(owed_, 0));
  }

  /// Leaves in piece_ the longest piece from p, at most `time_left`, that ends before or in the first contact; returns
  /// its length, or 0 if the solver does not converge.
  double find_piece(const Particles<D>& p, double time_left) {
    PieceEnd<D> end = solve(p, time_left);
    if (!end.converged) return 0;
    if (!end.violates) return time_left;
    double lo = 0, hi = time_left, tau = time_left, last_tau = 0, last_miss = 0;
    violator_ = end.violator;
    bool known = false;  // last_tau and last_miss are
    for (int iteration = 0; hi - lo > 4 * std::numeric_limits<double>::epsilon() * time_left; ++iteration) {
      const double miss = end.contact - tau;
      double next = end.contact;
      if (known && miss != last_miss && std::isfinite(miss)) {
        const double secant = tau - miss * (tau - last_tau) / (miss - last_miss);
        if (secant > lo && secant < hi) next = secant;
      }
      if (std::isfinite(miss)) {
        last_tau = tau;
        last_miss = miss;
        known = true;
      }
      if (!(next > lo && next < hi) || iteration % 8 == 7) next = 0.5 * (lo + hi);
      if (next <= lo || next >= hi) break;
      tau = next;
      end = solve(p, tau);
      if (!end.converged) return 0;
      if (end.violates) {
        hi = tau;
        violator_ = end.violator;
      } else {
        if (end.touches) return tau;
        lo = tau;
      }
    }
    // The bracket has closed on a jump: a grazing contact that exists for some τ only. The piece before it is accepted.
    if (lo == 0)
      throw Error(Failure::numerical, partners(violator_, scan_->box()) +
                                          " meet at once, however short the step; "
                                          "separate them or give them a relative velocity");
    scan_->count_event(violator_);
    end = solve(p, lo);
    return end.converged ? lo : 0;
  }

  PieceEnd<D> solve(const Particles<D>& p, double tau) {
    if (watch_) watch_->look();
    {
      const Stopwatch watch(counters_->seconds.sweep);
      if (!piece_->solve(p.x, p.v, tau, *scan_, *counters_)) return {.converged = false};
    }
    const Stopwatch watch(counters_->seconds.predict);
    return contacts_->judge(p.x, p.v, *piece_, tau);
  }

  int order_;
  std::uint64_t max_events_;
  std::vector<Reaction<D>> reactions_;
  std::optional<ContactScan<D>> scan_;
  std::optional<DiscreteGradient<D>> piece_;
  std::optional<ChordContacts<D>> contacts_;
  std::vector<Vec<D>> last_a_;  // mean accelerations of the last piece, of this length; 0: those at the start
  double last_length_ = 0;
  EventKey<D> violator_{};  // the contact that limits the last piece
  double owed_ = 0;         // missing energy that is carried over
  Counters* counters_ = nullptr;
  SlabWatch* watch_ = nullptr;
};

}  // namespace

IntegratorInfo cdda() {
  return {
      .name = "cdda",
      .title = "Collision Discrete Derivative Algorithm",
      .order = "2 or 4",
      .conserves = "energy and linear momentum to rounding, for any step",
      .parameters = parameter::with_adaptive_steps(
          {{.name = "order",
            .type = Parameter::Type::integer,
            .fallback = "2",
            .unit = "-",
            .meaning =
                "2: the plain discrete-gradient step; 4: composed of five (about five times the cost; `accuracy` "
                "then chooses shorter steps than it must)",
            .range = Parameter::Range::positive,
            .choices = {"2", "4"}}}),
      .documentation =
          "Discrete-gradient steps, cut for all particles at each collision so that every piece ends in contact. "
          "Each piece conserves the energy exactly, whatever its length. Each collision costs a few implicit solves of "
          "the whole system.",
      .source =
          "Enomoto, thesis, 2011; Gonzalez, J. Nonlinear Sci. 6 (1996) 449; LaBudde, Greenspan, Numer. Math. "
          "25 (1976) 323; Suzuki, Phys. Lett. A 146 (1990) 319",
      .exact = true,
      .steps = true,
      .adapts = true,
      .in_2d = make<CollisionDiscreteDerivative, 2>,
      .in_3d = make<CollisionDiscreteDerivative, 3>};
}

}  // namespace carom::integrator
