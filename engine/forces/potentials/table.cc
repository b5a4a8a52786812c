// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/potentials/table.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/forces/potentials/options.h"
#include "engine/forces/potentials/types.h"

namespace carom {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kMostCells = 65536;  // 256 kB of indices

/// The spline's slopes at its knots, from the continuity of V″ inside and a given slope or V″ = 0 at either end. The
/// matrix is tridiagonal and diagonally dominant.
std::vector<double> knot_slopes(const std::vector<double>& rho, std::span<const double> v,
                                std::span<const double> end_slopes) {
  const std::size_t n = rho.size();
  std::vector<double> diagonal(n, 1), above(n, 0), below(n, 0), slope(n);
  const auto chord = [&](std::size_t k) { return (v[k + 1] - v[k]) / (rho[k + 1] - rho[k]); };
  for (std::size_t k = 1; k + 1 < n; ++k) {
    const double left = 1 / (rho[k] - rho[k - 1]), right = 1 / (rho[k + 1] - rho[k]);
    below[k] = left, above[k] = right, diagonal[k] = 2 * (left + right);
    slope[k] = 3 * (left * chord(k - 1) + right * chord(k));
  }
  if (end_slopes.empty()) {
    diagonal[0] = 2, above[0] = 1, slope[0] = 3 * chord(0);
    diagonal[n - 1] = 2, below[n - 1] = 1, slope[n - 1] = 3 * chord(n - 2);
  } else {
    slope[0] = 0.5 * end_slopes[0] / std::sqrt(rho[0]);  // dV/dρ = (dV/dr)/(2r)
    slope[n - 1] = 0.5 * end_slopes[1] / std::sqrt(rho[n - 1]);
  }
  for (std::size_t k = 1; k < n; ++k) {
    const double factor = below[k] / diagonal[k - 1];
    diagonal[k] -= factor * above[k - 1];
    slope[k] -= factor * slope[k - 1];
  }
  slope[n - 1] /= diagonal[n - 1];
  for (std::size_t k = n - 1; k-- > 0;) slope[k] = (slope[k] - above[k] * slope[k + 1]) / diagonal[k];
  return slope;
}

}  // namespace

Table::Table(std::span<const double> r, std::span<const double> values, std::span<const double> slopes) {
  std::vector<double> rho;
  for (const double each : r) rho.push_back(each * each);
  const std::vector<double> s = knot_slopes(rho, values, slopes);
  auto data = std::make_shared<Data>();
  auto& pieces = data->pieces;
  pieces.resize(1);
  double narrowest = kInfinity;
  for (std::size_t k = 0; k + 1 < rho.size(); ++k) {
    const double h = rho[k + 1] - rho[k], chord = (values[k + 1] - values[k]) / h;
    pieces.push_back({rho[k], rho[k], values[k], s[k], (3 * chord - 2 * s[k] - s[k + 1]) / h,
                      (s[k] + s[k + 1] - 2 * chord) / (h * h)});
    narrowest = std::min(narrowest, h);
  }
  first_ = rho.front(), last_ = rho.back();
  pieces[0] = {-kInfinity, first_, values[0], s[0], pieces[1].c2, 0};
  pieces.push_back({std::nextafter(last_, kInfinity), last_, values.back(), 0, 0, 0});
  pieces.push_back({kInfinity, last_, 0, 0, 0, 0});
  const double cells = std::min(std::ceil((last_ - first_) / narrowest), kMostCells);
  inverse_cell_ = cells / (last_ - first_), last_cell_ = cells - 1;
  std::uint32_t at = 1;
  for (std::uint32_t cell = 0; cell < cells; ++cell) {
    while (cell >= (pieces[at + 1].start - first_) * inverse_cell_) ++at;
    data->cells.push_back(at);
  }
  pieces_ = pieces.data(), cells_ = data->cells.data();
  data_ = std::move(data);
}

/// The scale at this distance within the table, but at least 2^-16 of the largest one at the points.
ForceScale Table::scale(double distance) const {
  const auto size = [&](double rho) -> ForceScale {
    return {2 * std::sqrt(rho) * std::abs(derivative(rho)), std::abs(value(rho))};
  };
  ForceScale scale = size(std::clamp(distance * distance, first_, last_));
  for (std::size_t k = 1; k + 1 < data_->pieces.size(); ++k) {
    const ForceScale at = size(data_->pieces[k].base);
    scale = {std::max(scale.force, 0x1p-16 * at.force), std::max(scale.energy, 0x1p-16 * at.energy)};
  }
  return scale;
}

namespace types {
namespace {

using Numbers = std::vector<double>;

void check(const Numbers& r, const Numbers& values, const Numbers& slopes) {
  const auto refuse = [](const std::string& problem) { options::refuse("table", problem); };
  if (r.size() != values.size())
    refuse("'r' has " + std::to_string(r.size()) + " numbers and 'value' " + std::to_string(values.size()) +
           "; give a value for each distance");
  if (!r.empty() && !(r.front() > 0)) refuse("the first distance is not positive; begin above 0");
  if (r.size() < 2) refuse("a table needs two points at least; give more");
  if (std::ranges::adjacent_find(r, std::greater_equal<>()) != r.end())
    refuse("the distances do not ascend; sort the points, each distance once");
  if (!slopes.empty() && slopes.size() != 2)
    refuse("'slope' has " + std::to_string(slopes.size()) +
           " numbers; give two, dV/dr at the first and the last point");
}

template <int D>
std::unique_ptr<Interaction<D>> make(const Parameters& p, const InteractionContext<D>& context) {
  if (!p.has("r") || !p.has("value")) options::refuse("table", "no points are given; give 'r' and 'value', or 'file'");
  const Numbers &r = p.get<Numbers>("r"), &values = p.get<Numbers>("value");
  const Numbers slopes = p.has("slope") ? p.get<Numbers>("slope") : Numbers();
  check(r, values, slopes);
  const options::CutOptions cut = options::cut_options("table", p, r.back());
  if (!(cut.cutoff <= r.back()))
    options::refuse("table", "'cutoff' lies beyond the last point; give a shorter one or more points");
  if (!(cut.cutoff > r.front())) options::refuse("table", "'cutoff' lies before the first point; give a longer one");
  const Table table(r, values, slopes);
  return options::cut_term<D>("table", table, PairWeight::one, cut, p, context);
}

}  // namespace

InteractionInfo table() {
  return {
      .name = "table",
      .kind = InteractionInfo::Kind::pair,
      .parameters = options::with_cut(
          {{"r", Type::real_list, "none", "length", "distances of the points, ascending", Range::positive},
           {"value", Type::real_list, "none", "energy", "V at each of them"},
           {"file", Type::text, "none", "-",
            "instead of 'r' and 'value': a table with r and V in each line, separated by commas or blanks; relative to "
            "the deck's folder"},
           {"slope", Type::real_list, "none", "energy/length",
            "dV/dr at the first and at the last point; absent: a natural spline, without second derivative in r^2 "
            "there"}},
          "distance at which the potential ends, at most that of the last point; absent: there"),
      .formula = "sum over pairs of the cubic spline in r^2 through the given points",
      .documentation =
          "Any pair potential, given by points. It ends at the last point, or at a smaller cutoff, where it is cut "
          "like other potentials; for a table that goes to zero by itself use cut = 'shifted'. Below the first point "
          "it "
          "continues as a parabola in r^2: let the table begin at a distance that no pair reaches.",
      .source = "de Boor, A Practical Guide to Splines, 1978",
      .in_2d = make<2>,
      .in_3d = make<3>};
}

}  // namespace types
}  // namespace carom
