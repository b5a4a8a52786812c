// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/potentials/field_term.h"
#include "engine/forces/potentials/options.h"
#include "engine/forces/potentials/types.h"

namespace carom::types {
namespace {

/// V_i = ½ k |x − c|²; its discrete gradient is the gradient at the midpoint.
template <int D>
class HarmonicTrap {
 public:
  HarmonicTrap(double stiffness, const Vec<D>& centre) : k_(stiffness), centre_(centre) {}

  HarmonicTrap among(const Particles<D>&) const { return *this; }
  double least_force(double distance) const { return k_ * distance; }
  double value(Id, const Vec<D>& x) const { return 0.5 * k_ * (x - centre_).squaredNorm(); }
  Vec<D> gradient(Id, const Vec<D>& x) const { return k_ * (x - centre_); }
  Vec<D> mean_gradient(Id, const Vec<D>& x, const Vec<D>& x_new) const {
    return 0.5 * k_ * ((x - centre_) + (x_new - centre_));
  }
  Vec<D> hessian_product(Id, const Vec<D>&, const Vec<D>& w) const { return k_ * w; }

 private:
  double k_;  ///< [energy/length²]
  Vec<D> centre_;
};

template <int D>
std::unique_ptr<Interaction<D>> make(const Parameters& p, const InteractionContext<D>& context) {
  constexpr std::string_view type = "harmonic-trap";
  if (context.box.has(Boundary::periodic))
    options::refuse(type, "has no single-valued potential in a periodic box; make the boundaries 'wall' or 'open'");
  const Vec<D> centre = p.has("centre") ? options::vector<D>(type, p, "centre") : Vec<D>(0.5 * context.box.edges);
  return std::make_unique<FieldTerm<D, HarmonicTrap<D>>>(context.particles,
                                                         HarmonicTrap<D>(p.real("stiffness"), centre));
}

}  // namespace

InteractionInfo harmonic_trap() {
  return {.name = "harmonic-trap",
          .kind = InteractionInfo::Kind::field,
          .parameters = {{"stiffness", Type::real, "", "energy/length^2", "k", Range::non_negative},
                         {"centre", Type::real_list, "none", "length",
                          "c, one number an axis; absent: the middle of the box"}},
          .formula = "sum over particles of k/2 |x - c|^2",
          .documentation = "A spring from every particle to one point, as in optical and ion traps.",
          .source = "textbook",
          .in_2d = make<2>,
          .in_3d = make<3>};
}

}  // namespace carom::types
