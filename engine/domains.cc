#include "engine/domains.h"

#include <algorithm>

#include "engine/error.h"
#include "engine/shared_contacts.h"

namespace carom {
namespace {

constexpr double kCollisions = 0.3;                           // of a sphere in a window, about
constexpr double kLargestStray = 1.0, kSmallestStray = 0.02;  // in diameters
constexpr std::size_t kFewest = 8;                            // spheres a region
constexpr double kFaster = 1.15;                              // than anyone is, somebody may come to be
constexpr double kSlack = 8;                                  // windows between looks at who is at the border

}  // namespace

template <int D>
Domains<D>::Domains(const Box<D>& box, const Particles<D>& particles, Exchange& exchange, std::size_t regions,
                    const SearchOptions& options, std::function<double()> window)
    : box_(box),
      particles_(particles),
      exchange_(exchange),
      regions_(std::clamp<std::size_t>(regions, 1, std::max<std::size_t>(particles.radius.size() / kFewest, 1))),
      forced_window_(std::move(window)) {
  diameter_ = 2 * *std::max_element(particles.radius.begin(), particles.radius.end());
  for (std::size_t r = first_region(exchange_.rank()); r < first_region(exchange_.rank() + 1); ++r)
    local_.push_back({.number = static_cast<std::uint32_t>(r),
                      .region = std::make_unique<Region<D>>(box, particles, options),
                      .neighbours = {},
                      .holders = {}});
}

/// Regions go to ranks in their order, as evenly as may be.
template <int D>
std::size_t Domains<D>::first_region(int rank) const {
  return regions_ * static_cast<std::size_t>(rank) / static_cast<std::size_t>(exchange_.size());
}

template <int D>
int Domains<D>::rank_of(std::uint32_t region) const {
  int rank = static_cast<int>(region * static_cast<std::size_t>(exchange_.size()) / regions_);
  while (first_region(rank + 1) <= region) ++rank;
  while (first_region(rank) > region) --rank;
  return rank;
}

template <int D>
void Domains<D>::take(Particles<D>& particles, const Vec<D>& g, double horizon) {
  g_ = g;
  horizon_ = horizon;
  events_ = 0;
  fastest_ = 0;
  double squares = 0;
  for (const Vec<D>& v : particles.v) {
    fastest_ = std::max(fastest_, v.norm());
    squares += v.squaredNorm();
  }
  if (pace_ == 0 && squares > 0) {
    Extent<D> extent;
    for (const Vec<D>& x : particles.x) extent.add(x);
    const double thermal = std::sqrt(squares / static_cast<double>(D * particles.size()));
    pace_ = kCollisions / (contacts_a_length(situation_of<D>(box_, particles_.radius, extent)) * thermal);
  }
  fastest_ = kFaster * fastest_ + g_.norm() * horizon_;
  stray_ = std::clamp(1.05 * pace_ * fastest_, kSmallestStray * diameter_, kLargestStray * diameter_);
  division_.emplace(box_, particles.x, regions_);
  std::vector<Record<D>> records(particles.size());
  for (std::size_t i = 0; i < records.size(); ++i)
    records[i] = {particles.x[i], particles.v[i], 0.0, static_cast<Id>(i), 0, particles.species[i]};
  std::vector<Vec<D>>().swap(particles.x);
  std::vector<Vec<D>>().swap(particles.v);
  load(records, 0);
}

template <int D>
void Domains<D>::load(std::span<const Record<D>> records, double now) {
  const double reach = diameter_ + 2 * stray_;
  std::vector<std::vector<Record<D>>> own(regions_), ghosts(regions_);
  const std::size_t first = first_region(exchange_.rank()), last = first_region(exchange_.rank() + 1);
  for (const Record<D>& r : records) {
    Vec<D> x = r.x + (now - r.t) * r.v;
    x += (0.5 * (now - r.t) * (now - r.t)) * g_;
    const std::uint32_t owner = division_->owner(x);
    division_->for_each_near(x, reach, [&](std::uint32_t q) {
      if (q >= first && q < last) (q == owner ? own : ghosts)[q].push_back(r);
    });
  }
  for (Local& local : local_) {
    local.neighbours = division_->neighbours(local.number, reach);
    if (local.neighbours.size() > 64)
      throw Error(Failure::deck, "a region has more than 64 neighbours; use fewer ranks for this box");
    local.region->load(std::move(own[local.number]), ghosts[local.number], g_, horizon_, now, stray_);
    local.holders.clear();
    local.unwatched = std::numeric_limits<double>::infinity();
  }
  now_ = now;
  fresh_ = false;
  sort_out();
  fresh_ = true;
}

/// Starts all regions anew from what everybody knows.
template <int D>
void Domains<D>::reload(double now) {
  Bytes mine;
  for (const Local& local : local_)
    for (const Slot i : local.region->own()) put(mine, local.region->after(i));
  std::vector<Record<D>> records(particles_.radius.size());
  for (const Bytes& bytes : exchange_.gather(mine))
    for (Reader reader(bytes); reader.more();) {
      const auto r = reader.get<Record<D>>();
      records[r.id] = r;
    }
  load(records, now);
}

/// At the start of a window: says anew who is whose, and gives neighbours the ghosts that they do not have.
template <int D>
void Domains<D>::sort_out() {
  const double reach = diameter_ + 2 * stray_;
  std::vector<Bytes> outgoing(static_cast<std::size_t>(exchange_.size()));
  for (Local& local : local_) {
    Region<D>& region = *local.region;
    if (local.unwatched += stray_; local.unwatched > kSlack * stray_) {
      local.unwatched = 0;
      region.watch(now_,
                   [&](const Vec<D>& x) { return division_->depth(local.number, x) <= reach + (kSlack + 1) * stray_; });
    }
    const std::vector<Slot> before(region.border().begin(), region.border().end());
    region.sort_out(
        now_, [&](const Vec<D>& x) { return division_->owner(x) == local.number; },
        [&](const Vec<D>& x) { return division_->near(local.number, x, reach); });
    local.holders.resize(region.flights().size());
    for (const Slot i : before)
      if (!region.owns(i)) local.holders[i] = 0;
    for (const Slot i : region.border()) {
      const Vec<D> x = region.flights().at(i, now_).x;
      std::uint64_t now = 0;
      for (std::size_t k = 0; k < local.neighbours.size(); ++k) {
        if (!division_->near(local.neighbours[k], x, reach)) continue;
        now |= std::uint64_t{1} << k;
        if ((local.holders[i] >> k & 1) != 0) continue;
        Bytes& to = outgoing[static_cast<std::size_t>(rank_of(local.neighbours[k]))];
        put(to, local.neighbours[k]);
        put(to, region.flights()[i]);
      }
      local.holders[i] = now;
    }
  }
  double full = 0;
  for (const Bytes& bytes : exchange_.swap(std::move(outgoing)))
    for (Reader reader(bytes); reader.more();) {
      const auto number = reader.get<std::uint32_t>();
      const auto record = reader.get<Record<D>>();
      Local& local = local_[number - first_region(exchange_.rank())];
      if (!local.region->admit(record, now_)) full = 1;
    }
  for (Local& local : local_) local.holders.resize(local.region->flights().size());
  exchange_.largest({&full, 1});
  if (full > 0) reload(now_);
}

/// The end of the next window on the way to `end`.
template <int D>
double Domains<D>::window_end(double end) {
  double length = fastest_ > 0 ? stray_ / fastest_ : end - now_;
  if (pace_ > 0) length = std::min(length, pace_);
  if (forced_window_) length = std::min(length, forced_window_());
  const double windows = std::ceil((end - now_) / length * (1 - 1e-9));
  return windows <= 1 ? end : now_ + (end - now_) / windows;
}

template <int D>
double Domains<D>::run(double end, const Report& report) {
  Harvest sum;
  std::vector<Contact<D>> contacts;
  std::uint64_t collisions = report.counters.sphere_sphere;
  double reached = end;
  while (now_ < end) {
    if (!fresh_) sort_out();
    fresh_ = false;
    double stop = window_end(end);
    for (Local& local : local_) local.region->run(now_, stop);
    ++counts_.windows;
    agree();
    // Was anyone so fast that he may have come too far?
    Harvest got = harvest(stop, nullptr);
    std::array<double, 2> worst{got.speed + g_.norm() * horizon_, -got.astray};
    exchange_.largest(worst);
    bool whole = true;
    if (worst[0] > fastest_) fastest_ = kFaster * worst[0];
    if (-worst[1] < stop) {
      ++counts_.cut;
      whole = false;
      stop = -worst[1];
      EventKey<D> last{.time = stop};
      for (auto& k : last.image) k = std::numeric_limits<std::int32_t>::min();
      for (Local& local : local_) local.region->cut(last);
      got = harvest(stop, nullptr);
    }
    // Are there enough?
    std::uint64_t count = got.collisions;
    exchange_.sum({&count, 1});
    if (collisions + count >= report.collision_limit) {
      const EventKey<D> last = *key_of_collision(report.collision_limit - collisions);
      for (Local& local : local_) local.region->cut(last);
      got = harvest(last.time, nullptr);
      count = report.collision_limit - collisions;
      whole = false;
      reached = stop = last.time;
    }
    if (report.contacts) harvest(stop, &contacts);
    sum.collisions += got.collisions;
    sum.bounces += got.bounces;
    sum.virial.add(got.virial);
    sum.overlap = std::max(sum.overlap, got.overlap);
    counts_.events += got.collisions + got.bounces;
    collisions += count;
    const double length = stop - now_, n = static_cast<double>(particles_.radius.size());
    if (whole) {
      for (Local& local : local_) local.region->commit();
      now_ = stop;
      if (count > 0) {
        const double pace = length * kCollisions * n / (2 * static_cast<double>(count));
        pace_ = pace_ > 0 ? 0.9 * pace_ + 0.1 * pace : pace;
      }
    } else {
      reload(stop);
    }
    if (reached < end) break;
  }
  std::array<std::uint64_t, 2> totals{sum.collisions, sum.bounces};
  exchange_.sum(totals);
  report.counters.sphere_sphere += totals[0];
  report.counters.sphere_wall += totals[1];
  exchange_.largest({&sum.overlap, 1});
  report.counters.max_overlap = std::max(report.counters.max_overlap, sum.overlap);
  Bytes mine;
  put(mine, sum.virial);
  for (const Bytes& bytes : exchange_.gather(mine)) report.counters.collision_virial.add(Reader(bytes).get<ExactSum>());
  if (report.contacts) {
    gather_contacts<D>(exchange_, contacts, *report.contacts);
  }
  if (events_ += totals[0] + totals[1]; events_ > report.max_events)
    throw Error(Failure::numerical, "more than max_events_per_step = " + std::to_string(report.max_events) +
                                        " collisions in one step; use a smaller step or raise "
                                        "integrator.max_events_per_step");
  return reached;
}

/// Sends paths and mends them until nothing changes.
template <int D>
void Domains<D>::agree() {
  for (double more = 1; more > 0;) {
    ++counts_.rounds;
    std::vector<Bytes> outgoing(static_cast<std::size_t>(exchange_.size()));
    send_paths(outgoing);
    for (const Bytes& bytes : exchange_.swap(std::move(outgoing)))
      for (Reader reader(bytes); reader.more();) {
        const auto number = reader.get<std::uint32_t>();
        const auto id = reader.get<Id>();
        typename Region<D>::Nodes path(reader.get<std::uint32_t>());
        for (auto& node : path) node = reader.get<Node<D>>();
        local_[number - first_region(exchange_.rank())].region->follow(id, std::move(path));
      }
    more = 0;
    for (Local& local : local_) {
      local.region->repair();
      for (const Slot i : local.region->changed()) more = local.holders[i] != 0 ? 1 : more;
    }
    exchange_.largest({&more, 1});
  }
  for (const Local& local : local_)
    if (!local.region->agrees())
      throw Error(Failure::numerical, "internal error: regions do not agree about a window; please report this");
}

template <int D>
void Domains<D>::send_paths(std::vector<Bytes>& outgoing) const {
  for (const Local& local : local_)
    for (const Slot i : local.region->changed())
      for (std::size_t k = 0; k < local.neighbours.size(); ++k) {
        if ((local.holders[i] >> k & 1) == 0) continue;
        Bytes& to = outgoing[static_cast<std::size_t>(rank_of(local.neighbours[k]))];
        const auto path = local.region->path(i);
        put(to, local.neighbours[k]);
        put(to, local.region->flights()[i].id);
        put(to, static_cast<std::uint32_t>(path.size()));
        for (const Node<D>& node : path) put(to, node);
      }
}

template <int D>
void Domains<D>::fly_to(double time, Particles<D>& copies) const {
  struct Place {
    Id id;
    Vec<D> x, v;
  };
  Bytes mine;
  for (const Local& local : local_)
    for (const Slot i : local.region->own()) {
      const Record<D> r = local.region->flights().at(i, time);
      put(mine, Place{r.id, r.x, r.v});
    }
  copies.x.resize(particles_.radius.size());
  copies.v.resize(particles_.radius.size());
  for (const Bytes& bytes : exchange_.gather(mine))
    for (Reader reader(bytes); reader.more();) {
      const auto place = reader.get<Place>();
      copies.x[place.id] = place.x;
      copies.v[place.id] = place.v;
    }
}

template <int D>
void Domains<D>::give_back(double time, Particles<D>& particles) {
  fly_to(time, particles);
}

template <int D>
EventCounts Domains<D>::counts() const {
  EventCounts all;
  for (const Local& local : local_) all += local.region->counts();
  return all;
}

template <int D>
DomainCounts Domains<D>::domain_counts() const {
  DomainCounts all = counts_;
  for (const Local& local : local_) {
    all.run_events += local.region->run_events();
    all.redone_events += local.region->redone_events();
  }
  return all;
}

template class Domains<2>;
template class Domains<3>;

}  // namespace carom
