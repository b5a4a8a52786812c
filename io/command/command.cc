// SPDX-License-Identifier: BSD-3-Clause
#include "io/command/command.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <sstream>

#include "engine/setup/placement.h"
#include "io/deck/deck.h"
#include "io/deck/memory.h"
#include "io/deck/schema.h"
#include "io/deck/validate_state.h"
#include "io/files/log_report.h"
#include "io/files/version.h"

namespace carom {
namespace {

template <int D>
std::string box_text(const Box<D>& box) {
  std::ostringstream out;
  for (int k = 0; k < D; ++k)
    out << (k > 0 ? " x " : "") << box.edges[k] << " (" << find_boundary(box.boundary[k]).name << ")";
  return out.str();
}

std::string end_text(const Plan& plan) {
  std::ostringstream out;
  const auto part = [&](const std::string& text) { out << (out.tellp() > 0 ? " or " : "") << text; };
  if (plan.steps) part(std::to_string(*plan.steps) + " steps");
  if (plan.end_time) {
    std::ostringstream time;
    time << "time " << *plan.end_time;
    if (plan.accuracy == 0) time << " (" << std::ceil(*plan.end_time / plan.step * (1 - 1e-12)) << " steps)";
    part(time.str());
  }
  if (plan.collisions) part(std::to_string(*plan.collisions) + " collisions");
  return out.str();
}

template <int D>
int describe(Deck& deck) {
  const auto system = build_system<D>(deck);
  for (const std::string& warning : deck.warnings) std::cerr << warning << '\n';
  const Particles<D>& p = system->particles;
  std::cout << deck.file.string() << ": valid\n";
  if (!deck.title.empty()) std::cout << "title             " << deck.title << '\n';
  std::cout << "particles         " << p.size() << " in " << D << " dimensions";
  for (std::size_t s = 0; s < system->species.size(); ++s)
    std::cout << (s == 0 ? ": " : ", ") << std::count(p.species.begin(), p.species.end(), s) << " "
              << system->species[s];
  std::cout << "\nbox               " << box_text(system->box) << '\n';
  if (system->box.closed())
    std::cout << "packing fraction  " << packing_fraction<D>(system->box.volume(), p.radius) << '\n';
  std::cout << "interactions      " << system->interactions.size() << '\n';
  std::cout << "integrator        " << deck.integrator << ", " << steps_text(deck.plan) << '\n';
  std::cout << "ends at           " << end_text(deck.plan) << '\n';
  std::cout << "output            " << deck.output.directory.string() << '\n';
  const double memory = estimated_memory(*deck.source, &system->box);
  std::cout << "memory            about " << std::ceil(memory / 1e6) << " MB\n";
  return 0;
}

}  // namespace

int validate_command(const std::filesystem::path& file, const std::vector<std::string>& set) {
  Deck deck = read_deck(file, set);
  return deck.dimension == 2 ? describe<2>(deck) : describe<3>(deck);
}

std::string version_page() {
  return "carom " + version_string() + "\ncompiler: " + compiler_string() + "\nlibraries: " + library_versions();
}

}  // namespace carom
