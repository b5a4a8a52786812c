// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The engine's interface for communication among ranks: exchange of bytes, sums and maxima.
//
// The default is a single rank; parallel/ implements MPI. Every call is collective: all ranks make the same calls in
// the same order.

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "engine/base/bytes.h"
#include "engine/laws/counters.h"

namespace carom {

class Communicator {
 public:
  virtual ~Communicator() = default;
  virtual int rank() const { return 0; }
  virtual int size() const { return 1; }

  /// Sends outgoing[r] to rank r and returns the messages received, by rank. Empty messages are not sent.
  virtual std::vector<Bytes> swap(std::vector<Bytes> outgoing) { return outgoing; }
  /// Exchange between neighbours: sends outgoing[k] to partners[k] and returns the messages from the partners, in their
  /// order. The relation is mutual: this rank is a partner of its partners. Waits for no other rank.
  virtual std::vector<Bytes> swap(std::vector<Bytes> outgoing, std::span<const int> /*partners*/) { return outgoing; }
  /// The messages of all ranks, by rank.
  virtual std::vector<Bytes> gather(const Bytes& mine) { return {mine}; }
  /// Replaces each of `most` by its maximum over all ranks and each of `sums` by its sum.
  virtual void combine(std::span<double> /*most*/, std::span<std::uint64_t> /*sums*/) {}
  /// Begins an exchange between neighbours as swap(), with sizes[k] bytes to come from partners[k], and a combine().
  /// On return, `outgoing` has earlier messages, the memory of which can be used for the next ones. Both end with
  /// complete(), which returns the messages, valid until the next start(). Until then `most` must stay, and no other
  /// call but swap() of all ranks and gather() is allowed.
  virtual void start(std::vector<Bytes>& outgoing, std::span<const int> partners,
                     std::span<const std::size_t> /*sizes*/, std::span<double> most) {
    arrived_ = swap(std::move(outgoing), partners);
    outgoing.clear();
    combine(most, {});
  }
  virtual const std::vector<Bytes>& complete() { return arrived_; }
  /// The time for which this rank has waited for others [s].
  virtual double seconds_waited() const { return 0; }
  void largest(std::span<double> values) { combine(values, {}); }
  void sum(std::span<std::uint64_t> values) { combine({}, values); }

 private:
  std::vector<Bytes> arrived_;
};

/// The messages of all ranks, by rank, on rank 0; empty messages on other ranks. Collective.
inline std::vector<Bytes> gather_on_first(Communicator& ranks, Bytes mine) {
  std::vector<Bytes> outgoing(static_cast<std::size_t>(ranks.size()));
  outgoing[0] = std::move(mine);
  return ranks.swap(std::move(outgoing));
}

/// Passes a value from rank to rank, each of which calls add(value): the result is that of one rank doing all.
template <class Value, class Add>
Value accumulated_in_order(Communicator& ranks, Value value, Add&& add) {
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

/// Messages to ranks that consist of records of `size` bytes. for_each(send) calls send(rank, write) for each record,
/// and write(message) appends it. for_each() is called twice, first to count the records: messages that grow would be
/// copied several times.
template <class ForEach>
std::vector<Bytes> messages_of_records(std::size_t ranks, std::size_t size, ForEach&& for_each) {
  std::vector<std::size_t> records(ranks);
  for_each([&](std::size_t rank, auto&&) { ++records[rank]; });
  std::vector<Bytes> messages(ranks);
  for (std::size_t r = 0; r < ranks; ++r) messages[r].reserve(records[r] * size);
  for_each([&](std::size_t rank, auto&& write) { write(messages[rank]); });
  return messages;
}

/// Values as a message.
template <class Value>
Bytes message_of(std::span<const Value> values) {
  const auto bytes = std::as_bytes(values);
  return {bytes.begin(), bytes.end()};
}

/// The values in messages, which are freed one after the other.
template <class Value>
std::vector<Value> values_in(std::vector<Bytes> messages) {
  std::size_t size = 0;
  for (const Bytes& bytes : messages) size += bytes.size();
  std::vector<Value> all;
  all.reserve(size / sizeof(Value));
  for (Bytes& bytes : messages) {
    for (Reader reader(bytes); reader.more();) all.push_back(reader.get<Value>());
    Bytes().swap(bytes);
  }
  return all;
}

/// The values of all ranks, in the order of ranks. Collective.
template <class Value>
std::vector<Value> gather_values(Communicator& ranks, std::span<const Value> mine) {
  return values_in<Value>(ranks.gather(message_of(mine)));
}

/// The sum over all ranks of an object with a member add().
template <class Sums>
Sums sum_of_all(Communicator& ranks, Sums mine) {
  Archive out;
  out(mine);
  Sums all;
  for (const Bytes& each : ranks.gather(out.bytes())) {
    Archive in(each);
    in(mine);
    all.add(mine);
  }
  return all;
}

}  // namespace carom
