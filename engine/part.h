#pragma once
// What one rank does of a system that several ranks advance together.
//
// Every particle is owned by one rank, by where it is; others have copies of it, ghosts (Particles::ghost). What acts
// on a particle is computed by its owner, with all its pairs in the order of their ids, and told to the others: the
// sums are those of one rank alone, bit for bit. What is cheap beside that everybody does for the particles he knows.
//
// A rank knows either everybody, or its own particles and those near them. For methods that can do with these
// (Integrator::local()) it runs its ghosts like its own particles; those at the rim of what it knows may go wrong, for
// they miss partners, so it is checked that those near enough to matter did what they did at their owners'. If they did
// not, the slab is done again with everybody known. Particles are divided anew before anybody has come too far.

#include <memory>
#include <span>
#include <vector>

#include "engine/exchange.h"
#include "engine/system.h"

namespace carom {

/// What a method keeps of each particle from slab to slab, and has to take along when it is to work for others.
template <int D>
class Luggage {
 public:
  virtual ~Luggage() = default;
  virtual void pack(Id /*i*/, Bytes& /*to*/) const {}
  /// It works for the particles of this system from now on; unpack() follows, for each of them.
  virtual void regroup(System<D>& /*system*/) {}
  virtual void unpack(Id /*i*/, Reader& /*from*/) {}
};

template <int D>
class Part {
 public:
  /// Every rank has the same system; it and `ranks` outlive the part. Everybody is known at first.
  Part(System<D>& whole, Exchange& ranks);
  ~Part();
  Part(const Part&) = delete;
  Part& operator=(const Part&) = delete;

  /// The particles that this rank knows.
  System<D>& known() { return some_ ? *some_ : whole_; }
  bool knows_everybody() const { return !some_; }

  /// At the start of a slab: says anew who owns whom, by where everybody is, and whom this rank knows, if it is time
  /// for that; returns whether it was. `local`: those are enough that own particles may meet.
  bool divide_if_due(Luggage<D>& luggage, bool local, std::int64_t slab, double slab_length);
  /// Those who are known were not enough for a slab.
  void know_everybody(Luggage<D>& luggage, std::int64_t slab);
  /// Ghosts went wrong that matter: next time more of them are to be known.
  void deepen() { depth_ *= 2; }
  /// Brings positions, velocities and images of the whole system up to date, on all ranks.
  void collect();

  /// Whether the particles that are known are enough for paths so long in a slab [length].
  bool covers(double path) { return !some_ || largest(path) <= path_; }
  /// The same for a step of a kick-drift-kick method.
  bool covers(const Particles<D>& p, std::span<const Vec<D>> a, double length);
  /// Whether what a ghost does matters to own particles.
  bool matters(Id i) const { return matters_.empty() || matters_[i] != 0; }

  /// Tells the others about own particles that they know: pack(i, bytes), there unpack(i, reader).
  template <class Pack, class Unpack>
  void tell(Pack&& pack, Unpack&& unpack) {
    std::vector<Bytes> outgoing(holders_.size());
    for (std::size_t rank = 0; rank < holders_.size(); ++rank)
      for (const Id i : holders_[rank]) pack(i, outgoing[rank]);
    const std::vector<Bytes> incoming = ranks_.swap(std::move(outgoing));
    for (std::size_t rank = 0; rank < incoming.size(); ++rank) {
      Reader from(incoming[rank]);
      for (const Id i : ghosts_[rank]) unpack(i, from);
    }
  }
  /// Ghosts get the vectors of their owners.
  void refresh(std::span<Vec<D>> vectors) {
    tell([&](Id i, Bytes& to) { put(to, vectors[i]); },
         [&](Id i, Reader& from) { vectors[i] = from.template get<Vec<D>>(); });
  }

  Exchange& ranks() { return ranks_; }
  double largest(double value) {
    ranks_.largest({&value, 1});
    return value;
  }
  double seconds_waited() const { return ranks_.seconds(); }  ///< for other ranks

 private:
  /// Where in the messages of all ranks a particle's luggage is.
  struct Place {
    std::size_t rank, at;
  };
  std::vector<Bytes> gather_state(const Luggage<D>* luggage, std::vector<Place>* places);
  void divide(Luggage<D>& luggage, bool everybody, double slab_length);
  bool choose(double slab_length);
  void choose_everybody();
  bool outdated();
  std::size_t total() const { return whole_.particles.size(); }

  System<D>& whole_;
  std::unique_ptr<System<D>> some_;
  TimedExchange ranks_;
  std::vector<std::vector<Id>> holders_, ghosts_;  // by rank: own particles that it knows, and ghosts of its particles
  std::vector<char> matters_;
  std::vector<Vec<D>> at_;  // where everybody was at the last division, images undone
  double path_ = 0, slack_ = 0;
  double depth_;           // of ghosts that do not matter [largest diameter]
  std::int64_t next_ = 0;  // while everybody is known: the slab before which to divide
  std::int64_t patience_ = 1;
};

}  // namespace carom
