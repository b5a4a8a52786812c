// SPDX-License-Identifier: BSD-3-Clause
#include "io/deck/deck.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <fstream>
#include <numbers>

#include "engine/ranks/id_blocks.h"
#include "engine/setup/placement.h"
#include "io/deck/deck_source.h"
#include "io/deck/memory.h"
#include "io/deck/validate_state.h"
#include "tests/support/thread_ranks.h"

namespace carom::deck_test {
namespace {

/// A folder with decks for each test.
class DeckTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(testing::TempDir()) / (std::string("carom-deck-") + info->name());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }

  Deck read(const std::string& text, const std::vector<std::string>& set = {}) const {
    return read_deck(write("deck.toml", text), set);
  }

 private:
  std::filesystem::path folder_;
};

const std::string springs = R"(format = 1
title = "a \"quoted\" title"
description = """two
lines"""
[system]
dimension = 2
box = [10, 8.5]
boundary = ["wall", "periodic"]
[[particles]]
name = "a"
position = [[2, 5], [5, 5]]
velocity = [[0.1, 0], [0, -0.3]]
radius = [0.5, 0.25]
[[particles]]
name = "b"
position = [[8, 5]]
radius = 0.5
mass = 2
charge = -1
[[interaction]]
type = "harmonic-bond"
pairs = [[0, 1], [1, 2]]
stiffness = 3
rest_length = 3.0
[integrator]
type = "cdda"
step = 0.01
[run]
steps = 1e3
)";

const std::string fluid = R"(format = 1
[system]
dimension = 3
boundary = ["periodic", "periodic", "periodic"]
[[particles]]
name = "small"
count = 80
temperature = 1.5
radius = 0.4
[[particles]]
name = "large"
count = 20
temperature = 1.5
radius = 0.5
mass = 2.0
[placement]
type = "fcc"
packing_fraction = 0.30
seed = 7
[integrator]
type = "free-flight"
[run]
collisions = 1000
)";

template <int D>
void expect_equal(const System<D>& a, const System<D>& b) {
  EXPECT_EQ(a.box.edges, b.box.edges);
  EXPECT_EQ(a.box.boundary, b.box.boundary);
  EXPECT_EQ(a.species, b.species);
  EXPECT_EQ(a.particles.x, b.particles.x);
  EXPECT_EQ(a.particles.v, b.particles.v);
  EXPECT_EQ(a.particles.mass, b.particles.mass);
  EXPECT_EQ(a.particles.radius, b.particles.radius);
  EXPECT_EQ(a.particles.charge, b.particles.charge);
  EXPECT_EQ(a.particles.species, b.particles.species);
  EXPECT_EQ(a.interactions.size(), b.interactions.size());
}

TEST_F(DeckTest, ReadsWhatItSays) {
  Deck deck = read(springs);
  EXPECT_EQ(deck.title, "a \"quoted\" title");
  EXPECT_EQ(deck.description, "two\nlines");
  EXPECT_EQ(deck.integrator, "cdda");
  EXPECT_EQ(deck.integrator_parameters.real("step"), 0.01);
  EXPECT_EQ(deck.integrator_parameters.integer("order"), 2);  // a default
  EXPECT_EQ(deck.plan.step, 0.01);
  EXPECT_EQ(deck.plan.steps, 1000);
  EXPECT_FALSE(deck.plan.end_time);
  EXPECT_EQ(deck.output.directory, "runs/deck");

  const auto system = build_system<2>(deck);
  const Particles<2>& p = system->particles;
  EXPECT_EQ(system->box.edges, Vec<2>(10, 8.5));
  EXPECT_EQ(system->box.boundary, (std::array{Boundary::wall, Boundary::periodic}));
  EXPECT_EQ(p.x, (std::vector<Vec<2>>{{2, 5}, {5, 5}, {8, 5}}));
  EXPECT_EQ(p.v, (std::vector<Vec<2>>{{0.1, 0}, {0, -0.3}, {0, 0}}));
  EXPECT_EQ(p.radius, (std::vector<double>{0.5, 0.25, 0.5}));
  EXPECT_EQ(p.mass, (std::vector<double>{1, 1, 2}));
  EXPECT_EQ(p.charge, (std::vector<double>{0, 0, -1}));
  EXPECT_EQ(p.species, (std::vector<std::uint16_t>{0, 0, 1}));
}

/// Indices of lists count from the first particle of their own species.
TEST_F(DeckTest, ListsOfALaterSpeciesAreItsOwn) {
  Deck deck = read(springs, {"particles.1.position=[[8, 5], [8, 2]]", "particles.1.velocity=[[1, 2], [3, 4]]",
                             "particles.1.radius=[0.3, 0.4]", "particles.1.mass=[5, 6]", "particles.1.charge=[7, 8]"});
  const auto system = build_system<2>(deck);
  const Particles<2>& p = system->particles;
  EXPECT_EQ(p.v, (std::vector<Vec<2>>{{0.1, 0}, {0, -0.3}, {1, 2}, {3, 4}}));
  EXPECT_EQ(p.radius, (std::vector<double>{0.5, 0.25, 0.3, 0.4}));
  EXPECT_EQ(p.mass, (std::vector<double>{1, 1, 5, 6}));
  EXPECT_EQ(p.charge, (std::vector<double>{0, 0, 7, 8}));
}

TEST_F(DeckTest, OutputIsWhatItSays) {
  const Deck deck = read(springs, {"output.directory=there", "output.frame_interval=0.25", "output.thermo_interval=0.5",
                                   "output.sample_start=1.5", "output.msd_interval=0.75", "output.events=true",
                                   R"(output.start="equilibrated")", R"(output.checkpoint_wall="")",
                                   R"(output.units={length = "nm", time = "ps"})"});
  EXPECT_EQ(deck.output.directory, "there");
  EXPECT_EQ(deck.plan.frame_interval, 0.25);
  EXPECT_EQ(deck.plan.thermo_interval, 0.5);
  EXPECT_EQ(deck.output.sample_start, 1.5);
  EXPECT_TRUE(deck.plan.from_equilibrium);
  ASSERT_EQ(deck.output.observables.size(), 1u);
  EXPECT_EQ(deck.output.observables[0].info->name, "msd");
  EXPECT_EQ(deck.output.observables[0].parameters.real("interval"), 0.75);
  EXPECT_TRUE(deck.plan.events);
  EXPECT_FALSE(deck.output.checkpoint_wall);
  EXPECT_EQ(deck.output.units->length, "nm");
  EXPECT_EQ(deck.output.units->time, "ps");
}

TEST_F(DeckTest, VectorsHaveANumberForEachAxis) {
  for (const char* vector : {"[1]", "[1, 2, 3]"})
    for (const std::string key : {"position", "velocity"}) {
      const std::string set = "particles.1." + key + "=[" + vector + "]";
      try {
        read(springs, {set});
        ADD_FAILURE() << set << " was not refused";
      } catch (const Error& e) {
        EXPECT_EQ(e.failure(), Failure::deck);
        EXPECT_NE(std::string(e.what()).find("vector 0 (from 0) of '" + key + "' has "), std::string::npos) << e.what();
      }
    }
}

/// An error names the problem and its position.
TEST_F(DeckTest, MistakesAreRefused) {
  const auto said = [&](const std::string& text, const std::vector<std::string>& set, bool replace = false) {
    try {
      Deck deck = read_deck(write("deck.toml", text), set, read_text, replace);
      deck.dimension == 2 ? void(build_system<2>(deck)) : void(build_system<3>(deck));
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  const auto line_of_second = [](const std::string& text, const std::string& part) {
    const auto at = text.find(part, text.find(part) + 1);
    return std::to_string(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n') + 1);
  };
  struct Mistake {
    const std::string& text;
    std::vector<std::string> set;
    std::string says;
  };
  for (const auto& [text, set, says] : std::vector<Mistake>{
           {fluid, {"placement.packing_fraction=1"}, "'packing_fraction' must be below 1"},
           {springs, {R"(system.boundary=["wall"])"}, "'boundary' has the wrong length (1)"},
           {springs, {"system.box=[10, 8, 6]"}, "'box' has the wrong length (3)"},
           {springs, {"interaction.pairs=[[0, -1]]"}, "names the particle -1, which cannot be"},
           {springs, {"particles.0.velocity=[[0.1, 0]]"}, "'velocity' has 1 vector for 2 particles"},
           {springs,
            {"particles.1.position=[[5.7, 5]]"},
            "deck.toml:" + line_of_second(springs, "[[particles]]") + ":1: error: 1 pair of spheres overlaps"},
           {springs, {"system.box=[1, 1]"}, "the spheres fill 1.7671"}})
    EXPECT_NE(said(text, set).find(says), std::string::npos) << says << " in: " << said(text, set);
  EXPECT_EQ(said(springs, {"system.box=[1, 1]", R"(system.boundary=["open", "open"])"}),
            "");  // an open box has no volume
  // If another type is set, keys of the deck that it does not have are dropped; unknown keys that are set with it are
  // errors.
  std::string fourth = springs;
  fourth.replace(fourth.find("step = 0.01"), 11, "step = 0.01\norder = 4");
  EXPECT_NE(said(fourth, {"integrator.type=psa"}).find("unknown key 'order'"), std::string::npos);
  EXPECT_EQ(said(fourth, {"integrator.type=psa"}, true), "");
  EXPECT_NE(said(fourth, {"integrator.type=psa", "integrator.order=2"}, true).find("unknown key 'order'"),
            std::string::npos);
}

TEST_F(DeckTest, WarnsOfAStepBeyondATenthOfThePeriod) {
  const auto warnings = [&](double share) {
    const double period = 2 * std::numbers::pi / std::sqrt(3 * (1 + 0.5));
    Deck deck = read(springs, {"interaction.0.pairs=[[1, 2]]", "integrator.step=" + std::to_string(share * period)});
    build_system<2>(deck);
    return deck.warnings;
  };
  EXPECT_TRUE(warnings(0.099).empty());
  ASSERT_EQ(warnings(0.101).size(), 1u);
  EXPECT_NE(warnings(0.101)[0].find("is long for the shortest period at the start"), std::string::npos);
}

TEST_F(DeckTest, WarnsOfACutoffBeyondHalfThePeriodicBox) {
  const auto warnings = [&](const std::string& cutoff) {
    Deck deck =
        read(springs + "[[interaction]]\ntype = \"yukawa\"\namplitude = 1\nkappa = 3\ncutoff = " + cutoff + "\n");
    build_system<2>(deck);
    return deck.warnings;
  };
  EXPECT_TRUE(warnings("4.25").empty());  // the edge between walls is longer
  ASSERT_EQ(warnings("4.5").size(), 1u);
  EXPECT_NE(warnings("4.5")[0].find("cutoff 4.5 is more than half the box, 4.25"), std::string::npos);
}

TEST_F(DeckTest, WarnsOfTheBackgroundOfAnEwaldSum) {
  const auto warnings = [&](const std::string& charge, const std::string& interaction) {
    const auto species = [](const std::string& name, const std::string& q) {
      return "[[particles]]\nname = \"" + name + "\"\ncount = 32\ntemperature = 1.0\nradius = 0.1\ncharge = " + q +
             "\n";
    };
    Deck deck = read(
        "format = 1\ntitle = \"t\"\n[system]\ndimension = 3\nbox = [8, 8, 8]\n"
        "boundary = [\"periodic\", \"periodic\", \"periodic\"]\n" +
        species("a", "1.0") + species("b", charge) + "[placement]\ntype = \"fcc\"\n[[interaction]]\ntype = \"" +
        interaction + "\"\nform = \"ewald\"\naccuracy = 0.01\n[integrator]\ntype = \"psa\"\nstep = 0.001\n" +
        "[run]\nsteps = 1\n[output]\ndirectory = \"out\"\n");
    build_system<3>(deck);
    return deck.warnings;
  };
  EXPECT_TRUE(warnings("-1.0", "coulomb").empty());
  ASSERT_EQ(warnings("-0.5", "coulomb").size(), 1u);
  EXPECT_NE(warnings("-0.5", "coulomb")[0].find("the charges add up to 16, which a uniform background neutralises"),
            std::string::npos);
  ASSERT_EQ(warnings("-1.0", "gravity").size(), 1u);
  EXPECT_NE(warnings("-1.0", "gravity")[0].find("Jeans swindle"), std::string::npos);
}

/// A checkpoint has the bonds that were found at the start of the run, so a branch cannot set another length.
TEST_F(DeckTest, ABranchHasTheBondsOfItsRun) {
  std::string lattice = fluid + R"([[interaction]]
type = "harmonic-bond"
within = 1.3
stiffness = 2
rest_length = 1
)";
  const std::string free = R"(type = "free-flight")";
  const Deck of = read(lattice.replace(lattice.find(free), free.size(), "type = \"psa\"\nstep = 0.01"));
  bool same = true;
  const auto branch = [&](const std::vector<std::string>& set) { return read_branch(of, set, read_text, same); };
  for (const char* within : {"1.2", "1.4"})
    EXPECT_THROW(branch({std::string("interaction.0.within=") + within}), Error) << within;
  EXPECT_EQ(branch({"run.collisions=2000"}).plan.collisions, 2000u);
  EXPECT_TRUE(same);
  EXPECT_EQ(branch({"interaction.0.stiffness=3"}).source->interactions.size(), 1u);
  EXPECT_FALSE(same);
  EXPECT_THROW(branch({"particles.0.radius=0.1"}), Error);
}

TEST_F(DeckTest, ResolvedDeckGivesTheSameRun) {
  Deck deck = read(springs, {R"(title="tab \t, bell \u0007, \u001F, back\\slash, \u007F")"});
  EXPECT_EQ(deck.title, "tab \t, bell \a, \x1f, back\\slash, \x7f");
  const auto system = build_system<2>(deck);
  Deck again = read(deck.toml_text);
  expect_equal(*system, *build_system<2>(again));
  EXPECT_EQ(again.toml_text, deck.toml_text);
  EXPECT_EQ(again.title, deck.title);
  EXPECT_EQ(again.description, deck.description);
  EXPECT_NE(deck.toml_text.find("charge = 0.0"), std::string::npos) << "defaults are written out";
}

TEST_F(DeckTest, ResolvedDeckKeepsWhatTheInitialStateDecided) {
  Deck deck = read(fluid);
  const auto system = build_system<3>(deck);
  EXPECT_GT(deck.plan.step, 0);
  Deck again = read(deck.toml_text);
  EXPECT_EQ(again.plan.step, deck.plan.step);
  EXPECT_EQ(again.integrator_parameters.real("step"), deck.plan.step);
  expect_equal(*system, *build_system<3>(again));
  EXPECT_EQ(again.toml_text, deck.toml_text);
}

/// Species, vacancies and walls; errors have the same messages on all numbers of ranks.
TEST_F(DeckTest, RanksBuildTheSharesOfOneInitialState) {
  const std::string mixture = R"(format = 1
[system]
dimension = 3
boundary = ["periodic", "wall", "periodic"]
[[particles]]
name = "large"
count = 61
temperature = 1.5
radius = 0.5
[[particles]]
name = "small"
count = 120
temperature = 0.5
radius = 0.3
mass = 0.25
[placement]
type = "fcc"
packing_fraction = 0.2
[integrator]
type = "free-flight"
[run]
end_time = 1.0
[output]
directory = "unused"
)";
  Deck deck = read(mixture);
  const auto whole = build_system<3>(deck);
  Deck dense = read(mixture, {"placement.packing_fraction=0.9"});
  std::string refused;
  try {
    build_system<3>(dense);
  } catch (const Error& e) {
    refused = e.what();
  }
  EXPECT_NE(refused.find("overlap"), std::string::npos);
  for (const int size : {2, 3, 5})
    test::ThreadRanks(size).run([&](Communicator& ranks) {
      Deck mine = deck, too_dense = dense;
      mine.source = std::make_shared<Deck::Source>(*deck.source),
      too_dense.source = std::make_shared<Deck::Source>(*dense.source);
      const auto share = build_system<3>(mine, &ranks);
      EXPECT_LE(share->particles.size(), 181u / static_cast<unsigned>(size) + 1);
      EXPECT_EQ(share->size(), 181u);
      EXPECT_EQ(mine.plan.step, deck.plan.step);
      EXPECT_EQ(share->box.edges, whole->box.edges);
      const Particles<3> all = gathered(ranks, share->particles);
      if (ranks.rank() == 0) {
        EXPECT_EQ(all.x, whole->particles.x);
        EXPECT_EQ(all.v, whole->particles.v);
        EXPECT_EQ(all.mass, whole->particles.mass);
        EXPECT_EQ(all.radius, whole->particles.radius);
        EXPECT_EQ(all.charge, whole->particles.charge);
        EXPECT_EQ(all.species, whole->particles.species);
      }
      try {
        build_system<3>(too_dense, &ranks);
        ADD_FAILURE() << "was not refused";
      } catch (const Error& e) {
        EXPECT_EQ(e.what(), refused);
      }
    });
}

TEST_F(DeckTest, PackingFractionAndTemperatureAreMet) {
  Deck deck = read(fluid);
  const auto system = build_system<3>(deck);
  EXPECT_NEAR(packing_fraction<3>(system->box.volume(), system->particles.radius), 0.30, 1e-14);
  double twice_kinetic = 0;
  for (std::size_t i = 0; i < 100; ++i)
    twice_kinetic += system->particles.mass[i] * system->particles.v[i].squaredNorm();
  EXPECT_NEAR(twice_kinetic / 300, 1.5, 1e-14);
  Deck other = read(fluid, {"placement.seed=8"});
  EXPECT_NE(build_system<3>(other)->particles.v, system->particles.v);
}

TEST_F(DeckTest, VelocitiesOfGivenPositionsAreDrawnWithSeed1) {
  const auto velocities = [&](const std::vector<std::string>& placement) {
    std::vector<std::string> set{"particles.1.position=[[8, 5], [7, 7]]", "particles.1.temperature=1"};
    set.insert(set.end(), placement.begin(), placement.end());
    Deck deck = read(springs, set);
    return build_system<2>(deck)->particles.v;
  };
  const auto without = velocities({});
  EXPECT_GT(without[3].norm(), 0);
  EXPECT_EQ(without, velocities({"placement.type=random"}));
  EXPECT_EQ(without, velocities({"placement.type=random", "placement.seed=1"}));
  EXPECT_NE(without, velocities({"placement.type=random", "placement.seed=2"}));
}

TEST_F(DeckTest, EpochIsAboutFortyMeanFreeTimes) {
  // Equal spheres of diameter and temperature 1 at packing fraction 0.3: Enskog's rate is 10.1 collisions per unit
  // time.
  Deck deck = read(fluid, {"particles.0.radius=0.5", "particles.1.mass=1.0", "particles.0.temperature=1",
                           "particles.1.temperature=1"});
  build_system<3>(deck);
  EXPECT_NEAR(deck.plan.step, 40 / 10.1, 0.08);
  Deck at_rest = read(fluid, {"particles.0.temperature=0", "particles.1.temperature=0"});
  build_system<3>(at_rest);
  EXPECT_EQ(at_rest.plan.step, 1);
}

TEST_F(DeckTest, SetReplacesAndAdds) {
  Deck deck = read(springs, {"integrator.type=cva", "run.end_time=2.5", "interaction.stiffness=7",
                             "particles.1.mass=[4]", "output.events = true", "output.checkpoint_wall=00:05:00"});
  EXPECT_EQ(deck.integrator, "cva");
  EXPECT_EQ(deck.plan.end_time, 2.5);
  EXPECT_TRUE(deck.plan.events);
  EXPECT_EQ(deck.output.checkpoint_wall, 300.0);
  EXPECT_NE(deck.toml_text.find("stiffness = 7.0"), std::string::npos);
  EXPECT_EQ(build_system<2>(deck)->particles.mass[2], 4);
}

TEST_F(DeckTest, PeriodicPositionsAreWrappedAndRememberTheirImage) {
  Deck deck = read(springs, {"particles.1.position=[[8, -3.5]]"});
  const auto system = build_system<2>(deck);
  EXPECT_EQ(system->particles.x[2], Vec<2>(8, 5));
  EXPECT_EQ(system->particles.image[2], (Image<2>{0, -1}));
}

TEST_F(DeckTest, PositionsFromAFileGiveTheSameRunFromAnotherFolder) {
  write("places.txt", "# two\n1.0 2.0 3.0\n\n4.5, 5, 6e0\n");
  const std::vector<std::string> set{"particles.0.count=1", "particles.1.count=1", "placement.type=file",
                                     "placement.file=places.txt", "placement.packing_fraction=0.001"};
  Deck deck = read(fluid, set);
  const auto system = build_system<3>(deck);
  EXPECT_EQ(system->particles.x, (std::vector<Vec<3>>{{1, 2, 3}, {4.5, 5, 6}}));
  std::filesystem::create_directories(deck.file.parent_path() / "elsewhere");
  Deck again = read_deck(write("elsewhere/deck.toml", deck.toml_text), {});
  expect_equal(*system, *build_system<3>(again));
}

TEST_F(DeckTest, ExplicitSpheresStandAmongRandomOnes) {
  Deck deck = read(springs +
                   "[[particles]]\nname = \"c\"\ncount = 12\ntemperature = 1\nradius = 0.5\n"
                   "[placement]\ntype = \"random\"\n");
  const auto system = build_system<2>(deck);
  EXPECT_EQ(system->particles.x[1], Vec<2>(5, 5));
  EXPECT_EQ(system->particles.v[1], Vec<2>(0, -0.3));
  EXPECT_EQ(system->particles.size(), 15u);
}

/// The largest sphere of all species matters, at any position in its list.
TEST_F(DeckTest, LatticesKeepTheLargestOfAListOfRadiiOffTheWalls) {
  const std::string box = R"(format = 1
[system]
dimension = 2
box = [3.4, 3.4]
boundary = ["wall", "wall"]
[placement]
type = "square"
[integrator]
type = "free-flight"
[run]
end_time = 1.0
)";
  const auto species = [](const std::string& name, int count, const std::string& radius) {
    return "[[particles]]\nname = \"" + name + "\"\ncount = " + std::to_string(count) +
           "\ntemperature = 1\nradius = " + radius + "\n";
  };
  for (const std::string& particles :
       {species("a", 4, "[0.2, 0.3, 1.0, 0.25]"), species("a", 2, "0.3") + species("b", 2, "[0.2, 1.0]"),
        species("a", 2, "[1.0, 0.2]") + species("b", 2, "0.3")}) {
    Deck deck = read(box + particles);
    const auto system = build_system<2>(deck);
    std::vector<Vec<2>> sites = system->particles.x;
    std::ranges::sort(sites, {}, [](const Vec<2>& x) { return std::pair(x[0], x[1]); });
    const double far = 3.4 - 1.0;
    EXPECT_EQ(sites, (std::vector<Vec<2>>{{1, 1}, {1, far}, {far, 1}, {far, far}})) << particles;
  }
}

TEST_F(DeckTest, CompressedMixturesAreWhatTheDeckSaysAndComeOutOfTheResolvedDeckAgain) {
  const std::vector<std::string> set{"placement.type=compressed", "placement.packing_fraction=0.5",
                                     "placement.growth_rate=0.5", "particles.1.mass=7"};
  Deck deck = read(fluid, set);
  const auto system = build_system<3>(deck);
  const auto& p = system->particles;
  EXPECT_EQ(p.radius.front(), 0.4);  // exactly
  EXPECT_NE(p.radius.back(), p.radius.front());
  EXPECT_NEAR(packing_fraction<3>(system->box.volume(), p.radius), 0.5, 1e-14);
  EXPECT_EQ(find_overlaps<3>(system->box, p.x, p.radius).pairs, 0u);
  Deck again = read_deck(write("again.toml", deck.toml_text), {});
  expect_equal(*system, *build_system<3>(again));

  auto lighter = set;
  lighter.back() = "particles.1.mass=1";
  Deck other = read(fluid, lighter);
  EXPECT_EQ(build_system<3>(other)->particles.x, p.x);  // masses and velocities of the run are ignored
}

TEST_F(DeckTest, ShortestPeriodOfOneBondIsThatOfItsOscillator) {
  Deck deck = read(springs, {"interaction.0.pairs=[[1, 2]]"});
  const auto system = build_system<2>(deck);
  EXPECT_NEAR(shortest_period(*system), 2 * std::numbers::pi / std::sqrt(3 * (1 + 0.5)), 1e-12);
}

/// A pair within a cutoff takes four bytes; along a periodic axis a particle has images, between walls it has none.
TEST_F(DeckTest, MemoryOfPairsIsThatOfThoseWithinTheCutoff) {
  const auto pairs = [&](double cutoff) {
    Deck deck = read(springs + "[[interaction]]\ntype = \"yukawa\"\namplitude = 1\nkappa = 3\ncutoff = " +
                     std::to_string(cutoff) + "\n");
    deck.source->species[0].count = 9999;
    Box<2> box;
    box.edges = {10, 8};
    box.boundary = {Boundary::wall, Boundary::periodic};
    return (estimated_memory(*deck.source, &box) - estimated_memory<2>(*deck.source, nullptr)) / (4 * 0.5 * 1e8);
  };
  const double disc = std::numbers::pi / 4;  // the disc's fraction of its square
  EXPECT_NEAR(pairs(1), disc * 0.2 * 0.25, 1e-3 * pairs(1));
  EXPECT_NEAR(pairs(4), disc * 0.8 * 1.0, 1e-3 * pairs(4));
  EXPECT_NEAR(pairs(16), disc * 1.0 * 4.0, 1e-3 * pairs(16));
}

TEST_F(DeckTest, MemoryIsThatOfAllRanksWithinTheLimitOfTheProcess) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the sanitizer has more memory of its own than the limit";
#endif
  rlimit before{};
  getrlimit(RLIMIT_AS, &before);
  rlimit limit = before;
  limit.rlim_cur = 1'000'000'000;
  Deck deck = read(springs);
  SpeciesConfig& species = deck.source->species[0];
  species.count = 1000;
  const double few = estimated_memory<3>(*deck.source, nullptr);
  species.count = 2'000'000;
  const double many = estimated_memory<3>(*deck.source, nullptr);
  species.count = static_cast<std::size_t>(2e6 * 1.5e9 / (many - few));
  setrlimit(RLIMIT_AS, &limit);
  std::string said;
  try {
    check_memory<3>(*deck.source, nullptr, 1);
  } catch (const Error& e) {
    said = e.what();
  }
  EXPECT_NO_THROW(check_memory<3>(*deck.source, nullptr, 2));
  setrlimit(RLIMIT_AS, &before);
  EXPECT_NE(said.find("GB of memory; 1 GB are free here"), std::string::npos) << said;
}

}  // namespace
}  // namespace carom::deck_test
