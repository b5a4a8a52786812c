// SPDX-License-Identifier: BSD-3-Clause
#include "engine/run/mean_squared_displacement.h"

#include <numeric>
#include <utility>

namespace carom {

template <int D>
MeanSquaredDisplacement<D>::MeanSquaredDisplacement(const System<D>& system, const Sampling& sampling)
    : Observable<D>(sampling), system_(system), number_(system.species.size()) {}

template <int D>
MeanSquaredDisplacement<D>::MeanSquaredDisplacement(const System<D>& system, const Parameters& parameters, double start)
    : MeanSquaredDisplacement(system, {parameters.real("interval"), start}) {}

template <int D>
void MeanSquaredDisplacement<D>::add_sample(double time, const Particles<D>& particles) {
  now_.resize(particles.size());
  for (std::size_t i = 0; i < particles.size(); ++i) now_[i] = particles.x[i] + system_.box.shift(particles.image[i]);
  if (system_.box.sheared())
    for (Vec<D>& x : now_) x[0] = 0;  // the flow carries particles along x
  const std::uint64_t index = this->samples();
  if (index == 0) {
    species_ = particles.species;
    for (const auto species : species_) number_[species] += 1;
    decades_.push_back({time, now_, {}});
    return;
  }
  std::uint64_t spacing = 1;  // distance between the lags of a decade, in samples
  for (std::size_t n = 0; index % spacing == 0; ++n, spacing *= kLags) {
    const std::uint64_t lag = index / spacing % kLags;
    if (lag != 0) {
      add(decades_[n].lag[lag], time, decades_[n]);
      return;
    }
    // The window ends. It is one lag of the next decade: the first windows of both began at the same time.
    if (n + 1 == decades_.size()) decades_.push_back({decades_[n].origin_time, std::move(decades_[n].origin), {}});
    decades_[n].origin_time = time;
    decades_[n].origin = now_;
  }
}

template <int D>
void MeanSquaredDisplacement<D>::add(Lag& lag, double time, const Decade& from) {
  lag.squares.resize(number_.size());
  ++lag.origins;
  lag.time.add(time - from.origin_time);
  std::vector<ExactSum> squares(number_.size());
  for (std::size_t i = 0; i < now_.size(); ++i) squares[species_[i]].add((now_[i] - from.origin[i]).squaredNorm());
  std::vector<double> means(1 + number_.size());
  ExactSum all;
  for (std::size_t s = 0; s < number_.size(); ++s) {
    lag.squares[s].add(squares[s]);
    all.add(squares[s]);
    means[1 + s] = squares[s].value() / number_[s];
  }
  means[0] = all.value() / static_cast<double>(now_.size());
  if (lag.origins == 1) lag.series = Blocking(means.size());
  lag.series.add(means);
}

template <int D>
auto MeanSquaredDisplacement<D>::rows() const -> std::vector<Row> {
  const double particles = std::accumulate(number_.begin(), number_.end(), 0.0);
  std::vector<Row> rows;
  for (const Decade& decade : decades_)
    for (const Lag& lag : decade.lag) {
      if (lag.origins == 0) continue;
      const auto origins = static_cast<double>(lag.origins);
      Row row{lag.time.value() / origins, lag.origins, 0, {}, lag.series.estimate(0), {}};
      ExactSum all;
      for (std::size_t s = 0; s < number_.size(); ++s) {
        all.add(lag.squares[s]);
        row.of.push_back(lag.squares[s].value() / (origins * number_[s]));
        row.errors.push_back(lag.series.estimate(1 + s));
      }
      row.msd = all.value() / (origins * particles);
      rows.push_back(std::move(row));
    }
  return rows;
}

template <int D>
std::vector<TableColumn> MeanSquaredDisplacement<D>::table() const {
  std::vector<TableColumn> table = {{"time", {}}, {"origins", {}}};
  const std::vector<Row> all = rows();
  const auto add = [&](const std::string& name, auto&& mean, auto&& error) {
    std::vector<double> means;
    std::vector<Estimate> errors;
    for (const Row& row : all) means.push_back(mean(row)), errors.push_back(error(row));
    add_estimates(table, name, means, errors);
  };
  for (const Row& row : all) {
    table[0].values.push_back(row.time);
    table[1].values.push_back(static_cast<double>(row.origins));
  }
  const std::string name = system_.box.sheared() ? "msd_across" : "msd";
  add(
      name, [](const Row& row) { return row.msd; }, [](const Row& row) { return row.error; });
  for (std::size_t s = 0; number_.size() > 1 && s < number_.size(); ++s)
    add(
        name + "_" + system_.species[s], [s](const Row& row) { return row.of[s]; },
        [s](const Row& row) { return row.errors[s]; });
  return table;
}

template class MeanSquaredDisplacement<2>;
template class MeanSquaredDisplacement<3>;

namespace observable {

ObservableInfo msd() {
  return {
      .name = "msd",
      .title = "mean squared displacement",
      .parameters = {parameter::interval(
          "the shortest lag of the mean squared displacement, averaged into msd.csv; 0: none. Lags are 1 … 9, 10, "
          "20 … 90, 100 … times this, up to the length of the run")},
      .documentation =
          "The mean squared displacement of all particles and, if there are several species, of each of them; it is "
          "continuous across periodic boundaries. Columns: time (the lag), origins (the number of time origins), "
          "msd, msd_A, and error_ and samples_ of each, from the means over particles of each origin. A drift of the "
          "whole system is not subtracted. In a sheared box the columns are msd_across and msd_across_A, and "
          "displacements "
          "are those across the flow, along y and z.",
      .source = "Frenkel, Smit, Understanding Molecular Simulation, 2nd ed., section 4.4.2",
      .in_2d = maker<MeanSquaredDisplacement, 2>(),
      .in_3d = maker<MeanSquaredDisplacement, 3>(),
      .sheared = true};
}

}  // namespace observable

}  // namespace carom
