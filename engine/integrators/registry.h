// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// One line an integrator: the declaration that its own file ends in.

#include "engine/integrators/integrator.h"

namespace carom::integrator {

IntegratorInfo free_flight();
IntegratorInfo verlet();
IntegratorInfo psa();
IntegratorInfo cva();
IntegratorInfo mcva();
IntegratorInfo cdda();
IntegratorInfo edda();

/// The factory of an integrator template that is made from its parameters.
template <template <int> class T, int D>
std::unique_ptr<Integrator<D>> make(const Parameters& parameters) {
  return std::make_unique<T<D>>(parameters);
}

}  // namespace carom::integrator
