// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/potentials/damped_coulomb.h"
#include "engine/forces/potentials/ewald.h"
#include "engine/forces/potentials/inverse_distance.h"
#include "engine/forces/potentials/options.h"
#include "engine/forces/potentials/types.h"

namespace carom::types {
namespace {

template <int D>
std::unique_ptr<Interaction<D>> make(const Parameters& p, const InteractionContext<D>& context) {
  constexpr std::string_view type = "coulomb";
  constexpr PairWeight charges = PairWeight::charges;
  if (p.text("form") == "ewald") {
    if (p.has("cutoff") || p.has("damping"))
      options::refuse(type, "form = \"ewald\" takes 'cutoff' and 'damping' from 'accuracy'; leave them out");
    if constexpr (D == 3)
      return ewald(type, p.real("constant"), charges, p, context);
    else
      options::refuse(type, "form = \"ewald\" is for three dimensions; use form = \"damped-shifted\"");
  }
  if (p.has("accuracy") || p.has("surface") || p.has("wall_charges"))
    options::refuse(
        type, "'accuracy', 'surface' and 'wall_charges' belong to form = \"ewald\"; leave them out or change 'form'");
  if (p.text("form") == "plain") {
    if (p.has("cutoff") || p.has("damping"))
      options::refuse(type,
                      "'cutoff' and 'damping' belong to form = \"damped-shifted\"; leave them out or change 'form'");
    return options::all_pairs<D>(type, InverseDistance(p.real("constant")), charges, p, context,
                                 "use form = \"damped-shifted\" with 'damping' and 'cutoff'");
  }
  if (!p.has("cutoff") || !p.has("damping"))
    options::refuse(type, "form = \"damped-shifted\" needs 'damping' and 'cutoff'; give both (damping = 0 only cuts)");
  const DampedCoulomb whole(p.real("constant"), p.real("damping"));
  return options::within_reach<D>(type, Cut<DampedCoulomb>(whole, p.real("cutoff"), CutKind::quadratic), charges, p,
                                  context, whole);
}

}  // namespace

InteractionInfo coulomb() {
  return {
      .name = "coulomb",
      .kind = InteractionInfo::Kind::pair,
      .parameters = options::with_filter(
          {{"constant", Type::real, "1.0", "energy*length/charge^2", "C, or 1/(4 pi epsilon)"},
           {"form",
            Type::text,
            "\"plain\"",
            "-",
            "plain: C q q'/r between all pairs; damped-shifted: damped and cut, for periodic boxes; ewald: the sum "
            "over "
            "all periodic images",
            Range::any,
            {"plain", "damped-shifted", "ewald"}},
           {"damping", Type::real, "none", "1/length", "alpha of the form damped-shifted", Range::non_negative},
           {"cutoff", Type::real, "none", "length", "where the form damped-shifted ends", Range::positive},
           {"accuracy", Type::real, "none", "-",
            "of the form ewald: root mean square error of the forces, relative to C q^2/a^2, q^2 the mean squared "
            "charge "
            "and a^3 the volume per charge; from 1e-12 to 0.1; absent: 1e-5",
            Range::positive},
           {"surface",
            Type::text,
            "none",
            "-",
            "of the form ewald: what surrounds the periodic images, an ideal conductor or vacuum; absent: conducting",
            Range::any,
            {"conducting", "vacuum"}},
           {"wall_charges", Type::real_list, "none", "charge/length^2",
            "of the form ewald between two walls: the charge per area of the lower and of the upper wall"}}),
      .formula =
          "sum over pairs of C q q'/r, or of C q q' [erfc(alpha r)/r - polynomial in r^2] up to the cutoff, or the "
          "Ewald sum over all pairs and images",
      .documentation =
          "Charges in vacuum (plain: all pairs are summed directly; not in periodic boxes), or the damped-shifted sum "
          "that replaces the long-ranged potential in neutral periodic systems: the real-space part of an Ewald sum, "
          "cut so that V, V' and V'' go to zero at the cutoff. Usual values: alpha times cutoff between 2 and 3. The "
          "form ewald sums all periodic images in a box that is periodic along three axes, or along two axes and has "
          "walls along the third; 'accuracy' sets alpha and both cutoffs. If charges in a box that is periodic along "
          "three axes do not add up to zero, a uniform background neutralises them, and its energy is part of V. "
          "Between walls they must add up to zero together with 'wall_charges', which are spread evenly over the "
          "planes at "
          "both ends of the box; V contains "
          "the energy of particles and walls in each other's field.",
      .source =
          "Wolf et al., J. Chem. Phys. 110 (1999) 8254; Fennell, Gezelter, J. Chem. Phys. 124 (2006) 234104; "
          "Ewald, Ann. Phys. 369 (1921) 253; Kolafa, Perram, Mol. Simul. 9 (1992) 351; "
          "Yeh, Berkowitz, J. Chem. Phys. 111 (1999) 3155",
      .in_2d = make<2>,
      .in_3d = make<3>};
}

}  // namespace carom::types
