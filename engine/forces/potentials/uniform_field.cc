// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/potentials/uniform_field.h"

#include "engine/forces/potentials/field_term.h"
#include "engine/forces/potentials/options.h"
#include "engine/forces/potentials/types.h"

namespace carom::types {
namespace {

template <int D>
std::unique_ptr<Interaction<D>> make(const Parameters& p, const InteractionContext<D>& context) {
  const bool electric = p.has("electric_field");
  if (electric == p.has("acceleration"))
    options::refuse("uniform-field", electric ? "both 'acceleration' and 'electric_field' are given; give one of them, "
                                                "and the other in an interaction of its own"
                                              : "no field is given; give 'acceleration' or 'electric_field'");
  const std::string key = electric ? "electric_field" : "acceleration";
  const Vec<D> g = options::vector<D>("uniform-field", p, key);
  for (int k = 0; k < D; ++k)
    if (context.box.periodic(k) && g[k] != 0)
      options::refuse("uniform-field", "'" + key + "' has a component along axis " + std::to_string(k) +
                                           ", which is periodic: there its potential is not unique; make that boundary "
                                           "'wall' or 'open', or that component 0");
  const PairWeight weight = electric ? PairWeight::charges : PairWeight::masses;
  return std::make_unique<FieldTerm<D, UniformField<D>>>(context.particles,
                                                         UniformField<D>(weight, context.particles, g));
}

}  // namespace

InteractionInfo uniform_field() {
  return {.name = "uniform-field",
          .kind = InteractionInfo::Kind::field,
          .parameters = {{"acceleration", Type::real_list, "none", "length/time^2", "g, one number an axis"},
                         {"electric_field", Type::real_list, "none", "force/charge",
                          "E, one number an axis, instead of g: the force on a particle is q E"}},
          .formula = "sum over particles of -m g.x or of -q E.x",
          .documentation =
              "The same acceleration for all particles that are not fixed, such as that of gravity on the ground, or "
              "an electric field. With an acceleration, flights stay exact parabolas, so free-flight handles this "
              "field, too.",
          .source = "textbook",
          .in_2d = make<2>,
          .in_3d = make<3>};
}

}  // namespace carom::types
