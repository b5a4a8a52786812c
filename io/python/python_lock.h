// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The lock of the interpreter, which is released while the engine works, and the end of the interpreter.
//
// Python can end while daemon threads are still running. From then on it ends each thread that requests its lock with
// pthread_exit(), and the process aborts if this unwinds C++ frames. So atexit stops the runs of other threads and
// waits until none of these threads is in the engine. There remain threads in callbacks, and modules imported too late
// for atexit: a thread that Python ends there sleeps, above its C++ frames, until the process has ended.

#include <pybind11/pybind11.h>

namespace carom::python {

namespace py = pybind11;

/// Called once, by the module: runs are then stopped when Python ends.
void stop_runs_at_exit();
/// Whether Python is about to end in another thread; runs of this thread must then end.
bool python_is_ending();

/// Calls a function, with arguments as for PyObject_CallFunction(); false if it raises.
bool call(const py::object& function, const char* format = nullptr, double first = 0, double second = 0);

/// During the life of this object its thread is in the engine, without the lock. If Python is about to end, the thread
/// keeps the lock until its run ends, at the next check.
class Unlocked {
 public:
  Unlocked() { unlock(); }
  ~Unlocked() { lock(); }
  Unlocked(const Unlocked&) = delete;
  Unlocked& operator=(const Unlocked&) = delete;

  /// The thread leaves the engine for an action that does not throw.
  void with_lock(auto&& action) {
    lock();
    action();
    unlock();
  }

 private:
  void lock();
  void unlock();

  PyThreadState* state_ = nullptr;  // while the lock is released
};

}  // namespace carom::python
