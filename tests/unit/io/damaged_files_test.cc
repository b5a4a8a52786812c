// SPDX-License-Identifier: BSD-3-Clause
// `carom info` on files that are valid for HDF5 but contain what carom never writes: each is refused with an error that
// names it.

#include <cmath>
#include <functional>

#include "engine/base/error.h"
#include "io/files/h5md.h"
#include "io/files/hdf5.h"
#include "io/files/info.h"
#include "io/files/output_directory.h"
#include "io/files/trajectory_reader.h"
#include "io/view/run_source.h"
#include "sample_run.h"

namespace carom::damaged_files_test {
namespace {

namespace fs = std::filesystem;
using hdf5::Handle;

/// A trajectory of two frames.
fs::path written_trajectory() {
  const fs::path path = test::fresh_directory() / "t.h5md";
  const auto system = test::sample_system<2>();
  TrajectoryWriter<2> writer(path, test::sample_deck(2), *system);
  for (int f = 0; f < 2; ++f) writer.frame(test::sample_snapshot<2>(system->particles, 0.5 * f, f));
  writer.close();
  return path;
}

/// Changes a file; returns the reason why it is refused.
std::string refusal(const fs::path& path, const std::function<void(hid_t file)>& change) {
  {
    const Handle file(H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), H5Fclose);
    change(file.id());
  }
  try {
    return "not refused: " + describe_file(path);
  } catch (const Error& e) {
    EXPECT_EQ(e.failure(), Failure::file);
    return e.what();
  }
}

/// Replaces a data set by one of this type and shape that was never written to.
void replace(hid_t file, const char* name, hid_t type, const std::vector<hsize_t>& shape) {
  H5Ldelete(file, name, H5P_DEFAULT);
  const Handle space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose);
  const Handle layout(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  if (!shape.empty())
    H5Pset_chunk(layout.id(), static_cast<int>(shape.size()), std::vector<hsize_t>(shape.size(), 1).data());
  const Handle set(H5Dcreate2(file, name, type, space.id(), H5P_DEFAULT, layout.id(), H5P_DEFAULT), H5Dclose);
  EXPECT_GE(set.id(), 0) << name;
}

Handle text_of(std::size_t width) {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.id(), width);
  return type;
}

TEST(DamagedFiles, AFileThatIsNotDamagedIsDescribed) {
  const std::string text = describe_file(written_trajectory());
  for (const char* line :
       {"kind          H5MD 1.1 trajectory\n", "title         three spheres\n", "integrator    free-flight\n",
        "dimension     2\n", "particles     3\n", "box           4, 5\n", "boundary      periodic, wall\n",
        "frames        2\n", "times         0 to 0.5\n", "steps         0 to 1\n"})
    EXPECT_NE(text.find(line), std::string::npos) << line << "in\n" << text;
}

TEST(DamagedFiles, NumbersOfAxesAreChecked) {
  const fs::path path = written_trajectory();
  const std::string group = "/particles/trajectory/";
  const auto with = [&](const std::string& name, const std::vector<hsize_t>& shape) {
    fs::copy_file(path, path.string() + ".2", fs::copy_options::overwrite_existing);
    return refusal(path.string() + ".2",
                   [&](hid_t file) { replace(file, (group + name).c_str(), H5T_NATIVE_DOUBLE, shape); });
  };
  EXPECT_NE(with("position/value", {2}).find("t.h5md.2: /particles/trajectory/position/value has 1 axes, not 3"),
            std::string::npos);
  EXPECT_NE(with("position/step", {}).find("position/step has 0 axes, not 1"), std::string::npos);
  EXPECT_NE(with("box/edges/value", {2, 3, 3, 3}).find("box/edges/value has 4 axes, not 3"), std::string::npos);
}

TEST(DamagedFiles, TheDimensionIsChecked) {
  for (const double dimension : {-1.0, 0.0, 4.0, 1e300, std::nan("")}) {
    const auto change = [&](hid_t file) {
      const char* name = "/parameters/dimension";
      replace(file, name, H5T_NATIVE_DOUBLE, {1});
      const Handle set(H5Dopen2(file, name, H5P_DEFAULT), H5Dclose);
      H5Dwrite(set.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, &dimension);
    };
    const std::string why = refusal(written_trajectory(), change);
    EXPECT_NE(why.find("t.h5md: a trajectory in "), std::string::npos) << why;
  }
}

TEST(DamagedFiles, TextsAreNoLargerThanTheFile) {
  const auto title = [](std::size_t width, const std::vector<hsize_t>& shape) {
    return refusal(written_trajectory(),
                   [&](hid_t file) { replace(file, "/parameters/title", text_of(width).id(), shape); });
  };
  EXPECT_NE(title(1, {hsize_t{1} << 60}).find("/parameters/title claims to be larger than the file"),
            std::string::npos);
  EXPECT_NE(title(16, {(hsize_t{1} << 60) + 1}).find("claims to be larger"),
            std::string::npos);  // 16 bytes modulo 2^64
  EXPECT_NE(title(1, {hsize_t{1} << 32, hsize_t{1} << 32}).find("claims to be larger"), std::string::npos);
  EXPECT_NE(title(8, {0}).find("/parameters/title is empty"), std::string::npos);
}

TEST(DamagedFiles, AttributesHaveTheirNumbers) {
  const auto change = [](hid_t file) {
    H5Adelete_by_name(file, "/h5md", "version", H5P_DEFAULT);
    const Handle group(H5Gopen2(file, "/h5md", H5P_DEFAULT), H5Gclose), space(H5Screate(H5S_SCALAR), H5Sclose);
    const Handle version(H5Acreate2(group.id(), "version", H5T_NATIVE_INT32, space.id(), H5P_DEFAULT, H5P_DEFAULT),
                         H5Aclose);
  };
  const std::string why = refusal(written_trajectory(), change);
  EXPECT_NE(why.find("/h5md@version has 1 numbers, not 2"), std::string::npos) << why;
}

TEST(DamagedFiles, ADataSetIsReadAsBytesOnlyWhereItHasThem) {
  const fs::path path = written_trajectory();
  {
    const Handle file(H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), H5Fclose);
    const Handle texts = text_of(H5T_VARIABLE);
    replace(file.id(), "/parameters/title", texts.id(), {2});
    replace(file.id(), "/parameters/dimension", H5T_NATIVE_DOUBLE, {(hsize_t{1} << 61) + 1});  // 8 bytes modulo 2^64
  }
  const hdf5::File file = hdf5::File::open(path);
  EXPECT_THROW(hdf5::bytes(file, "/parameters/title"), Error);  // pointers
  EXPECT_THROW(hdf5::bytes(file, "/parameters/dimension"), Error);
}

TEST(DamagedFiles, WhatIsNoTrajectoryIsRefusedInOneWay) {
  for (const char* missing : {"/h5md", "/particles/trajectory/position/value", "/particles"}) {
    const fs::path path = written_trajectory(), run = path.parent_path();
    fs::rename(path, run / run_file::trajectory);
    const std::string why = (run / run_file::trajectory).string() + ": an HDF5 file, but no trajectory of carom";
    EXPECT_EQ(refusal(run / run_file::trajectory, [&](hid_t file) { H5Ldelete(file, missing, H5P_DEFAULT); }), why);
    const auto refused = [&](auto&& open) {
      try {
        open();
        return std::string("not refused");
      } catch (const Error& e) {
        EXPECT_EQ(e.failure(), Failure::file);
        return std::string(e.what());
      }
    };
    EXPECT_EQ(refused([&] { TrajectoryReader reader(run); }), why) << missing;
    EXPECT_EQ(refused([&] { RunSource(run, false); }), why) << missing;
  }
}

}  // namespace
}  // namespace carom::damaged_files_test
