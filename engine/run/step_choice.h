// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The steps of a run before its clock knows better: what the parameters of a method say, the first step of a method
// that chooses its steps, and the longest one that it may choose.

#include "engine/run/simulation.h"

namespace carom {

/// Completes the parameters of a method that chooses its steps, or epochs, if no step is given: the first step, or
/// `step`, which was the first one when the run began. Collective.
template <int D>
void choose_step(const System<D>& system, const IntegratorInfo& info, const Plan& plan, Parameters& given,
                 double step = 0);

/// Takes the steps of a plan from the parameters of its method.
void set_steps(Plan& plan, const Parameters& parameters);

/// The first step of a method that chooses its steps [time]: at most Plan::step, and so short that no particle moves
/// farther than its diameter times the cube root of the accuracy, by its velocity or by the forces on it. Collective.
template <int D>
double first_step(const System<D>& system, const Plan& plan);

/// The longest step that the plan, the walls, the bath and the fastest particle allow [time], and the largest
/// acceleration by forces, `strongest` [length/time²]. Collective.
template <int D>
double longest_step(const System<D>& system, const Plan& plan, double strongest);

}  // namespace carom
