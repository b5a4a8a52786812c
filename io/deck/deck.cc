// SPDX-License-Identifier: BSD-3-Clause
#include "io/deck/deck.h"

#include <algorithm>
#include <fstream>

#include "io/deck/deck_build.h"
#include "io/deck/deck_interactions.h"
#include "io/deck/deck_interpret.h"
#include "io/deck/deck_toml.h"

namespace carom {

std::optional<std::string> read_text(const std::filesystem::path& file) {
  constexpr std::size_t kTextPiece = 1 << 20,
                        kMostText = std::size_t{1} << 30;  // of what is no file and may have no end
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

Deck read_deck(const std::filesystem::path& file, std::span<const std::string> overrides, const TextReader& reader,
               bool replace) {
  const auto text = reader(file);
  if (!text)
    throw Error(Failure::file, file.string() + ": error: cannot read this deck; check the path and its permissions");
  Problems problems;
  DeckToml toml = parse_deck(file, *text, overrides, problems);
  if (replace) drop_replaced(toml);
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
