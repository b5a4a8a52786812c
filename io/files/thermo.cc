// SPDX-License-Identifier: BSD-3-Clause
#include "io/files/thermo.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>

namespace carom {

namespace {
constexpr ColumnChart kError{"error", "largest energy error so far", true}, kTemperature{"temperature", "temperature"},
    kPressure{"pressure", "pressure"};
}  // namespace

template <int D>
const std::vector<Column<D>>& columns() {
  using S = const Snapshot<D>&;
  using enum ColumnKind;
  // name, kind, unit, meaning, number, name in Python and in the trajectory, format in run.log, chart
  static const std::vector<Column<D>> all = {
      {"time", number, "time", "simulated time since the start of the run",  //
       [](S s, int) { return s.time; }, "time", nullptr, "12.6g"},
      {"step", count, "-", "steps done; with free-flight, epochs begun or done",  //
       [](S s, int) { return static_cast<double>(s.step); }, "step", nullptr, "10.0f"},
      {"collisions", count, "-", "pair collisions so far",  //
       [](S s, int) { return static_cast<double>(s.collisions); }, "collisions", "collisions", "12.0f"},
      {"kinetic", number, "energy", "K, with the energy of spins",  //
       [](S s, int) { return s.kinetic; }, "kinetic", "kinetic_energy", "14.8g"},
      {"potential", number, "energy", "V with its long-range corrections",  //
       [](S s, int) { return s.potential; }, "potential", "potential_energy", "14.8g"},
      {"total", number, "energy", "H = K + V",  //
       [](S s, int) { return s.total(); }, "energy", "total_energy", "16.10g"},
      {"shadow", number, "energy", "S_h of Verlet types; NaN for other methods",  //
       [](S s, int) { return s.shadow; }, "shadow_energy", "shadow_energy"},
      {"max_energy_error", number, "energy", "largest change of `conserved` since the first step",  //
       [](S s, int) { return s.max_energy_error; }, nullptr, "max_energy_error", "10.2e", &kError, "max |ΔE|"},
      {"momentum", vector, "mass length/time", "total momentum",  //
       [](S s, int axis) { return s.momentum[axis]; }, "momentum", "momentum"},
      {"temperature", number, "energy", "Σ m v²/(D N), k_B = 1; without spins",  //
       [](S s, int) { return s.temperature; }, "temperature", "temperature", "12.6g", &kTemperature},
      {"pressure", number, "energy/length^D", "virial pressure, with the collisions since the last row",  //
       [](S s, int) { return s.pressure; }, "pressure", "pressure", "12.6g", &kPressure},
      {"conserved", number, "energy", "H + dissipated − work − heat",  //
       [](S s, int) { return s.conserved(); }, "conserved", "conserved_energy"},
      {"dissipated", number, "energy", "energy lost at inelastic contacts so far",  //
       [](S s, int) { return s.dissipated; }, "dissipated", "dissipated_energy"},
      {"work", number, "energy", "work of moving walls and of shear so far",  //
       [](S s, int) { return s.work; }, "work", "work"},
      {"heat", number, "energy", "heat from thermal walls and baths so far",  //
       [](S s, int) { return s.heat; }, "heat", "heat"},
      {"rotational", number, "energy", "the part of K that is in spins",  //
       [](S s, int) { return s.rotational; }, "rotational_energy", "rotational_energy"},
      {"rotational_temperature", number, "energy", "Σ I ω²/(f N), f = 1 in two dimensions, 3 in three",  //
       [](S s, int) { return s.rotational_temperature; }, "rotational_temperature", "rotational_temperature"},
      {"step_length", number, "time", "length of the last step or epoch",  //
       [](S s, int) { return s.step_length; }, "step_length", "step_length"},
      {"bonds", number, "-", "pairs inside the outermost of their steps, for each particle",  //
       [](S s, int) { return s.bonds; }, nullptr, "bonds"},
      {"shear_stress", number, "energy/length^D",
       "−P_xy since the last row, from the work of the flow; nan while a flow rests or turns, 0 without shear",  //
       [](S s, int) { return s.shear_stress; }, "shear_stress", "shear_stress"}};
  return all;
}
template const std::vector<Column<2>>& columns();
template const std::vector<Column<3>>& columns();

std::string columns_page() {
  std::string text = "thermo.csv – a row each output.thermo_interval\n";
  for (const Column<3>& column : columns<3>())
    text += fmt::format("    {}{} [{}]: {}\n", column.name, column.components() > 1 ? "_x, _y, _z" : "", column.unit,
                        column.meaning);
  text +=
      "    pressure_x-, … [energy/length^D]: mean force per area on a face of the box that is a wall, a sphere or a "
      "cylinder, since the last row\n";
  text += "    force_NAME [energy/length]: mean force on a further plane, since the last row\n";
  return text;
}

ThermoPoint last_thermo_point(const std::filesystem::path& path) {
  constexpr std::streamoff kTailBytes = 2000;  // bytes, more than two rows have
  if (!std::filesystem::is_regular_file(path)) return {};
  std::ifstream in(path, std::ios::ate);
  in.seekg(std::max<std::streamoff>(0, in.tellg() - kTailBytes));
  std::string end{std::istreambuf_iterator<char>(in), {}};
  end.resize(end.rfind('\n') + 1);  // a kill may have left a part of a row
  ThermoPoint point;
  if (end.size() < 2) return point;
  const std::size_t start = end.rfind('\n', end.size() - 2) + 1;
  if (std::sscanf(end.c_str() + start, "%lf,%" SCNd64 ",%" SCNu64, &point.time, &point.step, &point.collisions) == 3)
    return point;
  return {};
}

template <int D>
ThermoWriter<D>::ThermoWriter(const std::filesystem::path& path, const Box<D>& box, const std::optional<FileMark>& mark)
    : file_(path, mark) {
  std::vector<std::string> names;
  for (const Wall<D>& wall : box.walls()) {
    std::string name = (box.area(wall, box.time) > 0 ? "pressure_" : "force_") + box.name_of(wall.number);
    std::ranges::replace_if(
        name, [](char c) { return c == ',' || c == '"' || c == '\n' || c == '\r'; }, '_');
    const auto known = std::ranges::find(names, name);
    column_of_wall_.push_back(static_cast<std::size_t>(known - names.begin()));
    if (known == names.end()) names.push_back(std::move(name));
  }
  wall_columns_ = names.size();
  if (mark) return;
  std::string head;
  for (const Column<D>& column : columns<D>())
    for (int axis = 0; axis < column.components(); ++axis)
      head += fmt::format("{}{}{}", head.empty() ? "" : ",", column.name, column.suffix(axis));
  for (const std::string& name : names) head += "," + name;
  file_.append(head + '\n');
}

template <int D>
void ThermoWriter<D>::thermo(const Snapshot<D>& s) {
  std::string row;
  for (const Column<D>& column : columns<D>())
    for (int axis = 0; axis < column.components(); ++axis)
      row += fmt::format("{}{}", row.empty() ? "" : ",", column.of(s, axis));
  std::vector<double> loads(wall_columns_, 0.0);
  for (std::size_t k = 0; k < std::min(s.walls.size(), column_of_wall_.size()); ++k)
    loads[column_of_wall_[k]] += s.walls[k].load();
  for (const double load : loads) row += fmt::format(",{}", load);
  file_.append(row + '\n');
}

template class ThermoWriter<2>;
template class ThermoWriter<3>;

}  // namespace carom
