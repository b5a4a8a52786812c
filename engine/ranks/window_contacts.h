#pragma once
// The contacts of a window about which all subdomains agree.

#include <optional>

#include "engine/ranks/subdomain.h"

namespace carom {

template <int D>
class WindowContacts {
 public:
  /// Null: this rank has no subdomain, and no contacts.
  WindowContacts(const Box<D>& box, Subdomain<D>* subdomain) : box_(box), subdomain_(subdomain) {}

  /// Appends the contacts of which the lower id is owned.
  void append_to(std::vector<Contact<D>>& contacts) const;
  /// The key of the n-th pair collision of all ranks, from 1; none where there are fewer. Collective.
  std::optional<EventKey<D>> key_of_collision(std::uint64_t number, Communicator& ranks) const;

 private:
  /// Calls visit(slot, k) for each node k of a path that stands for a contact of which the lower id is owned.
  template <class Visit>
  void for_each(Visit&& visit) const;
  Contact<D> contact_of(Slot lo, std::size_t k) const;

  const Box<D>& box_;
  Subdomain<D>* subdomain_;
};

}  // namespace carom
