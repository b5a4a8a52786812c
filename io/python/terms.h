// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The terms of V of a simulation in Python.

#include <vector>

#include "engine/ranks/system.h"
#include "io/deck/deck.h"

namespace carom::python {

struct Force {
  const InteractionInfo* info;
  Parameters parameters;  ///< complete; bonds found within a distance are stored as `pairs`
};

/// Makes the terms for the particles of a system. Bonds found in the first system are kept for later systems.
template <int D>
class Terms {
 public:
  Terms() = default;
  /// The terms of a deck, which the system has already.
  Terms(const Deck& deck, const System<D>& system);

  const std::vector<Force>& all() const { return all_; }
  /// Adds a term, to the system too; if this throws, the term is not added.
  void add(const InteractionInfo& info, Parameters complete, System<D>& system);
  /// Replaces the terms of the system, which has none if this throws.
  void make(System<D>& system);
  /// Adds the terms to a system that does not have them yet.
  void complete(System<D>& system) {
    if (system.interactions.size() != all_.size()) make(system);
  }

 private:
  std::vector<Force> all_;
};

}  // namespace carom::python
