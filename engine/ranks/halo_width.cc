// SPDX-License-Identifier: BSD-3-Clause
#include "engine/ranks/halo_width.h"

#include <algorithm>
#include <cmath>

namespace carom {
namespace {

constexpr double kMinSlack = 0.5, kMaxSlack = 2;  // largest displacement between divisions [largest diameter]
constexpr double kSlabsBetweenDivisions = 16;     // typical number of slabs between divisions
constexpr double kPathAllowance = 2;              // path allowed for, relative to the longest path
constexpr double kPathMargin = 1.25;              // path allowed for, relative to one that was too long
constexpr double kDecay = 0.75;                   // factor on enlarged widths after a division that was good enough

}  // namespace

void HaloWidth::fit(double reach, double path, double diameter) {
  path_ = std::max(kPathAllowance * path, wanted_path_);
  slack_ = std::clamp(kSlabsBetweenDivisions * path, kMinSlack * diameter, kMaxSlack * diameter);
  near_ = diameter + 2 * path_ + 2 * slack_;
  far_ = near_ + std::max(reach - diameter, depth_ * diameter);
  safe_slabs_ = 0;
}

void HaloWidth::ask_for_path(double path) {
  asked_ = std::isfinite(path);
  if (asked_) wanted_path_ = kPathMargin * path;
}

void HaloWidth::relax() {
  depth_ = std::max(kDecay * depth_, least_depth_);
  wanted_path_ *= kDecay;
}

}  // namespace carom
