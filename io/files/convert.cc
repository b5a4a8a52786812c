// SPDX-License-Identifier: BSD-3-Clause
#include "io/files/convert.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace carom {

namespace {

constexpr std::size_t kBytesPerWrite = 1 << 20;  // bytes written at a time

/// The chemical symbols, by atomic number from 1.
constexpr std::array<std::string_view, 118> kElements = {
    "H",  "He", "Li", "Be", "B",  "C",  "N",  "O",  "F",  "Ne", "Na", "Mg", "Al", "Si", "P",  "S",  "Cl",
    "Ar", "K",  "Ca", "Sc", "Ti", "V",  "Cr", "Mn", "Fe", "Co", "Ni", "Cu", "Zn", "Ga", "Ge", "As", "Se",
    "Br", "Kr", "Rb", "Sr", "Y",  "Zr", "Nb", "Mo", "Tc", "Ru", "Rh", "Pd", "Ag", "Cd", "In", "Sn", "Sb",
    "Te", "I",  "Xe", "Cs", "Ba", "La", "Ce", "Pr", "Nd", "Pm", "Sm", "Eu", "Gd", "Tb", "Dy", "Ho", "Er",
    "Tm", "Yb", "Lu", "Hf", "Ta", "W",  "Re", "Os", "Ir", "Pt", "Au", "Hg", "Tl", "Pb", "Bi", "Po", "At",
    "Rn", "Fr", "Ra", "Ac", "Th", "Pa", "U",  "Np", "Pu", "Am", "Cm", "Bk", "Cf", "Es", "Fm", "Md", "No",
    "Lr", "Rf", "Db", "Sg", "Bh", "Hs", "Mt", "Ds", "Rg", "Cn", "Nh", "Fl", "Mc", "Lv", "Ts", "Og"};

/// The species as chemical symbols, which ASE requires: their names if all are symbols, else substitutes.
std::vector<std::string_view> symbols_of(const std::vector<std::string>& names) {
  std::vector<std::string_view> symbols;
  const bool chemical =
      std::ranges::all_of(names, [](const auto& name) { return std::ranges::count(kElements, name) > 0; });
  for (std::size_t s = 0; s < names.size(); ++s)
    symbols.push_back(chemical ? std::string_view(names[s]) : kElements[s % kElements.size()]);
  return symbols;
}

/// A value of the second line of extended XYZ.
std::string quoted_for_extxyz(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c == '\n' ? ' ' : c;
  }
  return out + "\"";
}

std::string joined(std::span<const std::string> words) {
  std::string all;
  for (const std::string& word : words) all += (all.empty() ? "" : ",") + word;
  return all;
}

bool periodic(const TrajectoryReader& trajectory, std::size_t axis) {
  return axis < trajectory.boundary.size() && trajectory.boundary[axis] == "periodic";
}

}  // namespace

std::span<const ExportFormat> export_formats() {
  static constexpr std::array<ExportFormat, 5> formats = {{
      {"extxyz", "extxyz", false, write_extxyz},         // extended XYZ, for OVITO and ASE
      {"gsd", "gsd", false, write_gsd},                  // the format of HOOMD-blue, for OVITO, freud and MDAnalysis
      {"lammps-data", "data", true, write_lammps_data},  // a data file of LAMMPS
      {"xdmf", "xmf", false, write_xdmf},                // refers to the trajectory, for ParaView
      {"xdmf2", "xmf", false, write_xdmf2},              // likewise, for programs with an older reader
  }};
  return formats;
}

std::string write_extxyz(const TrajectoryReader& trajectory, std::span<const std::uint64_t> frames, TextFile& file,
                         const std::filesystem::path& /*path*/) {
  const auto symbols = symbols_of(trajectory.species_names);
  for (const std::uint64_t index : frames) {
    const TrajectoryFrame f = trajectory.frame(index);
    fmt::memory_buffer text;
    const auto out = fmt::appender(text);
    fmt::format_to(out, "{}\nLattice=\"{} 0 0 {} {} 0 0 0 {}\"", trajectory.particles(), f.edges[0], f.tilt, f.edges[1],
                   f.edges[2]);
    fmt::format_to(
        out,
        " Properties=species:S:1:pos:R:3:velo:R:3:radius:R:1:mass:R:1:charge:R:1:image:I:3{} Time={} Step={} pbc=\"",
        f.spin.empty() ? "" : ":angular_velocity:R:3", f.time, f.step);
    for (std::size_t k = 0; k < 3; ++k)
      fmt::format_to(out, "{}{}", k > 0 ? " " : "", periodic(trajectory, k) ? 'T' : 'F');
    fmt::format_to(out, "\" species_names={}\n", quoted_for_extxyz(joined(trajectory.species_names)));
    for (std::size_t i = 0; i < trajectory.particles(); ++i) {
      const auto *x = &f.position[3 * i], *v = &f.velocity[3 * i];
      const auto* image = &f.image[3 * i];
      fmt::format_to(out, "{} {} {} {} {} {} {} {} {} {} {} {} {}",
                     symbols[static_cast<std::size_t>(trajectory.species[i])], x[0], x[1], x[2], v[0], v[1], v[2],
                     trajectory.radius[i], trajectory.mass[i], trajectory.charge[i], image[0], image[1], image[2]);
      if (!f.spin.empty()) fmt::format_to(out, " {} {} {}", f.spin[3 * i], f.spin[3 * i + 1], f.spin[3 * i + 2]);
      text.push_back('\n');
      if (text.size() < kBytesPerWrite) continue;
      file.append({text.data(), text.size()});
      text.clear();
    }
    file.append({text.data(), text.size()});
  }
  return {};
}

std::string write_lammps_data(const TrajectoryReader& trajectory, std::span<const std::uint64_t> frames, TextFile& file,
                              const std::filesystem::path& path) {
  // 1. What the input script must declare: the boundaries, and the properties of each atom.
  const TrajectoryFrame f = trajectory.frame(frames.front());
  const bool charged = std::ranges::any_of(trajectory.charge, [](double q) { return q != 0; });
  const bool bonded = !trajectory.bonds.empty(), flat = trajectory.dimension == 2;
  std::string boundary;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::string rule = k < trajectory.boundary.size() ? trajectory.boundary[k] : "periodic";
    boundary += std::string(" ") + (rule == "periodic" ? "p" : rule == "wall" ? "f" : "s");
  }
  const std::string styles = std::string(charged || bonded ? "hybrid sphere" : "sphere") + (charged ? " charge" : "") +
                             (bonded ? " bond" : "");
  const std::string script = "units lj; dimension " + std::to_string(trajectory.dimension) + "; boundary" + boundary +
                             "; atom_style " + styles + "; read_data " + path.filename().string();

  // 2. The box: along an open axis it spans the particles.
  fmt::memory_buffer text;
  const auto out = fmt::appender(text);
  const std::size_t n = trajectory.particles();
  fmt::format_to(out, "carom, time {}, step {}: {}\n\n{} atoms\n{} atom types\n", f.time, f.step, script, n,
                 trajectory.species_names.size());
  if (bonded) fmt::format_to(out, "{} bonds\n1 bond types\n", trajectory.bonds.size());
  for (std::size_t k = 0; k < 3; ++k) {
    double low = 0, high = f.edges[k];
    if (flat && k == 2) low = -0.5, high = 0.5;
    if (k < trajectory.boundary.size() && trajectory.boundary[k] == "open")
      for (std::size_t i = 0; i < n; ++i) {
        low = std::min(low, f.position[3 * i + k] - trajectory.radius[i]);
        high = std::max(high, f.position[3 * i + k] + trajectory.radius[i]);
      }
    fmt::format_to(out, "{} {} {}lo {}hi\n", low, high, "xyz"[k], "xyz"[k]);
  }

  const bool back = f.tilt > 0.5 * f.edges[0];  // LAMMPS wants tilts of at most half an edge
  if (f.tilt != 0) fmt::format_to(out, "{} 0 0 xy xz yz\n", back ? f.tilt - f.edges[0] : f.tilt);

  // 3. The particles.
  const auto write = [&](bool all) {
    if (!all && text.size() < kBytesPerWrite) return;
    file.append({text.data(), text.size()});
    text.clear();
  };
  fmt::format_to(out, "\nAtoms # {}\n\n", styles);
  for (std::size_t i = 0; i < n; ++i) {
    // LAMMPS has no infinite mass: there `fix freeze` or no integration fixes a particle.
    const double r = trajectory.radius[i], mass = std::isinf(trajectory.mass[i]) ? 1 : trajectory.mass[i],
                 density = mass / (4.0 / 3.0 * 3.14159265358979323846 * r * r * r);
    const auto* x = &f.position[3 * i];
    const auto* image = &f.image[3 * i];
    if (charged || bonded) {
      fmt::format_to(out, "{} {} {} {} {} {} {}", i + 1, trajectory.species[i] + 1, x[0], x[1], x[2], 2 * r, density);
      if (charged) fmt::format_to(out, " {}", trajectory.charge[i]);
      if (bonded) fmt::format_to(out, " 0");
    } else {
      fmt::format_to(out, "{} {} {} {} {} {} {}", i + 1, trajectory.species[i] + 1, 2 * r, density, x[0], x[1], x[2]);
    }
    fmt::format_to(out, " {} {} {}\n", image[0] + (back ? image[1] : 0), image[1], image[2]);
    write(false);
  }
  fmt::format_to(out, "\nVelocities\n\n");
  for (std::size_t i = 0; i < n; ++i) {
    constexpr std::array<double, 3> still{};
    const double *v = &f.velocity[3 * i], *w = f.spin.empty() ? still.data() : &f.spin[3 * i];
    fmt::format_to(out, "{} {} {} {} {} {} {}\n", i + 1, v[0], v[1], v[2], w[0], w[1], w[2]);
    write(false);
  }
  if (bonded) fmt::format_to(out, "\nBonds\n\n");
  for (std::size_t k = 0; k < trajectory.bonds.size(); ++k) {
    fmt::format_to(out, "{} 1 {} {}\n", k + 1, trajectory.bonds[k][0] + 1, trajectory.bonds[k][1] + 1);
    write(false);
  }
  write(true);

  constexpr std::int32_t kMostImages = 511;  // LAMMPS keeps an image in ten bits
  const bool far = std::ranges::any_of(f.image, [](std::int32_t i) { return std::abs(i) > kMostImages; });
  return "In LAMMPS: " + script +
         (far ? "\nSome particles have crossed the box more than 511 times: LAMMPS as it is usually built loses count"
              : "");
}

}  // namespace carom
