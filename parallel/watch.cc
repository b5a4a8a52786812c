// SPDX-License-Identifier: BSD-3-Clause
#include "parallel/watch.h"

#include <sched.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <limits>
#include <thread>

#include "engine/laws/counters.h"

namespace carom {

namespace {

constexpr int kSpins = 200;           // polls before the timer and the notices are checked
constexpr double kShortPause = 1e-3;  // seconds, while other ranks work
constexpr double kLongPause = 50e-3;  // seconds, when this rank has finished
constexpr double kQueryAgain = 0.1;   // seconds between queries to ranks that have not ended
constexpr double kTimeToAnswer = 2;   // seconds
constexpr double kMaxPollGap = 1;     // seconds between two polls; longer gaps mean that the process was not running

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

void say(const std::string& message) {
  std::fprintf(stderr, "%s\n", message.c_str());
  std::fflush(stderr);
}

void flush_all() {
  std::cout.flush();
  std::fflush(nullptr);
}

}  // namespace

double WaitTimer::waited() {
  const double time = now();
  if (last_ >= 0) waited_ += std::min(time - last_, kMaxPollGap);
  last_ = time;
  return waited_;
}

void WaitTimer::pause(double longest) const {
  const double seconds = std::min(waited_ / 100, longest);
  if (seconds < 1e-5)
    sched_yield();
  else
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

Watch::Watch(MPI_Comm world, double silence) : silence_(silence) {
  MPI_Comm_dup(world, &side_);
  MPI_Comm_rank(side_, &rank_);
  MPI_Comm_size(side_, &size_);
  states_.resize(static_cast<std::size_t>(size_));
  receive_next();
}

Watch::~Watch() {
  MPI_Cancel(&receive_);
  MPI_Wait(&receive_, MPI_STATUS_IGNORE);
  for (Sent& sent : sent_) MPI_Wait(&sent.request, MPI_STATUS_IGNORE);
  MPI_Comm_free(&side_);
}

// ---- Notices ----

void Watch::receive_next() { MPI_Irecv(&incoming_, sizeof incoming_, MPI_BYTE, MPI_ANY_SOURCE, 0, side_, &receive_); }

void Watch::send(int to, Kind kind, const Outcome& outcome) {
  sent_.remove_if([](Sent& sent) {
    int done = 0;
    MPI_Test(&sent.request, &done, MPI_STATUS_IGNORE);
    return done != 0;
  });
  Sent& sent = sent_.emplace_back(Sent{{kind, outcome.code, calls_}});
  const std::size_t length = std::min(outcome.failure.size(), sent.notice.failure.size() - 1);
  std::copy_n(outcome.failure.begin(), length, sent.notice.failure.begin());
  MPI_Isend(&sent.notice, static_cast<int>(offsetof(Notice, failure) + length + 1), MPI_BYTE, to, 0, side_,
            &sent.request);
}

void Watch::receive_notices() {
  for (;;) {
    int arrived = 0;
    MPI_Status status;
    MPI_Test(&receive_, &arrived, &status);
    if (arrived == 0) return;
    const Notice notice = incoming_;
    receive_next();
    process(status.MPI_SOURCE, notice);
  }
}

void Watch::process(int from, const Notice& notice) {
  State& state = states_[static_cast<std::size_t>(from)];
  state.calls = notice.calls;
  switch (notice.kind) {
    case Kind::question:
      send(from, Kind::answer);
      break;
    case Kind::answer:
      state.answered = true;
      break;
    case Kind::ended:
      state.outcome = Outcome{notice.code, notice.failure.data()};
      if (!failed_ && !state.outcome->failure.empty()) failed_ = from;
      break;
    case Kind::verdict:
      verdict_ = notice.code;
      break;
  }
}

/// Sends a question to all ranks that have not ended.
void Watch::query_ranks() {
  for (int r = 0; r < size_; ++r)
    if (r != rank_ && !states_[static_cast<std::size_t>(r)].outcome) send(r, Kind::question);
}

// ---- Waiting ----

void Watch::wait(std::span<MPI_Request> requests) {
  const Stopwatch watch(seconds_waited_);
  const auto complete = [&] {
    int done = 0;
    MPI_Testall(static_cast<int>(requests.size()), requests.data(), &done, MPI_STATUSES_IGNORE);
    return done != 0;
  };
  for (int i = 0; i < kSpins; ++i)
    if (complete()) return;
  WaitTimer timer, since_failure;
  while (!complete()) {
    receive_notices();
    if (failed_) {
      // A rank that failed after this call still completes it.
      const State& state = states_[static_cast<std::size_t>(*failed_)];
      if (state.calls < calls_ || since_failure.waited() > kGrace)
        throw RankFailure(names({&*failed_, 1}) + ": " + state.outcome->failure);
    }
    if (const double waited = timer.waited(); silence_ > 0 && waited > silence_) {
      if (const std::string silence = silence_of(complete); !silence.empty()) throw SilentRanks(silence);
      return;
    }
    timer.pause(kShortPause);
  }
}

/// Names the silent ranks; empty if is_over() becomes true, as the missing answers may arrive meanwhile.
std::string Watch::silence_of(const std::function<bool()>& is_over) {
  for (State& state : states_) state.answered = false;
  query_ranks();
  std::vector<int> silent;
  for (WaitTimer timer; timer.waited() < kTimeToAnswer; timer.pause(kShortPause)) {
    if (is_over()) return {};
    receive_notices();
    silent.clear();
    for (int r = 0; r < size_; ++r)
      if (const State& state = states_[static_cast<std::size_t>(r)]; r != rank_ && !state.answered && !state.outcome)
        silent.push_back(r);
  }
  char seconds[32];
  std::snprintf(seconds, sizeof seconds, "%g", silence_);
  if (silent.empty())
    return "all ranks have waited for each other for " + std::string(seconds) + " s: a fault of the program";
  return "no answer from " + names(silent) + " for " + seconds +
         " s: stopped, cut off or still at work; --silence allows longer waits";
}

// ---- Ending ----

int Watch::finish(const Outcome& mine, bool alone) {
  // Output is flushed first: when another rank ends with an error, mpirun ends the rest.
  flush_all();
  return rank_ == 0 ? finish_first(mine, alone) : finish_other(mine, alone);
}

int Watch::finish_first(const Outcome& mine, bool alone) {
  const auto end = [this](const Outcome& outcome) {
    states_[0] = {.calls = calls_, .outcome = outcome};
    if (!failed_ && !outcome.failure.empty()) failed_ = 0;
  };
  end(mine);
  WaitTimer timer, since_failure;
  double query_next = 0;
  const auto all_ended = [&] {
    return std::all_of(states_.begin(), states_.end(), [](const State& state) { return state.outcome.has_value(); });
  };
  for (State& state : states_) state.answered = false;
  for (receive_notices(); !all_ended() && !mine.left; receive_notices()) {
    if (failed_) {
      const double waited = since_failure.waited();
      if (some_wait_never_ends() || waited > kGrace) break;
      if (waited >= query_next) {
        query_ranks();
        query_next = waited + kQueryAgain;
      }
    } else if (silence_ > 0 && timer.waited() > silence_) {
      const std::string silence = silence_of(all_ended);
      if (silence.empty()) continue;
      end({kFault, silence});
      break;
    }
    timer.waited();
    timer.pause(kLongPause);
  }

  const int code = states_[static_cast<std::size_t>(failed_.value_or(0))].outcome->code;
  if (!all_ended() || mine.left) abort(code, account(alone));
  if (failed_) say(account(alone));
  for (State& state : states_) state = {};
  failed_.reset();
  for (int r = 1; r < size_; ++r) send(r, Kind::verdict, {code});
  return code;
}

int Watch::finish_other(const Outcome& mine, bool alone) {
  verdict_.reset();
  send(0, Kind::ended, mine);
  WaitTimer timer;
  for (receive_notices(); !verdict_; receive_notices()) {
    const double waited = timer.waited();
    if (!mine.failure.empty()) {
      if (waited > 2 * kGrace) abort(mine.code, "carom: " + names({&rank_, 1}) + ": " + mine.failure);
    } else if (!alone && silence_ > 0 && waited > silence_) {
      const std::string silence = silence_of([&] { return verdict_.has_value(); });
      if (!silence.empty()) abort(kFault, "carom: " + names({&rank_, 1}) + ": " + silence);
    }
    timer.pause(kLongPause);
  }
  return *verdict_;
}

/// Whether a rank waits in a call that a failed rank has not made.
bool Watch::some_wait_never_ends() const {
  auto last_call = std::numeric_limits<std::uint64_t>::max();
  for (const State& state : states_)
    if (state.outcome && !state.outcome->failure.empty()) last_call = std::min(last_call, state.calls);
  return std::any_of(states_.begin(), states_.end(),
                     [&](const State& state) { return !state.outcome && state.answered && state.calls > last_call; });
}

/// The failures, one line each; ranks with the same failure share a line.
std::string Watch::account(bool alone) const {
  const auto beginning = [](const std::string& text) {
    return text.substr(0, std::tuple_size_v<decltype(Notice::failure)> - 1);
  };
  std::string text;
  std::vector<bool> done(states_.size());
  for (std::size_t r = 0; r < states_.size(); ++r) {
    const auto& outcome = states_[r].outcome;
    if (done[r] || !outcome || outcome->failure.empty()) continue;
    std::vector<int> alike;
    for (std::size_t s = r; s < states_.size(); ++s)
      if (const auto& other = states_[s].outcome; other && beginning(other->failure) == beginning(outcome->failure)) {
        alike.push_back(static_cast<int>(s));
        done[s] = true;
      }
    if (!text.empty()) text += "\n";
    if (!alone && static_cast<int>(alike.size()) < size_) text += "carom: " + names(alike) + ": ";
    text += outcome->failure;
  }
  return text;
}

/// "rank 1 of 4", "ranks 1, 3 of 4"
std::string Watch::names(std::span<const int> ranks) const {
  std::string text = ranks.size() == 1 ? "rank" : "ranks";
  for (std::size_t k = 0; k < ranks.size(); ++k) text += (k > 0 ? ", " : " ") + std::to_string(ranks[k]);
  return text + " of " + std::to_string(size_);
}

void Watch::abort(int code, const std::string& message) const {
  say(message);
  flush_all();
  MPI_Abort(side_, code);
  std::abort();  // MPI_Abort does not return; the compiler cannot know
}

}  // namespace carom
