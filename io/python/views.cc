// SPDX-License-Identifier: BSD-3-Clause
#include "io/python/views.h"

#include <utility>

namespace carom::python {

/// Calls action(member of Particles, Kept) for each array that a run changes.
template <int D>
void ParticleViews<D>::each(auto&& action) {
  action(&Particles<D>::x, x_);
  action(&Particles<D>::v, v_);
  action(&Particles<D>::image, image_);
  action(&Particles<D>::spin, spin_);
}

template <int D>
Constants ParticleViews<D>::constants() {
  const std::lock_guard lock(mutex_);
  constants_viewed_ = true;
  return {particles_->mass, particles_->radius, particles_->charge, particles_->species};
}

template <int D>
void ParticleViews<D>::rest(Particles<D>&& of_run, Particles<D>& particles) {
  const std::lock_guard lock(mutex_);
  particles = std::move(of_run);
  each([&](auto of, auto& kept) {
    if (kept.values.empty()) return;
    kept.values = particles.*of;
    kept.values.swap(particles.*of);
    kept.values = {};
  });
  particles_ = &particles;
  shown_ = nullptr;
  lent_ = false;
}

template <int D>
void ParticleViews<D>::lend(Particles<D>& particles) {
  const std::lock_guard lock(mutex_);
  each([&](auto of, auto& kept) {
    if (!kept.viewed) return;
    kept.values = particles.*of;
    kept.values.swap(particles.*of);
  });
  lent_ = true;
}

template <int D>
void ParticleViews<D>::show(const Particles<D>& particles) {
  const std::lock_guard lock(mutex_);
  each([&](auto of, auto& kept) {
    if (kept.viewed) kept.values = particles.*of;
  });
  shown_ = &particles;
}

template <int D>
void ParticleViews<D>::hide() {
  const std::lock_guard lock(mutex_);
  shown_ = nullptr;
}

template <int D>
void ParticleViews<D>::detach(Particles<D>& particles) {
  const std::lock_guard lock(mutex_);
  bool viewed = std::exchange(constants_viewed_, false);
  each([&](auto, auto& kept) { viewed = std::exchange(kept.viewed, false) || viewed; });
  if (!viewed) return;
  Particles<D> old = particles;
  std::swap(old, particles);
  detached_.push_back(std::move(old));
}

template class ParticleViews<2>;
template class ParticleViews<3>;

}  // namespace carom::python
