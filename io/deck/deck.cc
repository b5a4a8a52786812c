// SPDX-License-Identifier: BSD-3-Clause
#include "io/deck/deck.h"

#include <algorithm>
#include <array>
#include <fstream>

#include "io/deck/deck_source.h"

namespace carom {
namespace {

/// Whether the tables of this name in two decks describe the same motion of particles.
bool same_tables(const Deck& one, const Deck& other, std::string_view name) {
  const auto values = [&](const Deck& deck) {
    std::vector<std::map<std::string, ParameterValue, std::less<>>> all;
    for (const ValueTable& table : deck.source->values.list(name)) all.push_back(table.values.all());
    for (auto& each : all) each.erase("max_events_per_step");  // it affects no motion
    return all;
  };
  return values(one) == values(other);
}

}  // namespace

std::optional<std::string> read_text(const std::filesystem::path& file) {
  constexpr std::size_t kTextPiece = 1 << 20,
                        kMostText = std::size_t{1}
                                    << 30;  // limit for input that is not a regular file and may never end
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) return {};
  const bool ends = std::filesystem::is_regular_file(file, ignored);
  std::ifstream in(file, std::ios::binary);
  if (!in) return {};
  std::string text;
  for (bool more = true; more;) {
    const std::size_t before = text.size();
    text.resize(before + kTextPiece);
    in.read(text.data() + before, kTextPiece);
    text.resize(before + static_cast<std::size_t>(in.gcount()));
    if (in.bad()) return {};
    if (text.find('\0', before) != std::string::npos)
      throw Error(Failure::file, file.string() + ": error: this is no text, it has zero bytes; check the path");
    more = !in.eof();
    if (more && !ends && text.size() >= kMostText)
      throw Error(Failure::file, file.string() + ": error: there is no end of this input; give a file");
  }
  return text;
}

TextReader reader_for(Communicator& ranks) {
  return [&ranks](const std::filesystem::path& file) -> std::optional<std::string> {
    auto text = ranks.rank() == 0 ? read_text(file) : std::nullopt;
    if (text) text->push_back('.');  // marks a readable text, which may be empty
    const auto bytes = std::as_bytes(std::span(text ? std::string_view(*text) : std::string_view()));
    const Bytes received = std::move(ranks.gather({bytes.begin(), bytes.end()})[0]);
    if (received.empty()) return {};
    return std::string(reinterpret_cast<const char*>(received.data()), received.size() - 1);
  };
}

Deck read_deck(const std::filesystem::path& file, std::span<const std::string> overrides, const TextReader& reader,
               bool replace) {
  const auto text = reader(file);
  if (!text)
    throw Error(Failure::file, file.string() + ": error: cannot read this deck; check the path and its permissions");
  Problems problems;
  Deck deck;
  deck.file = file;
  interpret(read_values(file, *text, overrides, replace, problems), reader, deck, problems);
  problems.throw_errors(Failure::deck);
  PlacementConfig& placement = deck.source->placement;
  const auto& all = deck.source->species;
  if (placement.type == "file" && std::any_of(all.begin(), all.end(), [](const auto& some) { return some.placed; })) {
    const auto table = reader(placement.file);
    if (!table)
      throw Error(Failure::file, placement.file.string() + ": error: cannot read the positions; check placement.file");
    placement.positions = rows_in(*table, placement.file, static_cast<std::size_t>(deck.dimension), "not a position");
  }
  deck.warnings = problems.warnings();
  deck.toml_text = write_deck(deck.source->values);
  return deck;
}

Deck read_branch(const Deck& of, std::span<const std::string> overrides, const TextReader& reader, bool& same_motion) {
  constexpr std::array kKept = {"system", "particles", "placement", "wall"};
  Problems problems;
  for (const std::string& text : overrides) {
    const std::string key = text.substr(0, text.find('=')), table = key.substr(0, key.find('.'));
    if (std::ranges::find(kKept, table) != kKept.end())
      problems.error(
          {"--set " + key}, "a branch has the particles and the box of its checkpoint",
          "set [integrator], [[interaction]], [[contact]], [[bath]], [run] or [output]; for other particles or walls "
          "start a new run");
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
  const auto ramp = [](const Deck& each) {
    const ValueTable* bath = each.source->values.find("bath");
    return bath ? bath->find<std::vector<double>>("temperature") : nullptr;
  };
  const auto sets_ramp_time = [](const std::string& set) { return set.find(".ramp_time=") != std::string::npos; };
  if (ramp(of) && ramp(deck) && *ramp(of) != *ramp(deck) && std::ranges::none_of(overrides, sets_ramp_time))
    problems.error({"--set bath.0.temperature"},
                   "this ramp would get the ramp_time of the run, whose ramp was another one",
                   "set bath.0.ramp_time, too: [start, end] in the time of the run");
  problems.throw_errors(Failure::deck);
  const auto rough = [](const Deck& each) {
    return std::ranges::any_of(each.source->values.list("contact"),
                               [](const ValueTable& contact) { return contact.given("tangential"); });
  };
  same_motion = same_tables(of, deck, "integrator") && same_tables(of, deck, "interaction") && rough(of) == rough(deck);
  return deck;
}

void set_output_directory(Deck& deck, const std::filesystem::path& directory) {
  deck.output.directory = directory;
  deck.source->values.find("output")->values.set("directory", directory.string());
  deck.toml_text = write_deck(deck.source->values);
}

std::size_t particle_count(const Deck& deck) { return deck.source->particles(); }

}  // namespace carom
