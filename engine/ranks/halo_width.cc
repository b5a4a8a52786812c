// SPDX-License-Identifier: BSD-3-Clause
#include "engine/ranks/halo_width.h"

#include <algorithm>
#include <cmath>

namespace carom {
namespace {

constexpr double kLeastSlack = 0.5, kMostSlack = 2;  // that a particle comes between divisions [largest diameter]
constexpr double kSlabsApart = 16;                   // divisions, about
constexpr double kPathFactor = 2;                    // factor between the longest path and the one allowed for
constexpr double kPathRoom = 1.25;                   // for a path that was too long
constexpr double kForget = 0.75;                     // of what was asked for is kept after a division that was enough

}  // namespace

void HaloWidth::fit(double reach, double path, double diameter) {
  path_ = std::max(kPathFactor * path, wanted_path_);
  slack_ = std::clamp(kSlabsApart * path, kLeastSlack * diameter, kMostSlack * diameter);
  near_ = std::max(reach, diameter) + 2 * path_ + 2 * slack_;
  far_ = near_ + depth_ * diameter;
  safe_slabs_ = 0;
}

void HaloWidth::ask_for_path(double path) {
  asked_ = std::isfinite(path);
  if (asked_) wanted_path_ = kPathRoom * path;
}

void HaloWidth::ask_for_depth() {
  depth_ *= 2;
  asked_ = true;
}

void HaloWidth::relax() {
  depth_ = std::max(kForget * depth_, least_depth_);
  wanted_path_ *= kForget;
}

}  // namespace carom
