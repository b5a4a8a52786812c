// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What subdomains that border on each other send: ghosts that the other one lacks, and paths until both agree about a
// window.

#include "engine/ranks/subdomain.h"

namespace carom {

template <int D>
class PathExchange {
 public:
  explicit PathExchange(Communicator& ranks) : ranks_(ranks) {}

  /// Between the subdomains of a bisection, of which each of the first ranks has one.
  void start(const Bisection<D>& bisection);
  /// Appends a value to the next message to the k-th neighbour of this rank's subdomain.
  template <class T>
  void add(std::size_t neighbour, const T& value) {
    put(outgoing_[neighbour], value);
  }
  /// Sends the messages; returns those that have come from neighbours. Collective.
  std::vector<Bytes> swap();
  /// Sends the paths of a window and repairs them until nothing changes on any rank; returns how many rounds it took.
  /// Once a window: what was received stays until the next. Null: this rank has no subdomain. Collective.
  std::uint64_t agree(Subdomain<D>* subdomain);

 private:
  void add_paths(Subdomain<D>& subdomain);

  Communicator& ranks_;
  std::vector<int> partners_;                 // the ranks of the neighbours
  std::vector<Bytes> outgoing_;               // to each of them
  std::vector<std::vector<Bytes>> received_;  // of the window: paths that were sent here
};

}  // namespace carom
