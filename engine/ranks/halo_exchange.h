// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Owners of a rank's ghosts, ranks with ghosts of its own particles, and the exchange that updates ghosts.

#include <cstring>
#include <span>
#include <vector>

#include "engine/base/force_sums.h"
#include "engine/base/particles.h"
#include "engine/ranks/communicator.h"

namespace carom {

template <int D>
struct Box;
template <int D>
class Bisection;

template <int D>
class HaloExchange {
 public:
  /// Sets the owners of the particles on rank `me`, and the ranks that have its own ones as ghosts, from the bisection.
  /// Ghosts within `near` of the rank's subdomain matter.
  void assign(const Bisection<D>& bisection, const Box<D>& box, Particles<D>& p, int me, double near);
  /// Whether the motion of a ghost matters to own particles.
  bool matters(Id i) const { return matters_[i] != 0; }
  /// The largest squared displacement of an own particle since assign(), if it is at x with the image of `p`.
  double squared_farthest(const Box<D>& box, const Particles<D>& p, std::span<const Vec<D>> x) const;

  /// Ghosts get the values of their owners; each vector has an entry for each particle of this rank. Collective.
  template <class... T>
  void update(Communicator& ranks, std::span<T>... values) const {
    start(ranks, {}, values...);
    finish(ranks, values...);
  }
  /// Owners add the sums on ghosts to those on their particles; the sums on ghosts are zero afterwards. Collective.
  void add_ghosts(Communicator& ranks, ForceSums<D>& sums) const;
  /// update() in two parts, between which the values are unknown; finish() also replaces each of `most` by its maximum
  /// over all ranks.
  template <class... T>
  void start(Communicator& ranks, std::span<double> most, std::span<T>... values) const {
    constexpr std::size_t kBytes = (sizeof(T) + ...);
    std::vector<Bytes> outgoing(neighbours_.size());
    std::vector<std::size_t> sizes;
    for (std::size_t k = 0; k < neighbours_.size(); ++k) {
      const auto rank = static_cast<std::size_t>(neighbours_[k]);
      sizes.push_back(kBytes * copies_of_[rank].size());
      outgoing[k].resize(kBytes * copied_to_[rank].size());
      std::byte* to = outgoing[k].data();
      for (const Id i : copied_to_[rank])
        ((std::memcpy(to, static_cast<const void*>(&values[i]), sizeof(T)), to += sizeof(T)), ...);
    }
    ranks.start(std::move(outgoing), neighbours_, sizes, most);
  }
  template <class... T>
  void finish(Communicator& ranks, std::span<T>... values) const {
    const std::vector<Bytes> incoming = ranks.complete();
    for (std::size_t k = 0; k < neighbours_.size(); ++k) {
      const std::byte* from = incoming[k].data();
      for (const Id i : copies_of_[static_cast<std::size_t>(neighbours_[k])])
        ((std::memcpy(static_cast<void*>(&values[i]), from, sizeof(T)), from += sizeof(T)), ...);
    }
  }

 private:
  std::vector<std::vector<Id>> copied_to_, copies_of_;  // by rank: own particles with ghosts there; ghosts owned there
  std::vector<int> neighbours_;                         // ranks with entries in either
  std::vector<char> matters_;
  std::vector<Vec<D>> at_;  // unwrapped positions at assign()
};

}  // namespace carom
