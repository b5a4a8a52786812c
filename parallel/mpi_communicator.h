// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Communicator among the ranks of a World, by MPI.
//
// Waits look for failures of others (parallel/watch.h) and throw RankFailure or SilentRanks; messages may arrive after
// that, so the object must outlive World::on_all(). They may be of any length: MPI's limit of 2^31 bytes does
// not show.

#include "engine/ranks/communicator.h"
#include "parallel/world.h"

namespace carom {

class MpiCommunicator : public Communicator {
 public:
  /// Keeps a reference. There are several ranks.
  explicit MpiCommunicator(const World& ranks) : ranks_(ranks) {}

  int rank() const override { return ranks_.rank(); }
  int size() const override { return ranks_.size(); }
  std::vector<Bytes> swap(std::vector<Bytes> outgoing) override;
  std::vector<Bytes> swap(std::vector<Bytes> outgoing, std::span<const int> partners) override;
  std::vector<Bytes> gather(const Bytes& mine) override;
  void combine(std::span<double> most, std::span<std::uint64_t> sums) override;

 private:
  std::vector<Bytes> trade(const std::function<const Bytes&(std::size_t)>& outgoing);

  const World& ranks_;
  // Where messages arrive; what leaves in swap().
  std::vector<std::uint64_t> leaving_, coming_;
  std::vector<Bytes> incoming_, outgoing_;
  std::vector<Bytes> first_in_, first_out_;   // the first messages among neighbours
  std::vector<std::uint64_t> mine_, theirs_;  // values that are combined
};

}  // namespace carom
