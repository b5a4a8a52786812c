// SPDX-License-Identifier: BSD-3-Clause
// Random small systems over many orders of magnitude: sums of forces, energies and virials agree with simple loops, or
// an error names a pair that causes it. CAROM_FUZZ_SYSTEMS sets the number of systems of the slow test.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <regex>

#include "engine/base/error.h"
#include "engine/forces/forces.h"
#include "engine/forces/simd/pair_kernels.h"
#include "tests/unit/potentials/random_laws.h"

namespace carom::pair_fuzz_test {
namespace {

using test::Dice;
using test::Law;
using test::Real;
using test::Sized;

/// Positions or their changes: some near or at another one, some far away.
template <int D>
std::vector<Vec<D>> random_positions(Dice& dice, std::size_t particles, double edge, bool periodic) {
  std::vector<Vec<D>> x;
  const auto direction = [&] {
    Vec<D> u;
    for (int k = 0; k < D; ++k) u[k] = dice.uniform(-1, 1);
    return u;
  };
  while (x.size() < particles) {
    Vec<D> at = 0.5 * edge * (Vec<D>::Ones() + direction());
    if (!x.empty() && dice.one_in(3)) at = x[dice.below(x.size())] + edge * dice.decades(-15, -1) * direction();
    if (!x.empty() && dice.one_in(100)) at = x[dice.below(x.size())];
    if (!periodic && dice.one_in(30)) at += edge * dice.decades(0, 6) * direction();
    for (int k = 0; periodic && k < D; ++k) at[k] = std::clamp(at[k], 0.0, std::nextafter(edge, 0.0));
    x.push_back(at);
  }
  return x;
}

/// Sums of simple loops over pairs and images.
template <int D>
struct Expected {
  struct Force {
    std::array<Real, D> v{}, error{};
  };
  std::vector<Force> forces, mean_forces;
  struct Sum {
    Real v = 0, error = 0;
  } energy, magnitude, virial;
  struct Pair {
    Id i, j;
    Real share;  // its force or energy / the largest possible sum
  };
  std::vector<Pair> pairs;     // pairs with forces or energies
  Real largest = 0;            // the largest share
  Real largest_own = 0;        // the largest energy or virial of a particle and its own image
  Real largest_mean = 0;       // the largest share of mean forces
  bool bond_too_long = false;  // for a periodic box
  static constexpr Real kUnit = 256 * std::numeric_limits<double>::epsilon();

  explicit Expected(std::size_t particles) : forces(particles), mean_forces(particles) {}

  void add(const Law& law, const System<D>& system, std::span<const Vec<D>> x_new) {
    const auto& p = system.particles;
    const Box<D>& box = system.box;
    const int images = box.periodic(0) && std::isfinite(law.cutoff2)
                           ? static_cast<int>(std::ceil(std::sqrt(law.cutoff2) / box.edges[0])) + 1
                           : 0;
    const auto visit = [&](Id i, Id j, const Image<D>& image) {
      const Vec<D> shift = box.shift(image), d = p.x[i] - p.x[j] + shift, d_new = x_new[i] - x_new[j] + shift;
      const double rho = squared(d), rho_new = squared(d_new);
      const double w = law.weight == Law::one      ? 1
                       : law.weight == Law::masses ? p.mass[i] * p.mass[j]
                                                   : p.charge[i] * p.charge[j];
      if (w == 0 || !(rho < law.cutoff2 || rho_new < law.cutoff2)) return;
      const Quanta quanta = system.quanta;
      if (rho < law.cutoff2) {
        const Sized slope = Sized(-2 * Real(w)) * law.slope(rho), value = Sized(w) * law.value(rho);
        const Real share = std::max({force(forces, i, j, slope, d, {}, quanta.force), sum(energy, value, quanta.energy),
                                     sum(virial, slope * Sized(rho), 64 * quanta.energy)});
        sum(magnitude, {std::abs(value.v), value.size}, quanta.energy);
        pairs.push_back({i, j, share});
        largest = std::max(largest, share);
      }
      const Real share = force(mean_forces, i, j, Sized(-w) * law.quotient(rho, rho_new), d, d_new, quanta.force);
      largest_mean = std::max(largest_mean, share);
    };
    if (!law.bonds.empty()) {
      for (const auto& [i, j] : law.bonds) {
        const Vec<D> d = p.x[i] - p.x[j];
        const Image<D> image = box.nearest_image(d);
        for (int k = 0; k < D; ++k)
          if (box.periodic(k) && std::abs(d[k] + box.shift(image)[k]) > 0.48 * box.edges[k]) bond_too_long = true;
        visit(i, j, image);
      }
      return;
    }
    const int side = 2 * images + 1;
    const auto own = [&](Id i, const Image<D>& image) {
      const double rho = squared(box.shift(image));
      const double w = law.weight == Law::one ? 1 : law.weight == Law::masses ? p.mass[i] : p.charge[i];
      if (w == 0 || image == Image<D>{} || !(rho < law.cutoff2)) return;
      const Sized slope = Sized(-w * w) * law.slope(rho), value = Sized(0.5 * w * w) * law.value(rho);  // of ±d
      sum(energy, value, 0);
      sum(virial, slope * Sized(rho), 0);
      sum(magnitude, {std::abs(value.v), value.size}, 0);
      largest_own = std::max({largest_own, std::abs(value.v), std::abs(slope.v) * rho});
    };
    for (Id i = 0; i < p.size(); ++i)
      for (Id j = i; j < p.size(); ++j)
        for (int n = 0; n < (D == 3 ? side * side * side : side * side); ++n) {
          Image<D> image;
          for (int k = 0, rest = n; k < D; ++k, rest /= side) image[k] = rest % side - images;
          i == j ? own(i, image) : visit(i, j, image);
        }
  }

 private:
  static double squared(const Vec<D>& d) { return d[0] * d[0] + d[1] * d[1] + (D == 3 ? d[D - 1] * d[D - 1] : 0); }

  static Real force(std::vector<Force>& to, Id i, Id j, const Sized& g, const Vec<D>& d, const std::optional<Vec<D>>& e,
                    double quantum) {
    Real size = 0;
    for (int k = 0; k < D; ++k) {
      const Real way = e ? d[k] + (*e)[k] : d[k], f = g.v * way;
      const Real error = kUnit * g.size * std::abs(way) + quantum;
      to[i].v[k] += f, to[j].v[k] -= f;
      to[i].error[k] += error, to[j].error[k] += error;
      size += std::abs(f);
    }
    return size >= 0 ? size / (0x1p86L * quantum) : std::numeric_limits<Real>::infinity();
  }
  static Real sum(Sum& to, const Sized& value, double quantum) {
    to.v += value.v;
    to.error += kUnit * value.size + quantum;
    const Real share = std::abs(value.v) / (0x1p90L * quantum);
    return share >= 0 ? share : std::numeric_limits<Real>::infinity();
  }
};

struct Tally {
  std::uint64_t held = 0, refused = 0, invalid = 0, unmade = 0;
  double worst = 0;
};

/// The error as a multiple of the allowed error; infinite for NaN. A thousand terms that are no normal doubles may be
/// lost.
Real excess(double value, Real expected, Real error) {
  if (value == expected) return 0;
  const Real off = std::abs(value - expected) / (error + 1000 * Real{std::numeric_limits<double>::min()});
  return off >= 0 ? off : std::numeric_limits<Real>::infinity();
}

template <int D>
void expect_forces(const std::vector<Vec<D>>& f, const std::vector<typename Expected<D>::Force>& expected,
                   Tally& tally) {
  for (Id i = 0; i < f.size(); ++i)
    for (int k = 0; k < D; ++k) {
      const Real off = excess(f[i][k], expected[i].v[k], expected[i].error[k]);
      tally.worst = std::max(tally.worst, static_cast<double>(off));
      ASSERT_LE(off, 1) << "particle " << i << " error " << expected[i].error[k] << ": " << f[i][k] << ", not "
                        << expected[i].v[k];
    }
}

/// An error must name, by ids, a pair with a force or energy that is too large, and give advice.
template <int D>
void expect_reason(const Error& error, const Expected<D>& expected, const Particles<D>& p) {
  EXPECT_EQ(error.failure(), Failure::numerical);
  const std::string message = error.what();
  std::smatch named;
  if (expected.bond_too_long && message.find("spans nearly half the periodic box") != std::string::npos) {
    EXPECT_TRUE(std::regex_search(message, named, std::regex("particles (\\d+) and (\\d+).*use a larger box")))
        << message;
    return;
  }
  if (message.find("its own image") != std::string::npos) {
    EXPECT_TRUE(std::regex_search(message, std::regex("particle \\d+ and its own image, .* apart.*use a larger box")));
    EXPECT_GT(expected.largest_own, 1e300L) << message;
    return;
  }
  ASSERT_TRUE(std::regex_search(
      message, named, std::regex("between particles (\\d+) and (\\d+), .* apart, .*use a smaller integrator.step")))
      << message;
  Real share = 0;
  for (const auto& pair : expected.pairs)
    if (std::to_string(p.id_of(pair.i)) == named[1] && std::to_string(p.id_of(pair.j)) == named[2])
      share = std::max(share, pair.share);
  EXPECT_GT(share, 0.1) << message;
}

template <int D>
void try_system(Dice& dice, Tally& tally) {
  const bool periodic = dice.one_in(2);
  const double edge = dice.decades(-3, 4);
  const std::size_t n = 2 + dice.below(dice.one_in(10) ? 20 : 6);
  auto system =
      test::make_system<D>(Vec<D>::Constant(edge), periodic ? Boundary::periodic : Boundary::wall,
                           random_positions<D>(dice, n, edge, periodic), std::vector<Vec<D>>(n, Vec<D>::Zero()));
  Particles<D>& p = system->particles;
  const double unit = dice.decades(-4, 4), spread = dice.one_in(2) ? 6 : 0.5;
  for (Id i = 0; i < n; ++i) {
    p.radius[i] = edge * dice.decades(-4, -1);
    p.mass[i] = unit * dice.decades(-spread, 0);
    p.charge[i] = dice.one_in(8) ? 0 : (dice.one_in(2) ? unit : -unit) * dice.decades(-spread, 0);
  }
  std::vector<Law> laws;
  std::string description = std::to_string(D) + "-D, " + (periodic ? "periodic" : "walled");
  const auto widths = available_kernels<PairKernels>();
  do {
    laws.push_back(random_law(dice, n, edge, periodic));
    description += ", " + laws.back().type;
    test::add_interaction(*system, laws.back().type, laws.back().given);
    system->interactions.back()->use(*widths[dice.below(widths.size())]);
  } while (dice.one_in(3));
  SCOPED_TRACE(description);
  for (Id i = 0; i < n; ++i) p.id.push_back(3 * i + 5);  // as on several ranks
  system->quanta = quanta(*system);

  auto x_new = p.x;
  const double way = dice.one_in(5) ? 0 : edge * dice.decades(-15, -0.5);
  for (auto& x : x_new)
    if (!dice.one_in(4))
      for (int k = 0; k < D; ++k) x[k] += way * dice.uniform(-1, 1);
  Expected<D> expected(n);
  for (const Law& law : laws) expected.add(law, *system, x_new);

  std::vector<Vec<D>> f(n);
  Counters counters;
  PotentialSums sums;
  try {
    evaluate_forces<D>(*system, p.x, f, counters, &sums);
    ++tally.held;
    EXPECT_LT(expected.largest, 2);
    expect_forces<D>(f, expected.forces, tally);
    EXPECT_LE(excess(sums.energy.value(), expected.energy.v, expected.energy.error), 1);
    EXPECT_LE(excess(sums.magnitude.value(), expected.magnitude.v, expected.magnitude.error), 1);
    EXPECT_LE(excess(sums.virial.value(), expected.virial.v, expected.virial.error), 1)
        << sums.virial.value() << " " << expected.virial.v << " " << expected.virial.error;
    EXPECT_EQ(evaluate_energy<D>(*system, p.x).energy.value(), sums.energy.value());
  } catch (const Error& error) {
    ++tally.refused;
    expect_reason<D>(error, expected, p);
  }
  if (expected.bond_too_long) return;
  MeanForces<D> mean;
  const auto values = [&] {
    for (Id i = 0; i < n; ++i) f[i] = mean[i];
  };
  mean.evaluate(*system, p.x, x_new);
  values();
  if (std::isnan(f[0][0])) {
    ++tally.invalid;
    EXPECT_GT(expected.largest_mean, 0.1);
    return;
  }
  EXPECT_LT(expected.largest_mean, 2);
  expect_forces<D>(f, expected.mean_forces, tally);
  // Moves some particles and moves them back.
  auto other = x_new;
  std::vector<char> changed(n);
  for (Id i = 0; i < n; ++i)
    if (dice.one_in(3)) changed[i] = 1, other[i] += Vec<D>::Constant(way * dice.uniform(-1, 1));
  const auto before = f;
  mean.update(*system, p.x, x_new, other, changed.data());
  mean.update(*system, p.x, other, x_new, changed.data());
  values();
  EXPECT_TRUE(f == before || std::isnan(f[0][0]));
}

void try_systems(std::uint64_t count, std::uint64_t seed) {
  Tally tally;
  for (std::uint64_t n = 0; n < count && !testing::Test::HasFailure(); ++n) {
    SCOPED_TRACE("system " + std::to_string(n) + " of seed " + std::to_string(seed));
    Dice dice{std::mt19937_64(seed * 1000000007 + n)};
    dice.one_in(2) ? try_system<2>(dice, tally) : try_system<3>(dice, tally);
  }
  std::printf(
      "    %g systems held, %g refused, %g with mean forces that do not fit; largest error %.3g of what is allowed\n",
      static_cast<double>(tally.held), static_cast<double>(tally.refused), static_cast<double>(tally.invalid),
      tally.worst);
  if (testing::Test::HasFailure()) return;
  EXPECT_GT(tally.held, count / 4);
  EXPECT_GT(tally.refused, count / 50);
}

TEST(PairFuzz, SumsAreThoseOfPlainLoopsOrTheErrorNamesThePair) { try_systems(4000, 1); }

TEST(PairFuzzSlow, SumsAreThoseOfPlainLoopsOrTheErrorNamesThePair) {
  const char* const given = std::getenv("CAROM_FUZZ_SYSTEMS");
  try_systems(given ? static_cast<std::uint64_t>(std::stod(given)) : 1000000, 2);
}

}  // namespace
}  // namespace carom::pair_fuzz_test
