// SPDX-License-Identifier: BSD-3-Clause
#include "io/deck/memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <string>

#include "engine/base/error.h"
#include "engine/search/neighbour_list.h"

namespace carom {
namespace {

/// Bytes for lists of pairs within a cutoff: one partner per pair, each image of a particle counted separately.
template <int D>
double memory_of_pairs(double particles, double cutoff, const Box<D>& box) {
  double share = 1;  // fraction of the particles within a cutoff of a particle along each axis
  for (int k = 0; k < D; ++k) {
    const double within = 2 * cutoff / box.edges[k];
    share *= box.periodic(k) ? within : std::min(1.0, within);
  }
  constexpr double kSphere = D == 2 ? 0.785 : 0.524;  // volume over that of its square or cube
  return 0.5 * particles * particles * kSphere * share * sizeof(std::uint32_t);
}

}  // namespace

template <int D>
double estimated_memory(const Deck::Source& source, const Box<D>* box) {
  constexpr double program = 30e6;  // libraries and MPI
  constexpr double state = (2 * D + 3) * sizeof(double) + D * sizeof(std::int32_t) + sizeof(std::uint16_t);
  constexpr double events = 300, neighbours = 900;
  const auto particles = static_cast<double>(source.particles());
  const auto pair = [](const InteractionConfig& term) { return term.info->kind == InteractionInfo::Kind::pair; };
  const bool lists = std::ranges::any_of(source.interactions, pair);
  double radius = 0;  // the largest one
  for (const SpeciesConfig& species : source.species)
    if (!species.radius.empty()) radius = std::max(radius, std::ranges::max(species.radius));
  double bytes = program + particles * (2 * state + events + (lists ? neighbours : 0));
  for (const InteractionConfig& term : source.interactions)
    if (box && pair(term) && term.parameters.has("cutoff"))
      bytes += memory_of_pairs(particles, term.parameters.real("cutoff"), *box);
  // A candidate of the event core, or a NeighbourPair in the list of a method with steps; and one that counts energies.
  constexpr double of_pair = 2.0 * sizeof(NeighbourPair<D>) / sizeof(std::uint32_t);
  if (box && !box->steps.empty()) bytes += of_pair * memory_of_pairs(particles, 2 * box->steps.reach()(radius), *box);
  return bytes;
}

double available_memory() {
  double there = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
  std::ifstream machine("/proc/meminfo");
  std::string line;
  while (std::getline(machine, line))
    if (line.starts_with("MemAvailable:")) there = 1024 * std::stod(line.substr(13));
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
    there = std::min(there, static_cast<double>(limit.rlim_cur));
  return there;
}

template <int D>
void check_memory(const Deck::Source& source, const Box<D>* box, int ranks) {
  const double need = estimated_memory(source, box), there = available_memory();
  if (need <= there * ranks) return;
  Place place = std::ranges::max_element(source.species, {}, &SpeciesConfig::count)->at;
  std::string remedy = "take fewer particles, or more ranks on more machines";
  if (box && estimated_memory<D>(source, nullptr) <= there * ranks) {
    remedy = "take a shorter cutoff; in a periodic box each particle meets all images of each other within it";
    const auto cutoff = [](const InteractionConfig& term) {
      return term.parameters.has("cutoff") ? term.parameters.real("cutoff") : 0.0;
    };
    if (!box->steps.empty()) {
      place = source.values.list("step").front().at;
      remedy = "take shorter ranges of steps and cutoffs";
    } else {
      place = std::ranges::max_element(source.interactions, {}, cutoff)->at;
    }
  }
  Problems problems;
  problems.error(place,
                 "a run of " + std::to_string(source.particles()) + " particles needs about " +
                     short_text(need / 1e9, 3) + " GB of memory; " + short_text(there / 1e9, 3) + " GB are free here",
                 remedy);
  problems.throw_errors(Failure::initial_state);
}

template double estimated_memory(const Deck::Source&, const Box<2>*);
template double estimated_memory(const Deck::Source&, const Box<3>*);
template void check_memory(const Deck::Source&, const Box<2>*, int);
template void check_memory(const Deck::Source&, const Box<3>*, int);

}  // namespace carom
