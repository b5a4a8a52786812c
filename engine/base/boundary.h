// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What bounds a box along an axis, and the declarations that make the kinds known by their names: decks, their schema,
// messages and files take them from here. What a boundary does is in Box (box.h) and Wall (wall.h).

#include <cstdint>
#include <string_view>
#include <vector>

namespace carom {

enum class Boundary : std::uint8_t { wall, periodic, open };

/// The declaration of a boundary; engine/base/boundary.cc lists them all.
struct BoundaryInfo {
  Boundary boundary;
  std::string_view name;     ///< as in the deck: `boundary = ["…", …]`
  std::string_view meaning;  ///< a clause for the manual: what it does
  std::string_view h5md;     ///< the word that H5MD has for it
};

/// Every boundary there is, in the order of the manual.
const std::vector<BoundaryInfo>& boundaries();

/// The one of that name; throws Error(Failure::deck), which lists the names.
const BoundaryInfo& find_boundary(std::string_view name);
const BoundaryInfo& find_boundary(Boundary boundary);

}  // namespace carom
