#include "io/run.h"

#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <optional>

#include "engine/error.h"
#include "io/deck.h"
#include "io/hdf5.h"
#include "io/log.h"
#include "io/log_report.h"
#include "io/output_directory.h"
#include "io/progress.h"
#include "io/run_files.h"
#include "io/summary.h"
#include "io/text_file.h"
#include "parallel/communicator.h"

namespace carom {

namespace {

constexpr int kDone = 0, kStoppedEarly = 75;

/// Whether the wall time that the user granted is used up.
class Deadline {
 public:
  explicit Deadline(std::optional<double> seconds) : seconds_(seconds) {}
  bool passed() const { return seconds_ && std::chrono::duration<double>(Clock::now() - start_).count() >= *seconds_; }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
  std::optional<double> seconds_;
};

const IntegratorInfo& integrator_named(const std::string& name) {
  for (const IntegratorInfo& info : integrators())
    if (info.name == name) return info;
  throw Error(Failure::deck, "there is no integrator '" + name + "'; `carom methods` lists those there are");
}

/// Does something that may fail while another failure is being reported: only the first one counts.
template <class Action>
void at_best(Action&& action) {
  try {
    action();
  } catch (const std::exception&) {
  }
}

/// Runs a deck in D dimensions on this rank.
template <int D>
int run_deck(Deck& deck, const RunOptions& options, int ranks, const Deadline& deadline) {
  const IntegratorInfo& info = integrator_named(deck.integrator);
  auto system = build_system<D>(deck);
  const auto& directory = deck.output.directory;
  const auto backup = prepare_output_directory(directory);
  RunLog log(directory / run_file::log, options.quiet);
  RunOutcome outcome{
      .status = "done", .error = "", .particles = system->particles.size(), .ranks = ranks, .contact_values = {}};
  log.say(banner_text(deck, outcome.particles, ranks));
  for (const std::string& warning : deck.warnings) log.warn(warning);
  if (ranks > 1) log.warn(fmt::format("warning: this version uses one rank; the other {} wait", ranks - 1));
  if (backup) log.warn("warning: the files of an earlier run in this directory are now in " + backup->string());
  write_file_atomically(directory / run_file::deck, deck.toml_text);

  Simulation<D> simulation(std::move(system), info, info.make<D>(deck.integrator_parameters), deck.plan);
  const Statistics& statistics = simulation.statistics();
  const auto summary = [&] {
    write_file_atomically(directory / run_file::summary, summary_text(deck, outcome, statistics));
  };
  std::optional<RunFiles<D>> files;
  ThermoTable<D> table(log);
  Progress<D> progress(stdout, isatty(STDOUT_FILENO) == 1);
  try {
    files.emplace(deck, simulation.system());
    files->add_to(simulation);
    simulation.add(table);
    if (!options.quiet) simulation.add(progress);
    simulation.run([&] { return deadline.passed(); });
    progress.end_line();
    files->close();
    outcome.contact_values = files->contact_values();
    if (statistics.stopped_early) outcome.status = "stopped";
    log.say(report_text(deck, statistics));
    if (statistics.stopped_early)
      log.warn("warning: stopped by --max-wall; this version writes no checkpoint, so the run cannot be continued");
    log.close();
    summary();
  } catch (const std::exception& e) {
    // Files first: closing them gives back the room they had reserved on a disk that may be full.
    progress.end_line();
    outcome.status = "failed";
    outcome.error = e.what();
    if (files) files->close_after_failure();
    at_best(summary);
    at_best([&] { log.error(e.what()); });
    throw;
  }
  return statistics.stopped_early ? kStoppedEarly : kDone;
}

}  // namespace

int run_command(const RunOptions& options) {
  const Deadline deadline(options.max_wall_seconds);
  // A file that grows beyond its limit and a reader of stdout that goes away are errors to report, not reasons to die.
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  hdf5::start_library();
  const Communicator ranks;
  return ranks.on_first([&] {
    Deck deck = read_deck(options.deck, options.set);
    if (options.output) set_output_directory(deck, *options.output);
    const int code = deck.dimension == 2 ? run_deck<2>(deck, options, ranks.size(), deadline)
                                         : run_deck<3>(deck, options, ranks.size(), deadline);
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
      throw Error(Failure::file, "standard output: cannot write to it; the files of the run are complete in " +
                                     deck.output.directory.string());
    return code;
  });
}

}  // namespace carom
