// SPDX-License-Identifier: BSD-3-Clause
#include "engine/ranks/system.h"

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"

namespace carom {
namespace {

[[noreturn]] void refuse(const std::string& what, const std::string& remedy) {
  throw Error(Failure::initial_state, what + "; " + remedy);
}

}  // namespace

template <int D>
void System<D>::check() const {
  const Particles<D>& p = particles;
  const auto same_length = [&](std::string_view name, std::size_t length) {
    if (length != p.x.size())
      refuse("the array '" + std::string(name) + "' of the particles has " + std::to_string(length) +
                 " entries, x has " + std::to_string(p.x.size()),
             "give each particle one, or use Particles::add()");
  };
  same_length("v", p.v.size());
  same_length("mass", p.mass.size());
  same_length("radius", p.radius.size());
  same_length("charge", p.charge.size());
  same_length("species", p.species.size());
  same_length("image", p.image.size());
  if (!p.spin.empty()) same_length("spin", p.spin.size());
  for (int k = 0; k < D; ++k)
    if (!(box.edges[k] > 0) || !std::isfinite(box.edges[k]))
      refuse("the edge of the box along axis " + std::to_string(k) + " is " + short_text(box.edges[k]),
             "give a positive length");
  box.check(Failure::initial_state);
  for (Id i = 0; i < p.size(); ++i) {
    const auto wrong = [&](const char* what, const char* remedy) {
      refuse("the " + std::string(what) + " of particle " + std::to_string(p.id_of(i)) + " cannot be", remedy);
    };
    if (!p.x[i].allFinite()) wrong("position", "give finite coordinates");
    if (!p.v[i].allFinite()) wrong("velocity", "give finite components");
    if (!p.spin.empty() && !p.spin[i].allFinite()) wrong("spin", "give finite components");
    if (!(p.mass[i] > 0)) wrong("mass", "give a positive one");
    if (p.fixed(i) && (p.v[i] != Vec<D>::Zero() || (!p.spin.empty() && p.spin[i] != Spin<D>::Zero())))
      refuse("particle " + std::to_string(p.id_of(i)) + " is fixed, since its mass is infinite, and has a velocity",
             "give it a finite mass, or no velocity and no spin");
    if (!(p.radius[i] > 0) || !std::isfinite(p.radius[i])) wrong("radius", "give a positive one");
    if (!std::isfinite(p.charge[i])) wrong("charge", "give a finite one");
    if (p.species[i] >= species.size()) wrong("species", "give System::species a name for each");
  }
}

template <int D>
void System<D>::count_moving() {
  const auto& mass = particles.mass;
  std::uint64_t fixed = static_cast<std::uint64_t>(std::ranges::count_if(mass, is_fixed));
  decomposition.ranks().sum({&fixed, 1});
  fixed_ = static_cast<std::size_t>(fixed);
}

template void System<2>::count_moving();
template void System<3>::count_moving();
template void System<2>::check() const;
template void System<3>::check() const;

}  // namespace carom
