// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Declarations of all types of interaction. Each is defined in the file with its name; registry.cc lists them.

#include "engine/laws/interaction.h"

namespace carom::types {

using Type = Parameter::Type;
using Range = Parameter::Range;

InteractionInfo harmonic_bond();
InteractionInfo gravity();
InteractionInfo coulomb();
InteractionInfo yukawa();
InteractionInfo lennard_jones();
InteractionInfo wca();
InteractionInfo morse();
InteractionInfo inverse_power();
InteractionInfo table();
InteractionInfo uniform_field();
InteractionInfo harmonic_trap();

}  // namespace carom::types
