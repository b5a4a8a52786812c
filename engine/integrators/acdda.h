#pragma once
// acdda: discrete gradients on a time mesh of its own for each particle; acdda.cc tells how it works.

#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "engine/integrator.h"
#include "engine/integrators/extrapolation.h"
#include "engine/integrators/mixing.h"
#include "engine/integrators/part_sweeps.h"
#include "engine/integrators/sweep_rule.h"
#include "engine/slab_core.h"

namespace carom::integrator {

template <int D>
class AsynchronousDiscreteDerivative : public Integrator<D> {
 public:
  explicit AsynchronousDiscreteDerivative(const Parameters& parameters)
      : max_events_(static_cast<std::uint64_t>(parameters.integer("max_events_per_step"))),
        accepted_(parameters.has("tolerance") ? parameters.real("tolerance") : 0),
        adaptive_(parameters.has("adaptive") ? parameters.real("adaptive") : 0) {}

  bool local() const override { return adaptive_ == 0; }
  void pack(Id i, Bytes& to) const override { extrapolation_.pack(i, to); }
  void unpack(Id i, Reader& from) override { extrapolation_.unpack(i, from); }
  void release() override;
  void regroup(System<D>& system) override;
  void start(System<D>& system, Counters& counters) override;
  void slab(System<D>& system, const Slab& slab, SlabReport<D>& report) override;

 private:
  struct Solution {
    bool settled = false;
    double cut = 0;      ///< > 0: the slab must end there for everybody, by this event
    bool crowd = false;  ///< there were too many events, this one among them
    EventKey<D> key{};
  };

  bool advance_some(System<D>& system, const Slab& slab, SlabReport<D>& report);
  bool fits(const Particles<D>& p, double piece, double slab_length);
  double path_error(const Particles<D>& p) const;
  Solution solve(const System<D>& system, double length);
  void begin(const System<D>& system, double margin);
  bool all_alike(const Histories<D>& paths, bool repaired) const;
  void evaluate(const System<D>& system);
  void reevaluate(const System<D>& system);
  void refresh(const System<D>& system, PairCounts& counts, bool some);
  void count(std::uint64_t evaluations);
  void hold(const System<D>& system, const Histories<D>& paths);
  void mix(const Particles<D>& p, bool alike);

  /// What a sweep has changed, of all particles.
  struct Change {
    double largest = 0;       ///< of an impulse from the one flown on, as a velocity
    double unsettled = 0;     ///< the same among those who have not settled
    double smooth = 0;        ///< and have no inner nodes
    double speed = 0;         ///< of the system
    std::uint64_t count = 0;  ///< of those who have not settled
    bool settled = true;
    bool lost = false;  ///< ghosts did not do what they should have
    void note(double difference) { largest = difference > largest || std::isnan(difference) ? difference : largest; }
  };

  double difference(const Particles<D>& p, Id i, std::uint32_t n) const;
  Change compare_all(const Particles<D>& p, double last_change, bool mixes);
  void agree_on(Change& change);
  Change compare_some(const Particles<D>& p);
  void settle(const Particles<D>& p, Id i, double first, Eigen::Index* mixed, Change& change);
  bool separate(bool repaired);
  bool steady(const Particles<D>& p, const Change& change);
  void finish(Particles<D>& p);

  static constexpr std::size_t kFew = 8;  // a repair pays where no more than one in so many changes
  static constexpr double kRoom = 1.25;   // margins in units of the farthest path

  std::uint64_t max_events_;
  double accepted_;  // for what the sweeps may leave, relative; 0: rounding
  double adaptive_;  // local error of paths that pieces are fitted to; 0: they are not
  double wanted_ = std::numeric_limits<double>::infinity();  // length of the next piece
  std::optional<ContactScan<D>> scan_;
  std::optional<SlabCore<D>> core_;
  Extrapolation<D> extrapolation_;
  SweepRule<D> rule_;
  Histories<D> paths_;
  std::vector<Vec<D>> impulse_, mean_;
  std::vector<double> differences_;     // of first intervals, from what was flown on
  std::vector<Id> unsettled_;           // after a sweep
  std::vector<Id> changed_, affected_;  // by a repair; affected: with the partners of the changed
  PartSweeps<D> others_;
  std::vector<Id> told_;     // ghosts whose impulses the last sweep changed
  bool agreed_ = true;       // with the owners of ghosts, after the last sweep
  bool few_ = false;         // of all have not settled
  std::uint64_t total_ = 0;  // particles, of all ranks
  bool remembers_ = true;    // what pairs receive: every interaction
  std::vector<PairMemory<D>> memories_;
  std::vector<ExtraNode> extra_;
  std::uint64_t pairs_ = 0;  // within reach
  double tolerance_ = 0;     // of last intervals, relative
  double speed_ = 0;         // of the system, at the last sweep of everybody
  Mixing mixing_;
  Counters* counters_ = nullptr;
};

}  // namespace carom::integrator
