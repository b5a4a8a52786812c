#include "io/files/thermo.h"

#include <spdlog/fmt/fmt.h>

#include <string>

namespace carom {

template <int D>
ThermoWriter<D>::ThermoWriter(const std::filesystem::path& path, std::optional<std::uint64_t> size)
    : file_(path, size) {
  if (size) return;
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
