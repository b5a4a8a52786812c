// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Values of Python as parameters, and declarations as dictionaries of Python.

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "engine/base/parameters.h"

namespace carom::python {

namespace py = pybind11;

/// Keyword arguments for what is declared so; those that are None are left out. Throws Error(Failure::deck) about what
/// is no value of any parameter; types and ranges are checked by completed().
Parameters parameters_of(std::string_view of, std::span<const Parameter> declared, const py::dict& given);

/// By name.
py::dict values_of(const Parameters& parameters);

/// [{"name", "type", "default", "unit", "meaning", "choices"}, …], in the order of the manual.
py::list described(std::span<const Parameter> declared);

}  // namespace carom::python
