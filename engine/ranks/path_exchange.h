// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Messages between neighbouring subdomains: ghosts that a neighbour lacks, and the paths that make a window consistent.

#include <functional>

#include "engine/ranks/subdomain.h"

namespace carom {

template <int D>
class PathExchange {
 public:
  explicit PathExchange(Communicator& ranks) : ranks_(ranks) {}

  /// Connects the subdomains of a bisection; each of the first ranks has one.
  void start(const Bisection<D>& bisection);
  /// Appends a value to the next message to the k-th neighbour of this rank's subdomain.
  template <class T>
  void add(std::size_t neighbour, const T& value) {
    put(outgoing_[neighbour], value);
  }
  /// Sends the messages; returns the messages received from the neighbours, valid until the next call. Collective.
  const std::vector<Bytes>& swap();
  /// Exchanges the paths of a window and repairs it, in rounds; returns their number. After every second round
  /// agree(changed) is called, which gets whether paths changed here in this round that a neighbour has, and returns
  /// whether a path changed on any rank: then there are two more. Null: this rank has no subdomain. Collective.
  std::uint64_t make_consistent(Subdomain<D>* subdomain, const std::function<bool(bool)>& agree);

 private:
  void add_paths(Subdomain<D>& subdomain);

  Communicator& ranks_;
  std::vector<int> partners_;    // ranks of the neighbours
  std::vector<Bytes> outgoing_;  // for each of them
  std::vector<Bytes> received_;  // from each of them; their memory is used for the next outgoing messages
};

}  // namespace carom
