#pragma once
// What one rank does of a system that several ranks advance together.
//
// Every particle is owned by one rank, by where it is; the others have copies of it, ghosts (Particles::ghost). What
// acts on a particle is computed by its owner, with all its pairs in the order of their ids, and told to the others:
// the sums are those of one rank alone, bit for bit. What is cheap beside that everybody does for everybody.

#include <span>
#include <vector>

#include "engine/box.h"
#include "engine/exchange.h"
#include "engine/particles.h"

namespace carom {

template <int D>
class Part {
 public:
  /// Every rank has the same particles; they, the box and `ranks` outlive the part.
  Part(const Box<D>& box, Particles<D>& particles, Exchange& ranks);

  /// Says anew who owns whom, by where everybody is.
  void divide();

  /// The vectors of each of `who` become those that its owner has; of(i, visit) calls visit(vector) for each of
  /// particle i. The ranks speak of the same particles.
  template <class Of>
  void refresh(std::span<const Id> who, Of&& of) {
    Bytes mine;
    for (const Id i : who)
      if (particles_.owns(i)) of(i, [&](const Vec<D>& vector) { put(mine, vector); });
    const std::vector<Bytes> all = ranks_.gather(mine);
    std::vector<Reader> from(all.begin(), all.end());
    for (const Id i : who)
      if (!particles_.owns(i)) of(i, [&](Vec<D>& vector) { vector = from[owner_[i]].template get<Vec<D>>(); });
  }
  /// The same of one vector a particle, for everybody.
  void refresh(std::span<Vec<D>> vectors) {
    refresh(everybody_, [&](Id i, auto&& visit) { visit(vectors[i]); });
  }

  /// Makes each count the sum over all ranks.
  void sum(std::span<std::uint64_t> counts) { ranks_.sum(counts); }
  /// What every rank has to say, by rank.
  std::vector<Bytes> gather(const Bytes& mine) { return ranks_.gather(mine); }

  const std::vector<Id>& everybody() const { return everybody_; }
  double seconds_waited() const { return ranks_.seconds(); }  ///< for other ranks

 private:
  const Box<D>& box_;
  Particles<D>& particles_;
  TimedExchange ranks_;
  std::vector<Id> everybody_;
  std::vector<std::uint32_t> owner_;  // by particle: the rank
};

}  // namespace carom
