// SPDX-License-Identifier: BSD-3-Clause
#include "engine/events/event_search.h"

#include <gtest/gtest.h>

#include "engine/events/contact.h"
#include "tests/unit/engine/events/event_cases.h"

namespace carom::event_search_test {
namespace {

/// An EventSearch without an EventCore.
template <int D>
struct Searched {
  /// `elsewhere`: spheres of the system that this search does not have.
  Searched(std::unique_ptr<System<D>> spheres, const Vec<D>& g, const SearchOptions& options, double displacement = 0.1,
           std::size_t elsewhere = 0)
      : system(std::move(spheres)),
        sizes(system->particles),
        flights(system->box),
        queue(flights),
        search(system->box, flights, queue, &sizes, options) {
    sizes.spheres += elsewhere;
    std::vector<Record<D>> records;
    const Particles<D>& p = system->particles;
    for (Id i = 0; i < p.size(); ++i) {
      const double s = system->box.walls().empty() ? 0.1 * (i % 3) : 0;  // since its record; it passes no wall
      records.push_back({p.x[i] - s * p.v[i] + (0.5 * s * s) * g, p.v[i] - s * g, kStart - s, i, 0, p.species[i]});
    }
    flights.load(records, sizes, g, kEnd);
    search.start(kStart, displacement);
  }

  /// Calls visit(j, image) for all other spheres in all images near the box.
  template <class Visit>
  void for_all_others(Slot i, Visit&& visit) const {
    for (Slot j = 0; j < flights.size(); ++j)
      for (int code = 0; code < std::pow(5, D); ++code) {
        Image<D> image;
        bool there = j != i && j != dismissed;
        for (int k = 0, digits = code; k < D; ++k, digits /= 5) {
          image[k] = digits % 5 - 2;
          there = there && (image[k] == 0 || system->box.periodic(k));
        }
        // Where the images of a row are.
        const Box<D>& box = system->box;
        image[0] -= static_cast<int>(std::nearbyint(image[1] * (box.tilt + kStart * box.slide()) / box.edges[0]));
        if (there) visit(j, image);
      }
  }
  /// Compares a sphere's plan with a search by brute force: no contact comes before it, and it is not later than a
  /// contact before the next events of both spheres. Returns the first contact.
  double expect_planned(Slot i) const {
    double first = kNever, seen = kNever;
    flights.visit_lone_events(i, flights[i], [&](double time, EventKind, Id) { first = std::min(first, time); });
    seen = first;
    for_all_others(i, [&](Slot j, const Image<D>& image) {
      const double time = flights.pair_contact(i, j, system->box.offset(image));
      first = std::min(first, time);
      if (time < queue[i].update && time <= queue[j].due()) seen = std::min(seen, time);
    });
    EXPECT_GE(queue[i].contact, first) << i;
    EXPECT_LE(queue[i].contact, seen) << i;
    EXPECT_GE(queue[i].update, kStart) << i;
    planned += seen < kEnd ? 1 : 0;
    return first;
  }

  /// The first contact by brute force.
  double first_contact() const {
    double first = kNever;
    for (Slot i = 0; i < flights.size(); ++i) {
      flights.visit_lone_events(i, flights[i], [&](double time, EventKind, Id) { first = std::min(first, time); });
      for_all_others(i, [&](Slot j, const Image<D>& image) {
        if (i < j) first = std::min(first, flights.pair_contact(i, j, system->box.offset(image)));
      });
    }
    return first;
  }

  static constexpr double kStart = 2, kEnd = 3;
  std::unique_ptr<System<D>> system;
  Sizes sizes;
  Flights<D> flights;
  EventQueue<D> queue;
  EventSearch<D> search;
  Slot dismissed = kEmpty;
  mutable int planned = 0;  // contacts that expect_planned() found
};

constexpr SearchOptions kLists{.method = SearchOptions::Method::lists}, kCells{.method = SearchOptions::Method::cells};
constexpr auto kMethods = {kLists, kCells};
/// For spheres with radii from 0.2 to 0.5.
constexpr auto kMethodsOfMixtures = {
    kLists, kCells, SearchOptions{.method = SearchOptions::Method::small_cells, .skin = 0.2, .cell = 0.6, .small = 0.3},
    SearchOptions{.method = SearchOptions::Method::small_cells, .skin = 0.7, .cell = 0.9, .small = 0.45}};

/// Executes the queue up to the first contact: before it only neighbourhoods change.
template <int D>
void expect_nothing_missed(Searched<D>& s) {
  double first = kNever;
  for (Slot i = 0; i < s.flights.size(); ++i) first = std::min(first, s.expect_planned(i));
  Slot i = 0;
  double now = Searched<D>::kStart;
  while (s.queue.next(Searched<D>::kEnd, i, now) && s.queue[i].update < s.queue[i].contact) {
    s.search.look_again(i, now);
    s.queue.read_versions();
    EXPECT_GE(s.queue[i].update, now);
  }
  EXPECT_EQ(now, first);
}

/// When spheres have been wrapped, their regions move with them, so that lists need not be made again.
TEST(EventSearch, RegionsFollowSpheresThatWereWrapped) {
  auto spheres = random_system<3>(300, {9, 10, 11}, {P, P, P}, 0.4, 0.4, 5);
  for (Vec<3>& v : spheres->particles.v) v *= 0.05;  // they stay in their regions
  Searched<3> s(std::move(spheres), Vec<3>::Zero(), kLists);
  std::vector<Vec<3>> centre, shift;
  const auto centre_of = [&](Slot i) {
    return Vec<3>(s.queue[i].where.centre[0], s.queue[i].where.centre[1], s.queue[i].where.centre[2]);
  };
  for (Slot i = 0; i < s.flights.size(); ++i) {
    centre.push_back(centre_of(i));
    shift.push_back(s.system->box.shift({i % 2 == 0 ? 1 : -1, i % 3 == 0 ? 1 : 0, 0}));
    Record<3> r = s.flights[i];
    r.x += shift[i];
    s.flights.set(i, r, {});
  }
  s.search.start(Searched<3>::kStart, 0.1);
  int displaced = 0;
  for (Slot i = 0; i < s.flights.size(); ++i) {
    const double from_centre = (s.flights[i].x - shift[i] - centre[i]).norm();
    if (from_centre > 0.02) continue;
    EXPECT_LT((centre_of(i) - centre[i] - shift[i]).norm(), 1e-12) << i;
    displaced += from_centre > 1e-3 ? 1 : 0;
  }
  EXPECT_GT(displaced, 5);
}

TEST(EventSearch, PlansTheContactsThatTryingEverythingFinds) {
  for (const auto& method : kMethods) {
    Searched<2> flat(random_system<2>(40, {9, 9}, {P, P}, 0.2, 0.5, 1), Vec<2>::Zero(), method);
    expect_nothing_missed(flat);
    Searched<3> walled(random_system<3>(60, {6, 5, 6}, {P, W, P}, 0.3, 0.5, 2), Vec<3>::Zero(), method);
    expect_nothing_missed(walled);
    Searched<2> field(random_system<2>(40, {9, 9}, {P, W}, 0.5, 0.5, 3), Vec<2>(0, -1), method);
    expect_nothing_missed(field);
  }
}

/// The spheres of a random system, with the velocities of the flow in a sheared box.
template <int D>
std::unique_ptr<System<D>> sheared(std::unique_ptr<System<D>> system, double rate) {
  system->box.shear_rate = rate;
  Particles<D>& p = system->particles;
  for (std::size_t i = 0; i < p.size(); ++i) p.v[i][0] += system->box.flow(p.x[i]);
  system->box.pass(Searched<D>::kStart, 0, -Searched<D>::kStart);  // no tilt when the search starts
  return system;
}

/// Executes the queue like EventCore: each contact is the first one that brute force finds.
template <int D>
void expect_contacts(Searched<D>& s, int contacts) {
  Slot i = 0;
  double now = 0;
  for (int events = 0; events < 10000 && contacts > 0 && s.queue.next(Searched<D>::kEnd, i, now); ++events) {
    s.queue.read_versions();
    const NextEvent<D> a = s.queue[i];
    if (a.update < a.contact) {
      s.search.look_again(i, now);
    } else if (s.queue.stale(a)) {
      s.search.plan(i, now);
    } else {
      ASSERT_EQ(now, s.first_contact()) << contacts;
      --contacts;
      ++s.queue[i].version;
      if (a.kind == EventKind::wall) {
        s.flights.meet_alone({.time = now, .kind = a.kind, .lo = s.flights[i].id, .hi = a.partner}, i);
        s.search.plan(i, now);
      } else {
        const Slot j = s.flights.packing().slot(a.partner);
        s.flights.collide(i, j, s.system->box.offset(s.flights.packing().image(a.partner)), now, 0);
        ++s.queue[j].version;
        s.search.plan_two(i, j, now);
      }
    }
  }
  EXPECT_EQ(contacts, 0);
}

TEST(EventSearch, PlansAnewAfterContacts) {
  for (const auto& method : kMethods) {
    Searched<2> flat(random_system<2>(30, {9, 7}, {P, P}, 0.3, 0.5, 6), Vec<2>::Zero(), method);
    expect_contacts(flat, 30);
    Searched<2> equal(random_system<2>(30, {9, 7}, {P, P}, 0.4, 0.4, 7), Vec<2>::Zero(), method);
    expect_contacts(equal, 30);
    Searched<3> walled(random_system<3>(30, {5, 4, 4}, {P, W, W}, 0.3, 0.5, 8), Vec<3>::Zero(), method);
    expect_contacts(walled, 30);
    Searched<2> field(random_system<2>(30, {7, 9}, {P, W}, 0.3, 0.5, 9), Vec<2>(0, -1), method);
    expect_contacts(field, 30);
  }
}

TEST(EventSearch, PlansContactsInAShearedBox) {
  const SearchOptions lists;
  for (const double rate : {0.7, -1.3}) {
    Searched<2> flat(sheared(random_system<2>(40, {9, 9}, {P, P}, 0.2, 0.5, 1), rate), Vec<2>::Zero(), lists);
    expect_nothing_missed(flat);
    Searched<3> equal(sheared(random_system<3>(60, {6, 5, 6}, {P, P, P}, 0.4, 0.4, 2), rate), Vec<3>::Zero(), lists);
    expect_nothing_missed(equal);
    Searched<3> walled(sheared(random_system<3>(60, {6, 5, 6}, {P, P, W}, 0.3, 0.5, 2), rate), Vec<3>(0, 0, -1), lists);
    expect_nothing_missed(walled);
    Searched<2> many(sheared(random_system<2>(30, {9, 7}, {P, P}, 0.4, 0.4, 7), rate), Vec<2>::Zero(), lists);
    expect_contacts(many, 30);
    Searched<3> sizes(sheared(random_system<3>(30, {5, 4, 4}, {P, P, W}, 0.3, 0.5, 8), rate), Vec<3>::Zero(), lists);
    expect_contacts(sizes, 30);
  }
}

/// Only cells near the spheres are stored, up to three beyond them, and spheres come to the outermost ones. With nine
/// parts, rows of cells have too many patterns, and all cells are stored.
TEST(EventSearch, FindsContactsInScatteredParts) {
  for (const auto& method : kMethods)
    for (const int parts : {2, 9}) {
      auto system = random_system<3>(100, {18, 5, 5}, {P, P, P}, 0.5, 0.5, 12);
      system->box.edges[0] = 150;
      const auto part = [&](const Vec<3>& x) { return static_cast<int>(std::floor(x[0] * parts / 150)); };
      for (Vec<3>& x : system->particles.x) x[0] += std::floor(x[0] * parts / 18) * 132 / parts;
      Searched<3> s(std::move(system), Vec<3>::Zero(), method, 0.1, 500'000);
      const double now = s.kStart, cell = 150.0 / 149;
      for (int k = 0; k < parts; ++k) {  // the last two spheres of each part
        std::vector<std::pair<double, Slot>> members;
        for (Slot i = 0; i < s.flights.size(); ++i)
          if (const Vec<3> x = s.flights.at(i, now).x; part(x) == k) members.emplace_back(x[0], i);
        std::ranges::sort(members);
        const Vec<3> last = s.flights.at(members.back().second, now).x + Vec<3>(3 * cell, 0, 0);
        for (const auto& [i, away] : {std::pair(members.back().second, 0.0), {members.end()[-2].second, 1.5}}) {
          const Record<3> r = s.flights.at(i, now);
          s.flights.set(i, {last - Vec<3>(away, 0.3, 0), {away, 0, 0.1}, now, r.id, 0, r.species}, {});
          s.search.move(i, now);
        }
      }
      for (Slot i = 0; i < s.flights.size(); ++i) {
        s.search.plan(i, now);
        s.queue.read_versions();
      }
      for (Slot i = 0; i < s.flights.size(); ++i) s.expect_planned(i);
      expect_contacts(s, 10 + parts);
    }
}

TEST(EventSearch, KnowsSpheresThatComeMoveAndGo) {
  for (const auto& method : kMethodsOfMixtures) {
    Searched<3> s(random_system<3>(60, {4.8, 4.8, 4.8}, {P, P, P}, 0.2, 0.5, 4), Vec<3>::Zero(), method);
    const double now = s.kStart;
    const auto plan_all = [&] {
      for (Slot i = 0; i < s.flights.size(); ++i) {
        if (i != s.dismissed) s.search.plan(i, now);
        s.queue.read_versions();
      }
      for (Slot i = 0; i < s.flights.size(); ++i)
        if (i != s.dismissed) s.expect_planned(i);
    };
    const Vec<3> x = s.flights.at(3, now).x, other = s.flights.at(40, now).x;
    for (const auto& [i, at] : {std::pair<Slot, Vec<3>>{3, other}, {40, x}}) {  // they exchange positions
      s.flights.set(i, {at, -2.0 * s.flights[i].v, now, s.flights[i].id, 0, s.flights[i].species}, {});
      s.search.move(i, now);
    }
    plan_all();
    const auto reaches = s.flights.reaches(0);
    const auto [least, most] = std::ranges::minmax_element(reaches);
    for (const auto& extreme : {least, most}) {
      const auto i = static_cast<Slot>(extreme - reaches.begin());
      s.search.dismiss(i);
      s.dismissed = i;
      plan_all();
      s.dismissed = kEmpty;
      s.queue.admit(i);
      s.search.admit(i, reaches[i], now);
      s.expect_planned(i);
      plan_all();
    }
    EXPECT_GT(s.planned, 40);
    expect_contacts(s, 60);
  }
}

TEST(EventSearch, FindsAllThatASphereMayTouchInAWindow) {
  for (const auto& method : kMethodsOfMixtures)
    for (const double displacement : {0.1, 1.0}) {
      Searched<3> s(random_system<3>(70, {6, 5, 4}, {P, P, W}, 0.2, 0.5, 5), Vec<3>::Zero(), method, displacement);
      std::size_t found = 0;
      for (Slot i = 0; i < s.flights.size(); ++i) {
        const auto near = s.search.find_near(i);
        s.for_all_others(i, [&](Slot j, const Image<3>& image) {
          const double reach = s.flights.reaches(0)[i] + s.flights.reaches(0)[j] + 2 * displacement;
          if ((s.flights[i].x - s.flights[j].x + s.system->box.shift(image)).norm() > reach) return;
          const auto& packing = s.flights.packing();
          EXPECT_TRUE(std::ranges::count(near, packing.pack(j, packing.linear(image))) == 1) << i << ' ' << j;
          ++found;
        });
      }
      EXPECT_GT(found, s.flights.size());
    }
}

}  // namespace
}  // namespace carom::event_search_test
