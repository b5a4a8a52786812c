// SPDX-License-Identifier: BSD-3-Clause
#include "engine/events/event_core.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "engine/base/error.h"
#include "engine/events/contact.h"
#include "engine/events/meeting.h"
#include "engine/forces/forces.h"
#include "tests/support/experiments.h"

namespace carom::event_core_test {
namespace {

struct Hit {
  double t;
  EventKind kind;
  Id lo, hi;
};

/// The velocity of the upper edge of the box along an axis.
template <int D>
double edge_velocity(const Box<D>& box, int axis) {
  const WallOptions<D>* const face = box.find(static_cast<Id>(2 * axis + 1));
  return face ? -face->velocity : 0;
}

/// Simple and slow event-driven dynamics: all spheres are moved to every event, and all pairs and images are tried.
template <int D>
std::vector<Hit> obvious_run(const Box<D>& box, Particles<D> p, const Vec<D>& g, double end) {
  std::vector<Hit> hits;
  double now = 0;
  const int n = static_cast<int>(p.size());
  for (;;) {
    double best = end - now;
    Hit next{};
    Offset<D> best_offset;
    for (int i = 0; i < n; ++i) {
      for (int j = i + 1; j < n; ++j) {
        const double sigma = p.radius[i] + p.radius[j];
        for (int code = 0; code < static_cast<int>(std::pow(5, D)); ++code) {
          Image<D> image;
          int digits = code;
          bool allowed = true;
          for (int k = 0; k < D; ++k, digits /= 5) {
            image[k] = digits % 5 - 2;
            allowed = allowed && (image[k] == 0 || box.periodic(k));
          }
          if (!allowed) continue;
          if (box.sheared())  // where the images of a row are
            image[0] -= static_cast<int>(
                std::nearbyint((p.x[i][0] - p.x[j][0] + image[1] * (box.tilt + now * box.slide())) / box.edges[0]));
          const Offset<D> offset = box.offset(image);
          Vec<D> d = p.x[i] - p.x[j] + offset.start, v = p.v[i] - p.v[j];
          d[0] += now * offset.slide;
          v[0] += offset.slide;
          const double b = d.dot(v), c = d.squaredNorm() - sigma * sigma, disc = b * b - v.squaredNorm() * c;
          if (b >= 0 || disc <= 0) continue;
          const double s = std::max(0.0, c / (std::sqrt(disc) - b));
          if (s < best) best = s, next = {now + s, EventKind::pair, Id(i), Id(j)}, best_offset = offset;
        }
      }
      for (int k = 0; k < D; ++k)
        for (int side = 0; side < 2 && box.walled(k); ++side) {
          const double sign = side == 0 ? 1 : -1, wall = side == 0 ? 0 : box.edges[k] + now * edge_velocity(box, k),
                       gap = sign * (p.x[i][k] - wall) - p.radius[i];
          const double v = sign * (p.v[i][k] - side * edge_velocity(box, k)), a = sign * g[k];
          double s = kNever;
          if (a == 0)
            s = v < 0 ? std::max(0.0, gap / -v) : kNever;
          else if (const double disc = v * v - 2 * a * gap; disc > 0)  // the root at which it moves towards the wall
            s = (-v - std::sqrt(disc)) / a;
          if (s < -1e-9 || (s < 1e-9 && v + a * s >= 0)) s = kNever;
          if (s < best) best = s, next = {now + s, EventKind::wall, Id(i), Id(2 * k + side)};
        }
    }
    for (int i = 0; i < n; ++i) {
      p.x[i] += best * p.v[i] + 0.5 * best * best * g;
      p.v[i] += best * g;
    }
    if (next.t == 0 && best == end - now) return hits;
    now += best;
    hits.push_back(next);
    if (next.kind == EventKind::wall) {
      double& v = p.v[next.lo][next.hi / 2];
      v = 2 * (next.hi % 2) * edge_velocity(box, static_cast<int>(next.hi / 2)) - v;
    } else {
      Vec<D> d = p.x[next.lo] - p.x[next.hi] + best_offset.start, v = p.v[next.lo] - p.v[next.hi];
      d[0] += now * best_offset.slide;
      v[0] += best_offset.slide;
      const double f = collision_factor<D>(d, v, p.mass[next.lo], p.mass[next.hi]);
      p.v[next.lo] += f / p.mass[next.lo] * d;
      p.v[next.hi] -= f / p.mass[next.hi] * d;
    }
  }
}

template <int D>
std::unique_ptr<System<D>> random_spheres(int n, double edge, std::array<Boundary, D> boundary, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1), radius(0.2, 0.5), velocity(-1, 1);
  std::vector<Vec<D>> x, v;
  std::vector<double> r, m;
  while (static_cast<int>(x.size()) < n) {
    Vec<D> at, speed;
    const double size = radius(random);
    for (int k = 0; k < D; ++k) at[k] = size + uniform(random) * (edge - 2 * size), speed[k] = velocity(random);
    bool free = true;
    for (std::size_t j = 0; j < x.size(); ++j) {
      Vec<D> d = at - x[j];
      for (int k = 0; k < D; ++k) d[k] -= edge * std::nearbyint(d[k] / edge);
      free = free && d.norm() > size + r[j];
    }
    if (!free) continue;
    x.push_back(at), v.push_back(speed), r.push_back(size), m.push_back(0.5 + uniform(random));
  }
  auto system = test::make_system<D>(Vec<D>::Constant(edge), Boundary::open, x, v, r, m);
  system->box.boundary = boundary;
  return system;
}

template <int D>
void expect_same_events(const System<D>& system, const Vec<D>& g, double end, std::size_t at_least) {
  Counters counters;
  std::vector<Contact<D>> contacts;
  EventCore<D> core(system.box);
  core.load(system.particles, g, end);
  core.run(end, {.counters = counters, .contacts = &contacts});
  const auto obvious = obvious_run<D>(system.box, system.particles, g, end);
  ASSERT_GE(obvious.size(), at_least);
  ASSERT_EQ(contacts.size(), obvious.size());
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const auto& key = contacts[k].key;
    EXPECT_NEAR(key.time, obvious[k].t, 1e-6) << "event " << k;  // rounding errors grow with every collision
    EXPECT_EQ(key.kind, obvious[k].kind) << "event " << k;
    EXPECT_EQ(key.lo, obvious[k].lo) << "event " << k;
    EXPECT_EQ(key.hi, obvious[k].hi) << "event " << k;
    if (key.kind != EventKind::wall) continue;
    Vec<D> foot = contacts[k].x_lo;
    const int axis = static_cast<int>(key.hi / 2);
    foot[axis] = key.hi % 2 == 0 ? 0 : system.box.edges[axis] + edge_velocity(system.box, axis) * key.time;
    EXPECT_EQ(contacts[k].x_hi, foot) << "event " << k;
  }
}

constexpr Boundary W = Boundary::wall, P = Boundary::periodic, O = Boundary::open;

TEST(EventCore, FindsTheEventsThatTryingEverythingFinds) {
  expect_same_events<2>(*random_spheres<2>(8, 4, {P, P}, 1), Vec<2>::Zero(), 6, 20);
  expect_same_events<2>(*random_spheres<2>(8, 4, {W, P}, 2), Vec<2>::Zero(), 6, 20);
  expect_same_events<2>(*random_spheres<2>(9, 4, {W, W}, 3), Vec<2>::Zero(), 6, 20);
  expect_same_events<2>(*random_spheres<2>(9, 4, {O, P}, 4), Vec<2>::Zero(), 6, 3);
  expect_same_events<3>(*random_spheres<3>(10, 2.6, {P, P, P}, 5), Vec<3>::Zero(), 4, 20);
  expect_same_events<3>(*random_spheres<3>(10, 3, {P, W, P}, 6), Vec<3>::Zero(), 4, 20);
  const auto oblong = random_spheres<2>(9, 4, {W, W}, 3);
  oblong->box.edges = {4, 4.5};
  expect_same_events<2>(*oblong, Vec<2>::Zero(), 6, 20);
}

TEST(EventCore, FindsThemForEqualMassesOfAnySize) {
  const auto system = random_spheres<2>(8, 4, {W, P}, 2);
  system->particles.mass.assign(8, 2.5);
  expect_same_events<2>(*system, Vec<2>::Zero(), 6, 20);
}

TEST(EventCore, FindsThemInAUniformField) {
  expect_same_events<2>(*random_spheres<2>(8, 5, {P, W}, 7), Vec<2>(0, -1), 5, 20);
  expect_same_events<3>(*random_spheres<3>(8, 4, {W, P, W}, 8), Vec<3>(0.3, 0.5, -1), 4, 20);
}

TEST(EventCore, FindsThemWhereWallsMove) {
  for (const double speed : {-0.15, 0.4}) {
    const auto flat = random_spheres<2>(8, 4, {W, P}, 2);
    flat->box.add({.name = "x+", .velocity = -speed});
    expect_same_events<2>(*flat, Vec<2>::Zero(), 6, 20);
    const auto deep = random_spheres<3>(10, 3.5, {W, W, W}, 6);
    deep->box.add({.name = "x+", .velocity = -speed});
    deep->box.add({.name = "y+", .velocity = -0.1});
    expect_same_events<3>(*deep, Vec<3>(0, 0, -0.5), 4, 20);
  }
}

/// Spheres of a random system in a sheared box, with the velocities of its flow.
template <int D>
std::unique_ptr<System<D>> sheared(std::unique_ptr<System<D>> system, double rate) {
  system->box.shear_rate = rate;
  Particles<D>& p = system->particles;
  for (std::size_t i = 0; i < p.size(); ++i) p.v[i][0] += system->box.flow(p.x[i]);
  return system;
}

TEST(EventCore, FindsThemInAShearedBox) {
  expect_same_events<2>(*sheared(random_spheres<2>(8, 4, {P, P}, 1), 1.0), Vec<2>::Zero(), 3, 9);
  expect_same_events<2>(*sheared(random_spheres<2>(7, 5, {P, P}, 2), -0.6), Vec<2>::Zero(), 8, 9);
  expect_same_events<3>(*sheared(random_spheres<3>(10, 2.8, {P, P, P}, 5), 0.8), Vec<3>::Zero(), 2, 9);
  expect_same_events<3>(*sheared(random_spheres<3>(10, 3, {P, P, W}, 6), -1.5), Vec<3>::Zero(), 2, 9);
}

TEST(EventCore, TwoSpheresInADiluteBoxMeetThroughAFarImage) {
  // They separate in a periodic box of 40 diameters and meet on the other side: not through the initial nearest image.
  auto system = test::make_system<2>({40, 40}, P, {{10, 20}, {12, 20}}, {{-1, 0}, {1, 0}});
  Counters counters;
  std::vector<Contact<2>> contacts;
  EventCore<2> core(system->box);
  core.load(system->particles, Vec<2>::Zero(), 50);
  core.run(50, {.counters = counters, .contacts = &contacts});
  ASSERT_GE(contacts.size(), 1u);
  EXPECT_NEAR(contacts[0].key.time, (40 - 2 - 1) / 2.0, 1e-12);
  EXPECT_EQ(std::abs(contacts[0].key.image[0]), 1);
}

TEST(EventCore, StoppingOnTheWayChangesNothing) {
  auto system = test::hard_spheres<3>(3, 0.4);
  const double end = 2;
  auto records = [&](const std::vector<double>& stops) {
    Counters counters;
    EventCore<3> core(system->box);
    core.load(system->particles, Vec<3>::Zero(), end);
    Particles<3> copies = system->particles;
    for (double stop : stops) {
      core.run(stop, {.counters = counters});
      core.copy_at(stop, copies);
    }
    core.run(end, {.counters = counters});
    core.copy_at(end, copies);
    EXPECT_GT(counters.sphere_sphere, 300u);
    return copies;
  };
  const auto plain = records({}), stopped = records({0.1, 0.100001, 0.7, 1.3, 1.9999});
  EXPECT_EQ(plain.x, stopped.x);
  EXPECT_EQ(plain.v, stopped.v);
}

TEST(EventCore, RadiiMayChangeBetweenSlabs) {  // equal and unequal radii: no old list is kept
  for (const bool equal : {true, false}) {
    auto system = test::hard_spheres<3>(3, 0.2);
    Particles<3>& p = system->particles;
    for (std::size_t i = 0; i < p.size(); ++i)
      if (!equal && i % 2 == 1) p.radius[i] = 0.4;
    const SearchOptions lists{.method = SearchOptions::Method::lists, .skin = 0.05};
    EventCore<3> kept(system->box, lists);
    kept.load(p, Vec<3>::Zero(), 1);
    for (double& r : p.radius) r *= 1.3;
    std::vector<std::vector<Contact<3>>> contacts(2);
    EventCore<3> fresh(system->box, lists);
    for (EventCore<3>* core : {&kept, &fresh}) {
      Counters counters;
      core->load(p, Vec<3>::Zero(), 1);
      core->run(1, {.counters = counters, .contacts = &contacts[core == &fresh]});
      EXPECT_LT(counters.max_overlap, 1e-12);
    }
    ASSERT_GT(contacts[1].size(), 100u);
    ASSERT_EQ(contacts[0].size(), contacts[1].size());
    for (std::size_t k = 0; k < contacts[0].size(); ++k) EXPECT_TRUE(contacts[0][k].key == contacts[1][k].key);
  }
}

TEST(EventCore, StopsAtTheCollisionLimit) {
  auto system = test::hard_spheres<2>(6, 0.5);
  Counters counters;
  std::vector<Contact<2>> contacts;
  EventCore<2> core(system->box);
  core.load(system->particles, Vec<2>::Zero(), 10);
  const double reached = core.run(10, {.counters = counters, .contacts = &contacts, .collision_limit = 123});
  EXPECT_EQ(counters.sphere_sphere, 123u);
  EXPECT_EQ(reached, contacts.back().key.time);
}

TEST(EventCore, SimultaneousCollisionsOfALatticeKeepTheirOrder) {
  // Discs on a square lattice with velocities ±1 along x: whole columns collide at one instant.
  std::vector<Vec<2>> x, v;
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < 8; ++j) {
      x.push_back({1.5 * i + 0.75, 1.5 * j + 0.75});
      v.push_back({(i % 2) ? -1.0 : 1.0, 0.0});
    }
  auto system = test::make_system<2>({12, 12}, P, x, v);
  Counters counters;
  std::vector<Contact<2>> contacts;
  EventCore<2> core(system->box);
  core.load(system->particles, Vec<2>::Zero(), 5);
  core.run(5, {.counters = counters, .contacts = &contacts});
  ASSERT_EQ(contacts.size() % 32, 0u);
  ASSERT_GE(contacts.size(), 64u);
  for (std::size_t k = 1; k < contacts.size(); ++k) EXPECT_LT(contacts[k - 1].key, contacts[k].key);
}

/// The smallest gap relative to the contact distance, of pairs through periodic images and of walls, with scaled radii.
template <int D>
double smallest_gap(const System<D>& system, const Particles<D>& p, double scale) {
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < p.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      Vec<D> d = p.x[i] - p.x[j];
      d += system.box.shift(system.box.nearest_image(d));
      const double sigma = scale * (p.radius[i] + p.radius[j]);
      smallest = std::min(smallest, d.norm() / sigma - 1);
    }
    for (int k = 0; k < D; ++k)
      if (system.box.walled(k))
        smallest = std::min(smallest, std::min(p.x[i][k], system.box.edges[k] - p.x[i][k]) / (scale * p.radius[i]) - 1);
  }
  return smallest;
}

TEST(EventCore, GrowingSpheresNeverOverlap) {
  auto check = [](auto system, double growth, double end) {
    constexpr int D = std::decay_t<decltype(system->box.edges)>::RowsAtCompileTime;
    Counters counters;
    std::vector<Contact<D>> contacts;
    EventCore<D> core(system->box);
    core.load(system->particles, Vec<D>::Zero(), end, growth);
    Particles<D> copies = system->particles;
    for (int stop = 1; stop <= 50; ++stop) {
      const double time = end * stop / 50;
      core.run(time, {.counters = counters, .contacts = &contacts});
      core.copy_at(time, copies);
      EXPECT_GT(smallest_gap<D>(*system, copies, 1 + growth * time), -1e-12) << "time " << time;
    }
    EXPECT_GT(counters.sphere_sphere, 20u);
    EXPECT_LT(counters.max_overlap, 1e-12);
    for (const Contact<D>& contact : contacts) {  // at contact the spheres touch with their sizes at that time
      const Particles<D>& p = system->particles;
      const double now = 1 + growth * contact.key.time;
      const double distance = (contact.x_lo - contact.x_hi).norm();
      const double sigma =
          p.radius[contact.key.lo] + (contact.key.kind == EventKind::pair ? p.radius[contact.key.hi] : 0);
      if (contact.key.kind == EventKind::pair) {
        EXPECT_NEAR(distance / (sigma * now), 1, 1e-12);
      } else {
        const auto axis = contact.key.hi / 2;
        EXPECT_NEAR(std::abs(contact.x_lo[axis] - contact.x_hi[axis]) / (sigma * now), 1, 1e-12);
      }
    }
  };
  check(test::hard_spheres<2>(8, 0.4), 0.1, 3);  // many small cells, which grow with the spheres
  check(test::hard_spheres<3>(3, 0.2), 0.1, 3);
  check(random_spheres<2>(8, 4, {W, W}, 9), 0.05, 8);
  check(random_spheres<2>(8, 4, {P, W}, 10), 0.05, 8);
  check(random_spheres<3>(10, 2.6, {P, P, P}, 11), 0.02, 8);
  check(random_spheres<3>(10, 3.2, {W, P, W}, 12), 0.02, 8);
}

TEST(EventCore, GrowthPushesRestingSpheresApartAndOffTheWalls) {
  // Two discs at rest, each 1 from a wall and of radius 0.5 (1 + growth·t).
  auto system = test::make_system<2>({5, 9}, W, {{1, 4.5}, {4, 4.5}}, {{0, 0}, {0, 0}});
  Counters counters;
  EventCore<2> core(system->box);
  core.load(system->particles, Vec<2>::Zero(), 1.2, 0.1);
  Particles<2> p = system->particles;
  core.run(1.2, {.counters = counters});
  EXPECT_EQ(counters.sphere_sphere + counters.sphere_wall, 0u);
  core.load(system->particles, Vec<2>::Zero(), 1.2, 1.0);
  core.run(1.2, {.counters = counters});
  core.copy_at(1.2, p);
  EXPECT_EQ(counters.sphere_wall, 2u);
  EXPECT_DOUBLE_EQ(p.v[0][0], 1.0);  // twice the rate of the radius
  EXPECT_DOUBLE_EQ(p.v[1][0], -1.0);

  // Two discs at rest at a distance of 2, far from the walls: they touch at t = 1 and separate at twice the rate of σ =
  // 1 + t.
  auto pair = test::make_system<2>({10, 9}, W, {{4, 4.5}, {6, 4.5}}, {{0, 0}, {0, 0}});
  EventCore<2> other(pair->box);
  other.load(pair->particles, Vec<2>::Zero(), 1.2, 1.0);
  other.run(1.2, {.counters = counters});
  other.copy_at(1.2, p);
  EXPECT_EQ(counters.sphere_sphere, 1u);
  EXPECT_DOUBLE_EQ(p.v[0][0], -1.0);
  EXPECT_DOUBLE_EQ(p.v[1][0], 1.0);
}

TEST(EventCore, NewtonsCradlePassesTheBlowThroughAChainInContact) {
  auto system = test::make_system<2>({20, 4}, W, {{2, 2}, {6, 2}, {7, 2}, {8, 2}, {9, 2}},
                                     {{1, 0}, {0, 0}, {0, 0}, {0, 0}, {0, 0}});
  Counters counters;
  std::vector<Contact<2>> contacts;
  EventCore<2> core(system->box);
  core.load(system->particles, Vec<2>::Zero(), 5);
  core.run(5, {.counters = counters, .contacts = &contacts});
  Particles<2> p = system->particles;
  core.copy_at(5, p);
  ASSERT_EQ(contacts.size(), 4u);
  for (std::uint32_t k = 0; k < 4; ++k) {
    EXPECT_EQ(contacts[k].key.time, 3.0);
    EXPECT_EQ(contacts[k].key.generation, k == 0 ? 0u : k);
    EXPECT_EQ(contacts[k].key.lo, k);
  }
  EXPECT_EQ(p.v[4], Vec<2>(1, 0));
  EXPECT_EQ(p.x[4], Vec<2>(11, 2));
  for (int i = 0; i < 4; ++i) EXPECT_EQ(p.v[i], Vec<2>(0, 0));
}

TEST(EventCore, ASphereAtRestOnAWallUnderAFieldIsAnErrorThatNamesIt) {
  auto system = test::make_system<2>({4, 4}, W, {{2, 0.5}}, {{0.3, 0}});
  EventCore<2> core(system->box);
  try {
    core.load(system->particles, Vec<2>(0, -1), 1);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.failure(), Failure::numerical);
    EXPECT_NE(std::string(error.what()).find("particle 0 rests or slides on the lower wall of axis 1"),
              std::string::npos);
  }
}

TEST(EventCore, MoreEventsThanAllowedIsAnErrorThatNamesThePair) {
  auto system = test::make_system<2>({6, 4}, W, {{1, 2}, {3, 2}}, {{1, 0}, {-1, 0}});
  Counters counters;
  EventCore<2> core(system->box);
  core.load(system->particles, Vec<2>::Zero(), 100);
  EXPECT_THROW(core.run(100, {.counters = counters, .max_events = 10}), Error);
}

TEST(EventCore, CountsWhatItDid) {
  const auto run = test::run_until<3>(test::hard_spheres<3>(4, 0.4), "free-flight", 1, 4);
  const Counters& all = run->statistics().counters;
  const EventCounts& events = all.events;
  EXPECT_GT(events.predictions, all.sphere_sphere);
  EXPECT_GT(events.candidates, events.predictions);
  EXPECT_GT(events.stale, 0u);
  EXPECT_GT(events.dropped, 0u);
  EXPECT_GT(events.scheduled, events.dropped + all.sphere_sphere);
  EXPECT_GT(events.crossings + events.rebuilds, 0u);
}

}  // namespace
}  // namespace carom::event_core_test
