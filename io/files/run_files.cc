// SPDX-License-Identifier: BSD-3-Clause
#include "io/files/run_files.h"

#include <algorithm>
#include <iterator>

#include "engine/base/error.h"
#include "io/files/hdf5.h"
#include "io/files/output_directory.h"

namespace carom {

void check_files(const Deck& deck, const FileMarks& marks, const FileMark& log) {
  const auto& directory = deck.output.directory;
  check_text(directory / run_file::log, log);
  check_text(directory / run_file::thermo, marks.thermo);
  hdf5::check_rows(directory / run_file::trajectory, kFrameRows, marks.frames);
  if (deck.plan.events) hdf5::check_rows(directory / run_file::events, kEventRows, marks.events.rows);
}

template <int D>
RunFiles<D>::RunFiles(const Deck& deck, const System<D>& system, const std::optional<FileMarks>& marks)
    : trajectory_(deck.output.directory / run_file::trajectory, deck, system,
                  marks ? std::optional(marks->frames) : std::nullopt),
      thermo_(deck.output.directory / run_file::thermo, system.box,
              marks ? std::optional(marks->thermo) : std::nullopt) {
  if (deck.plan.events)
    events_ = std::make_unique<EventWriter<D>>(deck.output.directory / run_file::events, deck,
                                               marks ? std::optional(marks->events) : std::nullopt);
  for (const auto& [info, parameters] : deck.output.observables) {
    const std::filesystem::path path = deck.output.directory / run_file::averages(*info);
    averages_.emplace_back(path, info->template in<D>().make(system, parameters, deck.output.sample_start));
  }
}

template <int D>
FileMarks RunFiles<D>::mark() {
  return {trajectory_.mark(), thermo_.mark(), events_ ? events_->mark() : EventMark()};
}

template <int D>
void RunFiles<D>::for_each(auto&& action) {
  if (events_) action(*events_);
  action(trajectory_);
  action(thermo_);
  for (auto& average : averages_) action(average);
}

template <int D>
void RunFiles<D>::add_to(Simulation<D>& simulation) {
  for_each([&](auto& file) { simulation.add(file); });
}

template <int D>
void RunFiles<D>::close() {
  for_each([](auto& file) { file.close(); });
}

template <int D>
void RunFiles<D>::close_after_failure() {
  for_each([](auto& file) { at_best([&] { file.close(); }); });
}

template <int D>
std::vector<SpeciesValue> RunFiles<D>::species_values() const {
  std::vector<SpeciesValue> all;
  for (const auto& average : averages_) std::ranges::move(average.average().species_values(), std::back_inserter(all));
  return all;
}

template class RunFiles<2>;
template class RunFiles<3>;

}  // namespace carom
