#include "engine/part.h"

#include <numeric>

#include "engine/division.h"

namespace carom {

template <int D>
Part<D>::Part(const Box<D>& box, Particles<D>& particles, Exchange& ranks)
    : box_(box), particles_(particles), ranks_(ranks), everybody_(particles.size()), owner_(particles.size()) {
  std::iota(everybody_.begin(), everybody_.end(), 0);
  particles.ghost.resize(particles.size());
  divide();
}

template <int D>
void Part<D>::divide() {
  const Division<D> division(box_, particles_.x, static_cast<std::size_t>(ranks_.size()));
  for (const Id i : everybody_) {
    owner_[i] = division.owner(particles_.x[i]);
    particles_.ghost[i] = static_cast<int>(owner_[i]) != ranks_.rank();
  }
}

template class Part<2>;
template class Part<3>;

}  // namespace carom
