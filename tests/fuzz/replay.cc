// SPDX-License-Identifier: BSD-3-Clause
// Runs a fuzz target without a fuzzer: `TARGET MUTATIONS FILE…` passes each file and this number of mutations of each
// file to it, equal in every run.

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

namespace fs = std::filesystem;
using Input = std::vector<std::uint8_t>;

/// The files, and the files in the directories, sorted by name.
std::vector<fs::path> files_of(int argc, char** argv) {
  std::vector<fs::path> files;
  for (int k = 2; k < argc; ++k) {
    if (!fs::is_directory(argv[k]))
      files.emplace_back(argv[k]);
    else
      for (const auto& entry : fs::directory_iterator(argv[k]))
        if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// One to four changes: a bit, a byte at a likely limit, eight bytes, a cut, a repetition.
void mutate(Input& input, std::mt19937_64& random) {
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  constexpr std::uint8_t kLimits[] = {0, 1, 0x7f, 0x80, 0xff, '"', '[', '\n'};
  for (std::size_t changes = 1 + below(4); changes > 0 && !input.empty(); --changes) {
    const std::size_t at = below(input.size());
    const auto here = input.begin() + static_cast<std::ptrdiff_t>(at);
    switch (below(8)) {
      case 0:
        input.resize(at);
        break;
      case 1: {
        const Input part(here,
                         here + static_cast<std::ptrdiff_t>(std::min<std::size_t>(input.size() - at, 1 + below(64))));
        input.insert(here, part.begin(), part.end());
        break;
      }
      case 2:
        std::fill_n(here, std::min<std::size_t>(8, input.size() - at), kLimits[below(std::size(kLimits))]);
        break;
      case 3:
      case 4:
        *here = kLimits[below(std::size(kLimits))];
        break;
      default:
        *here ^= static_cast<std::uint8_t>(1u << below(8));
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const auto files = files_of(argc, argv);
  if (files.empty()) return std::fputs("no files\n", stderr), 2;
  const int mutations = std::stoi(argv[1]);
  std::mt19937_64 random(1);
  for (const fs::path& file : files) {
    std::ifstream in(file, std::ios::binary);
    const Input input{std::istreambuf_iterator<char>(in), {}};
    LLVMFuzzerTestOneInput(input.data(), input.size());
    for (int k = 0; k < mutations; ++k) {
      Input mutated = input;
      mutate(mutated, random);
      LLVMFuzzerTestOneInput(mutated.data(), mutated.size());
    }
  }
  std::printf("%zu files, %d mutations of each\n", files.size(), mutations);
}
