// The spheres in a subdomain, and those at its border.

#include "engine/ranks/subdomain.h"

namespace carom {

template <int D>
void Subdomain<D>::load(std::vector<Record<D>> records, const Bisection<D>& bisection, std::uint32_t number,
                        const Vec<D>& g, double horizon, double now, double max_displacement) {
  bisection_ = &bisection;
  number_ = number;
  max_displacement_ = max_displacement;
  paths_.clear();
  scripts_.clear();
  changed_.clear();
  role_.clear();
  edge_.clear();
  core_.load(std::move(records), g, horizon, now, 2 * max_displacement);
  const std::size_t room = core_.flights().room();
  slots_.clear(room);
  trace_.clear(room);
  paths_.resize(room);
  scripts_.resize(room);
  holders_.assign(room, 0);
  rewritten_.assign(room, 0);
  agreed_.assign(room, 0);
  disturbed_.assign(room, 0);
  other_.clear();
  mended_of_.assign(room, kNone);
  role_.assign(room, Role::none);
  for (Slot i = 0; i < core_.flights().size(); ++i) enlist(i, core_.flights()[i].id, Role::own);
  unwatched_ = std::numeric_limits<double>::infinity();
}

template <int D>
void Subdomain<D>::enlist(Slot i, Id id, Role role) {
  slots_.add(id, i);
  role_[i] = role;
}

template <int D>
void Subdomain<D>::forget(Slot i) {
  role_[i] = Role::none;
  slots_.remove(core_.flights()[i].id);
  core_.dismiss(i);
}

template <int D>
std::vector<Slot> Subdomain<D>::own() const {
  std::vector<Slot> own;
  for (Slot i = 0; i < core_.flights().size(); ++i)
    if (is_own(i)) own.push_back(i);
  return own;
}

/// Finds out anew which own spheres may come to the border before this is called again.
template <int D>
void Subdomain<D>::watch(double now) {
  unwatched_ = 0;
  const double reach = bisection_->reach() + (kSlack + 1) * max_displacement_;
  std::erase_if(edge_, [&](const Edge& edge) { return role_[edge.slot] != Role::ghost; });
  for (Slot i = 0; i < core_.flights().size(); ++i)
    if (is_own(i) && bisection_->depth(number_, bisection_->wrapped(core_.flights().at(i, now).x)) <= reach)
      edge_.push_back({i, 0});
  std::vector<Slot> slots;
  for (const Edge& edge : edge_) slots.push_back(edge.slot);
  core_.set_border(slots, now);
}

/// Finds the owner of a sphere and the subdomains in which it is a ghost, from its position now, and how far it may
/// come until one of these changes; other subdomains that have it find the same.
template <int D>
typename Subdomain<D>::Edge Subdomain<D>::look_at(Slot i, double now) {
  const Flights<D>& flights = core_.flights();
  const Vec<D> at = bisection_->wrapped(flights.at(i, now).x);
  const double speed = flights[i].v.norm() + flights.g().norm() * flights.horizon();
  const double depth = bisection_->depth(number_, at), reach = bisection_->reach();
  if (bisection_->deep(depth)) {
    role_[i] = Role::own;
    holders_[i] = 0;
    return {i, depth - (1 + 1e-6) * reach, (1 + 1e-6) * speed};
  }
  holders_[i] = 0;
  double quiet;
  if (depth > 0 || bisection_->owner(at) == number_) {
    quiet = depth;
    const auto neighbours = bisection_->neighbours(number_);
    for (std::size_t k = 0; k < neighbours.size(); ++k) {
      const double squared = bisection_->squared_distance(neighbours[k], at);
      if (squared <= reach * reach) holders_[i] |= std::uint64_t{1} << k;
      quiet = std::min(quiet, std::abs(std::sqrt(squared) - reach));
    }
    role_[i] = holders_[i] == 0 ? Role::own : Role::seen;
  } else {
    const double squared = bisection_->squared_distance(number_, at), away = std::sqrt(squared);
    if (squared > reach * reach) {
      forget(i);
      return {i, 0};
    }
    role_[i] = Role::ghost;
    quiet = std::min(away, reach - away);
  }
  return {i, quiet - 1e-6 * reach, (1 + 1e-6) * speed};
}

template <int D>
bool Subdomain<D>::admit(const Record<D>& r, double now) {
  if (slots_.find(r.id) != IdTable::kNowhere) return true;
  Slot slot = 0;
  if (!core_.admit(r, now, slot)) return false;
  enlist(slot, r.id, Role::ghost);
  edge_.push_back({slot, 0});
  return true;
}

template void Subdomain<2>::load(std::vector<Record<2>>, const Bisection<2>&, std::uint32_t, const Vec<2>&, double,
                                 double, double);
template void Subdomain<2>::forget(Slot);
template std::vector<Slot> Subdomain<2>::own() const;
template void Subdomain<2>::watch(double);
template typename Subdomain<2>::Edge Subdomain<2>::look_at(Slot, double);
template bool Subdomain<2>::admit(const Record<2>&, double);
template void Subdomain<3>::load(std::vector<Record<3>>, const Bisection<3>&, std::uint32_t, const Vec<3>&, double,
                                 double, double);
template void Subdomain<3>::forget(Slot);
template std::vector<Slot> Subdomain<3>::own() const;
template void Subdomain<3>::watch(double);
template typename Subdomain<3>::Edge Subdomain<3>::look_at(Slot, double);
template bool Subdomain<3>::admit(const Record<3>&, double);

}  // namespace carom
