// SPDX-License-Identifier: BSD-3-Clause
#include "engine/run/simulation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/run/mean_squared_displacement.h"
#include "engine/run/radial_distribution.h"
#include "tests/support/experiments.h"

namespace carom::simulation_test {
namespace {

/// Records what was reported at which time.
template <int D>
struct Notebook : Observer<D> {
  void frame(const Snapshot<D>& shot) override { frames.push_back(shot.time), x.push_back(shot.particles->x); }
  void thermo(const Snapshot<D>& shot) override { rows.push_back(shot.time), pressure.push_back(shot.pressure); }
  void contacts(double start, std::span<const Contact<D>> all) override {
    for (const auto& contact : all) {
      if (contact.key.kind == EventKind::pair) ++pairs;
      times.push_back(start + contact.key.time);
      touched.push_back(contact);
    }
  }
  void progress(const Statistics& s) override { fraction = s.fraction_done; }
  Sampling sampling() const override { return wanted; }
  void sample(double time, const Particles<D>& p) override { samples.push_back(time), sampled.push_back(p.x); }
  Sampling wanted;
  std::vector<double> samples;
  std::vector<std::vector<Vec<D>>> sampled;
  std::vector<double> frames, rows, pressure, times;
  std::vector<std::vector<Vec<D>>> x;
  std::vector<Contact<D>> touched;
  std::uint64_t pairs = 0;
  double fraction = 0;
};

TEST(Simulation, ShowsSlabEndsAtOrAfterTheirDueTimes) {
  auto run = test::make_run<2>(test::five_springs(), "cva",
                               {.step = 0.03, .steps = 40, .frame_interval = 0.5, .thermo_interval = 0.1});
  Notebook<2> notes;
  run->add(notes);
  run->run();
  ASSERT_EQ(notes.frames.size(), 4u);  // 0, 0.5 → 0.51, 1.0 → 1.02, and the end
  EXPECT_DOUBLE_EQ(notes.frames[1], 0.51);
  EXPECT_DOUBLE_EQ(notes.frames[2], 1.02);
  EXPECT_DOUBLE_EQ(notes.frames[3], 1.2);
  ASSERT_EQ(notes.rows.size(), 13u);
  EXPECT_DOUBLE_EQ(notes.rows[1], 0.12);
  EXPECT_DOUBLE_EQ(notes.rows.back(), 1.2);
  EXPECT_DOUBLE_EQ(notes.fraction, 1.0);
}

TEST(Simulation, TheLastStateIsShownOnceWhereItIsDue) {
  auto run = test::make_run<2>(test::five_springs(), "cva",
                               {.step = 0.25, .steps = 4, .frame_interval = 0.5, .thermo_interval = 0.25});
  Notebook<2> notes;
  run->add(notes);
  run->run();
  EXPECT_EQ(notes.frames, (std::vector<double>{0, 0.5, 1}));
  EXPECT_EQ(notes.rows, (std::vector<double>{0, 0.25, 0.5, 0.75, 1}));
}

TEST(Simulation, FreeFlightIsShownExactlyAtTheDueTimes) {
  auto run = test::make_run<3>(test::hard_spheres<3>(2, 0.2), "free-flight",
                               {.step = 1.0, .end_time = 2.5, .frame_interval = 0.4});
  Notebook<3> notes;
  run->add(notes);
  run->run();
  ASSERT_EQ(notes.frames.size(), 8u);
  for (int k = 0; k < 7; ++k) EXPECT_DOUBLE_EQ(notes.frames[k], 0.4 * k);
  EXPECT_DOUBLE_EQ(notes.frames[7], 2.5);
}

TEST(Simulation, SamplesAtTheTimesOfEachObserver) {
  for (const double step : {1.0, 0.7}) {
    auto run = test::make_run<3>(test::hard_spheres<3>(2, 0.2), "free-flight",
                                 {.step = step, .end_time = 2.5, .frame_interval = 0.4});
    Notebook<3> often, late, never;
    often.wanted = {.interval = 0.2};
    late.wanted = {.interval = 0.5, .start = 0.9};
    for (auto* notes : {&often, &late, &never}) run->add(*notes);
    run->run();
    ASSERT_EQ(often.samples.size(), 13u);  // 0, 0.2, … 2.4; the end is not a due time
    for (int k = 0; k < 13; ++k) EXPECT_NEAR(often.samples[k], 0.2 * k, 1e-12);
    ASSERT_EQ(late.samples.size(), 4u);  // 0.9, 1.4, 1.9, 2.4
    for (int k = 0; k < 4; ++k) EXPECT_NEAR(late.samples[k], 0.9 + 0.5 * k, 1e-12);
    EXPECT_TRUE(never.samples.empty());
    for (int k = 0; k < 7; ++k) EXPECT_LT(test::largest_difference(often.x[k], often.sampled[2 * k]), 1e-12);
  }
  auto run = test::make_run<2>(test::five_springs(), "cva", {.step = 0.03, .steps = 40});
  Notebook<2> notes;
  notes.wanted = {.interval = 0.5};
  run->add(notes);
  run->run();
  ASSERT_EQ(notes.samples.size(), 3u);
  EXPECT_DOUBLE_EQ(notes.samples[1], 0.51);
  EXPECT_DOUBLE_EQ(notes.samples[2], 1.02);
}

TEST(Simulation, MeasuresTheMeanFreeFlight) {
  // Two discs that collide head on in a periodic box after 3.5 of path each, at 2 and at 1; equal masses exchange
  // velocities.
  auto run = test::make_run<2>(test::make_system<2>({8, 4}, Boundary::periodic, {{1, 1}, {5, 1}}, {{2, 0}, {-1, 0}}),
                               "free-flight", {.step = 1, .end_time = 700});
  run->run();
  const auto& s = run->statistics();
  // The first time is 1, then every (8 − 2)/3; in between one disc moves by 4 and the other by 2.
  EXPECT_EQ(s.counters.sphere_sphere, 350u);
  EXPECT_NEAR(*s.mean_free_time, 2, 1e-12);
  EXPECT_NEAR(*s.mean_free_path, 3, 1e-12);
  const auto none = test::run_steps<2>(
      test::make_system<2>({8, 4}, Boundary::wall, {{1, 1}, {5, 3}}, {{2, 0}, {-1, 0}}), "free-flight", 1, 20);
  EXPECT_GT(none->statistics().counters.sphere_wall, 5u);
  EXPECT_FALSE(none->statistics().mean_free_time);
  EXPECT_FALSE(none->statistics().mean_free_path);
}

/// The means of the samples with their errors are those of the whole run, and those of the rows of all steps.
TEST(Simulation, TheMeansOfTheSeriesAreThoseOfTheRun) {
  const auto column = [](const Statistics& s, std::string_view name) {
    return s.estimate(std::ranges::find(Statistics::mean_names, name) - Statistics::mean_names.begin()).mean;
  };
  auto gas = test::hard_spheres<3>(3, 0.2);
  const auto flight = test::run_until<3>(std::move(gas), "free-flight", 0.5, 20);
  const Statistics& s = flight->statistics();
  EXPECT_GT(s.counters.sphere_sphere, 1000u);
  EXPECT_NEAR(column(s, "pressure"), s.mean_pressure, 1e-12 * s.mean_pressure);
  EXPECT_NEAR(column(s, "collision_rate"), s.collision_rate, 1e-12 * s.collision_rate);
  EXPECT_NEAR(column(s, "mean_free_time"), *s.mean_free_time, 1e-12);
  EXPECT_NEAR(column(s, "mean_free_path"), *s.mean_free_path, 1e-12);

  struct Rows : Observer<2> {
    void thermo(const Snapshot<2>& shot) override {
      if (shot.step == 0) return;
      temperature += shot.temperature / 400;
      potential += shot.potential / 400;
    }
    double temperature = 0, potential = 0;
  } rows;
  auto springs = test::make_run<2>(test::five_springs(), "psa", {.step = 0.01, .steps = 400, .thermo_interval = 1e-3});
  springs->add(rows);
  springs->run();
  const Statistics& of_steps = springs->statistics();
  EXPECT_NEAR(column(of_steps, "temperature"), rows.temperature, 1e-12 * rows.temperature);
  EXPECT_NEAR(column(of_steps, "potential"), rows.potential, 1e-12 * rows.potential);
  std::size_t hit = 0;
  for (std::size_t wall = 0; wall < of_steps.counters.walls.size(); ++wall) {
    const double impulse = of_steps.counters.walls[wall].impulse.value();
    hit += impulse != 0;
    EXPECT_NEAR(of_steps.estimate(Statistics::mean_names.size() + wall).mean, impulse / of_steps.end_time, 1e-12);
  }
  EXPECT_GE(hit, 1u);
}

/// Two discs as above, in a run that branches off at step 30, which is at another time than 30 steps of its own: sums
/// and means begin there.
TEST(Simulation, ABranchCountsFromItsStart) {
  for (const Plan& plan : {Plan{.step = 1, .end_time = 745}, Plan{.step = 1, .steps = 730}}) {
    struct Fractions : Observer<2> {
      void progress(const Statistics& s) override { all.push_back(s.fraction_done); }
      std::vector<double> all;
    } done;
    auto run = test::make_run<2>(test::make_system<2>({8, 4}, Boundary::periodic, {{1, 1}, {5, 1}}, {{2, 0}, {-1, 0}}),
                                 "free-flight", plan);
    run->add(done);
    run->run({.branch = {{.start = {30, 45}, .from = {30, 45}}}});
    const Statistics& s = run->statistics();
    EXPECT_EQ(s.end_time, 745);
    EXPECT_EQ(s.counters.sphere_sphere, 350u);
    EXPECT_NEAR(*s.mean_free_time, 2, 1e-12);
    EXPECT_NEAR(*s.mean_free_path, 3, 1e-12);
    EXPECT_NEAR(s.collision_rate, 0.5, 1e-12);
    ASSERT_EQ(done.all.size(), 701u);  // one at the start
    for (std::size_t n = 0; n <= 700; ++n) EXPECT_NEAR(done.all[n], static_cast<double>(n) / 700, 1e-14);
  }
}

/// Two discs that fall at different times and meet once: |v| grows equally and uniformly, with a mean of ½ + ½ g T.
TEST(Simulation, TheMeanSpeedIsThatOfTheWholeSlab) {
  auto system = test::make_system<2>({100, 4}, Boundary::open, {{5, 2}, {2, 2}}, {{0, 0}, {1, 0}});
  test::add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{1.0, 0.0}}});
  const auto run = test::run_until<2>(std::move(system), "psa", 0.5, 4);
  const Statistics& s = run->statistics();
  EXPECT_EQ(s.counters.sphere_sphere, 1u);
  EXPECT_NEAR(*s.mean_free_path / *s.mean_free_time, 2.5, 1e-12);
}

/// Two discs that meet at 1, 3, 5 …, each time with a virial d·Δp of 3; 2K = 5. Frames in between change nothing.
TEST(Simulation, ThePressureOfARowIsThatSinceTheRowBefore) {
  for (const double frames : {0.0, 0.8}) {
    auto run = test::make_run<2>(test::make_system<2>({8, 4}, Boundary::periodic, {{1, 1}, {5, 1}}, {{2, 0}, {-1, 0}}),
                                 "free-flight",
                                 {.step = 4, .end_time = 10, .frame_interval = frames, .thermo_interval = 2.75});
    Notebook<2> notes;
    run->add(notes);
    run->run();
    const std::vector<double> collisions = {0, 1 / 2.75, 2 / 2.75, 1 / 2.75, 1 / 1.75};  // per unit time
    ASSERT_EQ(notes.pressure.size(), collisions.size());
    for (std::size_t k = 0; k < collisions.size(); ++k)
      EXPECT_NEAR(notes.pressure[k], (5 + 3 * collisions[k]) / (2 * 32), 1e-13) << "row " << k;
  }
}

TEST(Simulation, ShortensTheLastStepToMeetTheEnd) {
  const auto run = test::run_until<2>(test::five_springs(), "cdda", 0.04, 0.1);
  EXPECT_EQ(run->statistics().steps, 3);
  EXPECT_DOUBLE_EQ(run->statistics().end_time, 0.1);
  const auto straight = test::run_until<2>(test::five_springs(), "cdda", 0.001, 0.1);
  EXPECT_LT(test::largest_difference(run->system().particles.x, straight->system().particles.x), 1e-4);
}

/// The end is met to the bit, although 3 · 0.1 is more than 0.3 and 3 · 0.7 less than 2.1.
TEST(Simulation, EndsExactlyAtItsEnd) {
  EXPECT_GT(3 * 0.1, 0.3);
  EXPECT_LT(3 * 0.7, 2.1);
  for (const auto& [step, end] : {std::pair{0.1, 0.3}, {0.7, 2.1}}) {
    const auto run = test::run_until<2>(test::five_springs(), "cva", step, end);
    EXPECT_EQ(run->statistics().steps, 3);
    EXPECT_EQ(run->statistics().end_time, end);
  }
}

/// Each of these runs is stopped after two slabs; the discs have met once by then.
TEST(Simulation, TheFractionDoneIsThatOfTheNearestEnd) {
  const auto fraction = [](Plan plan) {
    plan.step = 1;
    auto run = test::make_run<2>(test::make_system<2>({8, 4}, Boundary::periodic, {{1, 1}, {5, 1}}, {{2, 0}, {-1, 0}}),
                                 "psa", plan);
    struct Watcher : Observer<2> {
      void progress(const Statistics& s) override { fractions.push_back(s.fraction_done); }
      std::vector<double> fractions;
    } watcher;
    run->add(watcher);
    int slabs = 0;
    run->run([&] { return slabs++ == 2; });
    return watcher.fractions.back();
  };
  EXPECT_EQ(fraction({.steps = 4}), 0.5);
  EXPECT_EQ(fraction({.end_time = 20}), 0.1);
  EXPECT_EQ(fraction({.steps = 4, .end_time = 20, .collisions = 100}), 0.5);
  EXPECT_EQ(fraction({.steps = 10, .end_time = 2.5, .collisions = 100}), 0.8);
  EXPECT_EQ(fraction({.steps = 100, .end_time = 20, .collisions = 4}), 0.25);
}

TEST(Simulation, MeasuresEnergyErrorsFromTheFirstStepOn) {
  const auto one = test::run_steps<2>(test::five_springs(), "cva", 0.3, 1);
  EXPECT_EQ(one->statistics().max_energy_error, 0);
  EXPECT_NE(one->statistics().energy_after_first_step, one->statistics().energy_initial);
  const auto two = test::run_steps<2>(test::five_springs(), "cva", 0.3, 2);
  const auto& s = two->statistics();
  EXPECT_EQ(s.max_energy_error, std::abs(s.energy_final - s.energy_after_first_step));
  EXPECT_GT(s.max_energy_error, 0);
}

TEST(Simulation, EndsAtTheFirstOfSeveralEnds) {
  auto run = test::make_run<2>(test::five_springs(), "psa", {.step = 0.01, .steps = 50, .end_time = 100});
  run->run();
  EXPECT_EQ(run->statistics().steps, 50);
}

TEST(Simulation, FreeFlightEndsAtTheNthCollision) {
  auto run =
      test::make_run<3>(test::hard_spheres<3>(2, 0.3), "free-flight", {.step = 5, .collisions = 200, .events = true});
  Notebook<3> notes;
  run->add(notes);
  run->run();
  EXPECT_EQ(run->statistics().counters.sphere_sphere, 200u);
  EXPECT_EQ(notes.pairs, 200u);
  EXPECT_EQ(notes.fraction, 1);
  EXPECT_DOUBLE_EQ(run->statistics().end_time, notes.times.back());
}

/// Two discs that meet every 4 between walls, in a box that is open elsewhere: no flight distance ends the run.
TEST(Simulation, SpheresThatMeetAgainAndAgainHaveNotFlownApart) {
  const auto run = test::make_run<2>(test::make_system<2>({6, 6}, Boundary::wall, {{2, 3}, {4, 3}}, {{1, 0}, {-1, 0}}),
                                     "free-flight", {.step = 1000, .collisions = 25000});
  run->system().box.boundary[1] = Boundary::open;
  EXPECT_NO_THROW(run->run());
  EXPECT_GT(run->statistics().end_time, 1e4 * 6);
}

TEST(Simulation, StopsWhenAsked) {
  auto run = test::make_run<2>(test::five_springs(), "cva", {.step = 0.01, .steps = 1000});
  int asked = 0;
  run->run([&] { return ++asked > 7; });
  EXPECT_TRUE(run->statistics().stopped_early);
  EXPECT_EQ(run->statistics().steps, 7);
}

TEST(Simulation, ReportsEveryContactInOrder) {
  for (const char* method : {"free-flight", "psa", "cva", "mcva", "cdda", "edda"}) {
    auto system = std::string(method) == "free-flight" ? test::hard_spheres<2>(4, 0.4) : test::nine_gravity();
    auto run = test::make_run<2>(std::move(system), method, {.step = 0.05, .steps = 150, .events = true});
    Notebook<2> notes;
    run->add(notes);
    run->run();
    const auto& counters = run->statistics().counters;
    EXPECT_GT(notes.times.size(), 20u) << method;
    EXPECT_EQ(notes.times.size(), counters.sphere_sphere + counters.sphere_wall) << method;
    EXPECT_TRUE(std::ranges::is_sorted(notes.times)) << method;
  }
}

TEST(Simulation, WallsAreTouchedWhereTheyStand) {
  for (const char* method : {"free-flight", "psa", "cva", "mcva", "cdda", "edda"}) {
    auto run = test::make_run<2>(test::make_system<2>({4, 7}, Boundary::wall, {{2, 3}}, {{1.3, 1.7}}), method,
                                 {.step = 0.05, .steps = 300, .events = true});
    Notebook<2> notes;
    run->add(notes);
    run->run();
    std::array<int, 4> hits{};
    for (const Contact<2>& contact : notes.touched) {
      const int axis = static_cast<int>(contact.key.hi / 2);
      Vec<2> foot = contact.x_lo;
      foot[axis] = contact.key.hi % 2 == 0 ? 0 : run->system().box.edges[axis];
      EXPECT_EQ(contact.x_hi, foot) << method;
      EXPECT_NEAR((contact.x_lo - foot).norm(), 0.5, 1e-12) << method;
      ++hits[contact.key.hi];
    }
    EXPECT_GT(*std::ranges::min_element(hits), 1) << method;
  }
}

/// A disc hits one that rests on the floor, which ends a piece of a step; far above another bounces between walls.
TEST(Simulation, ContactsInPiecesOfAStepHaveTheirTimes) {
  auto system =
      test::make_system<2>({6, 8}, Boundary::wall, {{3, 0.5}, {3.2, 1.8}, {3, 6}}, {{0, 0}, {0, -1}, {20, 0}});
  test::add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{0.0, -0.1}}});
  auto run = test::make_run<2>(std::move(system), "edda", {.step = 0.5, .steps = 2, .events = true});
  Notebook<2> notes;
  run->add(notes);
  run->run();
  EXPECT_GT(run->statistics().counters.pieces, 2u);
  std::size_t bounces = 0;
  for (std::size_t k = 0; k < notes.times.size(); ++k)
    if (notes.touched[k].key.lo == 2) {
      EXPECT_NEAR(notes.times[k], 0.125 + 0.25 * static_cast<double>(bounces++), 1e-9);
    }
  EXPECT_EQ(bounces, 4u);
}

TEST(Simulation, ObservingChangesNoBit) {
  for (const char* method : {"free-flight", "psa", "cva", "mcva", "cdda", "edda"}) {
    for (const char* variant : {"grid", "restart"}) {
      if (std::string(variant) == "restart" && std::string(method) != "mcva") continue;
      auto final_state = [&](double frames, double rows, bool events, Sampling wanted = {}) {
        auto system = std::string(method) == "free-flight" ? test::hard_spheres<2>(5, 0.5) : test::nine_gravity();
        auto run = test::make_run<2>(
            std::move(system), method,
            {.step = 0.05, .steps = 200, .frame_interval = frames, .thermo_interval = rows, .events = events},
            std::string(method) == "mcva" ? Parameters{{"variant", std::string(variant)}} : Parameters{});
        Notebook<2> notes;
        notes.wanted = wanted;
        run->add(notes);
        RadialDistribution<2> rdf(run->system(), {.sampling = wanted, .range = 1.2, .bins = 10});
        MeanSquaredDisplacement<2> msd(run->system(), wanted);
        run->add(rdf);
        run->add(msd);
        run->run();
        return std::pair(run->system().particles.x, run->system().particles.v);
      };
      const auto plain = final_state(0, 0, false);
      EXPECT_EQ(plain, final_state(0.05, 0.013, true)) << method;
      EXPECT_EQ(plain, final_state(0.37, 1.1, false)) << method;
      EXPECT_EQ(plain, final_state(0, 0, false, {.interval = 0.021, .start = 0.4})) << method;
      EXPECT_EQ(plain, final_state(0.31, 0, true, {.interval = 0.7})) << method;
    }
  }
}

TEST(Simulation, ForcesThatAreNotFiniteEndTheRun) {
  auto system = test::make_system<2>({10, 10}, Boundary::wall, {{2, 2}, {2, 2}}, {{0, 0}, {0, 0}});
  test::add_interaction(*system, "gravity", {{"constant", 1.0}});
  EXPECT_THROW(test::run_steps<2>(std::move(system), "verlet", 0.1, 10), Error);
}

/// Two particles joined by a stretched spring.
std::unique_ptr<System<2>> oscillator(double stiffness) {
  auto system = test::make_system<2>({60, 60}, Boundary::open, {{1, 0}, {40, 0}}, {{0, 0}, {0, 0}});
  test::add_interaction(*system, "harmonic-bond",
                        {{"pairs", PairList{{0, 1}}}, {"stiffness", stiffness}, {"rest_length", 38.0}});
  return system;
}

std::string failure_of(Simulation<2>& run) {
  try {
    run.run();
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), 4);
    return e.what();
  }
  return "none";
}

/// H is 1 − 1 = 0 if two discs that attract each other pass; K and V are not 0.
TEST(Simulation, EnergiesAreComparedWithWhatTheyConsistOf) {
  auto system = test::make_system<2>({9, 9}, Boundary::open, {{3, 3}, {6, 7}}, {{0.8, -0.6}, {-0.8, 0.6}});
  test::add_interaction(*system, "gravity", {{"constant", 5.0}});
  const auto run = test::run_steps<2>(std::move(system), "psa", 1e-9, 1);
  EXPECT_NEAR(run->statistics().energy_final, 0, 1e-8);
  EXPECT_NEAR(run->statistics().energy_reference, 2, 1e-8);
  EXPECT_NEAR(run->statistics().energy_scale, 2, 1e-8);
}

/// Störmer–Verlet conserves a harmonic oscillator's H + h²G to fourth order, and H to second.
TEST(Simulation, TheShadowEnergyIsKeptBetterThanTheEnergy) {
  const auto errors = [](double step) {
    const auto run = test::run_steps<2>(oscillator(1), "verlet", step, static_cast<std::int64_t>(6 / step));
    const Statistics& s = run->statistics();
    return std::array{s.max_energy_error, s.max_shadow_energy_error.value()};
  };
  const auto coarse = errors(0.1), fine = errors(0.05);
  EXPECT_NEAR(coarse[0] / fine[0], 4, 0.5);
  EXPECT_NEAR(coarse[1] / fine[1], 16, 2);
  EXPECT_LT(coarse[1], 0.05 * coarse[0]);
}

/// A particle that falls from rest has almost no energy at the start. Later H is the rounding error of the large K + V.
TEST(Simulation, EnergiesOfRoundingAreNoBlowUp) {
  auto system = test::make_system<2>({9, 9}, Boundary::open, {{1e-40, 0}}, {{0, 0}});
  test::add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{0.1, 0.0}}});
  Simulation<2> run(std::move(system), "verlet", {{"step", 0.3}}, {.steps = 100});
  EXPECT_EQ(failure_of(run), "none");
  EXPECT_LT(run.statistics().energy_scale, 1e-40);
  EXPECT_GT(run.statistics().max_energy_error, 1e-30);
}

/// Two discs of radii 1.5 and 0.5 move into each other, which no method allows, from a distance of 2.5 to one of 1.8.
TEST(Simulation, OverlapsAreRelativeToTheContactDistance) {
  IntegratorInfo info = find_integrator("verlet");
  info.hard_cores = true, info.smooth_forces = false;
  Simulation<2> run(
      test::make_system<2>({20, 20}, Boundary::periodic, {{5, 5}, {7.5, 5}}, {{0.7, 0}, {0, 0}}, {1.5, 0.5}), info,
      {{"step", 1.0}}, {.steps = 1});
  EXPECT_TRUE(failure_of(run).starts_with("particles 0 and 1 overlap, by 0.1 of their contact distance"));
  EXPECT_NEAR(run.statistics().counters.max_overlap, 0.1, 1e-14);
}

/// An overlap of 1e-9 diameters is more than rounding in a box of 20 diameters, but not in one of 10⁷.
TEST(Simulation, OverlapsOfRoundingAreToldFromOthers) {
  IntegratorInfo info = find_integrator("verlet");
  info.hard_cores = true, info.smooth_forces = false;
  const auto overlap = [&](double edge, double depth) {
    const double x = edge - 5;
    Simulation<2> run(test::make_system<2>({edge, 20}, Boundary::periodic, {{x, 5}, {x + 1.5, 5}},
                                           {{0.5 + depth, 0}, {0, 0}}, {0.5, 0.5}),
                      info, {{"step", 1.0}}, {.steps = 1});
    run.run();
    EXPECT_NEAR(run.statistics().counters.max_overlap, depth, 1e-16 * edge);
    return run.statistics().overlap;
  };
  EXPECT_FALSE(overlap(20, 0.9e-11));
  const auto found = overlap(20, 1.1e-11);
  ASSERT_TRUE(found);
  EXPECT_EQ(std::tuple(found->lo, found->hi, found->time), std::tuple(0u, 1u, 1.0));
  EXPECT_TRUE(overlap(20, 1e-9));
  EXPECT_FALSE(overlap(1e7, 1e-9));
  EXPECT_TRUE(overlap(1e7, 2e-7));
}

TEST(Simulation, ARunThatHasBlownUpEnds) {
  Simulation<2> later(oscillator(1), "verlet", {{"step", 3.0}}, {.steps = 1000});
  const std::string message = failure_of(later);
  for (const char* part : {"the run has blown up: the energy, 0.5 at the start, is ", " at step ", "time ", "particle ",
                           " is the fastest, with a speed of ", "use a smaller integrator.step"})
    EXPECT_NE(message.find(part), std::string::npos) << part << " in " << message;
  EXPECT_LT(later.statistics().steps, 30);
  Simulation<2> at_once(oscillator(1e6), "verlet", {{"step", 1.0}}, {.steps = 1000});
  EXPECT_NE(failure_of(at_once).find("blown up"), std::string::npos);
  EXPECT_EQ(at_once.statistics().steps, 1);
  EXPECT_EQ(at_once.statistics().max_energy_error, 0);
  Simulation<2> wild(oscillator(1), "verlet", {{"step", 1.2}}, {.steps = 1000});
  EXPECT_EQ(failure_of(wild), "none");
}

TEST(Simulation, AJumpOfTheEnergyEndsAnExactMethod) {
  IntegratorInfo info = find_integrator("verlet");
  for (const bool exact : {false, true}) {
    info.exact = exact;
    Simulation<2> run(oscillator(1), info, {{"step", 0.1}}, {.steps = 20});
    const std::string message = failure_of(run);
    EXPECT_EQ(message.starts_with("the energy, which verlet keeps to rounding, jumped by "), exact) << message;
  }
  for (const auto& method : integrators())
    EXPECT_EQ(method.exact, method.name == "free-flight" || method.name == "cdda" || method.name == "edda");
}

TEST(Simulation, RefusesAPeriodicBoxThatIsNarrowerThanASphere) {
  for (const double edge : {0.99, 1.01}) {
    std::string said;
    try {
      Simulation<2>(test::make_system<2>({4, edge}, Boundary::periodic, {{1, 0.5}}, {{1, 0}}), "psa", {},
                    {.step = 0.1, .steps = 1});
    } catch (const Error& e) {
      EXPECT_EQ(e.failure(), Failure::initial_state);
      said = e.what();
    }
    EXPECT_EQ(said.starts_with("the periodic box is 0.99 long on axis 1, less than a diameter of 1;"), edge < 1)
        << said;
  }
}

TEST(Simulation, RefusesAPlanWithoutEnd) {
  EXPECT_THROW(test::make_run<2>(test::five_springs(), "cva", {.step = 0.1}), Error);
  EXPECT_THROW(test::make_run<2>(test::five_springs(), "cva", {.step = 0, .steps = 1}), Error);
}

TEST(Simulation, RefusesIntervalsThatCannotBeCounted) {
  EXPECT_THROW(test::make_run<2>(test::five_springs(), "cva", {.step = 0.1, .steps = 1, .thermo_interval = 1e-12}),
               Error);
  EXPECT_THROW(test::make_run<2>(test::five_springs(), "cva", {.step = 0.1, .steps = 1, .frame_interval = 1e-300}),
               Error);
  EXPECT_NO_THROW(test::make_run<2>(test::five_springs(), "cva", {.step = 0.1, .steps = 1, .frame_interval = 1e-6}));
  Notebook<2> notes;
  notes.wanted = {.interval = 1e-12};
  EXPECT_THROW(test::make_run<2>(test::five_springs(), "cva", {.step = 0.1, .steps = 1})->add(notes), Error);
}

TEST(Simulation, FreeFlightRefusesForces) {
  EXPECT_THROW(test::run_steps<2>(test::five_springs(), "free-flight", 0.1, 1), Error);
}

}  // namespace
}  // namespace carom::simulation_test
