// SPDX-License-Identifier: BSD-3-Clause
#include "engine/ranks/subdomain.h"

#include <algorithm>
#include <bit>

namespace carom {

template <int D>
void Subdomain<D>::load(std::vector<Bytes> spheres, const Bisection<D>& bisection, const Vec<D>& g, double horizon,
                        double now, double max_displacement) {
  release();
  std::size_t bytes = 0;
  for (const Bytes& message : spheres) bytes += message.size();
  std::vector<Record<D>> records;
  std::vector<Internal<D>> internal;
  records.reserve(bytes / sizeof(Record<D>));
  for (Bytes& message : spheres) {
    for (Reader reader(message); reader.more();) {
      records.push_back(reader.get<Record<D>>());
      if (box_.contacts.need_internal()) internal.push_back(reader.get<Internal<D>>());
    }
    Bytes().swap(message);
  }
  // A sphere and the one that it may meet may each be this far from the start of the window, and so may their repairs.
  core_.load(std::move(records), g, horizon, now, 2 * max_displacement, internal);
  const auto number = static_cast<std::uint32_t>(ranks_.rank());
  ownership_.emplace(core_, bisection, number, max_displacement);
  paths_.emplace(box_, core_.flights(), *ownership_);
  repair_.emplace(box_, core_, *ownership_, *paths_);
  end_ = now;
  length_ = 0;
  ownership_->sort_out(now, 0, [](std::size_t, const Record<D>&) {});  // all spheres near each subdomain are there
  neighbours_.clear();
  if (number < bisection.subdomains())
    for (const std::uint32_t r : bisection.neighbours(number)) neighbours_.push_back(static_cast<int>(r));
  outgoing_.assign(neighbours_.size(), {});
}

template <int D>
void Subdomain<D>::release() {
  repair_.reset();
  paths_.reset();
  ownership_.reset();
  core_.release();
}

template <int D>
double Subdomain<D>::run(double now, double end) {
  end_ = end;
  length_ = end - now;
  redone_before_ = counts.redone_events;
  Counters unused;
  double reached = end;
  try {
    core_.run(end, {.counters = unused, .trace = &paths_->start_log()});
  } catch (LogFull) {
    reached = core_.now();
  }
  counts.run_events += paths_->trace().events().size();
  changed_ = paths_->link_log();
  return reached;
}

/// Sends the outgoing messages; returns those received from the neighbours, valid until the next call.
template <int D>
const std::vector<Bytes>& Subdomain<D>::swap() {
  for (Bytes& read : received_) read.clear();
  received_.resize(neighbours_.size());
  received_ = ranks_.swap(std::exchange(outgoing_, std::move(received_)), neighbours_);
  return received_;
}

template <int D>
std::uint64_t Subdomain<D>::make_consistent(const std::function<bool(bool)>& agree) {
  std::uint64_t rounds = 0;
  for (bool more = true; more; rounds += 2) {
    for (int round = 0; round < 2; ++round) {  // most windows need two, few need more
      for (const Slot i : changed_)
        for (std::uint64_t holders = ownership_->holders(i); holders != 0; holders &= holders - 1)
          paths_->write(i, outgoing_[static_cast<std::size_t>(std::countr_zero(holders))]);
      for (const Bytes& bytes : swap())
        for (Reader reader(bytes); reader.more();) paths_->read_script(reader);
      changed_ = repair_->run(end_);
      counts.redone_events += repair_->events();
    }
    more = agree(std::ranges::any_of(changed_, [&](Slot i) { return ownership_->is_seen(i); }));
  }
  return rounds;
}

template <int D>
bool Subdomain<D>::begin_window() {
  const auto other = paths_->take_changes();
  for (const auto& each : other) ownership_->note_event(each.slot, true);
  core_.put(other, end_);
  ownership_->sort_out(end_, length_, [&](std::size_t neighbour, const Record<D>& r) {
    put_sphere(outgoing_[neighbour], r, flights().internal(ownership_->slot_of(r.id)));
  });
  bool room = true;
  for (const Bytes& bytes : swap())
    for (Reader reader(bytes); reader.more();) {
      const auto r = reader.get<Record<D>>();
      const auto internal = flights().has_internal() ? reader.get<Internal<D>>() : Internal<D>{};
      room = ownership_->admit(r, end_, internal) && room;
    }
  return room;
}

template class Subdomain<2>;
template class Subdomain<3>;

}  // namespace carom
