#include "io/files/run_files.h"

#include <algorithm>
#include <exception>
#include <iterator>

#include "engine/base/error.h"
#include "io/files/output_directory.h"

namespace carom {
namespace {

/// One of the marks, where there are any.
template <class Mark>
std::optional<Mark> mark_of(const std::optional<FileMarks>& marks, Mark FileMarks::*which) {
  return marks ? std::optional(*marks.*which) : std::nullopt;
}

}  // namespace

template <int D>
RunFiles<D>::RunFiles(const Deck& deck, const System<D>& system, const std::optional<FileMarks>& marks)
    : trajectory_(deck.output.directory / run_file::trajectory, deck, system, mark_of(marks, &FileMarks::frames)),
      thermo_(deck.output.directory / run_file::thermo, mark_of(marks, &FileMarks::thermo_bytes)) {
  if (deck.plan.events)
    events_ = std::make_unique<EventWriter<D>>(deck.output.directory / run_file::events, deck,
                                               mark_of(marks, &FileMarks::events));
  for (const auto& [info, parameters] : deck.output.observables) {
    const std::filesystem::path path = deck.output.directory / run_file::averages(*info);
    averages_.emplace_back(path, info->template in<D>().make(system, parameters, deck.output.sample_start));
  }
}

template <int D>
FileMarks RunFiles<D>::mark() {
  return {trajectory_.frames(), thermo_.size(), events_ ? events_->mark() : EventMark()};
}

template <int D>
void RunFiles<D>::add_to(Simulation<D>& simulation) {
  if (events_) simulation.add(*events_);
  simulation.add(trajectory_);
  simulation.add(thermo_);
  for (auto& average : averages_) simulation.add(average);
}

template <int D>
void RunFiles<D>::close() {
  trajectory_.close();
  thermo_.close();
  if (events_) events_->close();
  for (const auto& average : averages_) average.close();
}

template <int D>
void RunFiles<D>::close_after_failure() {
  const auto try_to_close = [](auto& file) {
    try {
      file.close();
    } catch (const std::exception&) {  // the failure that brought us here is the one to report
    }
  };
  try_to_close(trajectory_);
  try_to_close(thermo_);
  if (events_) try_to_close(*events_);
  for (auto& average : averages_) try_to_close(average);
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
