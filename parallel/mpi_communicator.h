// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The MPI implementation of Communicator, for the ranks of a World.
//
// Waits poll for failures of other ranks (parallel/watch.h) and throw RankFailure or SilentRanks. Messages may still
// arrive afterwards, so the object must outlive World::on_all(). Messages can have any length: long ones are split to
// stay below MPI's limit of 2^31 bytes.

#include <array>

#include "engine/ranks/communicator.h"
#include "parallel/watch.h"

namespace carom {

class MpiCommunicator : public Communicator {
 public:
  /// Stores both. Its calls require several ranks.
  MpiCommunicator(MPI_Comm world, Watch& watch);

  int rank() const override { return rank_; }
  int size() const override { return size_; }
  std::vector<Bytes> swap(std::vector<Bytes> outgoing) override;
  std::vector<Bytes> swap(std::vector<Bytes> outgoing, std::span<const int> partners) override;
  std::vector<Bytes> gather(const Bytes& mine) override;
  void combine(std::span<double> most, std::span<std::uint64_t> sums) override;
  void start(std::vector<Bytes>& outgoing, std::span<const int> partners, std::span<const std::size_t> sizes,
             std::span<double> most) override;
  const std::vector<Bytes>& complete() override;
  double seconds_waited() const override { return watch_.seconds_waited(); }

 private:
  /// An exchange of combine() with another rank.
  struct Round {
    int partner, tag;
    bool sends, receives;
  };
  void begin_combine(std::span<double> most, std::span<std::uint64_t> sums);
  void begin_round();
  void end_combine();
  std::vector<Bytes> trade(const std::function<const Bytes&(std::size_t)>& outgoing);

  MPI_Comm world_;
  Watch& watch_;
  int rank_ = 0, size_ = 1;
  // Buffers of received messages, and of messages sent by swap().
  std::vector<std::uint64_t> leaving_, coming_;
  std::vector<Bytes> incoming_, outgoing_;
  std::vector<Bytes> first_in_, first_out_;  // the first messages between neighbours
  // Values to combine, where their results go, and the rounds from the present one on.
  std::vector<std::uint64_t> mine_, theirs_;
  std::span<double> most_;
  std::span<std::uint64_t> sums_;
  std::vector<Round> rounds_;
  std::size_t round_ = 0;
  std::array<MPI_Request, 2> combining_ = {MPI_REQUEST_NULL, MPI_REQUEST_NULL};
  std::vector<MPI_Request> receiving_;          // from start() to complete()
  std::array<std::vector<Bytes>, 2> arriving_;  // of this exchange and of the one before: methods alternate two kinds
  /// Messages that start() sends. Long ones leave only while the receiver waits in complete(), so this rank waits for
  /// them two exchanges later: it may be up to a step ahead of its neighbours.
  struct Departure {
    std::vector<Bytes> messages;
    std::vector<MPI_Request> requests;
  };
  std::array<Departure, 2> departures_;
};

}  // namespace carom
