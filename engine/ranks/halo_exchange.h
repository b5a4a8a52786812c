// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Owners of a rank's ghosts, ranks with ghosts of its own particles, and the exchange that updates ghosts.

#include <span>
#include <vector>

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
  /// The largest squared displacement of an own particle since assign().
  double squared_farthest(const Box<D>& box, const Particles<D>& p) const;

  /// Ghosts get the values of their owners; each vector has an entry for each particle of this rank. Collective.
  template <class... T>
  void update(Communicator& ranks, std::span<T>... values) const {
    std::vector<Bytes> outgoing(neighbours_.size());
    for (std::size_t k = 0; k < neighbours_.size(); ++k) {
      const auto& mine = copied_to_[static_cast<std::size_t>(neighbours_[k])];
      outgoing[k].reserve(mine.size() * (sizeof(T) + ...));
      for (const Id i : mine) (put(outgoing[k], values[i]), ...);
    }
    const std::vector<Bytes> incoming = ranks.swap(std::move(outgoing), neighbours_);
    for (std::size_t k = 0; k < neighbours_.size(); ++k) {
      Reader from(incoming[k]);
      for (const Id i : copies_of_[static_cast<std::size_t>(neighbours_[k])])
        ((values[i] = from.template get<T>()), ...);
    }
  }

 private:
  std::vector<std::vector<Id>> copied_to_, copies_of_;  // by rank: own particles with ghosts there; ghosts owned there
  std::vector<int> neighbours_;                         // ranks with entries in either
  std::vector<char> matters_;
  std::vector<Vec<D>> at_;  // unwrapped positions at assign()
};

}  // namespace carom
