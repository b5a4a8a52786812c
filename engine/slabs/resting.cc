#include "engine/slabs/resting.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace carom {

namespace {
constexpr int kMostSweeps = 2000;
}

template <int D>
void press_apart(std::span<RestingContact<D>> contacts, const std::vector<double>& mass, std::span<Vec<D>> w) {
  auto push = [&](const RestingContact<D>& contact, double lambda) {
    const Id lo = contact.key.lo, hi = contact.key.hi;
    w[lo] += (lambda / mass[lo]) * contact.normal;
    if (contact.key.kind == EventKind::pair) w[hi] -= (lambda / mass[hi]) * contact.normal;
  };
  for (const auto& contact : contacts)
    if (contact.lambda > 0) push(contact, contact.lambda);
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    double change = 0, size = 0;  // of the reactions' effects on the velocities
    for (auto& contact : contacts) {
      const Id lo = contact.key.lo, hi = contact.key.hi;
      const bool pair = contact.key.kind == EventKind::pair;
      const double compliance = contact.normal.squaredNorm() * (1 / mass[lo] + (pair ? 1 / mass[hi] : 0.0));
      const double speed = contact.normal.dot(pair ? Vec<D>(w[lo] - w[hi]) : w[lo]) - contact.bound;
      const double lambda = std::max(0.0, contact.lambda - speed / compliance);
      push(contact, lambda - contact.lambda);
      change = std::max(change, std::abs(lambda - contact.lambda) * compliance);
      size = std::max(size, lambda * compliance);
      contact.lambda = lambda;
    }
    if (change <= 8 * std::numeric_limits<double>::epsilon() * size) break;
  }
}

template void press_apart<2>(std::span<RestingContact<2>>, const std::vector<double>&, std::span<Vec<2>>);
template void press_apart<3>(std::span<RestingContact<3>>, const std::vector<double>&, std::span<Vec<3>>);

}  // namespace carom
