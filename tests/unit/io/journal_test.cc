// Blocks of a journal against a plain array of bytes, and files that are left in the middle of a flush.

#include "io/files/journal.h"

#include <libdeflate.h>

#include <fstream>
#include <random>

#include "engine/base/error.h"
#include "io/files/hdf5.h"
#include "io/files/journal_blocks.h"
#include "sample_run.h"

namespace carom {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kSize = 5000;

/// Writes a journal to an image of the file.
void apply(Bytes journal, Bytes& file) {
  const auto size = hdf5::complete_journal(journal);
  ASSERT_TRUE(size);
  hdf5::for_each_block(journal, [&](std::uint64_t address, const std::byte* data, std::size_t length) {
    EXPECT_LE(address + length, file.size());
    std::copy(data, data + length, file.begin() + static_cast<std::ptrdiff_t>(address));
    return true;
  });
}

TEST(Journal, BlocksAreThoseOfAnArray) {
  std::mt19937 random(3);
  const auto below = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random); };
  Bytes file(kSize), expected(kSize);
  hdf5::Blocks there;
  for (int flush = 0; flush < 300; ++flush) {
    hdf5::Blocks blocks;
    for (std::size_t puts = below(12); puts > 0; --puts) {
      const std::size_t at = below(10) * 400 + below(2) * below(400), length = 1 + below(2) * below(900);
      Bytes data(length);
      for (std::size_t k = 0; k < length; ++k)  // mostly what is there already, as HDF5 does
        data[k] = below(100) < 97 ? expected[at + k] : static_cast<std::byte>(below(256));
      blocks.put(at, data);
      std::copy(data.begin(), data.end(), expected.begin() + static_cast<std::ptrdiff_t>(at));
      Bytes seen = file;  // what a reader of the driver gets before the flush
      blocks.overlay(0, seen);
      ASSERT_EQ(seen, expected);
      const std::size_t from = below(kSize - 100);
      Bytes part(file.begin() + static_cast<std::ptrdiff_t>(from),
                 file.begin() + static_cast<std::ptrdiff_t>(from) + 100);
      blocks.overlay(from, part);
      ASSERT_TRUE(std::equal(part.begin(), part.end(), expected.begin() + static_cast<std::ptrdiff_t>(from)));
    }
    const Bytes journal = blocks.journal(kSize, there);
    apply(journal, file);
    ASSERT_EQ(file, expected) << flush;
    there = std::move(blocks);
    if (flush > 5) continue;
    for (std::size_t length = 0; length < journal.size(); ++length) {
      Bytes cut(journal.begin(), journal.begin() + static_cast<std::ptrdiff_t>(length));
      EXPECT_FALSE(hdf5::complete_journal(cut)) << length;
    }
    for (std::size_t k = 0; k < journal.size(); ++k) {
      Bytes flipped = journal;
      flipped[k] ^= std::byte{4};
      EXPECT_FALSE(hdf5::complete_journal(flipped)) << k;
    }
  }
}

// A checksum that fits what is damaged makes no journal of it.
TEST(Journal, BlocksThatDoNotFitAreNotReplayed) {
  hdf5::Blocks blocks;
  blocks.put(10, Bytes(100));
  const Bytes good = blocks.journal(kSize, {});
  const auto with = [&](std::uint64_t length_of_block, std::size_t bytes) {
    Bytes journal = good;
    std::memcpy(journal.data() + hdf5::kJournalHead + 8, &length_of_block, 8);
    journal.resize(bytes);
    const std::uint64_t length = bytes;
    std::memcpy(journal.data() + 16, &length, 8);
    const std::uint64_t sum = libdeflate_crc32(0, journal.data() + 16, bytes - 16);
    std::memcpy(journal.data() + 8, &sum, 8);
    return hdf5::complete_journal(journal).has_value();
  };
  EXPECT_TRUE(with(100, good.size()));
  EXPECT_FALSE(with(101, good.size()));
  EXPECT_FALSE(with(~std::uint64_t{0}, good.size()));
  EXPECT_FALSE(with(100, good.size() + 15));  // a part of a second block's head
  EXPECT_FALSE(with(100, good.size() - 1));
  EXPECT_FALSE(with(100, hdf5::kJournalHead + 8));
}

TEST(Journal, AReplayedFileHasItsBlocksAndItsSize) {
  const fs::path path = test::fresh_directory() / "a.h5", beside = path.string() + ".journal";
  std::ofstream(path, std::ios::binary) << std::string(kSize + 300, 'x');  // some behind its end
  hdf5::Blocks blocks;
  blocks.put(kSize - 10, Bytes(10, std::byte{'y'}));
  const Bytes journal = blocks.journal(kSize, {});
  std::ofstream(beside, std::ios::binary).write(reinterpret_cast<const char*>(journal.data()), std::ssize(journal));
  hdf5::replay_journal(path);
  std::ifstream in(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  EXPECT_EQ(bytes, std::string(kSize - 10, 'x') + std::string(10, 'y'));
  EXPECT_FALSE(fs::exists(beside));
}

// A file that is opened again: cut, appended to, and left in the middle of a flush, is made whole by the next to open
// it.
TEST(Journal, AFileOpenedAgainIsWholeAfterEveryFlush) {
  const fs::path path = test::fresh_directory() / "a.h5", copy = path.parent_path() / "copy.h5";
  {
    hdf5::File file = hdf5::File::create(path);
    EXPECT_FALSE(fs::exists(path));  // nothing of it has been flushed
    const hdf5::Handle group = file.group("g");
    hdf5::Series<double> series(file, group, "x", {100});
    for (int row = 0; row < 50; ++row) series.append(std::vector<double>(100, row));
  }
  for (int times = 1; times < 4; ++times) {
    hdf5::File file = hdf5::File::append(path);
    EXPECT_THROW(hdf5::File::open(path), Error);  // locked
    const hdf5::Handle group = file.group("g");
    hdf5::Series<double> series(file, group, "x", {100});
    EXPECT_EQ(series.rows(), 50u);
    series.cut(20);
    for (int row = 20; row < 50; ++row) {
      series.append(std::vector<double>(100, row + 1000 * times));
      if (row % 7 != 0) continue;
      file.flush();
      EXPECT_EQ(std::ifstream(path.string() + ".journal", std::ios::binary).get(), 0);  // a flush has ended
      fs::copy_file(path, copy, fs::copy_options::overwrite_existing);
      const hdf5::File seen = hdf5::File::open(copy);
      EXPECT_EQ(hdf5::shape(seen, "/g/x").at(0), static_cast<hsize_t>(row + 1));
    }
    file.close();
    EXPECT_FALSE(fs::exists(path.string() + ".journal"));
    const hdf5::File seen = hdf5::File::open(path);
    EXPECT_EQ(hdf5::number_at(seen, "/g/x", 19), 19);  // element [19][19]
    EXPECT_EQ(hdf5::number_at(seen, "/g/x", 49), 49 + 1000 * times);
  }
}

}  // namespace
}  // namespace carom
