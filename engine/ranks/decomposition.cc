// SPDX-License-Identifier: BSD-3-Clause
#include "engine/ranks/decomposition.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "engine/ranks/bisection.h"
#include "engine/ranks/migration.h"
#include "engine/ranks/system.h"

namespace carom {
namespace {

constexpr std::int64_t kSlabsPerDivision = 64;  // while all ranks have all particles
constexpr double kMaxKnownFraction = 0.9;       // if a rank would get more of all particles, all ranks get all
// The work for a particle without partners [pairs in a list]: a Lennard-Jones system with verlet takes 900 + 45 n
// instructions a step and particle with n pairs in the list (10 and 43 pairs, AVX2).
constexpr std::uint32_t kParticleWork = 20;
constexpr double kUneven = 1.1;  // the largest work over the mean at which the first division is repeated

}  // namespace

template <int D>
void Decomposition<D>::join(Communicator& ranks, Sizes of_all) {
  ranks_ = &ranks;
  sizes_ = std::move(of_all);
}

template <int D>
void Decomposition<D>::join(Communicator& ranks) {
  Particles<D>& p = system_.particles;
  join(ranks, Sizes(p));
  const Id first = blocks().first(ranks.rank()), end = blocks().first(ranks.rank() + 1);
  const auto keep = [&](auto& all) {
    if (!all.empty()) all = std::remove_reference_t<decltype(all)>(all.begin() + first, all.begin() + end);
  };
  for_each_array(p, keep);
  for (Id i = first; i < end; ++i) p.id.push_back(i);
}

template <int D>
std::size_t Decomposition<D>::total() const {
  return joined() ? sizes_->spheres : system_.particles.mass.size();
}

template <int D>
std::span<const double> Decomposition<D>::radii() const {
  return joined() ? sizes_->radius : system_.particles.radius;
}

template <int D>
bool Decomposition<D>::divide(bool local, double slab_length, bool cores) {
  if (!joined()) return false;
  local_ = local;
  points_ = !cores;
  width_.start(cores);
  migrate(slab_length);
  next_ = kSlabsPerDivision;
  fresh_ = true;
  return true;
}

template <int D>
void Decomposition<D>::to_blocks() {
  if (!by_place()) return;
  block();
  system_.particles = std::exchange(block_, {});
  system_.interactions = std::move(block_interactions_);
  layout_ = Layout::blocks;
}

template <int D>
const Particles<D>& Decomposition<D>::block() {
  if (!by_place()) return system_.particles;
  struct State {
    Vec<D> x, v;
    Image<D> image;
    Internal<D> internal;
  };
  const bool has_internal = system_.box.contacts.need_internal();
  const Particles<D>& p = system_.particles;
  const std::size_t size = has_internal ? sizeof(State) : offsetof(State, internal);
  to_id_blocks(
      blocks(), *ranks_, size,
      [&](auto&& send) {
        for (Id i = 0; i < p.size(); ++i)
          if (p.owns(i))
            send(p.id_of(i), [&](Bytes& to) {
              const State state{p.x[i], p.v[i], p.image[i], has_internal ? p.internal(i) : Internal<D>{}};
              put_bytes(to, &state, size);
            });
      },
      [&](std::size_t place, const std::byte* bytes) {
        State state;
        std::memcpy(static_cast<void*>(&state), bytes, size);
        block_.x[place] = state.x;
        block_.v[place] = state.v;
        block_.image[place] = state.image;
        if (has_internal) block_.set_internal(static_cast<Id>(place), state.internal);
      });
  return block_;
}

template <int D>
Bytes Decomposition<D>::block_of(Fields::Field& field) const {
  const Particles<D>& p = system_.particles;
  const std::byte* data = field.data();
  if (!by_place()) return {data, data + field.entries() * field.size};
  Bytes block((blocks().first(ranks_->rank() + 1) - blocks().first(ranks_->rank())) * field.size);
  to_id_blocks(
      blocks(), *ranks_, field.size,
      [&](auto&& send) {
        for (Id i = 0; i < p.size(); ++i)
          if (p.owns(i)) send(p.id_of(i), [&](Bytes& to) { put_bytes(to, data + i * field.size, field.size); });
      },
      [&](std::size_t place, const std::byte* bytes) {
        std::memcpy(block.data() + place * field.size, bytes, field.size);
      });
  return block;
}

template <int D>
bool Decomposition<D>::divide_if_due(std::int64_t slab, double slab_length) {
  if (!by_place()) return false;
  const auto known = std::exchange(farthest_, {});
  const auto farthest = [&] { return std::sqrt(known ? *known : largest(squared_farthest(system_.particles.x))); };
  const bool again = std::exchange(fresh_, false) && uneven();  // divide() knew no lists of pairs
  if (!again && (knows_all() ? slab < next_ : !width_.outdated(farthest))) return false;
  if (!knows_all() && !again) {  // the last division was good enough
    slabs_with_all_ = std::max<std::int64_t>(slabs_with_all_ / 2, 1);
    width_.relax();
  }
  migrate(slab_length);
  next_ = slab + kSlabsPerDivision;
  return true;
}

template <int D>
void Decomposition<D>::enlarge_halo(std::int64_t slab, double slab_length) {
  if (width_.take_request() && migrate_to_near(slab_length)) return;
  migrate_to_all();
  next_ = slab + slabs_with_all_;
  slabs_with_all_ = std::min(2 * slabs_with_all_, kSlabsPerDivision);
}

/// The work for each particle of this rank, as far as lists of pairs tell it.
template <int D>
std::vector<std::uint32_t> Decomposition<D>::work() const {
  std::vector<std::uint32_t> work(system_.particles.size(), kParticleWork);
  if (by_place())
    for (const auto& term : system_.interactions) term->add_listed_pairs(work);
  return work;
}

/// Whether a rank has much more work than the mean.
template <int D>
bool Decomposition<D>::uneven() const {
  if (knows_all()) return false;
  const std::vector<std::uint32_t> mine = work();
  std::uint64_t all = 0;
  for (Id i = 0; i < mine.size(); ++i) all += system_.particles.owns(i) ? mine[i] : 0;
  double most = static_cast<double>(all);
  ranks_->combine({&most, 1}, {&all, 1});
  return most * ranks_->size() > kUneven * static_cast<double>(all);
}

template <int D>
void Decomposition<D>::migrate(double slab_length) {
  if (!local_ || !migrate_to_near(slab_length)) migrate_to_all();
}

/// Packs this rank's particles for their receivers and empties the system; with `stay`, particles that stay are kept.
template <int D>
std::vector<Bytes> Decomposition<D>::pack(const std::vector<std::uint64_t>& particles, auto&& for_each_receiver,
                                          std::vector<Fields::Arrival>* stay) {
  Particles<D>& p = system_.particles;
  system_.fields.release_working();
  std::optional<std::size_t> here;
  if (stay) here = static_cast<std::size_t>(ranks_->rank());
  std::vector<Bytes> messages = pack_own(system_.fields, p, particles, for_each_receiver, here, stay);
  if (!by_place()) {
    block_ = std::exchange(p, {});
    block_interactions_ = std::move(system_.interactions);
    system_.interactions.clear();
  }
  if (stay) return messages;
  system_.fields.resize(0);
  p.id = {};
  return messages;
}

/// Sends each particle to the ranks near it; returns false, with nothing changed, if all ranks need all particles.
template <int D>
bool Decomposition<D>::migrate_to_near(double slab_length) {
  const Particles<D>& p = system_.particles;
  std::array<double, 2> most{};  // reach and speed
  auto& [reach, speed] = most;
  for (const auto& term : system_.interactions)
    reach = std::max(reach, by_place() ? term->reach(p.x) : term->reach(p, *ranks_));
  std::vector<Vec<D>> own;
  std::vector<std::uint32_t> work = this->work();
  for (Id i = 0; i < p.size(); ++i) {
    if (!p.owns(i)) continue;
    speed = std::max(speed, p.v[i].norm());
    work[own.size()] = work[i];
    own.push_back(p.x[i]);
  }
  work.resize(own.size());
  ranks_->largest(most);
  width_.fit(reach, speed * slab_length, 2 * system_.box.steps.reach()(sizes_->largest_radius()));
  if (!std::isfinite(width_.far())) return false;
  const Bisection<D> bisection(system_.box, own, blocks().ranks, width_.far(), *ranks_, work);
  const bool one_sided =
      points_ && std::ranges::none_of(system_.interactions, [](const auto& t) { return t->bonds(); });
  const auto for_each_near = [&](const Vec<D>& x, auto&& visit) {
    for_each_receiver(bisection, bisection.wrapped(x), one_sided, visit);
  };
  std::vector<std::uint64_t> known(blocks().ranks);
  for (const Vec<D>& x : own) for_each_near(x, [&](std::uint32_t rank) { ++known[rank]; });
  const std::vector<std::uint64_t> mine = known;
  ranks_->sum(known);
  if (static_cast<double>(std::ranges::max(known)) > kMaxKnownFraction * static_cast<double>(total())) return false;

  std::vector<Fields::Arrival> stay;
  const bool again = by_place();  // at first the particles are in blocks, and the memory of these is freed
  const auto messages = ranks_->swap(pack(mine, for_each_near, again ? &stay : nullptr));
  layout_ = Layout::halos;
  receive_particles(system_.fields, system_.particles, messages, total(), std::move(stay));
  assign(bisection, width_.near(), one_sided);
  system_.fields.prepare_working();
  return true;
}

template <int D>
void Decomposition<D>::migrate_to_all() {
  const auto messages =
      ranks_->gather(pack({total() / blocks().ranks}, [](const Vec<D>&, auto&& visit) { visit(0); })[0]);
  layout_ = Layout::copies_of_all;
  receive_particles(system_.fields, system_.particles, messages, total());
  constexpr double kAll = std::numeric_limits<double>::infinity();
  Communicator alone;
  assign(Bisection<D>(system_.box, system_.particles.x, blocks().ranks, kAll, alone), kAll);
  system_.fields.prepare_working();
}

/// Sets the owners of this rank's particles; ghosts nearer than `near` matter. Makes the interactions for them.
template <int D>
void Decomposition<D>::assign(const Bisection<D>& bisection, double near, bool one_sided) {
  Particles<D>& p = system_.particles;
  halo_.assign(bisection, system_.box, p, ranks_->rank(), near, one_sided);
  system_.interactions.resize(block_interactions_.size());
  for (std::size_t k = 0; k < block_interactions_.size(); ++k) {
    auto& term = system_.interactions[k];
    if (term && term->regroup()) continue;
    term = block_interactions_[k]->among(p);
    if (!term) throw std::logic_error("a particle is missing that an own particle feels");
    term->join(*ranks_);
  }
}

template <int D>
void Decomposition<D>::need_paths(double path) {
  if (knows_all() || width_.allows(path)) return;
  width_.ask_for_path(path);
  throw HaloTooSmall{};
}

template <int D>
void Decomposition<D>::start_step(std::span<Vec<D>> x, std::span<const Vec<D>> v, double length) {
  if (!by_place()) return;
  double farthest = 0;
  for (Id i = 0; i < v.size(); ++i)
    if (system_.particles.owns(i)) farthest = std::max(farthest, v[i].squaredNorm());
  farthest_.reset();
  const bool look = !knows_all() && width_.looks_next();
  most_ = {length * std::sqrt(farthest), look ? squared_farthest(x) : 0};
  for (const auto& term : system_.interactions) most_.push_back(term->ages() ? 1 : 0);
  halo_.start(*ranks_, most_, x);
}

template <int D>
void Decomposition<D>::finish_step(std::span<Vec<D>> x) {
  if (!by_place()) return;
  halo_.finish(*ranks_, x);
  need_paths(most_[0]);
  if (!knows_all() && width_.looks_next()) farthest_ = most_[1];
  for (std::size_t k = 2; k < most_.size(); ++k)
    if (most_[k] > 0) system_.interactions[k - 2]->renew();
}

template <int D>
void Decomposition<D>::need_deeper_halo() {
  width_.ask_for_depth();
  throw HaloTooSmall{};
}

template <int D>
void Decomposition<D>::update_halo() {
  if (knows_all()) return;
  copy_to_ghosts(std::span(system_.particles.x), std::span(system_.particles.v));
  if (system_.box.contacts.need_internal())
    system_.particles.for_each_internal([&](auto& array, auto) { copy_to_ghosts(std::span(array)); });
}

template class Decomposition<2>;
template class Decomposition<3>;

}  // namespace carom
