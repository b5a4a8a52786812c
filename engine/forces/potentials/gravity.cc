// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/potentials/ewald.h"
#include "engine/forces/potentials/inverse_distance.h"
#include "engine/forces/potentials/options.h"
#include "engine/forces/potentials/types.h"

namespace carom::types {
namespace {

template <int D>
std::unique_ptr<Interaction<D>> make(const Parameters& p, const InteractionContext<D>& context) {
  double fixed = context.particles.any_fixed() ? 1 : 0;
  if (context.ranks) context.ranks->largest({&fixed, 1});
  if (fixed > 0)
    options::refuse("gravity",
                    "the infinite mass of a fixed particle would attract without limit; give it a large finite mass");
  if (p.has("form") && p.text("form") == "ewald") {
    if constexpr (D == 3)
      return ewald("gravity", -p.real("constant"), PairWeight::masses, p, context);
    else
      options::refuse("gravity", "form = \"ewald\" is for three dimensions; use form = \"plain\"");
  }
  if (p.has("accuracy"))
    options::refuse("gravity", "'accuracy' belongs to form = \"ewald\"; leave it out or change 'form'");
  return options::all_pairs<D>("gravity", InverseDistance(-p.real("constant")), PairWeight::masses, p, context,
                               "make the boundaries 'wall' or 'open', or use form = \"ewald\"");
}

}  // namespace

InteractionInfo gravity() {
  return {
      .name = "gravity",
      .kind = InteractionInfo::Kind::pair,
      .parameters = options::with_filter(
          {{"constant", Type::real, "1.0", "energy*length/mass^2", "G"},
           {"form",
            Type::text,
            "\"plain\"",
            "-",
            "plain: -G m m'/r between all pairs; ewald: the sum over all periodic images",
            Range::any,
            {"plain", "ewald"}},
           {"accuracy", Type::real, "none", "-",
            "of the form ewald: root mean square error of the forces, relative to G m^2/a^2, m^2 "
            "the mean squared mass and a^3 the volume per particle; from 1e-12 to 0.1; absent: 1e-5",
            Range::positive}}),
      .formula = "sum over pairs of -G m m'/r, or the Ewald sum over all pairs and images",
      .documentation =
          "Newton's gravitation. plain: all pairs are summed directly; not in periodic boxes. ewald: in a box that is "
          "periodic along three axes, all images are summed. That sum exists only with a uniform background of "
          "negative mass, "
          "as if the mean density caused no forces (the Jeans swindle); its energy is part of V.",
      .source = "Enomoto, thesis, 2011, experiment 2; Hernquist, Bouchet, Suto, Astrophys. J. Suppl. 75 (1991) 231",
      .in_2d = make<2>,
      .in_3d = make<3>};
}

}  // namespace carom::types
