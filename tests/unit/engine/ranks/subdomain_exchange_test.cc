// SPDX-License-Identifier: BSD-3-Clause
// Subdomains on two ranks that exchange paths have equal paths, and those of one core.

#include <gtest/gtest.h>

#include "tests/unit/engine/ranks/window_cases.h"

namespace carom::subdomain_exchange_test {
namespace {

constexpr double kEnd = 0.12;

/// A collision sequence passes from one subdomain through a row of spheres into the other, which did not predict it.
TEST(Subdomain, MakesSubdomainsAgreeAboutAWindow) {
  std::vector<Vec<3>> x, v(16, Vec<3>::Zero());
  for (int i = 0; i < 16; ++i) x.push_back({2.0 + 1.001 * i, 3, 3});
  v[0][0] = 3;
  const auto system = test::make_system<3>({20, 6, 6}, P, x, v);
  const Sizes sizes(system->particles);
  EventCore<3> core(system->box, &sizes, {});
  core.load(records_of(system->particles), Vec<3>::Zero(), kEnd, 0, 2 * kDisplacement);
  Counters counters;
  core.run(kEnd, {.counters = counters});
  std::vector<Record<3>> right(system->size());
  for (const Record<3>& r : core.flights().records()) right[r.id] = r;

  std::size_t own = 0;
  std::mutex mutex;
  in_a_window(*system, sizes, kEnd, [&](Communicator&, Subdomain<3>& subdomain, std::uint64_t rounds) {
    EXPECT_GE(rounds, 2u);
    EXPECT_TRUE(subdomain.paths().all_match());
    const std::lock_guard lock(mutex);
    for (const Slot i : subdomain.own()) {
      const Record<3>& r = subdomain.paths().after(i);
      EXPECT_EQ(r.x, right[r.id].x) << r.id;
      EXPECT_EQ(r.v, right[r.id].v) << r.id;
      ++own;
    }
  });
  EXPECT_EQ(own, system->size());
}

TEST(Subdomain, HasTheContactsOfOneCore) {
  const auto system = random_system<3>(260, {14, 6, 6}, {P, P, W}, 0.5, 0.5, 11);
  const Sizes sizes(system->particles);
  std::vector<Contact<3>> whole;
  EventCore<3> core(system->box, &sizes, {});
  core.load(records_of(system->particles), Vec<3>::Zero(), kEnd, 0, 2 * kDisplacement);
  Counters counters;
  core.run(kEnd, {.counters = counters, .contacts = &whole});
  const auto walls = std::ranges::count(whole, EventKind::wall, [](const auto& contact) { return contact.key.kind; });
  ASSERT_GT(walls, 10);
  ASSERT_GT(whole.size(), static_cast<std::size_t>(walls) + 50);

  std::vector<std::vector<Contact<3>>> parts(3);
  in_a_window(*system, sizes, kEnd, [&](Communicator& ranks, Subdomain<3>& subdomain, std::uint64_t) {
    auto& found = parts[static_cast<std::size_t>(ranks.rank())];
    subdomain.for_each_contact([&](Slot i, std::size_t k) { found.push_back(subdomain.paths().contact_of(i, k)); });
  });
  ASSERT_FALSE(parts[1].empty());
  std::vector<Contact<3>> all = parts[0];
  all.insert(all.end(), parts[1].begin(), parts[1].end());
  std::ranges::sort(all, {}, &Contact<3>::key);
  expect_same<3>({whole, {}}, {all, {}}, "two subdomains");
}

}  // namespace
}  // namespace carom::subdomain_exchange_test
