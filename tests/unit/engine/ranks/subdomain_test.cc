// SPDX-License-Identifier: BSD-3-Clause
#include "engine/ranks/subdomain.h"

#include <gtest/gtest.h>

#include "engine/ranks/communicator.h"
#include "tests/unit/engine/events/event_cases.h"

namespace carom::subdomain_test {
namespace {

constexpr double kEnd = 0.12, kDisplacement = 0.5;  // of a window

/// The parts of a subdomain.
struct Parts {
  Parts(EventCore<3>& loaded, const Box<3>& box, const Bisection<3>& bisection, std::uint32_t number)
      : core(loaded),
        ownership(core, bisection, number, kDisplacement),
        paths(box, core.flights(), ownership),
        repair(box, core, ownership, paths) {}
  EventCore<3>& core;
  Ownership<3> ownership;
  WindowPaths<3> paths;
  WindowRepair<3> repair;
  std::vector<Slot> changed;
  std::uint64_t redone = 0;
};

std::unique_ptr<System<3>> fluid() { return random_system<3>(320, {14, 6, 6}, {P, P, P}, 0.5, 0.5, 11); }

/// A system in two subdomains, each with all spheres it needs, and one core with all spheres.
struct Divided {
  explicit Divided(std::unique_ptr<System<3>> spheres = fluid(), const Vec<3>& g = Vec<3>::Zero())
      : system(std::move(spheres)),
        sizes(system->particles),
        bisection(system->box, system->particles.x, 2, 2 * (sizes.largest_radius() + kDisplacement), alone, {},
                  sizes.largest_radius()),
        whole(system->box, &sizes, {}) {
    const Particles<3>& p = system->particles;
    std::vector<Record<3>> records;
    for (Id i = 0; i < p.size(); ++i) records.push_back({p.x[i], p.v[i], 0.0, i, 0, p.species[i]});
    whole.load(records, g, kEnd, 0, 2 * kDisplacement);
    for (std::uint32_t number : {0u, 1u}) {
      EventCore<3>& core = *cores.emplace_back(std::make_unique<EventCore<3>>(system->box, &sizes, SearchOptions{}));
      core.load(records, g, kEnd, 0, 2 * kDisplacement);
      Parts& part = *parts.emplace_back(std::make_unique<Parts>(core, system->box, bisection, number));
      part.ownership.sort_out(0, 0, [](std::size_t, const Record<3>&) {});
    }
  }
  /// The first run of a window.
  void run() {
    Counters unused;
    whole.run(kEnd, {.counters = unused});
    for (const auto& part : parts) {
      part->core.run(kEnd, {.counters = unused, .trace = &part->paths.start_log()});
      part->changed = part->paths.link_log();
    }
  }
  /// Sends the changed paths; returns their number.
  std::size_t send_paths() {
    std::size_t sent = 0;
    for (const int from : {0, 1})
      for (const Slot i : parts[from]->changed) {
        EXPECT_EQ(parts[from]->ownership.holders(i), 1u);  // it has only one neighbour
        Parts& to = *parts[1 - from];
        Bytes& bytes = messages.emplace_back();
        parts[from]->paths.write(i, bytes);
        Reader reader(bytes);
        to.paths.read_script(reader);
        EXPECT_FALSE(reader.more());
        ++sent;
      }
    return sent;
  }
  /// Sends changed paths and repairs both subdomains until no path changes; returns the number of rounds.
  int make_consistent() {
    int rounds = 0;
    for (; send_paths() > 0; ++rounds)
      for (const auto& part : parts) {
        part->changed = part->repair.run(kEnd);
        part->redone += part->repair.events();
        std::erase_if(part->changed, [&](Slot i) { return !part->ownership.is_seen(i); });
      }
    return rounds;
  }
  /// The number of own spheres that differ from the whole system's.
  std::size_t wrong() const {
    std::vector<Record<3>> right(system->size());
    for (const Record<3>& r : whole.flights().records()) right[r.id] = r;
    std::size_t wrong = 0, own = 0;
    for (const auto& part : parts)
      for (const Slot i : part->ownership.own()) {
        const Record<3>& r = part->paths.after(i);
        wrong += r.x == right[r.id].x && r.v == right[r.id].v && r.t == right[r.id].t ? 0 : 1;
        ++own;
      }
    EXPECT_EQ(own, system->size());
    return wrong;
  }

  Communicator alone;
  std::unique_ptr<System<3>> system;
  Sizes sizes;
  Bisection<3> bisection;
  EventCore<3> whole;
  std::vector<std::unique_ptr<EventCore<3>>> cores;
  std::vector<std::unique_ptr<Parts>> parts;
  std::deque<Bytes> messages;
};

/// Expects that each sphere is owned by the subdomain that contains it at this time, and that its owner knows whether
/// it is a ghost in the other. Returns the number of ghosts.
std::size_t expect_owners(const Divided& d, double time) {
  std::size_t ghosts = 0;
  for (Id id = 0; id < d.system->size(); ++id) {
    int owners = 0;
    for (const int k : {0, 1}) {
      const Ownership<3>&here = d.parts[k]->ownership, &there = d.parts[1 - k]->ownership;
      if (!here.owns_id(id)) continue;
      ++owners;
      const Slot other = there.slot_of(id);
      const bool ghost = other != IdTable::kNowhere && there.is_ghost(other);
      EXPECT_EQ(here.holders(here.slot_of(id)) != 0, ghost) << id;
      EXPECT_EQ(here.is_seen(here.slot_of(id)), ghost) << id;
      const Vec<3> x = d.bisection.wrapped(d.parts[k]->core.flights().at(here.slot_of(id), time).x);
      EXPECT_EQ(d.bisection.owner(x), static_cast<std::uint32_t>(k));
      const double reach = d.system->particles.radius[id] + d.sizes.largest_radius() + 2 * kDisplacement;
      EXPECT_EQ(d.bisection.squared_distance(static_cast<std::uint32_t>(1 - k), x) <= reach * reach, ghost) << id;
      ghosts += ghost ? 1 : 0;
    }
    EXPECT_EQ(owners, 1) << id;
  }
  return ghosts;
}

TEST(Ownership, EverySphereHasOneOwnerWhichKnowsWhereItIsAGhost) {
  Divided d;
  const std::size_t ghosts = expect_owners(d, 0);
  EXPECT_GT(ghosts, 50u);
  EXPECT_LT(ghosts, 280u);

  // A small sphere is a ghost only as far from the other subdomain as it can touch a largest sphere of it.
  const std::size_t of_sizes = expect_owners(Divided(random_system<3>(320, {14, 6, 6}, {P, P, P}, 0.1, 0.5, 11)), 0);
  EXPECT_GT(of_sizes, 50u);
  EXPECT_LT(of_sizes, ghosts - 20);
}

/// Spheres that start at rest change owners and become ghosts as soon as the field has moved them there.
TEST(Ownership, SpheresThatFallChangeTheirOwners) {
  constexpr int kWindows = 10;
  constexpr double length = kEnd / kWindows;
  std::unique_ptr<System<3>> at_rest = fluid();
  at_rest->particles.v.assign(at_rest->size(), Vec<3>::Zero());
  const Vec<3> g = {kDisplacement / (length * kEnd), 0, 0};
  const Divided d(std::move(at_rest), g);
  const std::vector<Slot> first = d.parts[0]->ownership.own();
  for (int window = 1; window <= kWindows; ++window) {
    const double now = window * length;
    std::array<std::vector<Record<3>>, 2> sent;
    for (const int k : {0, 1})
      d.parts[k]->ownership.sort_out(now, length, [&](std::size_t, const Record<3>& r) { sent[1 - k].push_back(r); });
    for (const int k : {0, 1})
      for (const Record<3>& r : sent[k]) ASSERT_TRUE(d.parts[k]->ownership.admit(r, now));
    expect_owners(d, now);
    if (HasFailure()) FAIL() << "in window " << window;
  }
  EXPECT_NE(d.parts[0]->ownership.own(), first);
}

/// A sphere that has moved with the flow since an old record may meet one that has come from far.
TEST(Ownership, UnderShearAGhostMeetsWhatIsNearAtTheEnd) {
  auto sheared = fluid();
  sheared->box.shear_rate = 0.2;
  const Divided d(std::move(sheared));
  const Ownership<3>& here = d.parts[0]->ownership;
  const double reach = d.bisection.reach(), end = 3;
  for (const Slot j : here.own()) {
    const Record<3> there = d.parts[0]->core.flights().at(j, end);
    for (const double part : {1 - 1e-9, 1.2}) {
      Record<3> ghost{there.x + part * reach * Vec<3>(0.6, 0, 0.8), Vec<3>::Zero(), 0.0, 0, 0, 0};
      ghost.v[0] = d.system->box.flow(ghost.x);
      ghost.x -= end * ghost.v;
      EXPECT_EQ(here.may_meet(ghost, j, {}, end), part < 1) << j;
    }
  }
}

/// A ghost that has just been admitted may collide as often in its first window as the log allows.
TEST(Ownership, AFreshGhostMayCollideManyTimes) {
  const Divided d;
  Ownership<3>& here = d.parts[0]->ownership;
  const Flights<3>& flights = d.cores[0]->flights();
  const auto& there = d.parts[1]->ownership;
  const std::vector<Slot> far = there.own();  // of these, the ones that are no ghosts here
  const auto unknown =
      std::ranges::find_if(far, [&](Slot i) { return here.slot_of(d.cores[1]->flights()[i].id) == IdTable::kNowhere; });
  ASSERT_NE(unknown, far.end());
  const Record<3> r = d.cores[1]->flights()[*unknown];
  ASSERT_TRUE(here.admit(r, 0));
  for (std::size_t k = 0; k < 10 * flights.capacity(); ++k) EXPECT_TRUE(here.note_event(here.slot_of(r.id)));
  here.sort_out(0, 0.01, [](std::size_t, const Record<3>&) {});  // it was too far to be a ghost
  EXPECT_EQ(here.slot_of(r.id), IdTable::kNowhere);
}

/// A sphere that is at rest before and after a window may have been fast between two events in it.
TEST(Ownership, ASphereWithSeveralEventsMayHaveMovedFar) {
  std::unique_ptr<System<3>> at_rest = fluid();
  at_rest->particles.v.assign(at_rest->size(), Vec<3>::Zero());
  const Divided d(std::move(at_rest));
  Parts& here = *d.parts[0];
  std::vector<Id> moved, sent;
  for (const Slot i : here.ownership.own()) {
    if (here.ownership.is_seen(i)) continue;
    for (const double way : {-0.9 * kDisplacement, 0.9 * kDisplacement}) {
      Record<3> r = here.core.flights()[i];
      r.x[0] += way;
      if (!d.bisection.near(1, d.bisection.wrapped(r.x))) continue;
      const std::array<EventCore<3>::Changed, 1> changed{{{i, r, {}}}};
      here.core.put(changed, 0);
      for (int event = 0; event < 2; ++event) EXPECT_TRUE(here.ownership.note_event(i));
      moved.push_back(r.id);
      break;
    }
  }
  here.ownership.sort_out(0.01, 0.01, [&](std::size_t, const Record<3>& r) { sent.push_back(r.id); });
  std::ranges::sort(moved);
  std::ranges::sort(sent);
  EXPECT_GT(moved.size(), 10u);
  EXPECT_EQ(sent, moved);
}

TEST(Ownership, AGhostMeetsWhatIsAsNearAsBothCanCome) {
  for (const Vec<3>& g : {Vec<3>(0, 0, 0), Vec<3>(2, -3, 6)}) {
    const Divided d(fluid(), g);
    const Ownership<3>& here = d.parts[0]->ownership;
    const double reach = d.bisection.reach(), end = 0.3, start = 0.05, left = end - start;
    std::size_t somewhere = 0, nowhere = 0;
    for (Id id = 0; id < d.system->size(); ++id) {
      const Record<3> r{d.system->particles.x[id], d.system->particles.v[id], start, id, 0, 0};
      const double way = (r.v.norm() + 0.5 * left * g.norm()) * left,
                   away = std::sqrt(d.bisection.squared_distance(0, r.x));
      Vec<3> low, high;
      const bool meets = here.meeting_place(here.slot_of(id), r, end, low, high);
      EXPECT_EQ(meets, away <= reach - kDisplacement + way) << id;
      ++(meets ? somewhere : nowhere);
      for (const Vec<3>& place : d.system->particles.x) {  // possible partners
        Vec<3> x = place - r.x;
        x = r.x + x + d.system->box.shift(d.system->box.nearest_image(x));
        const double from_here = std::sqrt(d.bisection.squared_distance(0, place));
        if (!meets || (x - r.x).norm() > reach + way || from_here > 3 * kDisplacement) continue;
        EXPECT_TRUE((low.array() <= x.array()).all() && (x.array() <= high.array()).all()) << id;
      }
      const Slot j = here.own()[0];
      const Record<3> there = d.parts[0]->core.flights().at(j, end);
      for (const double part : {1 - 1e-9, 1 + 1e-9}) {
        Record<3> ghost = r;
        ghost.x = there.x + part * (reach + way) * Vec<3>(0.6, 0, 0.8);
        EXPECT_EQ(here.may_meet(ghost, j, {}, end), part < 1) << id;
      }
    }
    EXPECT_GT(somewhere, 50u);
    EXPECT_GT(nowhere, 0u);
  }
}

TEST(WindowPaths, AScriptMatchesThePathWithTheSameNodesAndNoOther) {
  Divided d;
  d.run();
  WindowPaths<3>& paths = d.parts[0]->paths;
  const Ownership<3>& ownership = d.parts[0]->ownership;
  int compared = 0;
  const std::vector<Slot> ghosts = paths.take_unmatched();
  for (const Slot g : ghosts) {
    EXPECT_FALSE(paths.matches(g));  // a path with events and without a script
    Bytes& own = d.messages.emplace_back();
    paths.write(g, own);
    Reader reader(own);
    paths.read_script(reader);
    EXPECT_TRUE(paths.matches(g));
    EXPECT_TRUE(ownership.is_ghost(g));
    ++compared;
    EXPECT_EQ(paths.script(g).size(), paths.events(g).size());
  }
  EXPECT_GT(compared, 10);
  EXPECT_TRUE(paths.all_match());
  const Slot last = ghosts.back();
  Node<3>& node = paths.path(last).back();
  node.after.v[1] = std::nextafter(node.after.v[1], 2.0);
  EXPECT_FALSE(paths.matches(last));
  EXPECT_FALSE(paths.all_match());
}

TEST(WindowPaths, CutsAtAKeyAndFindsWhatDiffersFromTheCore) {
  Divided d;
  d.run();
  WindowPaths<3>& paths = d.parts[0]->paths;
  const std::uint64_t all = paths.tally().contacts();
  EventKey<3> middle{.time = kEnd / 2};
  std::uint64_t before = 0;
  std::vector<Slot> later;
  paths.for_each_own([&](Slot i) {
    for (const Node<3>& node : paths.events(i)) {
      before += node.key.lo == node.after.id && node.key <= middle ? 1 : 0;
      if (middle < node.key && (later.empty() || later.back() != i)) later.push_back(i);
    }
  });
  paths.cut(middle);
  EXPECT_EQ(paths.tally().contacts(), before);
  EXPECT_GT(before, 5u);
  EXPECT_LT(before, all);
  std::vector<Slot> other;
  for (const auto& [slot, record, internal] : paths.take_changes()) {
    EXPECT_LE(record.t, kEnd / 2);
    if (d.parts[0]->ownership.owns(slot)) other.push_back(slot);
  }
  std::ranges::sort(other);
  std::ranges::sort(later);
  EXPECT_EQ(other, later);
}

TEST(WindowRepair, GoesOnUntilAllOwnSpheresAreAsInOneCore) {
  // An impact passes from one subdomain through a row of spheres into the other, which did not predict it.
  std::vector<Vec<3>> x, v(16, Vec<3>::Zero());
  for (int i = 0; i < 16; ++i) x.push_back({2.0 + 1.001 * i, 3, 3});
  v[0][0] = 3;
  Divided d(test::make_system<3>({20, 6, 6}, P, x, v));
  d.run();
  EXPECT_GT(d.wrong(), 0u);
  EXPECT_GT(d.make_consistent(), 0);
  EXPECT_EQ(d.wrong(), 0u);
  std::uint64_t redone = 0;
  for (const auto& part : d.parts) {
    EXPECT_TRUE(part->paths.all_match());
    double fastest = 0;  // of the first run and of repairs
    part->paths.for_each_own([&](Slot i) {
      for (const Node<3>& node : part->paths.events(i)) fastest = std::max(fastest, node.after.v.squaredNorm());
    });
    EXPECT_GT(fastest, 8);
    EXPECT_EQ(part->paths.trace().fastest_squared(), fastest);
    redone += part->redone;
  }
  EXPECT_GT(redone, 0u);
  EXPECT_LT(redone, 100u);
}

/// Sphere 1 of the left subdomain and sphere 2 of the right one are hit by spheres that the other subdomain does not
/// have, and then meet; neither subdomain expects that. If both took the path of their ghost as it is, their paths
/// would be equal, but without the contact.
TEST(WindowRepair, FindsAContactOfTwoPathsThatEachSubdomainLearnsFromTheOther) {
  Divided d(test::make_system<3>({20, 6, 6}, P, {{7.95, 3, 3}, {9.25, 3, 3}, {10.75, 3, 3}, {12.05, 3, 3}},
                                 {{5, 0, 0}, {0, 0, 0}, {0, 0, 0}, {-5.1, 0, 0}}));
  d.run();
  for (const int k : {0, 1}) {
    EXPECT_EQ(d.parts[k]->ownership.slot_of(k == 0 ? 3 : 0), IdTable::kNowhere);
    EXPECT_EQ(d.parts[k]->paths.tally().sphere_sphere, 1u);
    EXPECT_TRUE(d.parts[k]->paths.has_no_events(d.parts[k]->ownership.slot_of(k == 0 ? 2 : 1)));
  }
  d.make_consistent();
  EXPECT_EQ(d.wrong(), 0u);
  EXPECT_EQ(d.parts[0]->paths.tally().sphere_sphere, 2u);  // the contact counts where its lower id is owned
  EXPECT_EQ(d.parts[1]->paths.tally().sphere_sphere, 1u);
}

}  // namespace
}  // namespace carom::subdomain_test
