// SPDX-License-Identifier: BSD-3-Clause
#include "engine/laws/boundary.h"

#include <algorithm>

#include "engine/base/parameters.h"

namespace carom {

const std::vector<BoundaryInfo>& boundaries() {
  static const std::vector<BoundaryInfo> all = {
      {Boundary::wall, "wall", "a hard wall; a sphere touches it when its centre is a radius away", "none"},
      {Boundary::periodic, "periodic", "a particle that leaves on one side enters on the other", "periodic"},
      {Boundary::open, "open", "no wall; the edge only determines how the box is drawn", "none"}};
  return all;
}

const BoundaryInfo& find_boundary(std::string_view name) { return find_named(boundaries(), "boundary", name); }

const BoundaryInfo& find_boundary(Boundary boundary) {
  return *std::ranges::find(boundaries(), boundary, &BoundaryInfo::boundary);
}

}  // namespace carom
