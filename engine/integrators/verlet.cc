// SPDX-License-Identifier: BSD-3-Clause
// verlet: kick-drift-kick, K(h/2) D(h) K(h/2), for points without hard cores.

#include "engine/forces/forces.h"
#include "engine/integrators/flow.h"
#include "engine/integrators/registry.h"

namespace carom::integrator {
namespace {

template <int D>
class Verlet : public Integrator<D> {
 public:
  explicit Verlet(const Parameters&) {}

  void start(System<D>& system, Counters& counters) override { accelerations_.start(system, counters); }

  const PotentialSums* potential() const override { return &accelerations_.sums; }
  Positions<D> accelerations() const override { return accelerations_.a; }

  void slab(System<D>& system, const Slab& slab, SlabReport<D>& report) override {
    auto& p = system.particles;
    x_.resize(p.size());
    v_ = p.v;
    FlowOfStep<D> flow(system, v_, accelerations_);
    for (Id i = 0; i < p.size(); ++i) {
      if (!p.owns(i)) continue;  // ghosts get positions from their owners, and nothing else
      v_[i] += (0.5 * slab.length) * accelerations_.a[i];
      x_[i] = p.x[i] + slab.length * v_[i];
    }
    // Nothing has changed yet if finish_step() throws.
    system.decomposition.start_step(x_, v_, slab.length);
    system.box.advance(slab.length);
    accelerations_.update(system, x_, report.counters, [&] { system.decomposition.finish_step(x_); });
    kick(v_, accelerations_.a, 0.5 * slab.length);
    p.x.swap(x_);
    p.v.swap(v_);
    flow.leave(slab.length, accelerations_, report.counters);
    report.reached = slab.length;
  }

 private:
  Accelerations<D> accelerations_;
  std::vector<Vec<D>> x_, v_;  // at the end of the drift
};

}  // namespace

IntegratorInfo verlet() {
  return {.name = "verlet",
          .title = "Störmer–Verlet",
          .order = "2",
          .conserves = "linear and angular momentum to rounding; the shadow energy S_h to order 4",
          .parameters = {parameter::step()},
          .documentation =
              "The velocity Verlet method (kick-drift-kick) for points, which have no hard cores and no "
              "radius.",
          .source = "Verlet, Phys. Rev. 159 (1967) 98; Swope, Andersen, Berens, Wilson, J. Chem. Phys. 76 (1982) 637",
          .hard_cores = false,
          .local = true,
          .shadow = true,
          .shear = true,
          .in_2d = make<Verlet, 2>,
          .in_3d = make<Verlet, 3>};
}

}  // namespace carom::integrator
