#include "engine/skin_lists.h"

#include <cmath>
#include <cstring>

namespace carom {
namespace {

constexpr double kPlaces = 1024;  // to a cell, along each axis

template <int D>
Vec<D> centre(const Agenda<D>& a) {
  Vec<D> c;
  for (int k = 0; k < D; ++k) c[k] = a.where.centre[k];
  return c;
}

}  // namespace

template <int D>
SkinLists<D>::SkinLists(const Box<D>& box, const Packing<D>& packing, const ScanKernels& kernels,
                        std::span<const double> radius, double skin, PageVector<Agenda<D>>& agenda)
    : box_(box), packing_(packing), kernels_(kernels), radius_(radius), skin_(skin), agenda_(agenda) {
  const double largest = *std::max_element(radius.begin(), radius.end());
  exact_ =
      radius.size() > 1 || std::find(box.boundary.begin(), box.boundary.end(), Boundary::open) != box.boundary.end();
  if (radius.size() > 1) {
    level_.resize(radius.size());
    for (std::size_t i = 0; i < radius.size(); ++i)
      level_[i] = static_cast<std::uint8_t>(std::clamp(std::floor(std::log2(largest / radius[i])), 0.0, 30.0));
  }
}

template <int D>
void SkinLists<D>::build(std::span<const Record<D>> records) {
  const std::size_t n = records.size();
  std::vector<Vec<D>> x(n);
  for (std::size_t i = 0; i < n; ++i) x[i] = records[i].x;
  // 1. Cells for each size.
  levels_.clear();
  const std::size_t levels = level_.empty() ? 1 : 1 + *std::max_element(level_.begin(), level_.end());
  for (std::size_t l = 0; l < levels; ++l) {
    double largest = level_.empty() ? radius_[0] : 0;
    for (std::size_t i = 0; i < level_.size(); ++i)
      if (level_[i] == l) largest = std::max(largest, radius_[i]);
    // Places are rounded down to 1024ths: two of them may come out nearer or farther by one in each direction.
    const double edge = 2 * (std::max(largest, 1e-300) + skin_) * (1 + 2 * std::sqrt(D) / kPlaces);
    CellGrid<D> grid(box_, edge, x);
    Level level{grid, largest, {}, {}};
    level.lines.resize(grid.cells());
    for (auto& line : level.lines) std::fill_n(line.slot, 8, kNobody);
    level.next.assign(grid.cells(), kNobody);
    levels_.push_back(std::move(level));
  }
  // 2. Everybody into a cell.
  boxes_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    for (int k = 0; k < D; ++k) agenda_[i].where.centre[k] = x[i][k];
    insert(static_cast<Slot>(i), x[i]);
  }
  x = {};
  // 3. Lists.
  pool_.clear();
  pool_.reserve(24 * n);
  for (auto& unused : unused_) unused.clear();
  for (std::size_t i = 0; i < n; ++i) {
    agenda_[i].capacity = 0;
    assign(static_cast<Slot>(i), surround(static_cast<Slot>(i), records[i].x));
  }
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
  const Image<D> boxes = level.grid.boxes(cell);
  boxes_[i] = packing_.linear(boxes);
  if (!packing_.fits(boxes)) throw_too_far();
  std::uint32_t code = 0;
  for (int k = 0; k < D; ++k) code |= static_cast<std::uint32_t>(place[k]) << (10 * k);
  std::uint32_t line = static_cast<std::uint32_t>(level.grid.index(cell));
  for (;;) {
    for (int q = 0; q < 8; ++q)
      if (level.lines[line].slot[q] == kNobody) {
        level.lines[line].slot[q] = i;
        level.lines[line].place[q] = code;
        return;
      }
    if (level.next[line] == kNobody) {
      std::uint32_t fresh = level.free;
      if (fresh != kNobody) {
        level.free = level.next[fresh];
      } else {
        fresh = static_cast<std::uint32_t>(level.lines.size());
        level.lines.emplace_back();
        level.next.push_back(kNobody);
      }
      std::fill_n(level.lines[fresh].slot, 8, kNobody);
      level.next[fresh] = kNobody;
      level.next[line] = fresh;
    }
    line = level.next[line];
  }
}

template <int D>
void SkinLists<D>::remove(Slot i, const Vec<D>& x) {
  Level& level = levels_[level_of(i)];
  const std::uint32_t first = static_cast<std::uint32_t>(level.grid.index(level.grid.cell(x)));
  for (std::uint32_t line = first, before = kNobody;; before = line, line = level.next[line]) {
    CellLine& cell = level.lines[line];
    for (int q = 0; q < 8; ++q) {
      if (cell.slot[q] != i) continue;
      cell.slot[q] = kNobody;
      const bool empty = std::all_of(cell.slot, cell.slot + 8, [](auto s) { return s == kNobody; });
      if (before != kNobody && empty) {
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
unsigned SkinLists<D>::surround(Slot i, const Vec<D>& x) {
  unsigned found = 0;
  for (const Level& level : levels_) look_into(level, i, x, found);
  return found;
}

template <int D>
void SkinLists<D>::look_into(const Level& level, Slot i, const Vec<D>& x, unsigned& found) {
  Place place;
  const Cell<D> cell = locate(level, x, place);
  NearTask task{level.lines.data(), level.next.data(), {}, {}, {}, {}, 0};
  double rounding = 0;
  const double reach = radius(i) + level.largest_radius + 2 * skin_;
  std::int32_t range[D];
  for (int k = 0; k < D; ++k) {
    const double scale = level.grid.edge(k) / kPlaces;
    task.at[k] = static_cast<float>(place[k]);
    task.scale[k] = static_cast<float>(scale);
    rounding += scale * scale;
    const double places = reach * (1 + 2 * std::sqrt(D) / kPlaces);
    range[k] = places <= level.grid.edge(k) ? 1 : static_cast<std::int32_t>(std::ceil(places / level.grid.edge(k)));
    if (!box_.periodic(k)) range[k] = std::min(range[k], level.grid.count(k));
  }
  const double limit = (reach + std::sqrt(rounding)) * (1 + 1e-5);
  task.limit_squared = static_cast<float>(limit * limit);

  // The cells in reach, with the square of the distance to the nearest point of each.
  std::size_t images = 1;  // how often a cell may be seen
  for (int k = 0; k < D; ++k) {
    steps_[k].clear();
    images *= static_cast<std::size_t>(1 + 2 * range[k] / level.grid.count(k));
    for (std::int32_t o = -range[k]; o <= range[k]; ++o) {
      typename CellGrid<D>::Step step;
      if (!level.grid.step(k, cell[k] + o, step)) continue;
      if (std::abs(step.boxes) > packing_.largest()) throw_too_far();
      const float offset = static_cast<float>(o) * static_cast<float>(kPlaces);
      const float places = o == 0  ? 0
                           : o > 0 ? offset - task.at[k] - 1
                                   : task.at[k] - offset - static_cast<float>(kPlaces);
      const float gap = std::max(places, 0.0f) * task.scale[k];
      steps_[k].push_back(
          {static_cast<std::uint32_t>(step.offset), step.boxes * (1 << (packing_.field_bits * k)), offset, gap * gap});
    }
  }
  if constexpr (D == 2) steps_[2].assign(1, {0, 0, 0, 0});
  std::size_t cells = 1;
  for (int k = 0; k < 3; ++k) {
    task.step[k] = steps_[k].data();
    task.steps[k] = static_cast<unsigned>(steps_[k].size());
    cells *= steps_[k].size();
  }
  // Lines beyond the first of their cells may all be here.
  const std::size_t most = 8 * (cells + (level.lines.size() - level.grid.cells()) * images);
  if (slots_.size() < most) slots_.resize(2 * most), away_.resize(2 * most);
  const unsigned n = kernels_.near(task, slots_.data(), away_.data());
  if (found_.size() < found + n + 8) found_.resize(2 * (found + n + 8));

  for (unsigned q = 0; q < n; ++q) {
    const Slot j = slots_[q];
    if (j == i) continue;
    const std::int32_t linear = boxes_[j] - away_[q];
    if ((boxes_[j] | away_[q]) != 0) {
      const Image<D> theirs = packing_.image(packing_.pack(0, boxes_[j])),
                     seen = packing_.image(packing_.pack(0, away_[q]));
      for (int k = 0; k < D; ++k)
        if (std::abs(theirs[k] - seen[k]) > packing_.largest()) throw_too_far();
    }
    const std::uint32_t candidate = packing_.pack(j, linear);
    if (exact_) {
      const Vec<D> d = x - centre(agenda_[j]) + box_.shift(packing_.image(candidate));
      const double within = radius(i) + radius(j) + 2 * skin_;
      if (!(d.squaredNorm() < within * within)) continue;
    }
    found_[found++] = candidate;
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
  const std::size_t at = pool_.size();
  pool_.resize(at + std::size_t{8} * units);
  return static_cast<std::uint32_t>(at / 8);
}

/// Makes the first n of found_ the list of a sphere.
template <int D>
void SkinLists<D>::assign(Slot i, unsigned n) {
  Agenda<D>& a = agenda_[i];
  const unsigned units = std::max(1u, (n + 7) / 8);
  if (units > a.capacity) {
    if (units > std::numeric_limits<std::uint16_t>::max() / 8)
      throw Error(Failure::numerical, "a sphere has more than 65 thousand neighbours");
    if (a.capacity > 0) unused_[a.capacity].push_back(a.list);
    a.list = take(units);
    a.capacity = static_cast<std::uint16_t>(units);
  }
  std::uint32_t* const list = &pool_[std::size_t{8} * a.list];
  const std::uint32_t self = packing_.pack(i, 0);
  std::int32_t any = 0;
  for (unsigned q = 0; q < n; ++q) {
    list[q] = found_[q];
    any |= packing_.linear(found_[q]);
  }
  for (unsigned q = n; q < 8u * a.capacity; ++q) list[q] = self;
  a.count = static_cast<std::uint16_t>(n);
  a.shifted = any != 0;
}

template <int D>
void SkinLists<D>::add(Slot i, std::uint32_t candidate) {
  Agenda<D>& a = agenda_[i];
  if (a.count == 8u * a.capacity) {
    std::vector<std::uint32_t> longer(candidates(a), candidates(a) + a.count);
    longer.push_back(candidate);
    longer.swap(found_);
    assign(i, a.count + 1u);
    longer.swap(found_);
    return;
  }
  pool_[std::size_t{8} * a.list + a.count++] = candidate;
  a.shifted = a.shifted || packing_.linear(candidate) != 0;
}

template <int D>
void SkinLists<D>::drop(Slot i, std::uint32_t candidate) {
  Agenda<D>& a = agenda_[i];
  std::uint32_t* const list = &pool_[std::size_t{8} * a.list];
  for (unsigned q = 0; q < a.count; ++q) {
    if (list[q] != candidate) continue;
    list[q] = list[--a.count];
    list[a.count] = packing_.pack(i, 0);
    return;
  }
}

template <int D>
unsigned SkinLists<D>::renew(Slot i, const Vec<D>& x) {
  Agenda<D>& a = agenda_[i];
  remove(i, centre(a));
  for (int k = 0; k < D; ++k) a.where.centre[k] = x[k];
  insert(i, x);
  const unsigned n = surround(i, x);
  // Those who are gone and those who are new are told. Both lists are padded with the sphere itself.
  const std::uint32_t* const list = candidates(a);
  const unsigned before = a.count;
  for (unsigned q = n; q % 8 != 0; ++q) found_[q] = packing_.pack(i, 0);
  const auto among = [](const std::uint32_t* all, unsigned count, std::uint32_t one) {
    typedef std::uint32_t Four __attribute__((vector_size(16)));
    Four found{};
    for (unsigned q = 0; q < count; q += 4) {
      Four four;
      std::memcpy(&four, all + q, sizeof four);
      found |= (Four)(four == one);
    }
    std::uint64_t halves[2];
    std::memcpy(halves, &found, sizeof halves);
    return (halves[0] | halves[1]) != 0;
  };
  gone_.clear();
  for (unsigned q = 0; q < before; ++q)
    if (!among(found_.data(), n, list[q])) gone_.push_back(list[q]);
  unsigned old = n;  // those who stay come first
  for (unsigned q = 0; q < old;)
    if (among(list, before, found_[q]))
      ++q;
    else
      std::swap(found_[q], found_[--old]);
  assign(i, n);
  for (const std::uint32_t candidate : gone_) drop(packing_.slot(candidate), packing_.reversed(i, candidate));
  for (unsigned q = old; q < n; ++q) add(packing_.slot(found_[q]), packing_.reversed(i, found_[q]));
  return n - old;
}

/// The sphere has been carried by so many boxes: its region goes with it, and the images in the lists follow.
template <int D>
void SkinLists<D>::shift(Slot i, const Image<D>& boxes) {
  Agenda<D>& a = agenda_[i];
  for (int k = 0; k < D; ++k) a.where.centre[k] += boxes[k] * box_.edges[k];
  const std::int32_t linear = packing_.linear(boxes);
  boxes_[i] += linear;
  std::uint32_t* const list = &pool_[std::size_t{8} * a.list];
  a.shifted = true;
  for (unsigned q = 0; q < a.count; ++q) {
    const std::uint32_t old = list[q], own = packing_.reversed(i, old);
    const Slot j = packing_.slot(old);
    list[q] = packing_.pack(j, packing_.linear(old) - linear);
    Agenda<D>& other = agenda_[j];
    std::uint32_t* const others = &pool_[std::size_t{8} * other.list];
    for (unsigned p = 0; p < other.count; ++p)
      if (others[p] == own) {
        others[p] = packing_.reversed(i, list[q]);
        other.shifted = true;
        break;
      }
  }
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

template class SkinLists<2>;
template class SkinLists<3>;

}  // namespace carom
