// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Collects the contacts of a slab when each rank has found the contacts of its own particles.

#include <algorithm>
#include <span>
#include <vector>

#include "engine/laws/contact_log.h"
#include "engine/laws/counters.h"
#include "engine/ranks/system.h"

namespace carom {

/// Appends the contacts in messages from all ranks, in the order of their keys.
template <int D>
void merge_contacts(std::vector<Bytes> messages, std::vector<Contact<D>>& to) {
  auto contacts = values_in<Contact<D>>(std::move(messages));
  std::ranges::sort(contacts, {}, &Contact<D>::key);
  to.insert(to.end(), contacts.begin(), contacts.end());
}

/// Counts the contacts of all ranks and appends them to `log` unless it is null; `found` are the contacts of this
/// rank's own particles and ghosts. Returns false, without any effect, if there are more than `most`.
template <int D>
bool commit_contacts(const System<D>& system, std::span<const Contact<D>> found, std::uint64_t most, Counters& counters,
                     std::vector<Contact<D>>* log) {
  const Particles<D>& p = system.particles;
  ContactTally tally;
  std::vector<Contact<D>> own;
  for (Contact<D> contact : found) {
    if (!p.owns(contact.key.lo)) continue;
    contact.key.lo = p.id_of(contact.key.lo);
    if (contact.key.kind == EventKind::pair) contact.key.hi = p.id_of(contact.key.hi);
    tally.record(contact, log ? &own : nullptr);
  }
  tally = system.decomposition.sum(tally);
  if (tally.contacts() > most) return false;
  counters.add(tally);
  if (log) merge_contacts<D>(system.decomposition.ranks().gather(message_of<Contact<D>>(own)), *log);
  return true;
}

}  // namespace carom
