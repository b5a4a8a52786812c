// SPDX-License-Identifier: BSD-3-Clause
#include "io/files/events.h"

#include "io/files/hdf5.h"
#include "sample_run.h"

namespace carom::events_test {
namespace {

Contact<2> contact(double time, Id lo, Id hi) {
  Contact<2> c;
  c.key.time = time;
  c.key.lo = lo;
  c.key.hi = hi;
  c.key.image = {-1, 2};
  c.x_lo = {0.1, 0.2};
  c.x_hi = {0.3, 0.4};
  c.impulse = {1.0 / 3, -2.0 / 3};
  return c;
}

TEST(Events, HoldsEveryContactExactly) {
  const auto path = test::fresh_directory() / "events.h5";
  EventWriter<2> writer(path, test::sample_deck(2));
  Statistics statistics;
  std::vector<Contact<2>> slab(20000);  // more than one batch
  for (std::size_t i = 0; i < slab.size(); ++i) slab[i] = contact(1e-5 * static_cast<double>(i), 1, 2);
  writer.contacts(0, slab);
  statistics.steps = 1;
  writer.progress(statistics);
  Contact<2> wall = contact(0.125, 2, 3);
  wall.key.kind = EventKind::wall;
  writer.contacts(0.5, std::array{wall});
  writer.close();

  const hdf5::File file = hdf5::File::open(path);
  EXPECT_EQ(hdf5::shape(file, "/events/time"), std::vector<hsize_t>{20001});
  EXPECT_EQ(hdf5::shape(file, "/events/impulse"), (std::vector<hsize_t>{20001, 2}));
  for (const hsize_t i : {0, 16384, 19999})
    EXPECT_EQ(hdf5::number_at(file, "/events/time_in_slab", i), 1e-5 * static_cast<double>(i));
  EXPECT_EQ(hdf5::number_at(file, "/events/slab", 19999), 0);
  EXPECT_EQ(hdf5::number_at(file, "/events/slab", 20000), 1);
  EXPECT_EQ(hdf5::number_at(file, "/events/time", 20000), 0.625);
  EXPECT_EQ(hdf5::number_at(file, "/events/kind", 19999), 0);
  EXPECT_EQ(hdf5::number_at(file, "/events/kind", 20000), 1);
  EXPECT_EQ(hdf5::number_at(file, "/events/lo", 20000), 2);
  EXPECT_EQ(hdf5::number_at(file, "/events/hi", 20000), 3);

  double row[2];
  const hdf5::Handle set(H5Dopen2(file.id(), "/events/impulse", H5P_DEFAULT), H5Dclose);
  const hdf5::Handle space(H5Dget_space(set.id()), H5Sclose);
  const hsize_t start[] = {20000, 0}, count[] = {1, 2};
  H5Sselect_hyperslab(space.id(), H5S_SELECT_SET, start, nullptr, count, nullptr);
  const hdf5::Handle memory(H5Screate_simple(2, count, nullptr), H5Sclose);
  ASSERT_GE(H5Dread(set.id(), H5T_NATIVE_DOUBLE, memory.id(), space.id(), H5P_DEFAULT, row), 0);
  EXPECT_EQ(row[0], 1.0 / 3);
  EXPECT_EQ(row[1], -2.0 / 3);
}

/// Events are written with each row and each frame, even if their batch is not full.
TEST(Events, AreInTheFileWhereARowOrAFrameIs) {
  const auto path = test::fresh_directory() / "events.h5", copy = path.parent_path() / "copy.h5";
  const auto system = test::sample_system<2>();
  EventWriter<2> writer(path, test::sample_deck(2));
  const auto written = [&] {
    std::filesystem::copy_file(path, copy, std::filesystem::copy_options::overwrite_existing);
    return hdf5::shape(hdf5::File::open(copy), "/events/time").at(0);
  };
  const auto snapshot = test::sample_snapshot<2>(system->particles, 1, 1);
  writer.contacts(0, std::array{contact(0.5, 0, 1)});
  EXPECT_EQ(written(), 0u);
  writer.thermo(snapshot);
  EXPECT_EQ(written(), 1u);
  writer.contacts(0, std::array{contact(0.75, 1, 2)});
  writer.frame(snapshot);
  EXPECT_EQ(written(), 2u);
  writer.contacts(1, std::array{contact(0.25, 0, 2), contact(0.5, 0, 1)});
  EXPECT_EQ(writer.mark().rows.length, 4u);
  EXPECT_EQ(written(), 4u);
}

/// A continued run continues its count of slabs.
TEST(Events, SlabsGoOnFromTheMark) {
  const auto path = test::fresh_directory() / "events.h5";
  Statistics statistics;
  statistics.steps = 7;
  std::optional<EventMark> mark;
  {
    EventWriter<2> writer(path, test::sample_deck(2));
    writer.contacts(0, std::array{contact(0.5, 0, 1)});
    writer.progress(statistics);
    mark = writer.mark();
    writer.contacts(3.5, std::array{contact(0.25, 1, 2)});
    writer.close();
  }
  EventWriter<2> writer(path, test::sample_deck(2), mark);
  writer.contacts(3.5, std::array{contact(0.125, 0, 2)});
  writer.close();
  const hdf5::File file = hdf5::File::open(path);
  ASSERT_EQ(hdf5::shape(file, "/events/slab"), std::vector<hsize_t>{2});
  EXPECT_EQ(hdf5::number_at(file, "/events/slab", 0), 0);
  EXPECT_EQ(hdf5::number_at(file, "/events/slab", 1), 7);
  EXPECT_EQ(hdf5::number_at(file, "/events/time", 1), 3.625);
}

}  // namespace
}  // namespace carom::events_test
