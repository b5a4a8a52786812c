// SPDX-License-Identifier: BSD-3-Clause
// A system divided among ranks has the bits of an undivided one, for any subdomains and windows.

#include "engine/ranks/windowed_flight.h"

#include <gtest/gtest.h>

#include "engine/ranks/id_blocks.h"
#include "tests/support/same_statistics.h"
#include "tests/support/thread_ranks.h"
#include "tests/unit/engine/events/event_cases.h"

namespace carom::windowed_flight_test {
namespace {

/// A division of a run.
struct Way {
  int subdomains = 1;
  SearchOptions::Method method = SearchOptions::Method::automatic;
  double in_cache = SearchOptions{}.in_cache;
  double skin = 0, cell = 0, small = 0;  // as in SearchOptions
  std::function<double()> window{};
  std::uint64_t limit = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t contacts = std::numeric_limits<std::uint64_t>::max();  ///< of a slab
  bool log = true;                                                     ///< contacts
};

template <int D>
Outcome<D> whole(const Case<D>& c, std::uint64_t limit = std::numeric_limits<std::uint64_t>::max(),
                 Counters* counted = nullptr, std::uint64_t contacts = std::numeric_limits<std::uint64_t>::max()) {
  Outcome<D> out;
  out.particles = c.system->particles;
  Particles<D>& p = out.particles;
  Box<D> box = c.system->box;
  EventCore<D> core(box);
  Counters counters;
  for (int k = 0; k < c.slabs && counters.sphere_sphere < limit; ++k) {
    core.load(p, c.g, c.slab);
    const double reached = core.run(
        c.slab, {.counters = counters, .contacts = &out.contacts, .collision_limit = limit, .contact_limit = contacts});
    core.copy_at(reached, p);
    for (std::size_t i = 0; i < p.size(); ++i) box.wrap(p.x[i], p.image[i]);
    box.time += reached;
  }
  if (counted) *counted = counters;
  return out;
}

template <int D>
Outcome<D> divided(const Case<D>& c, const Way& way, Counters* counted = nullptr,
                   WindowCounts* windows_counted = nullptr) {
  Outcome<D> out;
  test::ThreadRanks(way.subdomains).run([&](Communicator& ranks) {
    System<D> system;
    system.box = c.system->box;
    system.particles = c.system->particles;
    system.decomposition.join(ranks);
    Particles<D>& p = system.particles;
    WindowedFlight<D> flight(
        system.box, system.decomposition.sizes(), ranks,
        {.method = way.method, .skin = way.skin, .cell = way.cell, .small = way.small, .in_cache = way.in_cache},
        way.window);
    Counters counters;
    std::vector<Contact<D>> contacts;
    for (int k = 0; k < c.slabs && counters.sphere_sphere < way.limit; ++k) {
      flight.take(p, c.g, c.slab);
      const double reached = flight.run(c.slab, {.counters = counters,
                                                 .contacts = way.log ? &contacts : nullptr,
                                                 .collision_limit = way.limit,
                                                 .contact_limit = way.contacts});
      flight.give_back(reached, p);
      system.wrap();
      system.box.time += reached;
    }
    Particles<D> all = gathered(ranks, p);
    if (ranks.rank() > 0) return;
    out = {std::move(contacts), std::move(all)};
    if (counted) *counted = counters;
    if (windows_counted) *windows_counted = flight.window_counts();
  });
  return out;
}

template <int D>
void expect_the_same_however_divided(const Case<D>& c, std::size_t at_least,
                                     std::initializer_list<int> numbers = {1, 2, 3, 4, 8}) {
  Counters one, many;
  const auto reference = whole(c, std::numeric_limits<std::uint64_t>::max(), &one);
  ASSERT_GE(reference.contacts.size(), at_least);
  using Method = SearchOptions::Method;
  for (const int subdomains : numbers)
    for (const Method method : {Method::lists, Method::cells}) {
      const std::string what = std::to_string(subdomains) + (method == Method::lists ? " lists" : " cells");
      const double in_cache = subdomains % 2 == 0 ? SearchOptions{}.in_cache : 0;  // 0: prefetch all spheres
      expect_same(reference, divided(c, {.subdomains = subdomains, .method = method, .in_cache = in_cache}, &many),
                  what);
      if (testing::Test::HasFailure()) return;
      EXPECT_EQ(one.sphere_sphere, many.sphere_sphere) << what;
      EXPECT_EQ(one.sphere_wall, many.sphere_wall) << what;
      EXPECT_EQ(one.collision_virial.value(), many.collision_virial.value()) << what;
      EXPECT_EQ(one.max_overlap, many.max_overlap) << what;
      EXPECT_TRUE(test::same(one.worst, many.worst)) << what;
      EXPECT_EQ(one.work.value(), many.work.value()) << what;
    }
}

TEST(WindowedFlight, Fluids) {
  expect_the_same_however_divided<3>({.system = test::hard_spheres<3>(5, 0.49), .slab = 0.3, .slabs = 2}, 3900);
  expect_the_same_however_divided<3>({.system = test::hard_spheres<3>(5, 0.3), .slab = 0.8, .slabs = 2}, 2000);
  expect_the_same_however_divided<3>({.system = test::hard_spheres<3>(5, 0.1), .slab = 2, .slabs = 2}, 700);
  expect_the_same_however_divided<2>({.system = test::hard_spheres<2>(14, 0.69), .slab = 0.4, .slabs = 2}, 1000);
  expect_the_same_however_divided<2>({.system = test::hard_spheres<2>(10, 0.1), .slab = 5, .slabs = 2}, 300);
}

TEST(WindowedFlight, Crystals) {
  expect_the_same_however_divided<3>({.system = test::hard_spheres<3>(4, 0.7), .slab = 0.04, .slabs = 2}, 1800);
  expect_the_same_however_divided<2>({.system = test::hard_spheres<2>(8, 0.8), .slab = 0.1, .slabs = 2}, 400);
}

TEST(WindowedFlight, ManySizes) {
  expect_the_same_however_divided<3>(
      {.system = random_system<3>(300, {7, 7, 7}, {P, P, P}, 0.1, 1.0, 3), .slab = 0.05, .slabs = 2}, 700);
  expect_the_same_however_divided<2>(
      {.system = random_system<2>(120, {21, 21}, {P, W}, 0.15, 1.5, 4), .slab = 0.3, .slabs = 2}, 200);
}

/// Spheres up to some size in cells, larger ones beside them, which change subdomains and are ghosts like small ones.
TEST(WindowedFlight, LargeSpheresBesideCells) {
  const auto expect_the_same = [](const auto& c, std::size_t at_least) {
    const auto reference = whole(c);
    ASSERT_GE(reference.contacts.size(), at_least);
    const auto [least, most] = std::ranges::minmax(c.system->particles.radius);
    for (const int subdomains : {3, 8})
      for (const double share : {-1.0, 0.2, 0.8})
        for (const double skin : {0.1, 1.0}) {
          const double small = least + share * (most - least);
          const auto found = divided(c, {.subdomains = subdomains,
                                         .method = SearchOptions::Method::small_cells,
                                         .in_cache = subdomains == 3 ? 0 : SearchOptions{}.in_cache,
                                         .skin = skin * most,
                                         .cell = 0.5 * most,
                                         .small = small});
          expect_same(
              reference, found,
              std::to_string(subdomains) + " up to " + std::to_string(small) + ", skin " + std::to_string(skin));
        }
  };
  expect_the_same(Case<3>{.system = random_system<3>(300, {9, 7, 7}, {P, P, P}, 0.1, 1.0, 3), .slab = 0.2, .slabs = 2},
                  1000);
  expect_the_same(Case<3>{.system = random_system<3>(300, {9, 8, 8}, {P, W, P}, 0.1, 1.0, 4),
                          .g = {0.2, -1, 0},
                          .slab = 0.2,
                          .slabs = 2},
                  1000);
  expect_the_same(Case<2>{.system = random_system<2>(120, {21, 21}, {P, W}, 0.15, 1.5, 4), .slab = 0.5, .slabs = 3},
                  300);
}

/// In a box of 10⁷ diameters contacts are rounded to 1e-9 of a diameter, between spheres and at a wall: the longest
/// overlap is the same one.
TEST(WindowedFlight, OverlapsOfRounding) {
  std::vector<Vec<2>> x, v;
  for (int i = 0; i < 60; ++i) {
    x.push_back({1e7 - 0.6 - 1.7 * (i / 6), 0.6 + 1.7 * (i % 6)});
    v.push_back({std::sin(37.0 * i) + 0.5, std::cos(11.0 * i)});
  }
  const Case<2> c{.system = test::make_system<2>({1e7, 10}, W, x, v), .slab = 4, .slabs = 2};
  Counters counters;
  whole(c, std::numeric_limits<std::uint64_t>::max(), &counters);
  EXPECT_GT(counters.worst.depth, kRoundingOfOverlaps);
  expect_the_same_however_divided<2>(c, 150);
}

/// All spheres are in one line across the longest edge, at its end or in its middle: subdomains can have no sphere, or
/// one, before spheres arrive, in the same epoch or in the next.
TEST(WindowedFlight, EmptyRegions) {
  for (const double column : {5.0, 100.0}) {
    const int n = 80;
    std::vector<Vec<2>> x, v;
    std::vector<double> radius;
    for (int i = 0; i < n; ++i) {
      x.push_back({column, 0.25 + 0.5 * i});
      v.push_back({std::sin(37.0 * i), std::cos(11.0 * i)});
      radius.push_back(0.1 + 0.1 * (i % 7) / 7.0);
    }
    const std::vector<double> mass(n, 1.0);
    expect_the_same_however_divided<2>(
        {.system = test::make_system<2>({200, 40}, P, x, v, radius, mass), .slab = 3, .slabs = 3}, 50);
    expect_the_same_however_divided<2>(
        {.system = test::make_system<2>({200, 40}, P, x, v, std::vector<double>(n, 0.2), mass), .slab = 3}, 50);
  }
}

/// The cores have rows of cells near their spheres only, in some of them all rows but one.
TEST(WindowedFlight, SmallPartsOfAGas) {
  for (const unsigned seed : {1, 2, 3})
    expect_the_same_however_divided<3>(
        {.system = random_system<3>(1600, {14.1, 14.1, 14.1}, {P, P, P}, 0.5, 0.5, seed), .slab = 0.2}, 500, {16});
}

/// The core of a subdomain has cells near its spheres only until a sphere leaves them: here all spheres move from one
/// end of a periodic box into all of it.
TEST(WindowedFlight, SpheresFarFromTheirRegion) {
  for (const double radius : {0.4, 0.2})  // equal radii, and unequal ones
    for (const auto method : {SearchOptions::Method::lists, SearchOptions::Method::cells}) {
      auto system = random_system<3>(150, {6, 6, 6}, {P, P, P}, radius, 0.4, 23);
      system->box.edges = {60, 7, 7};
      Particles<3>& p = system->particles;
      Counters counters;
      std::vector<Contact<3>> all, here;
      EventCore<3> whole(system->box);
      whole.load(p, Vec<3>::Zero(), 20);
      whole.run(20, {.counters = counters, .contacts = &all});
      Sizes sizes(p);
      sizes.spheres *= 4;  // as if there were more spheres elsewhere
      EventCore<3> part(system->box, &sizes, {.method = method});
      std::vector<Record<3>> records;
      for (Id i = 0; i < p.size(); ++i) records.push_back({p.x[i], p.v[i], 0.0, i, 0, p.species[i]});
      part.load(records, Vec<3>::Zero(), 20, 0, 0.5);
      part.run(20, {.counters = counters, .contacts = &here});
      ASSERT_GT(all.size(), 300u);
      ASSERT_EQ(all.size(), here.size());
      for (std::size_t k = 0; k < all.size(); ++k) ASSERT_TRUE(all[k].key == here[k].key) << "contact " << k;
    }
}

/// Beside the number of one of several million spheres a candidate has two bits for each axis of its image. That is
/// enough for spheres that pass through a face; what is farther away is an error.
TEST(WindowedFlight, SpheresOfALargeSystemPassThroughFaces) {
  const auto system = random_system<3>(150, {6, 6, 6}, {P, P, P}, 0.4, 0.4, 23);
  const Particles<3>& p = system->particles;
  Counters counters;
  std::vector<Contact<3>> all;
  EventCore<3> whole(system->box);
  whole.load(p, Vec<3>::Zero(), 20);
  whole.run(20, {.counters = counters, .contacts = &all});
  Sizes sizes(p);
  sizes.spheres = 5000000;  // as if there were more spheres elsewhere
  for (const auto method : {SearchOptions::Method::lists, SearchOptions::Method::cells}) {
    std::vector<Contact<3>> here;
    EventCore<3> part(system->box, &sizes, {.method = method});
    std::vector<Record<3>> records;
    for (Id i = 0; i < p.size(); ++i) records.push_back({p.x[i], p.v[i], 0.0, i, 0, p.species[i]});
    part.load(records, Vec<3>::Zero(), 20, 0, 0.5);
    ASSERT_EQ(part.flights().packing().largest(), 1);
    EXPECT_THROW(part.run(20, {.counters = counters, .contacts = &here}), Error);
    ASSERT_GT(here.size(), 300u);
    for (std::size_t k = 0; k < here.size(); ++k) ASSERT_TRUE(all[k].key == here[k].key) << "contact " << k;
  }
}

TEST(WindowedFlight, WallsAndFields) {
  expect_the_same_however_divided<3>({.system = random_system<3>(150, {7, 6, 6}, {W, P, W}, 0.5, 0.5, 5), .slab = 1},
                                     1000);
  expect_the_same_however_divided<3>(
      {.system = random_system<3>(150, {6, 6, 9}, {P, P, W}, 0.5, 0.5, 7), .g = {0.1, 0, -1}, .slab = 1}, 1000);
  expect_the_same_however_divided<2>(
      {.system = random_system<2>(40, {7, 12}, {W, W}, 0.3, 0.5, 8), .g = {0, -0.5}, .slab = 1}, 200);
}

TEST(WindowedFlight, Pistons) {
  for (const double speed : {-0.3, 0.7}) {
    Case<3> c{.system = random_system<3>(150, {7, 6, 8}, {W, P, W}, 0.4, 0.5, 25), .slab = 1};
    c.system->box.add({.name = "x+", .velocity = -speed});
    c.system->box.add({.name = "z+", .velocity = 0.2});
    expect_the_same_however_divided<3>(c, 800);
  }
}

/// Subdomains with more events per sphere become smaller, which changes no path.
TEST(WindowedFlight, UnevenWork) {
  expect_the_same_however_divided<3>(
      {.system = random_system<3>(200, {6, 6, 24}, {P, P, W}, 0.4, 0.4, 17), .g = {0, 0, -2}, .slab = 1.5, .slabs = 5},
      1500);
}

/// All spheres fall into one of two subdomains, which has no room for so many and must be loaded again.
TEST(WindowedFlight, GhostsThatFindNoRoom) {
  const Case<2> c{.system = random_system<2>(1500, {30, 60}, {P, W}, 0.04, 0.04, 19), .g = {0, -20}, .slab = 3};
  const auto reference = whole(c);
  ASSERT_GT(reference.contacts.size(), 1000u);
  WindowCounts counts;
  expect_same(reference, divided(c, {.subdomains = 2}, nullptr, &counts), "falling");
  EXPECT_GT(counts.cut, 0u);
}

/// A disc between two fixed ones, a millionth apart, fills the log of its subdomain in the first window; the other
/// subdomain has few events and must end the window there, too.
TEST(WindowedFlight, ALogThatIsFullInOneSubdomain) {
  std::vector<Vec<2>> x = {{2, 6}, {2.4 + 1e-6, 6}, {2.8 + 2e-6, 6}}, v = {{0, 0}, {1, 0}, {0, 0}};
  for (int i = 0; i < 200; ++i) {
    x.push_back({8.0 + i % 20, 0.5 + i / 20});
    v.push_back({std::sin(7.0 * i), std::cos(11.0 * i)});
  }
  std::vector<double> mass(x.size(), 1.0);
  mass[0] = mass[2] = std::numeric_limits<double>::infinity();
  const Case<2> c{.system = test::make_system<2>({30, 12}, P, x, v, std::vector<double>(x.size(), 0.2), mass),
                  .slab = 0.1};
  const auto reference = whole(c);
  ASSERT_GT(reference.contacts.size(), 40000u);
  WindowCounts counts;
  const auto parts = divided(c, {.subdomains = 2, .log = false}, nullptr, &counts);
  EXPECT_EQ(parts.particles.x, reference.particles.x);
  EXPECT_EQ(parts.particles.v, reference.particles.v);
  EXPECT_EQ(counts.subdomains, 2u);
  EXPECT_GT(counts.cut, 0u);
}

/// One sphere is so fast that each subdomain would have more neighbours than there are bits.
TEST(WindowedFlight, MoreRegionsThanTheBoxHasRoomFor) {
  const Case<3> c{.system = test::hard_spheres<3>(6, 0.49), .slab = 0.01, .slabs = 2};
  c.system->particles.v[5] *= 200;
  WindowCounts counts;
  expect_same(whole(c), divided(c, {.subdomains = 72}, nullptr, &counts), "72 subdomains");
  EXPECT_GT(counts.subdomains, 20u);
  EXPECT_LT(counts.subdomains, 72u);
  EXPECT_GT(counts.windows, 0u);
}

TEST(WindowedFlight, OpenSpace) {
  expect_the_same_however_divided<3>(
      {.system = random_system<3>(200, {8, 8, 8}, {O, O, P}, 0.5, 0.5, 9), .slab = 4, .slabs = 4}, 150);
}

TEST(WindowedFlight, TinyPeriodicBoxes) {  // subdomains are their own neighbours, spheres have many images
  expect_the_same_however_divided<3>(
      {.system = random_system<3>(24, {3.1, 2.9, 3.3}, {P, P, P}, 0.4, 0.4, 10), .slab = 2}, 400);
  expect_the_same_however_divided<2>({.system = random_system<2>(16, {4.2, 5.6}, {P, P}, 0.5, 0.5, 11), .slab = 5},
                                     300);
}

/// Rows and columns of spheres at exact positions, at rest or with speeds of −1 and 1 along an axis: many collisions at
/// one instant, and chains of collisions.
TEST(WindowedFlight, ExactTies) {
  for (const std::size_t variant : {0, 1, 2, 3, 4, 5}) {
    const int n = 6;
    std::vector<Vec<3>> x, v;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j)
        for (int k = 0; k < n; ++k) {
          x.push_back({2.0 * i, 2.0 * j, 2.0 * k});
          const int which = static_cast<int>(((x.size() + 1000 * variant) * 2654435761u >> 7) % 12);
          Vec<3> speed = Vec<3>::Zero();
          if (which < 8) speed[which / 2 % 3] = which % 2 == 0 ? 1 : -1;
          v.push_back(speed);
        }
    auto system = test::make_system<3>({12, 12, 12}, P, x, v, std::vector<double>(x.size(), 0.5),
                                       std::vector<double>(x.size(), 1.0));
    expect_the_same_however_divided<3>({.system = std::move(system), .slab = 4, .slabs = 3}, 450);
  }
}

/// The spheres of a case, with spins and a rough law for all contacts.
template <int D>
Case<D> rough(Case<D> c) {
  ContactLaws& laws = c.system->box.contacts;
  const auto walls = c.system->box.walls();
  laws.resize(1, walls.empty() ? 0 : walls.back().number + std::size_t{1});
  const auto law = laws.add({.restitution = 0.95, .tangential = 0.6, .friction = 0.4});
  laws.set_pair(0, 0, law);
  for (const Wall<D>& wall : walls) laws.set_wall(0, wall.number, law);
  Particles<D>& p = c.system->particles;
  p.spin.resize(p.size());
  for (Id i = 0; i < p.size(); ++i)
    for (int k = 0; k < Spin<D>::SizeAtCompileTime; ++k) p.spin[i][k] = std::sin(37.0 * i + k);
  return c;
}

TEST(WindowedFlight, RoughSpheres) {
  expect_the_same_however_divided<3>(rough<3>({.system = test::hard_spheres<3>(5, 0.49), .slab = 0.3, .slabs = 2}),
                                     2000);
  expect_the_same_however_divided<2>(rough<2>({.system = test::hard_spheres<2>(14, 0.69), .slab = 0.4, .slabs = 2}),
                                     900);
  expect_the_same_however_divided<3>(
      rough<3>({.system = random_system<3>(150, {6, 6, 9}, {P, P, W}, 0.4, 0.5, 7), .g = {0.1, 0, -1}, .slab = 1}),
      700);
  Case<3> fast = rough<3>({.system = random_system<3>(200, {9, 9, 9}, {P, P, P}, 0.4, 0.4, 12), .slab = 1, .slabs = 2});
  fast.system->particles.v[17] = {300, 20, 1};
  expect_the_same_however_divided<3>(fast, 1000);
  const Case<3> c = rough<3>({.system = test::hard_spheres<3>(5, 0.3), .slab = 0.8, .slabs = 3});
  for (const std::uint64_t limit : {1, 777, 1500})
    expect_same(whole(c, limit), divided(c, {.subdomains = 3, .limit = limit}), std::to_string(limit));
}

/// A very fast sphere would cross many subdomains in a window that suits the other spheres.
TEST(WindowedFlight, OneFastSphere) {
  Case<3> c{.system = random_system<3>(200, {9, 9, 9}, {P, P, P}, 0.4, 0.4, 12), .slab = 1, .slabs = 2};
  c.system->particles.v[17] = {300, 20, 1};
  expect_the_same_however_divided<3>(c, 2000);
}

TEST(WindowedFlight, RandomWindows) {
  const Case<3> c{.system = test::hard_spheres<3>(5, 0.3), .slab = 0.8, .slabs = 2};
  const auto reference = whole(c);
  for (std::uint64_t seed : {1, 2, 3}) {
    const auto window = [state = seed]() mutable {
      state = state * 6364136223846793005u + 1442695040888963407u;
      return 1e-4 * std::pow(1000.0, static_cast<double>(state >> 33) / 2147483648.0);
    };
    expect_same(reference, divided(c, {.subdomains = 4, .window = window}), "seed " + std::to_string(seed));
  }
}

TEST(WindowedFlight, EndsAtACollision) {
  const Case<3> c{.system = test::hard_spheres<3>(5, 0.3), .slab = 0.8, .slabs = 3};
  for (const std::uint64_t limit : {1, 2, 777, 1500}) {
    const auto reference = whole(c, limit);
    ASSERT_EQ(reference.contacts.size(), limit);
    for (const int subdomains : {1, 3, 8})
      expect_same(reference, divided(c, {.subdomains = subdomains, .limit = limit}), std::to_string(limit));
  }
}

/// Slabs that end after a number of contacts with walls and of pairs, or at a collision before that.
TEST(WindowedFlight, EndsAtAContact) {
  const Case<3> c{.system = random_system<3>(150, {7, 6, 6}, {W, P, W}, 0.5, 0.5, 5), .slab = 1, .slabs = 3};
  for (const std::uint64_t contacts : {1, 2, 100, 300}) {
    for (const std::uint64_t limit : {50, 10000}) {
      Counters counted;
      const auto reference = whole(c, limit, &counted, contacts);
      if (limit == 10000) {
        ASSERT_EQ(reference.contacts.size(), 3 * contacts);
      }
      if (contacts == 300) {
        EXPECT_GT(counted.sphere_wall, 0);
      }
      for (const int subdomains : {1, 3, 8})
        expect_same(reference, divided(c, {.subdomains = subdomains, .limit = limit, .contacts = contacts}),
                    std::to_string(contacts) + " " + std::to_string(limit));
    }
  }
}

/// Windows so short that each has at most one collision: the limit is reached by the last collision of a window.
TEST(WindowedFlight, EndsAtTheLastCollisionOfAWindow) {
  const Case<2> c{.system = test::hard_spheres<2>(5, 0.5), .slab = 0.2, .slabs = 2};
  for (const std::uint64_t limit : {1, 2, 3, 20}) {
    const auto reference = whole(c, limit);
    ASSERT_EQ(reference.contacts.size(), limit);
    WindowCounts counts;
    const Way way{.subdomains = 2, .window = [] { return 1e-4; }, .limit = limit};
    expect_same(reference, divided(c, way, nullptr, &counts), std::to_string(limit));
    EXPECT_GT(counts.windows, 5 * limit);
  }
}

/// Pairs that meet in the first window. One sphere of each is close to the end of the box, where a subdomain ends; the
/// other is up to a diameter and nearly twice the largest displacement away from it.
TEST(WindowedFlight, GhostsFromAsFarAsTwoSpheresCanCome) {
  const int rows = 40;
  std::vector<Vec<2>> x, v;
  for (int k = 0; k < rows; ++k) {
    const double away = 2.7 - 0.05 * k;  // of the sphere beyond the end
    x.push_back({0.01, 2.0 * k + 1});
    x.push_back({200 - away, 2.0 * k + 1});
    v.push_back({-1 + 1e-3 * k, 0});
    v.push_back({1, 0});
  }
  const Case<2> c{.system = test::make_system<2>({200, 2.0 * rows}, P, x, v, std::vector<double>(2 * rows, 0.5),
                                                 std::vector<double>(2 * rows, 1.0)),
                  .slab = 2};
  const auto reference = whole(c);
  ASSERT_GE(reference.contacts.size(), static_cast<std::size_t>(rows));
  for (const int subdomains : {2, 4}) expect_same(reference, divided(c, {.subdomains = subdomains}), "pairs");
}

}  // namespace
}  // namespace carom::windowed_flight_test
