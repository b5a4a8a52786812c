// SPDX-License-Identifier: BSD-3-Clause
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
#include "io/command/resume.h"
#include "io/deck/deck.h"
#include "io/files/hdf5.h"
#include "io/files/output_directory.h"
#include "io/files/progress.h"
#include "io/files/run_record.h"
#include "io/files/text_file.h"
#include "io/view/view.h"
#include "parallel/world.h"

namespace carom {

namespace {

constexpr int kDone = 0, kStoppedEarly = 75;

/// Computing the forces on fewer particles than this costs less than sending them.
constexpr std::size_t kFewestToShare = 64;

/// Calls between two checks for requests within a step (one call per piece, sweep or contact) in large systems.
constexpr std::uint64_t kCallsWithinSteps = 32;

/// The run of a deck, from its initial state or from a checkpoint. Throws Error. Collective.
template <int D>
Simulation<D> simulation_of(Deck& deck, Communicator& ranks, const Requests& requests, Resumed* from) {
  std::optional<GivenState> given;
  if (from) given = state_of<D>(*from, deck);
  auto system = build_system<D>(deck, ranks.size() > 1 ? &ranks : nullptr, given ? &*given : nullptr, [&] {
    if (requests.stops_this_rank())
      throw Error(Failure::interrupted, deck.file.string() + ": stopped by " + requests.reason() +
                                            " while the particles were placed; no file was written: start it again");
  });
  const IntegratorInfo& info = find_integrator(deck.integrator);
  return Simulation<D>(std::move(system), info, info.make<D>(deck.integrator_parameters), deck.plan);
}

/// What all ranks do during a run: stop or write checkpoints on request.
template <int D>
class RunControl {
 public:
  /// `head`: the head of the next checkpoint, on rank 0.
  RunControl(Simulation<D>& simulation, const Deck& deck, Communicator& ranks, Requests& requests,
             std::function<CheckpointHead()> head)
      : simulation_(simulation), deck_(deck), ranks_(ranks), requests_(requests), head_(std::move(head)) {
    requests_.set_interval(deck.output.checkpoint_wall);
  }
  typename Simulation<D>::Hooks hooks(const Resumed* from) {
    typename Simulation<D>::Hooks hooks;
    hooks.should_stop = [this] { return should_stop(); };
    hooks.left = [this] { asked_ = requests_.now(ranks_); };
    hooks.leave = [this] {
      const Requests::Asked now = requests_.now_and_then(ranks_, kCallsWithinSteps);
      if (now.checkpoint) asked_ = now;  // without a stop the checkpoint is written at the step's end
      return now.stop;
    };
    hooks.leave_here = [this] { return requests_.stop_here(ranks_); };
    if (from) set_hooks(*from, deck_, simulation_, hooks);
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

/// Runs a deck in D dimensions and writes its files. `at_work`: the ranks that share the work.
template <int D>
int run_deck(Deck& deck, const RunOptions& options, Communicator& at_work, int ranks, Requests& requests,
             Resumed* from) {
  const auto& directory = deck.output.directory;
  auto simulation = simulation_of<D>(deck, at_work, requests, from);
  const Statistics& statistics = simulation.statistics();
  RecordOptions of_record{.at_work = &at_work, .ranks = ranks, .quiet = options.quiet};
  if (from) of_record.from = &from->head, of_record.warning = from->warning;
  if (from && from->is_continued()) {
    of_record.continued = true;
    of_record.lock = std::move(from->lock);
    // The next checkpoint replaces the damaged one, not the good one.
    if (const auto last = directory / run_file::checkpoint; from->checkpoint->file() != last)
      rename_file(from->checkpoint->file(), last);
  }
  RunRecord<D> record(deck, simulation, std::move(of_record));
  Progress<D> progress(stdout, isatty(STDOUT_FILENO) == 1);
  try {
    if (!options.quiet) simulation.add(progress);
    RunControl<D> control(simulation, deck, at_work, requests, [&] { return record.head(); });
    simulation.run(control.hooks(from));
    progress.end_line();
    record.close(statistics.stopped_early ? fmt::format("stopped by {}; carom run --continue {} goes on",
                                                        requests.reason(), directory.string())
                                          : "");
  } catch (const std::exception& e) {
    progress.end_line();
    record.fail(e.what());
    throw;
  }
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
    throw Error(Failure::file,
                "standard output: cannot write to it; the files of the run are complete in " + directory.string());
  return statistics.stopped_early ? kStoppedEarly : kDone;
}

/// Runs the deck on a rank other than 0, without any output.
template <int D>
int run_beside(Deck& deck, Communicator& at_work, Requests& requests, Resumed* from) {
  auto simulation = simulation_of<D>(deck, at_work, requests, from);
  std::vector<std::unique_ptr<Observer<D>>> others;
  for (const auto& [info, parameters] : deck.output.observables) {
    others.push_back(info->template in<D>().make(simulation.system(), parameters, deck.output.sample_start));
    if (!others.back()->divided()) others.back() = std::make_unique<SamplingTimes<D>>(others.back()->sampling());
    simulation.add(*others.back());
  }
  BlockSender<D> sender(at_work, simulation.system(), from == nullptr || from->is_branch());
  simulation.add(sender);
  RunControl<D> control(simulation, deck, at_work, requests, {});
  simulation.run(control.hooks(from));
  accounts_of_all(at_work, simulation.statistics());
  return simulation.statistics().stopped_early ? kStoppedEarly : kDone;
}

template <int D>
int run_on_rank(Deck& deck, const RunOptions& options, Communicator& at_work, int ranks, Requests& requests,
                Resumed* from) {
  if (from && from->is_branch()) go_to_end<D>(*from, at_work);
  return at_work.rank() == 0 ? run_deck<D>(deck, options, at_work, ranks, requests, from)
                             : run_beside<D>(deck, at_work, requests, from);
}

}  // namespace

int run_command(const RunOptions& options) {
  Requests requests(options.max_wall_seconds);
  // A file that exceeds its size limit and a closed pipe on stdout are reported as errors instead of killing the
  // process.
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  hdf5::start_library();
  const World ranks(options.silence);
  Communicator alone;
  Communicator& all = ranks.communicator();

  Deck deck;
  std::optional<Resumed> from;
  std::optional<RunView> view;
  const int failure = ranks.on_all([&] {
    if (options.go_on || options.branch) {
      from.emplace(options.go_on ? find_run(*options.go_on, options.take_over, all)
                                 : find_state(*options.branch, *options.output, all));
      deck = deck_of(*from, options, all);
    } else {
      deck = read_deck(options.deck, options.set, reader_for(all));
      if (options.output) set_output_directory(deck, *options.output);
    }
    if (options.view && ranks.rank() == 0) view.emplace(deck.output.directory, options.port, options.browser);
    return 0;
  });
  if (failure != 0) return failure;
  const auto run = [&](Communicator& at_work) {
    Resumed* const resumed = from ? &*from : nullptr;
    return deck.dimension == 2 ? run_on_rank<2>(deck, options, at_work, ranks.size(), requests, resumed)
                               : run_on_rank<3>(deck, options, at_work, ranks.size(), requests, resumed);
  };
  const bool few = find_integrator(deck.integrator).smooth_forces && particle_count(deck) < kFewestToShare;
  const int code = few ? ranks.on_first([&] { return run(alone); }) : ranks.on_all([&] { return run(all); });
  if (view && code == kDone) view->stay();
  return code;
}

}  // namespace carom
