// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Communication among the ranks of a run, as far as the engine knows: bytes, sums and maxima.
//
// By default there is one rank. parallel/ has the class for MPI. Every call is collective: all ranks make the same
// calls in the same order.

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "engine/base/bytes.h"
#include "engine/base/counters.h"

namespace carom {

class Communicator {
 public:
  virtual ~Communicator() = default;
  virtual int rank() const { return 0; }
  virtual int size() const { return 1; }

  /// Sends outgoing[r] to rank r and returns what each rank has sent here, by rank. Empty messages are not sent.
  virtual std::vector<Bytes> swap(std::vector<Bytes> outgoing) { return outgoing; }
  /// The same among neighbours: outgoing[k] goes to partners[k], and this rank is among the partners of that one;
  /// returns what they have sent, in their order. Others are not waited for.
  virtual std::vector<Bytes> swap(std::vector<Bytes> outgoing, std::span<const int> /*partners*/) { return outgoing; }
  /// The messages of all ranks, by rank.
  virtual std::vector<Bytes> gather(const Bytes& mine) { return {mine}; }
  /// Makes each of `most` the largest among all ranks and each of `sums` the sum over them.
  virtual void combine(std::span<double> /*most*/, std::span<std::uint64_t> /*sums*/) {}
  void largest(std::span<double> values) { combine(values, {}); }
  void sum(std::span<std::uint64_t> values) { combine({}, values); }
};

/// The messages of all ranks, by rank, on rank 0; empty ones elsewhere. Collective.
inline std::vector<Bytes> gather_on_first(Communicator& ranks, Bytes mine) {
  std::vector<Bytes> outgoing(static_cast<std::size_t>(ranks.size()));
  outgoing[0] = std::move(mine);
  return ranks.swap(std::move(outgoing));
}

/// Hands a value from rank to rank, each of which does add(value): the result is that of one rank that does it all.
template <class Value, class Add>
Value handed_on(Communicator& ranks, Value value, Add&& add) {
  for (int rank = 0; rank < ranks.size(); ++rank) {
    Bytes mine;
    if (rank == ranks.rank()) {
      add(value);
      put(mine, value);
    }
    const auto received = ranks.gather(mine);
    value = Reader(received[static_cast<std::size_t>(rank)]).template get<Value>();
  }
  return value;
}

/// The values of all ranks, those of one rank after the other. Collective.
template <class Value>
std::vector<Value> gather_values(Communicator& ranks, std::span<const Value> mine) {
  const auto bytes = std::as_bytes(mine);
  std::vector<Value> all;
  for (const Bytes& each : ranks.gather({bytes.begin(), bytes.end()}))
    for (Reader reader(each); reader.more();) all.push_back(reader.get<Value>());
  return all;
}

/// The sum over all ranks of what has a function add().
template <class Sums>
Sums sum_of_all(Communicator& ranks, const Sums& mine) {
  Sums all;
  for (const Sums& each : gather_values<Sums>(ranks, {&mine, 1})) all.add(each);
  return all;
}

/// Another one, and the time that is spent in it.
class TimedCommunicator final : public Communicator {
 public:
  explicit TimedCommunicator(Communicator& ranks) : ranks_(ranks) {}
  int rank() const override { return ranks_.rank(); }
  int size() const override { return ranks_.size(); }
  std::vector<Bytes> swap(std::vector<Bytes> outgoing) override {
    const Stopwatch watch(seconds_);
    return ranks_.swap(std::move(outgoing));
  }
  std::vector<Bytes> swap(std::vector<Bytes> outgoing, std::span<const int> partners) override {
    const Stopwatch watch(seconds_);
    return ranks_.swap(std::move(outgoing), partners);
  }
  std::vector<Bytes> gather(const Bytes& mine) override {
    const Stopwatch watch(seconds_);
    return ranks_.gather(mine);
  }
  void combine(std::span<double> most, std::span<std::uint64_t> sums) override {
    const Stopwatch watch(seconds_);
    ranks_.combine(most, sums);
  }
  double seconds() const { return seconds_; }

 private:
  Communicator& ranks_;
  double seconds_ = 0;
};

}  // namespace carom
