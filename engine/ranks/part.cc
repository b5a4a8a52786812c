#include "engine/ranks/part.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "engine/ranks/division.h"
#include "engine/ranks/shares.h"

namespace carom {
namespace {

constexpr double kLeastSlack = 0.5, kMostSlack = 2;  // that a particle comes between divisions [largest diameter]
constexpr double kSlabsApart = 16;                   // divisions, about
constexpr double kFaster = 2;                        // factor between the largest speed and the one allowed for
constexpr double kRoom = 1.25;                       // for a path that was too long
constexpr std::int64_t kSlabs = 64;                  // between divisions while all are known
constexpr double kLeastDepth = 3;                    // of ghosts that do not matter [largest diameter]
constexpr double kMost = 0.9;                        // of all particles; a rank that would know more knows all

/// What ranks tell each other of a particle, beside its luggage.
template <int D>
struct State {
  Vec<D> x, v;
  double mass, radius, charge;
  Image<D> image;
  Id id;
  std::uint16_t species;
};

template <int D>
Vec<D> unwrapped(const Box<D>& box, const Particles<D>& p, Id i) {
  return p.x[i] + box.shift(p.image[i]);
}

}  // namespace

template <int D>
Part<D>::Part(System<D>& shares, bool local, double slab_length, bool cores)
    : shares_(shares),
      ranks_(*shares.ranks),
      holders_(static_cast<std::size_t>(ranks_.size())),
      least_depth_(cores ? kLeastDepth : 0),
      depth_(least_depth_) {
  shares_.part = this;
  divide(nullptr, !local, slab_length);
  next_ = kSlabs;
}

template <int D>
Part<D>::~Part() {
  shares_.part = nullptr;
}

template <int D>
void Part<D>::collect() {
  struct Place {
    Vec<D> x, v;
    Image<D> image;
    Id id;
  };
  const Particles<D>& p = known_->particles;
  const Shares shares{total(), holders_.size()};
  std::vector<Bytes> outgoing(holders_.size());
  for (Id i = 0; i < p.size(); ++i)
    if (p.owns(i))
      put(outgoing[static_cast<std::size_t>(shares.rank_of(p.id_of(i)))],
          Place{p.x[i], p.v[i], p.image[i], p.id_of(i)});
  Particles<D>& share = shares_.particles;
  const Id first = shares.first(ranks_.rank());
  for (const Bytes& message : ranks_.swap(std::move(outgoing)))
    for (Reader reader(message); reader.more();) {
      const auto [x, v, image, id] = reader.get<Place>();
      share.x[id - first] = x;
      share.v[id - first] = v;
      share.image[id - first] = image;
    }
}

template <int D>
bool Part<D>::divide_if_due(Luggage<D>& luggage, bool local, std::int64_t slab, double slab_length) {
  if (all_known_ ? slab < next_ : !outdated()) return false;
  if (!all_known_) {  // all has gone well since the last time
    patience_ = std::max<std::int64_t>(patience_ / 2, 1);
    depth_ = std::max(0.75 * depth_, least_depth_);
    wanted_path_ *= 0.75;
  }
  divide(&luggage, !local, slab_length);
  next_ = slab + kSlabs;
  return true;
}

template <int D>
void Part<D>::know_more(Luggage<D>& luggage, std::int64_t slab, double slab_length) {
  if (std::exchange(more_, false) && divide_some(&luggage, slab_length)) return;
  tell_all(&luggage);
  next_ = slab + patience_;
  patience_ = std::min(2 * patience_, kSlabs);
}

/// `luggage`: null before there is any.
template <int D>
void Part<D>::divide(Luggage<D>* luggage, bool all, double slab_length) {
  if (!all && divide_some(luggage, slab_length)) return;
  if (all_known_)
    own_anew();
  else
    tell_all(luggage);
}

/// What this rank's own particles have to tell, put into the messages that for_each_receiver(place, visit) visits;
/// `particles`: in each of them. No particle is known any more after that.
template <int D>
std::vector<Bytes> Part<D>::pack(Luggage<D>* luggage, const std::vector<std::uint64_t>& particles,
                                 auto&& for_each_receiver) {
  const Particles<D>& p = known_ ? known_->particles : shares_.particles;
  std::vector<Bytes> messages(particles.size());
  Bytes packed;
  for (Id i = 0; i < p.size(); ++i) {
    if (!p.owns(i)) continue;
    packed.clear();
    put(packed, State<D>{p.x[i], p.v[i], p.mass[i], p.radius[i], p.charge[i], p.image[i], p.id_of(i), p.species[i]});
    put(packed, std::size_t{0});
    const std::size_t before = packed.size();
    if (luggage) luggage->pack(i, packed);
    const std::size_t size = packed.size() - before;
    std::memcpy(packed.data() + before - sizeof size, &size, sizeof size);
    for_each_receiver(p.x[i], [&](std::size_t message) {
      if (messages[message].empty()) messages[message].reserve(particles[message] * packed.size());
      messages[message].insert(messages[message].end(), packed.begin(), packed.end());
    });
  }
  if (luggage) luggage->release();
  known_.reset();
  return messages;
}

/// Gives each particle to the ranks that need it; false, and nothing has changed: all ranks have to know all.
template <int D>
bool Part<D>::divide_some(Luggage<D>* luggage, double slab_length) {
  const System<D>& now = known_ ? *known_ : shares_;
  const Particles<D>& p = now.particles;
  std::array<double, 2> most{};  // reach and speed
  auto& [reach, speed] = most;
  for (const auto& term : now.interactions) reach = std::max(reach, known_ ? term->reach(p.x) : term->reach(p, ranks_));
  std::vector<Vec<D>> own;
  for (Id i = 0; i < p.size(); ++i) {
    if (!p.owns(i)) continue;
    speed = std::max(speed, p.v[i].norm());
    own.push_back(p.x[i]);
  }
  ranks_.largest(most);
  const double diameter = 2 * shares_.sizes->largest_radius();
  const double path = std::max(kFaster * speed * slab_length, wanted_path_);
  const double slack = std::clamp(kSlabsApart * speed * slab_length, kLeastSlack * diameter, kMostSlack * diameter);
  const double near = std::max(reach, diameter) + 2 * path + 2 * slack, far = near + depth_ * diameter;
  if (!std::isfinite(far)) return false;
  const Division<D> division(shares_.box, own, holders_.size(), far, ranks_);
  std::vector<std::uint64_t> known(holders_.size());
  for (const Vec<D>& x : own) division.for_each_near(division.wrapped(x), [&](std::uint32_t rank) { ++known[rank]; });
  const std::vector<std::uint64_t> mine = known;
  ranks_.sum(known);
  if (static_cast<double>(std::ranges::max(known)) > kMost * static_cast<double>(total())) return false;

  const auto messages = ranks_.swap(
      pack(luggage, mine, [&](const Vec<D>& x, auto&& visit) { division.for_each_near(division.wrapped(x), visit); }));
  const auto arrivals = receive(messages);
  assign(division, near);
  path_ = path;
  slack_ = slack;
  all_known_ = false;
  unpack(luggage, messages, arrivals);
  return true;
}

template <int D>
void Part<D>::tell_all(Luggage<D>* luggage) {
  const auto messages =
      ranks_.gather(pack(luggage, {total() / holders_.size()}, [](const Vec<D>&, auto&& visit) { visit(0); })[0]);
  const auto arrivals = receive(messages);
  all_known_ = true;
  own_anew();
  unpack(luggage, messages, arrivals);
}

/// Takes in the particles of messages; returns where in these they stand, by id.
template <int D>
std::vector<typename Part<D>::Arrival> Part<D>::receive(const std::vector<Bytes>& messages) {
  std::vector<Arrival> arrivals;
  for (std::size_t rank = 0; rank < messages.size(); ++rank)
    for (Reader from(messages[rank]); from.more();) {
      const std::size_t at = messages[rank].size() - from.left();
      const Id id = from.template get<State<D>>().id;
      from.skip(from.template get<std::size_t>());
      arrivals.push_back({id, rank, at});
    }
  std::ranges::sort(arrivals, {}, &Arrival::id);
  known_ = std::make_unique<System<D>>();
  known_->box = shares_.box;
  known_->species = shares_.species;
  known_->ranks = shares_.ranks;
  known_->quanta = shares_.quanta;
  known_->part = this;
  Particles<D>& p = known_->particles;
  for_each_array(p, [&](auto& array) { array.reserve(arrivals.size()); });
  for (const Arrival& arrival : arrivals) {
    Reader from(messages[arrival.rank]);
    from.skip(arrival.at);
    const auto s = from.template get<State<D>>();
    p.x.push_back(s.x);
    p.v.push_back(s.v);
    p.image.push_back(s.image);
    p.mass.push_back(s.mass);
    p.radius.push_back(s.radius);
    p.charge.push_back(s.charge);
    p.species.push_back(s.species);
    if (arrivals.size() < total()) p.id.push_back(s.id);
  }
  p.ghost.resize(p.size());
  return arrivals;
}

/// Makes what acts on those known, and gives the method what it has to know of them.
template <int D>
void Part<D>::unpack(Luggage<D>* luggage, const std::vector<Bytes>& messages, const std::vector<Arrival>& arrivals) {
  for (const auto& term : shares_.interactions) {
    known_->interactions.push_back(term->among(shares_.particles, known_->particles));
    if (!known_->interactions.back()) throw std::logic_error("Part: a particle is missing that an own particle feels");
  }
  if (!luggage) return;
  luggage->regroup(*known_);
  for (Id i = 0; i < arrivals.size(); ++i) {
    Reader from(messages[arrivals[i].rank]);
    from.skip(arrivals[i].at);
    from.template get<State<D>>();
    from.template get<std::size_t>();
    luggage->unpack(i, from);
  }
}

/// All are known: sets anew which rank owns each.
template <int D>
void Part<D>::own_anew() {
  constexpr double kAll = std::numeric_limits<double>::infinity();
  Exchange alone;
  assign(Division<D>(known_->box, known_->particles.x, holders_.size(), kAll, alone), kAll);
}

/// Sets the owners of those known, and which ranks know this rank's own; ghosts nearer than `near` matter.
template <int D>
void Part<D>::assign(const Division<D>& division, double near) {
  Particles<D>& p = known_->particles;
  holders_.assign(holders_.size(), {});
  ghosts_ = holders_;
  matters_.clear();
  at_.clear();
  safe_slabs_ = 0;
  const auto me = static_cast<std::uint32_t>(ranks_.rank());
  for (Id i = 0; i < p.size(); ++i) {
    const Vec<D> x = division.wrapped(p.x[i]);
    const std::uint32_t owner = division.owner(x);
    p.ghost[i] = owner != me;
    matters_.push_back(owner != me && division.squared_distance(me, x) <= near * near);
    at_.push_back(unwrapped(known_->box, p, i));
    if (owner != me)
      ghosts_[owner].push_back(i);
    else
      division.for_each_near(x, [&](std::uint32_t rank) {
        if (rank != me) holders_[rank].push_back(i);
      });
  }
  partners_.clear();
  for (std::size_t rank = 0; rank < holders_.size(); ++rank)
    if (!holders_[rank].empty() || !ghosts_[rank].empty()) partners_.push_back(static_cast<int>(rank));
}

template <int D>
bool Part<D>::covers(double path) {
  if (all_known_ || path <= path_) return true;
  more_ = std::isfinite(path);
  if (more_) wanted_path_ = kRoom * path;
  return false;
}

template <int D>
bool Part<D>::covers(const Particles<D>& p, std::span<const Vec<D>> a, double length) {
  if (all_known_) return true;
  double farthest = 0;
  for (Id i = 0; i < p.size(); ++i)
    if (p.owns(i)) farthest = std::max(farthest, (p.v[i] + 0.5 * length * a[i]).squaredNorm());
  return covers(length * std::sqrt(largest(farthest)));
}

/// Whether a particle has come so far that all are to be divided anew. Looks only where one may have.
template <int D>
bool Part<D>::outdated() {
  if (safe_slabs_ >= 1) {
    --safe_slabs_;
    return false;
  }
  const Particles<D>& p = known_->particles;
  double farthest = 0;
  for (Id i = 0; i < p.size(); ++i)
    if (p.owns(i)) farthest = std::max(farthest, (unwrapped(known_->box, p, i) - at_[i]).squaredNorm());
  const double left = 0.8 * slack_ - std::sqrt(largest(farthest));
  safe_slabs_ = left / path_;
  return left < 0;
}

template class Part<2>;
template class Part<3>;

}  // namespace carom
