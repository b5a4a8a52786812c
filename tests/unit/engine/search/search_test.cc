// SPDX-License-Identifier: BSD-3-Clause
// The search never changes a result: equal bits for any method, skin, cells, bins, sorting and vector width.

#include <gtest/gtest.h>

#include <cstdlib>

#include "engine/base/error.h"
#include "engine/events/contact.h"
#include "engine/events/event_core.h"
#include "engine/search/simd/scan_kernel.h"
#include "tests/unit/engine/events/event_cases.h"

namespace carom::search_test {
namespace {

/// Sets an environment variable during its lifetime.
class Environment {
 public:
  Environment(const char* name, const char* value) : name_(name) {
    if (value) setenv(name, value, 1);
  }
  ~Environment() { unsetenv(name_); }

 private:
  const char* name_;
};

template <int D>
Outcome<D> run(const Case<D>& c, const SearchOptions& options, const char* simd = nullptr) {
  const Environment environment("CAROM_SIMD", simd);
  Outcome<D> trace;
  trace.particles = c.system->particles;
  Particles<D>& p = trace.particles;
  EventCore<D> core(c.system->box, options);
  Counters counters;
  for (int k = 0; k < c.slabs; ++k) {
    core.load(p, c.g, c.slab, c.growth);
    core.run(c.slab, {.counters = counters, .contacts = &trace.contacts});
    core.copy_at(c.slab, p);
    for (std::size_t i = 0; i < p.size(); ++i) c.system->box.wrap(p.x[i], p.image[i]);
    for (double& r : p.radius) r *= 1 + c.growth * c.slab;
  }
  EXPECT_LT(counters.max_overlap, 1e-12);
  return trace;
}

using Method = SearchOptions::Method;

template <int D>
void expect_the_same_whatever_the_search(const Case<D>& c, std::size_t at_least) {
  const auto reference = run(c, {.method = Method::cells});
  ASSERT_GE(reference.contacts.size(), at_least);
  for (std::size_t k = 1; k < reference.contacts.size(); ++k) {
    if (reference.contacts[k].key.time > reference.contacts[k - 1].key.time) continue;
    if (reference.contacts[k].key.time < reference.contacts[k - 1].key.time) continue;  // in the next slab
    EXPECT_LT(reference.contacts[k - 1].key, reference.contacts[k].key);
  }
  expect_same(reference, run(c, {}), "automatic");
  for (const double cell : {1.3, 2.1}) expect_same(reference, run(c, {.method = Method::cells, .cell = cell}), "cells");
  for (const double skin : {0.03, 0.11, 0.3, 0.6})
    expect_same(reference, run(c, {.method = Method::lists, .skin = skin}), "skin " + std::to_string(skin));
  for (const double bin : {1.0, 7.0, 5000.0})
    expect_same(reference, run(c, {.entries_per_bin = bin}), "bin " + std::to_string(bin));
  for (const double sort : {0.0, 0.7, 1e9})
    for (const Method method : {Method::lists, Method::cells})
      expect_same(reference, run(c, {.method = method, .sort_interval = sort}), "sort " + std::to_string(sort));
  for (const Method method : {Method::lists, Method::cells})
    expect_same(reference, run(c, {.method = method, .in_cache = 0}), "as if there were no cache");
  for (const std::size_t width : vector_widths()) {
    const char* const simd = kVectorWidths[width].name;
    expect_same(reference, run(c, {.method = Method::lists}, simd), simd);
    expect_same(reference, run(c, {.method = Method::cells}, simd), simd);
  }
}

TEST(Search, DenseFluid) {
  expect_the_same_whatever_the_search<3>({.system = test::hard_spheres<3>(5, 0.49), .slab = 0.4}, 5000);
  expect_the_same_whatever_the_search<2>({.system = test::hard_spheres<2>(14, 0.69), .slab = 0.4}, 1000);
}

TEST(Search, Crystal) {
  expect_the_same_whatever_the_search<3>({.system = test::hard_spheres<3>(4, 0.7), .slab = 0.05}, 3000);
  expect_the_same_whatever_the_search<2>({.system = test::hard_spheres<2>(8, 0.8), .slab = 0.1}, 500);
}

TEST(Search, DiluteGas) {
  expect_the_same_whatever_the_search<3>({.system = test::hard_spheres<3>(5, 0.1), .slab = 3}, 1500);
  expect_the_same_whatever_the_search<3>({.system = test::hard_spheres<3>(4, 0.001), .slab = 120}, 200);
  expect_the_same_whatever_the_search<2>({.system = test::hard_spheres<2>(8, 0.02), .slab = 50}, 200);
}

TEST(Search, ManySizes) {
  expect_the_same_whatever_the_search<3>(
      {.system = random_system<3>(300, {7, 7, 7}, {P, P, P}, 0.1, 1.0, 3), .slab = 0.05}, 1000);
  expect_the_same_whatever_the_search<2>({.system = random_system<2>(120, {21, 21}, {P, W}, 0.15, 1.5, 4), .slab = 0.3},
                                         300);
}

TEST(Search, Walls) {
  expect_the_same_whatever_the_search<3>(
      {.system = random_system<3>(150, {7, 6, 6}, {W, P, W}, 0.5, 0.5, 5), .slab = 1}, 1000);
  expect_the_same_whatever_the_search<2>({.system = random_system<2>(40, {9.5, 9}, {W, W}, 0.5, 0.5, 6), .slab = 2},
                                         300);
}

TEST(Search, Field) {
  expect_the_same_whatever_the_search<3>(
      {.system = random_system<3>(150, {6, 6, 9}, {P, P, W}, 0.5, 0.5, 7), .g = {0.1, 0, -1}, .slab = 1}, 1000);
  expect_the_same_whatever_the_search<2>(
      {.system = random_system<2>(40, {7, 12}, {W, W}, 0.3, 0.5, 8), .g = {0, -0.5}, .slab = 1}, 200);
}

TEST(Search, OpenSpace) {  // they fly apart, some meet
  expect_the_same_whatever_the_search<3>(
      {.system = random_system<3>(200, {8, 8, 8}, {O, O, P}, 0.5, 0.5, 9), .slab = 4, .slabs = 4}, 150);
}

TEST(Search, TinyPeriodicBoxes) {  // a sphere meets its neighbour through several images and crosses many boxes
  expect_the_same_whatever_the_search<3>(
      {.system = random_system<3>(3, {1.7, 1.9, 2.1}, {P, P, P}, 0.4, 0.4, 10), .slab = 5}, 50);
  expect_the_same_whatever_the_search<2>({.system = random_system<2>(2, {2.2, 2.6}, {P, P}, 0.5, 0.5, 11), .slab = 20},
                                         30);
}

TEST(Search, GrowingSpheres) {
  expect_the_same_whatever_the_search<3>(
      {.system = random_system<3>(200, {7, 7, 7}, {P, P, P}, 0.4, 0.4, 12), .growth = 0.05, .slab = 0.5}, 500);
  expect_the_same_whatever_the_search<2>(
      {.system = random_system<2>(60, {9, 9}, {W, P}, 0.2, 0.4, 13), .growth = 0.1, .slab = 0.5}, 100);
}

/// Spheres up to several sizes in cells, larger ones beside them.
template <int D>
void expect_the_same_beside_cells(const Case<D>& c, std::size_t at_least) {
  const auto reference = run(c, {.method = Method::lists});
  ASSERT_GE(reference.contacts.size(), at_least);
  const auto& radius = c.system->particles.radius;
  const auto [least, most] = std::ranges::minmax(radius);
  for (const double share : {-1.0, 0.0, 0.2, 0.6, 0.95})
    for (const double skin : {0.03, 0.3, 1.5}) {
      const double small = least + share * (most - least);
      const SearchOptions options{
          .method = Method::small_cells, .skin = skin * most, .cell = 0.5 * most, .small = small};
      expect_same(reference, run(c, options),
                  "up to " + std::to_string(small) + ", skin " + std::to_string(skin * most));
    }
}

TEST(Search, LargeSpheresBesideCells) {
  expect_the_same_beside_cells<3>({.system = random_system<3>(300, {7, 7, 7}, {P, P, P}, 0.1, 1.0, 3), .slab = 0.05},
                                  1000);
  expect_the_same_beside_cells<2>({.system = random_system<2>(120, {21, 21}, {P, W}, 0.15, 1.5, 4), .slab = 0.3}, 300);
  expect_the_same_beside_cells<3>(
      {.system = random_system<3>(150, {8, 7, 9}, {P, O, W}, 0.2, 0.7, 7), .g = {0.1, 0, -1}, .slab = 1, .slabs = 3},
      300);
  expect_the_same_beside_cells<3>({.system = random_system<3>(5, {2.3, 2.1, 2.5}, {P, P, P}, 0.1, 0.5, 10), .slab = 5},
                                  50);
  expect_the_same_beside_cells<2>(
      {.system = random_system<2>(60, {9, 9}, {W, P}, 0.1, 0.4, 13), .growth = 0.1, .slab = 0.5, .slabs = 3}, 100);
}

Case<3> lattice() {  // with speeds of 1: whole layers collide at one instant
  std::vector<Vec<3>> x, v;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      for (int k = 0; k < 6; ++k) {
        x.push_back({1.5 * i + 0.75, 1.5 * j + 0.75, 1.5 * k + 0.75});
        v.push_back({i % 2 == 0 ? 1.0 : -1.0, j % 2 == 0 ? 1.0 : -1.0, 0.0});
      }
  return {.system = test::make_system<3>({9, 9, 9}, P, x, v), .slab = 2};
}

TEST(Search, ExactTies) { expect_the_same_whatever_the_search<3>(lattice(), 400); }

/// Runs with a well, a shoulder and several steps, of which one is too far out for a block of candidates. The reference
/// has each as two equal lists, with which EventSearch tries the candidates one by one. `known`: the kernels know them
/// as one list.
template <int D, class Make>
void expect_the_same_with_steps(Make&& make, bool known = true) {
  const std::vector<std::vector<StepSurface>> all = {
      {{.range = 1.5, .climb = 1}},
      {{.range = 1.3, .climb = -0.7}},
      {{.range = 1.2, .climb = -0.3}, {.range = 1.6, .climb = 0.8}, {.range = 2.7, .climb = 0.1}}};
  for (const auto& surfaces : all) {
    const auto with_steps = [&](bool one_list) {
      Case<D> c = make();
      Steps& steps = c.system->box.steps;
      steps.resize(2);
      const std::uint32_t list = steps.add({surfaces});
      for (const std::size_t other : {0, 1}) steps.set_pair(0, other, list);
      steps.set_pair(1, 1, one_list ? list : steps.add({surfaces}));
      Flights<D> flights(c.system->box);
      flights.load({}, Sizes(c.system->particles), c.g, 1);
      EXPECT_EQ(flights.setting().surfaces != nullptr, one_list && known);
      return c;
    };
    const auto reference = run(with_steps(false), {.method = Method::lists});
    EXPECT_GT(reference.contacts.size(), 100) << surfaces.front().range;
    const Case<D> c = with_steps(true);
    for (const std::size_t width : vector_widths())
      for (const Method method : {Method::lists, Method::cells}) {
        const char* const simd = kVectorWidths[width].name;
        expect_same(reference, run(c, {.method = method}, simd), simd);
      }
  }
}

template <int D>
auto fluid_of(int cells, double filled, double slab) {
  return [=] { return Case<D>{.system = test::hard_spheres<D>(cells, filled), .slab = slab, .slabs = 2}; };
}

TEST(Search, Steps) {
  expect_the_same_with_steps<3>(fluid_of<3>(4, 0.45, 0.05));
  expect_the_same_with_steps<3>(fluid_of<3>(4, 0.05, 0.6));
  expect_the_same_with_steps<2>(fluid_of<2>(10, 0.6, 0.1));
  expect_the_same_with_steps<2>(fluid_of<2>(10, 0.05, 1.5));
  expect_the_same_with_steps<3>(lattice);
  for (const double smallest : {0.4, 0.5}) {  // spheres of several sizes, or in a field
    const auto make = [&] {
      return Case<3>{.system = random_system<3>(150, {7, 7, 7}, {P, P, P}, smallest, 0.5, 14),
                     .g = Vec<3>(0, 0, smallest == 0.5 ? -1 : 0),
                     .slab = 0.3,
                     .slabs = 2};
    };
    expect_the_same_with_steps<3>(make, false);
  }
}

TEST(Search, BlowsFromBothSides) {  // two touching spheres are hit at one instant, repeatedly
  std::vector<Vec<2>> x, v;
  for (int row = 0; row < 4; ++row)
    for (const double place : {2.0, 5.5, 6.5, 10.0}) {
      x.push_back({place, 2.0 * row});
      v.push_back({place == 2.0 ? 1.0 : place == 10.0 ? -1.0 : 0.0, 0.0});
    }
  const std::vector<double> radius(x.size(), 0.5), mass(x.size(), 1.0);
  expect_the_same_whatever_the_search<2>({.system = test::make_system<2>({12, 8}, P, x, v, radius, mass), .slab = 40},
                                         100);
}

/// Lists are used in dense fluids, and in mixtures whose cells, as large as the largest spheres, would hold many small
/// ones.
TEST(SearchTuning, TakesListsForDenseFluidsAndForMixtures) {
  const auto lists = [](const SearchSituation& situation, Method method = Method::automatic) {
    SearchTuning tuning({.method = method});
    tuning.choose(situation, {});
    return tuning.lists();
  };
  const auto fluid = [](int dimension, double filled, double largest) {
    const double sphere = dimension == 2 ? 0.785 : 0.524;
    return SearchSituation{dimension, filled / sphere, filled, 1, largest};
  };
  for (const auto& [dimension, filled, largest, expected] : {std::tuple{3, 0.2, 1.0, false},
                                                             {3, 0.4, 1.0, true},
                                                             {3, 0.2, 1.5, false},
                                                             {3, 0.2, 5.0, true},
                                                             {3, 0.02, 5.0, false},
                                                             {3, 0.05, 8.0, true},
                                                             {2, 0.4, 1.0, false},
                                                             {2, 0.6, 1.0, true},
                                                             {2, 0.4, 1.5, false},
                                                             {2, 0.4, 5.0, true}}) {
    EXPECT_EQ(lists(fluid(dimension, filled, largest)), expected) << dimension << ' ' << filled << ' ' << largest;
    EXPECT_TRUE(lists(fluid(dimension, filled, largest), Method::lists));
    EXPECT_FALSE(lists(fluid(dimension, filled, largest), Method::cells));
  }
}

/// Mixtures of two diameters, half of the volume each: few large spheres are beside the cells of small ones, unless all
/// are dense or nearly as large.
TEST(SearchTuning, PutsLargeSpheresBesideTheCellsOfSmallOnes) {
  const auto tuned = [](double ratio, double filled, bool classes = true) {
    const double large = 1 / (1 + std::pow(ratio, 3));
    SearchSituation mixture{3, filled / 2 / (1 - large) / 0.524, filled, 1 + large * (ratio - 1), ratio};
    if (classes) mixture.classes = {{large, ratio, ratio, std::pow(ratio, -3)}, {0}, {1 - large, 1, 1, 1}};
    SearchTuning tuning({});
    tuning.choose(mixture, {});
    return tuning;
  };
  for (const double filled : {0.005, 0.05, 0.2, 0.4}) {
    const SearchTuning ten = tuned(10, filled);
    EXPECT_FALSE(ten.lists()) << filled;
    EXPECT_NEAR(ten.small(), 0.5, 1e-6) << filled;
    EXPECT_GE(ten.cell(), 1) << filled;
    EXPECT_GT(ten.skin(), 0.1) << filled;
    EXPECT_EQ(tuned(2, filled).lists(), filled == 0.4) << filled;
  }
  EXPECT_TRUE(tuned(10, 0.52).lists());
  EXPECT_TRUE(tuned(10, 0.1, false).lists());
}

/// In a dilute gas most candidates are those of crossings, which are no sign of a crowded region.
TEST(SearchTuning, KeepsCellsInADiluteGasUnlessARegionIsCrowded) {
  const SearchSituation dilute{3, 0.002 / 0.524, 0.002, 1, 1};
  EventCounts counts{.predictions = 100000, .crossings = 3000000};
  for (const auto& [candidates_of_a_scan, lists] : {std::pair{20, false}, {60, true}}) {
    SearchTuning tuning({});
    tuning.choose(dilute, {});
    ASSERT_FALSE(tuning.lists());
    counts.candidates = static_cast<std::uint64_t>(candidates_of_a_scan) * (counts.predictions + counts.crossings / 3);
    tuning.choose(dilute, counts);
    EXPECT_EQ(tuning.lists(), lists) << candidates_of_a_scan;
    // A skin for the mean density would give spheres in the crowd long lists.
    EXPECT_TRUE(!lists || tuning.skin() < 0.5);
  }
}

/// In a dilute mixture a sphere flies far between two contacts, and its list stays short even with a large skin.
TEST(SearchTuning, TakesLargerSkinsInDiluteMixtures) {
  for (const auto& [filled, skin] : {std::pair{0.02, 2.1}, {0.05, 1.4}, {0.1, 1.0}, {0.4, 0.45}}) {
    const double density = filled / 2 / 0.524;  // half of the volume is that of few large spheres
    SearchTuning tuning({});
    tuning.choose({3, density, filled, 1, 10}, {});
    ASSERT_TRUE(tuning.lists());
    EXPECT_NEAR(tuning.skin(), skin, 0.1 * skin) << filled;
  }
}

/// The skin comes close to the cheapest one, whatever the exponents of candidates and renewals, and stays there.
TEST(SearchTuning, FindsTheCheapestSkin) {
  for (const auto& [candidates_exponent, rebuilds_exponent] : {std::pair{3.0, 1.5}, {1.9, 2.0}, {2.0, 5.0}})
    for (const double rate : {0.002, 0.01, 0.1}) {
      const auto candidates = [&](double skin) { return 6 * std::pow(1 + 2 * skin, candidates_exponent); };
      const auto rebuilds = [&](double skin) { return rate * std::pow(0.3 / skin, rebuilds_exponent); };
      const auto cost = [&](double skin) { return 400 + 32 * candidates(skin) + 4500 * rebuilds(skin); };
      SearchTuning tuning({});
      EventCounts counts;
      for (int epoch = 0; epoch < 12; ++epoch) {
        tuning.choose({3, 0.49 / 0.524, 0.49, 1, 1}, counts);
        counts.predictions += 1'000'000;
        counts.candidates += static_cast<std::uint64_t>(1e6 * candidates(tuning.skin()));
        counts.rebuilds += static_cast<std::uint64_t>(1e6 * rebuilds(tuning.skin()));
      }
      double least = cost(0.02);
      for (double skin = 0.02; skin < 0.8; skin += 0.001) least = std::min(least, cost(skin));
      EXPECT_LT(cost(tuning.skin()), 1.03 * least)
          << candidates_exponent << ' ' << rebuilds_exponent << ' ' << rate << ": " << tuning.skin();
    }
}

TEST(Search, AWidthThisMachineLacksIsAnError) {
  const Environment environment("CAROM_SIMD", "mmx");
  EXPECT_THROW(vector_widths(), Error);
}

/// One sphere and 30 others at random positions, some of them in other boxes.
template <int D>
struct Surroundings {
  explicit Surroundings(bool plain) : packing(31, 31), records(31), radius(31, 0.5) {
    RandomStream random(5, RandomPurpose::position, 0);
    for (auto& r : records) {
      for (int k = 0; k < D; ++k) r.x[k] = 6 * random.uniform() - 3, r.v[k] = 2 * random.uniform() - 1;
      r.t = random.uniform();
    }
    setting = {.records = reinterpret_cast<const double*>(records.data()),
               .diameter = 1,
               .slot_mask = packing.slot_mask,
               .slot_bits = packing.slot_bits,
               .field_bits = packing.field_bits,
               .plain = plain};
    for (int k = 0; k < D; ++k) setting.edges[k] = 7.3, setting.g[k] = plain ? 0 : 0.1 * k - 0.3;
    if (!plain) {
      for (auto& r : radius) r = 0.3 + 0.4 * random.uniform();
      setting.radius = radius.data();
      setting.growth = 0.2;
    }
    for (Slot j = 1; j < 31; ++j) {
      Image<D> image{};
      image[0] = static_cast<int>(j % 3) - 1;
      candidates.push_back(packing.pack(j, packing.linear(image)));
    }
    candidates.resize(32, packing.pack(0, 0));
  }
  Packing<D> packing;
  std::vector<Record<D>> records;
  std::vector<double> radius;
  ScanSetting setting;
  std::vector<std::uint32_t> candidates;
};

template <int D>
void expect_all_widths_agree(bool plain) {
  const Surroundings<D> s(plain);
  for (unsigned n = 0; n <= 30; ++n) {
    auto candidates = s.candidates;
    for (unsigned q = n; q < 32; ++q) candidates[q] = s.packing.pack(0, 0);
    // One by one, with the functions of contact.h.
    double first = kNever;
    std::uint32_t which = 0;
    for (unsigned q = 0; q < n; ++q) {
      const Slot j = s.packing.slot(candidates[q]);
      const Record<D>&a = s.records[0], &b = s.records[j];
      const double now = std::max(a.t, b.t), s_a = now - a.t, s_b = now - b.t;
      const Vec<D> g = Eigen::Map<const Vec<D>>(s.setting.g);
      Vec<D> d = (a.x + s_a * a.v) - (b.x + s_b * b.v), v = a.v - b.v;
      d += (0.5 * (s_a * s_a - s_b * s_b)) * g;
      v += (s_a - s_b) * g;
      d[0] += s.packing.image(candidates[q])[0] * 7.3;
      const double sum = s.setting.radius ? s.radius[0] + s.radius[j] : 1.0, growth = s.setting.growth;
      const double sigma = sum * (1 + growth * now);
      const double time = now + contact_time<D>(d, v, sigma, sum * growth, 0.0);
      if (time == now) {  // they overlap
        first = -kNever;
        break;
      }
      if (time < first) first = time, which = q;
    }
    const ScanTask task{0, candidates.data(), n, 0};
    std::vector<ScanResult> results = {scan<D, 2>(s.setting, task, false), scan<D, 4>(s.setting, task, false)};
    for (const ScanKernels* kernels : available_kernels<ScanKernels>())
      results.push_back(kernels->scan[D - 2](s.setting, task, false));
    for (const ScanResult& result : results) {
      EXPECT_EQ(result.time, first) << n;
      if (std::isfinite(first)) {
        EXPECT_EQ(result.which, which) << n;
        EXPECT_FALSE(result.tied) << n;
      }
    }
  }
}

TEST(Scan, AllWidthsGiveTheBitsOfThePureFunction) {
  expect_all_widths_agree<3>(true);
  expect_all_widths_agree<2>(true);
  expect_all_widths_agree<3>(false);
  expect_all_widths_agree<2>(false);
}

TEST(Scan, ReportsTies) {
  Surroundings<3> s(true);
  s.records[0].x = Vec<3>::Zero();
  s.records[0].v = Vec<3>::Zero();
  s.records[0].t = 0;
  for (Slot j = 1; j < 31; ++j) s.records[j] = {{50.0 + j, 0, 0}, Vec<3>::Zero(), 0, j, 0, 0};
  s.records[4] = {{3, 0, 0}, {-1, 0, 0}, 0, 4, 0, 0};
  s.records[11] = {{-3, 0, 0}, {1, 0, 0}, 0, 11, 0, 0};
  for (Slot j = 1; j < 31; ++j) s.candidates[j - 1] = s.packing.pack(j, 0);
  const ScanTask task{0, s.candidates.data(), 30, 30};
  for (const auto& result : {scan<3, 2>(s.setting, task, true), scan<3, 4>(s.setting, task, true)}) {
    EXPECT_EQ(result.time, 2.0);
    EXPECT_TRUE(result.tied);
  }
}

TEST(Scan, SeesAnOverlapHoweverSlowlyItGrows) {
  Surroundings<3> s(true);
  s.records[0] = {Vec<3>::Zero(), Vec<3>::Zero(), 0, 0, 0, 0};
  for (const double approach : {1e-3, 1e-6, 1e-9, 1e-12}) {  // far below the resolution of the discriminant
    s.records[1] = {{1 - 1e-16, 0, 0}, {-approach, 0.7, 0.3}, 0, 1, 0, 0};
    s.candidates.assign(8, s.packing.pack(0, 0));
    s.candidates[0] = s.packing.pack(1, 0);
    const ScanTask task{0, s.candidates.data(), 1, 1};
    for (const bool latest : {false, true})
      for (const auto& result : {scan<3, 2>(s.setting, task, latest), scan<3, 4>(s.setting, task, latest)})
        EXPECT_EQ(result.time, -kNever) << approach;
  }
}

TEST(Scan, LeavesPairsAtAStepOut) {
  Surroundings<3> s(true);
  const ScanSurface surfaces[] = {{1, 1, 1e-6}, {2, 4, 1e-6}};
  s.setting.surfaces = surfaces;
  s.setting.surface_count = 2;
  for (Slot j = 0; j < 31; ++j) {
    s.records[j] = {{30, 0, 0}, Vec<3>::Zero(), 0, j, 0, 0};
    if (j > 0) s.candidates[j - 1] = s.packing.pack(j, 0);
  }
  s.records[0].x = Vec<3>::Zero();
  const auto expect = [&](std::uint64_t near, double time, unsigned which) {
    const ScanTask task{0, s.candidates.data(), 30, 30};
    for (const StepScan& found : {scan_steps<3, 2>(s.setting, task), scan_steps<3, 4>(s.setting, task)}) {
      EXPECT_EQ(found.near, near);
      EXPECT_EQ(found.first.time, time);
      EXPECT_TRUE(found.first.which == which || !std::isfinite(time)) << found.first.which;
    }
  };
  expect(0, kNever, 0);
  s.records[11] = {{3, 0, 0}, {-1, 0, 0}, 0, 11, 0, 0};
  expect(0, 1, 10);
  s.records[21] = {{1.5, 0, 0}, {4, 0, 0}, 0, 21, 0, 0};
  expect(0, 0.125, 20);
  for (const double at : {1 - 1e-8, 1 + 1e-8, 2 - 1e-8, 2 + 1e-8, 0.7}) {
    s.records[21].x[0] = at;
    expect(1 << 20, 1, 10);
  }
  s.records[30].x[0] = 2;
  expect(1 << 20 | 1 << 29, 1, 10);
}

/// Random spheres in cells, with walls across the second axis.
template <int D>
void expect_first_faces() {
  constexpr std::int32_t kCount = 5;
  const double infinity = kNever;
  const CellFaces faces{.origin = {-1, 0, 2},
                        .edge = {1.1, 1.3, 1.7},
                        .lowest = {-infinity, 0, D == 3 ? -infinity : 0},
                        .highest = {infinity, kCount, D == 3 ? infinity : 0}};
  RandomStream random(5, RandomPurpose::position, 1);
  for (int trial = 0; trial < 1000; ++trial) {
    Record<D> r{};
    CellPlace<D> place{};
    double first = kNever;
    unsigned face = 0;
    for (int k = 0; k < D; ++k) {
      const double inside = trial % 7 == k ? 0 : random.uniform();  // on a face, too
      const std::int32_t cell = static_cast<std::int32_t>(random.uniform() * kCount) - (k == 1 ? 0 : kCount / 2);
      place.unwrapped[k] = cell;
      r.x[k] = faces.origin[k] + (cell + inside) * faces.edge[k];
      r.v[k] = trial % 5 == k ? 0 : random.uniform() - 0.5;
      const unsigned up = r.v[k] < 0 ? 0 : 1;
      const std::int32_t number = cell + static_cast<std::int32_t>(up);
      if (k == 1 && (number == 0 || number == kCount)) continue;
      const double after = std::abs((faces.origin[k] + number * faces.edge[k] - r.x[k]) / r.v[k]);
      if (after < first) first = after, face = 2 * static_cast<unsigned>(k) + up;
    }
    const Crossing found = crossing<D>(faces, reinterpret_cast<const double*>(&r), place.unwrapped);
    const Crossing widest =
        widest_kernels<ScanKernels>().crossing[D - 2](faces, reinterpret_cast<const double*>(&r), place.unwrapped);
    EXPECT_EQ(found.after, first) << trial;
    EXPECT_EQ(widest.after, first) << trial;
    if (first == kNever) continue;
    EXPECT_EQ(found.face, face) << trial;
    EXPECT_EQ(widest.face, face) << trial;
  }
}

TEST(Scan, FindsTheFaceThroughWhichASphereLeavesItsCell) {
  expect_first_faces<3>();
  expect_first_faces<2>();
}

/// Expects that all images up to the farthest are restored; returns the farthest.
template <int D>
std::int32_t room_for_images(std::size_t slots, std::size_t particles) {
  const Packing<D> packing(slots, particles);
  for (const int sign : {-1, 1}) {
    Image<D> farthest{};
    farthest[0] = sign * packing.largest(), farthest[1] = -farthest[0];
    EXPECT_EQ(packing.image(packing.pack(5, packing.linear(farthest))), farthest) << slots;
  }
  return packing.largest();
}

TEST(Packing, HasTheSameRoomForImagesInTheCoresOfAnyNumberOfRanks) {
  for (const std::size_t particles : {64, 1000, 50000, 1000000})
    for (const std::size_t slots : {records_room(particles), particles / 7})
      EXPECT_EQ(room_for_images<3>(slots, particles), room_for_images<3>(particles, particles)) << slots;
  room_for_images<2>(std::size_t{1} << 25, std::size_t{1} << 25);  // more than ranks would have
}

TEST(Scan, FindsTheFirstOfMoreThanABlockOfCandidates) {
  Surroundings<3> s(true);
  s.records.resize(200);
  s.packing = Packing<3>(200, 200);
  s.setting.records = reinterpret_cast<const double*>(s.records.data());
  s.setting.slot_mask = s.packing.slot_mask;
  s.setting.slot_bits = s.packing.slot_bits;
  s.setting.field_bits = s.packing.field_bits;
  s.records[0] = {Vec<3>::Zero(), Vec<3>::Zero(), 0, 0, 0, 0};
  s.candidates.assign(200, s.packing.pack(0, 0));
  for (Slot j = 1; j < 200; ++j) {
    s.records[j] = {{5.0 + j, 0, 0}, {-1, 0, 0}, 0, j, 0, 0};
    s.candidates[j - 1] = s.packing.pack(j, 0);
  }
  for (const unsigned first : {3u, 63u, 64u, 130u, 199u}) {
    auto records = s.records;
    records[first].x[0] = 3;
    s.setting.records = reinterpret_cast<const double*>(records.data());
    const ScanTask task{0, s.candidates.data(), 199, 199};
    for (const auto& result : {scan<3, 2>(s.setting, task, false), scan<3, 4>(s.setting, task, true)}) {
      EXPECT_EQ(result.time, 2.0);
      EXPECT_EQ(result.which, first - 1);
      EXPECT_FALSE(result.tied);
    }
    records[first % 7 + 70].x[0] = 3;  // in another block or in the same block
    for (const auto& result : {scan<3, 2>(s.setting, task, true), scan<3, 4>(s.setting, task, false)})
      EXPECT_TRUE(result.tied);
  }
}

}  // namespace
}  // namespace carom::search_test
