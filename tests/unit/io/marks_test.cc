// SPDX-License-Identifier: BSD-3-Clause
// A run's files that are cut back to a mark and continued are equal to those of an uninterrupted run.

#include <fstream>
#include <map>

#include "engine/base/error.h"
#include "io/files/hdf5.h"
#include "io/files/log.h"
#include "io/files/log_report.h"
#include "io/files/output_directory.h"
#include "io/files/run_files.h"
#include "sample_run.h"
#include "tests/support/experiments.h"

namespace carom::marks_test {
namespace {

namespace fs = std::filesystem;

std::string contents(const fs::path& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Every data set by its name, with its shape and bytes.
std::map<std::string, std::string> data_sets(const fs::path& path) {
  const hdf5::File file = hdf5::File::open(path);
  struct Found {
    const hdf5::File& file;
    std::map<std::string, std::string> sets{};
  } found{file};
  H5Ovisit(
      file.id(), H5_INDEX_NAME, H5_ITER_INC,
      [](hid_t root, const char* name, const H5O_info_t* info, void* data) -> herr_t {
        if (info->type != H5O_TYPE_DATASET) return 0;
        auto& [in, sets] = *static_cast<Found*>(data);
        const hdf5::Handle set(H5Dopen2(root, name, H5P_DEFAULT), H5Dclose);
        const hdf5::Handle type(H5Dget_type(set.id()), H5Tclose);
        std::string text = std::to_string(H5Tget_size(type.id()));
        std::size_t size = H5Tget_size(type.id());
        for (const hsize_t n : hdf5::shape(in, name)) {
          text += " x " + std::to_string(n);
          size *= n;
        }
        std::string bytes(size, '\0');
        if (size > 0) {
          EXPECT_GE(H5Dread(set.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()), 0) << name;
        }
        sets[name] = text + ": " + bytes;
        return 0;
      },
      &found);
  return found.sets;
}

template <int D>
Deck deck_of_all(const fs::path& directory, const System<D>& system) {
  Deck deck = test::sample_deck(D);
  deck.output.directory = directory;
  deck.plan.events = true;
  for (const ObservableInfo& info : observables()) {
    Parameters parameters = completed(info.name, info.parameters, {{"interval", 0.1}});
    EXPECT_FALSE(info.template in<D>().complete(parameters, system));
    deck.output.observables.push_back({&info, parameters});
  }
  fs::create_directories(directory);
  return deck;
}

/// Writes a run of hard spheres to the files.
template <int D>
void show(RunFiles<D>& files, ThermoTable<D>& table, unsigned seed, double end_time) {
  Simulation<D> run(
      test::hard_spheres<D>(3, 0.6, seed), "psa", {},
      {.step = 0.05, .end_time = end_time, .frame_interval = 0.1, .thermo_interval = 0.05, .events = true});
  files.add_to(run);
  run.add(table);
  run.run();
}

template <class Dimension>
class Marks : public testing::Test {};
using Dimensions = testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(Marks, Dimensions);

TYPED_TEST(Marks, FilesCutBackAreThoseOfARunThatWentOn) {
  constexpr int D = TypeParam::value;
  const auto system = test::hard_spheres<D>(3, 0.6);
  const fs::path directory = test::fresh_directory();
  const Deck whole = deck_of_all<D>(directory / "whole", *system), cut = deck_of_all<D>(directory / "cut", *system);
  {
    RunFiles<D> files(whole, *system);
    RunLog log(whole.output.directory / run_file::log, true);
    ThermoTable<D> table(log);
    show(files, table, 1, 2.5);
    show(files, table, 2, 1.7);
    files.close();
    table.finish();
  }
  Archive marks;
  {
    RunFiles<D> files(cut, *system);
    RunLog log(cut.output.directory / run_file::log, true);
    ThermoTable<D> table(log);
    show(files, table, 1, 2.5);
    FileMarks at = files.mark();
    FileMark end = log.mark();
    std::uint64_t rows = table.rows();
    marks(at, end, rows);
    show(files, table, 3, 3);  // data after the checkpoint; more than a chunk
  }
  EXPECT_NE(data_sets(whole.output.directory / run_file::events), data_sets(cut.output.directory / run_file::events));
  {
    FileMarks at;
    FileMark end;
    std::uint64_t rows = 0;
    Archive from(marks.bytes());
    from(at, end, rows);
    check_files(cut, at, end);
    from.finish();
    RunFiles<D> files(cut, *system, at);
    RunLog log(cut.output.directory / run_file::log, true, end);
    ThermoTable<D> table(log, rows);
    show(files, table, 2, 1.7);
    files.close();
    table.finish();
  }
  for (const char* name : {run_file::trajectory, run_file::events}) {
    const auto a = data_sets(whole.output.directory / name), b = data_sets(cut.output.directory / name);
    EXPECT_GT(a.size(), 10u);
    for (const auto& [set, value] : a) EXPECT_TRUE(b.contains(set) && b.at(set) == value) << set;
    EXPECT_EQ(a.size(), b.size());
  }
  const std::string rows = contents(whole.output.directory / run_file::thermo);
  EXPECT_GT(rows.size(), 100u);
  EXPECT_EQ(rows, contents(cut.output.directory / run_file::thermo));
  // The lines of the log begin with the time of day.
  const auto rows_of = [](const fs::path& of) {
    std::ifstream in(of / run_file::log);
    std::vector<std::string> lines;
    for (std::string line; std::getline(in, line);) lines.push_back(line.substr(line.find("  ")));
    return lines;
  };
  EXPECT_GT(rows_of(whole.output.directory).size(), 50u);
  EXPECT_EQ(rows_of(whole.output.directory), rows_of(cut.output.directory));
}

// A file that is missing, shorter than at the checkpoint, changed, or another run's is named in an error, and nothing
// changes.
TEST(MarksOfFiles, FilesThatAreNotThoseOfTheRunAreErrors) {
  const fs::path directory = test::fresh_directory();
  const auto system = test::hard_spheres<2>(3, 0.6);
  const auto write = [&](const Deck& deck, unsigned seed, FileMarks& at, FileMark& end) {
    RunFiles<2> files(deck, *system);
    RunLog log(deck.output.directory / run_file::log, true);
    ThermoTable<2> table(log);
    show(files, table, seed, 1.5);
    at = files.mark();
    end = log.mark();
    show(files, table, seed, 0.5);
    files.close();
  };
  const Deck own = deck_of_all<2>(directory / "own", *system), other = deck_of_all<2>(directory / "other", *system);
  FileMarks at, ignored;
  FileMark end;
  write(other, 2, ignored, end);
  write(own, 1, at, end);
  check_files(own, at, end);
  const auto refusal = [&](const fs::path& path) -> std::string {
    const std::string before = fs::exists(path) ? contents(path) : "";
    try {
      check_files(own, at, end);
    } catch (const Error& e) {
      EXPECT_EQ(e.exit_code(), 5);
      const std::string text = e.what();
      EXPECT_TRUE(text.starts_with(path.string() + ": ")) << text;
      EXPECT_NE(text.find("; put back the file that the run has written, or start a new run"), std::string::npos);
      EXPECT_EQ(fs::exists(path) ? contents(path) : "", before);
      EXPECT_FALSE(fs::exists(path.string() + ".journal"));
      return text;
    }
    ADD_FAILURE() << path;
    return {};
  };
  for (const char* name : {run_file::log, run_file::thermo, run_file::trajectory, run_file::events}) {
    const fs::path path = own.output.directory / name;
    const std::string good = contents(path);
    const auto exchanged = [&](const std::string& bytes) {
      std::ofstream(path, std::ios::binary) << bytes;
      return refusal(path);
    };
    const auto has = [](const std::string& text, const std::string& words) {
      EXPECT_NE(text.find(words), text.npos) << text;
    };
    has(exchanged(contents(other.output.directory / name)), "is the file of another run, or was changed");
    exchanged("garbage");
    exchanged("");
    fs::remove(path);
    refusal(path);
    exchanged(good.substr(0, 200));
    std::ofstream(path, std::ios::binary) << good;
    check_files(own, at, end);
  }
  for (const char* name : {run_file::log, run_file::thermo}) {
    const fs::path path = own.output.directory / name;
    std::string changed = contents(path);
    changed[changed.size() / 3] ^= 1;
    std::ofstream(path, std::ios::binary) << changed;
    EXPECT_NE(refusal(path).find("or was changed"), std::string::npos);
    changed[changed.size() / 3] ^= 1;
    std::ofstream(path, std::ios::binary) << changed;
  }
  // Data that the files of this run lack.
  FileMarks later = at;
  later.frames.length += 100;
  std::swap(at, later);
  EXPECT_NE(refusal(own.output.directory / run_file::trajectory).find(" rows, and had "), std::string::npos);
  std::swap(at, later);
  check_files(own, at, end);
  const auto larger = test::hard_spheres<2>(4, 0.3);
  EXPECT_THROW(TrajectoryWriter<2>(own.output.directory / run_file::trajectory, own, *larger, at.frames), Error);
}

}  // namespace
}  // namespace carom::marks_test
