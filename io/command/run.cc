#include "io/command/run.h"

#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <optional>

#include "engine/base/error.h"
#include "io/deck/deck.h"
#include "io/files/directory_lock.h"
#include "io/files/hdf5.h"
#include "io/files/log.h"
#include "io/files/log_report.h"
#include "io/files/output_directory.h"
#include "io/files/progress.h"
#include "io/files/run_files.h"
#include "io/files/summary.h"
#include "io/files/text_file.h"
#include "parallel/mpi_exchange.h"

namespace carom {

namespace {

constexpr int kDone = 0, kStoppedEarly = 75;

/// Whether the wall time that the user granted is used up.
class Deadline {
 public:
  explicit Deadline(std::optional<double> seconds) : seconds_(seconds) {}
  /// Rank 0 decides for all.
  bool passed(Exchange& ranks) const {
    if (!seconds_) return false;
    double answer = ranks.rank() == 0 && elapsed() >= *seconds_ ? 1 : 0;
    ranks.largest({&answer, 1});
    return answer > 0;
  }

 private:
  double elapsed() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
  std::optional<double> seconds_;
};

/// Forces on fewer particles than these cost less than sending them.
constexpr std::size_t kFewestToShare = 64;

/// Does something that may fail while another failure is being reported: only the first one counts.
template <class Action>
void at_best(Action&& action) {
  try {
    action();
  } catch (const std::exception&) {
  }
}

/// Reads a file on rank 0, for all: the others may not see it.
TextReader reader_for(Exchange& ranks) {
  return [&ranks](const std::filesystem::path& file) -> std::optional<std::string> {
    auto text = ranks.rank() == 0 ? read_text(file) : std::nullopt;
    if (text) text->push_back('.');  // it can be read, and may be empty
    const auto bytes = std::as_bytes(std::span(text ? std::string_view(*text) : std::string_view()));
    const Bytes received = std::move(ranks.gather({bytes.begin(), bytes.end()})[0]);
    if (received.empty()) return {};
    return std::string(reinterpret_cast<const char*>(received.data()), received.size() - 1);
  };
}

template <int D>
Simulation<D> simulation_of(Deck& deck, Exchange& ranks) {
  const IntegratorInfo& info = find_integrator(deck.integrator);
  auto system = build_system<D>(deck, ranks.size() > 1 ? &ranks : nullptr);
  auto integrator = info.make<D>(deck.integrator_parameters);
  return Simulation<D>(std::move(system), info, std::move(integrator), deck.plan);
}

/// Runs a deck in D dimensions and writes its files. `at_work`: the ranks that share the work, of all that there are.
template <int D>
int run_deck(Deck& deck, const RunOptions& options, Exchange& at_work, int ranks, const Deadline& deadline) {
  auto simulation = simulation_of<D>(deck, at_work);
  const Statistics& statistics = simulation.statistics();
  const auto& directory = deck.output.directory;
  const DirectoryLock lock(directory);
  const auto backup = prepare_output_directory(directory);
  RunLog log(directory / run_file::log, options.quiet);
  RunOutcome outcome{.status = "done", .particles = simulation.system().size(), .ranks = ranks};
  log.say(banner_text(deck, outcome.particles, ranks));
  for (const std::string& warning : deck.warnings) log.warn(warning);
  if (at_work.size() < ranks)
    log.warn(
        fmt::format("warning: {} particles under forces are too few to be shared; one rank works, the other {} wait",
                    outcome.particles, ranks - 1));
  if (!lock.warning().empty()) log.warn(lock.warning());
  if (backup) log.warn("warning: the files of an earlier run in this directory are now in " + backup->string());
  write_file_atomically(directory / run_file::deck, deck.toml_text);

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
    simulation.run([&] { return deadline.passed(at_work); });
    progress.end_line();
    table.finish();
    const auto accounts = accounts_of_all(at_work, statistics);
    files->close();
    outcome.species_values = files->species_values();
    outcome.peak_memory_bytes = peak_memory_bytes(accounts);
    if (statistics.stopped_early) outcome.status = "stopped";
    log.say(report_text(deck, statistics, accounts));
    if (const auto regions = statistics.counters.domains.regions; regions > 0 && regions < static_cast<unsigned>(ranks))
      log.warn(fmt::format("warning: there is work for {} of {} ranks only; use so many", regions, ranks));
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
    at_best([&] { table.finish(); });
    at_best([&] { log.error(e.what()); });
    throw;
  }
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
    throw Error(Failure::file, "standard output: cannot write to it; the files of the run are complete in " +
                                   deck.output.directory.string());
  return statistics.stopped_early ? kStoppedEarly : kDone;
}

/// The same run on a rank other than 0, which shows nothing of it.
template <int D>
int run_beside(Deck& deck, Exchange& at_work, const Deadline& deadline) {
  auto simulation = simulation_of<D>(deck, at_work);
  std::vector<Onlooker<D>> onlookers;
  for (const auto& [info, parameters] : deck.output.observables)
    onlookers.emplace_back(Sampling{parameters.real("interval"), deck.output.sample_start});
  for (Onlooker<D>& onlooker : onlookers) simulation.add(onlooker);
  ShareTeller<D> teller(at_work, simulation.system());
  simulation.add(teller);
  simulation.run([&] { return deadline.passed(at_work); });
  accounts_of_all(at_work, simulation.statistics());
  return simulation.statistics().stopped_early ? kStoppedEarly : kDone;
}

template <int D>
int run_on_rank(Deck& deck, const RunOptions& options, Exchange& at_work, int ranks, const Deadline& deadline) {
  return at_work.rank() == 0 ? run_deck<D>(deck, options, at_work, ranks, deadline)
                             : run_beside<D>(deck, at_work, deadline);
}

}  // namespace

int run_command(const RunOptions& options) {
  const Deadline deadline(options.max_wall_seconds);
  // A file that grows beyond its limit and a reader of stdout that goes away are errors to report, not reasons to die.
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  hdf5::start_library();
  const Communicator ranks(options.silence);
  Exchange alone;
  std::optional<MpiExchange> team;
  if (ranks.size() > 1) team.emplace(ranks);
  Exchange& all = team ? *team : alone;

  Deck deck;
  const int failure = ranks.on_all([&] {
    deck = read_deck(options.deck, options.set, reader_for(all));
    if (options.output) set_output_directory(deck, *options.output);
    return 0;
  });
  if (failure != 0) return failure;
  const auto run = [&](Exchange& at_work) {
    return deck.dimension == 2 ? run_on_rank<2>(deck, options, at_work, ranks.size(), deadline)
                               : run_on_rank<3>(deck, options, at_work, ranks.size(), deadline);
  };
  const bool few = find_integrator(deck.integrator).smooth_forces && particle_count(deck) < kFewestToShare;
  if (few) return ranks.on_first([&] { return run(alone); });
  return ranks.on_all([&] { return run(all); });
}

}  // namespace carom
