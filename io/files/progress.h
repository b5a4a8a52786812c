// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The progress of a run: one line that is updated in place on a terminal, occasional plain lines elsewhere.

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <optional>
#include <string>

#include "engine/run/simulation.h"

namespace carom {

/// Rates over a recent window of wall time, so that the estimate follows a run that speeds up or slows down.
class RecentRates {
 public:
  explicit RecentRates(double window_seconds = 30) : window_(window_seconds) {}

  /// The state of the run after `wall` seconds; called with growing times.
  void add(double wall, double fraction_done, std::uint64_t collisions);
  /// Wall seconds until the end; nullopt while unknown.
  std::optional<double> seconds_left() const;
  double collisions_per_second() const;

 private:
  struct Point {
    double wall, fraction;
    std::uint64_t collisions;
  };
  double window_;
  std::deque<Point> points_;
};

/// For instance "t = 12.5  25.0 %  1.2e+05 collisions/s  |ΔE/E| = 1.1e-15  ETA 00:01:30".
std::string progress_text(const Statistics& statistics, const RecentRates& rates);

/// hh:mm:ss
std::string clock_text(double seconds);

/// Shows progress on a stream. Write errors of the stream do not disturb the run; check the stream at the end.
template <int D>
class Progress : public Observer<D> {
 public:
  Progress(std::FILE* out, bool terminal) : out_(out), terminal_(terminal) {}
  ~Progress() override { end_line(); }

  void progress(const Statistics& statistics) override;
  /// Ends the line on the terminal, before something else is printed.
  void end_line();

 private:
  using Clock = std::chrono::steady_clock;
  std::FILE* out_;
  bool terminal_;
  bool line_open_ = false;
  RecentRates rates_;
  Clock::time_point start_ = Clock::now();
  double next_ = 0;  // wall seconds of the next line
};

}  // namespace carom
