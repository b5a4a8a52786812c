// SPDX-License-Identifier: BSD-3-Clause
#include "io/command/convert.h"

#include <algorithm>
#include <charconv>
#include <iostream>

#include "engine/base/error.h"
#include "io/files/convert.h"
#include "io/files/text_file.h"

namespace carom {

namespace {

[[noreturn]] void refuse(const std::string& choice, const std::string& what) {
  throw Error(Failure::deck, "--frames " + choice + ": error: " + what +
                                 "; give a number (7, -1 for the last) or a slice first:behind:stride (0:100:10)");
}

/// The parts between colons; an empty part is nullopt.
std::vector<std::optional<std::int64_t>> parts_of(const std::string& choice) {
  std::vector<std::optional<std::int64_t>> parts;
  for (std::string_view rest = choice;;) {
    const std::size_t colon = rest.find(':');
    const std::string_view part = rest.substr(0, colon);
    std::int64_t value = 0;
    const auto [end, failed] = std::from_chars(part.data(), part.data() + part.size(), value);
    if (!part.empty() && (failed != std::errc{} || end != part.data() + part.size())) refuse(choice, "cannot read it");
    parts.push_back(part.empty() ? std::optional<std::int64_t>() : value);
    if (colon == std::string_view::npos) return parts;
    rest.remove_prefix(colon + 1);
  }
}

}  // namespace

std::vector<std::uint64_t> chosen_frames(const std::string& choice, std::uint64_t frames) {
  const auto parts = parts_of(choice);
  const auto count = static_cast<std::int64_t>(frames);
  const std::string there = "there are " + std::to_string(frames) + " frames";
  if (parts.size() == 1) {
    if (!parts[0]) refuse(choice, "cannot read it");
    const std::int64_t index = *parts[0] < 0 ? *parts[0] + count : *parts[0];
    if (index < 0 || index >= count) refuse(choice, there);
    return {static_cast<std::uint64_t>(index)};
  }
  const auto end_of = [&](std::optional<std::int64_t> part, std::int64_t fallback) {
    if (!part) return fallback;
    return std::clamp(*part < 0 ? *part + count : *part, std::int64_t{0}, count);
  };
  const std::int64_t stride = parts.size() > 2 && parts[2] ? *parts[2] : 1;
  if (parts.size() > 3 || stride < 1) refuse(choice, "cannot read it");
  std::vector<std::uint64_t> chosen;
  for (std::int64_t f = end_of(parts[0], 0); f < end_of(parts[1], count); f += stride)
    chosen.push_back(static_cast<std::uint64_t>(f));
  if (chosen.empty()) refuse(choice, there + ", none of them chosen");
  return chosen;
}

std::vector<std::string> format_names() {
  std::vector<std::string> names;
  for (const ExportFormat& format : export_formats()) names.emplace_back(format.name);
  return names;
}

int convert_command(const ConvertOptions& options) {
  const auto format = std::ranges::find(export_formats(), options.format, &ExportFormat::name);
  const TrajectoryReader trajectory(options.run);
  if (trajectory.frames() == 0) throw Error(Failure::file, trajectory.path().string() + ": holds no frame");
  const std::string choice = !options.frames.empty() ? options.frames : format->one_frame ? "-1" : ":";
  const auto frames = chosen_frames(choice, trajectory.frames());
  if (format->one_frame && frames.size() > 1)
    refuse(choice, std::string(format->name) + " takes one frame, these are " + std::to_string(frames.size()));

  auto file = trajectory.path();
  if (options.output)
    file = *options.output;
  else
    file.replace_extension(format->extension);
  std::error_code ignored;
  if (std::filesystem::equivalent(file, trajectory.path(), ignored))
    throw Error(Failure::deck, "-o " + file.string() + ": error: this is the trajectory itself; name another file");
  std::ostream& account = is_standard_output(file) ? std::cerr : std::cout;
  std::string note;
  write_aside(file, [&](TextFile& out) { note = format->write(trajectory, frames, out, file); });
  account << file.string() << ": " << frames.size() << (frames.size() == 1 ? " frame of " : " frames of ")
          << trajectory.particles() << " particles\n"
          << note << (note.empty() ? "" : "\n");
  return 0;
}

}  // namespace carom
