// SPDX-License-Identifier: BSD-3-Clause
// mcva: cva with impulses that conserve the shadow Hamiltonian S_h = H + h² G instead of H.
//
// With n the gradient of the gap, w = M⁻¹n and K = V″, an impulse λn changes S_h by bλ + ½aλ² exactly:
//   a = nᵀw + (h²/6) wᵀKw,   b = nᵀv + (h²/6) wᵀKv.
// A piece of length τ ≠ h conserves S_τ, not S_h: the next impulse makes up for (h² − τ²)(G(end) − G(start)).

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/base/error.h"
#include "engine/events/meeting.h"
#include "engine/integrators/collision_verlet.h"
#include "engine/integrators/registry.h"

namespace carom::integrator {
namespace {

/// If the shadow impulse would leave less than this fraction of the approach velocity, the elastic impulse is used.
constexpr double kLeastRestitution = 0.5;

template <int D>
class ModifiedCollisionVerlet : public Integrator<D> {
 public:
  explicit ModifiedCollisionVerlet(const Parameters& parameters)
      : h_(parameters.real("step")),
        restart_(parameters.text("variant") == "restart"),
        max_events_(static_cast<std::uint64_t>(parameters.integer("max_events_per_step"))) {}

  void start(System<D>& system, Counters& counters) override {
    // In a step a shaken wall moves on a parabola, and the next one begins at the end of the step, not at a node.
    if (restart_ && std::ranges::any_of(system.box.options, [](const auto& wall) { return wall.amplitude != 0; }))
      throw Error(Failure::deck, "mcva with variant = \"restart\" knows no shaken walls; take variant = \"grid\"");
    if (restart_ && system.box.bath.type != Bath::Type::none)
      throw Error(Failure::deck, "mcva with variant = \"restart\" knows no baths; take variant = \"grid\"");
    pieces_.emplace(system, max_events_);
    pieces_->start(counters);
    node_ = system.particles;
    const std::size_t n = system.particles.size();
    force_.resize(n);
    product_.resize(n);
    w_.assign(n, Vec<D>::Zero());
    system.fields.add_value("debt", debt_);
    if (!restart_) return;
    system.fields.add_value("lag", lag_);
    system.fields.add("node position", node_.x);
    system.fields.add("node velocity", node_.v);
    system.fields.add("node image", node_.image);
  }

  const PotentialSums* potential() const override { return &pieces_->potential(); }
  Positions<D> accelerations() const override { return pieces_->a(); }

  void slab(System<D>& system, const Slab& slab, SlabReport<D>& report) override {
    counters_ = &report.counters;
    pieces_->begin_step(report, slab.length);
    if (restart_ && report.watch) report.watch->before_change();
    if (restart_)
      restart_slab(system, slab.length);
    else
      grid_slab(system, slab.length);
    report.reached = slab.length;
  }

  const Particles<D>* energy_state() const override { return restart_ ? &node_ : nullptr; }

 private:
  static void take_motion(Particles<D>& to, const Particles<D>& from) {
    to.x = from.x;
    to.v = from.v;
    to.image = from.image;
  }

  /// On CVA's time grid: the pieces fill the slab.
  void grid_slab(System<D>& system, double length) {
    double done = 0;
    for (bool contact = true; contact;) {
      collide(system, done);
      const double time_left = length - done, tau = pieces_->next_contact(time_left);
      contact = tau < time_left;
      advance(system, tau);
      done += tau;
    }
    system.wrap();
  }

  /// A full step begins after each collision. The integration stays at its last node, up to a step before the end of
  /// the slab; the system at the end of the slab is a copy, advanced by a shorter step.
  void restart_slab(System<D>& system, double length) {
    auto& p = system.particles;
    take_motion(p, node_);
    system.box.time -= lag_;
    double node_time = -lag_;
    for (;;) {
      collide(system, node_time);
      const double time_left = length - node_time;
      const bool whole = time_left >= h_ * (1 - 1e-12);  // a whole step fits
      const double limit = whole ? h_ : time_left, tau = pieces_->next_contact(limit);
      if (tau == limit && !whole) break;
      advance(system, tau);
      node_time += tau;
    }
    system.wrap();
    lag_ = length - node_time;
    take_motion(node_, p);
    node_.spin = p.spin;  // no contact comes after the node
    if (lag_ <= 0) return;
    system.box.time += lag_;
    for (std::size_t i = 0; i < p.size(); ++i) {
      p.v[i] += (0.5 * lag_) * pieces_->flight()[i];
      p.x[i] += lag_ * p.v[i];
    }
    evaluate_forces<D>(system, p.x, force_, *counters_);
    for (std::size_t i = 0; i < p.size(); ++i) p.v[i] += (0.5 * lag_ / p.mass[i]) * force_[i];
    system.wrap();
  }

  void advance(System<D>& system, double tau) {
    if (tau == h_) return pieces_->advance(tau);
    const double before = shadow(system);
    pieces_->advance(tau);
    debt_ += (h_ * h_ - tau * tau) * (shadow(system) - before);
  }

  double shadow(const System<D>& system) {
    const auto& p = system.particles;
    return shadow_term<D>(system, p, pieces_->a(), product_, *counters_);
  }

  void collide(System<D>& system, double time) {
    pieces_->collide(time, [&](const Touch<D>& touch) { return impulse(system, touch); });
  }

  /// Returns the energy that the contact dissipates.
  double impulse(System<D>& system, const Touch<D>& touch) {
    auto& p = system.particles;
    const Id lo = touch.key.lo, hi = touch.key.hi;
    if ((!touch.pair() && system.box.wall(hi).thermal()) || law_of(system, touch).rough())
      return resolve_contact<D>(touch.key, touch.normal, system.box, p);
    const Vec<D>& n = touch.normal;
    w_[lo] = n / p.mass[lo];
    if (touch.pair()) w_[hi] = -n / p.mass[hi];
    evaluate_hessian_product<D>(system, p.x, w_, product_, *counters_);
    double nw = n.dot(w_[lo]), nv = n.dot(p.v[lo]), wKw = w_[lo].dot(product_[lo]), wKv = 0;
    if (touch.pair()) {
      nw -= n.dot(w_[hi]);
      nv -= n.dot(p.v[hi]);
      wKw += w_[hi].dot(product_[hi]);
    } else {
      nv -= touch.speed;  // then bλ + ½aλ² is the change of S_h less the work of the wall
    }
    for (std::size_t i = 0; i < p.size(); ++i) wKv += product_[i].dot(p.v[i]);
    const double sixth = h_ * h_ / 6;
    const double a = nw + sixth * wKw, b = nv + sixth * wKv;
    const double discriminant = b * b - 2 * a * debt_;
    double lambda = a > 0 && b < 0 && discriminant >= 0 ? (std::sqrt(discriminant) - b) / a : -2 * b / a;
    double dissipated = 0;
    if (!system.box.contacts.elastic()) {  // the shadow impulse is elastic
      const PairImpulse<D> inelastic = law(system, touch);
      if (inelastic.dissipated != 0) lambda = inelastic.factor, dissipated = inelastic.dissipated;
    }
    // Impulses that remove most of a slow pair's normal velocity, contact after contact, would bring it to rest.
    if (dissipated == 0 && (!(a > 0) || !(nv + lambda * nw > -kLeastRestitution * nv))) {
      lambda = -2 * nv / nw;
      ++counters_->fallbacks;
    }
    debt_ += lambda * (b + 0.5 * a * lambda) + dissipated;
    p.v[lo] += lambda * w_[lo];
    w_[lo].setZero();
    if (touch.pair()) {
      p.v[hi] += lambda * w_[hi];
      w_[hi].setZero();
    }
    return dissipated;
  }

  static ContactLaw law_of(const System<D>& system, const Touch<D>& touch) {
    const ContactLaws& laws = system.box.contacts;
    const auto& species = system.particles.species;
    if (laws.elastic()) return {};
    return touch.pair() ? laws.of_pair(species[touch.key.lo], species[touch.key.hi])
                        : laws.of_wall(species[touch.key.lo], touch.key.hi);
  }

  /// The impulse of the law of this contact, in multiples of the normal.
  static PairImpulse<D> law(const System<D>& system, const Touch<D>& touch) {
    const auto& p = system.particles;
    const Id lo = touch.key.lo, hi = touch.key.hi;
    const auto partner = [&](Id i) { return Partner<D>{p.mass[i], p.radius[i], p.species[i]}; };
    if (touch.pair())
      return pair_impulse<D>(system.box.contacts, touch.normal, p.v[lo] - p.v[hi], partner(lo), partner(hi));
    const auto bounced =
        wall_impulse<D>(system.box.contacts, system.box.wall(hi).at(p.x[lo]), p.v[lo], partner(lo), {});
    return {.factor = bounced.exchange.impulse, .dissipated = bounced.exchange.dissipated};
  }

  double h_;
  bool restart_;
  std::uint64_t max_events_;
  std::optional<VerletPieces<D>> pieces_;
  Counters* counters_ = nullptr;
  double debt_ = 0;  // S_h owed to the next impulse
  double lag_ = 0;   // restart: from the last node to the end of the slab
  Particles<D> node_;
  std::vector<Vec<D>> force_, product_, w_;
};

}  // namespace

IntegratorInfo mcva() {
  return {
      .name = "mcva",
      .title = "Modified Collision Verlet Algorithm",
      .order = "2",
      .conserves =
          "linear momentum to rounding; the shadow energy S_h across collisions (order 4 with variant restart)",
      .parameters = {parameter::step(),
                     parameter::longest_step(),
                     {.name = "variant",
                      .type = Parameter::Type::text,
                      .fallback = "\"grid\"",
                      .unit = "-",
                      .meaning = "grid: complete the step that a collision cuts; restart: begin a new full step after "
                                 "each collision",
                      .choices = {"grid", "restart"}},
                     parameter::max_events_per_step()},
      .documentation =
          "CVA with impulses that conserve the second-order shadow Hamiltonian of Verlet, so that the "
          "energy does not drift from collision to collision. An impulse that would hardly separate the spheres "
          "is replaced by the elastic one and counted as a fallback.",
      .source = "Bond, Leimkuhler, SIAM J. Sci. Comput. 30 (2007) 134",
      .shadow = true,
      .in_2d = make<ModifiedCollisionVerlet, 2>,
      .in_3d = make<ModifiedCollisionVerlet, 3>};
}

}  // namespace carom::integrator
