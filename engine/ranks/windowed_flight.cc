// SPDX-License-Identifier: BSD-3-Clause
#include "engine/ranks/windowed_flight.h"

#include <algorithm>

#include "engine/base/error.h"
#include "engine/ranks/shared_contacts.h"

namespace carom {
namespace {

constexpr std::size_t kMinSpheres = 8;                // spheres in a subdomain
constexpr std::size_t kMaxNeighbours = 64;            // neighbours of a subdomain: the bits of Subdomain::holders()
constexpr double kMeanWork = 64, kMaxWork = 64 * 64;  // mean and largest work of a sphere, as integers
constexpr double kWorkTolerance = 0.1;                // smaller relative differences from the mean are ignored

}  // namespace

template <int D>
WindowedFlight<D>::WindowedFlight(const Box<D>& box, Sizes sizes, Communicator& ranks, const SearchOptions& options,
                                  std::function<double()> window)
    : box_(box),
      sizes_(std::move(sizes)),
      ranks_(ranks),
      subdomains_(std::clamp<std::size_t>(sizes_.spheres / kMinSpheres, 1, static_cast<std::size_t>(ranks_.size()))),
      subdomain_(box, sizes_, options, ranks),
      length_(2 * box.steps.reach()(sizes_.largest_radius()), std::move(window)) {}

template <int D>
void WindowedFlight<D>::take(Particles<D>& particles, const Vec<D>& g, double horizon) {
  g_ = g;
  horizon_ = horizon;
  events_ = 0;
  length_.start(box_, sizes_, ranks_, particles, g, horizon);
  const double largest = box_.steps.reach()(sizes_.largest_radius());
  const auto divide = [&](std::size_t subdomains) {
    bisection_.emplace(box_, particles.x, subdomains, 2 * (largest + length_.max_displacement()), ranks_, work_,
                       largest);
    for (std::uint32_t r = 0; r < subdomains; ++r)
      if (bisection_->neighbours(r).size() > kMaxNeighbours) return false;
    return true;
  };
  while (!divide(subdomains_)) subdomains_ -= (subdomains_ + 7) / 8;  // the box is too small for so many subdomains
  subdomain_.counts.subdomains = subdomains_;
  auto spheres = messages([&](auto&& add) {
    for (Id i = 0; i < particles.size(); ++i)
      add(particles.x[i], {particles.x[i], particles.v[i], 0.0, particles.id_of(i), 0, particles.species[i]},
          has_internal() ? particles.internal(i) : Internal<D>{});
  });
  std::vector<Vec<D>>().swap(particles.x);
  std::vector<Vec<D>>().swap(particles.v);
  load(0, std::move(spheres));
  run_before_ = subdomain_.counts.run_events;
}

/// Messages to the subdomains. `spheres(add)` calls add(x, record, internal state) for each sphere, now at x, on one of
/// the ranks; it is called twice.
template <int D>
template <class Spheres>
std::vector<Bytes> WindowedFlight<D>::messages(Spheres&& spheres) {
  const std::size_t size = sizeof(Record<D>) + (has_internal() ? sizeof(Internal<D>) : 0);
  return messages_of_records(static_cast<std::size_t>(ranks_.size()), size, [&](auto&& send) {
    spheres([&](const Vec<D>& x, const Record<D>& r, const Internal<D>& internal) {
      const double reach = bisection_->reach_of(box_.steps.reach()(sizes_.radius_of(r)));
      bisection_->for_each_near(bisection_->wrapped(x), reach, [&](std::uint32_t rank) {
        send(rank, [&](Bytes& to) { subdomain_.put_sphere(to, r, internal); });
      });
    });
  });
}

/// Loads all subdomains.
template <int D>
void WindowedFlight<D>::load(double now, std::vector<Bytes> spheres) {
  subdomain_.load(ranks_.swap(std::move(spheres)), *bisection_, g_, horizon_, now, length_.max_displacement());
  now_ = now;
}

/// Loads all subdomains again from their present spheres.
template <int D>
void WindowedFlight<D>::reload() {
  const std::vector<Slot> own = subdomain_.own();
  load(now_, messages([&](auto&& add) {
         for (const Slot i : own) {
           const Record<D>& r = subdomain_.paths().after(i);
           add(subdomain_.flights().at(r, now_).x, r, subdomain_.paths().internal_after(i));
         }
       }));
}

/// The key of the n-th contact of a window over all ranks, or of the n-th collision of two cores, n from 1. Collective.
template <int D>
EventKey<D> WindowedFlight<D>::key_of_contact(std::uint64_t number, bool pairs) {
  std::vector<EventKey<D>> mine;
  subdomain_.for_each_contact([&](Slot i, std::size_t k) {
    const EventKey<D> key = subdomain_.paths().node(i, k).key;
    const auto core = [&] { return subdomain_.paths().contact_of(i, k).exchange.event == PairEvent::core; };
    if (!pairs || (key.kind == EventKind::pair && (box_.steps.empty() || core()))) mine.push_back(key);
  });
  auto keys = gather_values<EventKey<D>>(ranks_, mine);
  std::ranges::nth_element(keys, keys.begin() + static_cast<std::ptrdiff_t>(number - 1));
  return keys[number - 1];
}

/// The votes of all ranks as one. Collective.
template <int D>
typename WindowedFlight<D>::Vote WindowedFlight<D>::vote_of_all(const Vote& mine) {
  std::array<double, 4> most = {mine.changed ? 1.0 : 0.0, mine.no_room ? 1.0 : 0.0, -mine.reached, mine.speed};
  std::array<std::uint64_t, 3> sums = {mine.collisions_before, mine.events_before, mine.most_collisions};
  ranks_.combine(most, sums);
  return {.changed = most[0] > 0,
          .no_room = most[1] > 0,
          .reached = -most[2],
          .speed = most[3],
          .collisions_before = sums[0],
          .events_before = sums[1],
          .most_collisions = sums[2]};
}

template <int D>
double WindowedFlight<D>::run(double end, const Report& report) {
  constexpr double kForever = std::numeric_limits<double>::infinity();
  ContactTally sum, last_tally;
  std::vector<Contact<D>> contacts;
  const std::uint64_t events_before = events_;
  std::uint64_t collisions = report.counters.sphere_sphere;  // in windows before the last one
  double reached = end, last_length = 0, log_full_at = kForever;
  // The tally of a window is summed over ranks in the first vote of the next one; then last_tally and last_length
  // become zero, so that it counts once.
  while (now_ < end && reached == end) {
    const bool room = subdomain_.begin_window();
    const auto left = static_cast<double>(report.collision_limit - collisions);
    double stop = std::min(length_.window_end(now_, end, left - length_.expected(last_length)), log_full_at);
    const double ran = subdomain_.run(now_, stop);
    Vote vote;
    bool valid = false;
    const std::uint64_t rounds = subdomain_.make_consistent([&](bool paths_changed) {
      vote = vote_of_all({.changed = paths_changed,
                          .no_room = !room,
                          .reached = ran,
                          .speed = subdomain_.fastest(),
                          .collisions_before = last_tally.sphere_sphere,
                          .events_before = last_tally.contacts() + last_tally.kicks,
                          .most_collisions = subdomain_.most_events()});
      last_tally = {};
      collisions += vote.collisions_before;
      events_ += vote.events_before;
      if (last_length > 0)
        length_.note(std::exchange(last_length, 0), box_.steps.empty() ? vote.collisions_before : vote.events_before);
      valid = !vote.no_room && vote.reached == stop && !length_.too_fast(vote.speed, stop - now_);
      return valid && vote.changed;
    });
    if (events_ > report.max_events) throw_too_many_contacts(box_.contacts, report.max_events);
    length_.allow_for(vote.speed);
    log_full_at = vote.reached < stop ? vote.reached : kForever;
    if (!valid) {  // revoke the window; if the log has no room for more, run it up to there
      if (!(log_full_at > now_)) throw_too_many_contacts(box_.contacts, report.max_events);
      ++subdomain_.counts.cut;
      subdomain_.paths().cut({.time = -kForever});
      reload();
      continue;
    }
    ++subdomain_.counts.windows;
    subdomain_.counts.rounds += rounds;
    if (!subdomain_.paths().all_match())
      throw Error(Failure::numerical, "internal error: subdomains do not agree about a window; please report this");
    last_tally = subdomain_.paths().tally();
    const auto end_at = [&](std::uint64_t before, std::uint64_t limit, bool pairs) {
      if (before + vote.most_collisions < limit) return;  // else it may have been reached
      std::uint64_t count = pairs ? last_tally.sphere_sphere : last_tally.contacts() + last_tally.kicks;
      ranks_.sum({&count, 1});
      if (before + count < limit) return;
      const EventKey<D> last = key_of_contact(limit - before, pairs);
      subdomain_.paths().cut(last);
      last_tally = subdomain_.paths().tally();
      reached = stop = last.time;
    };
    end_at(collisions, report.collision_limit, true);
    end_at(events_, report.contact_limit, false);
    if (report.contacts)
      subdomain_.for_each_contact(
          [&](Slot i, std::size_t k) { contacts.push_back(subdomain_.paths().contact_of(i, k)); });
    sum.add(last_tally);
    subdomain_.counts.events += last_tally.contacts();
    last_length = stop - now_;
    now_ = stop;
  }
  const ContactTally all = sum_of_all(ranks_, sum);
  report.counters.add(all);
  if (events_ = events_before + all.contacts() + all.kicks; events_ > report.max_events)
    throw_too_many_contacts(box_.contacts, report.max_events);
  if (report.contacts) merge_contacts<D>(gather_on_first(ranks_, message_of<Contact<D>>(contacts)), *report.contacts);
  return reached;
}

template <int D>
void WindowedFlight<D>::give_back(double time, Particles<D>& particles) {
  measure_work();
  subdomain_.stop();
  copy_at(time, particles);
  subdomain_.release();
}

/// Measures the work of subdomains: the next bisection gives fewer spheres to subdomains with more events per sphere.
template <int D>
void WindowedFlight<D>::measure_work() {
  const std::uint64_t events = subdomain_.counts.run_events - run_before_, spheres = subdomain_.own().size();
  std::array<std::uint64_t, 2> all{events, spheres};
  ranks_.sum(all);
  const double expected = static_cast<double>(all[0]) / static_cast<double>(all[1]) * static_cast<double>(spheres);
  double work = expected > 0 ? static_cast<double>(events) / expected : 1;
  if (std::abs(work - 1) < kWorkTolerance) work = 1;
  subdomain_work_ = static_cast<std::uint32_t>(std::clamp(std::round(work * kMeanWork), 1.0, kMaxWork));
}

/// Sends the spheres, advanced to a time, and their work to the ranks of their blocks.
template <int D>
void WindowedFlight<D>::copy_at(double time, Particles<D>& copies) {
  struct State {
    std::uint32_t work;
    Vec<D> x, v;
    Internal<D> internal;
  };
  const std::size_t here = blocks().first(ranks_.rank() + 1) - blocks().first(ranks_.rank());
  copies.x.resize(here);
  copies.v.resize(here);
  work_.resize(here);
  if (has_internal()) copies.resize_internal(here);
  const std::size_t size = has_internal() ? sizeof(State) : offsetof(State, internal);
  const std::vector<Slot> own = subdomain_.own();
  to_id_blocks(
      blocks(), ranks_, size,
      [&](auto&& send) {
        for (const Slot i : own) {
          const Record<D>& after = subdomain_.paths().after(i);
          send(after.id, [&](Bytes& to) {
            const Record<D> r = subdomain_.flights().at(after, time);
            const State state{subdomain_work_, r.x, r.v, subdomain_.paths().internal_after(i)};
            put_bytes(to, &state, size);
          });
        }
      },
      [&](std::size_t place, const std::byte* bytes) {
        State state;
        std::memcpy(static_cast<void*>(&state), bytes, size);
        copies.x[place] = state.x;
        copies.v[place] = state.v;
        work_[place] = state.work;
        if (has_internal()) copies.set_internal(static_cast<Id>(place), state.internal);
      });
}

template class WindowedFlight<2>;
template class WindowedFlight<3>;

}  // namespace carom
