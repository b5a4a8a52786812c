// SPDX-License-Identifier: BSD-3-Clause
// A damaged checkpoint is refused: every byte is changed in turn, and the file is cut to every length.

#include "io/files/checkpoint.h"

#include <fstream>

#include "engine/base/error.h"
#include "io/files/info.h"
#include "io/files/output_directory.h"
#include "sample_run.h"

namespace carom::checkpoint_test {
namespace {

namespace fs = std::filesystem;

std::string contents(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
void write(const fs::path& path, const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; }

/// A small checkpoint in this directory.
fs::path written_in(const fs::path& directory) {
  const auto system = test::sample_system<2>();
  const CheckpointHead head{.deck = "format = 1\n",
                            .deck_file = "sample.toml",
                            .version = "of this test",
                            .integrator = "psa",
                            .dimension = 2,
                            .particles = 3,
                            .step = 7,
                            .time = 0.5,
                            .files = {},
                            .bonds = {{{0, 1}, {1, 2}}},
                            .warnings = {"warning: a long step"},
                            .branched_from = {}};
  write_checkpoint<2>(directory, head, *system);
  return directory / run_file::checkpoint;
}

/// The reason why a file is refused; empty if it is not.
std::string refusal(const fs::path& file) {
  try {
    Checkpoint checkpoint(file);
    for (const char* name : {"position", "velocity"}) checkpoint.read(name);
  } catch (const Error& e) {
    EXPECT_EQ(e.failure(), Failure::file);
    return e.what();
  }
  return {};
}

TEST(Checkpoint, HoldsWhatWasWritten) {
  const fs::path file = written_in(test::fresh_directory());
  const Checkpoint checkpoint(file);
  EXPECT_EQ(checkpoint.head().deck, "format = 1\n");
  EXPECT_EQ(checkpoint.head().deck_file, "sample.toml");
  EXPECT_EQ(checkpoint.head().step, 7);
  EXPECT_EQ(checkpoint.head().bonds, (std::vector<PairList>{{{0, 1}, {1, 2}}}));
  const auto system = test::sample_system<2>();
  const Bytes x = checkpoint.read("position");
  ASSERT_EQ(x.size(), 3 * sizeof(Vec<2>));
  EXPECT_EQ(std::memcmp(x.data(), system->particles.x.data(), x.size()), 0);
  EXPECT_THROW(checkpoint.read("nothing of that name"), Error);
  EXPECT_FALSE(fs::exists(file.parent_path() / run_file::previous_checkpoint));
  EXPECT_TRUE(is_checkpoint(file));
}

TEST(Checkpoint, AnyByteThatIsChangedIsNoticed) {
  const fs::path file = written_in(test::fresh_directory());
  const std::string good = contents(file);
  for (std::size_t at = 0; at < good.size(); ++at) {
    const auto put = [&](int byte) {
      std::fstream out(file, std::ios::in | std::ios::out | std::ios::binary);
      out.seekp(static_cast<std::streamoff>(at)).put(static_cast<char>(byte));
    };
    put(good[at] ^ (1 << at % 8));
    ASSERT_NE(refusal(file), "") << "byte " << at << " of " << good.size();
    put(good[at]);
  }
  EXPECT_EQ(refusal(file), "");
}

TEST(Checkpoint, AnyByteThatIsMissingIsNoticed) {
  const fs::path file = written_in(test::fresh_directory());
  const std::string good = contents(file);
  for (std::size_t length = good.size(); length-- > 0;) {
    fs::resize_file(file, length);
    ASSERT_NE(refusal(file), "") << length << " bytes of " << good.size();
  }
  write(file, good + '\0');
  EXPECT_NE(refusal(file), "");
}

TEST(Checkpoint, TheOneBeforeIsTakenWhereTheLastIsDamaged) {
  const fs::path directory = test::fresh_directory(), last = written_in(directory);
  written_in(directory);
  const fs::path before = directory / run_file::previous_checkpoint;
  const std::string good = contents(before);
  std::string warning;
  EXPECT_EQ(last_checkpoint(directory, warning).file(), last);
  EXPECT_EQ(warning, "");
  write(last, good.substr(0, good.size() / 2));
  EXPECT_EQ(last_checkpoint(directory, warning).file(), before);
  EXPECT_NE(warning.find("checkpoint.h5: the checkpoint is damaged or cut off"), std::string::npos) << warning;
  for (const auto& [format, age] : {std::pair{"1", "an older"}, {"9", "a newer"}}) {
    write(before, std::string("carom checkpoint ") + format + "\n");
    try {
      last_checkpoint(directory, warning);
      FAIL();
    } catch (const Error& e) {
      const std::string text = e.what();
      EXPECT_NE(text.find("damaged or cut off"), std::string::npos) << text;
      EXPECT_NE(text.find(std::string(age) + " carom; this one reads format 8"), std::string::npos) << text;
    }
  }
}

}  // namespace
}  // namespace carom::checkpoint_test
