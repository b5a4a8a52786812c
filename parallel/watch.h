// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// How ranks wait for each other, and how they end together when one of them cannot go on.
//
// A rank that waits polls for notices of other ranks meanwhile. A rank that fails sends a notice to rank 0, which
// queries the others. Where one of them waits in a call that the failed rank will never make, the failure is not common
// to all: rank 0 leaves its work (RankFailure), closes its files, names the rank and ends all. Where all have failed
// alike (a bad deck, a step that cannot be done) it is reported once, and all return its exit code. A rank that does
// not answer within kGrace, because it computes or is stopped, is not waited for.
//
// Where a wait lasts longer than the silence allowed, the rank that waits queries the others; those that do not answer
// are the silent ones. Time in which the process itself does not run does not count: a job may be suspended as a whole.

#include <mpi.h>

#include <array>
#include <cstdint>
#include <functional>
#include <list>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace carom {

/// Another rank has failed; the message names it.
class RankFailure : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The ranks that the message names do not answer.
class SilentRanks : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Exit code of a fault that is not the deck's: of the program, of its memory, of a rank that is lost.
constexpr int kFault = 70;

/// How the work of a rank has ended.
struct Outcome {
  int code = 0;
  std::string failure{};  ///< why it failed; empty: it has not
  bool left = false;      ///< it left a call in which it waited for others
};

/// The length of a wait [seconds], as far as this process was running meanwhile.
class Patience {
 public:
  /// To be called again and again; the length so far.
  double waited();
  /// Lets others run: for a hundredth of the wait so far, at most `longest`.
  void rest(double longest) const;

 private:
  double last_ = -1, waited_ = 0;
};

class Watch {
 public:
  static constexpr double kGrace = 5;  ///< seconds

  /// Collective. `silence`: seconds after which ranks that do not answer are given up; 0: never.
  Watch(MPI_Comm world, double silence);
  ~Watch();
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  /// To be called at the beginning of each collective call of the work, so that ranks can compare how far they are.
  void begin_call() { ++calls_; }

  /// Waits until all are complete. Throws RankFailure where another rank will never come, and SilentRanks.
  void wait(std::span<MPI_Request> requests);

  /// Collective: ends a piece of work together. Returns the exit code of the first rank that failed, or of rank 0. Does
  /// not return (MPI_Abort) where some cannot be reached any more. `alone`: rank 0 works, for any time.
  int settle(const Outcome& mine, bool alone);

 private:
  enum class Kind : int { question, answer, ended, verdict };
  struct Notice {
    Kind kind;
    int code;
    std::uint64_t calls;               ///< that the sender has begun
    std::array<char, 2000> failure{};  ///< its beginning
  };
  struct Sent {
    Notice notice;
    MPI_Request request = MPI_REQUEST_NULL;
  };
  /// What is known of a rank.
  struct State {
    std::uint64_t calls = 0;
    bool answered = false;
    std::optional<Outcome> outcome{};
  };

  void receive_next();
  void receive_notices();
  void process(int from, const Notice& notice);
  void send(int to, Kind kind, const Outcome& outcome = {});
  void query_ranks();
  bool some_wait_never_ends() const;
  std::string silence_of(const std::function<bool()>& is_over);
  int settle_first(const Outcome& mine, bool alone);
  int settle_other(const Outcome& mine, bool alone);
  std::string account(bool alone) const;
  std::string names(std::span<const int> ranks) const;
  [[noreturn]] void abort(int code, const std::string& message) const;

  MPI_Comm side_ = MPI_COMM_NULL;
  int rank_ = 0, size_ = 1;
  double silence_;
  std::uint64_t calls_ = 0;
  std::vector<State> states_;   ///< by rank; outcomes are sent to rank 0 only
  std::optional<int> failed_;   ///< the rank with the first notice of a failure
  std::optional<int> verdict_;  ///< of rank 0
  Notice incoming_{};
  MPI_Request receive_ = MPI_REQUEST_NULL;
  std::list<Sent> sent_;
};

}  // namespace carom
