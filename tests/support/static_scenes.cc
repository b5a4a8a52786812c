// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/static_scenes.h"

#include <cmath>
#include <numbers>

#include "tests/support/experiments.h"

namespace carom::test {

namespace {

/// Spheres with weight at rest between hard walls.
template <int D>
std::unique_ptr<System<D>> under_gravity(const Vec<D>& edges, const std::vector<Vec<D>>& x) {
  auto system = make_system<D>(edges, Boundary::wall, x, std::vector<Vec<D>>(x.size(), Vec<D>::Zero()));
  std::vector<double> down(D, 0.0);
  down.back() = -1;
  add_interaction(*system, "uniform-field", {{"acceleration", down}});
  return system;
}

/// Discs in rows, the first of n discs from wall to wall except for the margins, each other row in the notches of the
/// row below; `discs(row)` is the number of discs of a row.
template <typename Discs>
StaticScene<2> rows(int n, std::size_t count, double margin, Discs&& discs) {
  std::vector<Vec<2>> x;
  for (int row = 0; x.size() < count; ++row)
    for (int k = 0; k < discs(row) && x.size() < count; ++k)
      x.emplace_back(margin + 0.5 * (1 + n - discs(row)) + k, 0.5 + row * std::numbers::sqrt3 / 2);
  return {under_gravity<2>({n + 2 * margin, x.back()[1] + 3}, x)};
}

/// The layers of a heap.
StaticScene<3> layers(int n, double margin) {
  std::vector<Vec<3>> x;
  for (int layer = 0; layer < n; ++layer)
    for (int i = 0; i < n - layer; ++i)
      for (int j = 0; j < n - layer; ++j)
        x.emplace_back(margin + 0.5 + 0.5 * layer + i, margin + 0.5 + 0.5 * layer + j,
                       0.5 + layer * std::numbers::sqrt2 / 2);
  const double edge = n + 2 * margin;
  return {under_gravity<3>({edge, edge, 0.75 * n + 3}, x)};
}

constexpr Id kLeft = 0, kRight = 1, kFloor = 2;  // numbers of walls in 2-D
constexpr double kMargin = 2, kTrap = 2;         // around the bodies in a trap; stiffness of the trap

}  // namespace

template <int D>
StaticScene<D> in_trap(StaticScene<D> scene, double stiffness) {
  Vec<D> floor = 0.5 * scene.system->box.edges;
  floor[D - 1] = 0;
  add_interaction(*scene.system, "harmonic-trap",
                  {{"stiffness", stiffness}, {"centre", std::vector<double>(floor.begin(), floor.end())}});
  scene.reactions.clear();
  return scene;
}

template StaticScene<2> in_trap<2>(StaticScene<2>, double);
template StaticScene<3> in_trap<3>(StaticScene<3>, double);

StaticScene<2> column(int n) {
  std::vector<Vec<2>> x;
  std::vector<Reaction> reactions = {{.lo = 0, .hi = kFloor, .force = static_cast<double>(n)}};
  for (Id k = 0; k < static_cast<Id>(n); ++k) {
    x.emplace_back(2, 0.5 + k);
    if (k > 0) reactions.push_back({k - 1, k, false, static_cast<double>(n) - k});
  }
  return {under_gravity<2>({4, n + 3.0}, x), reactions};
}

StaticScene<2> pyramid(int n) {
  return rows(n, static_cast<std::size_t>(n * (n + 1) / 2), 0, [n](int row) { return n - row; });
}

StaticScene<2> trapped_crystal(int n) {
  const int left_out = (n - 1) / 2;  // discs in the longest row of the missing pyramid
  return in_trap(rows(n, static_cast<std::size_t>((n * (n + 1) - left_out * (left_out + 1)) / 2), kMargin,
                      [n](int row) { return n - row; }),
                 kTrap);
}

StaticScene<2> crystal(int n) {
  return rows(20, static_cast<std::size_t>(n), 0, [](int row) { return 20 - row % 2; });
}

StaticScene<2> arch(int keystones) {
  // Neighbours are 0.8 apart horizontally and 0.6 in height. A contact between a keystone and a disc at a wall has the
  // direction (0.8, 0.6), so it carries load / 1.2 for the load on a pair of discs.
  std::vector<Vec<2>> x;
  std::vector<Reaction> reactions;
  const auto total = static_cast<Id>(3 * keystones);
  for (Id level = 0; level < static_cast<Id>(keystones); ++level) {
    const Id left = 3 * level, right = left + 1, key = left + 2;
    const double y = 0.5 + 1.2 * level;
    x.insert(x.end(), {{0.5, y}, {2.1, y}, {1.3, y + 0.6}});
    const double above = total - 3.0 * (level + 1), on_pair = above + 1;  // weight above the keystone, and with it
    const double below = above + 3;                                       // with the discs at the walls
    reactions.push_back({left, key, false, on_pair / 1.2});
    reactions.push_back({right, key, false, on_pair / 1.2});
    const double sideways = 0.8 * on_pair / 1.2;  // from the keystone above
    if (level == 0) {
      reactions.push_back({.lo = left, .hi = kFloor, .force = below / 2});
      reactions.push_back({.lo = right, .hi = kFloor, .force = below / 2});
    } else {
      reactions.push_back({key - 3, left, false, below / 1.2});
      reactions.push_back({key - 3, right, false, below / 1.2});
    }
    const double from_below = level == 0 ? 0 : 0.8 * below / 1.2;  // from the keystone below
    reactions.push_back({.lo = left, .hi = kLeft, .force = sideways + from_below});
    reactions.push_back({.lo = right, .hi = kRight, .force = sideways + from_below});
  }
  return {under_gravity<2>({2.6, 1.2 * keystones + 3}, x), reactions};
}

StaticScene<3> heap(int n) { return layers(n, 0); }

StaticScene<3> trapped_heap() { return in_trap(layers(2, kMargin), kTrap); }

StaticScene<2> hanging_chain() {
  constexpr double kPull = 4, kStrut = 10, kStiffness = 200,
                   kLength = 1.25;  // horizontal pull of the chain; struts; springs
  constexpr Id kHigh = 4;           // discs in a column
  // From the left: the column's top, 8, 9 | 10, 11, the right column's top. Each spring carries the pull and the weight
  // below.
  const Vec<2> first = Vec<2>(kPull, -2.5), second = Vec<2>(kPull, -1.5);
  const Vec<2> a = Vec<2>(0.5, kHigh - 0.5) + kLength * first.normalized(), b = a + kLength * second.normalized();
  const double middle = b[0] + 0.5 * kLength, width = 2 * middle, rise = std::sqrt(1 - kLength * kLength / 4);
  std::vector<Vec<2>> x;
  for (const double side : {0.5, width - 0.5})
    for (Id k = 0; k < kHigh; ++k) x.emplace_back(side, 0.5 + k);
  x.insert(x.end(), {a, b, {width - b[0], b[1]}, {width - a[0], a[1]}, {middle, b[1] + rise}});
  StaticScene<2> scene{under_gravity<2>({width, 8}, x)};
  const auto spring = [&](Id i, Id j, double tension) {
    add_interaction(*scene.system, "harmonic-bond",
                    {{"pairs", PairList{{i, j}}},
                     {"stiffness", kStiffness},
                     {"rest_length", (x[i] - x[j]).norm() - tension / kStiffness}});
  };
  for (Id k = 0; k < kHigh; ++k) spring(k, kHigh + k, -kStrut);
  // The middle disc, 12, presses its two neighbours down by half its weight each, and apart.
  const double pressed = 0.5 / rise;
  spring(kHigh - 1, 8, first.norm());
  spring(8, 9, second.norm());
  spring(9, 10, kPull + pressed * 0.5 * kLength);
  spring(10, 11, second.norm());
  spring(11, 2 * kHigh - 1, first.norm());
  scene.reactions = {{9, 12, false, pressed}, {10, 12, false, pressed}};
  for (Id k = 0; k < kHigh; ++k) {
    const double above = kHigh - k + 2.5, sideways = k == kHigh - 1 ? kStrut - kPull : kStrut;
    scene.reactions.push_back({.lo = k, .hi = kLeft, .force = sideways});
    scene.reactions.push_back({.lo = kHigh + k, .hi = kRight, .force = sideways});
    for (const Id column : {Id{0}, kHigh})
      scene.reactions.push_back(k == 0 ? Reaction{.lo = column, .hi = kFloor, .force = above}
                                       : Reaction{column + k - 1, column + k, false, above});
  }
  return scene;
}

StaticScene<2> row_under_attraction(int n) {
  std::vector<Vec<2>> x;
  std::vector<Reaction> reactions;
  for (Id k = 0; k < static_cast<Id>(n); ++k) {
    x.emplace_back(10.0 + k, 10.0);
    if (k == 0) continue;
    double force = 0;  // sum of the forces across the contact
    for (Id i = 0; i < k; ++i)
      for (Id j = k; j < static_cast<Id>(n); ++j) force += 10.0 / ((j - i) * (j - i));
    reactions.push_back({k - 1, k, false, force});
  }
  auto system = make_system<2>({30, 30}, Boundary::open, x, std::vector<Vec<2>>(x.size(), Vec<2>::Zero()));
  add_interaction(*system, "gravity", {{"constant", 10.0}});
  return {std::move(system), reactions};
}

}  // namespace carom::test
