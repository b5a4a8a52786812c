// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The [[particles]] tables: species by explicit positions or by count, with one mass, radius and charge a particle.

#include "io/deck/deck_source.h"

namespace carom {

/// "1 particle", "2 particles"
std::string count_of(std::size_t n, const std::string& what);

/// Fills `species`; vectors are not checked where the dimension is 0, that is not known.
void read_species(const DeckValues& values, std::size_t dimension, std::vector<SpeciesConfig>& species,
                  Problems& problems);

}  // namespace carom
