// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Arrays of particles for viewers: they keep their addresses while runs swap and free their own arrays.

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

/// The views of a simulation's particles. During a run, viewed arrays are kept apart, as last shown. Any thread may
/// read them.
template <int D>
class ParticleViews {
 public:
  /// Views of all particles. During a run, an array that has not been viewed before is available only between show()
  /// and hide(); otherwise these functions throw Error.
  std::span<const Vec<D>> position() { return view(&Particles<D>::x, x_); }
  std::span<const Vec<D>> velocity() { return view(&Particles<D>::v, v_); }
  std::span<const Image<D>> image() { return view(&Particles<D>::image, image_); }
  std::span<const Spin<D>> spin() { return view(&Particles<D>::spin, spin_); }
  Constants constants();

  /// Views the particles in place, which no run changes from now on.
  void rest(const Particles<D>& particles) { particles_ = &particles; }
  /// rest() for particles that come back from a run.
  void rest(Particles<D>&& of_run, Particles<D>& particles);
  /// A run begins, with these particles.
  void lend(Particles<D>& particles);
  /// Renews the views of a run's particles, which are shown until hide().
  void show(const Particles<D>& particles);
  void hide();
  /// To be called before the number of particles changes between runs: the particles get new arrays, and existing views
  /// keep their contents.
  void detach(Particles<D>& particles);

 private:
  /// An array that a run changes.
  template <class T>
  struct Kept {
    std::vector<T> values;  ///< during a run: as last shown
    bool viewed = false;
  };
  template <class T>
  std::span<const T> view(std::vector<T> Particles<D>::*of, Kept<T>& kept) {
    const std::lock_guard lock(mutex_);
    if (lent_ && kept.values.empty()) {
      if (shown_ == nullptr)
        throw Error(Failure::deck, "a run is going on; look at the particles in its callback, or after it");
      kept.values = shown_->*of;
    }
    kept.viewed = true;
    return lent_ ? kept.values : particles_->*of;
  }
  void each(auto&& action);

  Kept<Vec<D>> x_, v_;
  Kept<Image<D>> image_;
  Kept<Spin<D>> spin_;
  bool constants_viewed_ = false, lent_ = false;
  const Particles<D>*particles_ = nullptr, *shown_ = nullptr;
  std::list<Particles<D>> detached_;  // old arrays that still have views
  std::mutex mutex_;
};

}  // namespace carom::python
