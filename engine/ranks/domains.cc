#include "engine/ranks/domains.h"

#include <algorithm>
#include <bit>

#include "engine/base/error.h"
#include "engine/ranks/halo.h"

namespace carom {
namespace {

constexpr double kCollisions = 0.3;                           // of a sphere in a window, about
constexpr double kLargestStray = 1.0, kSmallestStray = 0.02;  // in diameters
constexpr std::size_t kFewest = 8;                            // spheres a region
constexpr std::size_t kMostNeighbours = 64;                   // of a region: the bits of Region::holders()
constexpr double kUsualWork = 64, kMostWork = 64 * 64;        // in whole numbers
constexpr double kUneven = 0.1;                               // what differs less from the usual counts as usual

}  // namespace

template <int D>
Domains<D>::Domains(const Box<D>& box, Sizes sizes, Exchange& exchange, const SearchOptions& options,
                    std::function<double()> window)
    : box_(box), sizes_(std::move(sizes)), exchange_(exchange), options_(options), forced_window_(std::move(window)) {
  diameter_ = 2 * sizes_.largest_radius();
  make_region(std::clamp<std::size_t>(sizes_.spheres / kFewest, 1, static_cast<std::size_t>(exchange_.size())));
}

template <int D>
void Domains<D>::make_region(std::size_t regions) {
  event_counts_ = counts();
  counts_ = domain_counts();
  regions_ = regions;
  counts_.regions = regions;
  region_.reset();
  if (static_cast<std::size_t>(exchange_.rank()) < regions)
    region_ = std::make_unique<Region<D>>(box_, sizes_, options_);
}

template <int D>
void Domains<D>::take(Particles<D>& particles, const Vec<D>& g, double horizon, const Instants* instants) {
  g_ = g;
  horizon_ = horizon;
  events_ = 0;
  fastest_ = 0;
  for (const Vec<D>& v : particles.v) fastest_ = std::max(fastest_, v.norm());
  exchange_.largest({&fastest_, 1});
  if (pace_ == 0 && fastest_ > 0) pace_ = first_pace(particles);
  fastest_ = kFaster * fastest_ + g_.norm() * horizon_;
  stray_ = std::clamp(1.05 * pace_ * fastest_, kSmallestStray * diameter_, kLargestStray * diameter_);
  const auto record = [&](Id i) {
    Record<D> r{particles.x[i], particles.v[i], 0.0, particles.id_of(i), 0, particles.species[i]};
    if (instants) r.t = instants->t[i], r.generation = instants->generation[i];
    return r;
  };
  std::vector<Vec<D>> places;  // where they are now
  for (Id i = 0; instants && i < particles.size(); ++i) {
    const double s = instants->now - instants->t[i];
    Image<D> image{};
    box_.wrap(places.emplace_back(particles.x[i] + s * particles.v[i] + (0.5 * s * s) * g_), image);
  }
  const auto divide = [&](std::size_t regions) {
    division_.emplace(box_, instants ? places : particles.x, regions, diameter_ + 2 * stray_, exchange_, work_);
    for (std::uint32_t r = 0; r < regions; ++r)
      if (division_->neighbours(r).size() > kMostNeighbours) return false;
    return true;
  };
  std::size_t regions = regions_;
  while (!divide(regions)) regions -= (regions + 7) / 8;  // the box is too small for so many
  if (regions < regions_) make_region(regions);
  partners_.clear();
  if (region_)
    for (const std::uint32_t r : division_->neighbours(static_cast<std::uint32_t>(exchange_.rank())))
      partners_.push_back(static_cast<int>(r));
  outgoing_.assign(partners_.size(), {});
  load(instants ? instants->now : 0, [&](auto&& add) {
    for (Id i = 0; i < particles.size(); ++i) add(record(i));
    std::vector<Vec<D>>().swap(particles.x);
    std::vector<Vec<D>>().swap(particles.v);
  });
  run_before_ = region_ ? region_->run_events() : 0;
}

/// The time in which a sphere collides kCollisions times, by Enskog's theory.
template <int D>
double Domains<D>::first_pace(const Particles<D>& particles) const {
  ExactSum squares;  // the same for any number of ranks
  Extent<D> extent;
  for (const Vec<D>& v : particles.v) squares.add(v.squaredNorm());
  for (const Vec<D>& x : particles.x) extent.add(x);
  std::vector<double> bounds;
  for (int k = 0; k < D; ++k) {
    bounds.push_back(extent.particles > 0 ? -extent.low[k] : -std::numeric_limits<double>::infinity());
    bounds.push_back(extent.particles > 0 ? extent.high[k] : -std::numeric_limits<double>::infinity());
  }
  exchange_.largest(bounds);
  for (int k = 0; k < D; ++k)
    extent.low[k] = -bounds[std::size_t{2} * k], extent.high[k] = bounds[std::size_t{2} * k + 1];
  extent.particles = sizes_.spheres;
  const double thermal = std::sqrt(sum_of_all(exchange_, squares).value() / static_cast<double>(D * sizes_.spheres));
  return kCollisions / (contacts_a_length(situation_of<D>(box_, sizes_.radius, extent, sizes_.number)) * thermal);
}

/// Sends all messages to neighbours; returns those that have come from them.
template <int D>
std::vector<Bytes> Domains<D>::exchange_messages() {
  std::vector<Bytes> received = exchange_.swap(std::move(outgoing_), partners_);
  outgoing_.assign(partners_.size(), {});
  return received;
}

/// Where a sphere is, as Flights has it, bit for bit.
template <int D>
Vec<D> Domains<D>::place(const Record<D>& r, double now) const {
  const double s = now - r.t;
  Vec<D> x = r.x + s * r.v;
  if (g_ != Vec<D>::Zero()) x += (0.5 * s * s) * g_;
  return division_->wrapped(x);
}

/// Starts all regions anew. `spheres(add)` calls add(record) for each sphere, on one of the ranks.
template <int D>
template <class Spheres>
void Domains<D>::load(double now, Spheres&& spheres) {
  auto near = to_those_near<Record<D>>(
      *division_, exchange_, [&](auto&& send) { spheres([&](const Record<D>& r) { send(place(r, now), r); }); });
  if (region_)
    region_->load(std::move(near), *division_, static_cast<std::uint32_t>(exchange_.rank()), g_, horizon_, now, stray_);
  now_ = now;
  cut_ = false;
  sort_out(true);
}

/// Starts all regions anew from what they have now.
template <int D>
void Domains<D>::reload() {
  load(now_, [&](auto&& add) {
    if (region_)
      for (const Slot i : region_->own()) add(region_->after(i));
  });
}

/// At the start of a window: updates ownership and ghosts, and sends neighbours the ghosts that they lack. Where
/// regions have just been loaded they have them all.
template <int D>
void Domains<D>::sort_out(bool loaded) {
  sorted_ = true;
  if (region_)
    region_->sort_out(now_, [&](std::size_t neighbour, const Record<D>& record) {
      if (!loaded) put(outgoing_[neighbour], record);
    });
  if (loaded) return;
  double full = 0;
  for (const Bytes& bytes : exchange_messages())
    for (Reader reader(bytes); reader.more();)
      if (!region_->admit(reader.get<Record<D>>(), now_)) full = 1;
  exchange_.largest({&full, 1});
  if (full > 0) reload();
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
  ContactTally sum;
  std::vector<Contact<D>> contacts;
  std::uint64_t collisions = report.counters.sphere_sphere;
  double reached = end, full = std::numeric_limits<double>::infinity();
  while (now_ < end && reached == end) {
    if (cut_) reload();
    if (!sorted_) sort_out(false);
    double stop = std::min(window_end(end), full);
    full = -(region_ ? region_->run(now_, stop) : stop);
    exchange_.largest({&full, 1});
    full = -full;
    if (full < stop) {  // too many events for a window: it is taken back, and run again up to there
      if (!(full > now_)) throw_too_many_contacts(report.max_events);
      cut_at(now_);
      sorted_ = false;
      continue;
    }
    full = std::numeric_limits<double>::infinity();
    ++counts_.windows;
    agree();
    if (const double astray = first_astray(stop); astray < stop) stop = cut_at(astray);
    if (region_ && !region_->agrees(stop))
      throw Error(Failure::numerical, "internal error: regions do not agree about a window; please report this");
    ContactTally got = tally();
    std::uint64_t count = got.sphere_sphere;
    exchange_.sum({&count, 1});
    if (collisions + count >= report.collision_limit) {  // there are enough
      count = report.collision_limit - collisions;
      const EventKey<D> last = *key_of_collision(count);
      if (region_) region_->cut(last);
      cut_ = true;
      got = tally();
      reached = stop = last.time;
    }
    if (report.contacts) add_contacts(contacts);
    sum.add(got);
    counts_.events += got.contacts();
    std::uint64_t contacts_of_all = got.contacts();
    exchange_.sum({&contacts_of_all, 1});
    if (events_ += contacts_of_all; events_ > report.max_events) throw_too_many_contacts(report.max_events);
    collisions += count;
    const double length = stop - now_, n = static_cast<double>(sizes_.spheres);
    now_ = stop;
    sorted_ = false;
    if (cut_) continue;
    if (region_) region_->commit();
    if (count > 0) {
      const double pace = length * kCollisions * n / (2 * static_cast<double>(count));
      pace_ = pace_ > 0 ? 0.9 * pace_ + 0.1 * pace : pace;
    }
  }
  report_all(sum, contacts, report);
  return reached;
}

/// Sends paths and mends them until nothing changes.
template <int D>
void Domains<D>::agree() {
  received_.clear();
  for (double more = 1; more > 0;) {
    ++counts_.rounds;
    send_paths();
    for (const Bytes& bytes : received_.emplace_back(exchange_messages()))
      for (Reader reader(bytes); reader.more();) {
        const auto id = reader.get<Id>();
        region_->follow(id, reader);
      }
    more = 0;
    if (region_) {
      region_->repair();
      for (const Slot i : region_->changed()) more = region_->holders(i) != 0 ? 1 : more;
    }
    exchange_.largest({&more, 1});
  }
}

template <int D>
void Domains<D>::send_paths() {
  if (!region_) return;
  for (const Slot i : region_->changed())
    for (std::uint64_t holders = region_->holders(i); holders != 0; holders &= holders - 1) {
      Bytes& bytes = outgoing_[static_cast<std::size_t>(std::countr_zero(holders))];
      put(bytes, region_->flights()[i].id);
      region_->write_path(i, bytes);
    }
}

template <int D>
void Domains<D>::fly_to(double time, Particles<D>& copies) const {
  collect(time, copies, nullptr);
}

template <int D>
void Domains<D>::records(Particles<D>& particles, Instants& instants) const {
  const std::size_t here = blocks().first(exchange_.rank() + 1) - blocks().first(exchange_.rank());
  instants.now = now_;
  particles.x.resize(here);
  particles.v.resize(here);
  instants.t.resize(here);
  instants.generation.resize(here);
  to_id_blocks<Record<D>>(
      blocks(), exchange_,
      [&](auto&& send) {
        if (!region_) return;
        for (const Slot i : region_->own()) send(region_->after(i).id, region_->after(i));
      },
      [&](std::size_t place, const Record<D>& r) {
        particles.x[place] = r.x;
        particles.v[place] = r.v;
        instants.t[place] = r.t;
        instants.generation[place] = r.generation;
      });
}

template <int D>
void Domains<D>::give_back(double time, Particles<D>& particles) {
  measure_work();
  collect(time, particles, &work_);
}

/// So that the next division gives fewer spheres to regions with more events a sphere.
template <int D>
void Domains<D>::measure_work() {
  const std::uint64_t events = region_ ? region_->run_events() - run_before_ : 0;
  const std::uint64_t spheres = region_ ? region_->own().size() : 0;
  std::array<std::uint64_t, 2> all{events, spheres};
  exchange_.sum(all);
  const double expected = static_cast<double>(all[0]) / static_cast<double>(all[1]) * static_cast<double>(spheres);
  double work = expected > 0 ? static_cast<double>(events) / expected : 1;
  if (std::abs(work - 1) < kUneven) work = 1;
  region_work_ = static_cast<std::uint32_t>(std::clamp(std::round(work * kUsualWork), 1.0, kMostWork));
}

/// Sends the spheres, flown to a time, to the ranks of their blocks; and their work by region_work_.
template <int D>
void Domains<D>::collect(double time, Particles<D>& copies, std::vector<std::uint32_t>* work) const {
  struct State {
    std::uint32_t work;
    Vec<D> x, v;
  };
  const std::size_t here = blocks().first(exchange_.rank() + 1) - blocks().first(exchange_.rank());
  copies.x.resize(here);
  copies.v.resize(here);
  if (work) work->resize(here);
  to_id_blocks<State>(
      blocks(), exchange_,
      [&](auto&& send) {
        if (!region_) return;
        for (const Slot i : region_->own()) {
          const Record<D> r = region_->flights().at(region_->after(i), time);
          send(r.id, State{region_work_, r.x, r.v});
        }
      },
      [&](std::size_t place, const State& state) {
        copies.x[place] = state.x;
        copies.v[place] = state.v;
        if (work) (*work)[place] = state.work;
      });
}

template <int D>
EventCounts Domains<D>::counts() const {
  EventCounts all = event_counts_;
  if (region_) all += region_->counts();
  return all;
}

template <int D>
DomainCounts Domains<D>::domain_counts() const {
  DomainCounts all = counts_;
  if (!region_) return all;
  all.run_events += region_->run_events();
  all.redone_events += region_->redone_events();
  return all;
}

template class Domains<2>;
template class Domains<3>;

}  // namespace carom
