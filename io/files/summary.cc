// SPDX-License-Identifier: BSD-3-Clause
#include "io/files/summary.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "io/files/rank_account.h"
#include "io/files/version.h"

namespace carom {

namespace {

using Json = nlohmann::ordered_json;

Json number_or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

/// NaN is null.
Json json_of(const Estimate& estimate, const Statistics& of) {
  Json json = {{"mean", estimate.mean}, {"standard_error", estimate.error}, {"independent_samples", estimate.samples}};
  if (const double needed = of.needed_time(estimate); std::isfinite(needed)) json["needed_time"] = needed;
  return json;
}

}  // namespace

std::string summary_text(const Deck& deck, const RunOutcome& outcome, const Statistics& s) {
  const Counters& c = s.counters;
  const double rate = s.wall_seconds > 0 ? static_cast<double>(c.sphere_sphere) / s.wall_seconds : 0;
  Json json = {
      {"status", outcome.status},
      {"deck", deck.file.string()},
      {"title", deck.title},
      {"version", version_string()},
      {"integrator", deck.integrator},
      {"dimension", deck.dimension},
      {"particles", outcome.particles},
      {"ranks", outcome.ranks},
      {"steps", s.steps},
      {"end_time", s.end_time},
      {"events",
       {{"sphere_sphere", c.sphere_sphere},
        {"sphere_wall", c.sphere_wall},
        {"kicks", c.kicks},
        {"entered", c.steps.entered},
        {"left", c.steps.left},
        {"bounced", c.steps.bounced}}},
      {"energy",
       {{"initial", s.energy_initial},
        {"after_first_step", s.energy_after_first_step},
        {"final", s.energy_final},
        {"reference", s.energy_reference},
        {"max_abs_error", s.max_energy_error},
        {"dissipated", c.dissipated.value()},
        {"work", c.work.value() + c.shear.value()},
        {"heat", c.heat.value()},
        {"folded", s.energy_reference > 0 ? c.folded / s.energy_reference : 0.0}}},
      {"tail", {{"energy", s.tail_energy}, {"pressure", s.tail_pressure}}},
      {"shadow_energy", {{"max_abs_error", number_or_null(s.max_shadow_energy_error)}}},
      {"momentum", {{"max_abs_error", number_or_null(s.max_momentum_error)}}},
      {"max_overlap", c.max_overlap},
      {"pressure", s.mean_pressure},
      {"collision_rate", s.collision_rate},
      {"mean_free_time", number_or_null(s.mean_free_time)},
      {"mean_free_path", number_or_null(s.mean_free_path)},
      {"force_passes", s.force_passes},
      {"sweeps", c.sweeps},
      {"pieces", c.pieces},
      {"slabs_halved", c.slabs_halved},
      {"frozen", c.frozen},
      {"fallbacks", c.fallbacks},
      {"means", Json::object()},
      {"wall_seconds", s.wall_seconds},
      {"collisions_per_second", rate},
      {"peak_memory_bytes", std::max(outcome.peak_memory_bytes, peak_memory_bytes())},
  };
  for (std::size_t k = 0; k < Statistics::mean_names.size(); ++k)
    json["means"][Statistics::mean_names[k]] = json_of(s.estimate(k), s);
  if (deck.plan.from_equilibrium && s.equilibrium)
    json["equilibration"] = {{"transient_end", s.equilibrium->transient_end}, {"start", s.equilibrium->start}};
  else if (deck.plan.from_equilibrium)
    json["equilibration"] = nullptr;
  if (find_integrator(deck.integrator).adapts)
    json["step_lengths"] = {
        {"rejected", c.steps_rejected},
        {"shortest", s.shortest_step},
        {"mean",
         s.steps > s.start_steps ? (s.end_time - s.start_time) / static_cast<double>(s.steps - s.start_steps) : 0.0},
        {"longest", s.longest_step},
        {"local_error", s.local_error}};
  if (!s.shear_rates.empty()) {
    json["shear"] = {{"rates", s.shear_rates}, {"work", c.shear.value()}};
  } else if (s.shear_rate != 0) {
    const Estimate stress = s.shear_stress();
    Estimate viscosity = stress;
    viscosity.mean /= s.shear_rate;
    viscosity.error /= std::abs(s.shear_rate);
    json["shear"] = {{"rate", s.shear_rate},
                     {"work", c.shear.value()},
                     {"stress", json_of(stress, s)},
                     {"viscosity", json_of(viscosity, s)}};
  }
  if (s.rotational_energy) json["energy"]["rotational"] = *s.rotational_energy;
  for (const WallRecord& wall : outcome.walls) {  // both sides of a wall have one name
    const WallTally none, &tally = wall.number < c.walls.size() ? c.walls[wall.number] : none;
    Json& entry = json["walls"][wall.name];
    const bool front = entry.is_null();
    if (front) entry = Json::object();
    const auto add = [&](const char* key, double value) { entry[key] = entry.value(key, 0.0) + value; };
    const double force = s.end_time > s.start_time ? tally.impulse.value() / (s.end_time - s.start_time) : 0;
    entry["collisions"] = entry.value("collisions", std::uint64_t{0}) + tally.contacts;
    add("force", force);
    if (wall.area > 0) add("pressure", force / wall.area);
    if (front) {  // with the rear
      const Estimate of_force = s.estimate(Statistics::mean_names.size() + wall.number);
      entry["force_standard_error"] = of_force.error;
      if (wall.area > 0) entry["pressure_standard_error"] = of_force.error / wall.area;
      entry["independent_samples"] = of_force.samples;
    }
    add("work", tally.work.value());
    add("heat", tally.heat.value());
  }
  if (json.contains("walls"))
    for (Json& entry : json["walls"])
      if (entry["collisions"] == 0)  // no hit says nothing about how rare hits are
        for (const char* key : {"force_standard_error", "pressure_standard_error", "independent_samples"})
          if (entry.contains(key)) entry[key] = nullptr;
  if (!outcome.branched_from.empty())
    json["branched_from"] = {{"checkpoint", outcome.branched_from}, {"step", s.start_steps}, {"time", s.start_time}};
  for (const SpeciesValue& value : outcome.species_values)
    if (value.species.empty())
      json[value.name][value.symbol] = {{"mean", value.value}, {"standard_error", value.error}};
    else
      json[value.name].push_back(
          {{"species", value.species}, {value.symbol, value.value}, {"standard_error", value.error}});
  json["warnings"] = outcome.warnings;
  if (!outcome.error.empty()) json["error"] = outcome.error;
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace carom
