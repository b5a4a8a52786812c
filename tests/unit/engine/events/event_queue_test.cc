// SPDX-License-Identifier: BSD-3-Clause
#include "engine/events/event_queue.h"

#include <gtest/gtest.h>

#include "engine/events/contact.h"
#include "tests/unit/engine/events/event_cases.h"

namespace carom::event_queue_test {
namespace {

/// Spheres of diameter 1 with the given positions, all at rest, in slots that are their ids.
struct Spheres {
  explicit Spheres(const std::vector<Vec<2>>& x)
      : system(test::make_system<2>({40, 40}, O, x, std::vector<Vec<2>>(x.size(), Vec<2>::Zero()))),
        flights(system->box),
        queue(flights) {
    std::vector<Id> ids(x.size());
    for (Id i = 0; i < x.size(); ++i) ids[i] = i;
    flights.assign(ids);
    flights.load(system->particles, Vec<2>::Zero(), 10, 0);
    queue.clear();
  }
  /// Plans a contact of sphere i with sphere j, which has had `since` collisions after that.
  void plan(Slot i, double at, Slot j, std::uint32_t since = 0) {
    queue.offer(i, at, EventKind::pair, flights.packing().pack(j, 0));
    queue[i].partner_version -= since;
  }
  /// Removes the next event before 10 and returns its sphere.
  Slot next() {
    Slot i = 0;
    return queue.next(10, i, time) ? i : kNone;
  }

  static constexpr Slot kNone = 1000;
  std::unique_ptr<System<2>> system;
  Flights<2> flights;
  EventQueue<2> queue;
  double time = 0;
};

TEST(EventQueue, OfTwoContactsKeepsTheOneThatComesFirst) {
  Spheres s({{1, 1}, {3, 1}, {5, 1}, {7, 1}});
  s.plan(1, 2.0, 2);
  s.plan(1, 3.0, 0);
  EXPECT_EQ(s.queue.key_of(1).hi, 2u);
  s.plan(1, 1.0, 3);
  EXPECT_EQ(s.queue.key_of(1).hi, 3u);
  s.plan(1, 1.0, 2);  // the key of the pair (1, 2) is less than that of (1, 3)
  EXPECT_EQ(s.queue.key_of(1).hi, 2u);
  s.plan(1, 1.0, 3);
  EXPECT_EQ(s.queue.key_of(1).hi, 2u);
  s.queue.offer(1, 1.0, EventKind::wall, 3);
  EXPECT_EQ(s.queue.key_of(1).kind, EventKind::pair);
  s.queue.offer(1, 0.5, EventKind::wall, 3);
  EXPECT_EQ(s.queue.key_of(1).kind, EventKind::wall);
}

TEST(EventQueue, ServesEventsAtOneInstantByTheirKeysStalePlansFirst) {
  std::vector<Vec<2>> x;
  for (int i = 0; i < 10; ++i) x.push_back({1.0 + 2 * i, 1});
  Spheres s(x);
  s.plan(8, 1.0, 9);
  s.plan(4, 1.0, 5);
  s.plan(6, 1.0, 7, 1);  // stale
  s.plan(2, 1.0, 3);
  s.queue[0].update = 1.0;
  s.plan(1, 0.5, 0);
  s.queue.fill(0, 10, 0);
  std::vector<Slot> order;
  for (int k = 0; k < 6; ++k) order.push_back(s.next());
  EXPECT_EQ(order, (std::vector<Slot>{1, 6, 2, 4, 8, 0}));
  EXPECT_EQ(s.time, 1.0);
  EXPECT_EQ(s.next(), Spheres::kNone);
}

TEST(EventQueue, APlanThatChangesAtItsInstantIsServedWhenItsNewOneComes) {
  Spheres s({{1, 1}, {3, 1}, {5, 1}, {7, 1}, {9, 1}, {11, 1}});
  s.plan(0, 1.0, 1);
  s.plan(2, 1.0, 3);
  s.plan(4, 1.0, 5);
  s.queue.fill(0, 10, 0);
  EXPECT_EQ(s.next(), 0u);
  s.queue[4].contact = kNever;
  s.plan(4, 2.0, 5);
  s.queue.schedule(4);
  EXPECT_EQ(s.next(), 2u);
  EXPECT_EQ(s.time, 1.0);
  EXPECT_EQ(s.next(), 4u);
  EXPECT_EQ(s.time, 2.0);
}

TEST(EventQueue, ServesAContactThatBothPartnersPlanOnce) {
  Spheres s({{1, 1}, {3, 1}, {5, 1}});
  s.plan(0, 1.0, 1);
  s.plan(1, 1.0, 0);
  s.queue.fill(0, 10, 0);
  s.plan(2, 2.0, 1);
  s.queue.schedule(2);
  EXPECT_LT(s.next(), 2u);
  EXPECT_EQ(s.next(), 2u);
  EXPECT_EQ(s.next(), Spheres::kNone);
}

TEST(EventQueue, ReadsThePartnersVersionWhenItSettles) {
  Spheres s({{1, 1}, {3, 1}, {5, 1}});
  s.queue.plan_pair(0, 1.0, s.flights.packing().pack(1, 0));
  ++s.queue[1].version;  // in the same event
  EXPECT_TRUE(s.queue.stale(s.queue[0]));
  s.queue.read_versions();
  EXPECT_FALSE(s.queue.stale(s.queue[0]));
  ++s.queue[1].version;
  s.queue.read_versions();
  EXPECT_TRUE(s.queue.stale(s.queue[0]));
}

TEST(EventQueue, LeavesOutWhatASphereNoLongerPlans) {
  Spheres s({{1, 1}, {3, 1}, {5, 1}});
  s.plan(0, 3.0, 1);
  s.queue.fill(0, 10, 0);
  s.plan(0, 2.0, 2);
  s.queue.schedule(0);
  EXPECT_EQ(s.next(), 0u);
  EXPECT_EQ(s.time, 2.0);
  EXPECT_EQ(s.next(), Spheres::kNone);
}

}  // namespace
}  // namespace carom::event_queue_test
