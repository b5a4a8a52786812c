// SPDX-License-Identifier: BSD-3-Clause
// final_state DECK: runs a deck and writes the final positions, then the velocities, in the order of ids, as doubles to
// standard output. regression.py hashes them. Unlike the command, this program needs neither MPI nor HDF5, so it can be
// built for another processor or by another compiler with the library alone (CAROM_ENGINE_ONLY).

#include <cstdio>
#include <exception>

#include "io/deck/deck.h"

namespace {

template <int D>
void run(carom::Deck& deck) {
  auto system = carom::build_system<D>(deck);
  const auto& info = carom::find_integrator(deck.integrator);
  carom::Simulation<D> simulation(std::move(system), info, info.template make<D>(deck.integrator_parameters),
                                  deck.plan);
  simulation.run();
  const auto& particles = simulation.system().particles;
  for (const auto* vectors : {&particles.x, &particles.v})
    for (const carom::Vec<D>& each : *vectors) std::fwrite(each.data(), sizeof(double), D, stdout);
}

}  // namespace

int main(int, char** arguments) {
  try {
    carom::Deck deck = carom::read_deck(arguments[1], {});
    deck.dimension == 2 ? run<2>(deck) : run<3>(deck);
    return std::fflush(stdout) == 0 ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
