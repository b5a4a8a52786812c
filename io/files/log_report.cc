// SPDX-License-Identifier: BSD-3-Clause
#include "io/files/log_report.h"

#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "io/deck/deck_source.h"
#include "io/files/directory_lock.h"
#include "io/files/progress.h"
#include "io/files/thermo.h"
#include "io/files/version.h"

namespace carom {

namespace {

std::string ends_at(const Plan& plan) {
  std::string text;
  auto add = [&](const std::string& end) { text += (text.empty() ? "" : " or ") + end; };
  if (plan.steps) add(fmt::format("{} steps", *plan.steps));
  if (plan.end_time) add(fmt::format("time {:g}", *plan.end_time));
  if (plan.collisions) add(fmt::format("{} pair collisions", *plan.collisions));
  return text;
}

/// The parts of a rank's time, as named below; the last two are what is left and the whole.
std::array<double, 9> parts_of(const RankAccount& rank) {
  const Counters::Seconds& t = rank.seconds;
  std::array<double, 9> parts = {t.predict, t.queue, t.collide, t.force, t.sweep, t.communicate, t.output};
  parts[7] = std::max(0.0, rank.wall_seconds - std::accumulate(parts.begin(), parts.begin() + 7, 0.0));
  parts[8] = rank.wall_seconds;
  return parts;
}

/// Percentages refer to the mean.
std::string breakdown_text(std::span<const RankAccount> ranks) {
  constexpr std::array names = {"predict",     "queue",  "collide", "force", "sweep",
                                "communicate", "output", "other",   "total"};
  std::vector<std::array<double, 9>> parts;
  std::array<double, 9> mean{};
  for (const RankAccount& rank : ranks) {
    parts.push_back(parts_of(rank));
    for (std::size_t k = 0; k < mean.size(); ++k) mean[k] += parts.back()[k] / static_cast<double>(ranks.size());
  }
  std::string text = ranks.size() == 1
                         ? fmt::format("{:<12}{:>12}{:>9}", "part", "seconds", "share")
                         : fmt::format("{:<12}{:>12}{:>12}{:>12}{:>9}", "part", "least", "mean", "most", "share");
  for (std::size_t k = 0; k < mean.size(); ++k) {
    const auto less = [k](const auto& a, const auto& b) { return a[k] < b[k]; };
    const auto [least, most] = std::minmax_element(parts.begin(), parts.end(), less);
    text += fmt::format("\n{:<12}", names[k]);
    if (ranks.size() > 1) text += fmt::format("{:>12.3f}", (*least)[k]);
    text += fmt::format("{:>12.3f}", mean[k]);
    if (ranks.size() > 1) text += fmt::format("{:>12.3f}", (*most)[k]);
    if (k + 1 < mean.size()) text += fmt::format("{:>8.1f}%", 100 * mean[k] / std::max(mean.back(), 1e-9));
  }
  return text;
}

/// The cost of agreement between subdomains; empty for one rank.
std::string windows_text(std::span<const RankAccount> ranks) {
  WindowCounts all;
  std::uint64_t most = 0;
  for (const RankAccount& rank : ranks) {
    all.windows = rank.windows.windows;  // equal on all ranks, like the number of rounds
    all.rounds = rank.windows.rounds;
    all.events += rank.windows.events;
    all.run_events += rank.windows.run_events;
    all.redone_events += rank.windows.redone_events;
    most = std::max(most, rank.windows.events);
  }
  if (all.windows == 0) return "";
  const double events = std::max(static_cast<double>(all.events), 1.0);
  return fmt::format(
      "\n{} windows, {:.2f} rounds each; events at borders run twice {:.1f}%, redone {:.2f}%, imbalance {:.1f}%",
      all.windows, static_cast<double>(all.rounds) / static_cast<double>(all.windows),
      100 * (static_cast<double>(all.run_events) / events - 1), 100 * static_cast<double>(all.redone_events) / events,
      100 * (static_cast<double>(most) * static_cast<double>(ranks.size()) / events - 1));
}

std::string memory_text(std::span<const RankAccount> ranks) {
  constexpr double kMegabyte = 1e6;
  double least = std::numeric_limits<double>::infinity(), sum = 0, most = 0;
  for (const RankAccount& rank : ranks) {
    const double megabytes = static_cast<double>(rank.peak_memory_bytes) / kMegabyte;
    least = std::min(least, megabytes);
    most = std::max(most, megabytes);
    sum += megabytes;
  }
  if (ranks.size() == 1) return fmt::format("\nmemory at the peak {:.0f} MB", most);
  return fmt::format("\nmemory of a rank at the peak {:.0f} to {:.0f} MB, {:.0f} on average", least, most,
                     sum / static_cast<double>(ranks.size()));
}

/// The means that have no standard error, and the length of a run that may have one; empty if all have.
std::string missing_errors_text(const Statistics& s) {
  std::string names;
  double longest = 0;
  for (std::size_t k = 0; k < Statistics::mean_names.size(); ++k) {
    const double needed = s.needed_time(s.estimate(k));
    if (!std::isfinite(needed)) continue;
    names.append(names.empty() ? "" : ", ").append(Statistics::mean_names[k]);
    longest = std::max(longest, needed);
  }
  if (names.empty()) return "";
  return fmt::format(
      "\nno standard error of: {}; at the correlations seen so far a run to time {:.3g} at least may have all", names,
      longest);
}

}  // namespace

std::string steps_text(const Plan& plan) {
  return plan.accuracy > 0 ? fmt::format("steps of its own for an accuracy of {:g}", plan.accuracy)
                           : fmt::format("step {:g}", plan.step);
}

std::string banner_text(const Deck& deck, std::size_t particles, int ranks) {
  return fmt::format(
      "carom {}\n"
      "built with {}\n"
      "{}\n"
      "host {}, process {}, {}\n"
      "deck {}{}\n"
      "{} particles in {}-D, integrator {}, {}, until {}\n"
      "output in {}",
      version_string(), compiler_string(), library_versions(), host_name(), getpid(),
      ranks == 1 ? "1 rank" : fmt::format("{} ranks", ranks), deck.file.string(),
      deck.title.empty() ? "" : ": " + deck.title, particles, deck.dimension, deck.integrator, steps_text(deck.plan),
      ends_at(deck.plan), deck.output.directory.string());
}

std::optional<std::string> energy_warning(const Statistics& s, const IntegratorInfo& method) {
  // Errors count from the end of the first step, which may itself have the large error.
  const auto share = [](double error, double of) { return of > 0 ? error / of : 0; };
  // A flow may do far more work than the energy at the start.
  const double reference = std::max(s.energy_reference, std::abs(s.counters.shear.value()));
  const double later = share(s.max_energy_error, reference), first = share(s.first_step_error, s.energy_scale);
  constexpr double kExactErrorBound = 1e-12;  // the bound of the exact methods, relative to the reference energy
  if (std::max(first, later) <= 1) {
    if (!method.exact || std::max(first, later) <= kExactErrorBound) return {};
    return fmt::format(
        "warning: rounding has added up to {:.2g} of the reference energy, though {} is exact but for rounding: "
        "forces, "
        "speeds or masses differ by many orders of magnitude, or the run is very long",
        std::max(first, later), method.name);
  }
  return fmt::format(
      "warning: the energy was wrong by {:.2g} times its own size{}: what the run shows is no motion of this system; "
      "use a smaller integrator.step",
      std::max(first, later), first > later ? " after the first step" : "");
}

template <int D>
std::optional<std::string> overlap_warning(const Statistics& s, const Box<D>& box) {
  if (!s.overlap) return {};
  return fmt::format(
      "warning: {}, at time {:g}, which is more than rounding; take another integrator.step or integrator.type",
      overlap_text(*s.overlap, box), s.overlap->time);
}

std::optional<std::string> accuracy_warning(const Statistics& s, const IntegratorInfo& method) {
  constexpr double kLargestError = 1e-2;
  if (!method.adapts || !(s.local_error > kLargestError)) return {};
  return fmt::format(
      "warning: the steps are long: about time {:g}, one of them left the position of particle {} wrong by {:.2g} of "
      "its "
      "diameter, which the exact energy does not show; use a smaller integrator.step or accuracy, or leave both out",
      s.local_error_time, s.local_error_id, s.local_error);
}

template <int D>
std::vector<std::string> warnings_about(const Statistics& s, const IntegratorInfo& method, const Box<D>& box) {
  std::vector<std::string> all;
  for (auto& warning : {overlap_warning(s, box), energy_warning(s, method), accuracy_warning(s, method)})
    if (warning) all.push_back(*warning);
  return all;
}
template std::vector<std::string> warnings_about(const Statistics&, const IntegratorInfo&, const Box<2>&);
template std::vector<std::string> warnings_about(const Statistics&, const IntegratorInfo&, const Box<3>&);

template <int D>
std::vector<std::string> warnings_about(const Deck& deck, const Statistics& s, const Box<D>& box) {
  std::vector<std::string> all = warnings_about(s, find_integrator(deck.integrator), box);
  if (deck.plan.from_equilibrium && !s.equilibrium)
    all.emplace_back(
        "warning: the initial transient has not ended, so nothing was sampled, and the means of the summary are of the "
        "whole run; let it run longer, or give a shorter thermo_interval (100 rows at least)");
  return all;
}

std::string report_text(const Deck& deck, const Statistics& s, std::span<const RankAccount> ranks) {
  const Counters& c = s.counters;
  const double scale = s.energy_reference > 0 ? s.energy_reference : 1;
  std::string text = fmt::format(
      "{} at time {:g} after {} steps: {} pair and {} wall collisions in {}, {:.3g} pair collisions/s\n"
      "energy {:.10g}, largest error {:.2e} (relative {:.2e})",
      s.stopped_early ? "stopped" : "done", s.end_time, s.steps, c.sphere_sphere, c.sphere_wall,
      clock_text(s.wall_seconds), s.wall_seconds > 0 ? static_cast<double>(c.sphere_sphere) / s.wall_seconds : 0.0,
      s.energy_final, s.max_energy_error, s.max_energy_error / scale);
  if (c.dissipated.value() != 0 || c.work.value() != 0 || c.heat.value() != 0)
    text += fmt::format("\ndissipated {:.10g}, work {:.10g}, heat {:.10g}", c.dissipated.value(), c.work.value(),
                        c.heat.value());
  if (s.max_shadow_energy_error)
    text += fmt::format("\nshadow energy, largest error {:.2e}", *s.max_shadow_energy_error);
  if (s.max_momentum_error) text += fmt::format("\nmomentum, largest error {:.2e}", *s.max_momentum_error);
  text += fmt::format(
      "\nmean pressure {:.6g}{}, collision rate of a sphere {:.6g}, deepest overlap {:.1e}", s.mean_pressure,
      deck.source && deck.source->placement.lattice() && s.start_steps == 0 ? ", from the initial lattice on" : "",
      s.collision_rate, c.max_overlap);
  if (s.mean_free_time)
    text += fmt::format("\nmean free time {:.6g}, mean free path {:.6g}", *s.mean_free_time, *s.mean_free_path);
  text += missing_errors_text(s);
  if (deck.plan.accuracy > 0 && s.longest_step > 0)
    text += fmt::format("\nsteps from {:.3g} to {:.3g} long, {} repeated with shorter ones", s.shortest_step,
                        s.longest_step, c.steps_rejected);
  if (s.force_passes > 0)
    text += fmt::format("\n{:.6g} force passes, {} sweeps, {} steps halved, {} fallbacks", s.force_passes, c.sweeps,
                        c.slabs_halved, c.fallbacks);
  if (c.divisions > 0)
    text += fmt::format(
        "\nparticles divided among {} ranks {} times, {} steps redone with more ghosts, {} of them with all particles",
        ranks.size(), c.divisions, c.slabs_again, c.slabs_by_all);
  text += windows_text(ranks) + memory_text(ranks);
  return text + "\n" + breakdown_text(ranks) + "\nfiles in " + deck.output.directory.string();
}

template <int D>
void ThermoTable<D>::thermo(const Snapshot<D>& s) {
  constexpr std::uint64_t kOfADoubling = 16;
  if (rows_ == 0) {
    std::string head;
    for (const Column<D>& column : columns<D>())
      if (column.format)
        head += fmt::format("{}{:>{}}", head.empty() ? "" : " ", column.heading, std::atoi(column.format));
    log_.note(head);
  }
  const std::uint64_t row = rows_++;
  left_out_.reset();
  if (row % std::max<std::uint64_t>(1, std::bit_floor(row) / kOfADoubling) == 0)
    write(s);
  else
    left_out_ = s;
}

template <int D>
void ThermoTable<D>::finish() {
  if (left_out_) write(*left_out_);
  left_out_.reset();
}

template <int D>
void ThermoTable<D>::write(const Snapshot<D>& s) {
  std::string row;
  for (const Column<D>& column : columns<D>())
    if (column.format)
      row +=
          fmt::format(fmt::runtime(fmt::format("{}{{:>{}}}", row.empty() ? "" : " ", column.format)), column.of(s, 0));
  log_.note(row);
}

template std::optional<std::string> overlap_warning(const Statistics&, const Box<2>&);
template std::optional<std::string> overlap_warning(const Statistics&, const Box<3>&);
template std::vector<std::string> warnings_about(const Deck&, const Statistics&, const Box<2>&);
template std::vector<std::string> warnings_about(const Deck&, const Statistics&, const Box<3>&);
template class ThermoTable<2>;
template class ThermoTable<3>;

}  // namespace carom
