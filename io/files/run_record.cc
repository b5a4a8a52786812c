// SPDX-License-Identifier: BSD-3-Clause
#include "io/files/run_record.h"

#include <spdlog/fmt/fmt.h>

#include "io/files/output_directory.h"
#include "io/files/text_file.h"
#include "io/files/version.h"

namespace carom {

template <int D>
RunRecord<D>::RunRecord(Deck deck, Simulation<D>& simulation, const CheckpointHead* continued)
    : deck_(std::move(deck)), simulation_(simulation), lock_(deck_.output.directory) {
  const auto& directory = deck_.output.directory;
  const auto marks = continued ? std::optional(continued->files) : std::nullopt;
  outcome_ = {.status = "done", .warnings = deck_.warnings, .particles = simulation.system().size(), .ranks = 1};
  std::optional<std::filesystem::path> backup;
  if (continued) {
    check_files(deck_, continued->files, continued->log);
    outcome_.branched_from = continued->branched_from;
    bonds_ = continued->bonds;
  } else {
    backup = prepare_output_directory(directory, deck_.output.overwrite);
    bonds_ = found_bonds(deck_, simulation.system());
  }
  log_ = std::make_unique<RunLog>(directory / run_file::log, true,
                                  continued ? std::optional(continued->log) : std::nullopt);
  if (continued) {
    log_->note(fmt::format("continued at step {} on 1 rank", continued->step));
  } else {
    log_->note(banner_text(deck_, outcome_.particles, 1));
    for (const std::string& warning : deck_.warnings) log_->note(warning);
  }
  if (!lock_.warning().empty()) warn(lock_.warning());
  if (backup) warn("warning: the files of an earlier run in this directory are now in " + backup->string());
  write_file_atomically(directory / run_file::deck, deck_.toml_text);
  files_ = std::make_unique<RunFiles<D>>(deck_, simulation.system(), marks);
  table_ = std::make_unique<ThermoTable<D>>(*log_, continued ? continued->log_rows : 0);
  files_->add_to(simulation);
  simulation.add(*table_);
}

template <int D>
void RunRecord<D>::warn(const std::string& text) {
  log_->note(text);
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
void RunRecord<D>::close() {
  const Statistics& statistics = simulation_.statistics();
  table_->finish();
  files_->close();
  outcome_.species_values = files_->species_values();
  if (statistics.stopped_early) outcome_.status = "interrupted";
  Communicator alone;
  log_->note(report_text(deck_, statistics, accounts_of_all(alone, statistics)));
  for (const std::string& warning : warnings_about(deck_, statistics, simulation_.system().box)) {
    outcome_.warnings.push_back(warning);
    warn(warning);
  }
  log_->close();
  write_summary();
}

template <int D>
void RunRecord<D>::fail(const std::string& why) {
  outcome_.status = "failed";
  outcome_.error = why;
  if (const auto overlap = overlap_warning(simulation_.statistics(), simulation_.system().box)) {
    outcome_.warnings.push_back(*overlap);
    at_best([&] { warn(*overlap); });
  }
  files_->close_after_failure();
  at_best([&] { write_summary(); });
  at_best([&] { table_->finish(); });
  at_best([&] { log_->error(why); });
}

template class RunRecord<2>;
template class RunRecord<3>;

}  // namespace carom
