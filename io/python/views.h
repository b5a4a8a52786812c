// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Arrays of particles that others look at: these keep their addresses while runs swap and free arrays of their own.

#include <list>
#include <mutex>
#include <span>
#include <vector>

#include "engine/base/particles.h"

namespace carom::python {

/// Arrays that a run does not change.
struct Constants {
  std::span<const double> mass, radius, charge;
  std::span<const std::uint16_t> species;
};

/// The views of a simulation's particles. What has been viewed stands aside during a run, as shown last. Any thread may
/// look.
template <int D>
class ParticleViews {
 public:
  /// Of all particles. During a run an array that has not been viewed before is there while one is shown only; else
  /// these throw Error.
  std::span<const Vec<D>> position();
  std::span<const Vec<D>> velocity();
  std::span<const Image<D>> image();
  Constants constants();

  /// The particles, at rest from now on; they stay where they are.
  void rest(const Particles<D>& particles) { particles_ = &particles; }
  /// The same of particles that have been in a run.
  void rest(Particles<D>&& of_run, Particles<D>& particles);
  /// A run begins, with these particles.
  void lend(Particles<D>& particles);
  /// Renews the views of a run's particles, which are shown until hide().
  void show(const Particles<D>& particles);
  void hide();
  /// To be called before the number of the particles at rest changes: they get new arrays, and views go on to show
  /// what they showed.
  void detach(Particles<D>& particles);

 private:
  /// An array that a run changes.
  template <class T>
  struct Kept {
    std::vector<T> values;  ///< during a run: as shown last
    bool viewed = false;
  };
  template <class T>
  std::span<const T> view(std::vector<T> Particles<D>::*of, Kept<T>& kept);
  void each(auto&& action);

  Kept<Vec<D>> x_, v_;
  Kept<Image<D>> image_;
  bool constants_viewed_ = false, lent_ = false;
  const Particles<D>*particles_ = nullptr, *shown_ = nullptr;
  std::list<Particles<D>> detached_;  // of which there are views
  std::mutex mutex_;
};

}  // namespace carom::python
