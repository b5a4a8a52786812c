// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Ranks as threads of one process, for tests.

#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "engine/base/error.h"
#include "engine/ranks/communicator.h"

namespace carom::test {

class ThreadRanks {
 public:
  explicit ThreadRanks(int size)
      : messages_(static_cast<std::size_t>(size)), failures_(static_cast<std::size_t>(size)) {}

  /// Calls this on all ranks. If it throws on any rank, all ranks end, and the first rank's exception is thrown.
  void run(const std::function<void(Communicator&)>& work) {
    std::vector<std::thread> threads;
    for (std::size_t rank = 0; rank < messages_.size(); ++rank)
      threads.emplace_back([&, rank] {
        Rank exchange(*this, rank);
        try {
          work(exchange);
        } catch (...) {
          failures_[rank] = std::current_exception();
          give_up();
        }
      });
    for (auto& thread : threads) thread.join();
    if (first_failed_ < failures_.size()) std::rethrow_exception(failures_[first_failed_]);
  }

 private:
  class Rank final : public Communicator {
   public:
    Rank(ThreadRanks& team, std::size_t rank) : team_(team), rank_(rank) {}
    int rank() const override { return static_cast<int>(rank_); }
    int size() const override { return static_cast<int>(team_.messages_.size()); }
    std::vector<Bytes> swap(std::vector<Bytes> outgoing) override {
      team_.messages_[rank_] = std::move(outgoing);
      team_.meet(rank_);
      std::vector<Bytes> incoming;
      for (auto& from : team_.messages_) incoming.push_back(from[rank_]);
      team_.meet(rank_);
      return incoming;
    }
    std::vector<Bytes> swap(std::vector<Bytes> outgoing, std::span<const int> partners) override {
      std::vector<Bytes> to(team_.messages_.size()), incoming;
      for (std::size_t k = 0; k < partners.size(); ++k)
        to[static_cast<std::size_t>(partners[k])] = std::move(outgoing[k]);
      std::vector<Bytes> from = swap(std::move(to));
      for (const int partner : partners) incoming.push_back(std::move(from[static_cast<std::size_t>(partner)]));
      return incoming;
    }
    std::vector<Bytes> gather(const Bytes& mine) override {
      return swap(std::vector<Bytes>(team_.messages_.size(), mine));
    }
    void combine(std::span<double> most, std::span<std::uint64_t> sums) override {
      Bytes mine;
      for (const double value : most) put(mine, value);
      for (const std::uint64_t value : sums) put(mine, value);
      bool first = true;
      for (const Bytes& bytes : gather(mine)) {
        Reader reader(bytes);
        for (double& value : most) {
          const auto theirs = reader.get<double>();
          value = first ? theirs : std::max(value, theirs);
        }
        for (std::uint64_t& value : sums) value = reader.get<std::uint64_t>() + (first ? 0 : value);
        first = false;
      }
    }

   private:
    ThreadRanks& team_;
    std::size_t rank_;
  };

  void meet(std::size_t rank) {
    std::unique_lock lock(mutex_);
    const std::uint64_t round = round_;
    if (++waiting_ == messages_.size()) {
      waiting_ = 0;
      ++round_;
      all_there_.notify_all();
    }
    all_there_.wait(lock, [&] { return round_ != round || first_failed_ < messages_.size(); });
    if (round_ == round) throw Error(Failure::numerical, "rank " + std::to_string(rank) + " was left alone");
  }
  void give_up() {
    const std::lock_guard lock(mutex_);
    for (std::size_t rank = 0; rank < failures_.size() && first_failed_ == kNoRank; ++rank)
      if (failures_[rank]) first_failed_ = rank;
    all_there_.notify_all();
  }

  static constexpr std::size_t kNoRank = ~std::size_t{0};

  std::vector<std::vector<Bytes>> messages_;
  std::mutex mutex_;
  std::condition_variable all_there_;
  std::size_t waiting_ = 0, first_failed_ = kNoRank;
  std::uint64_t round_ = 0;
  std::vector<std::exception_ptr> failures_;
};

}  // namespace carom::test
