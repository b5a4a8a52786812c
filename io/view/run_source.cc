// SPDX-License-Identifier: BSD-3-Clause
#include "io/view/run_source.h"

#include <spdlog/fmt/fmt.h>
#include <sys/stat.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <fstream>
#include <span>

#include "engine/base/error.h"
#include "io/deck/deck.h"
#include "io/files/directory_lock.h"
#include "io/files/h5md.h"
#include "io/files/hdf5.h"
#include "io/files/journal.h"
#include "io/files/output_directory.h"
#include "io/files/thermo.h"
#include "io/files/trajectory_reader.h"

namespace carom {

namespace {

using Json = nlohmann::json;

static_assert(std::endian::native == std::endian::little);
constexpr const char* kBinary = "application/octet-stream";
constexpr const char* kText = "text/plain; charset=utf-8";
const std::string kParticles = "/particles/trajectory";

struct FileStatus {
  bool exists = false;
  std::string identity, version;  // identity and version of the file
  std::uint64_t size = 0;
};

FileStatus status_of(const std::filesystem::path& path) {
  struct stat s {};
  if (::stat(path.c_str(), &s) != 0) return {};
  const std::string identity = fmt::format("{}:{}", s.st_dev, s.st_ino);
  return {true, identity, fmt::format("{}:{}:{}.{:09}", identity, s.st_size, s.st_mtim.tv_sec, s.st_mtim.tv_nsec),
          static_cast<std::uint64_t>(s.st_size)};
}

template <class T>
void append(std::string& bytes, std::span<const T> values) {
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
}

std::optional<std::uint64_t> number_behind(std::string_view question, std::string_view prefix) {
  std::uint64_t number = 0;
  if (!question.starts_with(prefix)) return {};
  question.remove_prefix(prefix.size());
  const auto [end, error] = std::from_chars(question.data(), question.data() + question.size(), number);
  if (question.empty() || error != std::errc{} || end != question.data() + question.size()) return {};
  return number;
}

/// The columns of thermo.csv that the page draws.
Json curves() {
  Json all = Json::array();
  for (const Column<3>& column : columns<3>())
    if (const ColumnChart* chart = column.chart)
      all.push_back({{"column", column.name},
                     {"chart", chart->name},
                     {"title", chart->title},
                     {"logarithmic", chart->logarithmic}});
  return all;
}

/// The complete rows of a table from byte `first` on.
std::string rows_from(const std::filesystem::path& path, std::uint64_t first) {
  constexpr std::size_t kMostThermoBytes = 4 << 20;
  std::ifstream in(path, std::ios::binary);
  std::string text(kMostThermoBytes, '\0');
  in.seekg(static_cast<std::streamoff>(first));
  in.read(text.data(), kMostThermoBytes);
  text.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, in.gcount())));
  text.resize(text.rfind('\n') + 1);
  return text;
}

/// Name, normal, motion and shape of each wall that is more than a fixed face of the box.
Json walls_of(const hdf5::File& file) {
  Json walls = Json::array();
  if (!hdf5::exists(file, "/parameters/walls")) return walls;
  const auto names = hdf5::texts(file, "/parameters/walls/name");
  const auto normal = hdf5::numbers<double>(file, "/parameters/walls/normal"),
             motion = hdf5::numbers<double>(file, "/parameters/walls/motion");
  std::vector<double> shape;
  if (hdf5::exists(file, "/parameters/walls/shape")) shape = hdf5::numbers<double>(file, "/parameters/walls/shape");
  const std::size_t columns = names.empty() ? 0 : motion.size() / names.size();  // 4 or 5 in files of earlier versions
  for (std::size_t n = 0; n < names.size(); ++n) {
    walls.push_back({{"name", names[n]},
                     {"normal", std::vector<double>(&normal.at(3 * n), &normal.at(3 * n) + 3)},
                     {"motion", std::vector<double>(&motion.at(columns * n), &motion.at(columns * n) + columns)}});
    if (!shape.empty()) walls.back()["shape"] = std::vector<double>(&shape.at(8 * n), &shape.at(8 * n) + 8);
  }
  return walls;
}

}  // namespace

RunSource::RunSource(std::filesystem::path directory, bool awaited)
    : directory_(std::move(directory)), trajectory_(directory_ / run_file::trajectory) {
  if (!awaited && !std::filesystem::exists(trajectory_))
    throw Error(Failure::file, fmt::format("{}: has no {}; name the directory that `carom run` has written",
                                           directory_.string(), run_file::trajectory));
  if (!awaited) look();
}

void RunSource::look() {
  const FileStatus now = status_of(trajectory_);
  if (!now.exists || now.version == seen_) return;
  hdf5::read_between_flushes(trajectory_, [&] {
    const auto file = hdf5::File::open_unlocked(trajectory_);
    need_trajectory(file);
    frames_ = hdf5::shape(file, kParticles + "/position/step").at(0);
    if (now.identity == identity_) return;
    particles_ = hdf5::shape(file, kParticles + "/position/value").at(1);
    head_ = {{"id", now.identity},
             {"title", hdf5::text(file, "/parameters/title")},
             {"integrator", hdf5::text(file, "/parameters/integrator")},
             {"dimension", static_cast<int>(hdf5::number_at(file, "/parameters/dimension", 0))},
             {"boundary", hdf5::texts(file, "/parameters/boundary")},
             {"species", hdf5::texts(file, "/parameters/species")},
             {"particles", particles_},
             {"bonds",
              hdf5::exists(file, vmd_structure::bond_from) ? hdf5::shape(file, vmd_structure::bond_from).at(0) : 0}};
    head_["walls"] = walls_of(file);
    counts_.clear();
  });
  seen_ = now.version;
  identity_ = now.identity;
}

Json RunSource::state() {
  // Checks first whether the run is active, so that its last writes before its end are seen, too.
  const bool at_work = run_is_at_work(directory_);
  look();
  Json state = head_;
  std::string status = at_work ? "running" : frames_ == 0 ? "awaited" : "ended";
  if (const auto text = at_work ? std::nullopt : read_text(directory_ / run_file::summary)) {
    const Json summary = Json::parse(*text, nullptr, false);
    if (summary.is_object()) status = summary.value("status", status);
  }
  state["name"] = directory_.lexically_normal().string();
  state["status"] = status;
  state["frames"] = frames_;
  state["curves"] = curves();
  state["thermo"] = status_of(directory_ / run_file::thermo).size;
  for (const std::string_view name : kAverages)
    state["averages"][std::string(name)] = status_of(directory_ / (std::string(name) + ".csv")).version;
  return state;
}

std::optional<Answer> RunSource::answer(std::string_view question) {
  if (question == "state") return Answer{"application/json", state().dump()};
  if (std::ranges::find(kAverages, question) != kAverages.end()) {
    auto text = read_text(directory_ / (std::string(question) + ".csv"));
    if (!text) return {};
    return Answer{kText, std::move(*text)};
  }
  if (const auto first = number_behind(question, "thermo/"))
    return Answer{kText, rows_from(directory_ / run_file::thermo, *first)};
  look();
  if (frames_ == 0) return {};
  if (question == "particles") return Answer{kBinary, fixed_values()};
  if (question == "bonds") return Answer{kBinary, bonds()};
  if (question.starts_with("path/")) {
    const std::size_t slash = question.rfind('/');
    const auto particle = number_behind(question.substr(0, slash), "path/");
    const auto first = number_behind(question.substr(slash), "/");
    if (particle && first && *particle < particles_ && *first < frames_)
      return Answer{kBinary, path(*particle, *first)};
  }
  if (const auto number = number_behind(question, "frame/"); number && *number < frames_)
    return Answer{kBinary, frame(*number)};
  return {};
}

std::string RunSource::fixed_values() const {
  std::string bytes;
  hdf5::read_between_flushes(trajectory_, [&] {
    const auto file = hdf5::File::open_unlocked(trajectory_);
    bytes.clear();
    for (const char* name : {"/radius", "/species", "/mass", "/charge"})
      append<float>(bytes, hdf5::rows<float>(file, kParticles + name, 0, particles_));
  });
  return bytes;
}

std::string RunSource::bonds() const {
  std::vector<std::uint32_t> ids;
  hdf5::read_between_flushes(trajectory_, [&] {
    ids.clear();
    const auto file = hdf5::File::open_unlocked(trajectory_);
    if (!hdf5::exists(file, vmd_structure::bond_from)) return;
    const auto from = hdf5::numbers<std::uint32_t>(file, vmd_structure::bond_from);
    const auto to = hdf5::numbers<std::uint32_t>(file, vmd_structure::bond_to);
    for (std::size_t k = 0; k < std::min(from.size(), to.size()); ++k) {
      if (std::min(from[k], to[k]) < 1 || std::max(from[k], to[k]) > particles_)
        throw Error(Failure::file, trajectory_.string() + ": holds a bond of no particle: it is damaged");
      ids.insert(ids.end(), {from[k] - 1, to[k] - 1});
    }
  });
  std::string bytes;
  append<std::uint32_t>(bytes, ids);
  return bytes;
}

std::string RunSource::path(std::uint64_t particle, std::uint64_t first) const {
  std::vector<float> x;
  hdf5::read_between_flushes(trajectory_, [&] {
    const auto file = hdf5::File::open_unlocked(trajectory_);
    const auto frames = std::min<std::uint64_t>(2000, frames_ - first);
    x = hdf5::rows<float>(file, kParticles + "/position/value", first, frames, 1, particle);
  });
  std::string bytes;
  append<float>(bytes, x);
  return bytes;
}

std::string RunSource::frame(std::uint64_t number) {
  std::vector<float> x, v, spin;
  double head[9] = {};
  hdf5::read_between_flushes(trajectory_, [&] {
    const auto file = hdf5::File::open_unlocked(trajectory_);
    head[0] = hdf5::number_at(file, kParticles + "/position/time", number);
    head[1] = hdf5::number_at(file, kParticles + "/position/step", number);
    head[2] = hdf5::number_at(file, "/observables/collisions/value", number);
    for (int k = 0; k < 3; ++k) head[3 + k] = hdf5::diagonal_at(file, kParticles + "/box/edges/value", number, k);
    head[8] = hdf5::rows<double>(file, kParticles + "/box/edges/value", number, 1).at(3);
    x = hdf5::rows<float>(file, kParticles + "/position/value", number, 1);
    v = hdf5::rows<float>(file, kParticles + "/velocity/value", number, 1);
    if (hdf5::exists(file, kParticles + "/angular_velocity"))
      spin = hdf5::rows<float>(file, kParticles + "/angular_velocity/value", number, 1);
  });
  count_collisions(head[0]);
  head[6] = counts_.empty() ? 0 : 1;
  head[7] = spin.empty() ? 0 : 1;
  std::string bytes;
  bytes.reserve(sizeof head + 5 * sizeof(float) * particles_);
  append<double>(bytes, head);
  append<float>(bytes, x);
  for (auto* rows : {&v, &spin}) {
    const std::size_t n = rows->size() / 3;
    for (std::size_t i = 0; i < n; ++i) (*rows)[i] = std::hypot((*rows)[3 * i], (*rows)[3 * i + 1], (*rows)[3 * i + 2]);
    append<float>(bytes, std::span(*rows).first(n));
  }
  append<float>(bytes, std::vector<float>(counts_.begin(), counts_.end()));
  return bytes;
}

void RunSource::count_collisions(double until) {
  const auto events = directory_ / run_file::events;
  if (!std::filesystem::exists(events)) return counts_.clear();
  if (counts_.size() != particles_ || until < counted_until_) {
    counts_.assign(particles_, 0);
    counted_ = 0;
  }
  counted_until_ = until;
  constexpr std::uint64_t kEventsPerRead = 1 << 16;
  bool more = true;
  while (more) {
    std::vector<double> time;
    std::vector<std::uint32_t> kind, lo, hi;
    hdf5::read_between_flushes(events, [&] {
      const auto file = hdf5::File::open_unlocked(events);
      const std::uint64_t all = hdf5::shape(file, "/events/time").at(0);
      const std::uint64_t n = counted_ < all ? std::min(kEventsPerRead, all - counted_) : 0;
      time = hdf5::rows<double>(file, "/events/time", counted_, n);
      kind = hdf5::rows<std::uint32_t>(file, "/events/kind", counted_, n);
      lo = hdf5::rows<std::uint32_t>(file, "/events/lo", counted_, n);
      hi = hdf5::rows<std::uint32_t>(file, "/events/hi", counted_, n);
    });
    const auto now = static_cast<std::size_t>(std::upper_bound(time.begin(), time.end(), until) - time.begin());
    for (std::size_t k = 0; k < now; ++k) {
      ++counts_.at(lo[k]);
      if (kind[k] == 0) ++counts_.at(hi[k]);
    }
    counted_ += now;
    more = now == kEventsPerRead;
  }
}

}  // namespace carom
