// SPDX-License-Identifier: BSD-3-Clause
// The initial positions of the particles.

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <sstream>
#include <utility>

#include "engine/base/elementary.h"
#include "engine/ranks/id_blocks.h"
#include "engine/setup/compression.h"
#include "engine/setup/placement.h"
#include "io/deck/deck_source.h"

namespace carom {
namespace {

/// The words of one line up to the first word that is not a finite number.
struct Words {
  std::vector<double> numbers;
  std::string_view wrong;  // the word that is not a finite number; empty: none
  std::size_t column = 1;  // column of `wrong`, from 1
  bool a_number = false;   // `wrong` is a number, but not finite
};

Words words_of(std::string_view line) {
  line = line.substr(0, line.find('#'));
  Words words;
  std::size_t at = 0;
  constexpr const char* separators = ",; \t\r";
  while ((at = line.find_first_not_of(separators, at)) != std::string_view::npos) {
    const std::size_t end = std::min(line.find_first_of(separators, at), line.size());
    const char* first = line.data() + at + (line[at] == '+' ? 1 : 0);
    double value = 0;
    const auto [stop, failed] = std::from_chars(first, line.data() + end, value);
    if (failed != std::errc{} || stop != line.data() + end || !std::isfinite(value)) {
      words.wrong = line.substr(at, end - at);
      words.column = at + 1;
      words.a_number = failed == std::errc{} && stop == line.data() + end;
      return words;
    }
    words.numbers.push_back(value);
    at = end;
  }
  return words;
}

/// A word for messages; it may contain arbitrary bytes.
std::string shown(std::string_view word) {
  constexpr std::size_t kMostShown = 20;
  std::string text(word.substr(0, kMostShown));
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < ' ' || c > '~'; }, '?');
  return "'" + text + (word.size() > kMostShown ? "…'" : "'");
}

template <int D>
void place_from_file(const Deck::Source& source, const std::vector<Id>& placed, System<D>& system) {
  const auto& positions = source.placement.positions;
  if (positions.size() != placed.size()) {
    Problems problems;
    problems.error({source.placement.file.string()},
                   "this file has " + std::to_string(positions.size()) + " positions for " +
                       std::to_string(placed.size()) + " particles given by count",
                   "give one line for each");
    problems.throw_errors(Failure::deck);
  }
  for (std::size_t n = 0; n < placed.size(); ++n)
    system.particles.x[placed[n]] = Eigen::Map<const Vec<D>>(positions[n].data());
}

/// The packing fraction at which random insertion jams.
template <int D>
constexpr double kJammed = D == 2 ? 0.547 : 0.384;

[[noreturn]] void refuse(const Place& at, const std::string& what, const std::string& remedy) {
  throw Error(Failure::initial_state, at.text() + ": error: " + what + "; " + remedy);
}

template <int D>
void place_at_random(const Deck::Source& source, const std::vector<Id>& placed, System<D>& system, const Pause& pause) {
  const Box<D>& box = system.box;
  const bool points = !source.integrator->hard_cores;
  std::vector<double> radius = system.particles.radius;
  if (points)
    radius.assign(radius.size(),
                  0.5 * source.placement.distance.value_or(default_distance<D>(radius.size(), box.volume())));
  const std::string name = points ? "placement.distance" : "the largest diameter";
  const double largest = 2 * *std::ranges::max_element(radius);
  for (int k = 0; k < D; ++k)
    if (box.boundary[k] != Boundary::open && largest > box.edges[k] + box.gap_tolerance()(largest))
      refuse(source.placement.at,
             name + " is " + short_text(largest) + ", and the box is " + short_text(box.edges[k]) + " long on axis " +
                 std::to_string(k),
             points ? "give a smaller one, or leave it out" : "enlarge the box or make the spheres smaller");
  const std::size_t done = insert_at_random<D>(box, system.particles.x, radius, placed, source.placement.seed, pause);
  if (done == placed.size()) return;
  const std::string of = std::to_string(done + 1) + " of " + std::to_string(placed.size());
  const std::string jammed = short_text(kJammed<D>, 3);
  if (points)
    refuse(source.placement.at,
           "random insertion found no place for particle " + of + " at the distance " + short_text(largest) +
               " from all others",
           "give a smaller placement.distance, or leave it out");
  refuse(source.placement.at,
         "random insertion found no place for sphere " + of +
             " (packing fraction wanted: " + std::to_string(packing_fraction<D>(box.volume(), radius)) +
             (box.plain() ? ")" : " of the box, part of which is behind walls)"),
         box.has(Boundary::open)
             ? "take fewer or smaller spheres, or make the boundaries walls and take type = \"compressed\""
             : "take type = \"compressed\" or a lattice, a larger box or fewer spheres; insertion jams at a packing "
               "fraction of " +
                   jammed);
}

template <int D>
void place_by_compression(const Deck::Source& source, System<D>& system, const Pause& pause) {
  using End = typename Compression<D>::End;
  const PlacementConfig& placement = source.placement;
  const auto& radius = system.particles.radius;
  Compression<D> done = compress<D>(system.box, radius,
                                    {.seed = placement.seed,
                                     .growth_rate = placement.growth_rate,
                                     .max_collisions = placement.max_collisions,
                                     .pause = pause});
  if (done.reached()) {
    system.particles.x = std::move(done.x);
    return;
  }
  const double wanted = packing_fraction<D>(system.box.volume(), radius);
  std::ostringstream what, remedy;
  what.precision(4);
  if (done.end == End::no_room) {
    what << "the spheres have no room in the box: the largest diameter is "
         << 2 * *std::max_element(radius.begin(), radius.end()) << ", the shortest edge "
         << system.box.edges.minCoeff();
    remedy << "enlarge the box or make the spheres smaller";
  } else {
    what << (done.end == End::jammed ? "the spheres jammed" : "compression gave up") << " at packing fraction "
         << wanted * elementary::pow(done.factor, D) << ", short of " << wanted << " (reduced pressure "
         << done.reduced_pressure << ", " << std::round(done.collisions) << " collisions a particle)";
    if (done.end == End::too_many_collisions) remedy << "raise placement.max_collisions, or ";
    remedy << "take a lower packing fraction, a smaller placement.growth_rate (is " << placement.growth_rate
           << ") or another seed; "
           << (D == 2 ? "discs of two sizes jam near 0.84, equal discs crystallise"
                      : "equal spheres jam at 0.64 to 0.65 unless they crystallise");
  }
  refuse(placement.at, what.str(), remedy.str());
}

/// The sites of each species are drawn; its particles fill them in the order of their coordinates.
template <int D>
void place_on_lattice(const Deck::Source& source, Lattice lattice, System<D>& system, const Pause& pause) {
  std::vector<std::size_t> counts;
  for (const SpeciesConfig& species : source.species) counts.push_back(species.count);
  Particles<D>& p = system.particles;
  double margin = 0;
  for (const SpeciesConfig& species : source.species)
    margin = std::max(margin, *std::ranges::max_element(species.radius));
  const std::size_t n = source.particles();
  std::vector<Id> next(counts.size());  // the next particle of each species
  for (std::size_t s = 1; s < counts.size(); ++s) next[s] = next[s - 1] + static_cast<Id>(counts[s - 1]);
  const std::size_t sites = fit_lattice(lattice, system.box, n, margin).sites;
  // A single species that fills all sites needs no drawing.
  const std::vector<int> owner =
      counts.size() > 1 || sites > n ? distribute(sites, counts, source.placement.seed) : std::vector<int>{};
  const Id first = p.size() > 0 ? p.id_of(0) : 0;
  constexpr std::size_t kSitesBetweenPauses = 1 << 16;
  std::size_t site = 0;
  for_each_site<D>(lattice, system.box, n, margin, [&](const Vec<D>& x) {
    const int species = owner.empty() ? 0 : owner[site];
    if (++site % kSitesBetweenPauses == 0 && pause) pause();
    if (species < 0) return;
    const Id id = next[static_cast<std::size_t>(species)]++;
    if (id >= first && id - first < p.size()) p.x[id - first] = x;
  });
}

}  // namespace

std::vector<std::vector<double>> rows_in(const std::string& text, const std::filesystem::path& file,
                                         std::size_t columns, const std::string& not_what) {
  std::istringstream in(text);
  std::vector<std::vector<double>> rows;
  Problems problems;
  std::string line;
  constexpr std::size_t kMostErrors = 10;  // reported per file
  bool begins = true;
  for (int number = 1; problems.errors() < kMostErrors && std::getline(in, line); ++number) {
    const Words words = words_of(line);
    const std::size_t found = words.numbers.size();
    if (found == 0 && words.wrong.empty()) continue;
    const bool first = std::exchange(begins, false);
    if (first && found == 0 && !words.a_number) continue;  // a heading
    if (words.wrong.empty() && found == columns) {
      rows.push_back(words.numbers);
      continue;
    }
    const std::string what = !words.wrong.empty() ? shown(words.wrong) + " is no finite number"
                             : found == 1         ? "there is 1 number"
                                                  : "there are " + std::to_string(found) + " numbers";
    problems.error({file.string(), number, static_cast<int>(words.column)},
                   std::string(not_what).append(": ").append(what),
                   "give " + std::to_string(columns) + " finite numbers, separated by commas or blanks");
  }
  problems.throw_errors(Failure::deck);
  return rows;
}

template <int D>
double default_distance(std::size_t particles, double volume) {
  constexpr double unit = D == 2 ? std::numbers::pi / 4 : std::numbers::pi / 6;  // of a sphere of diameter 1
  return elementary::pow(0.5 * kJammed<D> / unit * volume / static_cast<double>(particles), 1.0 / D);
}

template <int D>
void place_particles(const Deck::Source& source, System<D>& system, const Pause& pause) {
  const PlacementConfig& placement = source.placement;
  const bool centred = placement.type == "fcc" || placement.type == "hexagonal";
  const Lattice lattice = centred ? Lattice::centred : Lattice::simple;
  if (source.edges.empty()) {
    const double filled = packing_fraction<D>(1, system.particles.radius, system.decomposition.others());
    system.box.edges = commensurate_edges<D>(lattice, source.particles(), filled / *placement.packing_fraction);
  }
  if (built_in_blocks(source)) {
    place_on_lattice(source, lattice, system, pause);
    return;
  }
  std::vector<Id> placed;
  Id id = 0;
  for (const SpeciesConfig& species : source.species)
    for (std::size_t n = 0; n < species.count; ++n, ++id) {
      if (species.placed)
        placed.push_back(id);
      else
        system.particles.x[id] = Eigen::Map<const Vec<D>>(species.position[n].data());
    }
  if (placed.empty()) return;
  if (placement.type == "file")
    place_from_file(source, placed, system);
  else if (placement.type == "random")
    place_at_random(source, placed, system, pause);
  else if (placement.type == "compressed")
    place_by_compression(source, system, pause);
  else
    place_on_lattice(source, lattice, system, pause);
}

template void place_particles(const Deck::Source&, System<2>&, const Pause&);
template void place_particles(const Deck::Source&, System<3>&, const Pause&);
template double default_distance<2>(std::size_t, double);
template double default_distance<3>(std::size_t, double);

}  // namespace carom
