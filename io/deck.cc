#include "io/deck.h"

#include "io/deck_interpret.h"
#include "io/deck_toml.h"

namespace carom {

Deck read_deck(const std::filesystem::path& file, std::span<const std::string> overrides) {
  Problems problems;
  const DeckToml toml = load_deck(file, overrides, problems);
  Deck deck;
  deck.file = file;
  interpret(read_values(toml, problems), deck, problems);
  problems.throw_errors(Failure::deck);
  deck.warnings = problems.warnings();
  deck.toml_text = write_deck(deck.source->values);
  return deck;
}

void set_output_directory(Deck& deck, const std::filesystem::path& directory) {
  deck.output.directory = directory;
  deck.source->values.find("output")->values.insert_or_assign("directory", directory.string());
  deck.toml_text = write_deck(deck.source->values);
}

}  // namespace carom
