// SPDX-License-Identifier: BSD-3-Clause
// Subdomains on two ranks that exchange paths have equal paths, and those of one core.

#include "engine/ranks/path_exchange.h"

#include <gtest/gtest.h>

#include "tests/support/thread_ranks.h"
#include "tests/unit/engine/window_cases.h"

namespace carom {
namespace {

constexpr double kEnd = 0.12;

/// A collision sequence passes from one subdomain through a row of spheres into the other, which did not predict it.
TEST(PathExchange, MakesSubdomainsAgreeAboutAWindow) {
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
  in_a_window(*system, sizes, kEnd, [&](Communicator&, Subdomain<3>* subdomain, std::uint64_t rounds) {
    EXPECT_GE(rounds, 2u);
    if (!subdomain) return;
    EXPECT_TRUE(subdomain->paths().all_match());
    const std::lock_guard lock(mutex);
    for (const Slot i : subdomain->own()) {
      const Record<3>& r = subdomain->paths().after(i);
      EXPECT_EQ(r.x, right[r.id].x) << r.id;
      EXPECT_EQ(r.v, right[r.id].v) << r.id;
      ++own;
    }
  });
  EXPECT_EQ(own, system->size());
}

TEST(PathExchange, BringsValuesToNeighbours) {
  test::ThreadRanks(4).run([](Communicator& ranks) {
    Communicator alone;
    std::vector<Vec<2>> x;
    for (int i = 0; i < 40; ++i) x.emplace_back(i + 0.5, 0.5);
    const Bisection<2> bisection({{40, 1}, {W, W}}, x, 3, 2, alone);
    PathExchange<2> exchange(ranks);
    exchange.start(bisection);
    const auto me = static_cast<std::uint32_t>(ranks.rank());
    std::size_t neighbours = 0;
    if (me < 3) neighbours = bisection.neighbours(me).size();
    for (std::size_t k = 0; k < neighbours; ++k) exchange.add(k, 100 * me + bisection.neighbours(me)[k]);
    const std::vector<Bytes> received = exchange.swap();
    ASSERT_EQ(received.size(), neighbours);
    for (std::size_t k = 0; k < neighbours; ++k)
      EXPECT_EQ(Reader(received[k]).get<std::uint32_t>(), 100 * bisection.neighbours(me)[k] + me);
    for (const Bytes& bytes : exchange.swap()) EXPECT_TRUE(bytes.empty());
  });
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
  in_a_window(*system, sizes, kEnd, [&](Communicator& ranks, Subdomain<3>* subdomain, std::uint64_t) {
    auto& found = parts[static_cast<std::size_t>(ranks.rank())];
    if (subdomain)
      subdomain->for_each_contact([&](Slot i, std::size_t k) { found.push_back(subdomain->paths().contact_of(i, k)); });
  });
  ASSERT_FALSE(parts[1].empty());
  std::vector<Contact<3>> all = parts[0];
  all.insert(all.end(), parts[1].begin(), parts[1].end());
  std::ranges::sort(all, {}, &Contact<3>::key);
  expect_same<3>({whole, {}}, {all, {}}, "two subdomains");
}

}  // namespace
}  // namespace carom
