// SPDX-License-Identifier: BSD-3-Clause
#include "io/files/h5md.h"

#include <pwd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <optional>

#include "io/files/hdf5.h"
#include "io/files/thermo.h"
#include "io/files/version.h"

namespace carom {

namespace {

using hdf5::File;
using hdf5::Handle;
using hdf5::Series;

/// Vectors as rows of three columns, with zeros for a missing axis.
template <class T, class Vectors>
std::vector<T> three_columns(const Vectors& vectors, int dimension) {
  std::vector<T> rows(3 * vectors.size(), T{});
  for (std::size_t i = 0; i < vectors.size(); ++i)
    for (int k = 0; k < dimension; ++k) rows[3 * i + static_cast<std::size_t>(k)] = vectors[i][k];
  return rows;
}

/// Packs arrays into a message, one after the other.
template <class... Arrays>
Bytes packed(const Arrays&... arrays) {
  Bytes bytes;
  bytes.reserve((std::as_bytes(std::span(arrays)).size() + ...));
  const auto add = [&](std::span<const std::byte> more) { bytes.insert(bytes.end(), more.begin(), more.end()); };
  (add(std::as_bytes(std::span(arrays))), ...);
  return bytes;
}

/// The variable data of a block of particles as a message.
template <int D>
Bytes frame_of(const Particles<D>& p, bool spins) {
  return packed(p.x, p.v, p.image, std::span(p.spin).first(spins ? p.spin.size() : 0));
}

/// Spins as rows of three columns.
template <int D>
std::vector<double> spin_columns(std::span<const Spin<D>> spins) {
  std::vector<double> rows(3 * spins.size());
  for (std::size_t i = 0; i < spins.size(); ++i)
    std::ranges::copy(spins[i], rows.begin() + static_cast<std::ptrdiff_t>(3 * i + (D == 2 ? 2 : 0)));
  return rows;
}

/// Unpacks the next `n` values of a message.
template <class T>
std::span<const T> next(Reader& message, std::size_t n) {
  return {reinterpret_cast<const T*>(message.skip(n * sizeof(T))), n};
}

std::string user_name() {
  const passwd* entry = getpwuid(getuid());
  return entry != nullptr ? entry->pw_name : "unknown";
}

void write_origin(File& file) {
  const Handle h5md = file.group("h5md"), author = file.group("h5md/author"), creator = file.group("h5md/creator");
  file.write_attribute(h5md, "version", std::vector<std::int32_t>{1, 1});
  file.write_attribute(author, "name", user_name());
  file.write_attribute(creator, "name", std::string("carom"));
  file.write_attribute(creator, "version", version_string());
}

template <int D>
void write_parameters(File& file, const Deck& deck, const System<D>& system) {
  const Handle group = file.group("parameters");
  std::vector<std::string> boundary;
  for (const Boundary b : system.box.boundary) boundary.emplace_back(find_boundary(b).name);
  file.write_text(group, "deck", deck.toml_text);
  file.write_text(group, "title", deck.title);
  file.write_text(group, "integrator", deck.integrator);
  file.write_number<std::int32_t>(group, "dimension", D);
  file.write_texts(group, "boundary", boundary);
  file.write_texts(group, "species", system.species);
}

/// The walls that are more than fixed faces of the box; `motion` of each: normal·x without motion, velocity, amplitude,
/// frequency and phase of a sine, when it ends. If some are round, `shape` of each: the radius, which is 0 for a plane,
/// the centre, the unit vector along a cylinder, 1 if the spheres are inside, else 0.
template <int D>
void write_walls(File& file, const Box<D>& box) {
  if (box.options.empty()) return;
  std::vector<std::string> names;
  std::vector<Vec<D>> normals;
  std::vector<double> motion, shape;
  Box<D> still = box;
  for (WallOptions<D>& each : still.options) each.velocity = each.amplitude = 0;
  for (const WallOptions<D>& each : box.options) {
    const Wall<D> wall = still.wall(each.number);
    names.push_back(each.name);
    normals.push_back(wall.normal);
    motion.insert(motion.end(), {wall.offset, each.velocity, each.amplitude, each.frequency, each.turns, each.until});
    const std::vector<double> place = three_columns<double>(std::vector{each.centre, each.direction}, D);
    shape.push_back(each.round);
    shape.insert(shape.end(), place.begin(), place.end());
    shape.push_back(each.inside ? 1 : 0);
  }
  const Handle group = file.group("parameters/walls");
  file.write_texts(group, "name", names);
  file.write_array(group, "normal", hdf5::native_type<double>(), three_columns<double>(normals, D).data(),
                   {names.size(), 3});
  file.write_array(group, "motion", hdf5::native_type<double>(), motion.data(), {names.size(), 6});
  if (std::ranges::any_of(box.options, [](const auto& each) { return each.round > 0; }))
    file.write_array(group, "shape", hdf5::native_type<double>(), shape.data(), {names.size(), 8});
}

/// The radius of a species: the mean of its particles, exact if all have the same radius.
struct SpeciesRadius {
  double first = 0, excess = 0;
  std::size_t particles = 0;
  void add(double radius) {
    if (particles++ == 0) first = radius;
    excess += radius - first;
  }
  double mean() const { return first + excess / static_cast<double>(particles); }
};

void write_species(File& file, const std::vector<std::string>& names, const std::vector<SpeciesRadius>& radii) {
  constexpr std::size_t kLongestName = 15;  // characters of a name in VMD
  const Handle group = file.group(vmd_structure::group);
  std::vector<std::int32_t> index;
  std::vector<std::string> name;
  std::vector<double> radius;
  for (std::size_t s = 0; s < names.size(); ++s) {
    if (radii[s].particles == 0) continue;
    index.push_back(static_cast<std::int32_t>(s));
    name.push_back(names[s].substr(0, kLongestName));
    radius.push_back(radii[s].mean());
  }
  file.write_array(group, "indexOfSpecies", hdf5::native_type<std::int32_t>(), index.data(), {index.size()});
  file.write_texts(group, "name", name);
  file.write_texts(group, "type", name);
  file.write_array(group, "radius", hdf5::native_type<double>(), radius.data(), {radius.size()});
}

/// Each pair that any term joins, listed once.
template <int D>
void write_bonds(File& file, const System<D>& system) {
  PairList bonds;
  for (const auto& term : system.interactions)
    if (const PairList* some = term->bonds(); some != nullptr)
      for (const auto& [i, j] : *some) bonds.push_back({std::min(i, j), std::max(i, j)});
  system.box.steps.for_each_bond([&](Id i, Id j, const PairSteps&) { bonds.push_back({i, j}); });
  if (bonds.empty()) return;
  std::ranges::sort(bonds);
  bonds.erase(std::unique(bonds.begin(), bonds.end()), bonds.end());
  std::vector<std::int32_t> from, to;
  for (const auto& [i, j] : bonds) {
    from.push_back(static_cast<std::int32_t>(i + 1));
    to.push_back(static_cast<std::int32_t>(j + 1));
  }
  const Handle group = file.group(vmd_structure::group);
  for (const auto& [name, ends] : {std::pair("bond_from", &from), std::pair("bond_to", &to)})
    file.write_array(group, name, hdf5::native_type<std::int32_t>(), ends->data(), {ends->size()});
}

/// Writes the H5MD module `units`, which uses texts of variable length.
void write_units(File& file, const Units& units, bool spins) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose), scalar(H5Screate(H5S_SCALAR), H5Sclose);
  H5Tset_size(type.id(), H5T_VARIABLE);
  const auto write = [&](const std::string& name, const std::string& unit) {
    const Handle attribute(file.check(H5Acreate_by_name(file.id(), name.c_str(), "unit", type.id(), scalar.id(),
                                                        H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                                      "create the unit of " + name),
                           H5Aclose);
    const char* text = unit.c_str();
    file.check(H5Awrite(attribute.id(), type.id(), &text), "write the unit of " + name);
  };
  const std::string particles = "particles/trajectory/";
  write(particles + "position/value", units.length);
  write(particles + "box/edges/value", units.length);
  write(particles + "radius", units.length);
  write(particles + "velocity/value", units.length + " " + units.time + "-1");
  if (spins) write(particles + "angular_velocity/value", units.time + "-1");
  write(particles + "position/time", units.time);
}

/// A time-dependent element of H5MD: value, step and time.
template <class T>
struct Element {
  Handle group;
  Series<T> value;
  Element(File& file, const std::string& name, std::vector<hsize_t> row_shape = {},
          hid_t stored = hdf5::native_type<T>())
      : group(file.group(name)), value(file, group, "value", std::move(row_shape), stored) {}
  void share_clock(File& file, const Handle& clock) {
    file.link(clock, "step", group, "step");
    file.link(clock, "time", group, "time");
  }
};

}  // namespace

template <int D>
struct TrajectoryWriter<D>::Contents {
  Contents(File at, const System<D>& system)
      : file(std::move(at)),
        position(file, "particles/trajectory/position", {system.size(), 3}),
        velocity(file, "particles/trajectory/velocity", {system.size(), 3}),
        image(file, "particles/trajectory/image", {system.size(), 3}),
        step(file, position.group, "step"),
        time(file, position.group, "time"),
        box(file.group("particles/trajectory/box")),
        edges(file, "particles/trajectory/box/edges", {3, 3}),
        box_of(system.box),
        ranks(system.decomposition.ranks()) {
    for (const Column<D>& column : columns<D>()) {
      if (!column.element) continue;
      const bool counts = column.kind == ColumnKind::count, vector = column.kind == ColumnKind::vector;
      const auto stored = counts ? hdf5::native_type<std::uint64_t>() : hdf5::native_type<double>();
      const std::string name = std::string("observables/").append(column.element);
      observables.push_back({{file, name, std::vector<hsize_t>(vector ? 1 : 0, 3), stored}, &column});
    }
    if (system.box.contacts.rough())
      spin.emplace(file, "particles/trajectory/angular_velocity", std::vector<hsize_t>{system.size(), 3});
    for (auto* element : {&velocity, &edges}) element->share_clock(file, position.group);
    if (spin) spin->share_clock(file, position.group);
    image.share_clock(file, position.group);
    for (auto& [element, column] : observables) element.share_clock(file, position.group);
  }

  void create(const Deck& deck, const System<D>& system) {
    write_origin(file);
    write_parameters(file, deck, system);
    write_walls(file, system.box);
    write_box(system.box);
    write_fixed(system);
    write_bonds(file, system);
    if (deck.output.units) write_units(file, *deck.output.units, spin.has_value());
    file.flush();
  }

  void cut(std::uint64_t frames) {
    for (auto* element : {&position, &velocity, &edges}) element->value.cut(frames);
    if (spin) spin->value.cut(frames);
    for (auto& [element, column] : observables) element.value.cut(frames);
    image.value.cut(frames);
    time.cut(frames);
    step.cut(frames);
  }

  void write_box(const Box<D>& b) {
    std::vector<std::string> boundary(3, "none");
    for (std::size_t k = 0; k < D; ++k) boundary[k] = find_boundary(b.boundary[k]).h5md;
    file.write_attribute(box, "dimension", std::int32_t{3});
    file.write_attribute(box, "boundary", boundary);
  }

  void write_fixed(const System<D>& system) {
    const Handle group(H5Gopen2(file.id(), "particles/trajectory", H5P_DEFAULT), H5Gclose);
    const std::size_t n = system.size();
    const hdf5::Array<std::uint32_t> id(file, group, "id", n);
    const hdf5::Array<std::int32_t> species(file, group, "species", n);
    const hdf5::Array<double> mass(file, group, "mass", n), radius(file, group, "radius", n),
        charge(file, group, "charge", n);
    const ContactLaws& contacts = system.box.contacts;
    std::optional<hdf5::Array<double>> moment;
    if (contacts.rough()) moment.emplace(file, group, "moment_of_inertia", n);
    std::size_t first = 0;
    std::vector<SpeciesRadius> species_radii(system.species.size());
    const auto write = [&](std::span<const std::uint16_t> kinds, std::span<const double> masses,
                           std::span<const double> radii, std::span<const double> charges) {
      std::vector<std::uint32_t> ids(kinds.size());
      std::iota(ids.begin(), ids.end(), static_cast<std::uint32_t>(first));
      id.write(first, ids);
      species.write(first, std::vector<std::int32_t>(kinds.begin(), kinds.end()));
      mass.write(first, masses);
      radius.write(first, radii);
      charge.write(first, charges);
      std::vector<double> moments(kinds.size());
      for (std::size_t i = 0; i < kinds.size(); ++i) {
        species_radii[kinds[i]].add(radii[i]);
        moments[i] = contacts.moment(kinds[i], masses[i], radii[i], D);
      }
      if (moment) moment->write(first, moments);
      first += kinds.size();
    };
    const Particles<D>& p = system.particles;
    if (!system.decomposition.joined())
      write(p.species, p.mass, p.radius, p.charge);
    else
      one_after_the_other(
          ranks, [&] { return packed(p.mass, p.radius, p.charge, p.species); },
          [&](int /*rank*/, const Bytes& message) {
            const std::size_t here = message.size() / (3 * sizeof(double) + sizeof(std::uint16_t));
            Reader reader(message);
            const auto masses = next<double>(reader, here), radii = next<double>(reader, here),
                       charges = next<double>(reader, here);
            write(next<std::uint16_t>(reader, here), masses, radii, charges);
          });
    write_species(file, system.species, species_radii);
  }

  /// Writes the variable data of the particles: one row of all particles, from one state or from the blocks of all
  /// ranks.
  void write_particles(const Particles<D>& p) {
    for (auto* element : {&position, &velocity}) element->value.append_row();
    image.value.append_row();
    if (spin) spin->value.append_row();
    if (ranks.size() == 1) {
      write_part(0, p.x, p.v, p.image, p.spin);
      return;
    }
    std::size_t first = 0;
    try {
      one_after_the_other(
          ranks, [&] { return frame_of(p, spin.has_value()); },
          [&](int /*rank*/, const Bytes& message) {
            const std::size_t n =
                message.size() / (2 * sizeof(Vec<D>) + sizeof(Image<D>) + (spin ? sizeof(Spin<D>) : 0));
            Reader reader(message);
            const auto x = next<Vec<D>>(reader, n), v = next<Vec<D>>(reader, n);
            const auto images = next<Image<D>>(reader, n);
            write_part(first, x, v, images, next<Spin<D>>(reader, spin ? n : 0));
            first += n;
          });
    } catch (...) {  // a rank is lost: the frame is dropped
      for (auto* element : {&position, &velocity}) element->value.drop_row();
      image.value.drop_row();
      if (spin) spin->value.drop_row();
      throw;
    }
  }
  void write_part(std::size_t first, std::span<const Vec<D>> x, std::span<const Vec<D>> v,
                  std::span<const Image<D>> images, std::span<const Spin<D>> spins) {
    if (spin) spin->value.write_part(first, spin_columns<D>(spins));
    velocity.value.write_part(first, three_columns<double>(v, D));
    image.value.write_part(first, three_columns<std::int32_t>(images, D));
    position.value.write_part(first, three_columns<double>(x, D));
  }

  File file;
  Element<double> position, velocity;
  Element<std::int32_t> image;
  std::optional<Element<double>> spin;  // if contacts are rough
  Series<std::int64_t> step;
  Series<double> time;
  Handle box;
  Element<double> edges;
  struct Observable {
    Element<double> element;
    const Column<D>* column;
  };
  std::vector<Observable> observables;
  const Box<D>& box_of;
  Communicator& ranks;
};

template <int D>
TrajectoryWriter<D>::TrajectoryWriter(const std::filesystem::path& path, const Deck& deck, const System<D>& system,
                                      const std::optional<FileMark>& mark)
    : contents_(std::make_unique<Contents>(mark ? File::append(path) : File::create(path), system)) {
  if (mark)
    contents_->cut(mark->length);
  else
    contents_->create(deck, system);
}

template <int D>
TrajectoryWriter<D>::~TrajectoryWriter() = default;

template <int D>
void TrajectoryWriter<D>::frame(const Snapshot<D>& s) {
  Contents& c = *contents_;
  c.write_particles(*s.particles);
  const Vec<D> lengths = c.box_of.lengths(s.time);
  std::array<double, 9> edges{0, 0, 0, 0, 0, 0, 0, 0, 1};  // in two dimensions 1 along z
  for (int k = 0; k < D; ++k) edges[4 * static_cast<std::size_t>(k)] = lengths[k];
  edges[3] = c.box_of.tilt;
  c.edges.value.append(edges);
  for (auto& [element, column] : c.observables) {
    std::vector<double> row(column->components() > 1 ? 3 : 1);
    for (int axis = 0; axis < column->components(); ++axis) row[static_cast<std::size_t>(axis)] = column->of(s, axis);
    element.value.append(row);
  }
  c.time.append(s.time);
  c.step.append(s.step);
  c.file.flush();
}

template <int D>
FileMark TrajectoryWriter<D>::mark() const {
  return hdf5::mark(contents_->file, kFrameRows, contents_->step.rows());
}

template <int D>
void TrajectoryWriter<D>::close() {
  contents_->file.close();
}

template <int D>
BlockSender<D>::BlockSender(Communicator& ranks, const System<D>& system, bool creates)
    : ranks_(ranks), spins_(system.box.contacts.rough()) {
  if (!creates) return;
  const Particles<D>& p = system.particles;
  one_after_the_other(
      ranks, [&] { return packed(p.mass, p.radius, p.charge, p.species); }, [](int, const Bytes&) {});
}

template <int D>
void BlockSender<D>::frame(const Snapshot<D>& s) {
  one_after_the_other(
      ranks_, [&] { return frame_of(*s.particles, spins_); }, [](int, const Bytes&) {});
}

template class TrajectoryWriter<2>;
template class TrajectoryWriter<3>;
template class BlockSender<2>;
template class BlockSender<3>;

}  // namespace carom
