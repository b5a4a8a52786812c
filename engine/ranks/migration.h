// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Migration of particles with all their fields (fields.h) from their owners to the ranks that need them.

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "engine/base/bytes.h"
#include "engine/base/fields.h"
#include "engine/base/particles.h"

namespace carom {

/// Packs this rank's own particles into the messages that for_each_receiver(place, visit) visits; `particles` is the
/// number of particles in each message. Those for message number `here` stay: they are added to `stay` instead.
template <int D>
std::vector<Bytes> pack_own(const Fields& fields, const Particles<D>& p, const std::vector<std::uint64_t>& particles,
                            auto&& for_each_receiver, std::optional<std::size_t> here = {},
                            std::vector<Fields::Arrival>* stay = nullptr) {
  std::vector<Bytes> messages(particles.size());
  Bytes packed(sizeof(Id) + fields.bytes());
  for (Id i = 0; i < p.size(); ++i) {
    if (!p.owns(i)) continue;
    const Id id = p.id_of(i);
    bool is_packed = false;
    for_each_receiver(p.x[i], [&](std::size_t message) {
      if (message == here) {
        stay->push_back({id, i, nullptr});
        return;
      }
      if (!std::exchange(is_packed, true)) {
        std::memcpy(packed.data(), &id, sizeof id);
        fields.pack(i, packed.data() + sizeof id);
      }
      if (messages[message].empty()) messages[message].reserve(particles[message] * packed.size());
      messages[message].insert(messages[message].end(), packed.begin(), packed.end());
    });
  }
  return messages;
}

/// Replaces this rank's particles by those that stay, `arrivals` in the order of ids, and those in the messages,
/// ordered by id and not marked as ghosts. No id may occur twice; `total` is the number of particles on all ranks.
template <int D>
void receive_particles(Fields& fields, Particles<D>& p, const std::vector<Bytes>& messages, std::size_t total,
                       std::vector<Fields::Arrival> arrivals = {}) {
  const auto stayed = static_cast<std::ptrdiff_t>(arrivals.size());
  for (const Bytes& message : messages)
    for (Reader from(message); from.more();) {
      const Id id = from.template get<Id>();
      arrivals.push_back({id, 0, from.skip(fields.bytes())});
    }
  std::ranges::sort(arrivals.begin() + stayed, arrivals.end(), {}, &Fields::Arrival::id);
  std::ranges::inplace_merge(arrivals, arrivals.begin() + stayed, {}, &Fields::Arrival::id);
  fields.take(arrivals);
  p.id.clear();
  if (arrivals.size() < total)
    for (const Fields::Arrival& each : arrivals) p.id.push_back(each.id);
  p.ghost.assign(p.size(), 0);
}

}  // namespace carom
