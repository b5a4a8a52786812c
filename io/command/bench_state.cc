// SPDX-License-Identifier: BSD-3-Clause
#include "io/command/bench_state.h"

#include <charconv>
#include <cstdio>
#include <fstream>
#include <numbers>
#include <numeric>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/setup/placement.h"
#include "io/files/text_file.h"

namespace carom {
namespace {

/// A periodic system of `n` spheres of one species, charge 0 and mass 1, for the rest to be filled in.
template <int D>
std::unique_ptr<System<D>> blank_system(std::size_t n, const Vec<D>& edges) {
  auto system = std::make_unique<System<D>>();
  system->box.edges = edges;
  system->box.boundary.fill(Boundary::periodic);
  system->species = {"sphere"};
  Particles<D>& p = system->particles;
  p.x.assign(n, Vec<D>::Zero());
  p.v.assign(n, Vec<D>::Zero());
  p.mass.assign(n, 1.0);
  p.radius.assign(n, 0.5);
  p.charge.assign(n, 0.0);
  p.species.assign(n, 0);
  p.image.assign(n, Image<D>{});
  return system;
}

void refuse(const Overlaps& found, const std::string& what) {
  if (found.pairs == 0) return;
  throw Error(Failure::initial_state, what + ": " + std::to_string(found.pairs) +
                                          " pairs of spheres overlap, particles " + std::to_string(found.lo) + " and " +
                                          std::to_string(found.hi) + " most; lower the packing fraction");
}

template <int D>
Overlaps overlaps(const System<D>& system) {
  return find_overlaps<D>(system.box, system.particles.x, system.particles.radius);
}

/// Puts all spheres on sites drawn at random from those of a lattice.
template <int D>
void place(Lattice lattice, double volume, std::uint64_t seed, System<D>& system) {
  Particles<D>& p = system.particles;
  system.box.edges = commensurate_edges<D>(lattice, p.size(), volume);
  const auto sites = lattice_sites<D>(lattice, system.box, p.size(), 0.0);
  const auto owner = distribute(sites.size(), std::vector<std::size_t>{p.size()}, seed);
  std::size_t i = 0;
  for (std::size_t site = 0; site < sites.size(); ++site)
    if (owner[site] == 0) p.x[i++] = sites[site];
}

/// Reads the file line by line and complains with its name and the line.
class StateReader {
 public:
  explicit StateReader(const std::filesystem::path& file) : file_(file), in_(file) {
    if (!in_ || std::filesystem::is_directory(file))
      throw Error(Failure::file, file.string() + ": cannot read the state; check the name after --state");
  }

  /// The numbers of the next line, valid until the next call.
  const std::vector<double>& next(const char* wanted) {
    ++number_;
    row_.clear();
    if (!std::getline(in_, line_)) fail("the file ends", wanted);
    const char* at = line_.data();
    const char* const end = at + line_.size();
    for (;;) {
      while (at != end && (*at == ' ' || *at == '\t' || *at == '\r')) ++at;
      if (at == end) return row_;
      double value = 0;
      const auto [stop, failed] = std::from_chars(at, end, value);
      const bool whole = stop == end || *stop == ' ' || *stop == '\t' || *stop == '\r';
      if (failed != std::errc{} || !whole || !std::isfinite(value)) fail("not a finite number", wanted);
      row_.push_back(value);
      at = stop;
    }
  }

  std::size_t spheres() {
    const char* wanted = "the number of spheres";
    const auto& row = next(wanted);
    if (row.size() != 1 || row[0] < 1 || row[0] > 4e9 || row[0] != std::floor(row[0]))
      fail("not a number of spheres", wanted);
    return static_cast<std::size_t>(row[0]);
  }

  const std::vector<double>& edges() {
    const char* wanted = "two or three positive edges of the periodic box";
    const auto& row = next(wanted);
    if (row.size() != 2 && row.size() != 3) fail("not the edges of a box", wanted);
    for (const double edge : row)
      if (edge <= 0) fail("not the edges of a box", wanted);
    return row;
  }

  [[noreturn]] void fail(const std::string& what, const std::string& wanted) const {
    throw Error(Failure::deck,
                file_.string() + ":" + std::to_string(number_) + ": error: " + what + "; give " + wanted);
  }

 private:
  std::filesystem::path file_;
  std::ifstream in_;
  int number_ = 0;
  std::string line_;
  std::vector<double> row_;
};

}  // namespace

template <int D>
std::unique_ptr<System<D>> lattice_state(std::uint64_t n, double packing_fraction, std::uint64_t seed) {
  const double sphere = D == 2 ? std::numbers::pi / 4 : std::numbers::pi / 6;
  const double volume = static_cast<double>(n) * sphere / packing_fraction;
  auto system = blank_system<D>(n, Vec<D>::Ones());
  place(Lattice::simple, volume, seed, *system);
  if (overlaps(*system).pairs > 0) place(Lattice::centred, volume, seed, *system);
  refuse(overlaps(*system),
         "a lattice of " + std::to_string(n) + " spheres at packing fraction " + std::to_string(packing_fraction));
  std::vector<Id> all(n);
  std::iota(all.begin(), all.end(), Id{0});
  draw_velocities<D>(system->particles, all, std::vector<double>(n, 1.0), seed);
  return system;
}

int state_dimension(const std::filesystem::path& file) {
  StateReader reader(file);
  reader.spheres();
  return static_cast<int>(reader.edges().size());
}

template <int D>
std::unique_ptr<System<D>> read_state(const std::filesystem::path& file) {
  StateReader reader(file);
  const std::size_t n = reader.spheres();
  auto system = blank_system<D>(0, Eigen::Map<const Vec<D>>(reader.edges().data()));
  Particles<D>& p = system->particles;
  double twice_kinetic = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const char* wanted = "position, velocity and radius of a sphere";
    const auto& row = reader.next(wanted);
    if (row.size() != 2 * D + 1 || row.back() <= 0) reader.fail("not a sphere", wanted);
    p.x.push_back(Eigen::Map<const Vec<D>>(row.data()));
    p.v.push_back(Eigen::Map<const Vec<D>>(row.data() + D));
    p.radius.push_back(row.back());
    twice_kinetic += p.v.back().squaredNorm();
  }
  if (twice_kinetic == 0)
    throw Error(Failure::initial_state,
                file.string() + ": all spheres are at rest: nothing will collide; give velocities");
  p.mass.assign(n, 1.0);
  p.charge.assign(n, 0.0);
  p.species.assign(n, 0);
  p.image.assign(n, Image<D>{});
  system->wrap();
  refuse(overlaps(*system), file.string());
  return system;
}

template <int D>
void write_state(const std::filesystem::path& file, const System<D>& system) {
  TextFile out(file);
  std::string piece = std::to_string(system.particles.size()) + "\n";
  const auto add = [&](double value, bool last) {
    char text[40];
    std::snprintf(text, sizeof text, "%.17g%c", value, last ? '\n' : ' ');
    piece += text;
  };
  for (int k = 0; k < D; ++k) add(system.box.edges[k], k == D - 1);
  const Particles<D>& p = system.particles;
  for (std::size_t i = 0; i < p.size(); ++i) {
    for (const double x : p.x[i]) add(x, false);
    for (const double v : p.v[i]) add(v, false);
    add(p.radius[i], true);
    if (piece.size() < (1u << 16)) continue;
    out.append(piece);
    piece.clear();
  }
  out.append(piece);
  out.close();
}

template std::unique_ptr<System<2>> lattice_state(std::uint64_t, double, std::uint64_t);
template std::unique_ptr<System<2>> read_state(const std::filesystem::path&);
template void write_state(const std::filesystem::path&, const System<2>&);

template std::unique_ptr<System<3>> lattice_state(std::uint64_t, double, std::uint64_t);
template std::unique_ptr<System<3>> read_state(const std::filesystem::path&);
template void write_state(const std::filesystem::path&, const System<3>&);

}  // namespace carom
