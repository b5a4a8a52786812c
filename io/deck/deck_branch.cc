// SPDX-License-Identifier: BSD-3-Clause
// The deck of a run that starts from the particles of another one.

#include <algorithm>
#include <array>

#include "io/deck/deck_source.h"

namespace carom {
namespace {

bool same_tables(const Deck& one, const Deck& other, std::string_view name) {
  const auto values = [&](const Deck& deck) {
    std::vector<std::map<std::string, Value, std::less<>>> all;
    for (const ValueTable& table : deck.source->values.list(name)) all.push_back(table.values);
    for (auto& each : all) each.erase("max_events_per_step");  // which moves nothing
    return all;
  };
  return values(one) == values(other);
}

}  // namespace

Deck read_branch(const Deck& of, std::span<const std::string> overrides, const TextReader& reader, bool& same_motion) {
  constexpr std::array kKept = {"system", "particles", "placement"};
  Problems problems;
  for (const std::string& text : overrides) {
    const std::string key = text.substr(0, text.find('=')), table = key.substr(0, key.find('.'));
    if (std::ranges::find(kKept, table) != kKept.end())
      problems.error({"--set " + key}, "a branch has the particles and the box of its checkpoint",
                     "set [integrator], [[interaction]], [run] or [output]; for other particles start a new run");
  }
  problems.throw_errors(Failure::deck);
  Deck deck = read_deck(of.source->values.file, overrides, reader, true);
  const auto &before = of.source->interactions, &now = deck.source->interactions;
  for (std::size_t n = 0; n < now.size(); ++n) {
    const auto within = [&](const auto& all) {
      return n < all.size() && all[n].parameters.has("within") ? all[n].parameters.real("within") : 0.0;
    };
    if (within(before) != within(now))
      problems.error({"--set interaction." + std::to_string(n) + ".within"},
                     "which particles are bonded has been found in the initial state of the run",
                     "give the bonds as 'pairs', or leave 'within' as it is");
  }
  problems.throw_errors(Failure::deck);
  same_motion = same_tables(of, deck, "integrator") && same_tables(of, deck, "interaction");
  return deck;
}

}  // namespace carom
