#include "engine/events/event_search.h"

#include <gtest/gtest.h>

#include "engine/events/contact.h"
#include "tests/unit/engine/event_cases.h"

namespace carom {
namespace {

/// A search of its own, without a core.
template <int D>
struct Searched {
  Searched(std::unique_ptr<System<D>> spheres, const Vec<D>& g, SearchOptions::Method method)
      : system(std::move(spheres)),
        sizes(system->particles),
        flights(system->box),
        queue(flights),
        search(system->box, flights, queue, &sizes, {.method = method}) {
    std::vector<Record<D>> records;
    const Particles<D>& p = system->particles;
    for (Id i = 0; i < p.size(); ++i) records.push_back({p.x[i], p.v[i], 0.0, i, 0, p.species[i]});
    flights.load(records, sizes, g, kEnd);
    search.start(0, kDisplacement);
  }

  /// Calls visit(j, image) for all images near the box of the other spheres.
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
        if (there) visit(j, image);
      }
  }
  /// Compares what a sphere plans with what trying everything finds: nothing comes before, and it is not later than
  /// contacts before the sphere or the other one has its next event. Returns the first contact.
  double expect_planned(Slot i) const {
    double first = kNever, seen = kNever;
    for (const Wall<D>& wall : flights.walls()) first = std::min(first, flights.wall_contact(i, wall));
    seen = first;
    for_all_others(i, [&](Slot j, const Image<D>& image) {
      const double time = flights.pair_contact(i, j, system->box.shift(image));
      first = std::min(first, time);
      if (time < queue[i].update && time <= queue[j].due()) seen = std::min(seen, time);
    });
    EXPECT_GE(queue[i].contact, first) << i;
    EXPECT_LE(queue[i].contact, seen) << i;
    planned += seen < kEnd ? 1 : 0;
    return first;
  }

  static constexpr double kEnd = 1, kDisplacement = 0.1;
  std::unique_ptr<System<D>> system;
  Sizes sizes;
  Flights<D> flights;
  EventQueue<D> queue;
  EventSearch<D> search;
  Slot dismissed = kEmpty;
  mutable int planned = 0;  // contacts that expect_planned() found
};

constexpr auto kMethods = {SearchOptions::Method::lists, SearchOptions::Method::cells};

/// In the order of the queue up to the first contact: before it nothing changes but what spheres look at.
template <int D>
void expect_nothing_missed(Searched<D>& s) {
  double first = kNever;
  for (Slot i = 0; i < s.flights.size(); ++i) first = std::min(first, s.expect_planned(i));
  Slot i = 0;
  double now = 0;
  while (s.queue.next(Searched<D>::kEnd, i, now) && s.queue[i].update < s.queue[i].contact) {
    s.search.look_again(i, now);
    s.queue.settle();
    EXPECT_GE(s.queue[i].update, now);
  }
  EXPECT_EQ(now, first);
}

TEST(EventSearch, PlansTheContactsThatTryingEverythingFinds) {
  for (const auto method : kMethods) {
    Searched<2> flat(random_system<2>(40, {9, 9}, {P, P}, 0.2, 0.5, 1), Vec<2>::Zero(), method);
    expect_nothing_missed(flat);
    Searched<3> walled(random_system<3>(60, {6, 5, 6}, {P, W, P}, 0.3, 0.5, 2), Vec<3>::Zero(), method);
    expect_nothing_missed(walled);
    Searched<2> field(random_system<2>(40, {9, 9}, {P, W}, 0.5, 0.5, 3), Vec<2>(0, -1), method);
    expect_nothing_missed(field);
  }
}

TEST(EventSearch, KnowsSpheresThatComeMoveAndGo) {
  for (const auto method : kMethods) {
    Searched<3> s(random_system<3>(80, {6, 6, 6}, {P, P, P}, 0.5, 0.5, 4), Vec<3>::Zero(), method);
    const auto plan_all = [&] {
      for (Slot i = 0; i < s.flights.size(); ++i) {
        if (i != s.dismissed) s.search.plan(i, 0);
        s.queue.settle();
      }
      for (Slot i = 0; i < s.flights.size(); ++i)
        if (i != s.dismissed) s.expect_planned(i);
    };
    Record<3> moved = s.flights[3];
    moved.v *= -2.0;
    s.flights.set(3, moved);
    s.search.move(3, 0);
    plan_all();
    s.search.dismiss(7);
    s.dismissed = 7;
    plan_all();
    s.dismissed = kEmpty;
    s.queue.admit(7);
    s.search.admit(7, 0.5, 0);
    s.expect_planned(7);
    plan_all();
    EXPECT_GT(s.planned, 40);
  }
}

TEST(EventSearch, FindsAllThatASphereMayTouchInAWindow) {
  for (const auto method : kMethods) {
    Searched<3> s(random_system<3>(120, {7, 6, 5}, {P, P, W}, 0.3, 0.5, 5), Vec<3>::Zero(), method);
    std::size_t found = 0;
    for (Slot i = 0; i < s.flights.size(); ++i) {
      const auto near = s.search.find_near(i);
      s.for_all_others(i, [&](Slot j, const Image<3>& image) {
        const double reach = s.flights.radii(0)[i] + s.flights.radii(0)[j] + 2 * Searched<3>::kDisplacement;
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
}  // namespace carom
