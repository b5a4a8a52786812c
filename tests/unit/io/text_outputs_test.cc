// thermo.csv, summary.json, run.log, progress, the output directory.

#include <sys/resource.h>

#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "io/files/log.h"
#include "io/files/log_report.h"
#include "io/files/output_directory.h"
#include "io/files/progress.h"
#include "io/files/summary.h"
#include "io/files/text_file.h"
#include "io/files/thermo.h"
#include "sample_run.h"

namespace carom {
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
  ThermoWriter<3> writer(path);
  writer.thermo(test::sample_snapshot<3>(system->particles, 0.1, 7));
  std::istringstream in(contents(path));  // before the file is closed
  std::string header, row, cell;
  std::getline(in, header);
  std::getline(in, row);
  EXPECT_EQ(header,
            "time,step,collisions,kinetic,potential,total,shadow,max_energy_error,momentum_x,momentum_y,momentum_z,"
            "temperature,pressure");
  std::vector<double> values;
  for (std::istringstream cells(row); std::getline(cells, cell, ',');)
    values.push_back(std::strtod(cell.c_str(), nullptr));
  ASSERT_EQ(values.size(), 13U);
  EXPECT_EQ(values[0], 0.1);
  EXPECT_EQ(values[2], 21);
  EXPECT_EQ(values[5], 1.25);
  EXPECT_TRUE(std::isnan(values[6]));
  EXPECT_EQ(values[11], 1.0 / 3);
}

// A piece that does not fit is taken back, so that the file ends with a whole line, and the message names the file.
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

TEST(Log, AFullDiskIsAnError) { EXPECT_THROW(RunLog("/dev/full", true).note("lost"), Error); }

// A table for people: few rows, evenly in each doubling, and always the last.
TEST(Log, TheTableIsNoCopyOfThermo) {
  const auto path = fresh_directory() / "run.log";
  const auto system = test::sample_system<2>();
  RunLog log(path, true);
  ThermoTable<2> table(log);
  constexpr int kRows = 100001;
  for (int row = 0; row <= kRows; ++row) table.thermo(test::sample_snapshot<2>(system->particles, row, row));
  table.finish();
  table.finish();  // it is there
  std::ifstream in(path);
  std::vector<int> steps;
  std::string line;
  std::getline(in, line);
  EXPECT_NE(line.find("temperature"), std::string::npos);
  while (std::getline(in, line)) {
    std::istringstream words(line);
    std::string day, clock, time;
    int step = -1;
    words >> day >> clock >> time >> step;
    steps.push_back(step);
  }
  EXPECT_EQ(steps.back(), kRows);
  EXPECT_LT(steps.size(), 250u);
  for (std::size_t n = 1; n < steps.size(); ++n) {
    EXPECT_GT(steps[n], steps[n - 1]);
    EXPECT_LE(steps[n] - steps[n - 1], std::max(1, steps[n] / 16)) << steps[n];
  }
}

TEST(Log, WarnsOfAnEnergyThatIsWrongByItsOwnSize) {
  Statistics s;
  s.energy_initial = 1, s.energy_after_first_step = 1.5, s.energy_reference = 2, s.energy_scale = 1;
  s.max_energy_error = 1.9;
  EXPECT_FALSE(energy_warning(s));
  s.max_energy_error = 5;
  EXPECT_NE(energy_warning(s)->find("wrong by 2.5 times its own size:"), std::string::npos);
  s.energy_after_first_step = -3, s.max_energy_error = 0;
  EXPECT_NE(energy_warning(s)->find("wrong by 4 times its own size after the first step:"), std::string::npos);
}

TEST(Summary, HasEveryValueByItsName) {
  const RunOutcome outcome{.status = "failed",
                           .error = "disk \xff full",
                           .warnings = {"a warning"},
                           .particles = 3,
                           .ranks = 2,
                           .species_values = {{"contact_value", {"small", "large"}, "g", 1.5}}};
  Statistics s;
  s.steps = 10, s.end_time = 11.5, s.force_passes = 12.5, s.energy_initial = 13.5;
  s.energy_after_first_step = 14.5, s.energy_final = 15.5, s.energy_reference = 16;
  s.max_energy_error = 17.5, s.tail_energy = 18.5, s.tail_pressure = 19.5;
  s.max_shadow_energy_error = 20.5, s.max_momentum_error = 21.5, s.mean_pressure = 22.5, s.collision_rate = 23.5;
  s.mean_free_time = 24.5, s.mean_free_path = 25.5, s.wall_seconds = 0.5;
  Counters& c = s.counters;
  c.sphere_sphere = 30, c.sphere_wall = 31, c.max_overlap = 32.5, c.sweeps = 33, c.pieces = 34, c.slabs_halved = 35;
  c.frozen = 36, c.fallbacks = 37, c.folded = 4;
  auto json = nlohmann::json::parse(summary_text(test::sample_deck(2), outcome, s));
  EXPECT_GT(json["peak_memory_bytes"], 1000000);
  EXPECT_NE(json["version"], "");
  json.erase("peak_memory_bytes"), json.erase("version");
  EXPECT_EQ(json, nlohmann::json::parse(R"({"status": "failed", "error": "disk \ufffd full", "warnings": ["a warning"],
    "deck": "sample.toml", "title": "three spheres", "integrator": "free-flight", "dimension": 2, "particles": 3,
    "ranks": 2, "steps": 10, "end_time": 11.5, "events": {"sphere_sphere": 30, "sphere_wall": 31},
    "energy": {"initial": 13.5, "after_first_step": 14.5, "final": 15.5, "reference": 16.0, "max_abs_error": 17.5,
               "folded": 0.25},
    "tail": {"energy": 18.5, "pressure": 19.5}, "shadow_energy": {"max_abs_error": 20.5},
    "momentum": {"max_abs_error": 21.5}, "max_overlap": 32.5, "pressure": 22.5, "collision_rate": 23.5,
    "mean_free_time": 24.5, "mean_free_path": 25.5, "force_passes": 12.5, "sweeps": 33, "pieces": 34,
    "slabs_halved": 35, "frozen": 36, "fallbacks": 37, "wall_seconds": 0.5, "collisions_per_second": 60.0,
    "contact_value": [{"species": ["small", "large"], "g": 1.5}]})"));
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

TEST(OutputDirectory, BelowAFileIsAnError) {
  const auto file = fresh_directory() / "file";
  std::ofstream(file) << "x";
  EXPECT_THROW(make_output_directory(file / "run"), Error);
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

TEST(Progress, ClockText) {
  EXPECT_EQ(clock_text(0.2), "00:00:01");
  EXPECT_EQ(clock_text(3725), "01:02:05");
  EXPECT_EQ(clock_text(360000), "100:00:00");
}

}  // namespace
}  // namespace carom
