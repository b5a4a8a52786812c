// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Owners of a rank's ghosts, ranks with ghosts of its own particles, and the exchange that updates ghosts.

#include <cstring>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/force_sums.h"
#include "engine/base/particles.h"
#include "engine/ranks/bisection.h"
#include "engine/ranks/communicator.h"

namespace carom {

/// Calls visit(rank) for the owner of a position and the ranks that have a particle there as a ghost: those near it or,
/// if `one_sided`, only those of them that may evaluate its pairs.
template <int D>
void for_each_receiver(const Bisection<D>& bisection, const Vec<D>& at, bool one_sided, auto&& visit) {
  using Side = typename Bisection<D>::Side;
  std::optional<std::uint32_t> owner;
  bisection.for_each_near(at, [&](std::uint32_t rank) {
    if (!owner) owner = rank;
    if (!one_sided || rank == *owner || bisection.side(rank, *owner, at) != Side::below) visit(rank);
  });
}

template <int D>
class HaloExchange {
 public:
  /// Sets the owners of the particles on rank `me`, and the ranks that have its own ones as ghosts, from the bisection.
  /// Ghosts within `near` of the rank's subdomain matter. `one_sided`: see for_each_receiver().
  void assign(const Bisection<D>& bisection, const Box<D>& box, Particles<D>& p, int me, double near,
              bool one_sided = false);
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
  /// Sends the sums on ghosts to the owners, where they are added; those on ghosts are zero afterwards. Returns whether
  /// the sums of all ranks had room for more passes. Collective.
  bool add_ghosts(Communicator& ranks, ForceSums<D>& sums) const;
  /// update() in two parts, between which the values are unknown; finish() also replaces each of `most` by its maximum
  /// over all ranks.
  template <class... T>
  void start(Communicator& ranks, std::span<double> most, std::span<T>... values) const {
    send(ranks, copied_to_, copies_of_, (sizeof(T) + ...), most, [&](std::byte* to, Id i) {
      ((std::memcpy(to, static_cast<const void*>(&values[i]), sizeof(T)), to += sizeof(T)), ...);
    });
  }
  template <class... T>
  void finish(Communicator& ranks, std::span<T>... values) const {
    const std::vector<Bytes>& incoming = ranks.complete();
    for (std::size_t k = 0; k < neighbours_.size(); ++k) {
      const std::byte* from = incoming[k].data();
      for (const Id i : copies_of_[static_cast<std::size_t>(neighbours_[k])])
        ((std::memcpy(static_cast<void*>(&values[i]), from, sizeof(T)), from += sizeof(T)), ...);
    }
  }

 private:
  using Lists = std::vector<std::vector<Id>>;
  /// Starts an exchange of so many bytes for each particle; pack(to, i) writes those for an entry of `from`.
  void send(Communicator& ranks, const Lists& from, const Lists& to, std::size_t bytes, std::span<double> most,
            auto&& pack) const {
    outgoing_.resize(neighbours_.size());
    std::vector<std::size_t> sizes;
    for (std::size_t k = 0; k < neighbours_.size(); ++k) {
      const auto rank = static_cast<std::size_t>(neighbours_[k]);
      sizes.push_back(bytes * to[rank].size());
      outgoing_[k].resize(bytes * from[rank].size());
      std::byte* at = outgoing_[k].data();
      for (const Id i : from[rank]) pack(at, i), at += bytes;
    }
    ranks.start(outgoing_, neighbours_, sizes, most);
  }

  Lists copied_to_, copies_of_;  // by rank: own particles with ghosts there; ghosts owned there
  Lists felt_by_, felt_of_;      // the part of each of which the ghosts' rank may evaluate pairs
  std::vector<int> neighbours_;  // ranks with entries in copied_to_ or copies_of_
  std::vector<char> matters_;
  std::vector<Vec<D>> at_;               // unwrapped positions at assign()
  mutable std::vector<Bytes> outgoing_;  // the next messages, in memory that is used again
};

}  // namespace carom
