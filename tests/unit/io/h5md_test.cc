// SPDX-License-Identifier: BSD-3-Clause
#include "io/files/h5md.h"

#include <cstdint>
#include <numeric>

#include "engine/base/error.h"
#include "engine/forces/add_interaction.h"
#include "io/files/hdf5.h"
#include "io/files/trajectory_reader.h"
#include "sample_run.h"

namespace carom::h5md_test {
namespace {

using test::fresh_directory;

template <class Dimension>
class Trajectory : public testing::Test {};
using Dimensions = testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(Trajectory, Dimensions);

std::vector<double> all_numbers(const hdf5::File& file, const std::string& name) {
  std::vector<double> values(1);
  for (const hsize_t n : hdf5::shape(file, name)) values.resize(values.size() * n);
  const hdf5::Handle set(H5Dopen2(file.id(), name.c_str(), H5P_DEFAULT), H5Dclose);
  EXPECT_GE(H5Dread(set.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0) << name;
  return values;
}

TYPED_TEST(Trajectory, HoldsThreeColumnsInAnyDimension) {
  constexpr int D = TypeParam::value;
  const auto path = fresh_directory() / "t.h5md";
  const auto system = test::sample_system<D>();
  TrajectoryWriter<D> writer(path, test::sample_deck(D), *system);
  for (int f = 0; f < 3; ++f) writer.frame(test::sample_snapshot<D>(system->particles, 0.5 * f, f));
  writer.close();

  const hdf5::File file = hdf5::File::open(path);
  const std::string p = "/particles/trajectory/";
  EXPECT_EQ(hdf5::shape(file, p + "position/value"), (std::vector<hsize_t>{3, 3, 3}));
  const auto x = all_numbers(file, p + "position/value"), v = all_numbers(file, p + "velocity/value"),
             image = all_numbers(file, p + "image/value"), edges = all_numbers(file, p + "box/edges/value");
  for (std::size_t f = 0; f < 3; ++f)
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        const bool there = static_cast<int>(k) < D;
        const std::size_t at = 9 * f + 3 * i + k;
        EXPECT_EQ(x[at], there ? static_cast<double>(i) + 0.25 * static_cast<double>(k) : 0.0);
        EXPECT_EQ(v[at], -x[at]);
        EXPECT_EQ(image[at], there ? static_cast<double>(i) : 0.0);
        EXPECT_EQ(edges[at], i != k ? 0.0 : there ? 4.0 + static_cast<double>(k) : 1.0);
      }
  EXPECT_EQ(all_numbers(file, p + "position/time"), (std::vector<double>{0, 0.5, 1}));
  EXPECT_EQ(all_numbers(file, p + "box/edges/step"), (std::vector<double>{0, 1, 2}));
  EXPECT_EQ(all_numbers(file, p + "mass"), (std::vector<double>{1.5, 2.5, 3.5}));
  EXPECT_EQ(all_numbers(file, p + "id"), (std::vector<double>{0, 1, 2}));
  EXPECT_EQ(all_numbers(file, p + "species"), (std::vector<double>{0, 0, 1}));
  EXPECT_EQ(all_numbers(file, "/observables/total_energy/value"), (std::vector<double>{1.25, 1.25, 1.25}));
  EXPECT_EQ(all_numbers(file, "/observables/collisions/value"), (std::vector<double>{0, 3, 6}));
  EXPECT_EQ(hdf5::attribute_texts(file, p + "box", "boundary"), (std::vector<std::string>{"periodic", "none", "none"}));
  EXPECT_EQ(hdf5::texts(file, "/parameters/species"), (std::vector<std::string>{"small", "large"}));
  EXPECT_EQ(hdf5::text(file, "/parameters/deck"), "format = 1\n");
  EXPECT_EQ(hdf5::number_at(file, "/parameters/dimension", 0), D);
}

/// Three columns, the third about z in two dimensions; only if contacts are rough.
TYPED_TEST(Trajectory, HasSpinsOfRoughSpheres) {
  constexpr int D = TypeParam::value;
  const auto path = fresh_directory() / "t.h5md";
  const auto system = test::sample_system<D>();
  const std::string name = "/particles/trajectory/angular_velocity/value";
  TrajectoryWriter<D>(path, test::sample_deck(D), *system).close();
  EXPECT_FALSE(hdf5::exists(hdf5::File::open(path), name));

  system->box.contacts.resize(2, 0);
  system->box.contacts.add({.tangential = 0.5});
  system->need_spins();
  for (std::size_t i = 0; i < 3; ++i)
    for (int k = 0; k < Spin<D>::SizeAtCompileTime; ++k)
      system->particles.spin[i][k] = static_cast<double>(i) + 0.25 * k;
  TrajectoryWriter<D> writer(path, test::sample_deck(D), *system);
  for (int f = 0; f < 2; ++f) writer.frame(test::sample_snapshot<D>(system->particles, 0.5 * f, f));
  writer.close();
  const hdf5::File file = hdf5::File::open(path);
  EXPECT_EQ(hdf5::shape(file, name), (std::vector<hsize_t>{2, 3, 3}));
  const auto spin = all_numbers(file, name);
  for (std::size_t f = 0; f < 2; ++f)
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_EQ(spin[9 * f + 3 * i + k], D == 3   ? static_cast<double>(i) + 0.25 * static_cast<double>(k)
                                           : k == 2 ? static_cast<double>(i)
                                                    : 0.0);
}

TYPED_TEST(Trajectory, SharesItsClockByHardLinks) {
  constexpr int D = TypeParam::value;
  const auto path = fresh_directory() / "t.h5md";
  const auto system = test::sample_system<D>();
  TrajectoryWriter<D>(path, test::sample_deck(D), *system).frame(test::sample_snapshot<D>(system->particles, 0, 0));
  const hdf5::File file = hdf5::File::open(path);
  const auto address = [&](const std::string& name) {
    H5O_info_t info;
    EXPECT_GE(H5Oget_info_by_name(file.id(), name.c_str(), &info, H5P_DEFAULT), 0) << name;
    return info.addr;
  };
  const std::string p = "/particles/trajectory/";
  for (const std::string& element : {p + "velocity", p + "image", p + "box/edges", std::string("/observables/pressure"),
                                     std::string("/observables/momentum")})
    for (const char* clock : {"/step", "/time"})
      EXPECT_EQ(address(element + clock), address(p + "position" + clock)) << element;
}

// A flushed frame can be read while the writer continues, as it must after a kill.
TYPED_TEST(Trajectory, IsReadableAfterEveryFrame) {
  constexpr int D = TypeParam::value;
  const auto path = fresh_directory() / "t.h5md";
  const auto system = test::sample_system<D>();
  TrajectoryWriter<D> writer(path, test::sample_deck(D), *system);
  for (int f = 0; f < 200; ++f) {  // more than fit in one chunk of `time` and of the positions
    writer.frame(test::sample_snapshot<D>(system->particles, f, f));
    if (f % 50 != 0) continue;
    const auto copy = path.parent_path() / "copy.h5md";
    std::filesystem::copy_file(path, copy, std::filesystem::copy_options::overwrite_existing);
    const hdf5::File file = hdf5::File::open(copy);
    EXPECT_EQ(hdf5::shape(file, "/particles/trajectory/position/value").at(0), static_cast<hsize_t>(f + 1));
    EXPECT_EQ(all_numbers(file, "/particles/trajectory/position/time").back(), f);
    EXPECT_EQ(all_numbers(file, "/particles/trajectory/position/value").back(), D == 3 ? 2.5 : 0.0);
  }
}

/// VMD has one radius per species: the mean of its particles, and exactly their radius if all are equal.
TEST(TrajectoryFile, ASpeciesOfMixedRadii) {
  const auto path = fresh_directory() / "t.h5md";
  const auto system = test::sample_system<2>();
  system->particles.radius = {0.1, 0.4, 0.3};
  TrajectoryWriter<2>(path, test::sample_deck(2), *system).close();
  const hdf5::File file = hdf5::File::open(path);
  EXPECT_EQ(all_numbers(file, "/particles/trajectory/radius"), system->particles.radius);
  const auto radii = all_numbers(file, "/parameters/vmd_structure/radius");
  ASSERT_EQ(radii.size(), 2u);
  EXPECT_DOUBLE_EQ(radii[0], 0.25);
  EXPECT_EQ(radii[1], 0.3);
}

/// A second rank without particles, which is lost in the middle of the second frame.
TEST(TrajectoryFile, HasNoPartOfAFrameInWhichARankIsLost) {
  struct Lost : Communicator {
    int calls = 0;
    int size() const override { return 2; }
    std::vector<Bytes> swap(std::vector<Bytes> outgoing) override {
      if (++calls == 6) throw Error(Failure::numerical, "a rank is lost");  // two for a new file, two a frame
      return {outgoing[0], {}};
    }
  } ranks;
  const auto path = fresh_directory() / "t.h5md";
  const auto system = test::sample_system<3>();
  system->decomposition.join(ranks, Sizes(system->particles));
  system->particles.id = {0, 1, 2};
  TrajectoryWriter<3> writer(path, test::sample_deck(3), *system);
  writer.frame(test::sample_snapshot<3>(system->particles, 0.0, 0));
  EXPECT_THROW(writer.frame(test::sample_snapshot<3>(system->particles, 0.5, 1)), Error);
  writer.close();
  const hdf5::File file = hdf5::File::open(path);
  for (const char* name : {"particles/trajectory/position/value", "particles/trajectory/velocity/value",
                           "particles/trajectory/image/value", "particles/trajectory/position/step",
                           "particles/trajectory/position/time", "observables/momentum/value"})
    EXPECT_EQ(hdf5::shape(file, name).at(0), 1u) << name;
  EXPECT_EQ(all_numbers(file, "particles/trajectory/position/value")[5], 1.5);
  EXPECT_EQ(all_numbers(file, "particles/trajectory/mass")[2], 3.5);
}

/// Units are written as the module `units` of H5MD requires, as strings of variable length.
TEST(TrajectoryFile, SaysItsUnits) {
  const auto path = fresh_directory() / "t.h5md";
  Deck deck = test::sample_deck(2);
  deck.output.units = {"nm", "ps"};
  TrajectoryWriter<2>(path, deck, *test::sample_system<2>()).close();
  const hdf5::File file = hdf5::File::open(path);
  const auto unit = [&](const std::string& name) {
    const hdf5::Handle attribute(
        H5Aopen_by_name(file.id(), ("particles/trajectory/" + name).c_str(), "unit", H5P_DEFAULT, H5P_DEFAULT),
        H5Aclose);
    const hdf5::Handle type(H5Aget_type(attribute.id()), H5Tclose);
    char* text = nullptr;
    EXPECT_GE(H5Aread(attribute.id(), type.id(), &text), 0) << name;
    const std::string found = text != nullptr ? text : "";
    H5free_memory(text);
    return found;
  };
  for (const char* length : {"position/value", "box/edges/value", "radius"}) EXPECT_EQ(unit(length), "nm") << length;
  EXPECT_EQ(unit("velocity/value"), "nm ps-1");
  EXPECT_EQ(unit("position/time"), "ps");
}

/// Each bond is written once; ids count from 1 in the file and from 0 in the reader.
TEST(TrajectoryFile, IsReadAsItWasWritten) {
  const auto path = fresh_directory() / "t.h5md";
  const auto system = test::sample_system<3>();
  for (const PairList& pairs : {PairList{{1, 2}}, PairList{{1, 0}, {2, 1}}})
    add_interaction(*system, "harmonic-bond", {{"pairs", pairs}, {"stiffness", 1.0}, {"rest_length", 1.0}});
  TrajectoryWriter<3> writer(path, test::sample_deck(3), *system);
  for (int f = 0; f < 2; ++f) writer.frame(test::sample_snapshot<3>(system->particles, 0.5 * f, 3 * f));
  writer.close();
  const TrajectoryReader reader(path);
  EXPECT_EQ(reader.bonds, (std::vector<std::array<std::uint32_t, 2>>{{0, 1}, {1, 2}}));
  EXPECT_EQ(reader.dimension, 3);
  EXPECT_EQ(reader.species_names, (std::vector<std::string>{"small", "large"}));
  EXPECT_EQ(reader.species, (std::vector<std::int32_t>{0, 0, 1}));
  EXPECT_EQ(reader.boundary, (std::vector<std::string>{"periodic", "wall", "wall"}));
  EXPECT_EQ(reader.mass, (std::vector<double>{1.5, 2.5, 3.5}));
  EXPECT_EQ(reader.charge, (std::vector<double>{0, -1, -2}));
  ASSERT_EQ(reader.frames(), 2u);
  const TrajectoryFrame frame = reader.frame(1);
  EXPECT_EQ(frame.time, 0.5);
  EXPECT_EQ(frame.step, 3);
  EXPECT_EQ(frame.edges, (std::array{4.0, 5.0, 6.0}));
  EXPECT_EQ(frame.position, (std::vector<double>{0, 0.25, 0.5, 1, 1.25, 1.5, 2, 2.25, 2.5}));
  EXPECT_EQ(frame.velocity[8], -2.5);
  EXPECT_EQ(frame.image, (std::vector<std::int32_t>{0, 0, 0, 1, 1, 1, 2, 2, 2}));
}

TEST(TrajectoryFile, NamesTheFileThatCannotBeCreated) {
  const auto path = fresh_directory() / "missing" / "t.h5md";
  const auto system = test::sample_system<2>();
  try {
    TrajectoryWriter<2> writer(path, test::sample_deck(2), *system);
    FAIL() << "created a file in a directory that does not exist";
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), 5);
    EXPECT_NE(std::string(e.what()).find(path.string()), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("No such file"), std::string::npos) << e.what();
  }
}

TEST(Hdf5File, AnArrayOfManyPiecesIsReadAsWritten) {
  const auto folder = fresh_directory();
  std::vector<double> values(3 * 100001);  // 2.4 MB, not a multiple of the block size
  std::iota(values.begin(), values.end(), 0.5);
  for (const bool plain : {false, true}) {
    const auto path = folder / (plain ? "plain.h5" : "journaled.h5");
    hdf5::File written = plain ? hdf5::File::create_plain(path, 512) : hdf5::File::create(path);
    written.write_array(written.group("here"), "values", H5T_NATIVE_DOUBLE, values.data(), {100001, 3});
    written.close();
    EXPECT_EQ(all_numbers(hdf5::File::open(path), "here/values"), values);
  }
}

}  // namespace
}  // namespace carom::h5md_test
