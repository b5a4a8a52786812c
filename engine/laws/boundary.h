// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The kinds of boundary along an axis and their declarations, from which decks, their schema, messages and files take
// the names. Box (box.h) and Wall (wall.h) implement what a boundary does.

#include <cstdint>
#include <string_view>
#include <vector>

namespace carom {

enum class Boundary : std::uint8_t { wall, periodic, open };

/// The declaration of a boundary; engine/laws/boundary.cc lists them all.
struct BoundaryInfo {
  Boundary boundary;
  std::string_view name;     ///< as in the deck: `boundary = ["…", …]`
  std::string_view meaning;  ///< a clause for the manual: what it does
  std::string_view h5md;     ///< the word that H5MD has for it
};

/// All kinds of boundary, in the order of the manual.
const std::vector<BoundaryInfo>& boundaries();

/// The declaration of this boundary; throws Error(Failure::deck), which lists the names, if there is none.
const BoundaryInfo& find_boundary(std::string_view name);
const BoundaryInfo& find_boundary(Boundary boundary);

}  // namespace carom
