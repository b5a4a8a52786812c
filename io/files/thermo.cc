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

ThermoPoint last_thermo_point(const std::filesystem::path& path) {
  constexpr std::streamoff kTail = 2000;  // bytes, more than two rows have
  if (!std::filesystem::is_regular_file(path)) return {};
  std::ifstream in(path, std::ios::ate);
  in.seekg(std::max<std::streamoff>(0, in.tellg() - kTail));
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
  file_.append(
      std::string("time,step,collisions,kinetic,potential,total,shadow,max_energy_error,momentum_x,momentum_y") +
      (D == 3 ? ",momentum_z" : "") + ",temperature,pressure\n");
}

template <int D>
void ThermoWriter<D>::thermo(const Snapshot<D>& s) {
  std::string row = fmt::format("{},{},{},{},{},{},{},{}", s.time, s.step, s.collisions, s.kinetic, s.potential,
                                s.total(), s.shadow, s.max_energy_error);
  for (const double p : s.momentum) row += fmt::format(",{}", p);
  file_.append(row + fmt::format(",{},{}\n", s.temperature, s.pressure));
}

template class ThermoWriter<2>;
template class ThermoWriter<3>;

}  // namespace carom
