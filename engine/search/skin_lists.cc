#include "engine/search/skin_lists.h"

#include <cmath>

namespace carom {
namespace {

constexpr double kPlaces = 1024;     // to a cell, along each axis
constexpr unsigned kSlack = 3;       // candidates that a new list has room for, beside those it has
constexpr double kMembers = 4;       // of a cell, at least: fewer would waste its line
constexpr std::int32_t kMargin = 2;  // cells, round those of a part

template <int D>
Vec<D> centre(const Agenda<D>& a) {
  Vec<D> c;
  for (int k = 0; k < D; ++k) c[k] = a.where.centre[k];
  return c;
}

}  // namespace

template <int D>
SkinLists<D>::SkinLists(const Box<D>& box, const Packing<D>& packing, const ScanKernels& kernels,
                        std::span<const double> radius, bool equal, double largest, double skin,
                        PageVector<Agenda<D>>& agenda)
    : box_(box),
      packing_(packing),
      kernels_(kernels),
      lanes_(kernels.lanes),
      radius_(radius),
      equal_(equal),
      largest_(largest),
      skin_(skin),
      agenda_(agenda) {
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
                         double astray) {
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
  astray_ = astray;
  for (Level& level : levels_) lay_out(level, astray);
  // 2. Every sphere into a cell.
  boxes_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Vec<D> x = place(static_cast<Slot>(i));
    for (int k = 0; k < D; ++k) agenda_[i].where.centre[k] = x[k];
    insert(static_cast<Slot>(i), x);
  }
  // 3. Lists.
  pool_.clear();
  used_ = 0;
  pool_.reserve(24 * n);
  for (auto& unused : unused_) unused.clear();
  for (std::size_t i = 0; i < n; ++i) {
    agenda_[i].capacity = 0;
    assign(static_cast<Slot>(i), surround(static_cast<Slot>(i), centre(agenda_[i])));
  }
}

/// Makes empty cells, and tabulates the steps to all that the spheres of a level can be seen from.
template <int D>
void SkinLists<D>::lay_out(Level& level, double astray) {
  level.lines.resize(level.grid.cells());
  for (auto& line : level.lines) std::fill_n(line.slot, 8, kEmpty);
  level.next.assign(level.grid.cells(), kEmpty);
  level.free = kEmpty;
  level.steps = {};
  for (int k = 0; k < D; ++k) {
    const double places = most_places(levels_[0].largest_radius, level, astray);
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
double SkinLists<D>::most_places(double radius, const Level& level, double astray) const {
  return (radius + level.largest_radius + 2 * (skin_ + astray)) * (1 + 2 * std::sqrt(D) / kPlaces);
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
  lay_out(level, astray_);
  for (const Slot i : members) insert(i, centre(agenda_[i]));
}

template <int D>
void SkinLists<D>::remove(Slot i, const Vec<D>& x) {
  Level& level = levels_[level_of(i)];
  const std::uint32_t first = static_cast<std::uint32_t>(level.grid.index(level.grid.cell(x)));
  for (std::uint32_t line = first, before = kEmpty;; before = line, line = level.next[line]) {
    CellLine& cell = level.lines[line];
    for (int q = 0; q < 8; ++q) {
      if (cell.slot[q] != i) continue;
      cell.slot[q] = kEmpty;
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

/// Fills found_ with the candidates of a sphere at x; returns how many.
template <int D>
unsigned SkinLists<D>::surround(Slot i, const Vec<D>& x, double astray) {
  unsigned found = 0;
  for (const Level& level : levels_) look_into(level, i, x, astray, found);
  return found;
}

template <int D>
void SkinLists<D>::look_into(const Level& level, Slot i, const Vec<D>& x, double astray, unsigned& found) {
  static constexpr CellView kHere{};
  Place place;
  const Cell<D> cell = locate(level, x, place);
  const Image<D> boxes = level.grid.boxes(cell);
  NearTask task{};
  task.lines = level.lines.data();
  task.next = level.next.data();
  const double places = most_places(radius(i), level, astray);
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
    const CellStep* step = &level.steps[k][static_cast<std::size_t>(here + low + level.margin)];
    auto& views = views_[k];
    views.resize(static_cast<std::size_t>(high - low + 1));
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
  const double limit = (radius(i) + level.largest_radius + 2 * (skin_ + astray) + std::sqrt(rounding)) * (1 + 1e-5);
  task.limit_squared = static_cast<float>(limit * limit);
  // Lines beyond the first of their cells may all be here.
  const std::size_t most = 8 * (cells + (level.lines.size() - level.grid.cells()) * images);
  if (slots_.size() < most) slots_.resize(2 * most), away_.resize(2 * most);
  const unsigned n = kernels_.near(task, slots_.data(), away_.data());
  if (found_.size() < found + n + 8) found_.resize(2 * (found + n + 8));

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
      const Vec<D> d = x - centre(agenda_[j]) + box_.shift(packing_.image(candidate));
      const double within = radius(i) + radius(j) + 2 * (skin_ + astray);
      if (!(d.squaredNorm() < within * within)) continue;
    }
    found_[found] = candidate;
    found += j != i ? 1 : 0;
  }
}

template <int D>
std::uint32_t SkinLists<D>::take(unsigned units) {
  if (unused_.size() <= units) unused_.resize(units + 1);
  if (!unused_[units].empty()) {
    const std::uint32_t list = unused_[units].back();
    unused_[units].pop_back();
    return list;
  }
  const std::size_t at = used_;
  used_ += std::size_t{lanes_} * units;
  pool_.resize(used_ + 8);  // lists are compared by eight
  return static_cast<std::uint32_t>(at / lanes_);
}

/// Makes the first n of found_ the list of a sphere.
template <int D>
void SkinLists<D>::assign(Slot i, unsigned n) {
  Agenda<D>& a = agenda_[i];
  const unsigned units = (n + kSlack + lanes_ - 1) / lanes_;
  if (n > lanes_ * a.capacity || a.capacity == 0) {
    if (units > std::numeric_limits<std::uint16_t>::max() / lanes_)
      throw Error(Failure::numerical, "a sphere has more than 65 thousand neighbours");
    if (a.capacity > 0) unused_[a.capacity].push_back(a.list);
    a.list = take(units);
    a.capacity = static_cast<std::uint16_t>(units);
  }
  std::uint32_t* const list = start_of(a);
  const std::uint32_t self = packing_.pack(i, 0);
  std::copy_n(found_.begin(), n, list);
  std::fill(list + n, list + lanes_ * a.capacity, self);
  a.count = static_cast<std::uint16_t>(n);
  divide(a);
}

/// Moves those in the same box to the start of a list.
template <int D>
void SkinLists<D>::divide(Agenda<D>& a) {
  std::uint32_t* const list = start_of(a);
  const auto* const others = std::partition(list, list + a.count, [&](auto c) { return same_box(c); });
  a.same = static_cast<std::uint16_t>(others - list);
}

template <int D>
void SkinLists<D>::add(Slot i, std::uint32_t candidate) {
  Agenda<D>& a = agenda_[i];
  if (a.count == lanes_ * a.capacity) {
    std::vector<std::uint32_t> longer(candidates(a), candidates(a) + a.count);
    longer.push_back(candidate);
    longer.swap(found_);
    assign(i, a.count + 1u);
    longer.swap(found_);
    return;
  }
  std::uint32_t* const list = start_of(a);
  list[a.count] = candidate;
  if (same_box(candidate)) std::swap(list[a.same++], list[a.count]);
  ++a.count;
}

/// Takes a candidate out of the list of a sphere.
template <int D>
void SkinLists<D>::drop(Slot i, std::uint32_t candidate) {
  const std::uint32_t* const list = candidates(agenda_[i]);
  remove_from_list(i, static_cast<unsigned>(std::find(list, list + agenda_[i].count, candidate) - list));
}

/// The same, given its place; one from behind moves there.
template <int D>
void SkinLists<D>::remove_from_list(Slot i, unsigned q) {
  Agenda<D>& a = agenda_[i];
  if (q == a.count) return;
  std::uint32_t* const list = start_of(a);
  if (q < a.same) {
    list[q] = list[--a.same];
    q = a.same;
  }
  list[q] = list[--a.count];
  list[a.count] = packing_.pack(i, 0);
}

template <int D>
std::span<const std::uint32_t> SkinLists<D>::renew(Slot i, const Vec<D>& x) {
  Agenda<D>& a = agenda_[i];
  remove(i, centre(a));
  for (int k = 0; k < D; ++k) a.where.centre[k] = x[k];
  insert(i, x);
  const unsigned n = surround(i, x);
  if (fresh_.size() < n + 8) fresh_.resize(2 * n + 8);
  kept_.assign(a.count / 64 + 1u, 0);
  const std::uint32_t* const list = candidates(a);
  const unsigned fresh = kernels_.compare(list, a.count, found_.data(), n, fresh_.data(), kept_.data());
  for (unsigned q = a.count; q-- > 0;) {  // from the end: the one that moves up has been looked at
    if ((kept_[q / 64] >> (q % 64) & 1) != 0) continue;
    drop(packing_.slot(list[q]), packing_.reversed(i, list[q]));
    remove_from_list(i, q);
  }
  for (unsigned q = 0; q < fresh; ++q) {
    add(i, fresh_[q]);
    add(packing_.slot(fresh_[q]), packing_.reversed(i, fresh_[q]));
  }
  std::fill_n(fresh_.begin() + fresh, 8, packing_.pack(i, 0));
  return {fresh_.data(), fresh};
}

/// The sphere has been carried by so many boxes: its region goes with it, and the images in the lists follow.
template <int D>
void SkinLists<D>::shift(Slot i, const Image<D>& boxes) {
  Agenda<D>& a = agenda_[i];
  for (int k = 0; k < D; ++k) a.where.centre[k] += boxes[k] * box_.edges[k];
  const std::int32_t linear = packing_.linear(boxes);
  boxes_[i] += linear;
  std::uint32_t* const list = start_of(a);
  for (unsigned q = 0; q < a.count; ++q) {
    const std::uint32_t old = list[q], own = packing_.reversed(i, old);
    const Slot j = packing_.slot(old);
    list[q] = packing_.pack(j, packing_.linear(old) - linear);
    Agenda<D>& other = agenda_[j];
    std::uint32_t* const others = start_of(other);
    for (unsigned p = 0; p < other.count; ++p)
      if (others[p] == own) {
        others[p] = packing_.reversed(i, list[q]);
        divide(other);
        break;
      }
  }
  divide(a);
}

template <int D>
void SkinLists<D>::follow(std::span<const Record<D>> records) {
  for (Slot i = 0; i < records.size(); ++i) {
    Image<D> boxes{};
    bool carried = false;
    for (int k = 0; k < D; ++k) {
      if (!box_.periodic(k)) continue;
      boxes[k] =
          static_cast<std::int32_t>(std::nearbyint((records[i].x[k] - agenda_[i].where.centre[k]) / box_.edges[k]));
      carried = carried || boxes[k] != 0;
    }
    if (carried) shift(i, boxes);
  }
  const double limit = skin_ * skin_ * 0.9;
  for (Slot i = 0; i < records.size(); ++i)
    if (!((records[i].x - centre(agenda_[i])).squaredNorm() < limit)) renew(i, records[i].x);
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
  for (int k = 0; k < D; ++k) agenda_[i].where.centre[k] = x[k];
  agenda_[i].count = agenda_[i].same = 0;
  insert(i, x);
  const unsigned n = surround(i, x);
  assign(i, n);
  const std::vector<std::uint32_t> list(found_.begin(), found_.begin() + n);
  for (const std::uint32_t candidate : list) add(packing_.slot(candidate), packing_.reversed(i, candidate));
}

template <int D>
void SkinLists<D>::dismiss(Slot i) {
  Agenda<D>& a = agenda_[i];
  remove(i, centre(a));
  const std::uint32_t* const list = candidates(a);
  for (unsigned q = 0; q < a.count; ++q) drop(packing_.slot(list[q]), packing_.reversed(i, list[q]));
  assign(i, 0);
}

template <int D>
bool SkinLists<D>::move(Slot i, const Vec<D>& x, double room) {
  const double limit = room * (1 - 1e-6);
  if ((x - centre(agenda_[i])).squaredNorm() < limit * limit) return false;
  renew(i, x);
  return true;
}

template <int D>
std::span<const std::uint32_t> SkinLists<D>::find_near(Slot i, double astray) {
  const unsigned n = surround(i, centre(agenda_[i]), astray);
  return {found_.data(), n};
}

template class SkinLists<2>;
template class SkinLists<3>;

}  // namespace carom
