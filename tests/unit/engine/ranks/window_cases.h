// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Subdomains of a system for tests of one window.

#include "engine/ranks/subdomain.h"
#include "tests/support/thread_ranks.h"
#include "tests/unit/engine/events/event_cases.h"

namespace carom {

inline constexpr double kDisplacement = 0.5;  // of a sphere in a window

template <int D>
std::vector<Record<D>> records_of(const Particles<D>& p) {
  std::vector<Record<D>> records;
  for (Id i = 0; i < p.size(); ++i) records.push_back({p.x[i], p.v[i], 0.0, i, 0, p.species[i]});
  return records;
}

/// This rank's subdomain of a bisection with all spheres it needs, at time 0.
template <int D>
std::unique_ptr<Subdomain<D>> subdomain_of(const System<D>& system, const Sizes& sizes, const Bisection<D>& bisection,
                                           Communicator& ranks, double end) {
  auto subdomain = std::make_unique<Subdomain<D>>(system.box, sizes, SearchOptions{}, ranks);
  const auto number = static_cast<std::uint32_t>(ranks.rank());
  std::vector<Bytes> spheres(1);
  for (const Record<D>& r : records_of(system.particles))
    if (number < bisection.subdomains() && bisection.near(number, bisection.wrapped(r.x)))
      subdomain->put_sphere(spheres[0], r, Internal<D>{});
  subdomain->load(std::move(spheres), bisection, Vec<D>::Zero(), end, 0, kDisplacement);
  return subdomain;
}

/// Three ranks, the last without a subdomain, advance a system up to `end` and call make_consistent for this window;
/// then check(ranks, subdomain, rounds of the exchange) on each.
template <int D>
void in_a_window(const System<D>& system, const Sizes& sizes, double end, auto&& check) {
  test::ThreadRanks(3).run([&](Communicator& ranks) {
    Communicator alone;
    const double largest = sizes.largest_radius();
    const Bisection<D> bisection(system.box, system.particles.x, 2, 2 * (largest + kDisplacement), alone, {}, largest);
    const auto subdomain = subdomain_of(system, sizes, bisection, ranks, end);
    subdomain->run(0, end);
    const std::uint64_t rounds = subdomain->make_consistent([&](bool changed) {
      double more = changed ? 1 : 0;
      ranks.largest({&more, 1});
      return more > 0;
    });
    check(ranks, *subdomain, rounds);
  });
}

}  // namespace carom
