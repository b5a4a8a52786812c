// SPDX-License-Identifier: BSD-3-Clause
// XDMF (xdmf.org): points at each time; the numbers stay in the trajectory, to which the file refers. How it refers
// to one row of a series differs: readers of XDMF 3 take a selection after the name of the data set (start : stride :
// count : dimensions), readers of XDMF 2 an item of type HyperSlab, and neither reader supports the other notation.

#include <spdlog/fmt/fmt.h>

#include "io/files/convert.h"

namespace carom {

namespace {

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '"' ? "&quot;" : std::string(1, c);
  return out;
}

struct Numbers {
  std::string file;        // the trajectory, as the XML names it
  std::uint64_t rows = 0;  // length of its series
  std::size_t particles = 0;
  int version = 3;  // version of XDMF

  /// One row of a series of vectors.
  std::string row(const std::string& name, std::string_view type, int bytes, std::uint64_t index) const {
    if (version == 3)
      return fmt::format(
          R"(<DataItem Dimensions="{0} 3" NumberType="{3}" Precision="{4}" Format="HDF">{5}:/particles/trajectory/{6}/value|{1} 0 0:1 1 1:1 {0} 3:{2} {0} 3</DataItem>)",
          particles, index, rows, type, bytes, file, name);
    return fmt::format(
        R"(<DataItem ItemType="HyperSlab" Dimensions="{0} 3">
          <DataItem Dimensions="3 3" NumberType="Int" Format="XML">{1} 0 0 1 1 1 1 {0} 3</DataItem>
          <DataItem Dimensions="{2} {0} 3" NumberType="{3}" Precision="{4}" Format="HDF">{5}:/particles/trajectory/{6}/value</DataItem>
        </DataItem>)",
        particles, index, rows, type, bytes, file, name);
  }
  std::string fixed(const std::string& name, std::string_view type, int bytes) const {
    return fmt::format(
        R"(<DataItem Dimensions="{}" NumberType="{}" Precision="{}" Format="HDF">{}:/particles/trajectory/{}</DataItem>)",
        particles, type, bytes, file, name);
  }
};

std::string write(int version, const TrajectoryReader& trajectory, std::span<const std::uint64_t> frames,
                  TextFile& file, const std::filesystem::path& path) {
  const auto folder = std::filesystem::absolute(path).parent_path();
  const Numbers numbers{escaped(std::filesystem::proximate(trajectory.path(), folder).string()), trajectory.frames(),
                        trajectory.particles(), version};
  file.append(fmt::format(R"(<?xml version="1.0"?>
<Xdmf Version="{}.0">
<Domain>
<Grid Name="{}" GridType="Collection" CollectionType="Temporal">
)",
                          version, escaped(trajectory.title)));
  for (const std::uint64_t index : frames) {
    std::string grid =
        fmt::format(R"(<Grid Name="particles" GridType="Uniform">
  <Time Value="{}"/>
  <Topology TopologyType="Polyvertex" NumberOfElements="{}" NodesPerElement="1"/>
  <Geometry GeometryType="XYZ">
        {}
  </Geometry>
)",
                    trajectory.time(index), trajectory.particles(), numbers.row("position", "Float", 8, index));
    const auto attribute = [&](std::string_view name, std::string_view type, const std::string& item) {
      grid +=
          fmt::format("  <Attribute Name=\"{}\" AttributeType=\"{}\" Center=\"Node\">\n        {}\n  </Attribute>\n",
                      name, type, item);
    };
    attribute("velocity", "Vector", numbers.row("velocity", "Float", 8, index));
    if (!trajectory.moment.empty())
      attribute("angular_velocity", "Vector", numbers.row("angular_velocity", "Float", 8, index));
    attribute("image", "Vector", numbers.row("image", "Int", 4, index));
    for (const char* name : {"radius", "mass", "charge"}) attribute(name, "Scalar", numbers.fixed(name, "Float", 8));
    attribute("species", "Scalar", numbers.fixed("species", "Int", 4));
    attribute("id", "Scalar", numbers.fixed("id", "UInt", 4));
    file.append(grid + "</Grid>\n");
  }
  file.append("</Grid>\n</Domain>\n</Xdmf>\n");
  return "It refers to " + trajectory.path().string() + ", beside which it must stay";
}

}  // namespace

std::string write_xdmf(const TrajectoryReader& trajectory, std::span<const std::uint64_t> frames, TextFile& file,
                       const std::filesystem::path& path) {
  return write(3, trajectory, frames, file, path);
}

std::string write_xdmf2(const TrajectoryReader& trajectory, std::span<const std::uint64_t> frames, TextFile& file,
                        const std::filesystem::path& path) {
  return write(2, trajectory, frames, file, path);
}

}  // namespace carom
