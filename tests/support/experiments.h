// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The systems that several tests run, and functions that run them.

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "engine/forces/add_interaction.h"
#include "engine/run/simulation.h"

namespace carom::test {

using Given = Parameters;

/// A system in a box with the same boundary on all axes; particles of one species.
template <int D>
std::unique_ptr<System<D>> make_system(const Vec<D>& edges, Boundary boundary, std::vector<Vec<D>> x,
                                       std::vector<Vec<D>> v, std::vector<double> radius = {},
                                       std::vector<double> mass = {});

using carom::add_interaction;

/// First experiment of the thesis: five discs in a box joined by springs. A start other than 0 changes the velocities
/// of the moving discs by up to a percent at random.
std::unique_ptr<System<2>> five_springs(unsigned start = 0);

/// Second experiment: nine gravitating discs in a box.
std::unique_ptr<System<2>> nine_gravity(unsigned start = 0);

/// Similar systems in three dimensions with unequal radii and masses: a bonded ring of six and eight gravitating
/// spheres.
std::unique_ptr<System<3>> bonded_cluster(unsigned start = 0);
std::unique_ptr<System<3>> gravity_cluster(unsigned start = 0);

/// Hard spheres (discs) of diameter 1 and mass 1 on an fcc (hexagonal) lattice with `cells` unit cells per edge, at
/// this packing fraction and temperature 1, periodic.
template <int D>
std::unique_ptr<System<D>> hard_spheres(int cells, double packing_fraction, unsigned seed = 1);

/// Sets the law of the contacts of two partners, "*" and "*" if it has none, with defaults for keys that are not given.
template <int D>
void set_law(System<D>& system, const Given& given);

/// A run with the integrator of this name, with defaults for parameters that are not given.
template <int D>
std::unique_ptr<Simulation<D>> make_run(std::unique_ptr<System<D>> system, const std::string& integrator, Plan plan,
                                        const Given& given = {});

/// make_run, and run() for this number of steps of length h.
template <int D>
std::unique_ptr<Simulation<D>> run_steps(std::unique_ptr<System<D>> system, const std::string& integrator, double h,
                                         std::int64_t steps, const Given& given = {});

/// make_run, and run() up to a time.
template <int D>
std::unique_ptr<Simulation<D>> run_until(std::unique_ptr<System<D>> system, const std::string& integrator, double h,
                                         double end_time, const Given& given = {});

/// The message of the Error that `work` throws; empty if it throws none.
std::string message_of(const std::function<void()>& work);

/// The largest difference of any coordinate.
template <int D>
double largest_difference(const std::vector<Vec<D>>& a, const std::vector<Vec<D>>& b);

/// Least-squares slope of log y against log x.
double fitted_order(const std::vector<double>& x, const std::vector<double>& y);

}  // namespace carom::test
