// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The directory of a run: created if it is missing; the files of an earlier run are moved, never lost. (One run at a
// time: directory_lock.h.)

#include <filesystem>
#include <optional>
#include <string>

#include "engine/run/observable.h"

namespace carom {

/// The files that a run writes.
namespace run_file {
inline constexpr const char* deck = "deck.toml";
inline constexpr const char* trajectory = "trajectory.h5md";
inline constexpr const char* thermo = "thermo.csv";
inline constexpr const char* events = "events.h5";
inline constexpr const char* summary = "summary.json";
inline constexpr const char* log = "run.log";
inline constexpr const char* checkpoint = "checkpoint.h5";
inline constexpr const char* previous_checkpoint = "checkpoint.previous.h5";
inline constexpr const char* lock = "carom.lock";
inline std::string averages(const ObservableInfo& info) { return std::string(info.name) + ".csv"; }
}  // namespace run_file

/// Creates the directory if it is missing. Throws Error(Failure::file).
void make_output_directory(const std::filesystem::path& directory);

/// Requires that the directory exists. If it has files of these names, moves them into its subdirectory `backup.1`, or
/// the next number that is free, and returns that. With `overwrite` removes them instead, except for what is neither a
/// file nor a link. Throws Error(Failure::file).
std::optional<std::filesystem::path> prepare_output_directory(const std::filesystem::path& directory,
                                                              bool overwrite = false);

}  // namespace carom
