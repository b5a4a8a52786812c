// SPDX-License-Identifier: BSD-3-Clause
#include "engine/setup/placement.h"

#include <algorithm>
#include <numbers>
#include <numeric>

#include "engine/base/elementary.h"
#include "engine/base/random.h"
#include "engine/search/sized_cells.h"

namespace carom {
namespace {

/// Equally spaced lattice planes along one axis.
struct Planes {
  int number = 1;
  double first = 0, spacing = 0;
  bool periodic = false;

  double at(int plane) const { return first + plane * spacing; }
  /// Distance to the equivalent site `planes` planes away; infinite if there is none.
  double step(int planes) const {
    return periodic || number > planes ? planes * spacing : std::numeric_limits<double>::infinity();
  }
};

template <int D>
Planes planes(Lattice lattice, const Box<D>& box, int axis, int cells, double margin) {
  const double edge = box.edges[axis];
  Planes p;
  p.number = lattice == Lattice::centred ? 2 * cells : cells;
  p.periodic = box.periodic(axis);
  p.spacing = edge / p.number;
  p.first = p.spacing / 2;
  if (box.walled(axis) && margin > p.first && p.number > 1) {
    p.first = margin;
    p.spacing = std::max(0.0, (edge - 2 * margin) / (p.number - 1));
  }
  return p;
}

/// The smallest distance between two sites. In centred lattices the sites have an even sum of plane numbers.
template <int D>
double site_distance(Lattice lattice, const std::array<Planes, D>& p) {
  double nearest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < D; ++k) {
    nearest = std::min(nearest, p[k].step(lattice == Lattice::centred ? 2 : 1));
    for (int l = 0; l < k && lattice == Lattice::centred; ++l)
      nearest = std::min(nearest, std::sqrt(p[k].step(1) * p[k].step(1) + p[l].step(1) * p[l].step(1)));
  }
  return nearest;
}

template <int D>
std::size_t sites_a_cell(Lattice lattice) {
  return lattice == Lattice::simple ? 1 : D == 2 ? 2 : 4;
}

std::array<double, 4> four_deviates(std::uint64_t seed, RandomPurpose purpose, Id id) {
  RandomStream random(seed, purpose, id);
  const auto first = random.normal_pair(), second = random.normal_pair();
  return {first[0], first[1], second[0], second[1]};
}

}  // namespace

template <int D>
LatticeCells<D> fit_lattice(Lattice lattice, const Box<D>& box, std::size_t count, double margin) {
  const std::size_t basis = sites_a_cell<D>(lattice);
  const double cell_edge =
      elementary::pow(box.volume() * static_cast<double>(basis) / static_cast<double>(count), 1.0 / D);
  std::array<int, D> most{};
  for (int k = 0; k < D; ++k)
    most[k] = static_cast<int>(std::min(2 * box.edges[k] / cell_edge, static_cast<double>(count))) + 2;

  LatticeCells<D> best;
  double best_distance = -1;
  std::array<int, D> n{};
  n.fill(1);
  while (n[0] <= most[0]) {  // all choices for all axes but the last, which gets the fewest cells that suffice
    std::size_t others = basis;
    for (int k = 0; k + 1 < D; ++k) others *= static_cast<std::size_t>(n[k]);
    n[D - 1] = static_cast<int>((count + others - 1) / others);
    std::array<Planes, D> p;
    for (int k = 0; k < D; ++k) p[k] = planes(lattice, box, k, n[k], margin);
    const double distance = site_distance<D>(lattice, p);
    const std::size_t sites = others * static_cast<std::size_t>(n[D - 1]);
    constexpr double same = 1 + 1e-12;
    if (distance > best_distance * same || (distance * same > best_distance && sites < best.sites)) {
      best = {n, sites};
      best_distance = distance;
    }
    int axis = D - 2;
    while (axis > 0 && n[axis] == most[axis]) n[axis--] = 1;
    ++n[axis];
  }
  return best;
}

template <int D>
std::size_t for_each_site(Lattice lattice, const Box<D>& box, std::size_t count, double margin,
                          const std::function<void(const Vec<D>&)>& visit) {
  const auto fit = fit_lattice(lattice, box, count, margin);
  std::array<Planes, D> p;
  for (int k = 0; k < D; ++k) p[k] = planes(lattice, box, k, fit.cells[k], margin);
  std::array<int, D> at{};
  while (at[0] < p[0].number) {
    if (lattice == Lattice::simple || std::accumulate(at.begin(), at.end(), 0) % 2 == 0) {
      Vec<D> x;
      for (int k = 0; k < D; ++k) x[k] = p[k].at(at[k]);
      visit(x);
    }
    int axis = D - 1;
    while (axis > 0 && at[axis] + 1 == p[axis].number) at[axis--] = 0;
    ++at[axis];
  }
  return fit.sites;
}

template <int D>
std::vector<Vec<D>> lattice_sites(Lattice lattice, const Box<D>& box, std::size_t count, double margin) {
  std::vector<Vec<D>> sites;
  for_each_site<D>(lattice, box, count, margin, [&](const Vec<D>& x) { sites.push_back(x); });
  return sites;
}

template <int D>
Vec<D> commensurate_edges(Lattice lattice, std::size_t count, double volume) {
  if (lattice == Lattice::simple || D == 3)
    return Vec<D>::Constant(D == 2 ? std::sqrt(volume) : elementary::cbrt(volume));
  // Hexagonal: nx by ny cells of a by a√3, with few vacancies first, a nearly square box second.
  const double square = std::sqrt(static_cast<double>(count) * std::numbers::sqrt3 / 2);
  const int least = std::max(1, static_cast<int>(square / 1.5)), most = static_cast<int>(square * 1.5) + 1;
  double best_cost = std::numeric_limits<double>::infinity(), best_aspect = 1;
  for (int nx = least; nx <= most; ++nx) {
    const std::size_t row = 2 * static_cast<std::size_t>(nx), ny = (count + row - 1) / row;
    const double vacancies = static_cast<double>(row * ny) / static_cast<double>(count) - 1;
    const double aspect = static_cast<double>(nx) / (static_cast<double>(ny) * std::numbers::sqrt3);
    const double cost = vacancies + 0.2 * std::abs(elementary::log(aspect));
    if (cost >= best_cost) continue;
    best_cost = cost;
    best_aspect = aspect;
  }
  Vec<D> edges = Vec<D>::Constant(std::sqrt(volume / best_aspect));
  edges[0] = std::sqrt(volume * best_aspect);
  return edges;
}

std::vector<int> distribute(std::size_t sites, std::span<const std::size_t> counts, std::uint64_t seed) {
  std::vector<int> group;
  group.reserve(sites);
  for (std::size_t g = 0; g < counts.size(); ++g) group.insert(group.end(), counts[g], static_cast<int>(g));
  group.resize(sites, -1);
  RandomStream random(seed, RandomPurpose::species, 0);
  for (std::size_t i = sites; i > 1; --i) std::swap(group[i - 1], group[random.below(static_cast<std::uint32_t>(i))]);
  return group;
}

template <int D>
std::size_t insert_at_random(const Box<D>& box, std::span<Vec<D>> x, std::span<const double> radius,
                             std::span<const Id> ids, std::uint64_t seed, const Pause& pause, std::uint64_t tries) {
  constexpr std::uint64_t kTrialsBetweenPauses = 1024;
  std::uint64_t trials = 0;
  std::vector<bool> waiting(x.size(), false);
  for (const Id i : ids) waiting[i] = true;
  SizedCells<D> cells(box, radius, {x.size(), Vec<D>::Zero(), box.edges});
  for (Id i = 0; i < x.size(); ++i)
    if (!waiting[i]) cells.insert(i, x[i], radius[i]);

  std::vector<Id> order(ids.begin(), ids.end());
  std::stable_sort(order.begin(), order.end(), [&](Id a, Id b) { return radius[a] > radius[b]; });
  const auto walls = box.walls();
  std::size_t placed = 0;
  for (const Id i : order) {
    RandomStream random(seed, RandomPurpose::position, i);
    bool free = false;
    for (std::uint64_t trial = 0; trial < tries && !free; ++trial) {
      if (pause && ++trials % kTrialsBetweenPauses == 0) pause();
      for (int k = 0; k < D; ++k) {
        const double margin = box.walled(k) ? radius[i] : 0;
        x[i][k] = margin + random.uniform() * (box.edges[k] - 2 * margin);
      }
      free = box.plain() || std::ranges::all_of(walls, [&](const auto& w) { return w.gap(x[i], radius[i]) >= 0; });
      cells.for_each_near(x[i], radius[i], [&](Id j, const Image<D>& image) {
        const double contact = radius[i] + radius[j];
        if ((x[i] - x[j] + box.shift(image)).squaredNorm() < contact * contact) free = false;
      });
    }
    if (!free) break;
    cells.insert(i, x[i], radius[i]);
    ++placed;
  }
  return placed;
}

template <int D>
Overlaps find_overlaps(const Box<D>& box, std::span<const Vec<D>> x, std::span<const double> radius,
                       std::span<const char> beyond, std::span<const char> fixed, std::span<const Id> id) {
  Overlaps found;
  const GapTolerance tolerance = box.gap_tolerance();
  visit_close_pairs<D>(box, x, radius, beyond, fixed, [&](Id i, Id j, const Image<D>& image) {
    const double distance = (x[i] - x[j] + box.shift(image)).norm(),
                 contact =
                     box.steps.core_distance(id.empty() ? i : id[i], id.empty() ? j : id[j], radius[i] + radius[j]);
    if (distance < contact - tolerance(contact)) found.add({1, j, i, distance, contact});
  });
  return found;
}

template <int D>
Outsiders find_outsiders(const Box<D>& box, std::span<const Vec<D>> x, std::span<const double> radius,
                         std::span<const char> fixed) {
  Outsiders found;
  const GapTolerance tolerance = box.gap_tolerance();
  const auto walls = box.walls();
  for (Id i = 0; i < x.size(); ++i) {
    if (!fixed.empty() && fixed[i] != 0) continue;
    bool outside = false;
    for (const Wall<D>& wall : walls) {
      const bool fits = wall.round == 0 || !wall.inside || wall.reach(radius[i]) > tolerance(radius[i]);
      const double depth = fits ? -wall.gap(x[i], radius[i]) : radius[i];  // a sphere that fills a cavity cannot move
      if (depth <= tolerance(radius[i])) continue;
      outside = true;
      if (depth <= found.depth) continue;
      found.worst = i;
      found.wall = wall.number;
      found.depth = depth;
    }
    if (outside) ++found.spheres;
  }
  return found;
}

template <int D>
void draw_velocities(Particles<D>& particles, std::span<const Id> chosen, std::span<const double> temperature,
                     std::uint64_t seed, RandomPurpose purpose, Communicator* ranks) {
  Communicator alone;
  for (std::size_t n = 0; n < chosen.size(); ++n) {
    const Id i = chosen[n];
    const auto normal = four_deviates(seed, purpose, particles.id_of(i));
    for (int k = 0; k < D; ++k) particles.v[i][k] = std::sqrt(temperature[n] / particles.mass[i]) * normal[k];
  }
  struct Sums {
    std::size_t particles = 0;
    double mass = 0, twice_kinetic_wanted = 0, twice_kinetic = 0;
    Vec<D> momentum = Vec<D>::Zero();
  };
  const Sums drawn = accumulated_in_order(ranks ? *ranks : alone, Sums{}, [&](Sums& sums) {
    sums.particles += chosen.size();
    for (std::size_t n = 0; n < chosen.size(); ++n) {
      const Id i = chosen[n];
      sums.mass += particles.mass[i];
      sums.momentum += particles.mass[i] * particles.v[i];
      sums.twice_kinetic_wanted += D * temperature[n];
    }
  });
  const Sums centred = accumulated_in_order(ranks ? *ranks : alone, drawn, [&](Sums& sums) {
    for (const Id i : chosen) {
      if (sums.particles > 1) particles.v[i] -= sums.momentum / sums.mass;
      sums.twice_kinetic += particles.mass[i] * particles.v[i].squaredNorm();
    }
  });
  const double scale = centred.twice_kinetic > 0 ? std::sqrt(centred.twice_kinetic_wanted / centred.twice_kinetic) : 0;
  for (const Id i : chosen) particles.v[i] *= scale;
}

template <int D>
void draw_spins(Particles<D>& particles, const ContactLaws& laws, std::span<const Id> chosen,
                std::span<const double> temperature, std::uint64_t seed, Communicator* ranks) {
  Communicator alone;
  constexpr int axes = Spin<D>::SizeAtCompileTime;
  struct Sums {
    double wanted = 0, drawn = 0;  // Σ I w²
  };
  const Sums sums = accumulated_in_order(ranks ? *ranks : alone, Sums{}, [&](Sums& sum) {
    for (std::size_t n = 0; n < chosen.size(); ++n) {
      const Id i = chosen[n];
      const double moment = laws.moment(particles.species[i], particles.mass[i], particles.radius[i], D);
      const auto normal = four_deviates(seed, RandomPurpose::spin, particles.id_of(i));
      for (int k = 0; k < axes; ++k) particles.spin[i][k] = std::sqrt(temperature[n] / moment) * normal[k];
      sum.wanted += axes * temperature[n];
      sum.drawn += moment * particles.spin[i].squaredNorm();
    }
  });
  const double scale = sums.drawn > 0 ? std::sqrt(sums.wanted / sums.drawn) : 0;
  for (const Id i : chosen) particles.spin[i] *= scale;
}

template <int D>
double packing_fraction(double volume, std::span<const double> radius, Communicator* ranks) {
  Communicator alone;
  const double filled = accumulated_in_order(ranks ? *ranks : alone, 0.0, [&](double& sum) {
    for (const double r : radius) sum += D == 2 ? std::numbers::pi * r * r : 4 * std::numbers::pi / 3 * r * r * r;
  });
  return filled / volume;
}

template LatticeCells<2> fit_lattice(Lattice, const Box<2>&, std::size_t, double);
template std::size_t for_each_site(Lattice, const Box<2>&, std::size_t, double,
                                   const std::function<void(const Vec<2>&)>&);
template std::vector<Vec<2>> lattice_sites(Lattice, const Box<2>&, std::size_t, double);
template Vec<2> commensurate_edges<2>(Lattice, std::size_t, double);
template std::size_t insert_at_random(const Box<2>&, std::span<Vec<2>>, std::span<const double>, std::span<const Id>,
                                      std::uint64_t, const Pause&, std::uint64_t);
template Overlaps find_overlaps(const Box<2>&, std::span<const Vec<2>>, std::span<const double>, std::span<const char>,
                                std::span<const char>, std::span<const Id>);
template Outsiders find_outsiders(const Box<2>&, std::span<const Vec<2>>, std::span<const double>,
                                  std::span<const char>);
template void draw_velocities(Particles<2>&, std::span<const Id>, std::span<const double>, std::uint64_t, RandomPurpose,
                              Communicator*);
template void draw_spins(Particles<2>&, const ContactLaws&, std::span<const Id>, std::span<const double>, std::uint64_t,
                         Communicator*);
template double packing_fraction<2>(double, std::span<const double>, Communicator*);

template LatticeCells<3> fit_lattice(Lattice, const Box<3>&, std::size_t, double);
template std::size_t for_each_site(Lattice, const Box<3>&, std::size_t, double,
                                   const std::function<void(const Vec<3>&)>&);
template std::vector<Vec<3>> lattice_sites(Lattice, const Box<3>&, std::size_t, double);
template Vec<3> commensurate_edges<3>(Lattice, std::size_t, double);
template std::size_t insert_at_random(const Box<3>&, std::span<Vec<3>>, std::span<const double>, std::span<const Id>,
                                      std::uint64_t, const Pause&, std::uint64_t);
template Overlaps find_overlaps(const Box<3>&, std::span<const Vec<3>>, std::span<const double>, std::span<const char>,
                                std::span<const char>, std::span<const Id>);
template Outsiders find_outsiders(const Box<3>&, std::span<const Vec<3>>, std::span<const double>,
                                  std::span<const char>);
template void draw_velocities(Particles<3>&, std::span<const Id>, std::span<const double>, std::uint64_t, RandomPurpose,
                              Communicator*);
template void draw_spins(Particles<3>&, const ContactLaws&, std::span<const Id>, std::span<const double>, std::uint64_t,
                         Communicator*);
template double packing_fraction<3>(double, std::span<const double>, Communicator*);

}  // namespace carom
