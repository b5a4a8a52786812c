// SPDX-License-Identifier: BSD-3-Clause
#include "io/python/python_lock.h"

#include <cxxabi.h>
#include <pthread.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <thread>
#include <utility>

namespace carom::python {
namespace {

std::atomic<std::thread::id> ending;  // the thread in which Python is about to end
int working = 0;                      // threads in the engine without the lock; the lock guards this number

/// Ends the runs of all other threads; returns when none of them is in the engine.
void stop_runs() {
  ending = std::this_thread::get_id();
  while (working > 0) {
    const py::gil_scoped_release release;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

/// Returns the result of the action, which only calls the interpreter. If Python ends this thread there, it sleeps.
template <class Action>
auto unless_python_ends(Action&& action) {
  try {
    return action();
  } catch (const abi::__forced_unwind&) {
    while (true) ::pause();
  }
}

}  // namespace

void stop_runs_at_exit() {
  py::module_::import("atexit").attr("register")(py::cpp_function(stop_runs));
  ::pthread_atfork(nullptr, nullptr,
                   [] { working = 0; });  // only the forking thread, which is in Python, exists in the child
}

bool python_is_ending() {
  const std::thread::id id = ending;
  return id != std::thread::id() && id != std::this_thread::get_id();
}

bool call(const py::object& function, const char* format, double first, double second) {
  return unless_python_ends([&] {
    PyObject* result = PyObject_CallFunction(function.ptr(), format, first, second);
    Py_XDECREF(result);
    return result != nullptr;
  });
}

void Unlocked::lock() {
  if (state_ == nullptr) return;
  unless_python_ends([&] { PyEval_RestoreThread(std::exchange(state_, nullptr)); });
  --working;
}

void Unlocked::unlock() {
  if (python_is_ending()) return;
  ++working;
  state_ = PyEval_SaveThread();
}

}  // namespace carom::python
