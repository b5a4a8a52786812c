// SPDX-License-Identifier: BSD-3-Clause
#include "engine/laws/contact_tally.h"

#include "engine/base/error.h"

namespace carom {

void throw_too_many_contacts(const ContactLaws& laws, std::uint64_t most, const std::string& last) {
  std::string what = "more than max_events_per_step = " + std::to_string(most) + " collisions in one step";
  if (!last.empty()) what += ", the last between " + last;
  const char* remedy = "use a smaller step or raise integrator.max_events_per_step";
  if (!laws.elastic() && laws.restitution_when_slow == 0)
    remedy = "give the contacts a larger rest_speed, use a smaller step, or raise integrator.max_events_per_step";
  else if (!laws.elastic())
    remedy =
        "free flight cannot hold spheres that come to rest on each other: take integrator.type = \"edda\" or \"psa\", "
        "or, if nothing presses them together, give the contacts a larger rest_speed";
  throw Error(Failure::numerical, what + "; " + remedy);
}

}  // namespace carom
