// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/potentials/field_term.h"
#include "engine/forces/potentials/options.h"
#include "engine/forces/potentials/types.h"

namespace carom::types {
namespace {

/// V_i = −m_i g·x: every particle has the acceleration g.
template <int D>
class UniformField {
 public:
  UniformField(const std::vector<double>& mass, const Vec<D>& g) : mass_(&mass), g_(g) {}

  UniformField among(const Particles<D>& some) const { return {some.mass, g_}; }
  double least_force(double) const {
    double least = std::numeric_limits<double>::infinity();
    for (const double m : *mass_)
      for (int k = 0; k < D; ++k)
        if (moving_mass(m) * g_[k] != 0) least = std::min(least, std::abs(m * g_[k]));
    return least < std::numeric_limits<double>::infinity() ? least : 0;
  }
  double value(Id i, const Vec<D>& x) const { return -moving_mass((*mass_)[i]) * g_.dot(x); }
  Vec<D> gradient(Id i, const Vec<D>&) const { return -moving_mass((*mass_)[i]) * g_; }
  Vec<D> mean_gradient(Id i, const Vec<D>& x, const Vec<D>&) const { return gradient(i, x); }
  Vec<D> hessian_product(Id, const Vec<D>&, const Vec<D>&) const { return Vec<D>::Zero(); }
  const Vec<D>& acceleration() const { return g_; }

 private:
  const std::vector<double>* mass_;
  Vec<D> g_;  ///< [length/time²]
};

template <int D>
std::unique_ptr<Interaction<D>> make(const Parameters& p, const InteractionContext<D>& context) {
  const Vec<D> g = options::vector<D>("uniform-field", p, "acceleration");
  for (int k = 0; k < D; ++k)
    if (context.box.periodic(k) && g[k] != 0)
      options::refuse("uniform-field", "'acceleration' has a component along axis " + std::to_string(k) +
                                           ", which is periodic: there its potential is not unique; make that boundary "
                                           "'wall' or 'open', or that component 0");
  return std::make_unique<FieldTerm<D, UniformField<D>>>(context.particles, UniformField<D>(context.particles.mass, g));
}

}  // namespace

InteractionInfo uniform_field() {
  return {.name = "uniform-field",
          .kind = InteractionInfo::Kind::field,
          .parameters = {{"acceleration", Type::real_list, "", "length/time^2", "g, one number an axis"}},
          .formula = "sum over particles of -m g.x",
          .documentation =
              "The same acceleration for all particles that are not fixed, such as that of gravity on the ground. "
              "Flights stay exact "
              "parabolas, so free-flight handles this field, too.",
          .source = "textbook",
          .in_2d = make<2>,
          .in_3d = make<3>};
}

}  // namespace carom::types
