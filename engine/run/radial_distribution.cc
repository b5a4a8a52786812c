// SPDX-License-Identifier: BSD-3-Clause
#include "engine/run/radial_distribution.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <sstream>

#include "engine/base/elementary.h"
#include "engine/base/error.h"
#include "engine/search/cell_grid.h"

namespace carom {

namespace {

/// Cells of half the range are the fastest, measured from 1/1 to 1/4 for ranges of three and four diameters.
constexpr int kCellsInRange = 2;

/// A contiguous range of particles in the order of the cells, and the displacement of their image.
template <int D>
struct Run {
  std::uint32_t begin, end;
  Vec<D> shift;
};

/// The volume in which an ideal gas has a partner at distances from a to b, averaged over a region with these edges;
/// there are no partners beyond walled edges.
template <int D>
double shell_volume(double a, double b, const Vec<D>& edges, const std::array<bool, D>& walled) {
  // Averages of |u_x|, |u_x u_y|, |u_x u_y u_z| over directions u.
  constexpr double pi = std::numbers::pi;
  constexpr std::array<double, 3> mean = {D == 2 ? 2 / pi : 0.5, D == 2 ? 1 / pi : 2 / (3 * pi), 1 / (4 * pi)};
  std::array<double, D + 1> c{1};  // coefficients of the average of Π (1 − r|u_k|/L_k) as a polynomial in r
  for (int k = 0; k < D; ++k)
    if (walled[k])
      for (int p = D; p > 0; --p) c[p] -= c[p - 1] / edges[k];
  double volume = 0;
  for (int p = 0; p <= D; ++p)
    volume += c[p] * (p == 0 ? 1.0 : mean[p - 1]) * (elementary::pow(b, D + p) - elementary::pow(a, D + p)) / (D + p);
  return (D == 2 ? 2 * pi : 4 * pi) * volume;
}

/// The error if g(r) up to `range` is not defined in this system.
template <int D>
std::optional<ParameterError> error_of(const System<D>& system, double range) {
  if (!system.box.closed() || !system.box.plain())
    return ParameterError{
        "interval", "g(r) needs a density, and a box with an open boundary, walls that move or further walls has none",
        "set rdf_interval = 0, or close the box"};
  const double longest = RadialDistribution<D>::longest_range(system);
  if (range > 0 && range <= longest * (1 + 1e-9)) return {};
  std::ostringstream what, remedy;
  what.precision(15);
  remedy.precision(15);
  what << "g(r) cannot be taken to " << range << " in this box";
  remedy << "take at most " << longest << ": half the shortest periodic edge, or the way between two walls";
  return ParameterError{"range", what.str(), remedy.str()};
}

/// Sets the range if it is not given.
template <int D>
std::optional<ParameterError> complete_gr(Parameters& parameters, const System<D>& system) {
  if (!parameters.has("range")) parameters.set("range", RadialDistribution<D>::usual_range(system));
  return error_of(system, parameters.real("range"));
}

}  // namespace

template <int D>
RadialDistribution<D>::RadialDistribution(const System<D>& system, const RadialDistributionOptions& options)
    : Observable<D>(options.sampling), system_(system), options_(options) {
  if (const auto wrong = error_of(system, options.range))
    throw Error(Failure::deck, wrong->what + "; " + wrong->remedy);
  const std::size_t species = system.species.size();
  number_.resize(species);
  smallest_.assign(species, std::numeric_limits<double>::infinity());
  largest_.resize(species);
  const auto bins = static_cast<std::size_t>(options.bins);
  counts_.resize(species * (species + 1) / 2 * bins);
  series_ = Blocking(counts_.size() + (species > 1 ? bins : 0));
}

template <int D>
RadialDistribution<D>::RadialDistribution(const System<D>& system, const Parameters& parameters, double start)
    : RadialDistribution(system, {.sampling = {parameters.real("interval"), start},
                                  .range = parameters.real("range"),
                                  .bins = static_cast<int>(parameters.integer("bins"))}) {}

/// Counts the particles of each species.
template <int D>
void RadialDistribution<D>::count(const Particles<D>& p) {
  for (std::size_t i = 0; i < p.size(); ++i) {
    const std::size_t s = p.species[i];
    number_[s] += 1;
    smallest_[s] = std::min(smallest_[s], p.radius[i]);
    largest_[s] = std::max(largest_[s], p.radius[i]);
  }
}

template <int D>
double RadialDistribution<D>::longest_range(const System<D>& system) {
  const auto radius = system.decomposition.radii();
  const double margin = radius.empty() ? 0 : 2 * *std::ranges::min_element(radius);
  double longest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < D; ++k)
    longest = std::min(longest, system.box.periodic(k) ? system.box.edges[k] / 2 : system.box.edges[k] - margin);
  return longest;
}

template <int D>
double RadialDistribution<D>::usual_range(const System<D>& system) {
  const auto radius = system.decomposition.radii();
  return std::min(longest_range(system), radius.empty() ? 1.0 : 6 * *std::ranges::max_element(radius));
}

template <int D>
std::size_t RadialDistribution<D>::pair_index(std::size_t a, std::size_t b) const {
  const std::size_t lo = std::min(a, b), hi = std::max(a, b);
  return hi * (hi + 1) / 2 + lo;
}

template <int D>
void RadialDistribution<D>::add_sample(double /*time*/, const Particles<D>& particles) {
  if (this->samples() == 0) count(particles);
  const std::size_t n = particles.size(), bins = static_cast<std::size_t>(options_.bins);
  const CellGrid<D> grid(system_.box, options_.range / kCellsInRange, {n, Vec<D>::Zero(), Vec<D>::Zero()}, 1);
  const Cell<D> reach = grid.range(options_.range);
  double farthest = 0;  // squared distance of two particles in such cells
  for (int k = 0; k < D; ++k) farthest += (reach[k] + 1) * grid.edge(k) * (reach[k] + 1) * grid.edge(k);

  // Sort the particles in the order of the cells, so that a row of cells is a contiguous range.
  start_.assign(grid.cells() + 1, 0);
  cell_.resize(n);
  species_.resize(n);
  for (auto& x : x_) x.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    Cell<D> c = grid.cell(particles.x[i]);
    for (int k = 0; k < D; ++k) c[k] = std::clamp(c[k], 0, grid.count(k) - 1);
    cell_[i] = static_cast<std::uint32_t>(grid.index(c));
    ++start_[cell_[i] + 1];
  }
  std::partial_sum(start_.begin(), start_.end(), start_.begin());
  auto next = start_;
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint32_t at = next[cell_[i]]++;
    for (int k = 0; k < D; ++k) x_[k][at] = particles.x[i][k];
    species_[at] = particles.species[i];
  }

  // All visited partners are counted, without a branch; counts beyond the range are dropped at the end.
  const double shells = static_cast<double>(bins) / options_.range;
  const double last = std::floor(std::sqrt(farthest) * shells) + 1;
  const std::size_t kinds = number_.size(), all = static_cast<std::size_t>(last) + 1;
  std::vector<std::uint64_t> counted(kinds * (kinds + 1) / 2 * all);
  std::vector<std::uint64_t*> histogram(kinds * kinds);
  for (std::size_t a = 0; a < kinds; ++a)
    for (std::size_t b = 0; b < kinds; ++b) histogram[a * kinds + b] = &counted[pair_index(a, b) * all];
  std::vector<Run<D>> runs;
  std::array<Eigen::ArrayXd, D> partner;  // the particles of the cell, then possible partners
  std::vector<std::uint16_t> kind;
  Eigen::ArrayXd squared;
  Eigen::ArrayXi shell;
  Cell<D> centre{};
  for (std::size_t cell = 0; cell < grid.cells(); ++cell, grid.advance(centre)) {
    const std::uint32_t begin = start_[cell], own = start_[cell + 1] - begin;
    if (own > 0) {
      runs.clear();
      grid.for_each_range(centre, reach, true, [&](std::size_t first, std::size_t end, const Image<D>& boxes) {
        if (start_[first] < start_[end]) runs.push_back({start_[first], start_[end], system_.box.shift(boxes)});
      });
      Eigen::Index size = 0;
      for (const Run<D>& run : runs) size += run.end - run.begin;
      for (int k = 0; k < D; ++k) {
        if (partner[k].size() < size) partner[k].resize(2 * size);
        double* to = partner[k].data();
        for (const Run<D>& run : runs)
          for (std::uint32_t j = run.begin; j < run.end; ++j) *to++ = x_[k][j] + run.shift[k];
      }
      kind.clear();
      if (kinds > 1)
        for (const Run<D>& run : runs)
          kind.insert(kind.end(), species_.begin() + run.begin, species_.begin() + run.end);
      squared.resize(size);
      shell.resize(size);
      for (std::uint32_t i = 0; i < own; ++i) {
        const Eigen::Index rest = size - (i + 1);
        squared.head(rest).setZero();
        for (int k = 0; k < D; ++k) squared.head(rest) += (partner[k].segment(i + 1, rest) - partner[k][i]).square();
        // (std::sqrt sets errno, which prevents vector code.)
        shell.head(rest) = (squared.head(rest).sqrt() * shells).min(last).template cast<std::int32_t>();
        std::uint64_t* const* const of = &histogram[species_[begin + i] * kinds];
        if (kinds == 1)
          for (Eigen::Index j = 0; j < rest; ++j) ++of[0][shell[j]];
        else
          for (Eigen::Index j = 0; j < rest; ++j) ++of[kind[static_cast<std::size_t>(j) + i + 1]][shell[j]];
      }
    }
  }
  std::vector<double> of_sample(series_.columns());
  for (std::size_t k = 0; k < counts_.size(); ++k) {
    const std::uint64_t count = counted[k / bins * all + k % bins];
    counts_[k] += count;
    of_sample[k] += static_cast<double>(count);
    if (kinds > 1) of_sample[counts_.size() + k % bins] += static_cast<double>(count);
  }
  series_.add(of_sample);
}

template <int D>
std::vector<double> RadialDistribution<D>::radii() const {
  std::vector<double> r(static_cast<std::size_t>(options_.bins));
  for (std::size_t b = 0; b < r.size(); ++b)
    r[b] = (static_cast<double>(b) + 0.5) * options_.range / static_cast<double>(options_.bins);
  return r;
}

template <int D>
double RadialDistribution<D>::pairs_between(std::size_t a, std::size_t b) const {
  return a == b ? number_[a] * (number_[a] - 1) / 2 : number_[a] * number_[b];
}

/// The counts in each shell of an ideal gas with `pairs` pairs; `margin` is the radius that centres keep from walls.
template <int D>
std::vector<double> RadialDistribution<D>::expected(double samples, double pairs, double margin) const {
  Vec<D> edges = system_.box.edges;
  std::array<bool, D> walled;
  for (int k = 0; k < D; ++k) {
    walled[k] = system_.box.walled(k);
    if (walled[k]) edges[k] -= 2 * margin;
  }
  const double width = options_.range / static_cast<double>(options_.bins);
  std::vector<double> counts(static_cast<std::size_t>(options_.bins));
  for (std::size_t b = 0; b < counts.size(); ++b) {
    const double inner = static_cast<double>(b) * width, outer = static_cast<double>(b + 1) * width;
    counts[b] = samples * pairs * shell_volume<D>(inner, outer, edges, walled) / edges.prod();
  }
  return counts;
}

template <int D>
std::vector<double> RadialDistribution<D>::expected(double samples, std::size_t a, std::size_t b) const {
  return expected(samples, pairs_between(a, b), std::min(smallest_[a], smallest_[b]));
}

/// The counts of all pairs in all samples.
template <int D>
std::vector<double> RadialDistribution<D>::expected_of_all(double samples) const {
  const double n = std::accumulate(number_.begin(), number_.end(), 0.0);
  return expected(samples, n * (n - 1) / 2, *std::ranges::min_element(smallest_));
}

template <int D>
std::vector<double> RadialDistribution<D>::g() const {
  const std::size_t bins = static_cast<std::size_t>(options_.bins);
  std::vector<std::uint64_t> all(bins);
  for (std::size_t k = 0; k < counts_.size(); ++k) all[k % bins] += counts_[k];
  std::vector<double> g = expected_of_all(static_cast<double>(this->samples()));
  for (std::size_t k = 0; k < bins; ++k) g[k] = static_cast<double>(all[k]) / g[k];
  return g;
}

template <int D>
std::vector<double> RadialDistribution<D>::g(std::size_t a, std::size_t b) const {
  std::vector<double> g = expected(static_cast<double>(this->samples()), a, b);
  for (std::size_t k = 0; k < g.size(); ++k)
    g[k] = static_cast<double>(counts_[pair_index(a, b) * g.size() + k]) / g[k];
  return g;
}

/// The errors of the columns of a pair of species, or of all at the end.
template <int D>
std::vector<Estimate> RadialDistribution<D>::errors_of(std::size_t pair, const std::vector<double>& expected) const {
  std::vector<Estimate> all;
  for (std::size_t k = 0; k < expected.size(); ++k) {
    all.push_back(series_.estimate(pair * expected.size() + k));
    all.back().error /= expected[k];
  }
  return all;
}

template <int D>
std::vector<Estimate> RadialDistribution<D>::errors() const {
  return errors_of(number_.size() > 1 ? counts_.size() / static_cast<std::size_t>(options_.bins) : 0,
                   expected_of_all(1));
}

template <int D>
std::vector<Estimate> RadialDistribution<D>::errors(std::size_t a, std::size_t b) const {
  return errors_of(pair_index(a, b), expected(1, a, b));
}

template <int D>
std::optional<double> RadialDistribution<D>::contact_value(std::size_t a, std::size_t b) const {
  if (this->samples() == 0 || smallest_[a] != largest_[a] || smallest_[b] != largest_[b]) return {};
  return contact_value_of(a, b, {counts_.begin(), counts_.end()}, static_cast<double>(this->samples()));
}

template <int D>
double RadialDistribution<D>::contact_error(std::size_t a, std::size_t b) const {
  return series_.error_of([&](std::span<const double> sums, double samples) {
    return contact_value_of(a, b, {sums.begin(), sums.end()}, samples)
        .value_or(std::numeric_limits<double>::quiet_NaN());
  });
}

/// Fits the parabola to counts of all shells of all pairs of species.
template <int D>
std::optional<double> RadialDistribution<D>::contact_value_of(std::size_t a, std::size_t b,
                                                              const std::vector<double>& counts, double samples) const {
  const double contact = smallest_[a] + smallest_[b], width = options_.range / options_.bins;
  const auto r = radii(), ideal = expected(samples, a, b);
  const double* const of_pair = &counts[pair_index(a, b) * r.size()];
  // Start at the contact distance; rounding must not lose the first shell.
  const auto first = static_cast<std::size_t>(std::ceil(contact / width * (1 - 1e-9)));
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  int used = 0;
  for (std::size_t k = first; k < r.size() && (k < first + 6 || r[k] + width / 2 <= 1.15 * contact); ++k) {
    if (!(of_pair[k] > 0)) continue;
    const double s = (r[k] - contact) / contact, weight = of_pair[k];
    const Eigen::Vector3d powers(1, s, s * s);
    normal += weight * powers * powers.transpose();
    right += weight * elementary::log(of_pair[k] / ideal[k]) * powers;
    ++used;
  }
  if (used < 4) return {};
  // Cramer's rule gives the first unknown: LDLT uses fused multiply-adds on processors that have them.
  const Eigen::Vector3d minors = normal.col(1).cross(normal.col(2));
  return elementary::exp(right.dot(minors) / normal.col(0).dot(minors));
}

template <int D>
std::vector<TableColumn> RadialDistribution<D>::table() const {
  std::vector<TableColumn> table = {{"r", radii()}};
  add_estimates(table, "g", g(), errors());
  const auto& names = system_.species;
  for (std::size_t a = 0; names.size() > 1 && a < names.size(); ++a)
    for (std::size_t b = a; b < names.size(); ++b)
      add_estimates(table, "g_" + names[a] + "_" + names[b], g(a, b), errors(a, b));
  return table;
}

template <int D>
std::vector<SpeciesValue> RadialDistribution<D>::species_values() const {
  const auto& names = system_.species;
  std::vector<SpeciesValue> values;
  for (std::size_t a = 0; a < names.size(); ++a)
    for (std::size_t b = a; b < names.size(); ++b)
      if (const auto g = contact_value(a, b))
        values.push_back({"contact_value", {names[a], names[b]}, "g", *g, contact_error(a, b)});
  return values;
}

template class RadialDistribution<2>;
template class RadialDistribution<3>;

namespace observable {

ObservableInfo rdf() {
  using enum Parameter::Type;
  using enum Parameter::Range;
  return {
      .name = "rdf",
      .title = "radial distribution function",
      .parameters = {parameter::interval(
                         "simulated time between samples of the radial distribution function, averaged into "
                         "rdf.csv; 0: none. A sample costs O(count); configurations a hundred mean free times "
                         "apart are about independent"),
                     {"range", real, "none", "length",
                      "the largest distance of rdf.csv, at most half the shortest periodic edge; default: three of "
                      "the largest diameters, or less if the box is small",
                      positive},
                     {.name = "bins",
                      .type = integer,
                      .fallback = "200",
                      .unit = "-",
                      .meaning = "shells of equal thickness from 0 to rdf_range",
                      .range = positive,
                      .most = 1e6}},
      .documentation =
          "g(r) of all particles and, if there are several species, of each pair of species. Columns: r (middle of a "
          "shell), g, g_A_B, and error_ and samples_ of each. `contact_value` in the summary is g extrapolated to "
          "contact. Along walls, g refers to "
          "an ideal gas in the region that the centres can reach.",
      .source = "Allen, Tildesley, Computer Simulation of Liquids, 2nd ed., section 2.6",
      .in_2d = maker<RadialDistribution, 2>(complete_gr<2>),
      .in_3d = maker<RadialDistribution, 3>(complete_gr<3>),
      .sheared = true};
}

}  // namespace observable

}  // namespace carom
