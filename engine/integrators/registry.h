// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// One line for each integrator: the declaration of the function at the end of its file.

#include "engine/integrators/integrator.h"

namespace carom::integrator {

IntegratorInfo free_flight();
IntegratorInfo verlet();
IntegratorInfo psa();
IntegratorInfo cva();
IntegratorInfo mcva();
IntegratorInfo cdda();
IntegratorInfo edda();

/// Makes an integrator from its parameters.
template <template <int> class T, int D>
std::unique_ptr<Integrator<D>> make(const Parameters& parameters) {
  return std::make_unique<T<D>>(parameters);
}

}  // namespace carom::integrator
