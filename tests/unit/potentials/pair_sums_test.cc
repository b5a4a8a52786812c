// SPDX-License-Identifier: BSD-3-Clause
// Sums over pairs have equal bits for any kernel and any order.

#include <algorithm>
#include <cstdlib>
#include <map>
#include <numeric>
#include <random>

#include "engine/forces/pair_list.h"
#include "engine/forces/potentials/cut.h"
#include "engine/forces/potentials/inverse_distance.h"
#include "engine/forces/potentials/lennard_jones.h"
#include "engine/forces/potentials/options.h"
#include "engine/forces/potentials/yukawa.h"
#include "engine/forces/simd/pair_kernels.h"
#include "tests/unit/potentials/cases.h"
#include "tests/unit/potentials/plain_sums.h"

namespace carom::pair_sums_test {
namespace {

using namespace std::string_literals;
using test::cut_lennard_jones;
using test::expect_reference;
using test::kQuantum;
using test::Options;
using test::Outcome;
using test::outcome;
using test::quanta;
using test::Quanta;
using test::Reference;
using test::Scene;

/// The vector widths of this machine.
std::vector<std::string> widths() {
  std::vector<std::string> found;
  for (const PairKernels* kernels : available_kernels<PairKernels>()) found.emplace_back(kernels->name);
  return found;
}

template <int D>
void expect_the_same_in_all_widths() {
  std::vector<Outcome<D>> first;
  for (const std::string& width : widths()) {
    SCOPED_TRACE(width);
    setenv("CAROM_SIMD", width.c_str(), 1);
    std::size_t number = 0;
    test::for_each_case<D>([&](Scene<D>& scene, const Interaction<D>& term) {
      const auto x_new = test::displaced(scene.particles.x, scene.random_vectors(0.1), 1);
      const Outcome<D> result = outcome(term, scene.particles.x, x_new);
      if (number == first.size()) first.push_back(result);
      EXPECT_TRUE(result == first[number++]);
    });
  }
  unsetenv("CAROM_SIMD");
}

TEST(PairSums, AreTheSameInEveryVectorWidth) {
  expect_the_same_in_all_widths<2>();
  expect_the_same_in_all_widths<3>();
}

/// Kernels read up to eight partners beyond the end of a run: these must be valid indices, even after a list of more
/// particles.
TEST(CutoffList, HasPlacesBehindTheLastPartnerToo) {
  for (const PairKernels* kernels : available_kernels<PairKernels>()) {
    SCOPED_TRACE(kernels->name);
    Box<2> box;
    box.edges = {10, 10};
    CutoffList<2> list(box, 2.0, {});
    list.use(*kernels);
    for (const std::size_t n : {60, 30, 12, 7, 5, 4, 3, 2}) {
      Particles<2> p;
      for (std::size_t i = 0; i < n; ++i)
        p.x.emplace_back(5 + 0.1 * static_cast<double>(i % 8), 5 + 0.1 * static_cast<double>(i / 8));
      const PairRecords<2>& records = list.cover({.x = p.x}, p);
      std::size_t pairs = 0;
      for (int kind = 0; kind < PairRecords<2>::kKinds; ++kind)
        for (const PairRun& run : records.runs[kind]) {
          pairs += run.count;
          for (std::size_t k = 0; k < run.count + 8u; ++k)
            ASSERT_LT(records.partners[kind].at(run.begin + k), n) << k << " of " << run.count << ", of " << n;
        }
      EXPECT_GE(pairs, n - 1);
    }
  }
}

/// Own particles come first; pairs of ghosts are not listed, and those of an own particle and a ghost on one of the two
/// ranks: about half of them on each if ids decide, or all on rank 0. `apart`: only pairs of two species are listed.
void expect_each_pair_once_on_two_ranks(bool by_ids, bool apart) {
  constexpr double kCutoff = 1.5;
  Box<3> box;
  box.edges = {6, 5, 7};
  box.boundary.fill(Boundary::periodic);
  std::mt19937_64 random(1);
  const auto place = [&](int axis) { return box.edges[axis] * static_cast<double>(random() >> 11) * 0x1p-53; };
  Particles<3> p;
  for (int i = 0; i < 300; ++i) p.x.emplace_back(place(0), place(1), place(2));
  for (int i = 0; i < 300; ++i) p.species.push_back(i % 5 == 0 ? 1 : 0);
  PairFilter filter;
  if (apart) filter.species = {&p.species, 0, 1};
  std::map<std::pair<Id, Id>, int> listed;
  std::array<double, 2> shared{};  // pairs
  for (const int rank : {0, 1}) {
    p.ghost.clear();
    const char ghost = by_ids ? kGhost : rank == 0 ? kGhostHere : kGhostElsewhere;
    for (int i = 0; i < 300; ++i) p.ghost.push_back((i % 3 == 0) == (rank == 0) ? ghost : 0);
    CutoffList<3> list(box, kCutoff, filter);
    const PairRecords<3>& records = list.cover({.x = p.x}, p);
    EXPECT_EQ(records.own, rank == 0 ? 200u : 100u);
    EXPECT_EQ(records.order.size(), ghost == kGhostElsewhere ? 100u : 300u);
    std::size_t pairs = 0;
    for (const auto kind :
         {PairRecords<3>::kPlain, PairRecords<3>::kMoving, PairRecords<3>::kShared, PairRecords<3>::kSharedMoving}) {
      EXPECT_EQ(records.runs[kind].empty(), PairRecords<3>::shared(kind) && ghost == kGhostElsewhere) << kind;
      for (const PairRun& run : records.runs[kind])
        for (std::size_t k = run.begin; k < run.begin + run.count; ++k, ++pairs) {
          const Id i = records.order[run.row], j = records.order[records.partners[kind][k]];
          EXPECT_TRUE(p.owns(j));
          EXPECT_EQ(p.owns(i), !PairRecords<3>::shared(kind));
          EXPECT_TRUE(!apart || p.species[i] != p.species[j]);
          shared[static_cast<std::size_t>(rank)] += p.owns(i) ? 0 : 1;
          ++listed[std::minmax(i, j)];
        }
    }
    std::vector<std::uint32_t> work(p.size());
    list.add_listed_pairs(work);
    EXPECT_EQ(std::accumulate(work.begin(), work.end(), std::size_t{0}), pairs);
    for (Id i = 0; i < p.size(); ++i) EXPECT_TRUE(p.owns(i) || work[i] == 0);
  }
  EXPECT_NEAR(shared[1] / shared[0], by_ids ? 1 : 0, 0.2);
  for (Id i = 0; i < p.size(); ++i)
    for (Id j = i + 1; j < p.size(); ++j) {
      const Vec<3> d = p.x[i] - p.x[j];
      const bool near =
          (d + box.shift(box.nearest_image(d))).norm() <= kCutoff && (!apart || p.species[i] != p.species[j]);
      const auto found = listed.find({i, j});
      EXPECT_LE(found == listed.end() ? 0 : found->second, 1);
      EXPECT_TRUE(!near || found != listed.end()) << i << " and " << j;
    }
}

TEST(CutoffList, TheListsOfTwoRanksHaveEachPairOnce) {
  for (const bool by_ids : {true, false})
    for (const bool apart : {false, true}) expect_each_pair_once_on_two_ranks(by_ids, apart);
}

TEST(PairSums, AreOfTheKernelsThatAreToBeUsed) {
  test::for_each_case<3>([](Scene<3>& scene, Interaction<3>& term) {
    const auto& x = scene.particles.x;
    const auto forces = [&] {
      ForceSums<3> sums(x.size(), kQuantum);
      term.add_forces(x, sums);
      return quanta(sums);
    };
    const auto expected = forces();
    PairKernels broken = widest_kernels<PairKernels>();
    broken.scatter = [](const PairBatch&, const std::int64_t(*)[PairBatch::kPaddedCapacity], ForceWords*) {};
    term.use(broken);
    EXPECT_EQ(forces() == expected, !term.keeps_momentum());  // fields have no kernels
    for (const PairKernels* kernels : available_kernels<PairKernels>()) {
      term.use(*kernels);
      EXPECT_TRUE(forces() == expected) << kernels->name;
    }
  });
}

TEST(PairSums, AreThoseOfPlainLoopsOverPairs) {
  Scene<3> scene(150, 7, Boundary::periodic, 0.6);
  const auto& x = scene.particles.x;
  const auto x_new = test::displaced(x, scene.random_vectors(0.3), 1);
  const Cut fluid(LennardJones(1.0, 0.8), 2.0, CutKind::shifted);
  expect_reference(scene, *scene.make("lennard-jones", cut_lennard_jones(0.8, 2.0)), fluid, 4, nullptr, x, x_new);
  Scene<2> plane(150, 9, Boundary::wall, 0.2);
  plane.particles.charge[3] = 0;  // pairs of zero weight add nothing
  plane.particles.charge[4] = 1e-3;
  const auto& q = plane.particles.x;
  const auto q_new = test::displaced(q, plane.random_vectors(0.3), 1);
  constexpr double kAll = std::numeric_limits<double>::infinity();
  expect_reference(plane, *plane.make("gravity", {{"constant", 0.7}}), InverseDistance(-0.7), kAll,
                   &plane.particles.mass, q, q_new);
  expect_reference(plane, *plane.make("yukawa", {{"amplitude", 2.0}, {"kappa", 1.1}, {"charges", true}}),
                   Yukawa(2, 1.1), kAll, &plane.particles.charge, q, q_new);
}

TEST(PairSums, HoldSeveralImagesOfAPairInASmallBox) {
  for (const double edge : {1.1, 1.7, 2.6, 4.1}) {  // the cutoff extends beyond the box
    Scene<2> scene(7, edge, Boundary::periodic, 0.2);
    const auto& x = scene.particles.x;
    const auto x_new = test::displaced(x, scene.random_vectors(0.02), 1);
    const Cut potential(LennardJones(1.0, 0.4), 2.0, CutKind::shifted);
    expect_reference(scene, *scene.make("lennard-jones", cut_lennard_jones(0.4, 2.0)), potential, 4, nullptr, x, x_new);
  }
}

TEST(PairSums, PassOverManyPairsThatAreOnlyInTheSkin) {
  for (const Boundary boundary : {Boundary::wall, Boundary::periodic}) {
    Scene<2> scene(0, 61, boundary, 0);
    for (int k = 0; k < 400; ++k)
      for (const double beside : {0.0, k % 399 == 0 ? 0.9 : 1.25})
        scene.particles.x.push_back(Vec<2>(0.01 + 3 * (k % 20) + beside, 0.01 + 3 * (k / 20)));
    const auto& x = scene.particles.x;
    scene.particles.mass.resize(x.size(), 1);
    const Cut potential(LennardJones(1.0, 0.8), 1.2, CutKind::shifted);
    expect_reference(scene, *scene.make("lennard-jones", cut_lennard_jones(0.8, 1.2)), potential, 1.44, nullptr, x, x);
  }
}

TEST(PairSums, PassOverManyPairsOfNoWeight) {
  Scene<2> scene(600, 30, Boundary::wall, 0.2);
  for (std::size_t i = 1; i < 599; ++i) scene.particles.charge[i] = 0;
  const auto& x = scene.particles.x;
  expect_reference(scene, *scene.make("yukawa", {{"amplitude", 2.0}, {"kappa", 0.1}, {"charges", true}}),
                   Yukawa(2, 0.1), std::numeric_limits<double>::infinity(), &scene.particles.charge, x, x);
}

/// Moves particles, sometimes wraps them, and compares with simple loops after each step, also in a flow of this rate.
template <int D>
void travel(double edge, int particles, double speed, const std::string& width, double rate = 0) {
  SCOPED_TRACE(width);
  setenv("CAROM_SIMD", width.c_str(), 1);
  Scene<D> scene(particles, edge, Boundary::periodic, 0.4);
  const auto travelled = scene.make(
      "yukawa", {{"amplitude", 1.0}, {"kappa", 1.1}, {"charges", false}, {"cutoff", 1.2}, {"cut", "shifted"s}});
  unsetenv("CAROM_SIMD");
  const Cut potential(Yukawa(1.0, 1.1), 1.2, CutKind::shifted);
  auto x = scene.particles.x;
  const auto drift = scene.random_vectors(speed);
  Box<D>& box = scene.box;
  box.shear_rate = rate;
  const auto moved = [&](const std::vector<Vec<D>>& from, double time) {
    auto to = test::displaced(from, drift, time);
    for (std::size_t i = 0; i < to.size(); ++i) to[i][0] += time * box.flow(from[i]);
    return to;
  };
  std::int32_t turns = 0;
  for (int step = 0; step < 30; ++step) {
    x = moved(x, 1);
    box.advance(1);
    if (step % 3 == 2) turns += std::abs(box.shorten_tilt());
    if (step % 3 == 2)
      for (auto& each : x) {
        Image<D> image{};
        scene.box.wrap(each, image);
      }
    if (step == 20) x[5][0] += 3 * edge;
    const auto x_new = moved(x, step % 4);
    box.next_tilt = box.tilt + step % 4 * box.slide();
    ForceSums<D> forces(x.size(), kQuantum), mean(x.size(), kQuantum);
    travelled->add_forces(x, forces);
    travelled->add_mean_forces(x, x_new, mean);
    const Reference<D> expected(scene, potential, 1.44, nullptr, x, x_new);
    if (step == 20) {  // too far away for the simple loops
      x[5][0] -= 3 * edge;
      continue;
    }
    ASSERT_TRUE(quanta(forces) == expected.forces) << "step " << step;
    ASSERT_TRUE(quanta(mean) == expected.mean_forces) << "step " << step;
    const auto by_tilt = [](typename ForceSums<D>::Whole sum) { return static_cast<double>(sum) * kQuantum; };
    ASSERT_EQ(forces.by_tilt().value(), rate == 0 ? 0 : by_tilt(expected.by_tilt)) << "step " << step;
    ASSERT_EQ(mean.by_tilt().value(), rate == 0 ? 0 : by_tilt(expected.mean_by_tilt)) << "step " << step;
  }
  EXPECT_EQ(turns > 0, rate != 0);
}

TEST(PairSums, DoNotDependOnTheHistoryOfTheList) {
  for (const std::string& width : widths()) {
    travel<2>(6, 60, 0.01, width);
    travel<2>(6, 60, 0.07, width);
    travel<3>(4, 90, 0.02, width);
    travel<3>(1.5, 12, 0.03, width);
    travel<2>(6, 60, 0.01, width, 0.04);
    travel<3>(4, 90, 0.02, width, -0.04);
  }
}

/// A potential without kernels.
struct OwnYukawa : Yukawa {
  using Yukawa::Yukawa;
};

TEST(PairSums, OfAPotentialThatIsNotListedAreTheSame) {
  Scene<3> scene(200, 6, Boundary::periodic, 0.4);
  const auto x_new = test::displaced(scene.particles.x, scene.random_vectors(0.1), 1);
  for (const char* cut : {"switch", "shifted", "force-shifted"}) {
    const Options given = {{"amplitude", 2.0}, {"kappa", 1.1}, {"charges", true}, {"cutoff", 2.0}, {"cut", cut + ""s}};
    Parameters parameters;
    for (const auto& [name, value] : given) parameters.set(name, value);
    const auto own = options::pair_term<3>(
        "own", OwnYukawa(2.0, 1.1), PairWeight::charges, parameters,
        {.box = scene.box, .particles = scene.particles, .species = scene.species, .bonds = nullptr});
    const Outcome<3> expected = outcome(*scene.make("yukawa", given), scene.particles.x, x_new);
    for (const PairKernels* kernels : available_kernels<PairKernels>()) {
      own->use(*kernels);
      EXPECT_TRUE(outcome(*own, scene.particles.x, x_new) == expected) << kernels->name;
    }
  }
}

TEST(PairSums, DoNotDependOnTheOrderOfTheParticles) {
  Scene<3> scene(120, 6, Boundary::periodic, 0.6);
  Scene<3> turned = scene;
  const auto reverse = [](auto& array) { std::ranges::reverse(array); };
  reverse(turned.particles.x);
  reverse(turned.particles.charge);
  reverse(turned.particles.species);
  const Options given = {{"constant", 1.3},
                         {"form", "damped-shifted"s},
                         {"damping", 0.9},
                         {"cutoff", 2.4},
                         {"species", std::vector<std::string>{"A", "B"}}};
  auto x_new = test::displaced(scene.particles.x, scene.random_vectors(0.2), 1);
  Outcome<3> one = outcome(*scene.make("coulomb", given), scene.particles.x, x_new);
  reverse(x_new);
  const Outcome<3> other = outcome(*turned.make("coulomb", given), turned.particles.x, x_new);
  for (auto* each : {&one.forces, &one.mean_forces, &one.products}) reverse(*each);
  EXPECT_TRUE(one == other);
}

TEST(PairSums, OfForcesAreExactlyZero) {
  test::for_each_case<3>([](Scene<3>& scene, const Interaction<3>& term) {
    if (!term.keeps_momentum()) return;
    const auto x_new = test::displaced(scene.particles.x, scene.random_vectors(0.1), 1);
    const Outcome<3> result = outcome(term, scene.particles.x, x_new);
    for (const auto* each : {&result.forces, &result.mean_forces, &result.products})
      for (int k = 0; k < 3; ++k) {
        ForceSums<3>::Whole sum = 0;
        for (const auto& force : *each) sum += force[k];
        EXPECT_TRUE(sum == 0);
      }
  });
}

TEST(PairSums, AreBroughtUpToDateExactly) {
  test::for_each_case<2>([](Scene<2>& scene, const Interaction<2>& term) {
    const auto& x = scene.particles.x;
    auto x_new = test::displaced(x, scene.random_vectors(0.05), 1);
    ForceSums<2> kept(x.size(), kQuantum);
    term.add_mean_forces(x, x_new, kept);
    for (int sweep = 0; sweep < 20; ++sweep) {
      std::vector<char> changed(x.size(), 0);
      auto next = x_new;
      for (std::size_t i = 0; i < x.size(); ++i) {
        changed[i] = scene.random() % 5 == 0;
        if (changed[i] != 0) next[i] += scene.random_vectors(0.02)[i];
      }
      const auto subtracted = term.add_mean_forces(x, x_new, kept, changed.data(), -1);
      const auto added = term.add_mean_forces(x, next, kept, changed.data());
      ForceSums<2> anew(x.size(), kQuantum);
      const auto all = term.add_mean_forces(x, next, anew);
      EXPECT_LE(std::max(subtracted, added), all + x.size());
      ASSERT_TRUE(quanta(kept) == quanta(anew)) << "sweep " << sweep;
      x_new = next;
    }
  });
}

}  // namespace
}  // namespace carom::pair_sums_test
