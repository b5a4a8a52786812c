// acdda: discrete gradients on a time mesh of its own for each particle.
//
// In a slab [0, h] each particle has its own nodes, its collisions, and over each of its intervals moves with a mean
// velocity v̄ = v⁺ + I/2m, ending it with v⁻ = v⁺ + I/m. A pair applies to both partners, over each stretch [s, s'] of
// the union of their nodes, the impulse (s' − s) × (its quotient force between the separations at s and at s').
//
// Energy. Over an interval the kinetic energy changes by m v̄·(v⁻ − v⁺) = I·v̄, the sum over stretches of force · (own
// displacement). For the two partners of a pair these add up to force · (change of the separation) = −(V' − V) on every
// stretch. So kinetic plus potential energy telescopes over the slab, for any nodes whatever; collisions keep it too.
// Momentum: what one partner receives the other gives.
//
// The impulses depend on the paths and the paths on the impulses. Sweeps solve for both: sweep k runs the slab event by
// event on parabolas with the mean forces of sweep k − 1, which end where the chords end, and computes the impulses on
// the chords. (With straight flights pairs that bounce again and again make the sweeps diverge.)

#include "engine/integrators/acdda.h"

#include <algorithm>
#include <cmath>

#include "engine/error.h"
#include "engine/forces.h"
#include "engine/integrators/registry.h"
#include "engine/shared_contacts.h"

namespace carom::integrator {
namespace {

constexpr int kMostSweeps = 60;
constexpr int kPatience = 5;   // sweeps after which who has other partners than before gets a node of its own
constexpr int kMostTries = 4;  // of such nodes, before the slab is halved
constexpr int kMostPieces = 1 << 14;
constexpr double kWorstContraction = 0.5;
constexpr double kMixed = 0.2;          // contraction from which on sweeps are mixed
constexpr double kLastAtLeast = 1e-15;  // of what may be left of the impulse of a last interval (acdda_sweeps.cc)
constexpr double kStalled = 1e-13;  // where increments stop shrinking below this, rounding is amplified by collisions

}  // namespace

template <int D>
void AsynchronousDiscreteDerivative<D>::release() {
  core_.reset();
  scan_.reset();
  paths_ = Histories<D>();
  memories_ = std::vector<PairMemory<D>>(memories_.size());
  for (auto* vectors : {&impulse_, &mean_}) *vectors = std::vector<Vec<D>>();
  differences_ = std::vector<double>();
  extrapolation_.release();
}

template <int D>
void AsynchronousDiscreteDerivative<D>::regroup(System<D>& system) {
  scan_.emplace(system, max_events_);
  core_.emplace(system, *scan_, max_events_);
  others_ = PartSweeps<D>(system);
  extrapolation_.resize(system.particles.size());
  impulse_.clear();
}

template <int D>
void AsynchronousDiscreteDerivative<D>::start(System<D>& system, Counters& counters) {
  regroup(system);
  total_ = system.part ? system.part->total() : system.size();
  const auto& mass = system.particles.mass;
  std::vector<Vec<D>> a(mass.size());
  evaluate_forces<D>(system, system.particles.x, a, counters);
  for (std::size_t i = 0; i < mass.size(); ++i) a[i] /= mass[i];
  extrapolation_.start(a);
  memories_.resize(system.interactions.size());
  for (const auto& term : system.interactions) remembers_ = remembers_ && term->remembers();
}

template <int D>
void AsynchronousDiscreteDerivative<D>::slab(System<D>& system, const Slab& slab, SlabReport<D>& report) {
  counters_ = &report.counters;
  scan_->begin_slab(report.counters, report.contacts, extrapolation_.last(), slab.length);
  auto& p = system.particles;
  auto elastic = [&](const Touch<D>& touch) { collide_elastically(touch, p); };
  double done = 0, longest = slab.length;
  if (others_) {
    report.unsure = !advance_some(system, slab, report);
    return;
  }
  while (done < slab.length) {
    scan_->resolve(done, p.x, p.v, elastic);
    const double rest = slab.length - done;
    const double piece = std::min(longest, rest / std::max(1.0, std::ceil(rest / wanted_)));
    const Solution solution = solve(system, piece);
    if (!solution.settled) {
      longest = solution.cut > 0 ? solution.cut : 0.5 * piece;
      if (solution.cut > 0) {
        scan_->count_event(solution.key);
        continue;
      }
      ++report.counters.slabs_halved;
      if (longest * kMostPieces < slab.length && solution.crowd) scan_->too_many(solution.key);
      if (longest * kMostPieces < slab.length)
        throw Error(Failure::numerical, "the sweeps do not settle even in " + std::to_string(kMostPieces) +
                                            " pieces; the forces are not finite or far too stiff for step = " +
                                            std::to_string(slab.length));
      continue;
    }
    if (adaptive_ > 0 && !fits(p, piece, slab.length)) continue;
    finish(p);
    ++report.counters.pieces;
    scan_->commit(done, core_->contacts());
    if (!scan_->resting().empty()) scan_->slide(p.x, p.v);
    done = piece == rest ? slab.length : done + piece;
    longest = std::max(2 * piece, slab.length / kMostPieces);
  }
  system.wrap();
  report.reached = slab.length;
}

/// A slab in one piece, of the particles that this rank knows. False, and nothing has been done, where it takes more
/// than that: pieces, contacts at its start, acceleration, or more particles.
template <int D>
bool AsynchronousDiscreteDerivative<D>::advance_some(System<D>& system, const Slab& slab, SlabReport<D>& report) {
  auto& p = system.particles;
  if (others_.any(!scan_->quiet(p.x, p.v))) return false;
  if (!solve(system, slab.length).settled) return false;
  if (!commit_contacts<D>(system, core_->contacts(), max_events_, *counters_, report.contacts)) return false;
  finish(p);
  system.part->tell(
      [&](Id i, Bytes& to) {
        put(to, p.x[i]);
        put(to, p.v[i]);
        put(to, extrapolation_.last()[i]);
        put(to, extrapolation_.time()[i]);
      },
      [&](Id i, Reader& from) {
        p.x[i] = from.get<Vec<D>>();
        p.v[i] = from.get<Vec<D>>();
        const auto a = from.get<Vec<D>>();
        extrapolation_.add(i, a, from.get<double>());
      });
  ++counters_->pieces;
  system.wrap();
  report.reached = slab.length;
  return true;
}

/// Whether the path of a piece is as good as asked; sets the length to try next.
template <int D>
bool AsynchronousDiscreteDerivative<D>::fits(const Particles<D>& p, double piece, double slab_length) {
  const double error = path_error(p), best = 0.9 * piece * std::cbrt(adaptive_ / error);
  const bool good = error <= adaptive_ || piece * kMostPieces < slab_length;
  wanted_ = good ? std::min(best, 2 * std::max(piece, std::min(wanted_, slab_length))) : std::max(best, 0.2 * piece);
  return good;
}

/// The largest error of a position over a piece. Where the acceleration changes at the rate j, seen from one interval
/// to the next, the parabola on its mean leaves the path by j s³/12 in a time s.
template <int D>
double AsynchronousDiscreteDerivative<D>::path_error(const Particles<D>& p) const {
  const Histories<D>& paths = paths_;
  double largest = 0;
  for (Id i = 0; i < p.size(); ++i) {
    double error = 0, before = extrapolation_.time()[i];
    Vec<D> a_before = extrapolation_.last()[i];
    for (std::uint32_t n = i; n != Histories<D>::kNone; n = paths.next[n]) {
      const double s = paths.duration(n);
      const Vec<D> a = impulse_[n] / (p.mass[i] * s);
      error += (a - a_before).norm() / (0.5 * (before + s)) * (s * s * s / 12);
      a_before = a;
      before = s;
    }
    largest = std::max(largest, error);
  }
  return largest;
}

/// Sweeps over a slab from the present positions until impulses and paths agree; leaves them in paths_ and impulse_.
template <int D>
typename AsynchronousDiscreteDerivative<D>::Solution AsynchronousDiscreteDerivative<D>::solve(const System<D>& system,
                                                                                              double length) {
  using End = typename SlabRun<D>::End;
  const Stopwatch watch(counters_->seconds.sweep);
  const auto& p = system.particles;
  const std::size_t n = p.size();
  Histories<D>& paths = paths_;
  auto reset = [&] {
    paths.reset(length, p.x, p.v);
    extrapolation_.expect(length, paths.a);
  };
  reset();
  double margin = 0;
  for (Id i = 0; i < n; ++i) margin = std::max(margin, length * (p.v[i].norm() + 0.5 * length * paths.a[i].norm()));
  margin = others_.largest(margin);
  if (others_ && !system.part->covers(kRoom * margin)) return {};
  begin(system, kRoom * margin);
  extra_.clear();
  tolerance_ = std::max(kLastAtLeast, accepted_);
  bool mixes = false, first = true;
  double last_change = 0, last_unsettled = 0, earlier_unsettled = 0, last_smooth = 0, earlier_smooth = 0;
  bool more_nodes = false;             // than the sweep before had
  int tries = 0, slow = 0, since = 0;  // since: sweeps since the last node was added
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    bool late = !first && !mixes && remembers_ && scan_->resting().empty() && !more_nodes && few_;
    SlabRun<D> run;
    const bool run_late = late;
    if (late) {
      run = core_->repair(paths, rule_, extra_, unsettled_);
      late = run.end != End::lost;
    }
    if (!late) {
      rule_.follow(first, n);
      run = core_->run(paths, rule_, extra_);
    }
    if (others_ && others_.any(run.end != End::complete || late != run_late)) return {};
    if (run.end == End::cut) return {.cut = run.time, .key = run.key};
    if (run.end == End::crowded) return {.crowd = true, .key = run.key};
    if (run.end == End::strayed) {
      if (!std::isfinite(run.margin)) return {};
      begin(system, kRoom * run.margin);
      reset();
      first = true;
      continue;
    }
    more_nodes = false;
    const bool alike = !first && !others_.any(!all_alike(paths, late));
    Change change;
    if (late) {
      reevaluate(system);
      change = compare_some(p);
    } else {
      evaluate(system);
      if (mixes) mix(p, alike);
      change = compare_all(p, mixes ? 0 : last_change, mixes);
    }
    if (change.lost) {
      system.part->deepen();
      return {};
    }
    if (change.settled) return {.settled = true};
    if (!std::isfinite(change.largest)) return {};
    const bool patient = ++since > kPatience;
    const bool crawls = since > 2 && change.unsettled > kWorstContraction * kWorstContraction * earlier_unsettled;
    if (crawls && change.unsettled <= kStalled * change.speed) return {.settled = true};
    slow = crawls ? slow + 1 : 0;
    if (!mixes && alike && since > 2 &&
        change.smooth > std::max(kMixed * kMixed * earlier_smooth, 0.1 * change.unsettled)) {
      if (others_) return {};
      mixes = true;
      since = slow = 0;
      mixing_.clear();
      ++counters_->fallbacks;
    }
    const bool parted = (patient || slow > 2) && !first && separate(late);
    if (parted || (slow > 2 && steady(p, change))) {
      more_nodes = true;
      since = slow = 0;
      if (++tries > kMostTries) return {};
    } else if (slow > 2) {
      return {};
    }
    earlier_unsettled = last_unsettled;
    last_unsettled = change.unsettled;
    earlier_smooth = last_smooth;
    last_smooth = change.smooth;
    last_change = change.largest;
    first = false;
  }
  return {};
}

template <int D>
void AsynchronousDiscreteDerivative<D>::begin(const System<D>& system, double margin) {
  core_->begin(system.particles.x, margin);
  for (const auto& term : system.interactions) term->begin_slab(system.particles.x, margin);
  for (auto& memory : memories_) memory.clear();
  pairs_ = 0;
}

/// Whether everybody has the same partners as in the sweep before; after a repair the others have anyway.
template <int D>
bool AsynchronousDiscreteDerivative<D>::all_alike(const Histories<D>& paths, bool repaired) const {
  const auto same = [&](Id i) { return !others_.counts(i) || same_meetings(paths, i); };
  if (repaired) return std::ranges::all_of(core_->awake(), same);
  return std::ranges::all_of(paths.noded(), same) && std::ranges::all_of(paths.had_nodes(), same);
}

/// Moves the particles to the end of the slab: last intervals with the newest impulses. What inner ones lack of
/// theirs is added to the last velocity, so that no momentum is lost.
template <int D>
void AsynchronousDiscreteDerivative<D>::finish(Particles<D>& p) {
  const Histories<D>& paths = paths_;
  extrapolation_.pass(paths.length);
  for (Id i = 0; i < p.size(); ++i) {
    if (!others_.counts(i)) continue;
    const double mass = p.mass[i];
    Vec<D> lacking = Vec<D>::Zero();
    std::uint32_t n = i;
    for (; paths.next[n] != Histories<D>::kNone; n = paths.next[n])
      lacking += impulse_[n] / mass - (paths.velocity_in(n, paths.end(n)) - paths.v[n]);
    const double time = paths.duration(n);
    p.x[i] = paths.x[n] + time * (paths.v[n] + impulse_[n] / (2 * mass));
    p.v[i] = paths.v[n] + impulse_[n] / mass + lacking;
    extrapolation_.add(i, impulse_[n] / (mass * time), time);
  }
}

template class AsynchronousDiscreteDerivative<2>;
template class AsynchronousDiscreteDerivative<3>;

IntegratorInfo acdda() {
  return {
      .name = "acdda",
      .title = "Asynchronous Collision Discrete Derivative Algorithm",
      .order = "2",
      .conserves = "energy and linear momentum to rounding, for any step; angular momentum in slabs without collisions",
      .parameters = {parameter::step(),
                     {.name = "tolerance",
                      .type = Parameter::Type::real,
                      .fallback = "none",
                      .unit = "-",
                      .meaning =
                          "what sweeps may leave of an impulse, as a velocity and relative to the fastest; trades "
                          "exact energy for fewer force passes; absent: rounding",
                      .range = Parameter::Range::positive},
                     {.name = "adaptive",
                      .type = Parameter::Type::real,
                      .fallback = "none",
                      .unit = "length",
                      .meaning = "cuts steps into pieces so short that the estimated error of a position in a piece "
                                 "stays below this; absent: steps are not cut",
                      .range = Parameter::Range::positive},
                     parameter::max_events_per_step()},
      .documentation =
          "Discrete-gradient steps in which each particle has a time mesh of its own: a collision cuts the step of "
          "the colliders only, and the energy is exact for any meshes. Steps are solved by sweeps, each of which "
          "costs a force pass at most and its collisions, whatever the number of particles. Where the forces are stiff "
          "the sweeps are mixed (Anderson 1965).",
      .source =
          "this project; relatives: Lew, Marsden, Ortiz, West, Arch. Ration. Mech. Anal. 167 (2003) 85; Logg, SIAM "
          "J. Sci. Comput. 24 (2003) 1879; Gonzalez, J. Nonlinear Sci. 6 (1996) 449",
      .in_2d = make<AsynchronousDiscreteDerivative, 2>,
      .in_3d = make<AsynchronousDiscreteDerivative, 3>};
}

}  // namespace carom::integrator
