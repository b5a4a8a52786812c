#include "engine/search/skin_lists.h"

#include <cmath>

namespace carom {
namespace {

constexpr double kPlaces = 1024;     // to a cell, along each axis
constexpr double kMembers = 4;       // of a cell, at least: fewer would waste its line
constexpr std::int32_t kMargin = 2;  // cells, round those of a part

template <int D>
Vec<D> centre(const NextEvent<D>& a) {
  Vec<D> c;
  for (int k = 0; k < D; ++k) c[k] = a.where.centre[k];
  return c;
}

}  // namespace

template <int D>
SkinLists<D>::SkinLists(const Box<D>& box, const Packing<D>& packing, const ScanKernels& kernels,
                        std::span<const double> radius, bool equal, double largest, double skin,
                        PageVector<NextEvent<D>>& next_events)
    : box_(box),
      packing_(packing),
      kernels_(kernels),
      radius_(radius),
      equal_(equal),
      largest_(largest),
      skin_(skin),
      next_events_(next_events),
      lists_(packing, kernels.lanes, next_events) {
  exact_ = !equal || !box.closed();
  if (!equal) {
    level_.resize(radius.size());
    for (std::size_t i = 0; i < radius.size(); ++i) level_[i] = octave(largest, radius[i]);
  }
}

template <int D>
std::uint8_t SkinLists<D>::octave(double largest, double radius) {
  return static_cast<std::uint8_t>(std::clamp(std::floor(std::log2(largest / radius)), 0.0, 30.0));
}

template <int D>
void SkinLists<D>::build(std::size_t n, const std::function<Vec<D>(Slot)>& place, const Extent<D>& extent,
                         double max_displacement) {
  // 1. Cells for each size.
  levels_.clear();
  const std::size_t levels = level_.empty() ? 1 : 1 + *std::max_element(level_.begin(), level_.end());
  double volume = 1;
  for (int k = 0; k < D; ++k) volume *= box_.bounded(k) ? box_.edges[k] : extent.high[k] - extent.low[k];
  for (std::size_t l = 0; l < levels; ++l) {
    double largest = l == 0 ? largest_ : 0;
    std::size_t members = equal_ ? n : 0;
    for (std::size_t i = 0; i < level_.size(); ++i)
      if (level_[i] == l) largest = std::max(largest, radius_[i]), ++members;
    // Places are rounded down to 1024ths: two of them may come out nearer or farther by one in each direction.
    const double reach = 2 * (std::max(largest, 1e-300) + skin_) * (1 + 2 * std::sqrt(D) / kPlaces);
    // Of the whole system, where these are a part of it.
    const double all =
        static_cast<double>(members) * static_cast<double>(extent.particles) / std::max(static_cast<double>(n), 1.0);
    const double roomy = std::pow(kMembers * volume / std::max(all, 1.0), 1.0 / D);
    const double edge = std::max(reach, roomy);
    Level level{
        .grid = CellGrid<D>(box_, edge, extent), .largest_radius = largest, .lines = {}, .next = {}, .steps = {}};
    if (n < extent.particles) {
      std::vector<Vec<D>> places;
      for (Slot i = 0; i < n; ++i) places.push_back(place(i));
      level.grid.confine(places, kMargin);
    }
    levels_.push_back(std::move(level));
  }
  widest_ = 0;
  max_displacement_ = max_displacement;
  for (Level& level : levels_) lay_out(level, max_displacement);
  // 2. Every sphere into a cell.
  boxes_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Vec<D> x = place(static_cast<Slot>(i));
    for (int k = 0; k < D; ++k) next_events_[i].where.centre[k] = x[k];
    insert(static_cast<Slot>(i), x);
  }
  // 3. Lists.
  lists_.clear(n);
  for (Slot i = 0; i < n; ++i) {
    next_events_[i].capacity = 0;
    lists_.assign(i, surround(i, centre(next_events_[i])));
  }
}

/// Makes empty cells, and tabulates the steps to all that the spheres of a level can be seen from.
template <int D>
void SkinLists<D>::lay_out(Level& level, double max_displacement) {
  level.lines.resize(level.grid.cells());
  for (auto& line : level.lines) std::fill_n(line.slot, 8, kEmpty);
  level.next.assign(level.grid.cells(), kEmpty);
  level.free = kEmpty;
  level.steps = {};
  for (int k = 0; k < D; ++k) {
    const double places = most_places(levels_[0].largest_radius, level, max_displacement);
    level.margin = std::max(level.margin, static_cast<std::int32_t>(std::ceil(places / level.grid.edge(k))));
  }
  for (int k = 0; k < D; ++k) {
    const std::int32_t unit = 1 << (packing_.field_bits * k), count = level.grid.count(k);
    for (std::int32_t c = -level.margin; c < count + level.margin; ++c) {
      typename CellGrid<D>::Step step{0, 0};
      level.grid.step(k, c, step);  // leads nowhere beyond walls: not used there
      widest_ = std::max(widest_, std::abs(step.boxes));
      level.steps[k].push_back({static_cast<std::uint32_t>(step.offset), step.boxes * unit});
    }
  }
  if (widest_ > packing_.largest()) throw_too_far();
}

/// How far a sphere sees spheres of a level, with room for places that are rounded.
template <int D>
double SkinLists<D>::most_places(double radius, const Level& level, double max_displacement) const {
  return (radius + level.largest_radius + 2 * (skin_ + max_displacement)) * (1 + 2 * std::sqrt(D) / kPlaces);
}

template <int D>
Cell<D> SkinLists<D>::locate(const Level& level, const Vec<D>& x, Place& place) const {
  const Cell<D> cell = level.grid.cell(x);
  for (int k = 0; k < D; ++k) {
    const double within = (x[k] - level.grid.face(k, cell[k])) * level.grid.inverse_edge(k);
    place[k] = static_cast<std::int32_t>(std::clamp(within * kPlaces, 0.0, kPlaces - 1));
  }
  return cell;
}

template <int D>
void SkinLists<D>::insert(Slot i, const Vec<D>& x) {
  Level& level = levels_[level_of(i)];
  Place place;
  const Cell<D> cell = locate(level, x, place);
  if (!level.grid.holds(cell)) spread(level);
  const Image<D> boxes = level.grid.boxes(cell);
  boxes_[i] = packing_.linear(boxes);
  for (const std::int32_t b : boxes) widest_ = std::max(widest_, std::abs(b));
  if (widest_ > packing_.largest()) throw_too_far();
  std::uint32_t code = 0;
  for (int k = 0; k < D; ++k) code |= static_cast<std::uint32_t>(place[k]) << (10 * k);
  std::uint32_t line = static_cast<std::uint32_t>(level.grid.index(cell));
  for (;;) {
    for (int q = 0; q < 8; ++q)
      if (level.lines[line].slot[q] == kEmpty) {
        level.lines[line].slot[q] = i;
        level.lines[line].place[q] = code;
        return;
      }
    if (level.next[line] == kEmpty) {
      std::uint32_t fresh = level.free;
      if (fresh != kEmpty) {
        level.free = level.next[fresh];
      } else {
        fresh = static_cast<std::uint32_t>(level.lines.size());
        level.lines.emplace_back();
        level.next.push_back(kEmpty);
      }
      std::fill_n(level.lines[fresh].slot, 8, kEmpty);
      level.next[fresh] = kEmpty;
      level.next[line] = fresh;
    }
    line = level.next[line];
  }
}

/// A sphere is outside the cells: from now on there are cells everywhere.
template <int D>
void SkinLists<D>::spread(Level& level) {
  std::vector<Slot> members;
  for (const CellLine& line : level.lines)
    for (const Slot i : line.slot)
      if (i != kEmpty) members.push_back(i);
  level.grid.spread();
  level.lines.clear();
  lay_out(level, max_displacement_);
  for (const Slot i : members) insert(i, centre(next_events_[i]));
}

template <int D>
void SkinLists<D>::remove(Slot i, const Vec<D>& x) {
  Level& level = levels_[level_of(i)];
  const std::uint32_t first = static_cast<std::uint32_t>(level.grid.index(level.grid.cell(x)));
  for (std::uint32_t line = first, before = kEmpty;; before = line, line = level.next[line]) {
    CellLine& cell = level.lines[line];
    for (Slot& slot : cell.slot) {
      if (slot != i) continue;
      slot = kEmpty;
      const bool empty = std::all_of(cell.slot, cell.slot + 8, [](auto s) { return s == kEmpty; });
      if (before != kEmpty && empty) {
        level.next[before] = level.next[line];
        level.next[line] = level.free;
        level.free = line;
      }
      return;
    }
  }
}

/// The candidates of a sphere at x; good until the next call.
template <int D>
std::span<const std::uint32_t> SkinLists<D>::surround(Slot i, const Vec<D>& x, double max_displacement) {
  unsigned found = 0;
  for (const Level& level : levels_) look_into(level, i, x, max_displacement, found);
  return {found_.data(), found};
}

template <int D>
void SkinLists<D>::look_into(const Level& level, Slot i, const Vec<D>& x, double max_displacement, unsigned& found) {
  static constexpr CellView kHere{};
  Place place;
  const Cell<D> cell = locate(level, x, place);
  const Image<D> boxes = level.grid.boxes(cell);
  NearTask task{};
  task.lines = level.lines.data();
  task.next = level.next.data();
  const double places = most_places(radius(i), level, max_displacement);
  double rounding = 0;
  std::size_t cells = 1, images = 1;  // images: how often a cell may be seen
  for (int k = 0; k < D; ++k) {
    const std::int32_t count = level.grid.count(k), here = cell[k] - boxes[k] * count;
    const double edge = level.grid.edge(k), scale = edge / kPlaces;
    task.scale[k] = static_cast<float>(scale);
    rounding += scale * scale;
    const std::int32_t range = places <= edge ? 1 : static_cast<std::int32_t>(std::ceil(places / edge));
    std::int32_t low = -range, high = range;
    if (!box_.periodic(k)) low = std::max(low, -here), high = std::min(high, count - 1 - here);
    const CellStep* step = level.steps[k].data() + here + low + level.margin;
    auto& views = views_[k];
    views.resize(static_cast<std::size_t>(high - low) + 1);
    float corner = static_cast<float>(low * static_cast<std::int32_t>(kPlaces) - place[k]);
    for (CellView& view : views) {
      const float gap = std::max(std::max(corner - 1, -corner - static_cast<float>(kPlaces)), 0.0f) * task.scale[k];
      view = {*step++, corner * task.scale[k], gap * gap};
      corner += static_cast<float>(kPlaces);
    }
    task.view[k] = views.data();
    task.views[k] = static_cast<unsigned>(views.size());
    cells *= views.size();
    images *= 1 + 2 * static_cast<std::size_t>(range) / static_cast<std::size_t>(count);
  }
  if constexpr (D == 2) task.view[2] = &kHere, task.views[2] = 1;
  const double limit =
      (radius(i) + level.largest_radius + 2 * (skin_ + max_displacement) + std::sqrt(rounding)) * (1 + 1e-5);
  task.limit_squared = static_cast<float>(limit * limit);
  // Lines beyond the first of their cells may all be here.
  const std::size_t most = 8 * (cells + (level.lines.size() - level.grid.cells()) * images);
  if (slots_.size() < most) slots_.resize(2 * most), away_.resize(2 * most);
  const unsigned n = kernels_.near(task, slots_.data(), away_.data());
  if (found_.size() < found + n + 8) found_.resize(std::size_t{2} * (found + n + 8));

  const std::int32_t carried = packing_.linear(boxes);
  const bool far = 2 * widest_ > packing_.largest();
  for (unsigned q = 0; q < n; ++q) {
    const Slot j = slots_[q];
    if (far) {
      const Image<D> theirs = packing_.image(packing_.pack(0, boxes_[j])),
                     seen = packing_.image(packing_.pack(0, away_[q] + carried));
      for (int k = 0; k < D; ++k)
        if (std::abs(theirs[k] - seen[k]) > packing_.largest()) throw_too_far();
    }
    const std::uint32_t candidate = packing_.pack(j, boxes_[j] - away_[q] - carried);
    if (exact_) {
      const Vec<D> d = x - centre(next_events_[j]) + box_.shift(packing_.image(candidate));
      const double within = radius(i) + radius(j) + 2 * (skin_ + max_displacement);
      if (!(d.squaredNorm() < within * within)) continue;
    }
    found_[found] = candidate;
    found += j != i ? 1 : 0;
  }
}

template <int D>
std::span<const std::uint32_t> SkinLists<D>::renew(Slot i, const Vec<D>& x) {
  NextEvent<D>& a = next_events_[i];
  remove(i, centre(a));
  for (int k = 0; k < D; ++k) a.where.centre[k] = x[k];
  insert(i, x);
  const std::span<const std::uint32_t> found = surround(i, x);
  const auto n = static_cast<unsigned>(found.size());
  if (fresh_.size() < n + 8) fresh_.resize(2 * n + 8);
  kept_.assign(a.count / 64 + 1u, 0);
  const std::uint32_t* const list = candidates(a);
  const unsigned fresh = kernels_.compare(list, a.count, found.data(), n, fresh_.data(), kept_.data());
  for (unsigned q = a.count; q-- > 0;) {  // from the end: the one that moves up has been looked at
    if ((kept_[q / 64] >> (q % 64) & 1) != 0) continue;
    lists_.drop(packing_.slot(list[q]), packing_.reversed(i, list[q]));
    lists_.remove(i, q);
  }
  for (unsigned q = 0; q < fresh; ++q) {
    lists_.add(i, fresh_[q]);
    lists_.add(packing_.slot(fresh_[q]), packing_.reversed(i, fresh_[q]));
  }
  std::fill_n(fresh_.begin() + fresh, 8, packing_.pack(i, 0));
  return {fresh_.data(), fresh};
}

/// The sphere has been carried by so many boxes: its region goes with it, and the images in the lists follow.
template <int D>
void SkinLists<D>::shift(Slot i, const Image<D>& boxes) {
  NextEvent<D>& a = next_events_[i];
  for (int k = 0; k < D; ++k) a.where.centre[k] += boxes[k] * box_.edges[k];
  const std::int32_t linear = packing_.linear(boxes);
  boxes_[i] += linear;
  std::uint32_t* const list = lists_.of(a);
  for (unsigned q = 0; q < a.count; ++q) {
    const std::uint32_t old = list[q], own = packing_.reversed(i, old);
    const Slot j = packing_.slot(old);
    list[q] = packing_.pack(j, packing_.linear(old) - linear);
    NextEvent<D>& other = next_events_[j];
    std::uint32_t* const others = lists_.of(other);
    for (unsigned p = 0; p < other.count; ++p)
      if (others[p] == own) {
        others[p] = packing_.reversed(i, list[q]);
        lists_.divide(other);
        break;
      }
  }
  lists_.divide(a);
}

template <int D>
void SkinLists<D>::follow(std::span<const Record<D>> records) {
  for (Slot i = 0; i < records.size(); ++i) {
    Image<D> boxes{};
    bool carried = false;
    for (int k = 0; k < D; ++k) {
      if (!box_.periodic(k)) continue;
      boxes[k] = static_cast<std::int32_t>(
          std::nearbyint((records[i].x[k] - next_events_[i].where.centre[k]) / box_.edges[k]));
      carried = carried || boxes[k] != 0;
    }
    if (carried) shift(i, boxes);
  }
  const double limit = skin_ * skin_ * 0.9;
  for (Slot i = 0; i < records.size(); ++i)
    if (!((records[i].x - centre(next_events_[i])).squaredNorm() < limit)) renew(i, records[i].x);
}

template <int D>
void SkinLists<D>::admit(Slot i, const Vec<D>& x, std::span<const double> radius) {
  radius_ = radius;
  if (i == boxes_.size()) boxes_.push_back(0);
  if (!equal_) {
    if (i == level_.size()) level_.push_back(0);
    // The smallest level that can hold it: there may be none of its octave.
    const auto level =
        std::find_if(levels_.rbegin(), levels_.rend(), [&](const Level& l) { return l.largest_radius >= radius[i]; });
    level_[i] = static_cast<std::uint8_t>(levels_.rend() - level - 1);
  }
  for (int k = 0; k < D; ++k) next_events_[i].where.centre[k] = x[k];
  next_events_[i].count = next_events_[i].same = 0;
  insert(i, x);
  const std::span<const std::uint32_t> list = surround(i, x);
  lists_.assign(i, list);
  for (const std::uint32_t candidate : list) lists_.add(packing_.slot(candidate), packing_.reversed(i, candidate));
}

template <int D>
void SkinLists<D>::dismiss(Slot i) {
  NextEvent<D>& a = next_events_[i];
  remove(i, centre(a));
  const std::uint32_t* const list = candidates(a);
  for (unsigned q = 0; q < a.count; ++q) lists_.drop(packing_.slot(list[q]), packing_.reversed(i, list[q]));
  lists_.assign(i, {});
}

template <int D>
bool SkinLists<D>::move(Slot i, const Vec<D>& x, double room) {
  const double limit = room * (1 - 1e-6);
  if ((x - centre(next_events_[i])).squaredNorm() < limit * limit) return false;
  renew(i, x);
  return true;
}

template <int D>
std::span<const std::uint32_t> SkinLists<D>::find_near(Slot i, double max_displacement) {
  return surround(i, centre(next_events_[i]), max_displacement);
}

template class SkinLists<2>;
template class SkinLists<3>;

}  // namespace carom
