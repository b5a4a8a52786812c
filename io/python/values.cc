// SPDX-License-Identifier: BSD-3-Clause
#include "io/python/values.h"

#include <pybind11/stl.h>

#include <array>

#include "engine/base/error.h"

namespace carom::python {
namespace {

/// In the order of Parameter::Type.
constexpr std::array kPythonTypes = {"bool",
                                     "int",
                                     "float",
                                     "list[float]",
                                     "str",
                                     "list[str]",
                                     "list[tuple[int, int]]",
                                     "list[list[float]]",
                                     "dict",
                                     "float or list[float]",
                                     "float or dict"};

[[noreturn]] void refuse(std::string_view of, std::string_view name, const std::string& what) {
  throw Error(Failure::deck, std::string(of) + ": '" + std::string(name) + "' " + what);
}

std::int64_t whole(std::string_view of, std::string_view name, const py::handle& value) {
  const auto index = py::reinterpret_steal<py::object>(PyNumber_Index(value.ptr()));
  int overflow = 0;
  const long long number = index ? PyLong_AsLongLongAndOverflow(index.ptr(), &overflow) : 0;
  PyErr_Clear();
  if (overflow != 0) refuse(of, name, "is too large a number; give one of at most 64 bits");
  return number;
}

/// The value of a list or array: texts, numbers, or pairs of ids.
ParameterValue list_of(std::string_view of, const Parameter* declared, std::string_view name, const py::handle& value) {
  py::array all;
  try {
    all = py::module_::import("numpy").attr("asarray")(value);
  } catch (const py::error_already_set&) {  // rows of different lengths
    refuse(of, name, "has rows of different lengths; give each the same number of entries");
  }
  const char kind = all.dtype().kind();
  const bool number = kind == 'i' || kind == 'u' || kind == 'f';
  const auto type = declared ? declared->type : Parameter::Type::real_list;
  if (all.size() == 0) {
    if (type == Parameter::Type::pair_list) return PairList();
    if (type == Parameter::Type::text_list) return std::vector<std::string>();
    return std::vector<double>();
  }
  if (kind == 'U' && all.ndim() == 1) return value.cast<std::vector<std::string>>();
  if (number && all.ndim() == 1)
    return py::array_t<double, py::array::c_style | py::array::forcecast>(all).cast<std::vector<double>>();
  if (number && kind != 'f' && all.ndim() == 2 && all.shape(1) == 2) {
    const py::array_t<std::int64_t, py::array::c_style | py::array::forcecast> ids(all);
    PairList pairs;
    for (py::ssize_t k = 0; k < ids.shape(0); ++k) {
      std::array<std::uint32_t, 2> pair{};
      for (int side = 0; side < 2; ++side) {
        const std::int64_t id = ids.at(k, side);
        if (id < 0 || id > 0xffffffffLL)
          refuse(of, name, "names particle " + std::to_string(id) + ", which cannot be; ids count from 0");
        pair[side] = static_cast<std::uint32_t>(id);
      }
      pairs.push_back(pair);
    }
    return pairs;
  }
  std::string shape;
  for (py::ssize_t axis = 0; axis < all.ndim(); ++axis)
    shape += (axis == 0 ? "" : ", ") + std::to_string(all.shape(axis));
  refuse(of, name,
         "is an array of shape (" + shape + ") and type " + py::str(all.dtype()).cast<std::string>() + "; give a " +
             kPythonTypes[static_cast<std::size_t>(type)] +
             (type == Parameter::Type::pair_list ? ", of shape (bonds, 2)" : ""));
}

ParameterValue value_of(std::string_view of, const Parameter* declared, std::string_view name,
                        const py::handle& value) {
  const bool array = py::isinstance<py::array>(value) && value.attr("ndim").cast<int>() > 0;
  if (PyBool_Check(value.ptr()) || py::str(py::type::of(value).attr("__name__")).cast<std::string>() == "bool_")
    return value.cast<bool>();
  if (py::isinstance<py::str>(value)) return value.cast<std::string>();
  if (!array && PyIndex_Check(value.ptr())) return whole(of, name, value);
  if (PyFloat_Check(value.ptr()) || (!array && py::hasattr(value, "__float__"))) return value.cast<double>();
  if (py::isinstance<py::dict>(value)) {
    TableValue table;
    for (const auto& [key, each] : value.cast<py::dict>())
      if (py::isinstance<py::str>(each))
        table[py::str(key)] = each.cast<std::string>();
      else if (py::hasattr(each, "__float__"))
        table[py::str(key)] = each.cast<double>();
      else
        refuse(of, name, "has a '" + py::str(key).cast<std::string>() + "' that is no number and no text; give one");
    return table;
  }
  if (array || PySequence_Check(value.ptr())) return list_of(of, declared, name, value);
  refuse(of, name,
         "is a " + py::str(py::type::of(value).attr("__name__")).cast<std::string>() +
             "; give a number, a text or a list");
}

}  // namespace

Parameters parameters_of(std::string_view of, std::span<const Parameter> declared, const py::dict& given) {
  Parameters parameters;
  for (const auto& [key, value] : given) {
    if (value.is_none()) continue;
    const auto name = key.cast<std::string>();
    const Parameter* known = nullptr;
    for (const Parameter& each : declared)
      if (each.name == name) known = &each;
    parameters.set(name, known ? value_of(of, known, name, value) : ParameterValue(false));
  }
  return parameters;
}

Parameters parameters_of(const TableSchema& table, const py::dict& given) {
  const Variant* variant = given.contains("type") ? table.variant(given["type"].cast<std::string>()) : nullptr;
  std::vector<Parameter> keys = table.keys;
  if (variant != nullptr) keys.insert(keys.end(), variant->keys.begin(), variant->keys.end());
  return parameters_of(variant ? variant->name : table.name, keys, given);
}

py::dict values_of(const Parameters& parameters) {
  py::dict all;
  for (const auto& [name, value] : parameters.all())
    all[py::str(name)] = std::visit([](const auto& each) -> py::object { return py::cast(each); }, value);
  return all;
}

py::list described(std::span<const Parameter> declared) {
  py::list all;
  for (const Parameter& each : declared) {
    py::dict one;
    one["name"] = each.name;
    one["type"] = kPythonTypes[static_cast<std::size_t>(each.type)];
    one["default"] = each.fallback;
    one["unit"] = each.unit;
    one["meaning"] = each.meaning;
    one["choices"] = py::cast(std::vector<std::string>(each.choices.begin(), each.choices.end()));
    all.append(one);
  }
  return all;
}

}  // namespace carom::python
