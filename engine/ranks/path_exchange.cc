// SPDX-License-Identifier: BSD-3-Clause
#include "engine/ranks/path_exchange.h"

#include <algorithm>
#include <bit>

namespace carom {

template <int D>
void PathExchange<D>::start(const Bisection<D>& bisection) {
  partners_.clear();
  if (const auto me = static_cast<std::uint32_t>(ranks_.rank()); me < bisection.subdomains())
    for (const std::uint32_t r : bisection.neighbours(me)) partners_.push_back(static_cast<int>(r));
  outgoing_.assign(partners_.size(), {});
}

template <int D>
const std::vector<Bytes>& PathExchange<D>::swap() {
  for (Bytes& read : received_) read.clear();
  received_.resize(partners_.size());
  received_ = ranks_.swap(std::exchange(outgoing_, std::move(received_)), partners_);
  return received_;
}

template <int D>
std::uint64_t PathExchange<D>::make_consistent(Subdomain<D>* subdomain, const std::function<bool(bool)>& agree) {
  std::uint64_t rounds = 0;
  for (bool more = true; more; rounds += 2) {
    for (int round = 0; round < 2; ++round) {  // most windows need two, few need more
      if (subdomain) add_paths(*subdomain);
      for (const Bytes& bytes : swap())
        for (Reader reader(bytes); subdomain && reader.more();) subdomain->paths().read_script(reader);
      if (subdomain) subdomain->repair();
    }
    more = agree(subdomain &&
                 std::ranges::any_of(subdomain->changed(), [&](Slot i) { return subdomain->ownership().is_seen(i); }));
  }
  return rounds;
}

template <int D>
void PathExchange<D>::add_paths(Subdomain<D>& subdomain) {
  for (const Slot i : subdomain.changed())
    for (std::uint64_t holders = subdomain.ownership().holders(i); holders != 0; holders &= holders - 1)
      subdomain.paths().write(i, outgoing_[static_cast<std::size_t>(std::countr_zero(holders))]);
}

template class PathExchange<2>;
template class PathExchange<3>;

}  // namespace carom
