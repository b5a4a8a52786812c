#include "engine/ranks/subdomain.h"

namespace carom {

template <int D>
void Subdomain<D>::load(std::vector<Record<D>> records, const Bisection<D>& bisection, std::uint32_t number,
                        const Vec<D>& g, double horizon, double now, double max_displacement) {
  core_.load(std::move(records), g, horizon, now, 2 * max_displacement);
  const std::size_t room = core_.flights().room();
  ownership_.load(bisection, number, max_displacement);
  paths_.load(room);
  repair_.load(room);
  changed_.clear();
  other_.clear();
  disturbed_.assign(room, 0);
}

template <int D>
double Subdomain<D>::run(double now, double end) {
  end_ = end;
  length_ = end - now;
  repair_.start(end);
  Counters unused;
  double reached = end;
  try {
    core_.run(end, {.counters = unused, .trace = &paths_.start()});
  } catch (LogFull) {
    reached = core_.now();
  }
  run_events_ += paths_.trace().events().size();
  changed_ = paths_.end();
  return reached;
}

template <int D>
void Subdomain<D>::commit() {
  other_ = paths_.finish();
  for (const auto& [slot, record] : other_) disturbed_[slot] = 1;
  core_.put(other_, end_);
  changed_.clear();
}

template class Subdomain<2>;
template class Subdomain<3>;

}  // namespace carom
