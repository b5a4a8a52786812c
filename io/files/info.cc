// SPDX-License-Identifier: BSD-3-Clause
#include "io/files/info.h"

#include <spdlog/fmt/fmt.h>

#include <cstdio>

#include "engine/base/error.h"
#include "io/deck/deck_problems.h"
#include "io/files/checkpoint.h"
#include "io/files/directory_lock.h"
#include "io/files/hdf5.h"
#include "io/files/journal.h"
#include "io/files/output_directory.h"
#include "io/files/trajectory_reader.h"

namespace carom {

namespace {

std::string line(const char* name, const std::string& value) { return fmt::format("{:<14}{}\n", name, value); }

/// "from 0 to 12.5" for an ascending data set.
std::string range_of(const hdf5::File& file, const std::string& dataset, hsize_t rows) {
  if (rows == 0) return "none";
  return fmt::format("{:g} to {:g}", hdf5::number_at(file, dataset, 0), hdf5::number_at(file, dataset, rows - 1));
}

std::string optional_text(const hdf5::File& file, const std::string& dataset) {
  return hdf5::exists(file, dataset) ? hdf5::text(file, dataset) : "unknown";
}

std::string describe_trajectory(const hdf5::File& file) {
  const std::string particles = "/particles/trajectory";
  const auto shape = hdf5::shape(file, particles + "/position/value", 3);
  const hsize_t frames = hdf5::shape(file, particles + "/position/step", 1)[0];
  const double axes = hdf5::exists(file, "/parameters/dimension") ? hdf5::number_at(file, "/parameters/dimension", 0)
                                                                  : static_cast<double>(shape[2]);
  if (!(axes >= 1 && axes <= 3))
    throw Error(Failure::file, file.path().string() + fmt::format(": a trajectory in {:g} dimensions", axes));
  const int dimension = static_cast<int>(axes);
  const auto boundary = hdf5::attribute_texts(file, particles + "/box", "boundary");
  std::vector<std::string> edges;
  if (frames > 0)
    for (int k = 0; k < dimension; ++k)
      edges.push_back(fmt::format("{:g}", hdf5::diagonal_at(file, particles + "/box/edges/value", frames - 1, k)));
  const auto version = hdf5::attribute_numbers(file, "/h5md", "version", 2);
  return line("kind", fmt::format("H5MD {}.{} trajectory", version[0], version[1])) +
         line("written by", join(hdf5::attribute_texts(file, "/h5md/creator", "name")) + " " +
                                join(hdf5::attribute_texts(file, "/h5md/creator", "version"))) +
         line("title", optional_text(file, "/parameters/title")) +
         line("integrator", optional_text(file, "/parameters/integrator")) +
         line("dimension", std::to_string(dimension)) + line("particles", std::to_string(shape[1])) +
         line("box", join(edges)) +
         line("boundary", hdf5::exists(file, "/parameters/boundary") ? join(hdf5::texts(file, "/parameters/boundary"))
                                                                     : join(boundary)) +
         line("frames", std::to_string(frames)) + line("times", range_of(file, particles + "/position/time", frames)) +
         line("steps", range_of(file, particles + "/position/step", frames));
}

std::string describe_events(const hdf5::File& file) {
  const hsize_t events = hdf5::shape(file, "/events/time", 1)[0];
  const auto version = hdf5::attribute_numbers(file, "/events", "version", 2);
  return line("kind", fmt::format("events, format {}.{}", version[0], version[1])) +
         line("written by", join(hdf5::attribute_texts(file, "/events", "creator"))) +
         line("title", optional_text(file, "/parameters/title")) +
         line("integrator", optional_text(file, "/parameters/integrator")) +
         line("dimension", std::to_string(hdf5::attribute_numbers(file, "/events", "dimension", 1)[0])) +
         line("collisions", std::to_string(events)) + line("times", range_of(file, "/events/time", events));
}

std::string describe_checkpoint(const std::filesystem::path& path) {
  const Checkpoint checkpoint(path);
  const CheckpointHead& head = checkpoint.head();
  return line("kind", "checkpoint, good") + line("written by", "carom " + head.version) +
         line("integrator", head.integrator) + line("dimension", std::to_string(head.dimension)) +
         line("particles", std::to_string(head.particles)) + line("step", std::to_string(head.step)) +
         line("time", fmt::format("{:g}", head.time)) + line("frames", std::to_string(head.files.frames.length));
}

}  // namespace

std::string describe_file(const std::filesystem::path& path) {
  if (std::filesystem::is_directory(path)) {
    std::string all;
    for (const char* name : {run_file::trajectory, run_file::events, run_file::checkpoint})
      if (std::filesystem::exists(path / name)) {
        if (!all.empty()) all += '\n';
        all += describe_file(path / name);
      }
    if (all.empty())
      throw Error(Failure::file, path.string() +
                                     ": the directory holds no trajectory.h5md, events.h5 or checkpoint.h5; " +
                                     "name the directory of a run, or a file");
    return all;
  }
  const std::string head = line("file", path.string());
  if (is_checkpoint(path)) return head + describe_checkpoint(path);
  std::string text;
  hdf5::read_between_flushes(path, [&] {
    const hdf5::File file = hdf5::File::open_unlocked(path);
    const bool events = hdf5::exists(file, "/events/time_in_slab");
    if (!events) need_trajectory(file);
    text = events ? describe_events(file) : describe_trajectory(file);
  });
  if (run_is_at_work(path.parent_path()))
    text += line("being written",
                 "Python's carom.open() reads it meanwhile; other programs report \"unable to lock file\", and "
                 "read it with HDF5_USE_FILE_LOCKING=FALSE, best opened anew for later frames");
  return head + text;
}

int info_command(const std::filesystem::path& file) {
  const std::string text = describe_file(file);
  if (std::fputs(text.c_str(), stdout) < 0 || std::fflush(stdout) != 0)
    throw Error(Failure::file, "standard output: cannot write to it");
  return 0;
}

}  // namespace carom
