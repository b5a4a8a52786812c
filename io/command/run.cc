#include "io/command/run.h"

#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "engine/base/error.h"
#include "io/command/requests.h"
#include "io/deck/deck.h"
#include "io/files/checkpoint.h"
#include "io/files/directory_lock.h"
#include "io/files/hdf5.h"
#include "io/files/log.h"
#include "io/files/log_report.h"
#include "io/files/output_directory.h"
#include "io/files/progress.h"
#include "io/files/run_files.h"
#include "io/files/summary.h"
#include "io/files/text_file.h"
#include "io/files/version.h"
#include "parallel/mpi_communicator.h"

namespace carom {

namespace {

constexpr int kDone = 0, kStoppedEarly = 75;

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
TextReader reader_for(Communicator& ranks) {
  return [&ranks](const std::filesystem::path& file) -> std::optional<std::string> {
    auto text = ranks.rank() == 0 ? read_text(file) : std::nullopt;
    if (text) text->push_back('.');  // it can be read, and may be empty
    const auto bytes = std::as_bytes(std::span(text ? std::string_view(*text) : std::string_view()));
    const Bytes received = std::move(ranks.gather({bytes.begin(), bytes.end()})[0]);
    if (received.empty()) return {};
    return std::string(reinterpret_cast<const char*>(received.data()), received.size() - 1);
  };
}

/// A run to be continued: its checkpoint on rank 0, and what all ranks know of it.
struct Continued {
  std::filesystem::path directory;
  mutable std::unique_ptr<DirectoryLock>
      lock;  // goes to the run; taken before the checkpoint is read: a process that is ending may write another
  std::optional<Checkpoint> checkpoint;
  CheckpointHead head;
  std::string warning;

  StateReader reader() const {
    return [this](const std::string& name) { return checkpoint->read(name); };
  }
};

/// Reads the last checkpoint on rank 0, for all.
Continued find_checkpoint(const std::filesystem::path& directory, bool take_over, Communicator& ranks) {
  Continued found{.directory = directory, .lock = {}, .checkpoint = {}, .head = {}, .warning = {}};
  Archive out;
  if (ranks.rank() == 0) {
    if (std::filesystem::is_directory(directory)) found.lock = std::make_unique<DirectoryLock>(directory, take_over);
    found.checkpoint.emplace(last_checkpoint(directory, found.warning));
    // The next checkpoint takes the place of one that is damaged, not of the one that is good.
    if (const auto last = directory / run_file::checkpoint; found.checkpoint->file() != last)
      std::filesystem::rename(found.checkpoint->file(), last);
    found.head = found.checkpoint->head();
    found.head.archive(out);
    out(found.head.deck);
  }
  Archive in(std::move(ranks.gather(out.bytes())[0]));
  found.head.archive(in);
  in(found.head.deck);
  return found;
}

/// The deck of a run that is continued, where only the end may be another.
Deck deck_of(const Continued& run, const RunOptions& options, Communicator& ranks) {
  for (const std::string& set : options.set)
    if (!set.starts_with("run."))
      throw Error(Failure::deck, "--set " + set +
                                     ": a run that is continued keeps its deck; only its end may be set "
                                     "anew (run.steps, run.end_time, run.collisions); start a new run for the rest");
  const auto file = run.directory / run_file::deck;
  const TextReader others = reader_for(ranks);
  Deck deck = read_deck(file, options.set, [&](const std::filesystem::path& path) {
    // Positions are in the checkpoint: their file may be gone.
    return path == file ? run.head.deck : others(path).value_or("");
  });
  set_output_directory(deck, run.directory);
  deck.warnings = run.head.warnings;
  deck.file = run.head.deck_file;
  return deck;
}

template <int D>
Simulation<D> simulation_of(Deck& deck, Communicator& ranks, const Continued* continued) {
  const IntegratorInfo& info = find_integrator(deck.integrator);
  std::optional<GivenState> given;
  if (continued) given = {continued->reader(), continued->head.bonds};
  auto system = build_system<D>(deck, ranks.size() > 1 ? &ranks : nullptr, given ? &*given : nullptr);
  auto integrator = info.make<D>(deck.integrator_parameters);
  return Simulation<D>(std::move(system), info, std::move(integrator), deck.plan);
}

/// What the ranks do alike while a run goes on: stop or write checkpoints when they are asked to.
template <int D>
class Keeper {
 public:
  /// `head`: that of the next checkpoint, on rank 0.
  Keeper(Simulation<D>& simulation, const Deck& deck, Communicator& ranks, Requests& requests,
         std::function<CheckpointHead()> head)
      : simulation_(simulation), deck_(deck), ranks_(ranks), requests_(requests), head_(std::move(head)) {
    requests_.set_interval(deck.output.checkpoint_wall);
  }
  typename Simulation<D>::Hooks hooks(const Continued* continued) {
    typename Simulation<D>::Hooks hooks;
    hooks.should_stop = [this] { return should_stop(); };
    hooks.pause = [this] {
      asked_ = requests_.now(ranks_);
      return asked_.checkpoint;
    };
    if (continued) hooks.restore = [this, continued] { restore_state(simulation_.system(), continued->reader()); };
    return hooks;
  }

 private:
  bool should_stop() {
    if (!asked_.checkpoint) asked_ = requests_.now_and_then(ranks_);
    const auto [checkpoint, stop] = std::exchange(asked_, {});
    if (checkpoint || simulation_.is_last_on_the_way()) {
      write_checkpoint(deck_.output.directory, ranks_.rank() == 0 ? head_() : CheckpointHead{}, simulation_.system());
      requests_.checkpoint_is_written();
    }
    return stop;
  }

  Simulation<D>& simulation_;
  const Deck& deck_;
  Communicator& ranks_;
  Requests& requests_;
  std::function<CheckpointHead()> head_;
  Requests::Asked asked_;
};

/// Runs a deck in D dimensions and writes its files. `at_work`: the ranks that share the work, of all that there are.
template <int D>
int run_deck(Deck& deck, const RunOptions& options, Communicator& at_work, int ranks, Requests& requests,
             const Continued* continued) {
  const auto& directory = deck.output.directory;
  auto simulation = simulation_of<D>(deck, at_work, continued);
  const Statistics& statistics = simulation.statistics();
  const auto lock = continued ? std::move(continued->lock) : std::make_unique<DirectoryLock>(directory);
  const auto backup = continued ? std::nullopt : prepare_output_directory(directory);
  std::optional<RunLog> log_file;
  if (continued)
    log_file.emplace(directory / run_file::log, options.quiet, continued->head.log_bytes);
  else
    log_file.emplace(directory / run_file::log, options.quiet);
  RunLog& log = *log_file;
  RunOutcome outcome{
      .status = "done", .warnings = deck.warnings, .particles = simulation.system().size(), .ranks = ranks};
  if (continued) {
    log.say(fmt::format("continued at step {} on {} {}", continued->head.step, ranks, ranks == 1 ? "rank" : "ranks"));
    if (!continued->warning.empty()) log.warn("warning: " + continued->warning);
  } else {
    log.say(banner_text(deck, outcome.particles, ranks));
    for (const std::string& warning : deck.warnings) log.warn(warning);
  }
  if (at_work.size() < ranks)
    log.warn(
        fmt::format("warning: {} particles under forces are too few to be shared; one rank works, the other {} wait",
                    outcome.particles, ranks - 1));
  if (!lock->warning().empty()) log.warn(lock->warning());
  if (backup) log.warn("warning: the files of an earlier run in this directory are now in " + backup->string());
  write_file_atomically(directory / run_file::deck, deck.toml_text);

  const auto summary = [&] {
    write_file_atomically(directory / run_file::summary, summary_text(deck, outcome, statistics));
  };
  std::optional<RunFiles<D>> files;
  ThermoTable<D> table(log, continued ? continued->head.log_rows : 0);
  Progress<D> progress(stdout, isatty(STDOUT_FILENO) == 1);
  try {
    if (continued)
      files.emplace(deck, simulation.system(), continued->head.files);
    else
      files.emplace(deck, simulation.system());
    files->add_to(simulation);
    simulation.add(table);
    if (!options.quiet) simulation.add(progress);
    const auto bonds = continued ? continued->head.bonds : found_bonds(deck, simulation.system());
    Keeper<D> keeper(simulation, deck, at_work, requests, [&] {
      return CheckpointHead{.deck = deck.toml_text,
                            .deck_file = deck.file.string(),
                            .version = version_string(),
                            .integrator = deck.integrator,
                            .dimension = D,
                            .particles = outcome.particles,
                            .step = statistics.steps,
                            .time = statistics.end_time,
                            .files = files->mark(),
                            .log_bytes = log.size(),
                            .log_rows = table.rows(),
                            .bonds = bonds,
                            .warnings = deck.warnings};
    });
    simulation.run(keeper.hooks(continued));
    progress.end_line();
    table.finish();
    const auto accounts = accounts_of_all(at_work, statistics);
    files->close();
    outcome.species_values = files->species_values();
    outcome.peak_memory_bytes = peak_memory_bytes(accounts);
    if (statistics.stopped_early) outcome.status = "interrupted";
    log.say(report_text(deck, statistics, accounts));
    if (const auto warning = energy_warning(statistics)) {
      outcome.warnings.push_back(*warning);
      log.warn(*warning);
    }
    if (const auto subdomains = statistics.counters.windows.subdomains;
        subdomains > 0 && subdomains < static_cast<unsigned>(ranks))
      log.warn(fmt::format("warning: there is work for {} of {} ranks only; use so many", subdomains, ranks));
    if (statistics.stopped_early)
      log.warn(fmt::format("stopped by {}; carom run --continue {} goes on", requests.reason(), directory.string()));
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
int run_beside(Deck& deck, Communicator& at_work, Requests& requests, const Continued* continued) {
  auto simulation = simulation_of<D>(deck, at_work, continued);
  std::vector<Onlooker<D>> onlookers;
  for (const auto& [info, parameters] : deck.output.observables)
    onlookers.emplace_back(Sampling{parameters.real("interval"), deck.output.sample_start});
  for (Onlooker<D>& onlooker : onlookers) simulation.add(onlooker);
  BlockSender<D> sender(at_work, simulation.system(), continued == nullptr);
  simulation.add(sender);
  Keeper<D> keeper(simulation, deck, at_work, requests, {});
  simulation.run(keeper.hooks(continued));
  accounts_of_all(at_work, simulation.statistics());
  return simulation.statistics().stopped_early ? kStoppedEarly : kDone;
}

template <int D>
int run_on_rank(Deck& deck, const RunOptions& options, Communicator& at_work, int ranks, Requests& requests,
                const Continued* continued) {
  return at_work.rank() == 0 ? run_deck<D>(deck, options, at_work, ranks, requests, continued)
                             : run_beside<D>(deck, at_work, requests, continued);
}

}  // namespace

int run_command(const RunOptions& options) {
  Requests requests(options.max_wall_seconds);
  // A file that grows beyond its limit and a reader of stdout that goes away are errors to report, not reasons to die.
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  hdf5::start_library();
  const World ranks(options.silence);
  Communicator alone;
  std::optional<MpiCommunicator> team;
  if (ranks.size() > 1) team.emplace(ranks);
  Communicator& all = team ? *team : alone;

  Deck deck;
  std::optional<Continued> continued;
  const int failure = ranks.on_all([&] {
    if (options.go_on) {
      continued.emplace(find_checkpoint(*options.go_on, options.take_over, all));
      deck = deck_of(*continued, options, all);
    } else {
      deck = read_deck(options.deck, options.set, reader_for(all));
      if (options.output) set_output_directory(deck, *options.output);
    }
    return 0;
  });
  if (failure != 0) return failure;
  const auto run = [&](Communicator& at_work) {
    const Continued* from = continued ? &*continued : nullptr;
    return deck.dimension == 2 ? run_on_rank<2>(deck, options, at_work, ranks.size(), requests, from)
                               : run_on_rank<3>(deck, options, at_work, ranks.size(), requests, from);
  };
  const bool few = find_integrator(deck.integrator).smooth_forces && particle_count(deck) < kFewestToShare;
  if (few) return ranks.on_first([&] { return run(alone); });
  return ranks.on_all([&] { return run(all); });
}

}  // namespace carom
