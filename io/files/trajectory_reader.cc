// SPDX-License-Identifier: BSD-3-Clause
#include "io/files/trajectory_reader.h"

#include <algorithm>

#include "engine/base/error.h"
#include "io/files/h5md.h"
#include "io/files/output_directory.h"

namespace carom {

namespace {

const std::string kParticles = "particles/trajectory/";

hdf5::File open_trajectory(const std::filesystem::path& path) {
  const bool directory = std::filesystem::is_directory(path);
  hdf5::File file = hdf5::File::open(directory ? path / run_file::trajectory : path);
  need_trajectory(file);
  return file;
}

}  // namespace

void need_trajectory(const hdf5::File& file) {
  if (!hdf5::exists(file, "/h5md") || !hdf5::exists(file, kParticles + "position/value"))
    throw Error(Failure::file, file.path().string() + ": an HDF5 file, but no trajectory of carom");
}

TrajectoryReader::TrajectoryReader(const std::filesystem::path& path) : file_(open_trajectory(path)) {
  const auto shape = hdf5::shape(file_, kParticles + "position/value");
  frames_ = hdf5::shape(file_, kParticles + "position/step").at(0);
  species = hdf5::numbers<std::int32_t>(file_, kParticles + "species");
  mass = hdf5::numbers<double>(file_, kParticles + "mass");
  radius = hdf5::numbers<double>(file_, kParticles + "radius");
  charge = hdf5::numbers<double>(file_, kParticles + "charge");
  if (hdf5::exists(file_, kParticles + "moment_of_inertia"))
    moment = hdf5::numbers<double>(file_, kParticles + "moment_of_inertia");
  if (shape.size() != 3 || shape[0] < frames_ || shape[2] != 3) damaged("positions of another shape");
  for (const std::size_t size : {species.size(), mass.size(), radius.size(), charge.size()})
    if (size != shape[1]) damaged("data sets of different numbers of particles");
  if (!moment.empty() && moment.size() != shape[1]) damaged("moments of inertia of another number of particles");

  dimension = static_cast<int>(hdf5::number_at(file_, "/parameters/dimension", 0));
  title = hdf5::text(file_, "/parameters/title");
  boundary = hdf5::texts(file_, "/parameters/boundary");
  species_names = hdf5::texts(file_, "/parameters/species");
  if ((dimension != 2 && dimension != 3) || boundary.size() != static_cast<std::size_t>(dimension))
    damaged("a dimension that does not fit the boundaries");
  const auto names = static_cast<std::int32_t>(species_names.size());
  if (!std::ranges::all_of(species, [&](std::int32_t s) { return s >= 0 && s < names; }))
    damaged("a species without a name");

  if (!hdf5::exists(file_, vmd_structure::bond_from)) return;
  const auto from = hdf5::numbers<std::uint32_t>(file_, vmd_structure::bond_from),
             to = hdf5::numbers<std::uint32_t>(file_, vmd_structure::bond_to);
  if (from.size() != to.size()) damaged("bonds with one end");
  for (std::size_t k = 0; k < from.size(); ++k) {
    if (std::min(from[k], to[k]) < 1 || std::max(from[k], to[k]) > particles()) damaged("a bond of no particle");
    bonds.push_back({from[k] - 1, to[k] - 1});
  }
}

double TrajectoryReader::time(std::uint64_t index) const {
  return hdf5::number_at(file_, kParticles + "position/time", index);
}

TrajectoryFrame TrajectoryReader::frame(std::uint64_t index) const {
  TrajectoryFrame frame;
  frame.time = time(index);
  frame.step = static_cast<std::int64_t>(hdf5::number_at(file_, kParticles + "position/step", index));
  for (std::size_t k = 0; k < 3; ++k)
    frame.edges[k] = hdf5::diagonal_at(file_, kParticles + "box/edges/value", index, static_cast<int>(k));
  frame.tilt = hdf5::rows<double>(file_, kParticles + "box/edges/value", index, 1).at(3);
  frame.position = hdf5::rows<double>(file_, kParticles + "position/value", index, 1);
  frame.velocity = hdf5::rows<double>(file_, kParticles + "velocity/value", index, 1);
  frame.image = hdf5::rows<std::int32_t>(file_, kParticles + "image/value", index, 1);
  if (!moment.empty()) {
    frame.spin = hdf5::rows<double>(file_, kParticles + "angular_velocity/value", index, 1);
    if (frame.spin.size() != 3 * particles()) damaged("angular velocities of another number of particles");
  }
  for (const std::size_t size : {frame.position.size(), frame.velocity.size(), frame.image.size()})
    if (size != 3 * particles()) damaged("data sets of different numbers of particles");
  return frame;
}

void TrajectoryReader::damaged(const std::string& what) const {
  throw Error(Failure::file, path().string() + ": holds " + what + ": it is damaged, or no trajectory of carom");
}

}  // namespace carom
