#include "engine/part.h"

#include <algorithm>
#include <cmath>

#include "engine/division.h"

namespace carom {
namespace {

constexpr double kLeastSlack = 0.5, kMostSlack = 2;  // that anybody comes between divisions [largest diameter]
constexpr double kSlabsApart = 16;                   // divisions, about
constexpr double kFaster = 2;                        // than anybody is, somebody may come to be
constexpr std::int64_t kSlabs = 64;                  // between divisions while everybody is known
constexpr double kLeastDepth = 3;                    // of ghosts that do not matter [largest diameter]
constexpr double kMost = 0.7;                        // of all particles; a rank that would know more knows everybody

/// What ranks tell each other of a particle.
template <int D>
struct State {
  Vec<D> x, v;
  Image<D> image;
  Id id;
};

template <int D>
Vec<D> unwrapped(const Box<D>& box, const Particles<D>& p, Id i) {
  return p.x[i] + box.shift(p.image[i]);
}

}  // namespace

template <int D>
Part<D>::Part(System<D>& whole, Exchange& ranks)
    : whole_(whole), ranks_(ranks), holders_(static_cast<std::size_t>(ranks.size())), depth_(kLeastDepth) {
  whole_.part = this;
  whole_.particles.ghost.resize(total());
  choose_everybody();
}

template <int D>
Part<D>::~Part() {
  whole_.part = nullptr;
  whole_.particles.ghost.clear();
}

/// Brings what is known of the whole up to date, and tells where each particle's luggage is.
template <int D>
std::vector<Bytes> Part<D>::gather_state(const Luggage<D>* luggage, std::vector<Place>* places) {
  const Particles<D>& p = known().particles;
  Bytes mine, packed;
  mine.reserve(p.size() * 2 * sizeof(State<D>));
  for (Id i = 0; i < p.size(); ++i) {
    if (!p.owns(i)) continue;
    put(mine, State<D>{p.x[i], p.v[i], p.image[i], p.id_of(i)});
    if (!luggage) continue;
    packed.clear();
    luggage->pack(i, packed);
    put(mine, packed.size());
    mine.insert(mine.end(), packed.begin(), packed.end());
  }
  std::vector<Bytes> all = ranks_.gather(mine);
  if (places) places->resize(total());
  for (std::size_t rank = 0; rank < all.size(); ++rank)
    for (Reader from(all[rank]); from.more();) {
      const auto [x, v, image, id] = from.get<State<D>>();
      whole_.particles.x[id] = x;
      whole_.particles.v[id] = v;
      whole_.particles.image[id] = image;
      if (!luggage) continue;
      const auto size = from.get<std::size_t>();
      (*places)[id] = {rank, all[rank].size() - from.left()};
      from.skip(size);
    }
  return all;
}

template <int D>
void Part<D>::collect() {
  if (some_) gather_state(nullptr, nullptr);
}

template <int D>
bool Part<D>::divide_if_due(Luggage<D>& luggage, bool local, std::int64_t slab, double slab_length) {
  if (some_ ? !outdated() : slab < next_) return false;
  if (some_) {  // all has gone well since the last time
    patience_ = std::max<std::int64_t>(patience_ / 2, 1);
    depth_ = std::max(0.75 * depth_, kLeastDepth);
  }
  divide(luggage, !local, slab_length);
  next_ = slab + kSlabs;
  return true;
}

template <int D>
void Part<D>::know_everybody(Luggage<D>& luggage, std::int64_t slab) {
  divide(luggage, true, 0);
  next_ = slab + patience_;
  patience_ = std::min(2 * patience_, kSlabs);
}

template <int D>
void Part<D>::divide(Luggage<D>& luggage, bool everybody, double slab_length) {
  const bool knew_everybody = knows_everybody();
  std::vector<Place> places;
  std::vector<Bytes> all;
  if (!knew_everybody || !everybody) all = gather_state(&luggage, &places);
  const bool chosen = !everybody && choose(slab_length);
  if (!chosen) {
    some_.reset();
    choose_everybody();
    if (knew_everybody) return;
  }
  luggage.regroup(known());
  const Particles<D>& p = known().particles;
  for (Id i = 0; i < p.size(); ++i) {
    const Place& place = places[p.id_of(i)];
    Reader from(all[place.rank]);
    from.skip(place.at);
    luggage.unpack(i, from);
  }
}

template <int D>
void Part<D>::choose_everybody() {
  Particles<D>& p = whole_.particles;
  Exchange alone;
  const Division<D> division(whole_.box, p.x, holders_.size(), 0, alone);
  holders_.assign(holders_.size(), {});
  ghosts_ = holders_;
  matters_.clear();
  const auto me = static_cast<std::size_t>(ranks_.rank());
  for (Id i = 0; i < p.size(); ++i) {
    const std::size_t owner = division.owner(division.wrapped(p.x[i]));
    p.ghost[i] = owner != me;
    if (owner != me)
      ghosts_[owner].push_back(i);
    else
      for (std::size_t rank = 0; rank < holders_.size(); ++rank)
        if (rank != me) holders_[rank].push_back(i);
  }
}

/// Chooses whom this rank knows, by where everybody is; false: it has to know everybody.
template <int D>
bool Part<D>::choose(double slab_length) {
  const Particles<D>& all = whole_.particles;
  double reach = 0, radius = 0, speed = 0;
  for (const auto& term : whole_.interactions) reach = std::max(reach, term->reach(all.x));
  for (const double each : all.radius) radius = std::max(radius, each);
  for (const Vec<D>& v : all.v) speed = std::max(speed, v.norm());
  path_ = kFaster * speed * slab_length;
  slack_ = std::clamp(kSlabsApart * speed * slab_length, kLeastSlack * 2 * radius, kMostSlack * 2 * radius);
  const double near = std::max(reach, 2 * radius) + 2 * path_ + 2 * slack_, far = near + depth_ * 2 * radius;
  if (!std::isfinite(far)) return false;
  Exchange alone;
  const Division<D> division(whole_.box, all.x, holders_.size(), far, alone);

  auto some = std::make_unique<System<D>>();
  Particles<D>& p = some->particles;
  const auto me = static_cast<std::uint32_t>(ranks_.rank());
  holders_.assign(holders_.size(), {});
  ghosts_ = holders_;
  matters_.clear();
  at_.clear();
  for (Id id = 0; id < all.size(); ++id) {
    const Vec<D> at = division.wrapped(all.x[id]);
    const std::uint32_t owner = division.owner(at);
    if (owner != me && !division.near(me, at)) continue;
    const auto i = static_cast<Id>(p.id.size());
    p.id.push_back(id);
    p.ghost.push_back(owner != me);
    p.x.push_back(all.x[id]);
    p.v.push_back(all.v[id]);
    p.image.push_back(all.image[id]);
    p.mass.push_back(all.mass[id]);
    p.radius.push_back(all.radius[id]);
    p.charge.push_back(all.charge[id]);
    p.species.push_back(all.species[id]);
    matters_.push_back(owner != me && division.squared_distance(me, at) <= near * near);
    at_.push_back(unwrapped(whole_.box, p, i));
    if (owner != me)
      ghosts_[owner].push_back(i);
    else
      division.for_each_near(at, [&](std::uint32_t rank) {
        if (rank != me) holders_[rank].push_back(i);
      });
  }
  some->box = whole_.box;
  some->species = whole_.species;
  some->ranks = whole_.ranks;
  some->part = this;
  bool enough = static_cast<double>(p.size()) <= kMost * static_cast<double>(all.size());
  for (const auto& term : whole_.interactions) {
    some->interactions.push_back(term->among(all, p));
    enough = enough && some->interactions.back();
  }
  if (largest(enough ? 0 : 1) > 0) return false;
  some_ = std::move(some);
  return true;
}

template <int D>
bool Part<D>::covers(const Particles<D>& p, std::span<const Vec<D>> a, double length) {
  if (!some_) return true;
  double farthest = 0;
  for (Id i = 0; i < p.size(); ++i) farthest = std::max(farthest, length * (p.v[i] + 0.5 * length * a[i]).norm());
  return covers(farthest);
}

template <int D>
bool Part<D>::outdated() {
  if (!some_) return false;
  const Particles<D>& p = some_->particles;
  double farthest = 0;
  for (Id i = 0; i < p.size(); ++i)
    if (p.owns(i)) farthest = std::max(farthest, (unwrapped(whole_.box, p, i) - at_[i]).squaredNorm());
  return largest(farthest) > 0.64 * slack_ * slack_;
}

template class Part<2>;
template class Part<3>;

}  // namespace carom
