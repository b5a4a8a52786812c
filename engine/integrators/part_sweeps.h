#pragma once
// What acva and acdda tell other ranks about a slab when each of them knows only the particles near its own
// (engine/part.h).
//
// After a run owners tell a digest of the events on their particles' paths, and in sweeps what these received; whoever
// has a copy that matters compares. A method alone, or one that knows everybody, asks and tells nothing.

#include <bit>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "engine/histories.h"
#include "engine/integrators/digest.h"
#include "engine/part.h"

namespace carom::integrator {

template <int D>
class PartSweeps {
 public:
  PartSweeps() = default;
  /// The system outlives this.
  explicit PartSweeps(const System<D>& system)
      : particles_(&system.particles), part_(system.part), some_(part_ && !part_->knows_everybody()) {}

  /// Whether this rank knows only some of the particles.
  explicit operator bool() const { return some_; }
  /// Whether what particle i does counts here.
  bool counts(Id i) const { return !some_ || particles_->owns(i); }

  /// Of all ranks, where each knows only some; else all know.
  double largest(double value) const { return some_ ? part_->largest(value) : value; }
  bool any(bool value) const { return some_ ? part_->largest(value ? 1 : 0) > 0 : value; }
  void largest(std::span<double> values) const {
    for (double& value : values)
      if (std::isnan(value)) value = std::numeric_limits<double>::infinity();
    if (some_) part_->ranks().largest(values);
  }
  Exchange& ranks() const { return part_->ranks(); }

  /// Whether on all ranks all ghosts that matter did what they did at their owners'. Collective.
  bool agree(const Histories<D>& paths) const {
    bool agreed = true;
    part_->tell([&](Id i, Bytes& to) { put(to, digest_with_flight(paths, i)); },
                [&](Id i, Reader& from) {
                  const bool same = from.get<std::uint64_t>() == digest_with_flight(paths, i);
                  agreed = agreed && (same || !part_->matters(i));
                });
    return !any(!agreed);
  }

  /// Gives ghosts the impulses of their owners; returns whether all that matter did what they did there. Ghosts whose
  /// impulses are other than before are appended to `changed`.
  bool refresh(const Histories<D>& paths, std::vector<Vec<D>>& impulse, std::vector<Id>& changed) const {
    bool agreed = true;
    part_->tell(
        [&](Id i, Bytes& to) {
          put(to, digest(paths, i));
          std::uint32_t intervals = 0;
          for (std::uint32_t n = i; n != Histories<D>::kNone; n = paths.next[n]) ++intervals;
          put(to, intervals);
          for (std::uint32_t n = i; n != Histories<D>::kNone; n = paths.next[n]) put(to, impulse[n]);
        },
        [&](Id i, Reader& from) {
          const bool same = from.get<std::uint64_t>() == digest(paths, i);
          if (!same && part_->matters(i)) agreed = false;
          bool differs = false;
          std::uint32_t n = i;
          for (auto intervals = from.get<std::uint32_t>(); intervals > 0; --intervals) {
            const auto theirs = from.get<Vec<D>>();
            if (n == Histories<D>::kNone) continue;  // at the rim: some events are missing here
            differs = differs || impulse[n] != theirs;
            impulse[n] = theirs;
            n = paths.next[n];
          }
          if (differs) changed.push_back(i);
        });
    return agreed;
  }

 private:
  /// Of the events on a path, and where it leads.
  std::uint64_t digest(const Histories<D>& paths, Id i) const {
    if (paths.simple(i)) return 0;
    std::uint64_t sum = 1;
    std::uint32_t last = i;
    for (std::uint32_t n = paths.next[i]; n != Histories<D>::kNone; n = paths.next[n]) {
      mix(sum, paths.opening(n), *particles_);
      last = n;
    }
    for (int k = 0; k < D; ++k) {
      mix(sum, std::bit_cast<std::uint64_t>(paths.x[last][k]));
      mix(sum, std::bit_cast<std::uint64_t>(paths.v[last][k]));
    }
    return sum;
  }
  /// Also of the acceleration after the last event.
  std::uint64_t digest_with_flight(const Histories<D>& paths, Id i) const {
    std::uint64_t sum = digest(paths, i);
    if (sum != 0)
      for (int k = 0; k < D; ++k) mix(sum, std::bit_cast<std::uint64_t>(paths.a[paths.last[i]][k]));
    return sum;
  }

  const Particles<D>* particles_ = nullptr;
  Part<D>* part_ = nullptr;
  bool some_ = false;
};

}  // namespace carom::integrator
