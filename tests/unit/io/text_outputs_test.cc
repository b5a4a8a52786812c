// SPDX-License-Identifier: BSD-3-Clause
// thermo.csv, summary.json, run.log, progress, the output directory.

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <bit>
#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "engine/base/error.h"
#include "io/files/averages.h"
#include "io/files/descriptor.h"
#include "io/files/directory_lock.h"
#include "io/files/log.h"
#include "io/files/log_report.h"
#include "io/files/output_directory.h"
#include "io/files/progress.h"
#include "io/files/summary.h"
#include "io/files/text_file.h"
#include "io/files/thermo.h"
#include "sample_run.h"

namespace carom::text_outputs_test {
namespace {

namespace fs = std::filesystem;
using test::fresh_directory;

std::string contents(const fs::path& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(Thermo, RowsHoldExactDoublesAtOnce) {
  const auto path = fresh_directory() / "thermo.csv";
  const auto system = test::sample_system<3>();
  ThermoWriter<3> writer(path, system->box);
  writer.thermo(test::sample_snapshot<3>(system->particles, 0.1, 7));
  std::istringstream in(contents(path));  // before the file is closed
  std::string header, row, cell;
  std::getline(in, header);
  std::getline(in, row);
  EXPECT_EQ(header,
            "time,step,collisions,kinetic,potential,total,shadow,max_energy_error,momentum_x,momentum_y,momentum_z,"
            "temperature,pressure,conserved,dissipated,work,heat,rotational,rotational_temperature,step_length,bonds,"
            "shear_stress,pressure_y-,pressure_y+,pressure_z-,pressure_z+");
  std::vector<double> values;
  for (std::istringstream cells(row); std::getline(cells, cell, ',');)
    values.push_back(std::strtod(cell.c_str(), nullptr));
  ASSERT_EQ(values.size(), 26U);
  EXPECT_EQ(values[0], 0.1);
  EXPECT_EQ(values[2], 21);
  EXPECT_EQ(values[5], 1.25);
  EXPECT_TRUE(std::isnan(values[6]));
  EXPECT_EQ(values[11], 1.0 / 3);
  for (const Column<3>& column : columns<3>())
    EXPECT_NE(columns_page().find(std::string("    ").append(column.name)), std::string::npos) << column.name;
}

// Only complete rows count: a kill may leave a partial row.
TEST(Thermo, TheLastRowSaysHowFarARunHasCome) {
  const auto path = fresh_directory() / "thermo.csv";
  const auto expect = [&](double time, std::int64_t step, std::uint64_t collisions) {
    const ThermoPoint point = last_thermo_point(path);
    EXPECT_EQ(point.time, time);
    EXPECT_EQ(point.step, step);
    EXPECT_EQ(point.collisions, collisions);
  };
  const auto append = [&](const char* text) { std::ofstream(path, std::ios::app) << text; };
  expect(0, 0, 0);
  append("");
  expect(0, 0, 0);
  append("time,step,collisions,kinetic\n");
  expect(0, 0, 0);
  append("0.30000000000000004,3,5000000000,1.5");
  expect(0, 0, 0);
  append("\n");
  expect(0.30000000000000004, 3, 5000000000);
  append("0.7,9,6000000000,1");
  expect(0.30000000000000004, 3, 5000000000);
  append("\n");
  for (int n = 10; n < 100; ++n) append("0.75,10,6000000000,1.5,2.5,3.5,4.5,5.5,6.5,7.5,8.5,9.5,10.5\n");
  append("12,100,6000000001,1.5,2.5,3.5,4.5,5.5,6.5,7.5,8.5,9.5,10.5\n");
  expect(12, 100, 6000000001);
}

// Text that does not fit is removed, so that the file ends with a complete line, and the message names the file.
TEST(TextFile, TakesBackWhatDoesNotFit) {
  const auto path = fresh_directory() / "limited.txt";
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  TextFile file(path);
  file.append("first line\n");
  rlimit limit = before;
  limit.rlim_cur = 20;
  setrlimit(RLIMIT_FSIZE, &limit);
  try {
    file.append("a second line that is too long\n");
    ADD_FAILURE() << "wrote beyond the limit";
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), 5);
    EXPECT_NE(std::string(e.what()).find(path.string()), std::string::npos);
  }
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(contents(path), "first line\n");
}

// A symbolic link stays; its target is replaced as a whole, or created.
TEST(WriteAside, GoesBehindLinks) {
  const auto directory = fresh_directory();
  fs::create_directory(directory / "there");
  const auto file = directory / "there" / "file", link = directory / "link", far = directory / "far",
             dangling = directory / "dangling";
  std::ofstream(file) << "old";
  fs::create_symlink("there/file", link);
  fs::create_symlink(link, far);
  fs::create_symlink("there/new", dangling);
  std::ifstream reader(file);
  for (const auto& name : {link, far}) {
    write_aside(name, [&](TextFile& out) {
      out.append(name.string());
      EXPECT_TRUE(fs::exists(file.string() + ".part"));
    });
    EXPECT_EQ(contents(file), name.string());
  }
  write_file_atomically(dangling, "new");
  EXPECT_EQ(contents(directory / "there" / "new"), "new");
  for (const auto& name : {link, far, dangling}) EXPECT_TRUE(fs::is_symlink(name)) << name;
  EXPECT_EQ((std::string{std::istreambuf_iterator<char>(reader), {}}), "old");  // of the file that was replaced
  EXPECT_THROW(write_aside(link, [](TextFile&) { throw Error(Failure::file, "no"); }), Error);
  EXPECT_EQ(contents(file), far.string());
  EXPECT_EQ(std::distance(fs::directory_iterator(directory / "there"), {}), 2);  // no part is left
}

TEST(WriteAside, WritesToPipesAndDevices) {
  const auto directory = fresh_directory(), pipe = directory / "pipe", device = directory / "device";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const Descriptor reader(::open(pipe.c_str(), O_RDONLY | O_NONBLOCK));
  write_file_atomically(pipe, "through");
  std::array<char, 10> got{};
  EXPECT_EQ(::read(reader.number(), got.data(), got.size()), 7);
  EXPECT_STREQ(got.data(), "through");
  fs::create_symlink("/dev/full", device);
  EXPECT_THROW(write_file_atomically(device, "lost"), Error);
  EXPECT_TRUE(fs::is_fifo(pipe));
  EXPECT_TRUE(fs::is_symlink(device));
  EXPECT_THROW(write_file_atomically(directory, "nowhere"), Error);
  EXPECT_EQ(std::distance(fs::directory_iterator(directory), {}), 2);
}

TEST(RenameFile, ReplacesFilesAndLinksOnly) {
  const auto directory = fresh_directory(), from = directory / "from";
  fs::create_directory(directory / "directory");
  ASSERT_EQ(::mkfifo((directory / "pipe").c_str(), 0600), 0);
  std::ofstream(directory / "file") << "old";
  fs::create_symlink("file", directory / "link");
  for (const char* name : {"directory", "pipe", "missing/file"}) {
    std::ofstream(from) << "new";
    try {
      rename_file(from, directory / name);
      ADD_FAILURE() << name;
    } catch (const Error& e) {
      EXPECT_EQ(e.failure(), Failure::file);
      EXPECT_NE(std::string(e.what()).find((directory / name).string() + ": "), std::string::npos) << e.what();
    }
    EXPECT_EQ(contents(from), "new");
  }
  for (const char* name : {"file", "link"}) {
    std::ofstream(from) << name;
    rename_file(from, directory / name);
    EXPECT_EQ(contents(directory / name), name);
    EXPECT_FALSE(fs::exists(from));
  }
  EXPECT_EQ(contents(directory / "file"), "file");
}

TEST(Log, AFullDiskIsAnError) { EXPECT_THROW(RunLog("/dev/full", true).note("lost"), Error); }

// A table for readers: few rows, evenly in each doubling, and always the last.
TEST(Log, TheTableIsNoCopyOfThermo) {
  const auto path = fresh_directory() / "run.log";
  const auto system = test::sample_system<2>();
  RunLog log(path, true);
  ThermoTable<2> table(log);
  constexpr int kRows = 100001;
  for (int row = 0; row <= kRows; ++row) table.thermo(test::sample_snapshot<2>(system->particles, row, row));
  table.finish();
  table.finish();  // it has been written
  std::ifstream in(path);
  std::vector<int> steps;
  int days = 0;
  std::string line;
  std::getline(in, line);
  EXPECT_EQ(line.find('-'), 4u) << line;  // a date
  EXPECT_NE(line.find("temperature"), std::string::npos);
  while (std::getline(in, line)) {
    std::istringstream words(line);
    std::string clock, time;
    int step = -1;
    words >> clock;
    if (clock.find('-') == 4) {  // the next day
      ++days;
      words >> clock;
    }
    words >> time >> step;
    steps.push_back(step);
  }
  EXPECT_LE(days, 1);
  EXPECT_EQ(steps.back(), kRows);
  EXPECT_LT(steps.size(), 250u);
  for (std::size_t n = 1; n < steps.size(); ++n) {
    EXPECT_GT(steps[n], steps[n - 1]);
    EXPECT_LE(steps[n] - steps[n - 1], std::max(1, steps[n] / 16)) << steps[n];
  }
}

TEST(Log, WarnsOfAnEnergyThatIsWrongByItsOwnSize) {
  Statistics s;
  s.first_step_error = 0.5, s.energy_reference = 2, s.energy_scale = 1;
  s.max_energy_error = 1.9;
  const IntegratorInfo &psa = find_integrator("psa"), &edda = find_integrator("edda");
  EXPECT_FALSE(energy_warning(s, psa));
  EXPECT_NE(energy_warning(s, edda)->find("rounding has added up to 0.95 of"), std::string::npos);
  s.first_step_error = 0, s.max_energy_error = 1.9e-12;
  EXPECT_FALSE(energy_warning(s, edda));
  s.first_step_error = 2e-12;
  EXPECT_NE(energy_warning(s, edda)->find("rounding has added up to 2e-12 of"), std::string::npos);
  s.first_step_error = 0.5;
  s.max_energy_error = 5;
  EXPECT_NE(energy_warning(s, psa)->find("wrong by 2.5 times its own size:"), std::string::npos);
  s.first_step_error = 4, s.max_energy_error = 0;
  EXPECT_NE(energy_warning(s, edda)->find("wrong by 4 times its own size after the first step:"), std::string::npos);
}

TEST(Log, TheBannerSaysWhatRunsAndToWhichEnd) {
  Deck deck = test::sample_deck(3);
  deck.plan.end_time = 2.5, deck.plan.collisions = 7;
  const std::string text = banner_text(deck, 3, 2);
  for (const char* part :
       {", 2 ranks\n", "\ndeck sample.toml: three spheres\n",
        "\n3 particles in 3-D, integrator free-flight, step 0.5, until 10 steps or time 2.5 or 7 pair "
        "collisions\n"})
    EXPECT_NE(text.find(part), std::string::npos) << part << " in\n" << text;
}

/// The second rank has three times as many events as the first.
TEST(Log, ReportsWhatRanksDidAndWhereTheirTimeWent) {
  Statistics s;
  s.steps = 4, s.end_time = 2.5, s.wall_seconds = 8;
  s.counters.sphere_sphere = 1600, s.counters.sphere_wall = 7;
  s.energy_final = 12, s.max_energy_error = 3e-3, s.energy_reference = 30;
  std::array<RankAccount, 2> ranks{};
  for (std::size_t k = 0; k < 2; ++k) {
    const auto part = static_cast<double>(2 * k + 1);
    ranks[k].seconds.collide = part, ranks[k].seconds.queue = 4 - part, ranks[k].wall_seconds = 8;
    ranks[k].windows = {
        .windows = 10, .rounds = 25, .events = 100 + 200 * k, .run_events = 150 + 300 * k, .redone_events = 2 + 4 * k};
    ranks[k].peak_memory_bytes = 20'000'000 * (k + 1);
  }
  const std::string text = report_text(test::sample_deck(2), s, ranks);
  for (const char* part :
       {"done at time 2.5 after 4 steps: 1600 pair and 7 wall collisions in 00:00:08, 200 pair collisions/s",
        "energy 12, largest error 3.00e-03 (relative 1.00e-04)",
        "\n10 windows, 2.50 rounds each; events at borders run twice 50.0%, redone 2.00%, imbalance 50.0%",
        "\nmemory of a rank at the peak 20 to 40 MB, 30 on average",
        "\nqueue              1.000       2.000       3.000    25.0%",
        "\ncollide            1.000       2.000       3.000    25.0%",
        "\nother              4.000       4.000       4.000    50.0%",
        "\ntotal              8.000       8.000       8.000\n"})
    EXPECT_NE(text.find(part), std::string::npos) << part << " in\n" << text;
  std::swap(ranks[0], ranks[1]);
  EXPECT_EQ(report_text(test::sample_deck(2), s, ranks), text);
  EXPECT_EQ(peak_memory_bytes(ranks), 40'000'000u);
}

/// The file is written at 1, 2, 4, 8 … samples and when it is closed.
TEST(Averages, AreWrittenWheneverTheirSamplesHaveDoubled) {
  const auto path = fresh_directory() / "profile.csv";
  const auto system = test::sample_system<2>();
  AverageWriter<2> writer(path, make_observable<2>("profile", *system, {{"interval", 1.0}, {"bins", 2}}));
  for (std::uint64_t sample = 1; sample <= 33; ++sample) {
    writer.sample(static_cast<double>(sample), system->particles);
    EXPECT_EQ(fs::remove(path), std::has_single_bit(sample)) << sample;
  }
  writer.close();
  EXPECT_TRUE(contents(path).starts_with(
      "x,density,temperature,velocity_x,velocity_y,density_small,density_large,temperature_small,"))
      << contents(path);
}

TEST(Averages, NamesThatCouldBeTakenForSeveralAreInQuotes) {
  const auto path = fresh_directory() / "msd.csv";
  const auto system = test::sample_system<2>();
  system->species = {"small", "la\"rge, heavy"};
  AverageWriter<2> writer(path, make_observable<2>("msd", *system, {{"interval", 1.0}}));
  for (int sample = 0; sample < 2; ++sample) writer.sample(sample, system->particles);
  EXPECT_TRUE(contents(path).starts_with("time,origins,msd,msd_small,\"msd_la\"\"rge, heavy\",error_msd,samples_msd,"))
      << contents(path);
}

TEST(Summary, HasEveryValueByItsName) {
  const RunOutcome outcome{.status = "failed",
                           .error = "disk \xff full",
                           .warnings = {"a warning"},
                           .particles = 3,
                           .ranks = 2,
                           .species_values = {{"contact_value", {"small", "large"}, "g", 1.5, 0.25}},
                           .walls = {{1, "x+", 4.0}, {2, "y-", 8.0}}};
  Statistics s;
  s.steps = 10, s.end_time = 11.5, s.force_passes = 12.5, s.energy_initial = 13.5;
  s.energy_after_first_step = 14.5, s.energy_final = 15.5, s.energy_reference = 16;
  s.max_energy_error = 17.5, s.tail_energy = 18.5, s.tail_pressure = 19.5;
  s.max_shadow_energy_error = 20.5, s.max_momentum_error = 21.5, s.mean_pressure = 22.5, s.collision_rate = 23.5;
  s.mean_free_time = 24.5, s.mean_free_path = 25.5, s.wall_seconds = 0.5;
  Counters& c = s.counters;
  c.sphere_sphere = 30, c.sphere_wall = 31, c.max_overlap = 32.5, c.sweeps = 33, c.pieces = 34, c.slabs_halved = 35;
  c.frozen = 36, c.fallbacks = 37, c.folded = 4, c.kicks = 38;
  c.steps.entered = 39, c.steps.left = 40, c.steps.bounced = 41;
  c.dissipated.add(5.5), c.work.add(6.5), c.heat.add(7.5);
  // Of the first mean and of the wall 2 only; pressures are (1 … 16) and forces 3.
  s.series = Blocking(Statistics::mean_names.size() + 3);
  for (int i = 0; i < 16; ++i) {
    std::vector<double> values(s.series.columns(), std::nan(""));
    values[0] = i + 1, values.back() = 3;
    s.series.add(values);
  }
  WallTally& floor = c.wall(2);
  floor.contacts = 31, floor.impulse.add(23), floor.work.add(6.5), floor.heat.add(7.5);
  auto json = nlohmann::json::parse(summary_text(test::sample_deck(2), outcome, s));
  EXPECT_GT(json["peak_memory_bytes"], 1000000);
  EXPECT_NE(json["version"], "");
  json.erase("peak_memory_bytes"), json.erase("version");
  const auto means = json["means"];
  json.erase("means");
  EXPECT_EQ(means.size(), Statistics::mean_names.size());
  for (const char* name : Statistics::mean_names) {
    EXPECT_EQ(means.at(name).size(), 3u);
    if (std::string(name) == "pressure")
      EXPECT_EQ(means.at(name)["mean"], 8.5);
    else
      EXPECT_TRUE(means.at(name)["mean"].is_null()) << name;
  }
  EXPECT_FALSE(json.contains("equilibration"));
  EXPECT_EQ(json, nlohmann::json::parse(R"({"status": "failed", "error": "disk \ufffd full", "warnings": ["a warning"],
    "deck": "sample.toml", "title": "three spheres", "integrator": "free-flight", "dimension": 2, "particles": 3,
    "ranks": 2, "steps": 10, "end_time": 11.5, "events": {"sphere_sphere": 30, "sphere_wall": 31, "kicks": 38,
    "entered": 39, "left": 40, "bounced": 41},
    "energy": {"initial": 13.5, "after_first_step": 14.5, "final": 15.5, "reference": 16.0, "max_abs_error": 17.5,
               "dissipated": 5.5, "work": 6.5, "heat": 7.5, "folded": 0.25},
    "walls": {"x+": {"collisions": 0, "force": 0.0, "pressure": 0.0, "work": 0.0, "heat": 0.0,
                     "force_standard_error": null, "pressure_standard_error": null, "independent_samples": null},
              "y-": {"collisions": 31, "force": 2.0, "pressure": 0.25, "work": 6.5, "heat": 7.5,
                     "force_standard_error": 0.0, "pressure_standard_error": 0.0, "independent_samples": null}},
    "tail": {"energy": 18.5, "pressure": 19.5}, "shadow_energy": {"max_abs_error": 20.5},
    "momentum": {"max_abs_error": 21.5}, "max_overlap": 32.5, "pressure": 22.5, "collision_rate": 23.5,
    "mean_free_time": 24.5, "mean_free_path": 25.5, "force_passes": 12.5, "sweeps": 33, "pieces": 34,
    "slabs_halved": 35, "frozen": 36, "fallbacks": 37, "wall_seconds": 0.5, "collisions_per_second": 60.0,
    "contact_value": [{"species": ["small", "large"], "g": 1.5, "standard_error": 0.25}]})"));
}

TEST(Summary, SaysWhenTheTransientEnded) {
  Deck deck = test::sample_deck(2);
  deck.plan.from_equilibrium = true;
  Statistics s;
  EXPECT_TRUE(nlohmann::json::parse(summary_text(deck, {}, s)).at("equilibration").is_null());
  EXPECT_EQ(warnings_about(deck, s, Box<2>()).size(), 1u);
  s.equilibrium = {3.5, 8.0};
  EXPECT_EQ(nlohmann::json::parse(summary_text(deck, {}, s))["equilibration"],
            nlohmann::json::parse(R"({"transient_end": 3.5, "start": 8.0})"));
  EXPECT_EQ(warnings_about(deck, s, Box<2>()).size(), 0u);
}

TEST(Summary, SaysNullWhereThereIsNoNumber) {
  Statistics s;
  s.energy_reference = std::numeric_limits<double>::quiet_NaN();
  const auto json = nlohmann::json::parse(summary_text(test::sample_deck(2), {}, s));
  EXPECT_TRUE(json["energy"]["reference"].is_null());
  for (const char* name : {"/shadow_energy/max_abs_error", "/momentum/max_abs_error", "/mean_free_time"})
    EXPECT_TRUE(json.at(nlohmann::json::json_pointer(name)).is_null()) << name;
  EXPECT_EQ(json["collisions_per_second"], 0);
  EXPECT_FALSE(json.contains("error"));
}

TEST(OutputDirectory, KeepsEarlierRunsInBackups) {
  const auto directory = fresh_directory() / "a" / "b";
  make_output_directory(directory);
  EXPECT_FALSE(prepare_output_directory(directory));
  for (int run = 1; run <= 2; ++run) {
    std::ofstream(directory / run_file::thermo) << run;
    std::ofstream(directory / "notes.txt") << "mine";
    EXPECT_EQ(prepare_output_directory(directory), directory / ("backup." + std::to_string(run)));
    EXPECT_FALSE(fs::exists(directory / run_file::thermo));
  }
  EXPECT_EQ(contents(directory / "backup.1" / run_file::thermo), "1");
  EXPECT_EQ(contents(directory / "backup.2" / run_file::thermo), "2");
  EXPECT_EQ(contents(directory / "notes.txt"), "mine");
}

/// What is neither a file nor a link is moved all the same.
TEST(OutputDirectory, ReplacesEarlierRunsOnRequest) {
  const auto directory = fresh_directory();
  for (const char* name : {run_file::trajectory, run_file::log, "rdf.csv", "rdf.csv.part"})
    std::ofstream(directory / name) << name;
  for (const char* name : {"notes.csv", "trajectory.h5md.old"}) std::ofstream(directory / name) << "mine";
  fs::create_symlink("notes.csv", directory / run_file::thermo);
  EXPECT_FALSE(prepare_output_directory(directory, true));
  EXPECT_EQ(std::distance(fs::directory_iterator(directory), fs::directory_iterator()), 2);
  for (const char* name : {"notes.csv", "trajectory.h5md.old"}) EXPECT_EQ(contents(directory / name), "mine");
  fs::create_directory(directory / run_file::summary);
  EXPECT_EQ(prepare_output_directory(directory, true), directory / "backup.1");
  EXPECT_TRUE(fs::is_directory(directory / "backup.1" / run_file::summary));
}

/// Journals and unfinished parts are moved with the files of the earlier run.
TEST(OutputDirectory, WhatAKillHasLeftGoesWithTheFiles) {
  const auto directory = fresh_directory();
  for (const char* name : {run_file::trajectory, run_file::events, run_file::checkpoint, "rdf.csv"})
    for (const char* left : {"", ".journal", ".part"}) std::ofstream(directory / (std::string(name) + left)) << name;
  ASSERT_TRUE(prepare_output_directory(directory));
  for (const char* name : {run_file::trajectory, run_file::events, run_file::checkpoint, "rdf.csv"})
    for (const char* left : {"", ".journal", ".part"}) {
      EXPECT_FALSE(fs::exists(directory / (std::string(name) + left))) << name << left;
      EXPECT_EQ(contents(directory / "backup.1" / (std::string(name) + left)), name);
    }
}

TEST(OutputDirectory, BelowAFileIsAnError) {
  const auto file = fresh_directory() / "file";
  std::ofstream(file) << "x";
  EXPECT_THROW(make_output_directory(file / "run"), Error);
}

TEST(DirectoryLock, SaysWhetherTheProcessThatItNamesIsAtWork) {
  const auto directory = fresh_directory(), lock_file = directory / run_file::lock;
  EXPECT_FALSE(run_is_at_work(directory));
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = contents(lock_file);
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from << " in " << text;
    std::ofstream(lock_file) << text.replace(at, from.size(), to);
    const bool at_work = run_is_at_work(directory);
    std::ofstream(lock_file) << text.replace(at, to.size(), from);
    return at_work;
  };
  {
    const DirectoryLock lock(directory);
    EXPECT_EQ(lock.warning(), "");
    EXPECT_TRUE(run_is_at_work(directory));
    EXPECT_THROW(DirectoryLock{directory}, Error);
    EXPECT_FALSE(with("ticks ", "ticks 1"));  // the number of a process that has ended was used again
    EXPECT_FALSE(with("process " + std::to_string(getpid()), "process 0"));
    EXPECT_TRUE(with("host ", "host not-"));  // the process is on another host: its end is unknown
    EXPECT_TRUE(run_is_at_work(directory));
  }
  EXPECT_FALSE(fs::exists(lock_file));
  {
    const DirectoryLock lock(directory);
    std::ofstream(lock_file) << "of another run";
  }
  EXPECT_EQ(contents(lock_file), "of another run");
  std::ofstream(lock_file) << "host " << host_name() << "\nprocess " << getpid() << "\nstarted then\nticks 1\n";
  const DirectoryLock lock(directory);
  EXPECT_NE(lock.warning().find("the run before in this directory was ended from outside"), std::string::npos);
}

// The estimate follows the recent pace, not the mean since the start.
TEST(RecentRates, FollowAChangeOfPace) {
  RecentRates rates(10);
  EXPECT_FALSE(rates.seconds_left());
  for (int t = 0; t <= 100; ++t) rates.add(t, 0.001 * t, 0);  // slow
  for (int t = 1; t <= 40; ++t) rates.add(100 + t, 0.1 + 0.01 * t, static_cast<std::uint64_t>(500 * t));
  EXPECT_NEAR(*rates.seconds_left(), 50, 1e-6);
  EXPECT_NEAR(rates.collisions_per_second(), 500, 1e-6);
}

TEST(Progress, ALineHasTimeShareRateErrorAndTimeLeft) {
  Statistics s;
  s.end_time = 2.5, s.fraction_done = 0.25, s.max_energy_error = 3e-3, s.energy_reference = 30;
  RecentRates rates(10);
  EXPECT_EQ(progress_text(s, rates), "t = 2.5   25.0 %  0.00e+00 collisions/s  |ΔE/E| = 1.0e-04  ETA --:--:--");
  rates.add(0, 0.05, 100);
  rates.add(4, 0.25, 500);
  EXPECT_EQ(progress_text(s, rates), "t = 2.5   25.0 %  1.00e+02 collisions/s  |ΔE/E| = 1.0e-04  ETA 00:00:15");
}

TEST(Progress, ClockText) {
  EXPECT_EQ(clock_text(0.2), "00:00:01");
  EXPECT_EQ(clock_text(3725), "01:02:05");
  EXPECT_EQ(clock_text(360000), "100:00:00");
}

}  // namespace
}  // namespace carom::text_outputs_test
