// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Contacts with thermal walls, and kicks of a bath: the new velocity is random and does not depend on the old one.
//
// Behind a thermal wall is a gas at rest relative to it: the tangential components are normal deviates, the component
// along the normal has the distribution of the particles that cross a plane (Tehver, Toigo, Koplik, Banavar, Phys. Rev.
// E 57 (1998) R17).

#include "engine/laws/contact_log.h"

namespace carom {

/// What the random numbers of a contact depend on, beside the seed.
struct Draw {
  Id id = 0;                 ///< the particle
  double time = 0;           ///< since the start of the run
  std::uint64_t number = 0;  ///< tells the contacts of a particle apart that have the same `time`
};

/// The velocity of a particle after a contact with a thermal wall.
template <int D>
Vec<D> thermal_velocity(const Wall<D>& wall, double mass, const Draw& draw, double t);

/// The velocity of a particle after a kick.
template <int D>
Vec<D> kicked_velocity(const Bath& bath, double mass, const Draw& draw);

}  // namespace carom
