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

template <int D>
const std::vector<ScalarColumn<D>>& scalar_columns() {
  using S = const Snapshot<D>&;
  static const auto all = [] {
    std::vector<ScalarColumn<D>> columns = {
        {"kinetic", "kinetic_energy", [](S s) { return s.kinetic; }, "kinetic", "14.8g"},
        {"potential", "potential_energy", [](S s) { return s.potential; }, "potential", "14.8g"},
        {"total", "total_energy", [](S s) { return s.total(); }, "total", "16.10g"},
        {"shadow", "shadow_energy", [](S s) { return s.shadow; }},
        {"max_energy_error", "max_energy_error", [](S s) { return s.max_energy_error; }, "max |ΔE|", "10.2e"},
        {"momentum_x", nullptr, [](S s) { return s.momentum[0]; }},  // in the trajectory one element, a vector
        {"momentum_y", nullptr, [](S s) { return s.momentum[1]; }}};
    if constexpr (D == 3) columns.push_back({"momentum_z", nullptr, [](S s) { return s.momentum[2]; }});
    columns.push_back({"temperature", "temperature", [](S s) { return s.temperature; }, "temperature", "12.6g"});
    columns.push_back({"pressure", "pressure", [](S s) { return s.pressure; }, "pressure", "12.6g"});
    return columns;
  }();
  return all;
}
template const std::vector<ScalarColumn<2>>& scalar_columns();
template const std::vector<ScalarColumn<3>>& scalar_columns();

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
ThermoWriter<D>::ThermoWriter(const std::filesystem::path& path, const std::optional<FileMark>& mark)
    : file_(path, mark) {
  if (mark) return;
  std::string head = "time,step,collisions";
  for (const auto& column : scalar_columns<D>()) head += std::string(",") + column.name;
  file_.append(head + '\n');
}

template <int D>
void ThermoWriter<D>::thermo(const Snapshot<D>& s) {
  std::string row = fmt::format("{},{},{}", s.time, s.step, s.collisions);
  for (const auto& column : scalar_columns<D>()) row += fmt::format(",{}", column.of(s));
  file_.append(row + '\n');
}

template class ThermoWriter<2>;
template class ThermoWriter<3>;

}  // namespace carom
