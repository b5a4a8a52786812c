// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Averages that are taken during a run, and the declarations by which they are found by name.
//
//   const auto rdf = make_observable<3>("rdf", run.system(), {{"interval", 0.1}, {"range", 3.0}});
//   run.add(*rdf);
//   run.run();
//   for (const TableColumn& column : rdf->table()) use(column.name, column.values);
//
// The keys of [output] (rdf_interval, rdf_range …), their checks and manual, the files (rdf.csv) and the entries of the
// summary are generated from the declarations.

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/archive.h"
#include "engine/base/parameters.h"
#include "engine/run/simulation.h"

namespace carom {

/// A column of a table; all columns of a table have equal length.
struct TableColumn {
  std::string name;
  std::vector<double> values;
};

/// Adds a column of means after the other means, and at the end columns of their errors and independent samples. (A
/// prefix cannot be taken for a part of a species' name.)
inline void add_estimates(std::vector<TableColumn>& table, const std::string& name, const std::vector<double>& means,
                          const std::vector<Estimate>& estimates) {
  const auto after = std::ranges::find_if(table, [](const auto& each) { return each.name.starts_with("error_"); });
  table.insert(after, {name, means});
  TableColumn errors{"error_" + name, {}}, samples{"samples_" + name, {}};
  for (const Estimate& each : estimates) {
    errors.values.push_back(each.error);
    samples.values.push_back(each.samples);
  }
  table.push_back(std::move(errors));
  table.push_back(std::move(samples));
}

/// A number about one or more species for the summary: `"name": [{"species": ["a", "b"], "symbol": value}, …]`; without
/// species one about the whole system: `"name": {"symbol": {"mean": value, "standard_error": error}, …}`.
struct SpeciesValue {
  std::string_view name;
  std::vector<std::string> species;
  std::string_view symbol;
  double value;
  double error = std::numeric_limits<double>::quiet_NaN();  ///< one standard error; NaN: unknown
};

template <int D>
class Observable : public Observer<D> {
 public:
  explicit Observable(const Sampling& sampling) : sampling_(sampling) {}

  Sampling sampling() const final { return sampling_; }
  void sample(double time, const Particles<D>& particles) final {
    add_sample(time, particles);
    ++samples_;
  }
  void add_state(Fields& fields, const std::string& name) final {
    fields.add_of_run({name, [this](Archive& archive) {
                         archive(samples_);
                         sums(archive);
                       }});
  }
  /// The number of samples taken.
  std::uint64_t samples() const { return samples_; }

  /// The averages of the samples so far; called only after the first sample.
  virtual std::vector<TableColumn> table() const = 0;
  virtual std::vector<SpeciesValue> species_values() const { return {}; }

 private:
  /// Passes to the archive, in a fixed order, everything that a sample changes and a later sample or a table reads.
  virtual void sums(Archive& archive) = 0;
  /// Adds a sample; samples() have been added before. `particles` are all particles in the order of their ids. With
  /// several ranks, called on rank 0 only; if divided(), on every rank with its own particles (Particles::owns).
  virtual void add_sample(double time, const Particles<D>& particles) = 0;

  Sampling sampling_;
  std::uint64_t samples_ = 0;
};

/// The functions of a declaration for D dimensions.
template <int D>
struct ObservableMaker {
  /// Sets the parameters that are not given and depend on the system; returns an error if a parameter does not fit it.
  std::optional<ParameterError> (*complete)(Parameters&, const System<D>&) = nullptr;
  /// Makes one from complete parameters; the first sample is due at time `start`. The system must outlive it.
  std::unique_ptr<Observable<D>> (*make)(const System<D>&, const Parameters&, double start) = nullptr;
};

/// The declaration of an observable; engine/run/observables.cc lists them all.
struct ObservableInfo {
  std::string_view name;  ///< begins the names of the file and the keys: `profile` writes profile.csv
  std::string_view title;
  std::vector<Parameter> parameters;  ///< must include `interval` (parameter::interval)
  std::string_view documentation;     ///< a paragraph for the manual
  std::string_view source;            ///< papers
  ObservableMaker<2> in_2d;
  ObservableMaker<3> in_3d;
  bool sheared = false;  ///< also for sheared boxes

  template <int D>
  const ObservableMaker<D>& in() const {
    if constexpr (D == 2)
      return in_2d;
    else
      return in_3d;
  }
  /// Completes the parameters, as ObservableMaker::complete.
  template <int D>
  std::optional<ParameterError> complete(Parameters& given, const System<D>& system) const {
    if (system.box.sheared() && !sheared)
      return ParameterError{"interval", std::string(name) + " does not go with 'shear' yet", "leave one of them out"};
    return in<D>().complete(given, system);
  }
};

/// All observables, in the order of the manual.
const std::vector<ObservableInfo>& observables();

/// The observable with this name; throws Error(Failure::deck) with a list of the names if there is none.
const ObservableInfo& find_observable(std::string_view name);

/// Makes an observable; parameters that are not given have their defaults. Throws Error(Failure::deck).
template <int D>
std::unique_ptr<Observable<D>> make_observable(std::string_view name, const System<D>& system, Parameters given,
                                               double start = 0);

namespace parameter {
/// The time between two samples; 0: no samples.
Parameter interval(std::string_view meaning);
}  // namespace parameter

namespace observable {

template <int D>
std::optional<ParameterError> nothing_to_complete(Parameters&, const System<D>&) {
  return {};
}

/// The functions for an observable template T with a constructor from system, parameters and start.
template <template <int> class T, int D>
ObservableMaker<D> maker(std::optional<ParameterError> (*complete)(Parameters&,
                                                                   const System<D>&) = nothing_to_complete) {
  return {complete, [](const System<D>& system, const Parameters& parameters, double start) {
            return std::unique_ptr<Observable<D>>(std::make_unique<T<D>>(system, parameters, start));
          }};
}

}  // namespace observable
}  // namespace carom
