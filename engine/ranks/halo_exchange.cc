// SPDX-License-Identifier: BSD-3-Clause
#include "engine/ranks/halo_exchange.h"

#include <array>

namespace carom {

template <int D>
void HaloExchange<D>::assign(const Bisection<D>& bisection, const Box<D>& box, Particles<D>& p, int me, double near,
                             bool one_sided) {
  using Side = typename Bisection<D>::Side;
  const auto own = static_cast<std::uint32_t>(me);
  copied_to_.assign(bisection.subdomains(), {});
  copies_of_ = felt_by_ = felt_of_ = copied_to_;
  matters_.clear();
  at_.clear();
  for (Id i = 0; i < p.size(); ++i) {
    const Vec<D> x = bisection.wrapped(p.x[i]);
    const std::uint32_t owner = bisection.owner(x);
    p.ghost[i] = 0;
    matters_.push_back(owner != own && bisection.squared_distance(own, x) <= near * near);
    at_.push_back(p.x[i] + box.shift(p.image[i]));
    if (owner == own) {
      for_each_receiver(bisection, x, one_sided, [&](std::uint32_t rank) {
        if (rank == own) return;
        copied_to_[rank].push_back(i);
        if (bisection.side(rank, own, x) != Side::below) felt_by_[rank].push_back(i);
      });
      continue;
    }
    const Side side = bisection.side(own, owner, x);
    p.ghost[i] = side == Side::unknown ? kGhost : side == Side::above ? kGhostHere : kGhostElsewhere;
    copies_of_[owner].push_back(i);
    if (side != Side::below) felt_of_[owner].push_back(i);
  }
  neighbours_.clear();
  for (std::size_t rank = 0; rank < copied_to_.size(); ++rank)
    if (!copied_to_[rank].empty() || !copies_of_[rank].empty()) neighbours_.push_back(static_cast<int>(rank));
}

template <int D>
double HaloExchange<D>::squared_farthest(const Box<D>& box, const Particles<D>& p, std::span<const Vec<D>> x) const {
  double farthest = 0;
  for (Id i = 0; i < p.size(); ++i)
    if (p.owns(i)) farthest = std::max(farthest, (x[i] + box.shift(p.image[i]) - at_[i]).squaredNorm());
  return farthest;
}

template <int D>
bool HaloExchange<D>::add_ghosts(Communicator& ranks, ForceSums<D>& sums) const {
  using Words = typename ForceSums<D>::Words;
  static_assert(alignof(Words) <= __STDCPP_DEFAULT_NEW_ALIGNMENT__);  // messages are read where they are
  std::array<double, 2> most = {sums.wide() ? 1.0 : 0.0, sums.has_room() ? 0.0 : 1.0};  // on any rank
  for (const bool high : {false, true}) {
    if (high && most[0] == 0) break;
    send(ranks, felt_of_, felt_by_, sizeof(Words), most, [&](std::byte* to, Id i) {
      const Words taken = sums.take(i, high);
      std::memcpy(to, &taken, sizeof(Words));
    });
    const std::vector<Bytes>& incoming = ranks.complete();
    for (std::size_t k = 0; k < neighbours_.size(); ++k) {
      const std::span taken(reinterpret_cast<const Words*>(incoming[k].data()), incoming[k].size() / sizeof(Words));
      sums.add(felt_by_[static_cast<std::size_t>(neighbours_[k])], taken, high);
    }
  }
  return most[1] == 0;
}

template class HaloExchange<2>;
template class HaloExchange<3>;

}  // namespace carom
