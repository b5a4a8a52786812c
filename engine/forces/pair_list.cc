// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/pair_list.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/base/error.h"
#include "engine/search/cell_grid.h"

namespace carom {

namespace {

/// More pairs, in all and for each particle, result from a step that is far too long.
constexpr std::size_t kMaxPairs = 100'000'000, kMaxPartners = 5000;
/// Cells are as long as the reach, but along the last axis they are thinner, so that fewer particles of a row of cells
/// are out of reach.
constexpr int kSlices = 8;

template <int D>
double farther(double squared, const Vec<D>& way) {
  const double other = way.squaredNorm();
  return other > squared && other <= std::numeric_limits<double>::max() ? other : squared;
}

template <int D>
Id farthest(const PairStep<D>& step) {
  Id most = 0;
  double squared = 0;
  for (Id i = 0; i < step.x_new.size(); ++i)
    if (const double other = farther<D>(squared, step.x_new[i] - step.x[i]); other > squared) squared = other, most = i;
  return most;
}

}  // namespace

/// Consecutive places of the list, shifted by one image.
struct PartnerRange {
  std::uint32_t begin, end;
  std::array<std::int32_t, 3> image;

  bool here() const { return (image[0] | image[1] | image[2]) == 0; }
  bool as(const PartnerRange& other) const {
    return ((image[0] ^ other.image[0]) | (image[1] ^ other.image[1]) | (image[2] ^ other.image[2])) == 0;
  }
};

template <int D>
PairRecords<D>& CutoffList<D>::cover(const PairStep<D>& step, const Particles<D>& particles, bool own_covered,
                                     const std::function<void()>& before_build) {
  const bool still = step.x_new.empty();
  const std::size_t first = own_covered ? records_.own : 0;
  double squared_from_build = own_covered ? own_squared_ : 0, squared_step = 0;
  const bool known =
      is_for(step, particles) && follow(step, first, records_.order.size(), squared_from_build, squared_step);
  if (!known && !still)
    for (std::size_t i = 0; i < step.x.size(); ++i) squared_step = farther<D>(squared_step, step.x_new[i] - step.x[i]);
  if (!made_) skin_.begin(2 * *shared_width_);
  double length = std::sqrt(squared_step), from_build = std::sqrt(squared_from_build);
  if (box_.sheared()) {
    length += 0.5 * std::abs(strain_of(step)) * cutoff_;
    if (known) from_build += lost_to(std::max(std::abs(strain()), std::abs(strain() + strain_of(step))));
  }
  grown_ = from_build - std::exchange(farthest_, from_build);
  const bool renew = std::exchange(renew_, false);
  if (!skin_.lasts(known, from_build, length) || renew) {
    farthest_ = grown_ = 0;
    need_finite(particles, step.x);
    skin_.renew(box_, length, [&] { return "particle " + std::to_string(particles.id_of(farthest(step))); });
    *shared_width_ = skin_.width();
    if (before_build) before_build();
    ghost_ = particles.ghost;
    build(step, particles);
    records_.load(step);
  } else {
    records_.load(step, first);
  }
  return records_;
}

template <int D>
PairRecords<D>* CutoffList<D>::cover_own(const PairStep<D>& step, const Particles<D>& particles) {
  double none = 0;
  own_squared_ = 0;
  if (particles.ghost.empty() || !is_for(step, particles) || !follow(step, 0, records_.own, own_squared_, none))
    return nullptr;
  const double lost = box_.sheared() ? lost_to(std::abs(strain())) : 0;
  if (std::sqrt(own_squared_) + lost > 0.5 * skin_.width()) return nullptr;
  records_.load(step, 0, records_.own);
  return &records_;
}

/// What a strain since the build takes from each of the two displacements that the skin allows, for a pair within the
/// cutoff: relative to the flow, its distance at the build was at most (|e|/2 + √(1 + e²/4)) times that of now.
template <int D>
double CutoffList<D>::lost_to(double strain) const {
  const double half = 0.5 * strain;
  return 0.5 * (cutoff_ + skin_.width()) * (1 - 1 / (half + std::sqrt(1 + half * half)));
}

/// The largest displacements since the last build, relative to the flow of a sheared box, of the particles in these
/// places. Updates the boxes of particles that were wrapped; returns false if one was wrapped that is not marked as
/// moving, or if a position is not finite.
template <int D>
bool CutoffList<D>::follow(const PairStep<D>& step, std::size_t first, std::size_t end, double& squared_from_build,
                           double& squared_step) {
  const double allowed = 0.25 * skin_.width() * skin_.width();
  const bool sheared = box_.sheared();
  const double strain = sheared ? this->strain() : 0, strain_in_step = sheared ? strain_of(step) : 0;
  const double tilt = sheared ? tilt_since_build() : 0, tilt_in_step = strain_in_step * box_.edges[1];
  for (std::size_t r = first; r < end; ++r) {
    const Id i = records_.order[r];
    Vec<D> home;
    for (int k = 0; k < D; ++k) home[k] = built_at_[k][r];
    const auto in_box = [&](const Vec<D>& x, bool later = false) {
      Vec<D> y = x - home;
      if (!records_.box.empty())
        for (int k = 0; k < D; ++k) y[k] -= (&records_.box[r].x)[k] * box_.edges[k];
      if (sheared) [[unlikely]] {
        y[0] -= records_.box[r].y * (tilt + (later ? tilt_in_step : 0));
        y[0] -= (strain + (later ? strain_in_step : 0)) * home[1];
      }
      return y;
    };
    Vec<D> way = in_box(step.x[i]);
    if (!(way.squaredNorm() <= allowed)) {
      if (!way.allFinite()) return false;
      const Image<D> jump = box_.nearest_image(way);
      if (jump != Image<D>{}) {
        if ((code_[r] & PartnerSearch::kMoving) == 0) return false;
        for (int k = 0; k < D; ++k) (&records_.box[r].x)[k] -= jump[k];
        if (sheared) records_.box[r].x += jump[1] * (box_.turns - records_.turns);
        way = in_box(step.x[i]);
      }
    }
    squared_from_build = std::max(squared_from_build, way.squaredNorm());
    if (step.x_new.empty()) continue;
    squared_from_build = farther<D>(squared_from_build, in_box(step.x_new[i], true));
    squared_step = farther<D>(squared_step, sheared ? in_box(step.x_new[i], true) - way : step.x_new[i] - step.x[i]);
  }
  return true;
}

template <int D>
void CutoffList<D>::build(const PairStep<D>& step, const Particles<D>& particles) {
  made_ = true;
  built_with_tilt_ = box_.tilt;
  records_.turns = box_.turns;
  particles_ = step.x.size();
  records_.clear();
  records_.partners[PairRecords<D>::kMoving].clear();
  records_.partners[PairRecords<D>::kSharedMoving].clear();
  sizes_ = {};
  // Groups: own particles, then ghosts; if a pair has two species, own ones of each, then ghosts of each.
  std::array<std::vector<Id>, 4> groups;
  const bool apart = filter_.species.apart();
  const std::size_t of_own = apart ? 2 : 1;
  Extent<D> extent;
  for (Id i = 0; i < step.x.size(); ++i) {
    const std::uint64_t code = filter_.species.code(i);
    const bool ghost = !ghost_.empty() && ghost_[i] != 0;
    if (code == 0 || (ghost && ghost_[i] == kGhostElsewhere)) continue;
    groups[(ghost ? of_own : 0) + (apart && code == PartnerSearch::kSecond ? 1 : 0)].push_back(i);
    extent.add(step.x[i]);
  }
  if (apart && groups[0].size() < groups[1].size())  // the fewer look for the more
    std::swap(groups[0], groups[1]), std::swap(groups[2], groups[3]);
  records_.own = groups[0].size() + (apart ? groups[1].size() : 0);
  std::vector<Id> members;
  for (const auto& group : groups) members.insert(members.end(), group.begin(), group.end());
  const bool ghosts = members.size() > records_.own;
  own_rows_ = {0, apart ? groups[1].size() : records_.own};
  ghost_rows_ = {0, members.size() - records_.own};
  const double reach = cutoff_ + skin_.width();
  const CellGrid<D> grid(box_, reach, extent, 2, kSlices);
  const Cell<D> range = grid.range(reach);

  // Counting sort by cell, one group after the other.
  const std::size_t cells = grid.cells();
  std::vector<std::uint32_t> at(members.size()), start((ghosts ? 2 : 1) * of_own * cells + 1);
  for (std::size_t m = 0, g = 0, end = groups[0].size(); m < members.size(); ++m) {
    while (m == end) end += groups[++g].size();
    at[m] = static_cast<std::uint32_t>(grid.index(grid.cell(step.x[members[m]])) + g * cells);
    ++start[at[m] + 1];
  }
  const std::size_t fullest = *std::ranges::max_element(start);
  std::partial_sum(start.begin(), start.end(), start.begin());
  std::vector<std::uint32_t> next = start;
  records_.order.resize(members.size());
  for (std::size_t m = 0; m < members.size(); ++m) records_.order[next[at[m]]++] = members[m];
  double around = 1;
  for (int k = 0; k < D; ++k) around *= 2 * range[k] + 1;
  records_.most_partners = static_cast<std::size_t>((ghosts ? 2 : 1) * around * static_cast<double>(fullest));

  for (auto& coordinate : built_at_) coordinate.assign(members.size() + 8, 0);
  code_.assign(members.size() + 8, 0);
  id_.clear();
  if (ghosts)
    for (const Id i : records_.order) id_.push_back(particles.id_of(i));
  bool any_moving = false;
  std::vector<Image<D>> boxes(members.size());
  for (std::size_t r = 0; r < members.size(); ++r) {
    const Id i = records_.order[r];
    boxes[r] = grid.boxes(grid.cell(step.x[i]));
    const Vec<D> home = step.x[i] - box_.shift(boxes[r]);
    std::uint64_t code = filter_.species.code(i);
    bool moving = box_.sheared() || boxes[r] != Image<D>{};
    for (int k = 0; k < D; ++k)
      moving = moving || (box_.periodic(k) &&
                          std::min(home[k], box_.edges[k] - home[k]) <= 0.5 * skin_.width() + 1e-9 * box_.edges[k]);
    if (moving) code |= PartnerSearch::kMoving;
    any_moving = any_moving || moving;
    for (int k = 0; k < D; ++k) built_at_[k][r] = home[k];
    code_[r] = code;
  }
  if (any_moving)
    for (const Image<D>& box : boxes) {
      records_.box.push_back({0, 0, 0, 0});
      for (int k = 0; k < D; ++k) (&records_.box.back().x)[k] = box[k];
    }

  // The partners of an own particle are own particles in half of the cells around it, or those of the other species in
  // all cells around it; so are the partners of a ghost, if this rank evaluates the pair.
  std::vector<PartnerRange> ranges;
  Cell<D> centre{};
  for (std::size_t c = 0; c + 1 < start.size(); ++c, grid.advance(centre)) {
    if (start[c] == start[c + 1]) continue;
    const std::size_t group = c / cells;
    if (apart && group == 0) continue;
    const bool own = group < of_own, half = own && !apart;
    const std::size_t theirs = apart && group == 2 ? cells : 0;  // where the group of the partners begins
    bool elsewhere = false;
    ranges.clear();
    grid.for_each_range(centre, range, half, [&](std::size_t first, std::size_t end, const Image<D>& away) {
      first += theirs, end += theirs;
      if (start[first] == start[end]) return;
      ranges.push_back({start[first], start[end], {}});
      for (int k = 0; k < D; ++k) ranges.back().image[k] = -away[k];
      elsewhere = elsewhere || !ranges.back().here();
    });
    if (elsewhere)  // equal images follow each other
      std::ranges::stable_sort(ranges.begin() + (half ? 1 : 0), ranges.end(), {},
                               [](const PartnerRange& part) { return std::pair(!part.here(), part.image); });
    for (std::uint32_t r = start[c]; r < start[c + 1] && !ranges.empty(); ++r) {
      if (half) ranges[0].begin = r + 1;
      find_pairs(r, ranges);
      if (sizes_[own ? 0 : 1] +
              records_.partners[own ? PairRecords<D>::kMoving : PairRecords<D>::kSharedMoving].size() >
          kMaxPairs + kMaxPartners * particles_) {
        made_ = false;
        throw Error(Failure::numerical,
                    "far too many pairs are within " + short_text(reach) + " of each other: the cutoff and " +
                        short_text(skin_.width()) + " for steps as long as that of particle " +
                        std::to_string(particles.id_of(farthest(step))) + "; use a smaller integrator.step or cutoff");
      }
    }
  }
  for (const auto kind : {PairRecords<D>::kMoving, PairRecords<D>::kSharedMoving})
    records_.partners[kind].insert(records_.partners[kind].end(), 8, 0);
  for (const std::size_t k : {0, 1}) {  // the search leaves invalid places beyond the last partner
    auto& partners = records_.partners[k == 0 ? PairRecords<D>::kPlain : PairRecords<D>::kShared];
    if (partners.size() < sizes_[k] + 8) partners.resize(sizes_[k] + 8);
    std::fill_n(partners.data() + sizes_[k], 8, 0u);
  }
}

/// Lists the pairs of one particle with the particles in these ranges.
template <int D>
void CutoffList<D>::find_pairs(std::uint32_t row, std::span<const PartnerRange> ranges) {
  const std::uint64_t code = code_[row];
  const double reach = (cutoff_ + skin_.width()) * (1 + 1e-12);
  const bool ghost = row >= records_.own;
  ++(ghost ? ghost_rows_ : own_rows_).done;
  const auto kind = ghost ? PairRecords<D>::kShared : PairRecords<D>::kPlain;
  const auto moving_kind = ghost ? PairRecords<D>::kSharedMoving : PairRecords<D>::kMoving;
  auto& plain = records_.partners[kind];
  std::size_t& size = sizes_[ghost ? 1 : 0];
  PartnerSearch search{.x = {built_at_[0].data(), built_at_[1].data(), built_at_[2].data()},
                       .code = code_.data(),
                       .row = row,
                       .own = {},
                       .reach_squared = reach * reach};
  search.wanted = filter_.species.partner_code(code);
  search.plain = (code & PartnerSearch::kMoving) == 0;
  for (std::size_t first = 0; first < ranges.size();) {
    const auto& image = ranges[first].image;
    std::size_t last = first, candidates = 16;
    for (; last < ranges.size() && ranges[last].as(ranges[first]); ++last)
      candidates += ranges[last].end - ranges[last].begin;
    if (const std::size_t needed = size + candidates; plain.size() < needed) {
      // After a sixteenth of the rows their mean tells how long the list will be, within a few percent.
      const auto& [done, all] = ghost ? ghost_rows_ : own_rows_;
      const std::size_t most = kMaxPairs + kMaxPartners * particles_;  // more are an error
      const std::size_t more = 16 * done < all ? needed : std::max(size / 4, 17 * size / (16 * done) * (all - done));
      plain.resize(std::min(needed + more, std::max(needed, most)));
    }
    if (other_.size() < candidates) other_.resize(candidates);
    search.here = ranges[first].here();
    for (int k = 0; k < 3; ++k) search.own[k] = built_at_[k][row] + (k < D ? image[k] * box_.edges[k] : 0.0);
    if (box_.tilt != 0) search.own[0] += image[1] * box_.tilt;
    PartnersFound found{plain.data() + size, other_.data()};
    for (; first < last; ++first) kernels_->find(search, ranges[first].begin, ranges[first].end, found);
    const auto remove = [&](auto&& condition) {
      found.plain = std::remove_if(plain.data() + size, found.plain, condition);
      found.other = std::remove_if(other_.data(), found.other, condition);
    };
    if (ghost && ghost_[records_.order[row]] == kGhost)
      remove([&](std::uint32_t r) { return !evaluated_with_first(id_[r], id_[row]); });
    if (filter_.excluded)
      remove([&](std::uint32_t r) { return filter_.excludes(records_.order[row], records_.order[r]); });
    const auto add = [&](int to, std::size_t begin, std::size_t end) {
      if (begin == end) return;
      records_.runs[to].push_back({row,
                                   static_cast<std::uint32_t>(begin),
                                   static_cast<std::uint32_t>(end - begin),
                                   {image[0], image[1], image[2]}});
    };
    const auto plain_end = static_cast<std::size_t>(found.plain - plain.data());
    add(kind, size, plain_end);
    size = plain_end;
    auto& partners = records_.partners[moving_kind];
    const std::size_t begin = partners.size();
    partners.insert(partners.end(), other_.data(), found.other);
    add(moving_kind, begin, partners.size());
  }
}

template <int D>
void CutoffList<D>::add_listed_pairs(std::span<std::uint32_t> of_particle) const {
  if (!made_) return;
  using Records = PairRecords<D>;
  for (const auto kind : {Records::kPlain, Records::kMoving, Records::kShared, Records::kSharedMoving})
    for (const PairRun& run : records_.runs[kind]) {
      if (!Records::shared(kind)) {
        of_particle[records_.order[run.row]] += run.count;
        continue;
      }
      const auto first = records_.partners[kind].begin() + run.begin;  // own particles, the row is a ghost
      std::for_each(first, first + run.count, [&](std::uint32_t r) { ++of_particle[records_.order[r]]; });
    }
}

template class CutoffList<2>;
template class CutoffList<3>;

}  // namespace carom
