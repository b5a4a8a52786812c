// SPDX-License-Identifier: BSD-3-Clause
// The static structure factor in periodic boxes, S(k) = ⟨|ρ(k)|²⟩/N with ρ(k) = Σ e^(−ik·x), of all particles, of each
// two species and of the charge:
//
//   S_ab(k) = ⟨Re ρ_a(k) ρ_b(k)*⟩/N,   Σ_ab S_ab = S,   S_qq(k) = ⟨|Σ q e^(−ik·x)|²⟩/N.
//
// (Hansen, McDonald, Theory of Simple Liquids, 4th ed., sections 4.1 and 10.2; S_qq is their S_ZZ.) The waves are those
// of the box, k = 2π n_k/L_k. Up to four times the smallest, each |k| has a row with all its waves. Then come shells of
// equal thickness, each with some of its waves: those next to points that are spread evenly over half a sphere.
//
// Every rank adds up the waves of its own particles in fixed point, and only the sums are exchanged, so that the bits
// do not depend on the ranks.

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <set>
#include <sstream>

#include "engine/base/normal_deviates.h"
#include "engine/run/observable.h"

namespace carom::observable {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;

/// Numbers of at most 1 are rounded to multiples of 2^-36. A sum of 10⁸ fits into 64 bits.
constexpr double kQuantum = 0x1p-36;
/// The difference of the bits of kAnchor + x and kAnchor is x/kQuantum, rounded to nearest.
constexpr double kAnchor = 1.5 * 0x1p52 * kQuantum;
std::int64_t fixed(double x) { return std::bit_cast<std::int64_t>(kAnchor + x) - std::bit_cast<std::int64_t>(kAnchor); }

/// Each |k| up to this multiple of the smallest has its own row.
constexpr double kOneByOne = 4;

template <int D>
using Wave = std::array<int, D>;  // n_k; the first that is not zero is positive

template <int D>
double length_of(const Wave<D>& wave, const Vec<D>& edges) {
  double squared = 0;
  for (int k = 0; k < D; ++k) squared += kTwoPi * wave[k] / edges[k] * (kTwoPi * wave[k] / edges[k]);
  return std::sqrt(squared);
}

/// Whether a wave is the one that stands for itself and its opposite.
template <int D>
bool leads(const Wave<D>& wave) {
  for (const int n : wave)
    if (n != 0) return n > 0;
  return false;
}

/// The point number i of n that are spread evenly over the sphere (a spiral, by the golden section) or the circle.
template <int D>
Vec<D> direction(int i, int n) {
  if constexpr (D == 2) {
    const auto [cos, sin] = cosine_and_sine(0.5 * (i + 0.5) / n);
    return {cos, sin};
  } else {
    const double z = (i + 0.5) / n, rho = std::sqrt(1 - z * z);
    const auto [cos, sin] = cosine_and_sine(i * (std::numbers::phi - 1));
    return {z, rho * cos, rho * sin};
  }
}

/// All waves up to |k| = `largest`, by their |k|.
template <int D>
std::vector<std::vector<Wave<D>>> all_waves(const Vec<D>& edges, double largest) {
  std::vector<std::pair<double, Wave<D>>> all;
  Wave<D> most;
  for (int k = 0; k < D; ++k) most[k] = static_cast<int>(largest * edges[k] / kTwoPi + 1e-9);
  const auto visit = [&](const auto& self, Wave<D> wave, int axis) -> void {
    if (axis == D) {
      const double k = length_of<D>(wave, edges);
      if (leads<D>(wave) && k <= largest * (1 + 1e-9)) all.push_back({k, wave});
      return;
    }
    for (wave[axis] = -most[axis]; wave[axis] <= most[axis]; ++wave[axis]) self(self, wave, axis + 1);
  };
  visit(visit, {}, 0);
  std::ranges::stable_sort(all, {}, [](const auto& each) { return each.first; });
  std::vector<std::vector<Wave<D>>> rows;
  double last = 0;
  for (const auto& [k, wave] : all) {
    if (rows.empty() || k > last * (1 + 1e-9)) rows.emplace_back();
    last = k;
    rows.back().push_back(wave);
  }
  return rows;
}

/// The waves of all rows: all of small |k|, then at most `each` of every shell up to `largest`.
template <int D>
std::vector<std::vector<Wave<D>>> chosen_waves(const Vec<D>& edges, double largest, std::int64_t shells, int each) {
  const double smallest = kTwoPi / edges.maxCoeff(), first = std::min(kOneByOne * smallest, largest);
  auto rows = all_waves<D>(edges, first);
  const double width = std::max(largest / static_cast<double>(shells), smallest);
  for (int shell = 0;; ++shell) {
    const double inner = first + shell * width, outer = inner + width;
    if (outer > largest * (1 + 1e-9)) break;
    std::set<Wave<D>> found;
    for (int i = 0; i < 2 * each && found.size() < static_cast<std::size_t>(each); ++i) {
      const Vec<D> to = direction<D>(i % each, each) * (i < each ? inner + 0.5 * width : inner + 0.75 * width);
      Wave<D> wave;
      for (int k = 0; k < D; ++k) wave[k] = static_cast<int>(std::lround(to[k] * edges[k] / kTwoPi));
      if (!leads<D>(wave))
        for (int& n : wave) n = -n;
      if (const double k = length_of<D>(wave, edges); k > inner * (1 + 1e-9) && k <= outer * (1 + 1e-9))
        found.insert(wave);
    }
    if (!found.empty()) rows.emplace_back(found.begin(), found.end());
  }
  return rows;
}

template <int D>
class StructureFactor : public Observable<D> {
 public:
  StructureFactor(const System<D>& system, const Parameters& parameters, double start)
      : Observable<D>({parameters.real("interval"), start}),
        system_(system),
        rows_(chosen_waves<D>(system.box.edges, parameters.real("range"), parameters.integer("bins"),
                              static_cast<int>(parameters.integer("waves")))),
        number_(system.species.size()) {
    for (const auto& row : rows_)
      for (const Wave<D>& wave : row)
        for (int k = 0; k < D; ++k) most_[k] = std::max(most_[k], std::abs(wave[k]));
  }

  bool divided() const override { return true; }

  std::vector<TableColumn> table() const override {
    std::vector<TableColumn> table = {{"k", {}}, {"waves", {}}};
    for (const auto& row : rows_) {
      double sum = 0;
      for (const Wave<D>& wave : row) sum += length_of<D>(wave, system_.box.edges);
      table[0].values.push_back(sum / static_cast<double>(row.size()));
      table[1].values.push_back(static_cast<double>(row.size()));
    }
    std::size_t column = 0;
    const auto add = [&](const std::string& name) {
      std::vector<double> means;
      std::vector<Estimate> estimates;
      for (std::size_t row = 0; row < rows_.size(); ++row) {
        estimates.push_back(series_.estimate(column++));
        means.push_back(estimates.back().mean);
      }
      add_estimates(table, name, means, estimates);
    };
    add("S");
    const auto& names = system_.species;
    for (std::size_t a = 0; names.size() > 1 && a < names.size(); ++a)
      for (std::size_t b = a; b < names.size(); ++b) add("S_" + names[a] + "_" + names[b]);
    if (charge_ > 0) add("S_charge");
    return table;
  }

 private:
  void add_sample(double /*time*/, const Particles<D>& particles) override {
    if (this->samples() == 0) count(particles);
    const std::size_t kinds = number_.size(), parts = kinds + (charge_ > 0 ? 1 : 0);
    std::size_t waves = 0;
    for (const auto& row : rows_) waves += row.size();
    std::vector<std::uint64_t> sums(parts * waves * 2);  // real and imaginary part [part][wave]
    std::array<std::vector<std::array<double, 2>>, D> turns;
    for (int k = 0; k < D; ++k) turns[k].resize(static_cast<std::size_t>(most_[k]) + 1);
    for (Id i = 0; i < particles.size(); ++i) {
      if (!particles.owns(i)) continue;
      for (int k = 0; k < D; ++k) {  // powers of e^(2πi x/L)
        const auto one = cosine_and_sine(particles.x[i][k] / system_.box.edges[k]);
        turns[k][0] = {1, 0};
        for (std::size_t n = 1; n < turns[k].size(); ++n) turns[k][n] = product(turns[k][n - 1], one);
      }
      std::uint64_t* to = &sums[particles.species[i] * waves * 2];
      std::uint64_t* to_charge = charge_ > 0 ? &sums[kinds * waves * 2] : nullptr;
      const double charge = charge_ > 0 ? particles.charge[i] / charge_ : 0;
      for (const auto& row : rows_)
        for (const Wave<D>& wave : row) {
          std::array<double, 2> phase = turns[0][static_cast<std::size_t>(wave[0])];
          for (int k = 1; k < D; ++k) {
            std::array<double, 2> turn = turns[k][static_cast<std::size_t>(std::abs(wave[k]))];
            if (wave[k] < 0) turn[1] = -turn[1];
            phase = product(phase, turn);
          }
          *to++ += static_cast<std::uint64_t>(fixed(phase[0]));
          *to++ += static_cast<std::uint64_t>(fixed(phase[1]));
          if (to_charge == nullptr) continue;
          *to_charge++ += static_cast<std::uint64_t>(fixed(charge * phase[0]));
          *to_charge++ += static_cast<std::uint64_t>(fixed(charge * phase[1]));
        }
    }
    system_.decomposition.ranks().sum(sums);
    add_rows(sums, waves);
  }

  static std::array<double, 2> product(const std::array<double, 2>& a, const std::array<double, 2>& b) {
    return {a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]};
  }

  /// Adds the means over the waves of each row.
  void add_rows(const std::vector<std::uint64_t>& sums, std::size_t waves) {
    const std::size_t kinds = number_.size();
    const double n = std::accumulate(number_.begin(), number_.end(), 0.0);
    const auto at = [&](std::size_t part, std::size_t wave) {
      const auto* sum = &sums[2 * (part * waves + wave)];
      return std::array{static_cast<double>(static_cast<std::int64_t>(sum[0])) * kQuantum,
                        static_cast<double>(static_cast<std::int64_t>(sum[1])) * kQuantum};
    };
    std::vector<double> values;
    const auto add = [&](double scale, auto&& of_wave) {
      std::size_t wave = 0;
      for (const auto& row : rows_) {
        double sum = 0;
        for (std::size_t k = 0; k < row.size(); ++k) sum += of_wave(wave++);
        values.push_back(scale * sum / (n * static_cast<double>(row.size())));
      }
    };
    const auto of_two = [&](std::size_t a, std::size_t b) {
      return [&, a, b](std::size_t wave) {
        const auto x = at(a, wave), y = at(b, wave);
        return x[0] * y[0] + x[1] * y[1];
      };
    };
    add(1, [&](std::size_t wave) {
      std::array<double, 2> all{};
      for (std::size_t kind = 0; kind < kinds; ++kind)
        for (int part = 0; part < 2; ++part) all[part] += at(kind, wave)[part];
      return all[0] * all[0] + all[1] * all[1];
    });
    for (std::size_t a = 0; kinds > 1 && a < kinds; ++a)
      for (std::size_t b = a; b < kinds; ++b) add(1, of_two(a, b));
    if (charge_ > 0) add(charge_ * charge_, of_two(kinds, kinds));
    if (this->samples() == 0) series_ = Blocking(values.size());
    series_.add(values);
  }

  /// Counts the particles of each species, and finds the largest charge. Collective.
  void count(const Particles<D>& particles) {
    std::vector<std::uint64_t> numbers(number_.size());
    for (Id i = 0; i < particles.size(); ++i) {
      if (!particles.owns(i)) continue;
      ++numbers[particles.species[i]];
      charge_ = std::max(charge_, std::abs(particles.charge[i]));
    }
    system_.decomposition.ranks().combine({&charge_, 1}, numbers);
    std::ranges::copy(numbers, number_.begin());
  }

  void sums(Archive& archive) override { archive(number_, charge_, series_); }

  const System<D>& system_;
  std::vector<std::vector<Wave<D>>> rows_;
  Wave<D> most_{};              // the largest |n| along each axis
  std::vector<double> number_;  // of particles, by species
  double charge_ = 0;           // the largest |q|; 0: there are no charges
  Blocking series_;             // of the rows of S, S_ab and S_qq
};

/// Sets the range if it is not given: four times the k of a wave as long as the largest diameter.
template <int D>
std::optional<ParameterError> complete_sk(Parameters& parameters, const System<D>& system) {
  for (int k = 0; k < D; ++k)
    if (!system.box.periodic(k))
      return ParameterError{
          "interval", "S(k) needs waves that fit a periodic box, and axis " + std::to_string(k) + " is not periodic",
          "set sk_interval = 0, or make all axes periodic"};
  const double smallest = kTwoPi / system.box.edges.maxCoeff();
  if (!parameters.has("range")) {
    const auto radius = system.decomposition.radii();
    const double diameter = radius.empty() ? 0 : 2 * *std::ranges::max_element(radius);
    parameters.set("range", std::max(diameter > 0 ? 4 * kTwoPi / diameter : 0, kOneByOne * smallest));
  }
  if (parameters.real("range") >= smallest) return {};
  std::ostringstream what;
  what << "no wave in this box has a k below " << smallest;
  return ParameterError{"range", what.str(), "give a larger range"};
}

}  // namespace

ObservableInfo sk() {
  using enum Parameter::Type;
  using enum Parameter::Range;
  return {
      .name = "sk",
      .title = "structure factor",
      .parameters = {parameter::interval("simulated time between samples of the structure factor S(k), averaged into "
                                         "sk.csv; 0: none. A sample costs O(count × waves)"),
                     {"range", real, "none", "1/length",
                      "the largest k of sk.csv; default: 8 pi over the largest diameter", positive},
                     {.name = "bins",
                      .type = integer,
                      .fallback = "100",
                      .unit = "-",
                      .meaning = "shells from 0 to sk_range; those thinner than the smallest k of the box are joined",
                      .range = positive,
                      .most = 1e4},
                     {.name = "waves",
                      .type = integer,
                      .fallback = "30",
                      .unit = "-",
                      .meaning = "waves of a shell",
                      .range = positive,
                      .most = 1e4}},
      .documentation =
          "S(k) = <|rho(k)|^2>/N for waves that fit the periodic box. Columns: k (mean |k| of the waves), waves (their "
          "number), S of all particles; with several species S_A_B = <Re rho_A rho_B*>/N; with charges S_charge = "
          "<|sum q "
          "exp(-ikx)|^2>/N; error_ and samples_ of each. The smallest k have a row each, with all waves. Every rank "
          "sums "
          "over its own particles.",
      .source = "Hansen, McDonald, Theory of Simple Liquids, 4th ed., sections 4.1 and 10.2",
      .in_2d = maker<StructureFactor, 2>(complete_sk<2>),
      .in_3d = maker<StructureFactor, 3>(complete_sk<3>)};
}

}  // namespace carom::observable
