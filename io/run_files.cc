#include "io/run_files.h"

#include <exception>

#include "io/output_directory.h"

namespace carom {

template <int D>
RunFiles<D>::RunFiles(const Deck& deck, const System<D>& system)
    : trajectory_(deck.output.directory / run_file::trajectory, deck, system),
      thermo_(deck.output.directory / run_file::thermo) {
  if (deck.plan.events) events_ = std::make_unique<EventWriter<D>>(deck.output.directory / run_file::events, deck);
}

template <int D>
void RunFiles<D>::add_to(Simulation<D>& simulation) {
  if (events_) simulation.add(*events_);
  simulation.add(trajectory_);
  simulation.add(thermo_);
}

template <int D>
void RunFiles<D>::close() {
  trajectory_.close();
  thermo_.close();
  if (events_) events_->close();
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
}

template class RunFiles<2>;
template class RunFiles<3>;

}  // namespace carom
