// SPDX-License-Identifier: BSD-3-Clause
#include "engine/ranks/subdomain.h"

#include <algorithm>

namespace carom {

template <int D>
void Subdomain<D>::load(std::vector<Record<D>> records, const Bisection<D>& bisection, std::uint32_t number,
                        const Vec<D>& g, double horizon, double now, double max_displacement,
                        const std::vector<Spin<D>>& spins) {
  release();
  core_.load(std::move(records), g, horizon, now, 2 * max_displacement, spins);
  ownership_.emplace(core_, bisection, number, max_displacement);
  paths_.emplace(box_, core_.flights(), *ownership_);
  repair_.emplace(box_, core_, *ownership_, *paths_);
  changed_.clear();
}

template <int D>
void Subdomain<D>::release() {
  repair_.reset();
  paths_.reset();
  ownership_.reset();
  core_.release();
}

template <int D>
double Subdomain<D>::run(double now, double end) {
  end_ = end;
  length_ = end - now;
  redone_before_ = redone_events_;
  Counters unused;
  double reached = end;
  try {
    core_.run(end, {.counters = unused, .trace = &paths_->start()});
  } catch (LogFull) {
    reached = core_.now();
  }
  run_events_ += paths_->trace().events().size();
  changed_ = paths_->end();
  return reached;
}

template <int D>
void Subdomain<D>::repair() {
  changed_ = repair_->run(end_);
  redone_events_ += repair_->events();
}

template <int D>
void Subdomain<D>::commit() {
  const auto other = paths_->finish();
  for (const auto& each : other) ownership_->turn(each.slot, true);
  core_.put(other, end_);
  changed_.clear();
}

template class Subdomain<2>;
template class Subdomain<3>;

}  // namespace carom
