#pragma once
// What one rank does of a system that several ranks advance together.
//
// Every particle is owned by one rank, by where it is; others have copies of it, ghosts (Particles::ghost). What acts
// on a particle is computed by its owner, with all its pairs, in sums of integers, and sent to the others: the sums are
// those of one rank alone, bit for bit. What is cheap beside that each rank does for all particles that it knows.
//
// A rank knows either all particles, or its own particles and those near them. For methods that can do with these
// (Integrator::local()) it runs its ghosts like its own particles; those at the rim of what it knows may go wrong, for
// they miss partners, so it is checked that those near enough to matter did what they did at their owners'. If they did
// not, the slab is done again with more ghosts, in the end with all particles known. Particles are divided anew before
// one has come too far: each goes from its owner to the ranks that know it from then on. The system itself keeps to
// shares (engine/ranks/shares.h), which are brought up to date when an observer looks.

#include <memory>
#include <span>
#include <vector>

#include "engine/base/system.h"
#include "engine/ranks/exchange.h"

namespace carom {

template <int D>
class Division;

/// What a method keeps of each particle from slab to slab, and has to take along when it is to work for others.
template <int D>
class Luggage {
 public:
  virtual ~Luggage() = default;
  virtual void pack(Id /*i*/, Bytes& /*to*/) const {}
  /// All is packed: the memory of what it works with is needed for others until regroup().
  virtual void release() {}
  /// It works for the particles of this system from now on; unpack() follows, for each of them.
  virtual void regroup(System<D>& /*system*/) {}
  virtual void unpack(Id /*i*/, Reader& /*from*/) {}
};

/// Thrown on all ranks together, before anything of the system has changed: the particles that they know were not
/// enough for a slab. Simulation does it again with more of them.
struct HaloTooSmall {};

template <int D>
class Part {
 public:
  /// Of a system that is kept in shares, which outlives the part. `local`: a rank's own particles and those near them
  /// are enough for slabs of this length. `cores`: particles collide. Collective.
  Part(System<D>& shares, bool local, double slab_length, bool cores = true);
  ~Part();
  Part(const Part&) = delete;
  Part& operator=(const Part&) = delete;

  /// The particles that this rank knows.
  System<D>& known() { return *known_; }
  bool knows_all() const { return all_known_; }
  /// How many particles there are, known or not.
  std::size_t total() const { return shares_.size(); }

  /// At the start of a slab: says anew which rank owns each particle, by where it is, and which this rank knows, if it
  /// is time for that; returns whether it was. `local`: those are enough that own particles may meet.
  bool divide_if_due(Luggage<D>& luggage, bool local, std::int64_t slab, double slab_length);
  /// Those that are known were not enough for a slab: knows more of them, where that was what lacked, or all.
  void know_more(Luggage<D>& luggage, std::int64_t slab, double slab_length);
  /// Ghosts went wrong that matter: more of them are to be known.
  void deepen() {
    depth_ *= 2;
    more_ = true;
  }
  /// Brings the positions, velocities and images of the shares up to date. Collective.
  void collect();

  /// Whether the particles that are known are enough for paths so long in a slab, those of all ranks [length].
  bool covers(double path);
  /// The same for a step of a kick-drift-kick method. Collective.
  bool covers(const Particles<D>& p, std::span<const Vec<D>> a, double length);
  /// Whether what a ghost does matters to own particles.
  bool matters(Id i) const { return matters_[i] != 0; }

  /// Tells the others about own particles that they know: pack(i, bytes), there unpack(i, reader).
  template <class Pack, class Unpack>
  void tell(Pack&& pack, Unpack&& unpack) {
    std::vector<Bytes> outgoing(partners_.size());
    for (std::size_t k = 0; k < partners_.size(); ++k)
      for (const auto& mine = holders_[static_cast<std::size_t>(partners_[k])]; const Id i : mine) {
        pack(i, outgoing[k]);
        if (i == mine.front()) outgoing[k].reserve(mine.size() * outgoing[k].size());
      }
    const std::vector<Bytes> incoming = ranks_.swap(std::move(outgoing), partners_);
    for (std::size_t k = 0; k < partners_.size(); ++k) {
      Reader from(incoming[k]);
      for (const Id i : ghosts_[static_cast<std::size_t>(partners_[k])]) unpack(i, from);
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
  /// Where in the messages of all ranks a particle is.
  struct Arrival {
    Id id;
    std::size_t rank, at;
  };
  void divide(Luggage<D>* luggage, bool all, double slab_length);
  bool divide_some(Luggage<D>* luggage, double slab_length);
  void tell_all(Luggage<D>* luggage);
  void own_anew();
  std::vector<Bytes> pack(Luggage<D>* luggage, const std::vector<std::uint64_t>& particles, auto&& for_each_receiver);
  std::vector<Arrival> receive(const std::vector<Bytes>& messages);
  void assign(const Division<D>& division, double near);
  void unpack(Luggage<D>* luggage, const std::vector<Bytes>& messages, const std::vector<Arrival>& arrivals);
  bool outdated();

  System<D>& shares_;
  std::unique_ptr<System<D>> known_;
  bool all_known_ = false;
  TimedExchange ranks_;
  std::vector<std::vector<Id>> holders_, ghosts_;  // by rank: own particles that it knows, and ghosts of its particles
  std::vector<int> partners_;                      // the ranks of which there are any
  std::vector<char> matters_;
  std::vector<Vec<D>> at_;  // where those known were at the last division, images undone
  double path_ = 0, slack_ = 0;
  double safe_slabs_ = 0;       // until a particle may have come too far
  double wanted_path_ = 0;      // at least that, since one was too long not long ago
  bool more_ = false;           // ghosts would have been enough for the slab
  double least_depth_, depth_;  // of ghosts that do not matter [largest diameter]
  std::int64_t next_ = 0;       // while all are known: the slab before which to divide
  std::int64_t patience_ = 1;
};

}  // namespace carom
