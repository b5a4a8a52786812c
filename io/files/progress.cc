// SPDX-License-Identifier: BSD-3-Clause
#include "io/files/progress.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

namespace carom {

void RecentRates::add(double wall, double fraction_done, std::uint64_t collisions) {
  points_.push_back({wall, fraction_done, collisions});
  while (points_.size() > 2 && points_[1].wall <= wall - window_) points_.pop_front();
}

std::optional<double> RecentRates::seconds_left() const {
  if (points_.empty()) return std::nullopt;
  const Point &first = points_.front(), &last = points_.back();
  if (last.fraction <= first.fraction) return std::nullopt;
  return (1 - last.fraction) * (last.wall - first.wall) / (last.fraction - first.fraction);
}

double RecentRates::collisions_per_second() const {
  if (points_.empty()) return 0;
  const Point &first = points_.front(), &last = points_.back();
  if (last.wall <= first.wall) return 0;
  return static_cast<double>(last.collisions - first.collisions) / (last.wall - first.wall);
}

std::string clock_text(double seconds) {
  const auto whole = static_cast<long long>(std::ceil(seconds));
  return fmt::format("{:02}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
}

std::string progress_text(const Statistics& s, const RecentRates& rates) {
  const double scale = s.energy_reference > 0 ? s.energy_reference : 1;
  const auto left = rates.seconds_left();
  return fmt::format("t = {:.6g}  {:5.1f} %  {:.2e} collisions/s  |ΔE/E| = {:.1e}  ETA {}", s.end_time,
                     100 * s.fraction_done, rates.collisions_per_second(), s.max_energy_error / scale,
                     left ? clock_text(*left) : "--:--:--");
}

template <int D>
void Progress<D>::progress(const Statistics& s) {
  constexpr double kTerminal = 0.2, kFirstPlain = 10, kRarestPlain = 600;  // seconds between lines
  const double wall = std::chrono::duration<double>(Clock::now() - start_).count();
  if (next_ == 0) {  // the first slab: rates are known from here on
    rates_.add(wall, s.fraction_done, s.counters.sphere_sphere);
    next_ = wall + (terminal_ ? kTerminal : kFirstPlain);
  }
  if (wall < next_) return;
  rates_.add(wall, s.fraction_done, s.counters.sphere_sphere);
  next_ = wall + (terminal_ ? kTerminal : std::clamp(wall / 4, kFirstPlain, kRarestPlain));
  const std::string text = progress_text(s, rates_);
  std::fputs((terminal_ ? "\r" + text + "\x1b[K" : text + "\n").c_str(), out_);
  std::fflush(out_);
  line_open_ = terminal_;
}

template <int D>
void Progress<D>::end_line() {
  if (!line_open_) return;
  std::fputs("\n", out_);
  std::fflush(out_);
  line_open_ = false;
}

template class Progress<2>;
template class Progress<3>;

}  // namespace carom
