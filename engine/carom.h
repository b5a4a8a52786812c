// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The library: the header for programs that use carom directly (engine/examples/).
//
//   auto system = std::make_unique<carom::System<2>>();
//   system->box.edges = {12, 6};                                             // hard walls by default
//   for (int k = 0; k < 5; ++k) system->particles.add({.x = {2.0 + 2 * k, 3.0}, .radius = 0.5});
//   add_interaction(*system, "harmonic-bond", {{"chain", true}, {"stiffness", 1.0}, {"rest_length", 2.0}});
//   carom::Simulation<2> run(std::move(system), "edda", {{"step", 0.01}}, {.end_time = 6});
//   run.run();
//   run.statistics().max_energy_error, run.system().particles.x …
//
// Integrators, interactions and their parameters have the same names as in decks (`carom methods`, `carom schema`).
// Mistakes throw carom::Error; its message says what to do.

#include "engine/base/error.h"
#include "engine/forces/add_interaction.h"
#include "engine/forces/forces.h"
#include "engine/forces/potentials/options.h"
#include "engine/integrators/integrator.h"
#include "engine/laws/interaction.h"
#include "engine/ranks/system.h"
#include "engine/run/mean_squared_displacement.h"
#include "engine/run/observable.h"
#include "engine/run/radial_distribution.h"
#include "engine/run/simulation.h"
#include "engine/setup/placement.h"
#include "engine/stepping/slab_core.h"
