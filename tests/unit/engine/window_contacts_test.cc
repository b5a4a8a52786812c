// The contacts of a window, however many subdomains there are, are those of one core.

#include "engine/ranks/window_contacts.h"

#include <gtest/gtest.h>

#include "tests/unit/engine/window_cases.h"

namespace carom {
namespace {

constexpr double kEnd = 0.12;

TEST(WindowContacts, AreThoseOfOneCore) {
  const auto system = random_system<3>(260, {14, 6, 6}, {P, P, W}, 0.5, 0.5, 11);
  const Sizes sizes(system->particles);
  std::vector<Contact<3>> whole;
  EventCore<3> core(system->box, &sizes, {});
  core.load(records_of(system->particles), Vec<3>::Zero(), kEnd, 0, 2 * kDisplacement);
  Counters counters;
  core.run(kEnd, {.counters = counters, .contacts = &whole});
  std::vector<EventKey<3>> collisions;
  for (const auto& contact : whole)
    if (contact.key.kind == EventKind::pair) collisions.push_back(contact.key);
  ASSERT_GT(collisions.size(), 50u);
  ASSERT_GT(whole.size(), collisions.size() + 10);

  std::vector<std::vector<Contact<3>>> parts(3);
  in_a_window(*system, sizes, kEnd, [&](Communicator& ranks, Subdomain<3>* subdomain, std::uint64_t) {
    const WindowContacts<3> contacts(system->box, subdomain);
    contacts.append_to(parts[static_cast<std::size_t>(ranks.rank())]);
    for (const std::size_t n : {std::size_t{1}, std::size_t{7}, collisions.size()})
      EXPECT_TRUE(contacts.key_of_collision(n, ranks) == collisions[n - 1]) << n;
    EXPECT_FALSE(contacts.key_of_collision(0, ranks));
    EXPECT_FALSE(contacts.key_of_collision(collisions.size() + 1, ranks));
  });
  EXPECT_TRUE(parts[2].empty());
  std::vector<Contact<3>> all = parts[0];
  all.insert(all.end(), parts[1].begin(), parts[1].end());
  std::ranges::sort(all, {}, &Contact<3>::key);
  expect_same<3>({whole, {}}, {all, {}}, "two subdomains");
}

}  // namespace
}  // namespace carom
