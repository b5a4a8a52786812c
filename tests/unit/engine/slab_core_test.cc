#include "engine/slab_core.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/experiments.h"

namespace carom {
namespace {

/// Accelerations that change from node to node: a function of the particle's own, of its partners and of the node.
template <int D>
struct Kinked : NodeRule<D> {
  explicit Kinked(std::span<const Vec<D>> accelerations) : own(accelerations) {}
  void node(const Histories<D>& paths, Id i, double t, const EventKey<D>& key, Vec<D>& v, Vec<D>& a) override {
    v = paths.velocity_in(paths.last[i], t);
    a = (key.lo + key.hi) % 3 == 0 ? Vec<D>(-own[i]) : Vec<D>(0.5 * own[i]);
  }
  std::span<const Vec<D>> own;
};

/// Random accelerations, and slabs so long that a particle has about this many collisions.
template <int D>
struct Scene {
  Scene(std::unique_ptr<System<D>> given, unsigned seed, double slab_length)
      : system(std::move(given)), random(seed), length(slab_length), scan(*system, 100000) {
    const auto& p = system->particles;
    for (std::size_t i = 0; i < p.size(); ++i) a.push_back(vector());
    scan.begin_slab(counters, nullptr, a, length);
    scan.resolve(0, p.x, system->particles.v, [](const Touch<D>&) {});
  }
  Vec<D> vector() {
    Vec<D> some;
    for (int k = 0; k < D; ++k) some[k] = std::uniform_real_distribution(-2.0, 2.0)(random);
    return some;
  }
  SlabRun<D> run(SlabCore<D>& core, Histories<D>& paths) {
    std::ranges::copy(a, paths.a.begin());
    Kinked<D> rule(a);
    return core.run(paths, rule, extra);
  }

  std::unique_ptr<System<D>> system;
  std::mt19937 random;
  double length;
  std::vector<Vec<D>> a;
  std::vector<ExtraNode> extra;
  Counters counters;
  ContactScan<D> scan;
};

template <int D>
void expect_same(const Histories<D>& a, const Histories<D>& b) {
  for (Id i = 0; i < a.particles(); ++i) {
    std::uint32_t m = i, n = i;
    for (;; m = a.next[m], n = b.next[n]) {
      ASSERT_EQ(a.start[m], b.start[n]) << i;
      ASSERT_EQ(a.x[m], b.x[n]) << i;
      ASSERT_EQ(a.v[m], b.v[n]) << i;
      ASSERT_EQ(a.a[m], b.a[n]) << i;
      ASSERT_EQ(a.chord[m], b.chord[n]) << i;
      ASSERT_EQ(a.next[m] == Histories<D>::kNone, b.next[n] == Histories<D>::kNone) << i;
      if (a.next[m] == Histories<D>::kNone) break;
      ASSERT_EQ(a.opening(a.next[m]), b.opening(b.next[n])) << i;
      ASSERT_EQ(a.generation(a.next[m]), b.generation(b.next[n])) << i;
    }
    ASSERT_EQ(a.last[i], m);
  }
}

/// Whether the last repair has cut what particle i did behind its first node.
template <int D>
bool kept(const Histories<D>& paths, Id i) {
  const std::uint32_t m = paths.past[i], n = paths.next[i];
  return m != Histories<D>::kNone && n != Histories<D>::kNone && paths.opening(m) == paths.opening(n);
}

struct Tally {
  int lost = 0, gone = 0, come = 0;  // collisions that a repair no longer has, and has in addition
  int woken = 0;                     // in the midst of a slab, with what they did before
};

/// Repairs, one after the other, of which each must leave what a run of everybody gives.
template <int D>
void repair_again_and_again(Scene<D>& scene, Tally& tally) {
  using End = typename SlabRun<D>::End;
  const auto& p = scene.system->particles;
  SlabCore<D> core(*scene.system, scene.scan, 100000), reference(*scene.system, scene.scan, 100000);
  const double margin = 9 * scene.length;
  core.begin(p.x, margin);
  reference.begin(p.x, margin);
  Histories<D> paths;
  paths.reset(scene.length, p.x, p.v);
  ASSERT_EQ(scene.run(core, paths).end, End::complete);
  const auto some = [&](std::size_t most) { return std::uniform_int_distribution<std::size_t>(0, most)(scene.random); };
  for (int k = 0; k < 20; ++k) {
    std::vector<Id> seeds;
    for (std::size_t n = 1 + some(5); n > 0; --n) {
      const auto i = static_cast<Id>(some(p.size() - 1));
      seeds.push_back(i);
      // Other collisions, or the same at other times.
      scene.a[i] = k % 2 == 0 ? scene.vector() : Vec<D>(scene.a[i] + 1e-6 * scene.vector());
      paths.a[i] = scene.a[i];
    }
    const auto before = std::vector(core.contacts().begin(), core.contacts().end());
    Kinked<D> rule(scene.a);
    const SlabRun<D> run = core.repair(paths, rule, scene.extra, seeds);
    Histories<D> whole;
    whole.reset(scene.length, p.x, p.v);
    ASSERT_EQ(scene.run(reference, whole).end, End::complete);
    if (run.end == End::lost) {
      ++tally.lost;
      ASSERT_EQ(scene.run(core, paths).end, End::complete);
    }
    for (const Id i : core.awake()) tally.woken += kept(paths, i) ? 1 : 0;
    ASSERT_NE(run.end, End::cut);
    expect_same(paths, whole);
    ASSERT_EQ(core.contacts().size(), reference.contacts().size());
    for (std::size_t c = 0; c < core.contacts().size(); ++c) {
      ASSERT_EQ(core.contacts()[c].key, reference.contacts()[c].key);
      ASSERT_EQ(core.contacts()[c].impulse, reference.contacts()[c].impulse);
    }
    const auto met = [](std::span<const Contact<D>> among, const Contact<D>& contact) {
      return std::ranges::any_of(among, [&](const Contact<D>& other) {
        return other.key.kind == contact.key.kind && other.key.lo == contact.key.lo && other.key.hi == contact.key.hi;
      });
    };
    for (const auto& contact : before) tally.gone += met(core.contacts(), contact) ? 0 : 1;
    for (const auto& contact : core.contacts()) tally.come += met(before, contact) ? 0 : 1;
  }
}

TEST(SlabCore, ARepairLeavesWhatARunOfEverybodyGives) {
  Tally tally;
  for (unsigned seed = 1; seed <= 6; ++seed)
    for (const double part : {0.3, 1.0}) {
      SCOPED_TRACE(seed);
      Scene<2> discs(test::hard_spheres<2>(6, 0.5, seed), seed, 0.5 * part);
      discs.extra = {{3, 0.1 * part}, {11, 0.25 * part}};
      repair_again_and_again<2>(discs, tally);
      Scene<3> spheres(test::hard_spheres<3>(3, 0.4, seed), seed, 0.15 * part);
      repair_again_and_again<3>(spheres, tally);
      if (testing::Test::HasFatalFailure()) return;
    }
  EXPECT_GT(tally.gone, 50);
  EXPECT_GT(tally.come, 50);
  EXPECT_GT(tally.woken, 20);
  EXPECT_EQ(tally.lost, 0);
}

TEST(SlabCore, ARepairBetweenWallsAndWhereThreeMeetAtOnce) {
  Tally tally;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    auto boxed = test::hard_spheres<2>(6, 0.4, seed);
    boxed->box.boundary.fill(Boundary::wall);
    for (auto& x : boxed->particles.x) x += Vec<2>::Constant(0.5);
    boxed->box.edges += Vec<2>::Constant(1.0);
    Scene<2> discs(std::move(boxed), seed, 0.2);
    repair_again_and_again<2>(discs, tally);
    // Two that meet a third at one instant, and one more that comes by.
    Scene<2> tie(test::make_system<2>({20, 12}, Boundary::open, {{4, 2}, {6, 2}, {8, 2}, {6, 6}, {12, 6}},
                                      {{2, 0}, {0, 0}, {-2, 0}, {0.1, -3}, {-4, -1}}),
                 seed, 1.5);
    for (std::size_t i = 0; i < 3; ++i) tie.a[i].setZero();
    repair_again_and_again<2>(tie, tally);
    if (testing::Test::HasFatalFailure()) return;
  }
  EXPECT_GT(tally.gone, 20);
}

}  // namespace
}  // namespace carom
