// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The terms of V that a simulation from Python was given.

#include <vector>

#include "engine/ranks/system.h"
#include "io/deck/deck.h"

namespace carom::python {

struct Force {
  const InteractionInfo* info;
  Parameters parameters;  ///< complete; bonds that were found within a distance stand as `pairs`
};

/// Makes them for the particles that a system has. What is found for the first system stays for the others.
template <int D>
class Terms {
 public:
  Terms() = default;
  /// Those of a deck, which the system has.
  Terms(const Deck& deck, const System<D>& system);

  const std::vector<Force>& all() const { return all_; }
  /// One more, to the system, too. Without it where it throws.
  void add(const InteractionInfo& info, Parameters complete, System<D>& system);
  /// In place of those that the system has; it has none where this throws.
  void make(System<D>& system);
  /// Where the system has not got them yet.
  void complete(System<D>& system) {
    if (system.interactions.size() != all_.size()) make(system);
  }

 private:
  std::vector<Force> all_;
};

}  // namespace carom::python
