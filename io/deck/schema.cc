// SPDX-License-Identifier: BSD-3-Clause
#include "io/deck/schema.h"

#include <algorithm>

#include "engine/integrators/integrator.h"
#include "engine/laws/bath_options.h"
#include "engine/laws/contact_options.h"
#include "engine/laws/interaction.h"
#include "engine/laws/wall_options.h"
#include "engine/setup/step_options.h"

namespace carom {
namespace {

using enum Parameter::Type;
using Range = Parameter::Range;

std::vector<Variant> variants_of(const auto& infos) {
  std::vector<Variant> all;
  all.reserve(infos.size());
  for (const auto& info : infos) all.push_back({std::string(info.name), info.parameters});
  return all;
}

std::string averages_of_all() {
  std::string files;
  for (const ObservableInfo& info : observables())
    files += (files.empty() ? "" : &info == &observables().back() ? " and " : ", ") + std::string(info.name) + ".csv";
  return files;
}

Parameter units_key() {
  const std::vector<std::string> lengths = {"Angstrom", "fm", "pm", "nm", "um", "mm", "m"},
                                 times = {"fs", "ps", "ns", "us", "ms", "s"};
  Parameter units = {
      "units", table, "none", "-",
      "the units of length and time that the trajectory states for other programs, as { length = \"Angstrom\", time = "
      "\"ps\" }; no number depends on them; none: reduced units"};
  units.keys = {{"length", text, "", "-", "the unit of length", Range::any, lengths},
                {"time", text, "", "-", "the unit of time", Range::any, times}};
  return units;
}

std::vector<Parameter> output_keys() {
  std::vector<Parameter> keys = {
      {"directory", text, "none", "-",
       "where the run writes its files, relative to the working directory; default: runs/ and the name of the deck"},
      {"overwrite", boolean, "false", "-",
       "true: the files of an earlier run in the directory are removed; false: they are moved to its backup.N"},
      {"frame_interval", real, "0.0", "time", "simulated time between frames of the trajectory; 0: first and last only",
       Range::non_negative},
      {"thermo_interval", real, "0.0", "time", "simulated time between rows of thermo.csv; 0: first and last only",
       Range::non_negative},
      {"start",
       text,
       "\"first\"",
       "-",
       "where means begin: those of summary.json over time, and the samples of " + averages_of_all() +
           "; first: at the start of the run (samples at sample_start); equilibrated: at the first step or epoch after "
           "the "
           "initial transient of pressure and potential energy in the rows of thermo.csv, which ends where the rule "
           "MSER-5 finds it (White, Simulation 69 (1997) 323; sample_start is counted from there). Needs a "
           "thermo_interval, best one of a few mean free times, and 100 rows at least",
       Range::any,
       {"first", "equilibrated"}}};
  for (const ObservableInfo& info : observables())
    for (const Parameter& parameter : info.parameters) {
      keys.push_back(parameter);
      keys.back().name = output_key(info, parameter.name);
    }
  keys.push_back(
      {"sample_start", real, "0.0", "time",
       "simulated time of the first sample for " + averages_of_all() + "; the time before is for equilibration",
       Range::non_negative});
  keys.push_back({"checkpoint_wall", text, "\"00:05:00\"", "-",
                  "wall time between checkpoints, hh:mm:ss; empty: only when the run ends or is stopped"});
  keys.push_back(units_key());
  keys.push_back({"events", boolean, "false", "-", "write every collision to events.h5"});
  return keys;
}

Parameter boundary_key() {
  Parameter key = {"boundary", text_list, "", "-", "the boundary along each axis"};
  for (const BoundaryInfo& info : boundaries()) {
    key.meaning += "; " + std::string(info.name) + ": " + std::string(info.meaning);
    key.choices.emplace_back(info.name);
  }
  return key;
}

Parameter type_key(const std::string& meaning) { return {"type", text, "", "-", meaning}; }

constexpr const char* kAdapts =
    "leave it out: this method has fixed steps, because with others its energy error would grow; or take edda or cdda";

std::vector<TableSchema> make_schema() {
  return {
      {"",
       false,
       true,
       "keys at the top of the deck",
       {{"format", integer, "", "-", "version of the deck format: 1", Range::positive},
        {"title", text, "\"\"", "-", "one line that says what the run shows"},
        {"description", text, "\"\"", "-", "a longer description: the source of the system, what to look at"}}},
      {"system",
       false,
       true,
       "the box",
       {{"dimension", integer, "", "-", "2 or 3", Range::positive},
        {"box", real_list, "none", "length",
         "edges of the box, whose lower corner is the origin; may be absent if placement.packing_fraction determines "
         "them",
         Range::positive},
        boundary_key(),
        {"shear",
         Parameter::Type::table,
         "none",
         "-",
         "a flow along x with a velocity that increases with y, by Lees–Edwards boundaries: images of the box above "
         "and below slide along x. All velocities, given and written, are relative to this flow",
         Range::any,
         {},
         {},
         std::numeric_limits<double>::infinity(),
         {{"rate", real_or_pairs, "", "1/time",
           "the velocity of the flow at y is rate·y; or [[time, rate], …], each rate from its time on, in the order of "
           "the times: a flow that begins, ends or turns"}}},
        {"tilt", real, "none", "length",
         "where the image of the box above is along x at the start, between 0 and the edge along x: a flow before this "
         "run has moved it there"}}},
      {"contact", true, false, "the law of all contacts between two partners; contacts without one are elastic",
       contact_parameters()},
      {"step", true, false,
       "distances at which the energy of a pair jumps: square wells and shoulders between species, tethers and hard "
       "bonds between listed pairs",
       step_parameters()},
      {"wall", true, false, "a further wall, or a face of the box that is more than a fixed hard wall",
       wall_parameters()},
      {"bath", true, false, "a heat bath for all particles; at most one", bath_parameters()},
      {"particles",
       true,
       true,
       "a species, given by positions or by count; ids number all particles from 0 in the order of the deck",
       {{"name", text, "", "-", "name of the species"},
        {"position", vector_list, "none", "length", "centres, one vector for each particle"},
        {"velocity", vector_list, "none", "length/time",
         "velocities of particles with positions; without velocity and temperature they are at rest"},
        {"count", integer, "none", "-", "number of particles, which [placement] places", Range::positive},
        {"temperature", real, "none", "energy",
         "draws Maxwell–Boltzmann velocities with zero total momentum and exactly this temperature (k_B = 1)",
         Range::non_negative},
        {"radius", real_or_list, "none", "length",
         "radius of the hard core; required, except with verlet, which has points", Range::positive},
        {"display_radius", real_or_list, "none", "length", "with verlet: the radius that pictures show; default: 0.5",
         Range::positive},
        {"mass", real_or_list, "1.0", "mass", "mass of a particle", Range::positive},
        {"fixed", boolean, "false", "-",
         "true: the particles never move, others bounce off them, and 'mass' has no effect; they may overlap each "
         "other "
         "and reach beyond walls"},
        {"charge", real_or_list, "0.0", "charge", "charge of a particle, for interactions between charges"},
        {"spin", vector_list, "none", "1/time",
         "angular velocities that go with explicit positions where contacts have 'tangential': [z] in two dimensions, "
         "[x, y, z] in three; without it and rotational_temperature particles start without spin"},
        {"rotational_temperature", real, "none", "energy",
         "where contacts have 'tangential': draws angular velocities from a normal distribution with exactly this mean "
         "energy, T/2 for each axis of rotation (k_B = 1): z in two dimensions, x, y and z in three",
         Range::non_negative},
        {"inertia", real, "none", "-",
         "reduced moment of inertia 4I/(m sigma^2), sigma the diameter: 0.5 for homogeneous discs, 0.4 for homogeneous "
         "spheres, which is the default; 1 for rings, 2/3 for shells",
         Range::positive}}},
      {"placement",
       false,
       false,
       "the initial positions of particles given by count",
       {type_key("the kind of placement"),
        {"packing_fraction", real, "none", "-",
         "determines the box if system.box is absent: a cube or a square (hexagonal: a rectangle that fits "
         "the lattice)",
         Range::positive},
        {"seed", integer, "1", "-", "seed of random positions and velocities", Range::non_negative}},
       {{"fcc", {}},
        {"simple-cubic", {}},
        {"hexagonal", {}},
        {"square", {}},
        {"random",
         {{"distance", real, "none", "length",
           "with verlet, whose particles are points: the smallest distance between two of them; default: that at which "
           "spheres of this diameter fill 0.19 (discs 0.27) of the box; 0: any",
           Range::non_negative}}},
        {"compressed",
         {{"growth_rate", real, "0.1", "-",
           "speed at which the largest diameter grows, relative to the thermal speed; it is divided by the reduced "
           "pressure PV/(NkT). Slower growth leads to denser jammed states",
           Range::positive},
          {"max_collisions", real, "100000.0", "-", "collisions per particle after which compression gives up",
           Range::positive}}},
        {"file",
         {{"file", text, "", "-",
           "file with a line of coordinates for each particle, separated by commas or blanks; relative to the "
           "folder of the deck"}}}}},
      {"interaction",
       true,
       false,
       "a smooth force between the particles or on them",
       {type_key("the kind of force")},
       variants_of(interactions())},
      {"integrator",
       false,
       true,
       "the method; `carom methods` describes all of them",
       {type_key("the name of the method")},
       variants_of(integrators()),
       {{"acdda", "write \"edda\", which keeps the energy as exactly"},
        {"acva", "write \"edda\", which keeps the energy exactly, or \"cva\""},
        {"adaptive", "leave it out, or take a shorter 'step'"},
        {"accuracy", kAdapts},
        {"shortest_step", kAdapts}}},
      {"run",
       false,
       true,
       "the end of the run: the first of these that it reaches; at least one is required",
       {{"steps", integer, "none", "-", "number of steps (free-flight: epochs)", Range::positive},
        {"end_time", real, "none", "time", "simulated time; the last step is shortened to meet it", Range::positive},
        {"collisions", integer, "none", "-", "number of pair collisions", Range::positive}}},
      {"output", false, false, "the files of the run", output_keys()}};
}

}  // namespace

const Variant* TableSchema::variant(std::string_view type) const {
  const auto at = std::find_if(variants.begin(), variants.end(), [&](const Variant& v) { return v.name == type; });
  return at == variants.end() ? nullptr : &*at;
}

std::string TableSchema::heading() const {
  if (name.empty()) return "the deck";
  return list ? "[[" + name + "]]" : "[" + name + "]";
}

const std::vector<TableSchema>& deck_schema() {
  static const std::vector<TableSchema> schema = make_schema();
  return schema;
}

const TableSchema& table_schema(std::string_view name) {
  for (const TableSchema& table : deck_schema())
    if (table.name == name) return table;
  throw std::logic_error("no table '" + std::string(name) + "' in the schema");
}

std::string output_key(const ObservableInfo& info, std::string_view parameter) {
  return std::string(info.name) + "_" + std::string(parameter);
}

std::string type_name(const Parameter& key) {
  const std::string range = key.range == Range::positive       ? "positive "
                            : key.range == Range::non_negative ? "non-negative "
                                                               : "";
  switch (key.type) {
    case boolean:
      return "true or false";
    case integer:
      return range + "integer";
    case real:
      return range + "number";
    case real_list:
      return "list of " + range + "numbers";
    case text:
      return "text";
    case text_list:
      return "list of texts";
    case pair_list:
      return "list of pairs of particle ids";
    case vector_list:
      return "list of vectors";
    case real_or_list:
      return range + "number, or a list of numbers";
    case real_or_pairs:
      return range + "number, or a list of pairs of numbers";
    case table:
    case real_or_table: {
      std::string names;
      for (const Parameter& each : key.keys) names += (names.empty() ? "" : " and ") + each.name;
      return (key.type == table ? "table of " : range + "number, or a table of ") + names;
    }
  }
  throw std::logic_error("unknown key type");
}

}  // namespace carom
