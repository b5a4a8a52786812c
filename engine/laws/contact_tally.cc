// SPDX-License-Identifier: BSD-3-Clause
#include "engine/laws/contact_tally.h"

#include "engine/base/error.h"

namespace carom {

void throw_too_many_contacts(std::uint64_t most, const std::string& last) {
  std::string what = "more than max_events_per_step = " + std::to_string(most) + " collisions in one step";
  if (!last.empty()) what += ", the last between " + last;
  throw Error(Failure::numerical, what + "; use a smaller step or raise integrator.max_events_per_step");
}

}  // namespace carom
