// SPDX-License-Identifier: BSD-3-Clause
// carom._carom: sessions in two and three dimensions, and the declarations of their parameters. The package in carom/
// builds the public interface on it.

#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include <chrono>
#include <optional>
#include <utility>

#include "engine/forces/potentials/table.h"
#include "engine/laws/boundary.h"
#include "io/files/thermo.h"
#include "io/files/version.h"
#include "io/python/python_lock.h"
#include "io/python/session.h"
#include "io/python/values.h"
#include "io/view/view.h"

namespace carom::python {
namespace {

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;

std::span<const double> span_of(const Array& array) { return {array.data(), static_cast<std::size_t>(array.size())}; }

/// A read-only view of numbers that `owner` keeps alive; `columns` 0: an array with one axis.
template <class T>
py::array view(const void* data, std::size_t rows, int columns, const py::object& owner) {
  std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(rows)};
  if (columns > 0) shape.push_back(columns);
  py::array array(py::dtype::of<T>(), shape, data, owner);
  array.attr("setflags")(py::arg("write") = false);
  return array;
}

Plan plan_of(const py::dict& ends, double every) {
  using enum Parameter::Type;
  using enum Parameter::Range;
  static const std::vector<Parameter> declared = {
      {"time", real, "none", "time", "simulated time at which the run ends", positive},
      {"steps", integer, "none", "-", "number of steps after which the run ends", positive},
      {"collisions", integer, "none", "-", "number of pair collisions after which the run ends", positive},
      {"every", real, "none", "time", "time between two calls of the callback", positive}};
  const Parameters given = completed("run", declared, parameters_of("run", declared, ends));
  Plan plan{.frame_interval = every, .thermo_interval = every};
  if (given.has("time")) plan.end_time = given.real("time");
  if (given.has("steps")) plan.steps = given.integer("steps");
  if (given.has("collisions")) plan.collisions = static_cast<std::uint64_t>(given.integer("collisions"));
  if (given.has("every")) plan.frame_interval = plan.thermo_interval = given.real("every");
  return plan;
}

/// A run for Python: its signals and callbacks. An exception in a callback ends the run at the end of the step, as does
/// the end of Python.
template <int D>
void run(Session<D>& session, const Plan& plan, const py::object& callback, const py::object& progress,
         const std::string& script) {
  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::milliseconds kTimeBetweenChecks(50);
  std::optional<py::error_already_set> raised;
  std::optional<Unlocked> unlocked(std::in_place);
  const auto in_python = [&](auto&& succeeds) {
    unlocked->with_lock([&] {
      if (!raised && !succeeds()) raised.emplace();
    });
  };
  auto last_look = Clock::now();
  bool cut = false;
  RunHooks hooks;
  hooks.script = script;
  hooks.stop = [&](const Statistics& statistics) {
    cut = cut || python_is_ending();
    if (cut || raised) return true;
    if (const auto now = Clock::now(); now - last_look >= kTimeBetweenChecks) {
      last_look = now;
      in_python([&] {
        return PyErr_CheckSignals() == 0 &&
               (progress.is_none() || call(progress, "dd", statistics.fraction_done, statistics.end_time));
      });
    }
    return raised.has_value();
  };
  if (!callback.is_none()) hooks.show = [&] { in_python([&] { return call(callback); }); };
  try {
    session.run(plan, hooks);
  } catch (const Error& error) {
    if (error.failure() != Failure::interrupted) throw;  // else `raised` or `cut` says more
  }
  unlocked.reset();
  if (raised) throw std::move(*raised);
  if (cut) {
    PyErr_SetNone(PyExc_SystemExit);  // ends the thread, and is not reported
    throw py::error_already_set();
  }
}

/// A number, an integer or an array of D numbers.
template <int D>
py::object value_of(const Column<D>& column, const Snapshot<D>& shot) {
  if (column.kind == ColumnKind::number) return py::float_(column.of(shot, 0));
  if (column.kind == ColumnKind::count) return py::int_(static_cast<std::int64_t>(column.of(shot, 0)));
  Array all(D);
  for (int axis = 0; axis < D; ++axis) all.mutable_data()[axis] = column.of(shot, axis);
  return all;
}

template <int D>
void bind(py::module_& module, const char* name) {
  using S = Session<D>;
  using V = ParticleViews<D>;
  const auto rows = [](auto get, int columns) {
    return [get, columns](const py::object& self) {
      const auto all = (self.cast<S&>().views().*get)();
      return view<typename decltype(all)::value_type::value_type>(all.data(), all.size(), columns, self);
    };
  };
  py::class_<S> session_type(module, name);
  for (const Column<D>& column : columns<D>())
    if (column.python)
      session_type.def_property_readonly(column.python, [&column](S& s) { return value_of(column, s.shot()); });
  session_type.def(py::init<const std::vector<double>&, const std::vector<std::string>&>())
      .def("add_particles",
           [](S& session, const Array& x, const Array& v, const Array& radius, const Array& mass, const Array& charge,
              const Array& spin, const std::string& species, double inertia) {
             session.add_particles({span_of(x), span_of(v), span_of(radius), span_of(mass), span_of(charge),
                                    span_of(spin), species, inertia});
           })
      .def("set_position", [](S& session, const Array& x) { session.set_position(span_of(x)); })
      .def("set_velocity", [](S& session, const Array& v) { session.set_velocity(span_of(v)); })
      .def("set_spin", [](S& session, const Array& spin) { session.set_spin(span_of(spin)); })
      .def("set_inertia", &S::set_inertia)
      .def("set", [](S& session, const std::string& table,
                     const py::dict& given) { session.set(table, parameters_of(table_schema(table), given)); })
      .def("set_shear", &S::set_shear)
      .def_property_readonly("shear_rate", &S::shear_rate)
      .def("set_bath_temperature", &S::set_bath_temperature)
      .def("take", &S::take)
      .def("run",
           [](S& session, const py::dict& ends, const py::object& callback, const py::object& progress,
              const std::string& script) {
             Plan plan = plan_of(ends, session.plan().thermo_interval);
             if (!plan.end_time && !plan.steps && !plan.collisions) {
               plan.end_time = session.plan().end_time;
               plan.steps = session.plan().steps;
               plan.collisions = session.plan().collisions;
             }
             run(session, plan, callback, progress, script);
           })
      .def("set_output", &S::set_output)
      .def_property_readonly("begun", &S::begun)
      .def_property_readonly("tilt", &S::tilt)
      .def("draw", [](S& session, const Array& temperature, std::uint64_t seed,
                      bool spins) { session.draw(span_of(temperature), seed, spins); })
      .def("means",
           [](const S& session) {
             py::dict all;
             const Statistics& statistics = session.statistics();
             const auto add = [&](const char* of, const Estimate& e) {
               py::dict entry;
               entry["mean"] = e.mean;
               entry["standard_error"] = e.error;
               entry["independent_samples"] = e.samples;
               entry["needed_time"] = statistics.needed_time(e);
               all[of] = entry;
             };
             for (std::size_t k = 0; k < Statistics::mean_names.size(); ++k)
               add(Statistics::mean_names[k], statistics.estimate(k));
             if (statistics.shear_rate != 0) add("shear_stress", statistics.shear_stress());
             return all;
           })
      .def("averages",
           [](const S& session) {
             py::dict all;
             for (const auto& [average, table] : session.averages()) {
               py::dict columns;
               for (const TableColumn& column : table)
                 columns[py::str(column.name)] =
                     Array(static_cast<py::ssize_t>(column.values.size()), column.values.data());
               all[py::str(average)] = columns;
             }
             return all;
           })
      .def("position", rows(&V::position, D))
      .def("velocity", rows(&V::velocity, D))
      .def("image", rows(&V::image, D))
      .def("spin", rows(&V::spin, D == 2 ? 0 : D))
      .def_property_readonly("inertias", &S::inertias)
      .def("constant",
           [](const py::object& self, const std::string& which) -> py::array {
             const Constants all = self.cast<S&>().views().constants();
             if (which == "species") return view<std::uint16_t>(all.species.data(), all.species.size(), 0, self);
             const auto values = which == "mass" ? all.mass : which == "radius" ? all.radius : all.charge;
             return view<double>(values.data(), values.size(), 0, self);
           })
      .def_property_readonly("energy_error",
                             [](S& s) {
                               const double scale = s.statistics().energy_reference;
                               return scale > 0 ? s.shot().max_energy_error / scale : 0.0;
                             })
      .def_property_readonly("force_passes", [](const S& s) { return s.statistics().force_passes; })
      .def_property_readonly("wall_seconds", [](const S& s) { return s.statistics().wall_seconds; })
      .def_property_readonly("interval", [](const S& s) { return s.plan().thermo_interval; })
      .def_property_readonly("size", &S::size)
      .def_property_readonly("directory", &S::directory)
      .def_property_readonly("warnings", &S::warnings)
      .def_property_readonly("species", &S::species)
      .def_property_readonly("method",
                             [](const S& s) { return std::string(s.integrator() ? s.integrator()->name : ""); })
      .def_property_readonly("forces",
                             [](const S& s) {
                               py::list all;
                               for (const ValueTable& force : s.tables("interaction"))
                                 all.append(py::make_tuple(force.variant->name, values_of(force.of_variant())));
                               return all;
                             })
      .def("tables",
           [](const S& s, const std::string& which) {
             py::list all;
             for (const ValueTable& table : s.tables(which)) all.append(values_of(table.values));
             return all;
           })
      .def("deck",
           [](S& s, const std::string& of, const std::vector<std::string>& without) {
             DeckValues values = s.deck(of);
             for (const std::string& table : without) values.list(table).clear();
             return write_deck(values);
           })
      .def_property_readonly("wall_loads", &S::wall_loads);
}

/// A session, its warnings, and the keys of [output] that the deck gives, with its directory.
py::tuple opened(Deck& deck, auto&&... from) {
  py::object session;
  const ValueTable& table = *deck.source->values.find("output");
  Parameters output{{"directory", deck.output.directory.string()}};
  for (const auto& [key, value] : table.values.all())
    if (table.given(key) && key != "directory") output.set(key, value);
  if (deck.dimension == 2)
    session = py::cast(std::make_unique<Session<2>>(deck, from...));
  else
    session = py::cast(std::make_unique<Session<3>>(deck, from...));
  return py::make_tuple(session, deck.warnings, values_of(output));
}

/// The simulation of a deck, given as a file or as text.
py::tuple from_deck(const std::string& file, const std::vector<std::string>& set,
                    const std::optional<std::string>& text) {
  Deck deck = read_deck(
      file, set, [&](const std::filesystem::path& path) { return text && path == file ? text : read_text(path); });
  return opened(deck, std::nullopt, [] {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  });
}

/// The simulation of a run to be continued.
py::tuple from_run(const std::string& directory, bool take_over) {
  Communicator alone;
  Resumed from = find_run(directory, take_over, alone);
  RunOptions options;
  options.go_on = directory;
  Deck deck = deck_of(from, options, alone);
  return opened(deck, from);
}

/// Serves the page of runs until a signal ends the process (view/view.h).
void serve_page(const std::vector<std::string>& runs, const std::optional<std::string>& file, std::uint16_t port,
                bool browser, bool led) {
  ViewOptions options;
  options.runs = {runs.begin(), runs.end()};
  options.port = port;
  options.browser = browser;
  options.led = led;
  if (file) options.export_to = *file;
  const py::gil_scoped_release released;
  view_command(options);
}

/// V and dV/dr at the distances `at`, from the spline of a table potential through the given points.
py::tuple spline(const Array& r, const Array& value, const Array& slope, const Array& at) {
  const Table table(span_of(r), span_of(value), span_of(slope));
  Array v(at.size()), derivative(at.size());
  for (py::ssize_t k = 0; k < at.size(); ++k) {
    const double distance = at.data()[k], rho = distance * distance;
    v.mutable_data()[k] = table.value(rho);
    derivative.mutable_data()[k] = 2 * distance * table.derivative(rho);
  }
  return py::make_tuple(v, derivative);
}

py::dict descriptors() {
  py::list methods, terms, rules;
  for (const IntegratorInfo& info : integrators()) {
    py::dict one;
    one["name"] = info.name, one["title"] = info.title, one["documentation"] = info.documentation;
    one["order"] = info.order, one["conserves"] = info.conserves, one["source"] = info.source;
    one["parameters"] = described(info.parameters);
    methods.append(one);
  }
  for (const InteractionInfo& info : interactions()) {
    py::dict one;
    one["name"] = info.name, one["formula"] = info.formula, one["documentation"] = info.documentation;
    one["source"] = info.source, one["parameters"] = described(info.parameters);
    terms.append(one);
  }
  for (const BoundaryInfo& info : boundaries()) {
    py::dict one;
    one["name"] = info.name, one["meaning"] = info.meaning;
    rules.append(one);
  }
  py::dict all;
  all["integrators"] = methods, all["forces"] = terms, all["boundaries"] = rules;
  const auto table = [](const char* name) {
    py::dict one;
    one["name"] = name, one["meaning"] = table_schema(name).meaning;
    one["parameters"] = described(table_schema(name).keys);
    return py::make_tuple(one);
  };
  all["walls"] = table("wall");
  all["contacts"] = table("contact");
  all["steps"] = table("step");
  all["baths"] = table("bath");
  return all;
}

/// Every key of a deck, described: {table: {variant: [key, …]}}. The variant "" has the keys that all variants have.
py::dict schema() {
  py::dict all;
  for (const TableSchema& table : deck_schema()) {
    py::dict variants;
    variants[""] = described(table.keys);
    for (const Variant& variant : table.variants) variants[py::str(variant.name)] = described(variant.keys);
    all[py::str(table.name)] = variants;
  }
  return all;
}

/// Raises the exception of carom.errors for the failure, with the text of the error.
void raise(const Error& error) {
  const py::object errors = py::module_::import("carom.errors");
  const py::object type = errors.attr("of_exit_code")(error.exit_code());
  PyErr_SetObject(type.ptr(), py::str(error.what()).ptr());
}

}  // namespace
}  // namespace carom::python

PYBIND11_MODULE(_carom, module) {
  using namespace carom::python;
  // pybind11 wants it by value. NOLINTNEXTLINE(performance-unnecessary-value-param)
  py::register_exception_translator([](std::exception_ptr pointer) {
    try {
      if (pointer) std::rethrow_exception(pointer);
    } catch (const carom::Error& error) {
      raise(error);
    }
  });
  stop_runs_at_exit();
  bind<2>(module, "Session2");
  bind<3>(module, "Session3");
  module.def("from_deck", from_deck);
  module.def("from_run", from_run);
  module.def("view", serve_page);
  module.def("spline", spline);
  module.def("descriptors", descriptors);
  module.def("schema", schema);
  py::dict meanings;
  for (const carom::Column<3>& column : carom::columns<3>())
    if (column.python) meanings[column.python] = std::string(column.meaning) + " [" + column.unit + "]";
  module.attr("columns") = meanings;
  module.attr("version") = carom::version_string();
}
