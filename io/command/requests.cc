// SPDX-License-Identifier: BSD-3-Clause
#include "io/command/requests.h"

#include <algorithm>
#include <array>
#include <csignal>

namespace carom {
namespace {

volatile std::sig_atomic_t stop_signal = 0, keep_signal = 0;

extern "C" void note_signal(int number) {
  if (number == SIGUSR1) {
    keep_signal = 1;
    return;
  }
  stop_signal = number;
  if (number == SIGINT) std::signal(SIGINT, SIG_DFL);
}

constexpr double kTimeBetweenLooks = 0.01;  // [s]
constexpr double kMostCalls = 1e4;          // between looks

}  // namespace

Requests::Requests(std::optional<double> most) : most_(most) {
  for (const int number : {SIGTERM, SIGINT, SIGHUP, SIGUSR1, SIGUSR2}) {
    struct sigaction action {};
    action.sa_handler = note_signal;
    action.sa_flags = SA_RESTART;
    sigemptyset(&action.sa_mask);
    struct sigaction before {};
    sigaction(number, nullptr, &before);
    if (before.sa_handler != SIG_IGN) sigaction(number, &action, nullptr);  // keeps the effect of nohup
  }
}

Requests::Asked Requests::now(Communicator& ranks) {
  const bool first = ranks.rank() == 0;
  const bool due = first && interval_ && seconds_since(last_checkpoint_) >= *interval_;
  const double calls = static_cast<double>(std::max(calls_, std::uint64_t{1})), elapsed = seconds_since(last_look_);
  std::array<double, 3> asked = {stop_here(ranks) ? 1.0 : 0.0, keep_signal != 0 || due ? 1.0 : 0.0,
                                 first ? std::clamp(calls * kTimeBetweenLooks / elapsed, 1.0, kMostCalls) : 0.0};
  ranks.largest(asked);
  between_ = static_cast<std::uint64_t>(asked[2]);
  calls_ = 0;
  last_look_ = Clock::now();
  return {asked[0] + asked[1] > 0, asked[0] > 0};
}

Requests::Asked Requests::now_and_then(Communicator& ranks, std::uint64_t most) {
  if (++calls_ >= std::min(between_, most)) return now(ranks);
  return {};
}

bool Requests::stop_here(const Communicator& ranks) const {
  return stop_signal != 0 || (ranks.rank() == 0 && most_ && seconds_since(start_) >= *most_);
}

bool Requests::stops_this_rank() const { return stop_signal != 0 || (most_ && seconds_since(start_) >= *most_); }

void Requests::checkpoint_is_written() {
  keep_signal = 0;
  last_checkpoint_ = Clock::now();
}

std::string Requests::reason() const {
  return stop_signal == 0 ? "--max-wall" : std::string("SIG").append(sigabbrev_np(stop_signal));
}

}  // namespace carom
