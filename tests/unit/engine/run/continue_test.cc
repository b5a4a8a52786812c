// SPDX-License-Identifier: BSD-3-Clause
// A run that is stopped and continued from its state against an uninterrupted run: every bit is equal, for all methods
// and all numbers of ranks before and after.

#include <gtest/gtest.h>

#include <map>
#include <span>

#include "engine/run/observable.h"
#include "engine/run/state.h"
#include "tests/support/experiments.h"
#include "tests/support/same_statistics.h"
#include "tests/support/thread_ranks.h"

namespace carom::continue_test {
namespace {

using test::Given;
using State = std::map<std::string, Bytes>;

/// Everything that a run reports.
template <int D>
struct Account : Observer<D> {
  explicit Account(Communicator* others) : ranks(others) {}
  Sampling sampling() const override { return {.interval = 0.05}; }
  void sample(double time, const Particles<D>& state) override { note(time), note(state); }
  void frame(const Snapshot<D>& shot) override {
    note(shot), note(ranks ? gathered(*ranks, *shot.particles) : *shot.particles);
  }
  void thermo(const Snapshot<D>& shot) override { note(shot); }
  void contacts(double start, std::span<const Contact<D>> all) override {
    for (const auto& contact : all) {
      events.insert(events.end(), {start, contact.key.time});
      for (const Vec<D>& v : {contact.x_lo, contact.x_hi, contact.impulse})
        events.insert(events.end(), v.begin(), v.end());
    }
  }
  void note(double value) { values.push_back(std::isnan(value) ? 0 : value); }
  void note(const Vec<D>& value) { values.insert(values.end(), value.begin(), value.end()); }
  void note(const Snapshot<D>& s) {
    for (const double value : {s.time, s.kinetic, s.potential, s.shadow, s.pressure, s.max_energy_error, s.rotational})
      note(value);
    note(static_cast<double>(s.step)), note(static_cast<double>(s.collisions)), note(Vec<D>(s.momentum.data()));
  }
  void note(const Particles<D>& p) {
    for (Id i = 0; i < p.size(); ++i) {
      note(p.x[i]), note(p.v[i]);
      for (const auto n : p.image[i]) note(n);
      if (p.spin.empty()) continue;
      for (const double w : p.spin[i]) note(w);
    }
  }
  Communicator* ranks;
  std::vector<double> values, events;
};

template <int D>
struct Scene {
  std::function<std::unique_ptr<System<D>>()> make;
  std::string method;
  Plan plan;
  Given given{};
  std::optional<std::uint64_t> slab_collisions{};
  bool averages = true;  ///< with all observables, which need the volume of the box

  std::unique_ptr<Simulation<D>> run_of(std::unique_ptr<System<D>> system, const Plan& its) const {
    auto simulation = test::make_run<D>(std::move(system), method, its, given);
    if (slab_collisions) simulation->limit_slabs(*slab_collisions);
    return simulation;
  }
};

/// When a run is stopped: at the n-th call of should_stop().
struct Leave {
  int at = std::numeric_limits<int>::max();
  bool at_last = false;                               ///< at its end, in the last state that a longer run shares
  int within_step = std::numeric_limits<int>::max();  ///< at the n-th check within steps
  int alone = std::numeric_limits<int>::max();        ///< at the n-th check of the last rank alone
};

template <int D>
struct Outcome {
  std::vector<double> values, events, averages;
  Statistics statistics;
  State state;
  int looks = 0, looks_alone = 0;  ///< of the last rank
  bool knew_all = false;           ///< of the last rank, if it left alone
};

template <int D>
Outcome<D> run(const Scene<D>& scene, int ranks, const Plan& plan, const Leave& leave, const State* from = nullptr) {
  Outcome<D> out;
  test::ThreadRanks(std::max(1, ranks)).run([&](Communicator& exchange) {
    auto system = scene.make();
    if (ranks > 0) system->decomposition.join(exchange);
    const bool first = exchange.rank() == 0;
    auto simulation = scene.run_of(std::move(system), plan);
    System<D>& state_of = simulation->system();
    const auto read = [&](const std::string& name) { return from->at(name); };
    if (from) restore_particles(state_of, read);
    Account<D> account(ranks > 0 ? &exchange : nullptr);
    simulation->add(account);
    std::vector<std::unique_ptr<Observable<D>>> averages;
    const auto& box = state_of.box;
    const bool fixed = std::ranges::any_of(state_of.particles.mass, [](double mass) { return std::isinf(mass); });
    const bool conserves = state_of.keeps_momentum() && box.bath.type == Bath::Type::none && box.contacts.elastic() &&
                           !box.contacts.rough() && !state_of.decomposition.any(fixed);
    for (const ObservableInfo& info : observables()) {
      if (!scene.averages) break;
      if (info.name == "transport" && !conserves) continue;
      averages.push_back(make_observable<D>(info.name, state_of, {{"interval", 1.5 * plan.step}}));
      simulation->add(*averages.back());
    }
    int asked = 0, looks = 0, looks_alone = 0;
    bool left = false, left_here = false;
    const auto stop = [&] {
      const bool now = asked++ == leave.at || left || (leave.at_last && simulation->is_last_on_the_way());
      if (now) save_state(state_of, into(out.state));
      return now && !leave.at_last;
    };
    simulation->run({.should_stop = stop,
                     .leave = [&] { return left = looks++ == leave.within_step; },
                     .leave_here =
                         [&] {
                           const bool last = exchange.rank() == exchange.size() - 1;
                           left_here = last && looks_alone++ == leave.alone;
                           if (left_here) out.knew_all = state_of.decomposition.knows_all();
                           return left_here;
                         },
                     .left = [&] { left = left || state_of.decomposition.any(left_here); },
                     .restore = from ? [&] { restore_state(state_of, read); } : std::function<void()>()});
    if (exchange.rank() == exchange.size() - 1) out.looks = looks, out.looks_alone = looks_alone;
    if (!first) return;
    out.values = std::move(account.values);
    out.events = std::move(account.events);
    for (const auto& average : averages)
      for (const TableColumn& column : average->table())
        for (const double value : column.values) out.averages.push_back(std::isnan(value) ? -1 : value);
    out.statistics = simulation->statistics();
  });
  return out;
}

/// Expects that `rest` is the end of `whole`.
void expect_tail(const std::vector<double>& whole, const std::vector<double>& rest) {
  ASSERT_LE(rest.size(), whole.size());
  const std::span<const double> tail = std::span(whole).last(rest.size());
  for (std::size_t k = 0; k < rest.size(); ++k) ASSERT_EQ(rest[k], tail[k]) << "value " << k << " of " << rest.size();
}

/// Expects that the output of a continued run is the end of the output of the uninterrupted run.
template <int D>
void expect_continued(const Outcome<D>& whole, const Outcome<D>& rest) {
  ASSERT_GT(rest.values.size(), 0u);
  expect_tail(whole.values, rest.values);
  expect_tail(whole.events, rest.events);
  EXPECT_TRUE(whole.averages == rest.averages);
  test::expect_same(whole.statistics, rest.statistics);
}

template <int D>
void compare(const Scene<D>& scene, std::vector<std::array<int, 2>> ranks, std::vector<int> leave_at) {
  SCOPED_TRACE(scene.method);
  const Outcome<D> whole = run<D>(scene, 0, scene.plan, {});
  for (const auto& [before, after] : ranks)
    for (const int at : leave_at) {
      SCOPED_TRACE(testing::Message() << "left off at " << at << " on " << before << " ranks, taken up by " << after);
      const Outcome<D> begun = run<D>(scene, before, scene.plan, {.at = at});
      ASSERT_TRUE(begun.statistics.stopped_early);
      expect_continued(whole, run<D>(scene, after, scene.plan, {}, &begun.state));
      if (::testing::Test::HasFailure()) return;
    }
}

const std::vector<std::array<int, 2>> kRanks = {{0, 0}, {1, 2}, {2, 3}, {4, 0}};

Plan plan_of(double step, std::int64_t steps) {
  return {.step = step, .steps = steps, .frame_interval = 3 * step, .thermo_interval = 2 * step, .events = true};
}

Scene<2> springs(const std::string& method, const Given& given = {}, double stiffness = 3) {
  return {[=] {
            auto system = test::hard_spheres<2>(8, 0.5);
            test::add_interaction(*system, "harmonic-bond",
                                  {{"within", 1.4}, {"stiffness", stiffness}, {"rest_length", 1.2}});
            return system;
          },
          method, plan_of(0.02, 24), given};
}
Scene<3> yukawa(const std::string& method, const Given& given = {}) {
  return {[] {
            auto system = test::hard_spheres<3>(5, 0.3);
            test::add_interaction(*system, "yukawa", {{"amplitude", 1.0}, {"kappa", 2.0}, {"cutoff", 2.0}});
            return system;
          },
          method, plan_of(0.02, 18), given};
}
Scene<3> ions(const std::string& method) {
  return {[] {
            auto system = test::hard_spheres<3>(4, 0.3);
            for (Id i = 0; i < system->size(); ++i) system->particles.charge[i] = i % 2 == 0 ? 1 : -1;
            test::add_interaction(
                *system, "coulomb",
                {{"form", std::string("ewald")}, {"accuracy", 1e-2}, {"surface", std::string("vacuum")}});
            return system;
          },
          method,
          plan_of(0.02, 12),
          {},
          {},
          false};  // there is no pressure tensor in vacuum
}

TEST(Continue, SlabMethods) {
  for (const char* method : {"verlet", "psa", "edda"}) {
    compare<2>(springs(method), kRanks, {1, 7, 16});
    compare<3>(yukawa(method), kRanks, {5});
    compare<3>(ions(method), {{1, 2}, {3, 0}}, {7});
  }
}
/// Sweeps are accelerated once the largest frequency is known, which is part of the state.
TEST(Continue, StiffForces) { compare<2>(springs("edda", {}, 1000), {{0, 0}, {2, 3}}, {7}); }
TEST(Continue, MethodsThatCutTheStepOfAll) {
  for (const auto& [method, given] : std::vector<std::pair<std::string, Given>>{{"cva", {}},
                                                                                {"mcva", {}},
                                                                                {"mcva", {{"variant", "restart"}}},
                                                                                {"cdda", {}},
                                                                                {"cdda", {{"order", std::int64_t{4}}}}})
    compare<2>(springs(method, given), {{0, 0}, {2, 3}}, {1, 9});
}
/// Steps that the method chooses, and a long one that is divided: how far the clock has come is part of the state.
TEST(Continue, StepsThatMethodsChoose) {
  for (const char* method : {"edda", "cdda"}) compare<2>(springs(method, {{"accuracy", 1e-3}}), {{2, 3}}, {9});
  Scene<2> divided = springs("edda");
  divided.plan = plan_of(1, 3);
  compare<2>(divided, {{0, 0}, {2, 3}}, {5});
}
/// Two discs press three others apart, so that all contacts are held and turn. The sweeps of a step correct their
/// reactions with the factors of the first sweep of this step, never with those of an earlier step.
TEST(Continue, ContactsThatAreHeldAndTurn) {
  const auto pile = [] {
    const double top = 0.5 + std::sqrt(0.75);
    auto system = test::make_system<2>({9, 9}, Boundary::wall, {{3, 0.5}, {4, 0.5}, {5, 0.5}, {3.5, top}, {4.5, top}},
                                       std::vector<Vec<2>>(5, Vec<2>::Zero()));
    test::set_law<2>(*system, {{"restitution", 0.5}});
    test::add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{0, -1}}});
    return system;
  };
  compare<2>({pile, "edda", plan_of(0.02, 12), {}, {}, false}, {{0, 0}, {2, 3}}, {2, 5, 9});
}
/// `slab_collisions`: far fewer than in an epoch, of which there are about 500 in 2.2 time units.
Scene<3> fluid(std::optional<std::uint64_t> slab_collisions = {}) {
  return {[] { return test::hard_spheres<3>(6, 0.35); },
          "free-flight",
          {.step = 0.4, .end_time = 2.2, .frame_interval = 0.3, .thermo_interval = 0.11, .events = true},
          {},
          slab_collisions};
}
TEST(Continue, FreeFlightBetweenEpochs) { compare<3>(fluid(), kRanks, {1, 3}); }
TEST(Continue, FreeFlightWithinEpochs) { compare<3>(fluid(40), kRanks, {1, 3, 5}); }

/// Two heavy spheres have nearly all energy: epochs become 4, 16 and 64 steps long.
Scene<3> uneven(std::optional<std::uint64_t> slab_collisions = {}) {
  return {[] {
            auto system = test::hard_spheres<3>(6, 0.35);
            for (const Id i : {100, 700}) system->particles.mass[i] = 1e10;
            return system;
          },
          "free-flight",
          {.step = 0.005, .end_time = 3, .frame_interval = 0.3, .thermo_interval = 0.11, .events = true},
          {{"lengthen", true}},
          slab_collisions};
}
TEST(Continue, EpochsThatBecomeLonger) {
  const Scene<3> scene = uneven();
  const auto run = scene.run_of(scene.make(), scene.plan);
  struct Slabs : Observer<3> {
    void contacts(double start, std::span<const Contact<3>>) override { starts.push_back(start); }
    std::vector<double> starts;
  } slabs;
  run->add(slabs);
  run->run();
  slabs.starts.erase(std::unique(slabs.starts.begin(), slabs.starts.end()), slabs.starts.end());
  EXPECT_LT(slabs.starts.size(), 12u);  // of 600 steps
  compare<3>(scene, {{2, 3}}, {3});
  compare<3>(uneven(900), {{0, 2}}, {5});
}

/// A third of the spheres is fixed, and a one-way wall may stand in the way.
template <int D>
Scene<D> obstructed(Scene<D> scene, bool valve) {
  return {[make = scene.make, valve] {
            auto system = make();
            auto& p = system->particles;
            for (Id i = 0; i < p.size(); i += 3) p.mass[i] = std::numeric_limits<double>::infinity(), p.v[i].setZero();
            if (!valve) return system;
            Vec<D> normal = Vec<D>::Unit(1);
            if (!system->box.periodic(0)) normal[0] = 0.1;
            system->box.boundary[1] = Boundary::open;
            system->box.add({.name = "valve", .normal = normal, .offset = 0.4 * system->box.edges[1], .one_way = true});
            return system;
          },
          scene.method,
          scene.plan,
          scene.given,
          scene.slab_collisions,
          !valve};
}
TEST(Continue, FixedSpheresAndAOneWayWall) {
  compare<3>(obstructed(fluid(), true), {{2, 3}}, {3});
  compare<2>(obstructed(springs("psa"), true), {{2, 3}}, {7});
  compare<3>(obstructed(yukawa("edda"), false), {{2, 3}}, {5});
  for (const char* method : {"edda", "mcva", "cdda"}) compare<2>(obstructed(springs(method), true), {{1, 2}}, {9});
}

/// A scene with spins, whose contacts are rough and inelastic.
template <int D>
Scene<D> rough(Scene<D> scene) {
  return {[make = scene.make] {
            auto system = make();
            ContactLaws& laws = system->box.contacts;
            laws.resize(1, 0);
            laws.set_pair(0, 0, laws.add({.restitution = 0.9, .tangential = 0.5, .friction = 0.4}));
            auto& p = system->particles;
            p.spin.resize(p.size());
            for (Id i = 0; i < p.size(); ++i)
              for (int k = 0; k < Spin<D>::SizeAtCompileTime; ++k) p.spin[i][k] = std::sin(37.0 * i + k);
            return system;
          },
          scene.method, scene.plan, scene.given, scene.slab_collisions};
}
TEST(Continue, RoughSpheres) {
  compare<3>(rough(fluid()), kRanks, {1, 3});
  compare<3>(rough(fluid(40)), {{0, 0}, {2, 3}}, {3});
  for (const char* method : {"psa", "edda"}) {
    compare<2>(rough(springs(method)), kRanks, {1, 16});
    compare<3>(rough(yukawa(method)), kRanks, {5});
  }
  for (const auto& [method, given] : std::vector<std::pair<std::string, Given>>{
           {"cva", {}}, {"mcva", {}}, {"mcva", {{"variant", "restart"}}}, {"cdda", {}}})
    compare<2>(rough(springs(method, given)), {{0, 0}, {2, 3}}, {9});
}

/// A halo that is too small is noticed after psa's first kick, which must not be applied twice.
TEST(Continue, AStepIsRepeatedFromItsStart) {
  const Scene<2> scene{
      [] {
        auto system = test::hard_spheres<2>(60, 0.7);
        test::add_interaction(*system, "yukawa", {{"amplitude", 1.0}, {"kappa", 2.0}, {"cutoff", 1.5}});
        ContactLaws& laws = system->box.contacts;
        laws.resize(1, 0);
        laws.set_pair(0, 0, laws.add({.restitution = 0.9, .tangential = 0.5, .rest_speed = 0.5}));
        return system;
      },
      "psa", plan_of(0.05, 3)};
  const Outcome<2> whole = run<2>(scene, 0, scene.plan, {}), parts = run<2>(scene, 2, scene.plan, {});
  EXPECT_GT(parts.statistics.counters.slabs_again, 0u);
  expect_continued(whole, parts);
}

/// Stops at each of several checks within steps: the run continues from the step's start.
template <int D>
void compare_within_steps(const Scene<D>& scene, std::vector<std::array<int, 2>> ranks, int leaves) {
  SCOPED_TRACE(scene.method);
  const Outcome<D> whole = run<D>(scene, 0, scene.plan, {});
  ASSERT_GT(whole.looks, 2 * leaves);
  for (const auto& [before, after] : ranks)
    for (int n = 1; n <= leaves; ++n) {
      const int at = n * whole.looks / (leaves + 1);
      SCOPED_TRACE(testing::Message() << "left at look " << at << " on " << before << " ranks, taken up by " << after);
      const Outcome<D> begun = run<D>(scene, before, scene.plan, {.within_step = at});
      ASSERT_TRUE(begun.statistics.stopped_early);
      expect_continued(whole, run<D>(scene, after, scene.plan, {}, &begun.state));
      if (::testing::Test::HasFailure()) return;
    }
}
TEST(Continue, WithinStepsThatAreCut) {
  for (const auto& [method, given] : std::vector<std::pair<std::string, Given>>{
           {"cva", {}}, {"mcva", {}}, {"mcva", {{"variant", "restart"}}}, {"cdda", {}}, {"edda", {}}})
    compare_within_steps<2>(springs(method, given), {{0, 0}, {2, 3}}, 3);
  for (const char* method : {"cva", "edda"}) compare_within_steps<2>(rough(springs(method)), {{0, 0}, {2, 3}}, 2);
}
/// One rank leaves a flight with many contacts, and all ranks abandon the step.
template <int D>
void compare_within_a_flight(const Scene<D>& scene, bool knows_all) {
  const Outcome<D> whole = run<D>(scene, 0, scene.plan, {});
  for (const int ranks : {0, 2}) {
    const Outcome<D> begun = run<D>(scene, ranks, scene.plan, {.alone = ranks == 0 ? whole.looks_alone - 1 : 0});
    ASSERT_TRUE(begun.statistics.stopped_early);
    EXPECT_EQ(begun.knew_all, knows_all || ranks == 0);
    EXPECT_EQ(begun.statistics.counters.slabs_again, 0u);
    expect_continued(whole, run<D>(scene, 2 - ranks, scene.plan, {}, &begun.state));
  }
}
TEST(Continue, WithinAFlight) {
  compare_within_a_flight<3>({[] { return test::hard_spheres<3>(6, 0.3); }, "psa", plan_of(0.3, 2)}, true);
  compare_within_a_flight<2>({[] { return test::hard_spheres<2>(60, 0.7); }, "psa", plan_of(0.05, 2)}, false);
}

TEST(Continue, AStateOfAnotherNumberOfParticlesIsRefused) {
  const Scene<3> scene = fluid();
  const Outcome<3> begun = run<3>(scene, 0, scene.plan, {.at = 1});
  for (const std::size_t more : {std::size_t{1}, ~std::size_t{0}})  // one more, one less
    for (const int ranks : {0, 2}) {
      State state = begun.state;
      Bytes& x = state.at("position");
      x.resize(x.size() + more * sizeof(Vec<3>));
      std::string said;
      try {
        run<3>(scene, ranks, scene.plan, {}, &state);
      } catch (const Error& e) {
        EXPECT_EQ(e.failure(), Failure::file);
        said = e.what();
      }
      EXPECT_EQ(said, "the state has no 'position' for each particle of this run") << more << " on " << ranks;
    }
}

/// A run that is continued and stopped at once shows the measurements of the state in which it had been stopped.
TEST(Continue, StopsAtOnce) {
  for (const Scene<2>& scene : {springs("psa"), rough(springs("edda"))}) {
    const Outcome<2> begun = run<2>(scene, 0, scene.plan, {.at = 5});  // no row and no frame is due then
    const Outcome<2> again = run<2>(scene, 0, scene.plan, {.at = 0}, &begun.state);
    ASSERT_GT(again.values.size(), 0u);
    expect_tail(begun.values, again.values);
  }
}

/// A simulation runs again to a later end.
TEST(Continue, RunAgain) {
  for (const Scene<3>& scene : {yukawa("psa"), yukawa("edda"), fluid(), fluid(40)}) {
    SCOPED_TRACE(scene.method);
    Plan early = scene.plan, late = scene.plan;
    early.end_time.reset(), late.end_time.reset();
    early.steps = 2, late.steps = 5;
    const auto whole = scene.run_of(scene.make(), late);
    const auto parts = scene.run_of(scene.make(), early);
    whole->run();
    parts->run();
    EXPECT_EQ(parts->statistics().steps, 2);
    parts->extend(late);
    parts->run();
    EXPECT_EQ(parts->system().particles.x, whole->system().particles.x);
    EXPECT_EQ(parts->system().particles.v, whole->system().particles.v);
    test::expect_same(whole->statistics(), parts->statistics());
    // From an end between two steps it continues with whole steps.
    late.steps.reset(), late.end_time = 6.5 * late.step;
    parts->extend(late);
    parts->run();
    late.end_time = 7.5 * late.step;
    parts->extend(late);
    parts->run();
    EXPECT_EQ(parts->statistics().end_time, late.end_time);
    EXPECT_EQ(parts->statistics().steps, 8);
  }
}

/// A run with a later end continues as if it had had that end from the start.
TEST(Continue, ALaterEnd) {
  std::vector<std::pair<Scene<3>, std::array<Plan, 2>>> cases;
  const auto ends = [](const Plan& base, auto&& set) {
    std::array<Plan, 2> plans{base, base};
    for (int k = 0; k < 2; ++k) {
      plans[k].steps.reset(), plans[k].end_time.reset(), plans[k].collisions.reset();
      set(plans[k], k == 0);
    }
    return plans;
  };
  for (const Scene<3>& scene : {yukawa("psa"), fluid(), fluid(40)}) {
    cases.push_back({scene, ends(scene.plan, [](Plan& p, bool short_) { p.steps = short_ ? 2 : 5; })});
    cases.push_back(
        {scene, ends(scene.plan, [](Plan& p, bool short_) { p.end_time = (short_ ? 2.5 : 5.1) * p.step; })});
    EXPECT_NE(3 * scene.plan.step - 2 * scene.plan.step, scene.plan.step);  // rounding changes the last slab
    cases.push_back(
        {scene, ends(scene.plan, [](Plan& p, bool short_) { p.end_time = (short_ ? 3.0 : 5.1) * p.step; })});
  }
  for (const Scene<3>& scene : {fluid(), fluid(40), uneven()})
    cases.push_back({scene, ends(scene.plan, [](Plan& p, bool short_) { p.collisions = short_ ? 500 : 1500; })});
  for (const double early : {0.5, 0.52, 0.523})  // ends within long epochs, at whole steps and between them
    cases.push_back({uneven(), ends(uneven().plan, [=](Plan& p, bool short_) { p.end_time = short_ ? early : 1.0; })});
  for (const auto& [scene, plans] : cases)
    for (const int ranks : {0, 2}) {
      SCOPED_TRACE(scene.method + " on " + std::to_string(ranks) + " ranks");
      const auto whole = run<3>(scene, 0, plans[1], {});
      const auto begun = run<3>(scene, ranks, plans[0], {.at_last = true});
      ASSERT_FALSE(begun.state.empty());
      expect_continued(whole, run<3>(scene, ranks, plans[1], {}, &begun.state));
      // With the old end it ends in the same state, if it ended within an epoch.
      if (!plans[0].collisions) continue;
      const auto ended = run<3>(scene, 0, plans[0], {});
      test::expect_same(ended.statistics, run<3>(scene, ranks, plans[0], {}, &begun.state).statistics);
    }
}

}  // namespace
}  // namespace carom::continue_test
