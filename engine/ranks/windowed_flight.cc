// SPDX-License-Identifier: BSD-3-Clause
#include "engine/ranks/windowed_flight.h"

#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include <algorithm>

#include "engine/base/error.h"
#include "engine/ranks/halo.h"
#include "engine/ranks/shared_contacts.h"

namespace carom {
namespace {

constexpr std::size_t kMinSpheres = 8;                // spheres in a subdomain
constexpr std::size_t kMaxNeighbours = 64;            // neighbours of a subdomain: the bits of Subdomain::holders()
constexpr double kMeanWork = 64, kMaxWork = 64 * 64;  // mean and largest work of a sphere, as integers
constexpr double kWorkTolerance = 0.1;                // smaller relative differences from the mean are ignored

/// Returns freed memory to the system; call it after large temporary arrays. Address sanitizer has an allocator of its
/// own and leaves that of glibc uninitialised, where malloc_trim() called by several threads at once crashes.
void trim_memory() {
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
  malloc_trim(0);
#endif
}

}  // namespace

template <int D>
WindowedFlight<D>::WindowedFlight(const Box<D>& box, Sizes sizes, Communicator& ranks, const SearchOptions& options,
                                  std::function<double()> window)
    : box_(box),
      sizes_(std::move(sizes)),
      ranks_(ranks),
      options_(options),
      exchange_(ranks),
      length_(2 * sizes_.largest_radius(), std::move(window)) {
  make_subdomain(std::clamp<std::size_t>(sizes_.spheres / kMinSpheres, 1, static_cast<std::size_t>(ranks_.size())));
}

template <int D>
void WindowedFlight<D>::make_subdomain(std::size_t subdomains) {
  event_counts_ = counts();
  counts_ = window_counts();
  subdomains_ = subdomains;
  counts_.subdomains = subdomains;
  subdomain_.reset();
  if (static_cast<std::size_t>(ranks_.rank()) < subdomains)
    subdomain_ = std::make_unique<Subdomain<D>>(box_, sizes_, options_);
}

template <int D>
void WindowedFlight<D>::take(Particles<D>& particles, const Vec<D>& g, double horizon) {
  g_ = g;
  horizon_ = horizon;
  events_ = 0;
  length_.start(box_, sizes_, ranks_, particles, g, horizon);
  const auto divide = [&](std::size_t subdomains) {
    bisection_.emplace(box_, particles.x, subdomains, 2 * (sizes_.largest_radius() + length_.max_displacement()),
                       ranks_, work_);
    for (std::uint32_t r = 0; r < subdomains; ++r)
      if (bisection_->neighbours(r).size() > kMaxNeighbours) return false;
    return true;
  };
  std::size_t subdomains = subdomains_;
  while (!divide(subdomains)) subdomains -= (subdomains + 7) / 8;  // the box is too small for so many subdomains
  if (subdomains < subdomains_) make_subdomain(subdomains);
  exchange_.start(*bisection_);
  load(0, [&](auto&& add) {
    for (Id i = 0; i < particles.size(); ++i)
      add({particles.x[i], particles.v[i], 0.0, particles.id_of(i), 0, particles.species[i]},
          rough() ? particles.spin[i] : Spin<D>(Spin<D>::Zero()));
    std::vector<Vec<D>>().swap(particles.x);
    std::vector<Vec<D>>().swap(particles.v);
  });
  run_before_ = subdomain_ ? subdomain_->run_events() : 0;
}

/// The position of a sphere, with the bits that Flights computes.
template <int D>
Vec<D> WindowedFlight<D>::place(const Record<D>& r, double now) const {
  const double s = now - r.t;
  Vec<D> x = r.x + s * r.v;
  if (g_ != Vec<D>::Zero()) x += (0.5 * s * s) * g_;
  return bisection_->wrapped(x);
}

/// Loads all subdomains. `spheres(add)` calls add(record, spin) for each sphere, on one of the ranks.
template <int D>
template <class Spheres>
void WindowedFlight<D>::load(double now, Spheres&& spheres) {
  std::vector<std::pair<Vec<D>, Spin<D>>> own;  // places and spins
  auto near = sent_to_near<Record<D>>(*bisection_, ranks_, [&](auto&& send) {
    spheres([&](const Record<D>& r, const Spin<D>& spin) {
      send(place(r, now), r);
      if (rough()) own.emplace_back(place(r, now), spin);
    });
  });
  std::vector<Spin<D>> spins;  // in the order of the records
  if (rough())
    spins = sent_to_near<Spin<D>>(*bisection_, ranks_, [&](auto&& send) {
      for (const auto& [x, spin] : own) send(x, spin);
    });
  if (subdomain_)
    subdomain_->load(std::move(near), *bisection_, static_cast<std::uint32_t>(ranks_.rank()), g_, horizon_, now,
                     length_.max_displacement(), spins);
  trim_memory();  // messages and sorted copies
  now_ = now;
  cut_ = false;
  sort_out(true);
}

/// Loads all subdomains again from their present spheres.
template <int D>
void WindowedFlight<D>::reload() {
  load(now_, [&](auto&& add) {
    if (subdomain_)
      for (const Slot i : subdomain_->own()) add(subdomain_->paths().after(i), subdomain_->paths().spin_after(i));
  });
}

/// Call at the start of a window: updates ownership and ghosts and sends neighbours the ghosts that they lack.
/// Subdomains that have just been loaded lack none.
template <int D>
void WindowedFlight<D>::sort_out(bool loaded) {
  sorted_ = true;
  if (subdomain_)
    subdomain_->sort_out(now_, [&](std::size_t neighbour, const Record<D>& record) {
      if (loaded) return;
      exchange_.add(neighbour, record);
      if (rough()) exchange_.add(neighbour, subdomain_->flights().spin(subdomain_->ownership().slot_of(record.id)));
    });
  no_room_ = false;
  if (loaded) return;
  for (const Bytes& bytes : exchange_.swap())
    for (Reader reader(bytes); reader.more();) {
      const auto record = reader.get<Record<D>>();
      const Spin<D> spin = rough() ? reader.get<Spin<D>>() : Spin<D>(Spin<D>::Zero());
      if (!subdomain_->ownership().admit(record, now_, spin)) no_room_ = true;
    }
}

/// The key of the n-th pair collision of a window over all ranks, n from 1. Collective.
template <int D>
EventKey<D> WindowedFlight<D>::key_of_collision(std::uint64_t number) const {
  std::vector<EventKey<D>> mine;
  if (subdomain_)
    subdomain_->for_each_contact([&](Slot i, std::size_t k) {
      if (const EventKey<D> key = subdomain_->paths().node(i, k).key; key.kind == EventKind::pair) mine.push_back(key);
    });
  auto keys = gather_values<EventKey<D>>(ranks_, mine);
  std::ranges::nth_element(keys, keys.begin() + static_cast<std::ptrdiff_t>(number - 1));
  return keys[number - 1];
}

template <int D>
double WindowedFlight<D>::run(double end, const Report& report) {
  ContactTally sum, got;
  std::vector<Contact<D>> contacts;
  const std::uint64_t events_before = events_;
  std::uint64_t collisions = report.counters.sphere_sphere;  // in windows before the last one
  constexpr double kForever = std::numeric_limits<double>::infinity();
  double reached = end, length = 0, full = kForever;
  while (now_ < end && reached == end) {
    if (cut_) reload();
    if (!sorted_) sort_out(false);
    const auto left = static_cast<double>(report.collision_limit - collisions);
    double stop = std::min(length_.window_end(now_, end, left - length_.expected(length)), full);
    const double ran = subdomain_ ? subdomain_->run(now_, stop) : stop;
    // Over all ranks: maxima of whether a path changed, a ghost found no room, of the time reached (negated) and of
    // speeds; sums over the window before, and the most collisions of this one.
    enum { changed, no_room, earliest, speed };
    std::array<double, 4> most;
    std::array<std::uint64_t, 3> sums;
    bool valid = false;
    const auto agree = [&](bool paths_changed) {
      most = {paths_changed ? 1.0 : 0.0, no_room_ ? 1.0 : 0.0, -ran, 0};
      sums = {got.sphere_sphere, got.contacts(), 0};
      if (subdomain_) {
        most[speed] = subdomain_->fastest();
        sums[2] = subdomain_->most_events();
      }
      got = {};
      ranks_.combine(most, sums);
      collisions += sums[0];
      events_ += sums[1];
      if (length > 0) length_.note(std::exchange(length, 0), sums[0]);
      valid = most[no_room] == 0 && -most[earliest] == stop && !length_.too_fast(most[speed], stop - now_);
      return valid && most[changed] > 0;
    };
    const std::uint64_t rounds = exchange_.make_consistent(subdomain_.get(), agree);
    if (events_ > report.max_events) throw_too_many_contacts(report.max_events);
    length_.allow_for(most[speed]);
    full = -most[earliest] < stop ? -most[earliest] : kForever;
    if (!valid) {  // revoke the window; if the log has no room for more, run it up to there
      if (!(full > now_)) throw_too_many_contacts(report.max_events);
      ++counts_.cut;
      if (subdomain_) subdomain_->paths().cut({.time = -kForever});
      cut_ = true;
      sorted_ = false;
      continue;
    }
    ++counts_.windows;
    counts_.rounds += rounds;
    if (subdomain_ && !subdomain_->paths().all_match())
      throw Error(Failure::numerical, "internal error: subdomains do not agree about a window; please report this");
    got = tally();
    if (collisions + sums[2] >= report.collision_limit) {  // it may have been reached
      std::uint64_t count = got.sphere_sphere;
      ranks_.sum({&count, 1});
      if (collisions + count >= report.collision_limit) {
        const EventKey<D> last = key_of_collision(report.collision_limit - collisions);
        if (subdomain_) subdomain_->paths().cut(last);
        cut_ = true;
        got = tally();
        reached = stop = last.time;
      }
    }
    if (report.contacts && subdomain_)
      subdomain_->for_each_contact(
          [&](Slot i, std::size_t k) { contacts.push_back(subdomain_->paths().contact_of(i, k)); });
    sum.add(got);
    counts_.events += got.contacts();
    if (!cut_) length = stop - now_;
    now_ = stop;
    sorted_ = false;
    if (subdomain_ && !cut_) subdomain_->commit();
  }
  const ContactTally all = sum_of_all(ranks_, sum);
  report.counters.add(all);
  if (events_ = events_before + all.contacts(); events_ > report.max_events) throw_too_many_contacts(report.max_events);
  if (report.contacts) merge_contacts<D>(gather_on_first(ranks_, packed<D>(contacts)), *report.contacts);
  return reached;
}

template <int D>
void WindowedFlight<D>::fly_to(double time, Particles<D>& copies) const {
  collect(time, copies, nullptr);
}

template <int D>
void WindowedFlight<D>::give_back(double time, Particles<D>& particles) {
  measure_work();
  if (subdomain_) subdomain_->stop();
  collect(time, particles, &work_);
  if (subdomain_) subdomain_->release();
}

/// Measures the work of subdomains: the next bisection gives fewer spheres to subdomains with more events per sphere.
template <int D>
void WindowedFlight<D>::measure_work() {
  const std::uint64_t events = subdomain_ ? subdomain_->run_events() - run_before_ : 0;
  const std::uint64_t spheres = subdomain_ ? subdomain_->own().size() : 0;
  std::array<std::uint64_t, 2> all{events, spheres};
  ranks_.sum(all);
  const double expected = static_cast<double>(all[0]) / static_cast<double>(all[1]) * static_cast<double>(spheres);
  double work = expected > 0 ? static_cast<double>(events) / expected : 1;
  if (std::abs(work - 1) < kWorkTolerance) work = 1;
  subdomain_work_ = static_cast<std::uint32_t>(std::clamp(std::round(work * kMeanWork), 1.0, kMaxWork));
}

/// Sends the spheres, advanced to a time, to the ranks of their blocks, and their work if asked for.
template <int D>
void WindowedFlight<D>::collect(double time, Particles<D>& copies, std::vector<std::uint32_t>* work) const {
  struct State {
    std::uint32_t work;
    Vec<D> x, v;
  };
  const std::size_t here = blocks().first(ranks_.rank() + 1) - blocks().first(ranks_.rank());
  copies.x.resize(here);
  copies.v.resize(here);
  if (work) work->resize(here);
  to_id_blocks<State>(
      blocks(), ranks_,
      [&](auto&& send) {
        if (!subdomain_) return;
        for (const Slot i : subdomain_->own()) {
          const Record<D> r = subdomain_->flights().at(subdomain_->paths().after(i), time);
          send(r.id, State{subdomain_work_, r.x, r.v});
        }
      },
      [&](std::size_t place, const State& state) {
        copies.x[place] = state.x;
        copies.v[place] = state.v;
        if (work) (*work)[place] = state.work;
      });
  if (!rough()) return;
  copies.spin.resize(here);
  to_id_blocks<Spin<D>>(
      blocks(), ranks_,
      [&](auto&& send) {
        if (!subdomain_) return;
        for (const Slot i : subdomain_->own()) send(subdomain_->flights()[i].id, subdomain_->paths().spin_after(i));
      },
      [&](std::size_t place, const Spin<D>& spin) { copies.spin[place] = spin; });
}

template <int D>
EventCounts WindowedFlight<D>::counts() const {
  EventCounts all = event_counts_;
  if (subdomain_) all += subdomain_->counts();
  return all;
}

template <int D>
WindowCounts WindowedFlight<D>::window_counts() const {
  WindowCounts all = counts_;
  if (!subdomain_) return all;
  all.run_events += subdomain_->run_events();
  all.redone_events += subdomain_->redone_events();
  return all;
}

template class WindowedFlight<2>;
template class WindowedFlight<3>;

}  // namespace carom
