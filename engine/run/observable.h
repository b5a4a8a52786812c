// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What is averaged while a run goes on, and the declaration that makes it known by its name.
//
//   const auto rdf = make_observable<3>("rdf", run.system(), {{"interval", 0.1}, {"range", 3.0}});
//   run.add(*rdf);
//   run.run();
//   for (const TableColumn& column : rdf->table()) use(column.name, column.values);
//
// From the declarations come the keys of [output] (rdf_interval, rdf_range …), their checks and manual, the files
// (rdf.csv) and the entries of the summary.

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/archive.h"
#include "engine/base/parameters.h"
#include "engine/run/simulation.h"

namespace carom {

/// One of a table; all columns of a table are of equal length.
struct TableColumn {
  std::string name;
  std::vector<double> values;
};

/// A number about some species, for the summary: there `"name": [{"species": ["a", "b"], "symbol": value}, …]`.
struct SpeciesValue {
  std::string_view name;
  std::vector<std::string> species;
  std::string_view symbol;
  double value;
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
  /// How many have been taken.
  std::uint64_t samples() const { return samples_; }

  /// The averages up to now; called after the first sample.
  virtual std::vector<TableColumn> table() const = 0;
  virtual std::vector<SpeciesValue> species_values() const { return {}; }

 private:
  /// Gives the archive everything that a sample changes and a later one or a table reads, always in the same order.
  virtual void sums(Archive& archive) = 0;
  /// samples() have been added before. All particles, in the order of their ids; on several ranks on rank 0 only.
  virtual void add_sample(double time, const Particles<D>& particles) = 0;

  Sampling sampling_;
  std::uint64_t samples_ = 0;
};

/// What a declaration says of D dimensions.
template <int D>
struct ObservableMaker {
  /// Sets what is left open and depends on the system; says what is wrong in it.
  std::optional<ParameterError> (*complete)(Parameters&, const System<D>&) = nullptr;
  /// From complete parameters; the first sample is due at the time `start`. The system outlives it.
  std::unique_ptr<Observable<D>> (*make)(const System<D>&, const Parameters&, double start) = nullptr;
};

/// The declaration of an observable; engine/run/observables.cc lists them all.
struct ObservableInfo {
  std::string_view name;  ///< of its file and of its keys: `profile` is averaged into profile.csv
  std::string_view title;
  std::vector<Parameter> parameters;  ///< `interval` (parameter::interval) among them
  std::string_view documentation;     ///< a paragraph for the manual
  std::string_view source;            ///< papers
  ObservableMaker<2> in_2d;
  ObservableMaker<3> in_3d;

  template <int D>
  const ObservableMaker<D>& in() const {
    if constexpr (D == 2)
      return in_2d;
    else
      return in_3d;
  }
};

/// Every observable there is, in the order of the manual.
const std::vector<ObservableInfo>& observables();

/// The one of that name; throws Error(Failure::deck), which lists the names.
const ObservableInfo& find_observable(std::string_view name);

/// It, made with these parameters and defaults for those left out. Throws Error(Failure::deck).
template <int D>
std::unique_ptr<Observable<D>> make_observable(std::string_view name, const System<D>& system, Parameters given,
                                               double start = 0);

namespace parameter {
/// The time between two samples; 0: none.
Parameter interval(std::string_view meaning);
}  // namespace parameter

namespace observable {

template <int D>
std::optional<ParameterError> nothing_to_complete(Parameters&, const System<D>&) {
  return {};
}

/// Of an observable template with a constructor from system, parameters and start.
template <template <int> class T, int D>
ObservableMaker<D> maker(std::optional<ParameterError> (*complete)(Parameters&,
                                                                   const System<D>&) = nothing_to_complete) {
  return {complete, [](const System<D>& system, const Parameters& parameters, double start) {
            return std::unique_ptr<Observable<D>>(std::make_unique<T<D>>(system, parameters, start));
          }};
}

}  // namespace observable
}  // namespace carom
