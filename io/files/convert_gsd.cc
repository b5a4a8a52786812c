// SPDX-License-Identifier: BSD-3-Clause
// GSD, version 2 (gsd.readthedocs.io, "File layer specification" and "HOOMD schema"): a header, the index of all
// chunks, their names, then the chunks, all in the byte order of the machine. All sizes are known beforehand, so the
// file is written sequentially.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <type_traits>
#include <utility>

#include "io/files/convert.h"

namespace carom {

namespace {

struct Header {
  std::uint64_t magic = 0x65DF65DF65DF65DF;
  std::uint64_t index_location = 0, index_entries = 0, names_location = 0, names_entries = 0;
  std::uint32_t schema_version = (1u << 16) | 4u, gsd_version = 2u << 16;
  char application[64] = "carom", schema[64] = "hoomd", reserved[80] = {};
};
static_assert(sizeof(Header) == 256);

struct Entry {
  std::uint64_t frame = 0, rows = 0;
  std::int64_t location = 0;
  std::uint32_t columns = 0;
  std::uint16_t name = 0;
  std::uint8_t type = 0, flags = 0;
};
static_assert(sizeof(Entry) == 32);

constexpr std::uint64_t kNameEntry = 64;  // bytes; the unit in which the header counts the list of names

/// The code of a type: unsigned integers from 1, signed ones from 5, by size; single precision.
template <class T>
constexpr std::uint8_t type_of() {
  if (std::is_same_v<T, float>) return 9;
  return static_cast<std::uint8_t>((std::is_signed_v<T> ? 4 : 0) + std::bit_width(sizeof(T)));
}

std::vector<float> single(std::span<const double> values) { return {values.begin(), values.end()}; }

/// Visits every chunk of a frame of the file: chunk(name, rows, number of columns).
template <class Chunk>
void each_chunk(const TrajectoryReader& t, std::uint64_t number, const TrajectoryFrame& f, Chunk&& chunk) {
  const bool flat = t.dimension == 2;
  chunk("configuration/step", std::vector{static_cast<std::uint64_t>(f.step)}, 1);
  std::vector<float> box = {static_cast<float>(f.edges[0]),
                            static_cast<float>(f.edges[1]),
                            flat ? 0.0f : static_cast<float>(f.edges[2]),
                            static_cast<float>(f.tilt / f.edges[1]),
                            0,
                            0};
  chunk("configuration/box", box, 1);
  chunk("particles/N", std::vector{static_cast<std::uint32_t>(t.particles())}, 1);
  std::vector<float> position(f.position.size());
  std::vector<std::int32_t> image = f.image;
  for (std::size_t i = 0; i < position.size(); ++i) {
    double x = f.position[i] - f.edges[i % 3] / 2;
    if (i % 3 == 0 && f.tilt != 0) {  // into the oblique box of HOOMD, around the origin
      const double row = f.tilt * (f.position[i + 1] / f.edges[1] - 0.5),
                   boxes = std::floor((x - row) / f.edges[0] + 0.5);
      x -= boxes * f.edges[0];
      image[i] += static_cast<std::int32_t>(boxes);
    }
    position[i] = flat && i % 3 == 2 ? 0.0f : static_cast<float>(x);
  }
  chunk("particles/position", position, 3);
  chunk("particles/velocity", single(f.velocity), 3);
  chunk("particles/image", image, 3);
  if (!f.spin.empty()) {
    // HOOMD's conjugate quaternion of the angular momentum L in the frame of the body is 2 q (0, L); the orientation q
    // of a sphere, which Carom does not follow, is the default (1, 0, 0, 0).
    std::vector<float> momentum(4 * t.particles());
    for (std::size_t i = 0; i < t.particles(); ++i)
      for (std::size_t k = 0; k < 3; ++k)
        momentum[4 * i + 1 + k] = static_cast<float>(2 * t.moment[i] * f.spin[3 * i + k]);
    chunk("particles/angmom", momentum, 4);
  }
  if (number > 0) return;  // the chunks below never change, and readers take them from the first frame
  chunk("configuration/dimensions", std::vector{static_cast<std::uint8_t>(t.dimension)}, 1);
  const auto names = [&](const std::string& name, const std::vector<std::string>& all) {
    std::size_t width = 1;
    for (const std::string& each : all) width = std::max(width, each.size() + 1);
    std::vector<std::int8_t> text;
    for (const std::string& each : all) {
      text.insert(text.end(), each.begin(), each.end());
      text.resize(text.size() + width - each.size());
    }
    chunk(name, text, static_cast<std::uint32_t>(width));
  };
  names("particles/types", t.species_names);
  chunk("particles/typeid", std::vector<std::uint32_t>(t.species.begin(), t.species.end()), 1);
  chunk("particles/mass", single(t.mass), 1);
  chunk("particles/charge", single(t.charge), 1);
  std::vector<float> diameter(t.particles());
  std::ranges::transform(t.radius, diameter.begin(), [](double r) { return static_cast<float>(2 * r); });
  chunk("particles/diameter", diameter, 1);
  if (!t.moment.empty()) {
    std::vector<float> moments(3 * t.particles());  // HOOMD turns bodies about axes with a moment only
    for (std::size_t i = 0; i < moments.size(); ++i)
      moments[i] = flat && i % 3 < 2 ? 0.0f : static_cast<float>(t.moment[i / 3]);
    chunk("particles/moment_inertia", moments, 3);
  }
  if (t.bonds.empty()) return;
  chunk("bonds/N", std::vector{static_cast<std::uint32_t>(t.bonds.size())}, 1);
  names("bonds/types", {"bond"});
  chunk("bonds/typeid", std::vector<std::uint32_t>(t.bonds.size()), 1);
  std::vector<std::uint32_t> group;
  for (const auto& bond : t.bonds) group.insert(group.end(), bond.begin(), bond.end());
  chunk("bonds/group", group, 2);
}

template <class Data>
std::string_view as_text(const Data& data) {
  const auto bytes = std::as_bytes(std::span(data));
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

std::string write_gsd(const TrajectoryReader& trajectory, std::span<const std::uint64_t> frames, TextFile& file,
                      const std::filesystem::path& /*path*/) {
  // 1. The list of chunks. All frames but the first have equal lists and sizes.
  std::vector<std::string> names;
  std::vector<Entry> index;
  std::int64_t end = 0;
  std::array<std::vector<Entry>, 2> kinds;
  const TrajectoryFrame any = trajectory.frame(frames.front());
  for (const std::uint64_t number : {0, 1})
    each_chunk(trajectory, number, any, [&](const std::string& name, const auto& data, std::uint32_t columns) {
      auto at = std::ranges::find(names, name);
      if (at == names.end()) at = names.insert(at, name);
      using T = typename std::decay_t<decltype(data)>::value_type;
      kinds[number].push_back({0, data.size() / columns, static_cast<std::int64_t>(data.size() * sizeof(T)), columns,
                               static_cast<std::uint16_t>(at - names.begin()), type_of<T>(), 0});
    });
  std::string list;
  for (const std::string& name : names) list += name + '\0';
  list.resize((list.size() / kNameEntry + 1) * kNameEntry);

  // 2. Their positions. The index is in the order of frames and names, the file in the order of each_chunk.
  const std::size_t chunks = kinds[0].size() + (frames.size() - 1) * kinds[1].size();
  Header header;
  header.names_location = sizeof(Header);
  header.names_entries = list.size() / kNameEntry;
  header.index_location = sizeof(Header) + list.size();
  header.index_entries = chunks;
  end = static_cast<std::int64_t>(header.index_location + chunks * sizeof(Entry));
  for (std::size_t number = 0; number < frames.size(); ++number)
    for (Entry entry : kinds[number > 0 ? 1 : 0]) {
      entry.frame = number;
      const std::int64_t size = std::exchange(entry.location, end);
      end += size;
      index.push_back(entry);
    }
  std::ranges::stable_sort(index, {}, [](const Entry& e) { return std::pair(e.frame, e.name); });

  // 3. The file.
  file.append(as_text(std::array{header}));
  file.append(list);
  file.append(as_text(index));
  for (std::size_t number = 0; number < frames.size(); ++number)
    each_chunk(trajectory, number, trajectory.frame(frames[number]),
               [&](const std::string&, const auto& data, std::uint32_t) { file.append(as_text(data)); });
  return {};
}

}  // namespace carom
