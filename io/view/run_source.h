// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Answers the page's requests about a run from the run's files, which may be growing.
//
//   state         JSON: what the run is, how many frames there are, whether it is active
//   particles     32-bit floats, little-endian: N radii [length], N species, N masses [mass], N charges [charge]
//   bonds         32-bit integers: the two ids of each bond, which count from 0
//   frame/K       nine doubles (time, step, collisions, the three edges of the box, whether counts and whether spins
//                 follow, the tilt of the box [length]), then floats: N positions of three columns [length], N speeds
//                 [velocity], N magnitudes of the spins [1/time], N numbers of collisions so far
//   path/I/K      floats: the positions of particle I from frame K on, at most 2000 frames
//   thermo/B      thermo.csv from its byte B on, complete rows, at most 4 MiB
//   rdf, sk, profile   rdf.csv, sk.csv, profile.csv

#include <array>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace carom {

struct Answer {
  const char* type;  ///< a MIME type
  std::string body;
};

class RunSource {
 public:
  /// `awaited`: the run is about to start, its files may be missing. Otherwise throws Error(Failure::file) if the
  /// directory holds no readable trajectory.
  RunSource(std::filesystem::path directory, bool awaited);

  /// The answer, or nullopt for an unknown question. Throws Error(Failure::file).
  std::optional<Answer> answer(std::string_view question);

  /// The averages that the page draws.
  static constexpr std::array<std::string_view, 3> kAverages = {"rdf", "sk", "profile"};

  /// The answer to `state`.
  nlohmann::json state();
  std::uint64_t particles() const { return particles_; }

 private:
  void look();
  std::string fixed_values() const;
  std::string bonds() const;
  std::string path(std::uint64_t particle, std::uint64_t first) const;
  std::string frame(std::uint64_t number);
  void count_collisions(double until);

  std::filesystem::path directory_, trajectory_;
  nlohmann::json head_;          // the constant data of the trajectory file
  std::string seen_, identity_;  // version of the trajectory file at the last check, and its identity
  std::uint64_t particles_ = 0, frames_ = 0;
  std::vector<std::uint32_t> counts_;  // collisions of each particle among the first `counted_` events
  std::uint64_t counted_ = 0;
  double counted_until_ = 0;
};

}  // namespace carom
