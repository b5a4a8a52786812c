// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/experiments.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "engine/base/random.h"
#include "engine/forces/pair_filter.h"
#include "engine/laws/contact_options.h"
#include "engine/ranks/id_blocks.h"
#include "engine/run/step_choice.h"
#include "engine/setup/placement.h"

namespace carom::test {

namespace {
/// Perturbs the velocities of the moving particles by up to a percent; start 0 changes nothing.
template <int D>
std::unique_ptr<System<D>> perturbed(std::unique_ptr<System<D>> system, unsigned start) {
  if (start == 0) return system;
  for (std::size_t i = 0; i < system->particles.size(); ++i) {
    RandomStream random(start, RandomPurpose::probe, static_cast<std::uint32_t>(i));
    if (system->particles.v[i] != Vec<D>::Zero())
      for (int k = 0; k < D; ++k) system->particles.v[i][k] += 0.01 * (2 * random.uniform() - 1);
  }
  return system;
}
}  // namespace

template <int D>
std::unique_ptr<System<D>> make_system(const Vec<D>& edges, Boundary boundary, std::vector<Vec<D>> x,
                                       std::vector<Vec<D>> v, std::vector<double> radius, std::vector<double> mass) {
  auto system = std::make_unique<System<D>>();
  system->box.edges = edges;
  system->box.boundary.fill(boundary);
  system->species = {"sphere"};
  for (std::size_t i = 0; i < x.size(); ++i)
    system->particles.add(
        {.x = x[i], .v = v[i], .radius = radius.empty() ? 0.5 : radius[i], .mass = mass.empty() ? 1.0 : mass[i]});
  return system;
}

std::unique_ptr<System<2>> five_springs(unsigned start) {
  auto system = make_system<2>({12, 6}, Boundary::wall, {{2, 3}, {4, 3}, {6, 3}, {8, 3}, {10, 3}},
                               {{0, 0}, {1.1, -0.4}, {0, 0}, {-0.7, 0.9}, {0, 0}});
  add_interaction(*system, "harmonic-bond",
                  {{"pairs", PairList{{0, 1}, {1, 2}, {2, 3}, {3, 4}}}, {"stiffness", 1.0}, {"rest_length", 2.0}});
  return perturbed(std::move(system), start);
}

std::unique_ptr<System<2>> nine_gravity(unsigned start) {
  auto system = make_system<2>(
      {10, 10}, Boundary::wall,
      {{2.5, 2.5}, {5.0, 2.5}, {7.5, 2.5}, {2.5, 5.0}, {5.0, 5.0}, {7.5, 5.0}, {2.5, 7.5}, {5.0, 7.5}, {7.5, 7.5}},
      {{0.2899, 0.2899},
       {0, 0.52},
       {-0.2616, 0.2616},
       {0.61, 0},
       {0, 0},
       {-0.45, 0},
       {0.4101, -0.4101},
       {0, -0.33},
       {-0.3465, -0.3465}});
  add_interaction(*system, "gravity", {{"constant", 1.0}});
  return perturbed(std::move(system), start);
}

std::unique_ptr<System<3>> bonded_cluster(unsigned start) {
  auto system = make_system<3>(
      {8, 8, 8}, Boundary::wall, {{2.5, 4, 4}, {4, 2.4, 3.7}, {5.6, 4, 4.2}, {4, 5.5, 4}, {4.1, 4, 5.7}, {4, 4.2, 2.4}},
      {{0.9, 0.1, 0}, {0, 0.7, 0.3}, {-0.8, 0, 0.2}, {0.1, -0.9, 0}, {0, 0.2, -1.0}, {-0.1, 0, 0.6}},
      {0.5, 0.6, 0.4, 0.7, 0.55, 0.45}, {1.0, 2.0, 0.7, 3.0, 1.5, 0.9});
  add_interaction(
      *system, "harmonic-bond",
      {{"pairs", PairList{{0, 1}, {1, 2}, {2, 3}, {0, 3}, {0, 4}, {1, 5}}}, {"stiffness", 2.0}, {"rest_length", 2.0}});
  return perturbed(std::move(system), start);
}

std::unique_ptr<System<3>> gravity_cluster(unsigned start) {
  auto system =
      make_system<3>({8, 8, 8}, Boundary::wall,
                     {{2, 2, 2}, {6, 2, 2.2}, {2, 6, 2}, {6, 6, 2}, {2, 2, 6}, {6, 2, 6}, {2.1, 6, 6}, {6, 6, 6}},
                     {{0.2, 0.1, 0},
                      {-0.1, 0.2, 0.1},
                      {0.1, -0.2, 0},
                      {-0.2, 0, 0.1},
                      {0.1, 0.1, -0.2},
                      {-0.2, 0.1, 0},
                      {0.1, -0.1, 0.1},
                      {0, -0.1, -0.1}},
                     {0.5, 0.6, 0.4, 0.7, 0.55, 0.45, 0.5, 0.6}, {1.0, 2.0, 0.7, 3.0, 1.5, 0.9, 1.0, 1.2});
  add_interaction(*system, "gravity", {{"constant", 1.0}});
  return perturbed(std::move(system), start);
}

template <int D>
std::unique_ptr<System<D>> hard_spheres(int cells, double packing_fraction, unsigned seed) {
  const std::size_t n = D == 3 ? 4ul * cells * cells * cells : 2ul * cells * cells;
  const double sphere = D == 3 ? std::numbers::pi / 6 : std::numbers::pi / 4;
  const double volume = static_cast<double>(n) * sphere / packing_fraction;
  Box<D> box;
  box.edges = commensurate_edges<D>(Lattice::centred, n, volume);
  box.boundary.fill(Boundary::periodic);
  auto x = lattice_sites<D>(Lattice::centred, box, n, 0.0);
  x.resize(n);  // a hexagonal lattice may have a few sites too many
  auto system = make_system<D>(box.edges, Boundary::periodic, std::move(x), std::vector<Vec<D>>(n, Vec<D>::Zero()));
  std::vector<Id> all(n);
  for (Id i = 0; i < n; ++i) all[i] = i;
  draw_velocities<D>(system->particles, all, std::vector<double>(n, 1.0), seed);
  return system;
}

template <int D>
void set_law(System<D>& system, const Given& given) {
  Parameters all = given;
  if (!all.has("between")) all.set("between", std::vector<std::string>{"*", "*"});
  add_contact<D>(system.box, system.species, completed("contact", contact_parameters(), all));
}

template <int D>
std::unique_ptr<Simulation<D>> make_run(std::unique_ptr<System<D>> system, const std::string& integrator, Plan plan,
                                        const Given& given) {
  const IntegratorInfo& info = find_integrator(integrator);
  Parameters parameters = given;
  if (!parameters.has("step") && plan.step > 0) parameters.set("step", plan.step);
  choose_step(*system, info, plan, parameters);
  parameters = completed(info.name, info.parameters, std::move(parameters));
  if (info.adapts && plan.longest_step == 0 && plan.accuracy == 0) set_steps(plan, parameters);
  auto made = info.make<D>(parameters);
  return std::make_unique<Simulation<D>>(std::move(system), info, std::move(made), plan);
}

template <int D>
std::unique_ptr<Simulation<D>> run_steps(std::unique_ptr<System<D>> system, const std::string& integrator, double h,
                                         std::int64_t steps, const Given& given) {
  auto run = make_run<D>(std::move(system), integrator, {.step = h, .steps = steps}, given);
  run->run();
  return run;
}

template <int D>
std::unique_ptr<Simulation<D>> run_until(std::unique_ptr<System<D>> system, const std::string& integrator, double h,
                                         double end_time, const Given& given) {
  auto run = make_run<D>(std::move(system), integrator, {.step = h, .end_time = end_time}, given);
  run->run();
  return run;
}

std::string message_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

template <int D>
double largest_difference(const std::vector<Vec<D>>& a, const std::vector<Vec<D>>& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, (a[i] - b[i]).cwiseAbs().maxCoeff());
  return largest;
}

double fitted_order(const std::vector<double>& x, const std::vector<double>& y) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  const auto n = static_cast<double>(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) {
    const double u = std::log(x[k]), w = std::log(y[k]);
    sx += u, sy += w, sxx += u * u, sxy += u * w;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

#define CAROM_FOR_DIMENSION(D)                                                                                         \
  template std::unique_ptr<System<D>> make_system<D>(const Vec<D>&, Boundary, std::vector<Vec<D>>,                     \
                                                     std::vector<Vec<D>>, std::vector<double>, std::vector<double>);   \
  template std::unique_ptr<System<D>> hard_spheres<D>(int, double, unsigned);                                          \
  template void set_law<D>(System<D>&, const Given&);                                                                  \
  template std::unique_ptr<Simulation<D>> make_run<D>(std::unique_ptr<System<D>>, const std::string&, Plan,            \
                                                      const Given&);                                                   \
  template std::unique_ptr<Simulation<D>> run_steps<D>(std::unique_ptr<System<D>>, const std::string&, double,         \
                                                       std::int64_t, const Given&);                                    \
  template std::unique_ptr<Simulation<D>> run_until<D>(std::unique_ptr<System<D>>, const std::string&, double, double, \
                                                       const Given&);                                                  \
  template double largest_difference<D>(const std::vector<Vec<D>>&, const std::vector<Vec<D>>&);
CAROM_FOR_DIMENSION(2)
CAROM_FOR_DIMENSION(3)

}  // namespace carom::test
