// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Which rank owns the particles that this one knows, which of its own others have copies of, and how copies get the
// values of their owners.

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
  /// Sets the owners of the particles that rank `me` knows, and which ranks know its own: those that they concern by
  /// the bisection. Copies nearer to its subdomain than `near` matter.
  void assign(const Bisection<D>& bisection, const Box<D>& box, Particles<D>& p, int me, double near);
  /// Whether what a copy does matters to own particles.
  bool matters(Id i) const { return matters_[i] != 0; }
  /// The square of the farthest that an own particle has come since assign().
  double squared_farthest(const Box<D>& box, const Particles<D>& p) const;

  /// Copies get the values of their owners; each vector has an entry for each particle known. Collective.
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
  std::vector<std::vector<Id>> copied_to_, copies_of_;  // by rank: own particles that it knows, copies of its own
  std::vector<int> neighbours_;                         // the ranks of which there are any
  std::vector<char> matters_;
  std::vector<Vec<D>> at_;  // where those known were at assign(), images undone
};

}  // namespace carom
