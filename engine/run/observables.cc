// SPDX-License-Identifier: BSD-3-Clause
#include "engine/base/error.h"
#include "engine/run/observable.h"

namespace carom {

namespace observable {  // declared at the ends of their own files
ObservableInfo rdf(), sk(), msd(), profile(), transport(), pressure_tensor();
}

const std::vector<ObservableInfo>& observables() {
  static const std::vector<ObservableInfo> all = {observable::rdf(),       observable::sk(),
                                                  observable::msd(),       observable::profile(),
                                                  observable::transport(), observable::pressure_tensor()};
  return all;
}

const ObservableInfo& find_observable(std::string_view name) { return find_named(observables(), "observable", name); }

template <int D>
std::unique_ptr<Observable<D>> make_observable(std::string_view name, const System<D>& system, Parameters given,
                                               double start) {
  const ObservableInfo& info = find_observable(name);
  Parameters parameters = completed(info.name, info.parameters, std::move(given));
  if (const auto wrong = info.complete(parameters, system))
    throw Error(Failure::deck, std::string(info.name) + ": " + wrong->what + "; " + wrong->remedy);
  return info.in<D>().make(system, parameters, start);
}

template std::unique_ptr<Observable<2>> make_observable(std::string_view, const System<2>&, Parameters, double);
template std::unique_ptr<Observable<3>> make_observable(std::string_view, const System<3>&, Parameters, double);

Parameter parameter::interval(std::string_view meaning) {
  return {.name = "interval",
          .type = Parameter::Type::real,
          .fallback = "0.0",
          .unit = "time",
          .meaning = std::string(meaning),
          .range = Parameter::Range::non_negative};
}

}  // namespace carom
