#include "io/run_files.h"

#include <exception>

#include "io/output_directory.h"

namespace carom {

namespace {
Sampling rdf_sampling(const OutputConfig& output) { return {output.rdf_interval, output.sample_start}; }
Sampling msd_sampling(const OutputConfig& output) { return {output.msd_interval, output.sample_start}; }
}  // namespace

std::vector<Sampling> samplings(const OutputConfig& output) { return {rdf_sampling(output), msd_sampling(output)}; }

template <int D>
RunFiles<D>::RunFiles(const Deck& deck, const System<D>& system)
    : trajectory_(deck.output.directory / run_file::trajectory, deck, system),
      thermo_(deck.output.directory / run_file::thermo) {
  if (deck.plan.events) events_ = std::make_unique<EventWriter<D>>(deck.output.directory / run_file::events, deck);
  const OutputConfig& output = deck.output;
  if (output.rdf_interval > 0)
    rdf_ = std::make_unique<RdfWriter<D>>(
        output.directory / run_file::rdf, system,
        RadialDistributionOptions{rdf_sampling(output), output.rdf_range.value(), output.rdf_bins});
  if (output.msd_interval > 0)
    msd_ = std::make_unique<MsdWriter<D>>(output.directory / run_file::msd, system, msd_sampling(output));
}

template <int D>
void RunFiles<D>::add_to(Simulation<D>& simulation) {
  if (events_) simulation.add(*events_);
  simulation.add(trajectory_);
  simulation.add(thermo_);
  if (rdf_) simulation.add(*rdf_);
  if (msd_) simulation.add(*msd_);
}

template <int D>
void RunFiles<D>::close() {
  trajectory_.close();
  thermo_.close();
  if (events_) events_->close();
  if (rdf_) rdf_->close();
  if (msd_) msd_->close();
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
  if (rdf_) try_to_close(*rdf_);
  if (msd_) try_to_close(*msd_);
}

template <int D>
std::vector<ContactValue> RunFiles<D>::contact_values() const {
  return rdf_ ? rdf_->contact_values() : std::vector<ContactValue>{};
}

template class RunFiles<2>;
template class RunFiles<3>;

}  // namespace carom
