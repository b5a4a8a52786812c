// SPDX-License-Identifier: BSD-3-Clause
// Blocks of a journal against a plain array of bytes, and files whose flush was interrupted.

#include "io/files/journal.h"

#include <libdeflate.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>
#include <fstream>
#include <random>
#include <utility>

#include "engine/base/error.h"
#include "io/files/hdf5.h"
#include "io/files/journal_blocks.h"
#include "sample_run.h"

namespace carom::journal_test {
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
      for (std::size_t k = 0; k < length; ++k)  // mostly unchanged bytes, as from HDF5
        data[k] = below(100) < 97 ? expected[at + k] : static_cast<std::byte>(below(256));
      blocks.put(at, data);
      std::copy(data.begin(), data.end(), expected.begin() + static_cast<std::ptrdiff_t>(at));
      Bytes seen = file;  // what the driver returns before the flush
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

// Damaged bytes with a valid checksum are not a journal.
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
  EXPECT_FALSE(with(100, good.size() + 15));  // a part of a second block's header
  EXPECT_FALSE(with(100, good.size() - 1));
  EXPECT_FALSE(with(100, hdf5::kJournalHead + 8));
}

TEST(Journal, AReplayedFileHasItsBlocksAndItsSize) {
  const fs::path path = test::fresh_directory() / "a.h5", beside = path.string() + ".journal";
  std::ofstream(path, std::ios::binary) << std::string(kSize + 300, 'x');  // longer than the journal's file
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

// A file that is opened again, shortened, extended and left in the middle of a flush is completed by the next program
// that opens it.
TEST(Journal, AFileOpenedAgainIsWholeAfterEveryFlush) {
  const fs::path path = test::fresh_directory() / "a.h5", copy = path.parent_path() / "copy.h5";
  {
    hdf5::File file = hdf5::File::create(path);
    EXPECT_FALSE(fs::exists(path));  // nothing has been flushed
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

/// A file that the driver has opened, used through HDF5's interface for drivers.
class DriverFile {
 public:
  explicit DriverFile(const fs::path& path) {
    hdf5::start_library();
    const hdf5::Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    H5Pset_driver(access.id(), hdf5::journal_driver(), nullptr);
    file_ = H5FDopen(path.c_str(), H5F_ACC_RDWR | H5F_ACC_CREAT | H5F_ACC_TRUNC, access.id(), HADDR_UNDEF);
    H5FDset_eoa(file_, H5FD_MEM_DEFAULT, std::uint64_t{1} << 30);
  }
  ~DriverFile() { close(); }
  DriverFile(const DriverFile&) = delete;
  DriverFile& operator=(const DriverFile&) = delete;

  // These functions return whether they succeeded.
  bool write(std::uint64_t at, const Bytes& data) {
    return H5FDwrite(file_, H5FD_MEM_DEFAULT, H5P_DEFAULT, at, data.size(), data.data()) >= 0;
  }
  bool flush() { return H5FDflush(file_, H5P_DEFAULT, false) >= 0; }
  bool resize(std::uint64_t size) {
    const bool done = H5FDset_eoa(file_, H5FD_MEM_DEFAULT, size) >= 0 && H5FDtruncate(file_, H5P_DEFAULT, false) >= 0;
    return H5FDset_eoa(file_, H5FD_MEM_DEFAULT, std::uint64_t{1} << 30) >= 0 && done;
  }
  bool close() { return file_ == nullptr || H5FDclose(std::exchange(file_, nullptr)) >= 0; }
  Bytes read(std::uint64_t at, std::size_t length) {
    Bytes data(length, std::byte{99});
    EXPECT_GE(H5FDread(file_, H5FD_MEM_DEFAULT, H5P_DEFAULT, at, length, data.data()), 0);
    return data;
  }

 private:
  H5FD_t* file_ = nullptr;
};

Bytes contents(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  const std::string all{std::istreambuf_iterator<char>(in), {}};
  const auto bytes = std::as_bytes(std::span(all));
  return {bytes.begin(), bytes.end()};
}

// HDF5 reads what it has written, also before a flush, while the file has the bytes and the size of the last flush.
TEST(Journal, TheDriverReadsWhatWaits) {
  const fs::path path = test::fresh_directory() / "a.h5";
  DriverFile file(path);
  std::mt19937 random(11);
  const auto below = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random); };
  Bytes now, flushed;
  for (int n = 0; n < 3000; ++n) {
    const std::size_t at = below(now.size() + 50);
    Bytes data(1 + below(400));
    for (std::byte& each : data) each = static_cast<std::byte>(1 + below(255));
    ASSERT_TRUE(file.write(at, data));
    now.resize(std::max(now.size(), at + data.size()));
    std::copy(data.begin(), data.end(), now.begin() + static_cast<std::ptrdiff_t>(at));
    const std::size_t from = below(now.size()), length = 1 + below(600);
    Bytes expected(length);  // zeros beyond the end
    std::copy_n(now.begin() + static_cast<std::ptrdiff_t>(from), std::min(length, now.size() - from), expected.begin());
    ASSERT_EQ(file.read(from, length), expected) << n;
    if (n > 10) {
      const Bytes there = contents(path);
      ASSERT_GE(there.size(), flushed.size());
      ASSERT_TRUE(std::equal(flushed.begin(), flushed.end(), there.begin())) << n;
    }
    if (below(4) > 0 && n != 10) continue;
    if (below(3) == 0) {  // HDF5 frees or allocates space before a flush
      now.resize(now.size() / 2 + below(now.size()));
      ASSERT_TRUE(file.resize(now.size()));
    }
    ASSERT_TRUE(file.flush());
    flushed = now;
    ASSERT_EQ(contents(path), now) << n;
    ASSERT_LE(std::ifstream(path.string() + ".journal", std::ios::binary).get(), 0);  // empty, or emptied
  }
  ASSERT_TRUE(file.resize(now.size() / 3));  // with no waiting data
  ASSERT_TRUE(file.flush());
  EXPECT_EQ(fs::file_size(path), now.size() / 3);
}

/// During its lifetime files cannot be written beyond this size.
class Limit {
 public:
  explicit Limit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    rlimit limit = before_;
    limit.rlim_cur = bytes;
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~Limit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  Limit(const Limit&) = delete;
  Limit& operator=(const Limit&) = delete;

 private:
  void (*handler_)(int);
  rlimit before_{};
};

// The journal is complete, and writing to the file fails: the journal stays and is complete to the last byte.
TEST(Journal, AFlushThatIsTornIsCompletedLater) {
  const fs::path path = test::fresh_directory() / "a.h5", journal = path.string() + ".journal";
  Bytes expected(100000, std::byte{1});
  {
    DriverFile file(path);
    ASSERT_TRUE(file.write(0, expected));
    ASSERT_TRUE(file.flush());
    for (const std::size_t at : {std::size_t{10}, std::size_t{70000}, expected.size() - 100}) {
      const Bytes data(100, static_cast<std::byte>(2 + at % 200));
      ASSERT_TRUE(file.write(at, data));
      std::copy(data.begin(), data.end(), expected.begin() + static_cast<std::ptrdiff_t>(at));
    }
    const Limit limit(50000);
    EXPECT_FALSE(file.flush());
    EXPECT_FALSE(file.flush());  // nothing more is written
    file.close();
  }
  const Bytes torn = contents(path), whole = contents(journal);
  EXPECT_EQ(torn.size(), expected.size());
  EXPECT_EQ(torn[10], expected[10]);
  EXPECT_EQ(torn[70000], std::byte{1});
  const auto with_journal = [&](const Bytes& bytes) {
    std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(torn.data()), std::ssize(torn));
    std::ofstream(journal, std::ios::binary).write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
    hdf5::replay_journal(path);
    EXPECT_FALSE(fs::exists(journal));
    return contents(path);
  };
  EXPECT_EQ(with_journal(whole), expected);
  EXPECT_EQ(with_journal({whole.begin(), whole.end() - 1}), torn);
}

TEST(Journal, RoomIsGivenBackWhereAFlushFails) {
  const fs::path path = test::fresh_directory() / "a.h5";
  DriverFile file(path);
  const Bytes flushed(1000, std::byte{1}), more(30000, std::byte{2});
  ASSERT_TRUE(file.write(0, flushed) && file.flush() && file.write(1000, more));
  EXPECT_EQ(fs::file_size(path), 31000u);  // new data can be written at once
  {
    const Limit limit(40000);
    EXPECT_FALSE(file.write(31000, more));
    file.close();
  }
  EXPECT_EQ(contents(path), flushed);
  EXPECT_FALSE(fs::exists(path.string() + ".journal"));
}

// The journal is beside the file itself, whichever name is used to open the file.
TEST(Journal, AFileBehindALink) {
  const fs::path directory = test::fresh_directory(), file = directory / "there" / "a.h5", link = directory / "a.h5";
  fs::create_directory(directory / "there");
  fs::create_symlink("there/a.h5", link);
  {
    hdf5::File::create(link).close();
    hdf5::File again = hdf5::File::append(link);
    again.group("g");
    again.flush();
    EXPECT_TRUE(fs::exists(file.string() + ".journal"));
  }
  const Bytes journal = hdf5::Blocks().journal(fs::file_size(file), {});
  std::ofstream(file.string() + ".journal", std::ios::binary)
      .write(reinterpret_cast<const char*>(journal.data()), std::ssize(journal));
  EXPECT_TRUE(hdf5::exists(hdf5::File::open(link), "/g"));
  EXPECT_FALSE(fs::exists(file.string() + ".journal"));
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_EQ(std::distance(fs::directory_iterator(directory), {}), 2);
}

TEST(Journal, NoFileIsWrittenToAPipe) {
  const fs::path pipe = test::fresh_directory() / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  try {
    hdf5::File::create(pipe);
    ADD_FAILURE() << "created it";
  } catch (const Error& e) {
    EXPECT_EQ(e.failure(), Failure::file);
    EXPECT_NE(std::string(e.what()).find("name another file"), std::string::npos) << e.what();
  }
  EXPECT_TRUE(fs::is_fifo(pipe));
}

}  // namespace
}  // namespace carom::journal_test
