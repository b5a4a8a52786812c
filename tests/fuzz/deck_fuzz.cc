// SPDX-License-Identifier: BSD-3-Clause
// The parser of decks on bytes from a fuzzer (tools/fuzz): it returns a deck or throws an Error.

#include <cstddef>
#include <cstdint>

#include "engine/base/error.h"
#include "io/deck/deck.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::filesystem::path file = "fuzz.toml";
  const carom::TextReader reader = [&](const std::filesystem::path& path) -> std::optional<std::string> {
    if (path != file) return "0 1\n2 3\n";  // positions, or points of a potential
    return std::string(reinterpret_cast<const char*>(data), size);
  };
  try {
    carom::read_deck(file, {}, reader);
  } catch (const carom::Error&) {
  }
  return 0;
}
