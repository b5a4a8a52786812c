// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Every type of interaction, in suitable boxes.

#include <gtest/gtest.h>

#include <type_traits>

#include "tests/unit/potentials/scene.h"

namespace carom::test {

using namespace std::string_literals;

struct Case {
  std::string type;
  Boundary boundary;
  std::vector<std::pair<std::string, ParameterValue>> parameters;
};

inline const PairList kPeriodicBonds = {{7, 2}, {0, 1}, {3, 5}, {0, 9}};

inline const std::vector<Case>& cases() {
  using Names = std::vector<std::string>;
  static const std::vector<Case> all = {
      {"harmonic-bond", Boundary::wall, {{"chain", true}, {"stiffness", 1.5}, {"rest_length", 1.2}}},
      {"harmonic-bond", Boundary::periodic, {{"pairs", kPeriodicBonds}, {"stiffness", 1.5}, {"rest_length", 1.2}}},
      {"gravity", Boundary::wall, {{"constant", 0.8}}},
      {"gravity", Boundary::open, {{"constant", 0.8}, {"species", Names{"A", "B"}}}},
      {"coulomb", Boundary::wall, {{"constant", 1.3}, {"form", "plain"s}}},
      {"coulomb",
       Boundary::periodic,
       {{"constant", 1.3}, {"form", "damped-shifted"s}, {"damping", 0.9}, {"cutoff", 2.4}}},
      {"yukawa", Boundary::wall, {{"amplitude", 2.0}, {"kappa", 1.1}, {"charges", true}}},
      {"yukawa",
       Boundary::periodic,
       {{"amplitude", 2.0}, {"kappa", 1.1}, {"charges", false}, {"cutoff", 2.2}, {"cut", "switch"s}}},
      {"lennard-jones", Boundary::open, {{"epsilon", 1.0}, {"sigma", 0.8}}},
      {"lennard-jones",
       Boundary::periodic,
       {{"epsilon", 1.0}, {"sigma", 0.8}, {"cutoff", 2.0}, {"cut", "switch"s}, {"species", Names{"B", "B"}}}},
      {"lennard-jones", Boundary::open, {{"epsilon", 1.0}, {"sigma", 0.8}, {"cutoff", 2.0}, {"cut", "force-shifted"s}}},
      {"table",
       Boundary::periodic,
       {{"r", std::vector<double>{0.5, 0.7, 0.9, 1.2, 1.6, 2.0}},
        {"value", std::vector<double>{9.0, 5.0, 1.0, -1.0, -0.4, -0.1}},
        {"slope", std::vector<double>{-30.0, 0.2}},
        {"cut", "switch"s},
        {"switch_from", 1.3}}},
      {"wca", Boundary::periodic, {{"epsilon", 1.0}, {"sigma", 1.1}}},
      {"morse", Boundary::open, {{"depth", 1.5}, {"alpha", 4.0}, {"r0", 0.9}}},
      {"morse", Boundary::periodic, {{"depth", 1.5}, {"alpha", 4.0}, {"r0", 0.9}, {"cutoff", 2.0}, {"cut", "switch"s}}},
      {"inverse-power",
       Boundary::periodic,
       {{"epsilon", 1.0}, {"sigma", 0.8}, {"exponent", 9.5}, {"cutoff", 2.0}, {"cut", "switch"s}}},
      {"uniform-field", Boundary::wall, {{"acceleration", 0.0}}},
      {"harmonic-trap", Boundary::wall, {{"stiffness", 0.7}}},
      {"uniform-field", Boundary::wall, {{"electric_field", 0.0}}},
      {"coulomb", Boundary::periodic, {{"constant", 1.3}, {"form", "ewald"s}, {"accuracy", 1e-11}}},
      {"coulomb",
       Boundary::periodic,
       {{"constant", 1.3}, {"form", "ewald"s}, {"accuracy", 1e-11}, {"exclude", "bonded"s}}},
  };
  return all;
}

/// Calls check(scene, term) for every case, or check(scene, term, remake), where remake(scene) makes an equal term for
/// another scene. Terms read their environment variables again for each.
template <int D, class Check>
void for_each_case(Check&& check) {
  for (const Case& each : cases()) {
    if (D == 2 &&
        std::ranges::find(each.parameters, std::pair{"form"s, ParameterValue("ewald"s)}) != each.parameters.end())
      continue;  // three dimensions only
    SCOPED_TRACE(each.type + " in " + std::to_string(D) + " dimensions");
    Scene<D> scene(D == 2 ? 24 : 40, 5, each.boundary, 0.75);
    auto parameters = each.parameters;
    const bool excludes = !parameters.empty() && parameters.back().first == "exclude";
    if (excludes || (each.type == "harmonic-bond" && each.boundary == Boundary::periodic))
      for (const auto& [i, j] : kPeriodicBonds) {  // shorter than half the box, across edges
        scene.particles.x[j] = scene.particles.x[i] + Vec<D>::Constant(excludes && j > 5 ? -0.9 : 0.9);
        scene.box.wrap(scene.particles.x[j], scene.particles.image[j]);
      }
    if (each.type == "uniform-field") parameters.back().second = std::vector<double>(D, -0.6);
    const auto remake = [&](const Scene<D>& other) {
      return other.make(each.type, parameters, excludes ? std::make_shared<BondTable>(kPeriodicBonds) : nullptr);
    };
    const auto term = remake(scene);
    if constexpr (std::is_invocable_v<Check, Scene<D>&, const Interaction<D>&, decltype(remake)>)
      check(scene, *term, remake);
    else
      check(scene, *term);
  }
}

}  // namespace carom::test
