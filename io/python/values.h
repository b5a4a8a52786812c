// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Converts Python values to parameters, and declarations to Python dictionaries.

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "io/deck/schema.h"

namespace carom::python {

namespace py = pybind11;

/// Converts keyword arguments to the declared parameters; arguments that are None are left out. Throws
/// Error(Failure::deck) for a value that no parameter can have; completed() checks types and ranges.
Parameters parameters_of(std::string_view of, std::span<const Parameter> declared, const py::dict& given);

/// Converts a table of a deck in this way, with the keys of the variant that its `type` names.
Parameters parameters_of(const TableSchema& table, const py::dict& given);

/// The parameters as a dictionary by name.
py::dict values_of(const Parameters& parameters);

/// [{"name", "type", "default", "unit", "meaning", "choices"}, …], in the order of the manual.
py::list described(std::span<const Parameter> declared);

}  // namespace carom::python
