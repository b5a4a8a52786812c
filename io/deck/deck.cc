#include "io/deck/deck.h"

#include <algorithm>
#include <fstream>
#include <sstream>

#include "io/deck/deck_build.h"
#include "io/deck/deck_interactions.h"
#include "io/deck/deck_interpret.h"
#include "io/deck/deck_toml.h"

namespace carom {

std::optional<std::string> read_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  if (in && in.peek() != std::ifstream::traits_type::eof()) text << in.rdbuf();
  if (!in || std::filesystem::is_directory(file)) return {};
  return text.str();
}

Deck read_deck(const std::filesystem::path& file, std::span<const std::string> overrides, const TextReader& reader) {
  const auto text = reader(file);
  if (!text)
    throw Error(Failure::file, file.string() + ": error: cannot read this deck; check the path and its permissions");
  Problems problems;
  const DeckToml toml = parse_deck(file, *text, overrides, problems);
  Deck deck;
  deck.file = file;
  DeckValues values = read_values(toml, problems);
  read_potentials(values, file.parent_path(), reader, problems);
  interpret(std::move(values), deck, problems);
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

void set_output_directory(Deck& deck, const std::filesystem::path& directory) {
  deck.output.directory = directory;
  deck.source->values.find("output")->values.insert_or_assign("directory", directory.string());
  deck.toml_text = write_deck(deck.source->values);
}

std::size_t particle_count(const Deck& deck) { return deck.source->particles(); }

}  // namespace carom
