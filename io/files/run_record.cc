// SPDX-License-Identifier: BSD-3-Clause
#include "io/files/run_record.h"

#include <spdlog/fmt/fmt.h>

#include "io/files/output_directory.h"
#include "io/files/text_file.h"
#include "io/files/version.h"

namespace carom {

namespace {

constexpr std::size_t kFewPerRank = 500;  // below this, most events are run twice (parallel/README.md)

}  // namespace

template <int D>
RunRecord<D>::RunRecord(const Deck& deck, Simulation<D>& simulation, RecordOptions options)
    : deck_(deck), simulation_(simulation), options_(std::move(options)) {
  const auto& directory = deck_.output.directory;
  const CheckpointHead* const from = options_.from;
  const CheckpointHead* const continued = options_.continued ? from : nullptr;
  if (!options_.lock) options_.lock = std::make_unique<DirectoryLock>(directory);
  outcome_ = {
      .status = "done", .warnings = deck_.warnings, .particles = simulation.system().size(), .ranks = options_.ranks};
  std::optional<std::filesystem::path> backup;
  if (continued)
    check_files(deck_, continued->files, continued->log);
  else
    backup = prepare_output_directory(directory, deck_.output.overwrite);
  if (from) outcome_.branched_from = from->branched_from;
  bonds_ = from ? from->bonds : found_bonds(deck_, simulation.system());
  log_ = std::make_unique<RunLog>(directory / run_file::log, options_.quiet,
                                  continued ? std::optional(continued->log) : std::nullopt, options_.silent);
  const int ranks = options_.ranks;
  if (continued) {
    log_->say(fmt::format("continued at step {} on {} {}", continued->step, ranks, ranks == 1 ? "rank" : "ranks"));
  } else {
    log_->say(banner_text(deck_, outcome_.particles, ranks));
    if (from)
      log_->say(fmt::format("branched from {} at step {}, time {:g}", from->branched_from, from->step, from->time));
    for (const std::string& warning : deck_.warnings) log_->warn(warning);
  }
  if (!options_.warning.empty()) warn("warning: " + options_.warning);
  if (options_.at_work && options_.at_work->size() < ranks)
    warn(fmt::format("warning: {} particles under forces are too few to be shared; one rank works, the other {} wait",
                     outcome_.particles, ranks - 1));
  else if (ranks > 1 && outcome_.particles < kFewPerRank * static_cast<std::size_t>(ranks))
    log_->say(
        fmt::format("hint: {} particles on {} ranks are few for each; fewer ranks may be faster (parallel/README.md)",
                    outcome_.particles, ranks));
  if (!options_.lock->warning().empty()) warn(options_.lock->warning());
  if (backup) warn("warning: the files of an earlier run in this directory are now in " + backup->string());
  const std::string origin =
      outcome_.branched_from.empty()
          ? ""
          : fmt::format("# A branch of {}: it started from the particles there.\n", outcome_.branched_from);
  write_file_atomically(directory / run_file::deck, origin + deck_.toml_text);
  table_ = std::make_unique<ThermoTable<D>>(*log_, continued ? continued->log_rows : 0);
  try {
    files_ = std::make_unique<RunFiles<D>>(deck_, simulation.system(),
                                           continued ? std::optional(continued->files) : std::nullopt);
    files_->add_to(simulation);
    simulation.add(*table_);
  } catch (const std::exception& error) {
    fail(error.what());
    throw;
  }
}

template <int D>
void RunRecord<D>::warn(const std::string& text) {
  log_->warn(text);
  warnings_.push_back(text);
}

template <int D>
CheckpointHead RunRecord<D>::head() {
  const Statistics& statistics = simulation_.statistics();
  return {.deck = deck_.toml_text,
          .deck_file = deck_.file.string(),
          .version = version_string(),
          .integrator = deck_.integrator,
          .dimension = D,
          .particles = outcome_.particles,
          .step = statistics.steps,
          .time = statistics.end_time,
          .files = files_->mark(),
          .log = log_->mark(),
          .log_rows = table_->rows(),
          .bonds = bonds_,
          .warnings = deck_.warnings,
          .branched_from = outcome_.branched_from};
}

template <int D>
CheckpointHead RunRecord<D>::checkpoint() {
  CheckpointHead now = head();
  write_checkpoint(deck_.output.directory, now, simulation_.system());
  return now;
}

template <int D>
void RunRecord<D>::write_summary() {
  outcome_.walls = WallRecord::all(simulation_.system().box);
  write_file_atomically(deck_.output.directory / run_file::summary,
                        summary_text(deck_, outcome_, simulation_.statistics()));
}

template <int D>
void RunRecord<D>::close(const std::string& last) {
  const Statistics& statistics = simulation_.statistics();
  table_->finish();
  Communicator alone;
  const auto accounts = accounts_of_all(options_.at_work ? *options_.at_work : alone, statistics);
  files_->close();
  outcome_.species_values = files_->species_values();
  outcome_.peak_memory_bytes = peak_memory_bytes(accounts);
  if (statistics.stopped_early) outcome_.status = "interrupted";
  log_->say(report_text(deck_, statistics, accounts));
  for (const std::string& warning : warnings_about(deck_, statistics, simulation_.system().box)) {
    outcome_.warnings.push_back(warning);
    warn(warning);
  }
  if (const auto subdomains = statistics.counters.windows.subdomains;
      subdomains > 0 && subdomains < static_cast<unsigned>(options_.ranks))
    log_->warn(fmt::format("warning: there is work for {} of {} ranks only; use so many", subdomains, options_.ranks));
  if (!last.empty()) log_->warn(last);
  log_->close();
  write_summary();
}

template <int D>
void RunRecord<D>::fail(const std::string& why) {
  outcome_.status = "failed";
  outcome_.error = why;
  const auto overlap = overlap_warning(simulation_.statistics(), simulation_.system().box);
  if (overlap) outcome_.warnings.push_back(*overlap);
  if (files_) files_->close_after_failure();  // first: this frees the space reserved on a disk that may be full
  at_best([&] { write_summary(); });
  at_best([&] { table_->finish(); });
  at_best([&] {
    if (overlap) warn(*overlap);
    log_->error(why);
  });
}

template class RunRecord<2>;
template class RunRecord<3>;

}  // namespace carom
