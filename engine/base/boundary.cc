// SPDX-License-Identifier: BSD-3-Clause
#include "engine/base/boundary.h"

#include <algorithm>

#include "engine/base/parameters.h"

namespace carom {

const std::vector<BoundaryInfo>& boundaries() {
  static const std::vector<BoundaryInfo> all = {
      {Boundary::wall, "wall", "hard and elastic; a sphere touches it when its centre is a radius away", "none"},
      {Boundary::periodic, "periodic", "what leaves on one side comes in on the other", "periodic"},
      {Boundary::open, "open", "nothing there; the edge is only where the box is drawn", "none"}};
  return all;
}

const BoundaryInfo& find_boundary(std::string_view name) { return find_named(boundaries(), "boundary", name); }

const BoundaryInfo& find_boundary(Boundary boundary) {
  return *std::ranges::find(boundaries(), boundary, &BoundaryInfo::boundary);
}

}  // namespace carom
