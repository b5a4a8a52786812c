// SPDX-License-Identifier: BSD-3-Clause
#include "engine/ranks/bisection.h"

#include <algorithm>
#include <bit>

namespace carom {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Maps doubles to unsigned integers in the same order.
std::uint64_t ordered(double value) {
  const auto bits = std::bit_cast<std::uint64_t>(value + 0.0);  // −0 becomes +0
  constexpr std::uint64_t kSign = std::uint64_t{1} << 63;
  return (bits & kSign) != 0 ? ~bits : bits | kSign;
}
double from_ordered(std::uint64_t key) {
  constexpr std::uint64_t kSign = std::uint64_t{1} << 63;
  return std::bit_cast<double>((key & kSign) != 0 ? key & ~kSign : ~key);
}

/// The search for the wanted element of a sorted sequence that is distributed over all ranks.
struct OrderStatistic {
  struct Element {
    std::uint64_t key;
    std::uint32_t weight;  // how often the key occurs
  };
  std::vector<Element> elements;  // on this rank; finally only elements with the wanted key
  std::uint64_t number;           // index from 0, below the number of elements; unused if there are none
  std::uint64_t found = 0;        // the bits known so far
};

/// Finds the wanted elements by counting, digit by digit from the highest. All ranks get the same result.
void select(std::span<OrderStatistic> wanted, Communicator& ranks) {
  constexpr int kBits = 8;
  constexpr std::size_t kDigits = std::size_t{1} << kBits;
  std::vector<std::uint64_t> counts(wanted.size() * kDigits);
  for (int shift = 64 - kBits; shift >= 0; shift -= kBits) {
    std::ranges::fill(counts, 0);
    for (std::size_t w = 0; w < wanted.size(); ++w)
      for (const auto& [key, weight] : wanted[w].elements) counts[w * kDigits + (key >> shift) % kDigits] += weight;
    ranks.sum(counts);
    for (std::size_t w = 0; w < wanted.size(); ++w) {
      std::uint64_t digit = 0;
      for (const std::uint64_t* count = &counts[w * kDigits]; digit + 1 < kDigits && wanted[w].number >= count[digit];)
        wanted[w].number -= count[digit++];
      wanted[w].found |= digit << shift;
      std::erase_if(wanted[w].elements, [&](const auto& element) { return (element.key >> shift) % kDigits != digit; });
    }
  }
}

}  // namespace

template <int D>
struct Bisection<D>::Sphere {
  Vec<D> x;
  std::uint32_t work;
};

/// A part of the box still to be cut, into this many subdomains numbered from `first`.
template <int D>
struct Bisection<D>::Piece {
  Part part;
  std::uint32_t first;
  std::size_t subdomains;
  std::span<Sphere> spheres;        // spheres on this rank
  std::int32_t above_cut = kNoCut;  // the cut that has this piece on one side
  bool upper = false;
};

template <int D>
Bisection<D>::Bisection(const Box<D>& box, std::span<const Vec<D>> x, std::size_t subdomains, double reach,
                        Communicator& ranks, std::span<const std::uint32_t> work, double largest)
    : box_(box), reach_(reach), largest_(largest), parts_(std::max<std::size_t>(subdomains, 1)) {
  std::vector<Sphere> spheres(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) spheres[i] = {wrapped(x[i]), work.empty() ? 1 : work[i]};
  Piece all{.part = {}, .first = 0, .subdomains = parts_.size(), .spheres = spheres};
  for (int k = 0; k < D; ++k) {
    all.part.low[k] = box.periodic(k) ? 0 : -kInfinite;
    all.part.high[k] = box.periodic(k) ? box.edges[k] : kInfinite;
  }
  std::vector<Piece> pieces;
  attach(all, pieces);
  while (!pieces.empty()) pieces = cut(pieces, ranks);
  for (std::uint32_t r = 0; r < parts_.size(); ++r) neighbours_.push_back(neighbours_of(r));
}

/// Links a piece to the cut above it; stores it if it is a single subdomain, else appends it to the pieces to cut.
template <int D>
void Bisection<D>::attach(Piece piece, std::vector<Piece>& pieces) {
  const bool subdomain = piece.subdomains == 1;
  // Pieces are cut in this order.
  const auto node =
      subdomain ? ~static_cast<std::int32_t>(piece.first) : static_cast<std::int32_t>(cuts_.size() + pieces.size());
  if (piece.above_cut == kNoCut)
    root_ = node;
  else
    (piece.upper ? cuts_[static_cast<std::size_t>(piece.above_cut)].above
                 : cuts_[static_cast<std::size_t>(piece.above_cut)].below) = node;
  if (!subdomain) {
    pieces.push_back(std::move(piece));
    return;
  }
  Part& part = parts_[piece.first] = piece.part;
  part.centre = 0.5 * (part.low + part.high);
  part.half = 0.5 * (part.high - part.low);
  for (int k = 0; k < D; ++k)
    part.whole[k] = box_.periodic(k) ? part.low[k] == 0 && part.high[k] == box_.edges[k]
                                     : !std::isfinite(part.low[k]) && !std::isfinite(part.high[k]);
}

/// Cuts all pieces across their longest edges at once, in a sheared box never across x, so that the images of a
/// piece stay where they are while they slide; returns the pieces to cut further.
template <int D>
auto Bisection<D>::cut(std::span<const Piece> pieces, Communicator& ranks) -> std::vector<Piece> {
  // The extent of the spheres in each piece, used if the box has no edge there, and their work.
  std::vector<double> bounds;  // maxima of −x and of x
  std::vector<std::uint64_t> work;
  for (const Piece& piece : pieces) {
    Vec<D> low = box_.edges, high = Vec<D>::Zero();
    std::uint64_t& sum = work.emplace_back(0);
    for (const Sphere& sphere : piece.spheres) {
      low = low.cwiseMin(sphere.x).eval(), high = high.cwiseMax(sphere.x).eval();
      sum += sphere.work;
    }
    for (int k = 0; k < D; ++k) bounds.push_back(-low[k]), bounds.push_back(high[k]);
  }
  ranks.largest(bounds);
  ranks.sum(work);

  std::vector<OrderStatistic> wanted;
  for (std::size_t p = 0; p < pieces.size(); ++p) {
    const Piece& piece = pieces[p];
    Vec<D> low, high;
    int axis = box_.sheared() ? 1 : 0;
    for (int k = 0; k < D; ++k) {
      low[k] = std::isfinite(piece.part.low[k]) ? piece.part.low[k] : -bounds[2 * (p * D + k)];
      high[k] = std::isfinite(piece.part.high[k]) ? piece.part.high[k] : bounds[2 * (p * D + k) + 1];
    }
    for (int k = axis; k < D; ++k)
      if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
    const std::size_t below = piece.subdomains / 2;
    const double share = static_cast<double>(below) / static_cast<double>(piece.subdomains);
    cuts_.push_back({axis, low[axis] + (high[axis] - low[axis]) * share, 0, 0});
    cut_axes_[axis] = 1;
    OrderStatistic& split = wanted.emplace_back();
    split.number = work[p] / piece.subdomains * below + work[p] % piece.subdomains * below / piece.subdomains;
    for (const Sphere& sphere : piece.spheres) split.elements.push_back({ordered(sphere.x[axis]), sphere.work});
  }
  select(wanted, ranks);

  // In a crystal, cut between two layers: a cut through a layer would soon have its spheres on one side.
  const std::size_t first = cuts_.size() - pieces.size();
  std::vector<double> layer_below(pieces.size(), -kInfinite);
  for (std::size_t p = 0; p < pieces.size(); ++p)
    for (const Sphere& sphere : pieces[p].spheres)
      if (const double at = sphere.x[cuts_[first + p].axis]; at < from_ordered(wanted[p].found))
        layer_below[p] = std::max(layer_below[p], at);
  ranks.largest(layer_below);

  std::vector<Piece> further;
  for (std::size_t p = 0; p < pieces.size(); ++p) {
    const Piece& piece = pieces[p];
    Cut& cut = cuts_[first + p];
    const double layer = from_ordered(wanted[p].found);
    if (work[p] > 0) cut.at = std::isfinite(layer_below[p]) ? 0.5 * (layer_below[p] + layer) : layer;
    const auto middle = std::partition(piece.spheres.begin(), piece.spheres.end(),
                                       [&](const Sphere& sphere) { return sphere.x[cut.axis] < cut.at; });
    const auto number = static_cast<std::int32_t>(first + p);
    const std::size_t below = piece.subdomains / 2;
    Piece lower{piece.part, piece.first, below, {piece.spheres.begin(), middle}, number, false};
    Piece upper{piece.part,
                piece.first + static_cast<std::uint32_t>(below),
                piece.subdomains - below,
                {middle, piece.spheres.end()},
                number,
                true};
    lower.part.high[cut.axis] = upper.part.low[cut.axis] = cut.at;
    attach(lower, further);
    attach(upper, further);
  }
  return further;
}

template <int D>
std::uint32_t Bisection<D>::owner(const Vec<D>& at) const {
  std::int32_t node = root_;
  while (node >= 0) {
    const Cut& cut = cuts_[static_cast<std::size_t>(node)];
    node = at[cut.axis] < cut.at ? cut.below : cut.above;
  }
  return static_cast<std::uint32_t>(~node);
}

template <int D>
auto Bisection<D>::side(std::uint32_t subdomain, std::uint32_t other, const Vec<D>& at) const -> Side {
  const Part &mine = parts_[subdomain], &theirs = parts_[other];
  for (int k = 0; k < D; ++k) {
    const double half = 0.5 * box_.edges[k];
    if (!box_.periodic(k) || !(mine.high[k] <= theirs.low[k] || theirs.high[k] <= mine.low[k])) continue;
    if (!(std::max(mine.half[k], theirs.half[k]) + reach_ < (1 - 1e-9) * half)) continue;
    const double away = at[k] - mine.centre[k];  // the nearest image is above if this is in (0, ½] or below −½ edges
    return (away > 0) == (std::abs(away) <= half) ? Side::above : Side::below;
  }
  return Side::unknown;
}

template <int D>
bool Bisection<D>::clip(std::uint32_t subdomain, double margin, Vec<D>& low, Vec<D>& high) const {
  const Part& part = parts_[subdomain];
  for (int k = 0; k < D; ++k) {
    const double edge = box_.edges[k];
    const bool images = box_.periodic(k);
    if (part.whole[k] || (images && high[k] - low[k] > edge)) continue;
    double least = kInfinite, most = -kInfinite;
    for (int box = images ? -1 : 0; box <= (images ? 1 : 0); ++box) {
      const double from = std::max(low[k], part.low[k] - margin + box * edge);
      const double to = std::min(high[k], part.high[k] + margin + box * edge);
      if (from <= to) least = std::min(least, from), most = std::max(most, to);
    }
    if (!(least <= most)) return false;
    low[k] = least;
    high[k] = most;
  }
  return true;
}

template <int D>
std::vector<std::uint32_t> Bisection<D>::neighbours_of(std::uint32_t subdomain) const {
  const Part& mine = parts_[subdomain];
  std::vector<std::uint32_t> near;
  for (std::uint32_t r = 0; r < parts_.size(); ++r)
    if (const Part& other = parts_[r];
        r != subdomain && squared_distance(mine, mine.half + other.half, other.centre, other.low, other.high) <=
                              (1 + 1e-6) * reach_ * reach_)  // allows for rounding
      near.push_back(r);
  return near;
}

template class Bisection<2>;
template class Bisection<3>;

}  // namespace carom
