// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/pair_records.h"

namespace carom {

template <int D>
void PairRecords<D>::clear() {
  for (auto& each : runs) each.clear();
  order.clear();
  box.clear();
}

namespace {

template <int D>
PairRecord record(const Vec<D>& x, double w) {
  return {x[0], x[1], D == 3 ? x[D - 1] : 0, w};
}

}  // namespace

template <int D>
void PairRecords<D>::load(const PairStep<D>& step, std::size_t first, std::size_t end) {
  x_.resize(order.size());
  for (std::size_t r = first; r < end; ++r)
    x_[r] = record<D>(step.x[order[r]], step.weight ? (*step.weight)[order[r]] : 1);
  const auto& other = step.vectors.empty() ? step.x_new : step.vectors;
  if (other.empty()) return;
  x_new_.resize(order.size());
  for (std::size_t r = first; r < end; ++r) x_new_[r] = record<D>(other[order[r]], 1);
}

template <int D>
PairRows PairRecords<D>::rows(Kind kind, const Box<D>& in, const PairStep<D>& step) {
  PairRows rows{.x = x_.data()};
  rows.vectors = !step.vectors.empty();
  if (rows.vectors || !step.x_new.empty()) rows.x_new = x_new_.data();
  if ((kind == kMoving || kind == kSharedMoving) && !box.empty()) rows.box = box.data();
  for (int k = 0; k < D; ++k) rows.edges[k] = in.edges[k];
  if (in.sheared()) {
    rows.sheared = true;
    rows.turns = in.turns - turns;
    rows.tilt[0] = in.tilt;
    rows.tilt[1] = in.next_tilt;
  }
  rows.weighted = step.weight != nullptr;
  rows.partner = partners[kind].data();
  rows.run = runs[kind].data();
  rows.runs = runs[kind].size();
  if (!step.changed) return rows;
  some_runs_.clear();
  some_partners_.clear();
  for (const PairRun& run : runs[kind]) {
    PairRun some = run;
    some.begin = static_cast<std::uint32_t>(some_partners_.size());
    const std::uint32_t* const partner = partners[kind].data() + run.begin;
    if (step.changed[order[run.row]] != 0) {
      some_partners_.insert(some_partners_.end(), partner, partner + run.count);
    } else {
      for (std::uint32_t k = 0; k < run.count; ++k)
        if (step.changed[order[partner[k]]] != 0) some_partners_.push_back(partner[k]);
    }
    some.count = static_cast<std::uint32_t>(some_partners_.size()) - some.begin;
    if (some.count > 0) some_runs_.push_back(some);
  }
  some_partners_.resize(some_partners_.size() + 8);
  rows.partner = some_partners_.data();
  rows.run = some_runs_.data();
  rows.runs = some_runs_.size();
  return rows;
}

template <int D>
ForceWords* PairRecords<D>::low() {
  low_.assign(order.size(), {});
  high_.clear();
  return low_.data();
}

template <int D>
ForceWords* PairRecords<D>::high() {
  high_.resize(order.size());
  return high_.data();
}

template <int D>
void PairRecords<D>::flush_to(ForceSums<D>& sums) {
  ForceWords* const low = sums.low();
  for (std::size_t r = 0; r < order.size(); ++r) low[order[r]].add(low_[r]);
  if (high_.empty()) return;
  ForceWords* const high = sums.high();
  for (std::size_t r = 0; r < order.size(); ++r) high[order[r]].add(high_[r]);
}

template class PairRecords<2>;
template class PairRecords<3>;

}  // namespace carom
