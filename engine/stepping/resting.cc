// SPDX-License-Identifier: BSD-3-Clause
#include "engine/stepping/resting.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "engine/base/particles.h"

namespace carom {
namespace {

// The proximal terms, added to a diagonal of ones. The first term makes all pivots similar, so that few exchanges find
// the contacts under pressure; the last is 10⁶ times the rounding of the factors, and small compared with the smallest
// relevant eigenvalue, so that each repetition reduces the error by several digits.
constexpr double kFirstProximal = 1e-2, kProximalRatio = 0.03, kLastProximal = 1e-10;
constexpr int kRepetitions = 400;
constexpr int kBeforeLowering = 4;  // repetitions with a raised proximal term, before a lower one is tried again
// A solution is sought to the rounding of the two spheres of each contact. In a cluster with light loads beside heavy
// ones this may be less than the rounding of the factors; then a solution is accepted that would also be kept.
constexpr int kStrictRepetitions = 8;
// Corrections with the factors of an earlier solution: each error must be at most kContraction of the one before.
constexpr int kCorrections = 12;
constexpr double kContraction = 0.2;
constexpr int kExchanges = 50;
constexpr int kFruitlessExchanges = 5;  // of all wrong contacts, before only one is exchanged at a time
// Coming near through the interior: the most rounds; the share of the way to the boundary that a step goes; a proximal
// term of 10⁴ roundings, since the matrix may be singular; the distances, relative to the largest gap, at which it is
// tried whether the contacts under pressure are known.
constexpr int kRounds = 50;
constexpr double kInside = 0.99, kInteriorProximal = 1e-12, kClose[] = {1e-7, 1e-10};
constexpr double kFewRoundings = 8 * std::numeric_limits<double>::epsilon();  // relative error of a sum of a few terms
constexpr double kMostStretched = 0.1;  // of the kinetic energy: the turn of a sliding pair takes less
constexpr int kWall = -1;               // in place of a second body

using Factors = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>;

}  // namespace

/// The contacts of a system, with the spheres that they act on.
template <int D>
class ReactionSolver<D>::Problem {
 public:
  /// `tied`: the contacts may neither approach nor open.
  Problem(std::span<const RestingContact<D>> contacts, const std::vector<double>& mass, bool tied) : tied_(tied) {
    std::vector<int> place(mass.size(), kWall);  // by particle: its place in bodies_
    for (const auto& contact : contacts) {
      place[contact.key.lo] = 0;
      if (pair(contact)) place[contact.key.hi] = 0;
    }
    for (Id id = 0; id < place.size(); ++id) {
      if (place[id] == kWall) continue;
      place[id] = static_cast<int>(bodies_.size());
      bodies_.push_back({id, 1 / mass[id], moving_mass(mass[id])});
    }
    for (const auto& contact : contacts) {
      keys_.push_back(contact.key);
      arms_.push_back({place[contact.key.lo], pair(contact) ? place[contact.key.hi] : kWall});
    }
    find_clusters();
  }

  /// Whether these are the contacts that the problem was made for.
  bool suits(std::span<const RestingContact<D>> contacts) const {
    return std::ranges::equal(contacts, keys_, {}, &RestingContact<D>::key);
  }

  /// Starts with these normals, bounds and reactions of the contacts.
  void begin(std::span<RestingContact<D>> contacts, std::span<Vec<D>> w) {
    contacts_ = contacts;
    w_ = w;
    for (int k = 0; k < size(); ++k) {
      const double of_hi = arms_[k].hi == kWall ? 0.0 : bodies_[arms_[k].hi].inverse_mass;
      const double inverse_mass = bodies_[arms_[k].lo].inverse_mass + of_hi;
      arms_[k].scale = std::sqrt(contacts[k].normal.squaredNorm() * inverse_mass);
    }
  }

  /// Solves each cluster that is not solved yet, and adds the effect of the reactions to w.
  bool solve(double* lost) {
    bool solved = true;
    if (const std::vector<int> all = everything(); !settled(all, true)) {
      for (Cluster& cluster : clusters_) solved &= settled(cluster.contacts, true) || solve(cluster);
      push(all);
    }
    for (const Body& body : bodies_) {
      const Vec<D> before = w_[body.id];
      w_[body.id] += body.shift;
      if (lost) *lost -= 0.5 * body.mass * body.shift.dot(before + w_[body.id]);
    }
    return solved;
  }

  /// Solves for velocities and conserves their kinetic energy: the motion of a cluster is rescaled relative to its
  /// centre of mass, and along the axes of walls that it touches relative to the walls. Returns the energy that is
  /// still missing.
  double solve_and_stretch() {
    if (settled(everything(), true)) {
      for (const Body& body : bodies_) w_[body.id] += body.shift;
      return 0;
    }
    double lacks = 0;
    for (Cluster& each : clusters_) {
      const std::vector<int>& cluster = each.contacts;
      if (!settled(cluster, true)) solve(each);
      push(cluster);
      std::vector<int> bodies;
      Vec<D> free = Vec<D>::Ones(), momentum = Vec<D>::Zero();  // free: 0 along axes of walls that the cluster touches
      for (const int k : cluster) {
        if (arms_[k].hi == kWall) free = (contacts_[k].normal.array() == 0).select(free, 0);
        for (const int b : {arms_[k].lo, arms_[k].hi})
          if (b != kWall) bodies.push_back(b);
      }
      std::ranges::sort(bodies);
      bodies.erase(std::unique(bodies.begin(), bodies.end()), bodies.end());
      double mass = 0, lost = 0, kinetic = 0;
      for (const int b : bodies) {
        Vec<D>& v = w_[bodies_[b].id];
        const Vec<D> after = v + bodies_[b].shift;
        const double m = bodies_[b].mass;
        lost -= 0.5 * m * bodies_[b].shift.dot(v + after);
        if (m == 0) free.setZero();  // a fixed sphere
        mass += m;
        momentum += m * after;
        v = after;
      }
      Vec<D> centre = free.cwiseProduct(momentum) / mass;
      bool carried = false;  // by a moving wall
      for (const int k : cluster) {
        const auto& [key, normal, speed, slack, lambda, force] = contacts_[k];
        if (arms_[k].hi != kWall || speed == 0) continue;
        carried = true;
        centre += (speed - normal.dot(centre)) * normal;
      }
      for (const int b : bodies) kinetic += 0.5 * bodies_[b].mass * (w_[bodies_[b].id] - centre).squaredNorm();
      if (!(std::abs(lost) <= kMostStretched * kinetic)) {
        lacks += lost;
        continue;
      }
      if (lost == 0) continue;
      const double share = lost / kinetic, stretch = share / (1 + std::sqrt(1 + share));
      for (const int b : bodies) {
        if (bodies_[b].mass == 0) continue;
        const Vec<D> more = stretch * (w_[bodies_[b].id] - centre);
        w_[bodies_[b].id] += more;
        if (carried) lacks -= bodies_[b].mass * more.dot(centre);
      }
    }
    return lacks;
  }

 private:
  struct Body {
    Id id;
    double inverse_mass, mass;      // 0, both, of a fixed sphere
    Vec<D> shift = Vec<D>::Zero();  // of w, by the reactions
    double size = 0;                // Σ |term| of w + shift
    std::vector<int> contacts{};
  };
  struct Arm {
    int lo, hi;        // indices into bodies_; hi: kWall at a wall
    double scale = 1;  // square root of the diagonal of N M⁻¹ Nᵀ, which the problem is scaled with
  };
  /// Contacts that shared spheres connect.
  struct Cluster {
    std::vector<int> contacts;           // ascending
    Eigen::SparseMatrix<double> all{};   // the lower half of its scaled matrix
    std::unique_ptr<Factors> factors{};  // null: the order of elimination is not known
    std::vector<char> factored{};        // by contact: whether it is in the matrix of `factors`
    Eigen::VectorXd added{};             // to the diagonal of this matrix
  };

  std::vector<int> everything() const {
    std::vector<int> all(size());
    std::iota(all.begin(), all.end(), 0);
    return all;
  }
  static bool pair(const RestingContact<D>& contact) { return contact.key.kind == EventKind::pair; }
  int size() const { return static_cast<int>(arms_.size()); }

  void find_clusters() {
    for (int k = 0; k < size(); ++k)
      for (const int body : {arms_[k].lo, arms_[k].hi})
        if (body != kWall && bodies_[body].mass > 0) bodies_[body].contacts.push_back(k);
    std::vector<char> seen(size(), 0);
    for (int first = 0; first < size(); ++first) {
      if (seen[first]) continue;
      std::vector<int> cluster{first};
      seen[first] = 1;
      for (std::size_t at = 0; at < cluster.size(); ++at)
        for (const int body : {arms_[cluster[at]].lo, arms_[cluster[at]].hi}) {
          if (body == kWall) continue;
          for (const int k : bodies_[body].contacts)
            if (!std::exchange(seen[k], 1)) cluster.push_back(k);
        }
      std::ranges::sort(cluster);
      clusters_.push_back({std::move(cluster)});
    }
  }

  /// Computes the shifts that the reactions of a cluster cause.
  void push(const std::vector<int>& cluster) {
    const auto each_body = [&](int k, auto&& visit) {
      visit(bodies_[arms_[k].lo], 1.0);
      if (arms_[k].hi != kWall) visit(bodies_[arms_[k].hi], -1.0);
    };
    for (const int k : cluster)
      each_body(k, [&](Body& body, double) {
        body.shift.setZero();
        body.size = w_[body.id].norm();
      });
    for (const int k : cluster) {
      const double lambda = contacts_[k].lambda;
      if (lambda == 0) continue;
      each_body(k, [&](Body& body, double sign) {
        body.shift += (sign * lambda * body.inverse_mass) * contacts_[k].normal;
        body.size += std::abs(lambda) * body.inverse_mass * contacts_[k].normal.norm();
      });
    }
  }
  /// n·(w_lo − w_hi) less the bound.
  double excess(int k) const {
    const auto& [lo, hi, scale] = arms_[k];
    Vec<D> w = w_[bodies_[lo].id] + bodies_[lo].shift;
    if (hi != kWall) w -= w_[bodies_[hi].id] + bodies_[hi].shift;
    return contacts_[k].normal.dot(w) - contacts_[k].bound;
  }
  double tolerance(int k) const {
    const auto& [lo, hi, scale] = arms_[k];
    const double size = bodies_[lo].size + (hi != kWall ? bodies_[hi].size : 0.0);
    return kFewRoundings * (contacts_[k].normal.norm() * size + std::abs(contacts_[k].bound));
  }
  /// Whether the reactions of a cluster solve the problem.
  bool settled(const std::vector<int>& cluster, bool with_slack = false) {
    push(cluster);
    return std::ranges::all_of(cluster, [&](int k) {
      const double over = excess(k), allowed = std::max(tolerance(k), with_slack ? contacts_[k].slack : 0.0);
      return over >= -allowed && ((!tied_ && contacts_[k].lambda == 0) || over <= allowed);
    });
  }

  /// Tries the last reactions. Where they are of no use, it comes near the solution through the interior, which tells
  /// which contacts are under pressure.
  bool solve(Cluster& which) {
    const std::vector<int>& cluster = which.contacts;
    const int m = static_cast<int>(cluster.size());
    std::vector<double> start(m);
    for (int k = 0; k < m; ++k) start[k] = contacts_[cluster[k]].lambda;
    if (correct(which, start)) return true;
    arrange(which);
    if (solve(which, start, kLastProximal, false)) return true;
    const Eigen::VectorXd gap = gaps(cluster);
    Eigen::VectorXd reaction = Eigen::VectorXd::Constant(m, gap.cwiseAbs().maxCoeff()), opening = reaction;
    for (const double close : kClose) {
      if (tied_) break;
      if (!approach(which, gap, close, reaction, opening)) break;
      for (int k = 0; k < m; ++k) start[k] = reaction[k] > opening[k] ? reaction[k] / arms_[cluster[k]].scale : 0;
      if (solve(which, start, kLastProximal, close == kClose[1])) return true;
    }
    return solve(which, std::vector<double>(m, 0.0), kFirstProximal, true);
  }

  /// Corrects known reactions with the factors of an earlier solution, where the same contacts were under pressure and
  /// had nearly the same normals. Returns false if this does not lead to a solution soon.
  bool correct(Cluster& which, std::vector<double> reaction) {
    const std::vector<int>& cluster = which.contacts;
    const int m = static_cast<int>(cluster.size());
    if (which.factored.empty() || !(which.added.array() == kLastProximal).all()) return false;
    for (int k = 0; k < m; ++k)
      if (which.factored[k] != (reaction[k] > 0)) return false;
    bool solved = false;
    double last = std::numeric_limits<double>::infinity();
    Eigen::VectorXd off(m);
    for (int correction = 0; correction < kCorrections; ++correction) {
      for (int k = 0; k < m; ++k) off[k] = which.factored[k] ? -excess(cluster[k]) / arms_[cluster[k]].scale : 0;
      const double size = off.norm();
      if (!solved && !(size <= kContraction * last)) return false;
      last = size;
      const Eigen::VectorXd more = which.factors->solve(off);
      for (int k = 0; k < m; ++k) {
        reaction[k] += more[k] / arms_[cluster[k]].scale;
        if (!(reaction[k] >= 0)) return false;
        contacts_[cluster[k]].lambda = reaction[k];
      }
      if (std::exchange(solved, settled(cluster)) && solved) return true;
    }
    return false;
  }

  /// How fast the contacts open without reactions, which are set to zero.
  Eigen::VectorXd gaps(const std::vector<int>& cluster) {
    Eigen::VectorXd gap(static_cast<Eigen::Index>(cluster.size()));
    for (const int k : cluster) contacts_[k].lambda = 0;
    push(cluster);
    for (Eigen::Index k = 0; k < gap.size(); ++k) gap[k] = excess(cluster[k]) / arms_[cluster[k]].scale;
    return gap;
  }

  /// Starts from these reactions. If all are zero, it starts from the contacts that approach or were under pressure in
  /// the last piece, and with the first proximal term from all contacts. Where pivoting makes no progress, the proximal
  /// term is raised; if the start is of no use at all, only where it `insists`.
  bool solve(Cluster& which, const std::vector<double>& start, double proximal, bool insists) {
    const std::vector<int>& cluster = which.contacts;
    const int m = static_cast<int>(cluster.size());
    const bool known = std::ranges::any_of(start, [](double lambda) { return lambda > 0; });
    const bool all = tied_ || proximal == kFirstProximal;
    Eigen::VectorXd reaction(m), before(m);
    const Eigen::VectorXd gap = gaps(cluster);
    active_.assign(m, 0);
    for (int k = 0; k < m; ++k) {
      reaction[k] = start[k] * arms_[cluster[k]].scale;
      active_[k] = all || (known ? start[k] > 0 : gap[k] < 0 || contacts_[cluster[k]].force > 0);
    }
    bool solved = false;
    double lowest = kLastProximal;
    int raised = 0;  // in this repetition
    for (int repetition = 0; repetition < kRepetitions; ++repetition) {
      before = reaction;
      proximal_ = proximal;
      const std::vector<char> active = active_;
      if (!pivot(which, gap, before, reaction, proximal == kFirstProximal)) {
        if ((repetition == 0 && !insists) || proximal == kFirstProximal) return false;
        reaction = before;
        active_ = active;
        proximal = lowest = std::min(proximal / kProximalRatio, kFirstProximal);
        raised = repetition;
        continue;
      }
      for (int k = 0; k < m; ++k) contacts_[cluster[k]].lambda = reaction[k] / arms_[cluster[k]].scale;
      // One more repetition: beside the large terms of a light sphere the error of a heavy one is invisible.
      if (std::exchange(solved, settled(cluster)) && solved) return true;
      if (repetition >= kStrictRepetitions && settled(cluster, true)) return true;
      if (repetition - raised == kBeforeLowering) {
        lowest = std::max(kProximalRatio * lowest, kLastProximal);
        raised = repetition;
      }
      proximal = std::max(kProximalRatio * proximal, lowest);
    }
    return false;
  }

  /// Block principal pivoting: makes (A + δ) λ + gap − δ λ_before zero where λ > 0, and non-negative elsewhere. Gives
  /// up without progress unless `patient`.
  bool pivot(Cluster& which, const Eigen::VectorXd& gap, const Eigen::VectorXd& before, Eigen::VectorXd& reaction,
             bool patient) {
    const std::vector<int>& cluster = which.contacts;
    const int m = static_cast<int>(cluster.size());
    // Exchanging all wrong contacts takes few rounds but may cycle. Where it makes no progress, only the last wrong
    // contact is exchanged, which terminates (Murty, Linear Algebra Appl. 7 (1974) 65).
    int fewest = m + 1, exchanges_left = kFruitlessExchanges;
    Eigen::VectorXd right(m);
    std::vector<int> wrong;
    for (int round = 0; round < kExchanges + 4 * m; ++round) {
      if (!factor(which, active_, Eigen::VectorXd::Constant(m, proximal_))) return false;
      for (int k = 0; k < m; ++k) right[k] = active_[k] ? proximal_ * before[k] - gap[k] : 0;
      reaction = which.factors->solve(right);
      if (!reaction.allFinite()) return false;
      if (tied_) return true;
      for (int k = 0; k < m; ++k) contacts_[cluster[k]].lambda = reaction[k] / arms_[cluster[k]].scale;
      push(cluster);
      wrong.clear();
      for (int k = 0; k < m; ++k) {
        const double allowed = tolerance(cluster[k]) / arms_[cluster[k]].scale;
        const bool flips = active_[k] ? reaction[k] < -allowed
                                      : excess(cluster[k]) / arms_[cluster[k]].scale - proximal_ * before[k] < -allowed;
        if (flips) wrong.push_back(k);
      }
      if (wrong.empty()) {
        reaction = reaction.cwiseMax(0.0);
        return true;
      }
      const int count = static_cast<int>(wrong.size());
      if (count < fewest) {
        fewest = count;
        exchanges_left = kFruitlessExchanges;
      } else if (exchanges_left-- <= 0) {
        if (!patient) return false;
        wrong.erase(wrong.begin(), wrong.end() - 1);
      }
      for (const int k : wrong) active_[k] ^= 1;
    }
    return false;
  }

  /// Computes the scaled matrix of a cluster, and the order in which its contacts are eliminated, whichever are active.
  void arrange(Cluster& which) {
    const std::vector<int>& cluster = which.contacts;
    const int m = static_cast<int>(cluster.size());
    std::vector<int> place(size(), kWall);
    for (int k = 0; k < m; ++k) place[cluster[k]] = k;
    std::vector<Eigen::Triplet<double>> entries;
    for (int row = 0; row < m; ++row) {
      const int k = cluster[row];
      for (const int b : {arms_[k].lo, arms_[k].hi}) {
        if (b == kWall) continue;
        for (const int l : bodies_[b].contacts) {
          if (place[l] > row) continue;
          const double sign = (arms_[k].lo == b) == (arms_[l].lo == b) ? 1 : -1;
          const double value = sign * bodies_[b].inverse_mass * contacts_[k].normal.dot(contacts_[l].normal);
          entries.emplace_back(row, place[l], value / (arms_[k].scale * arms_[l].scale));
        }
      }
    }
    which.all.resize(m, m);
    which.all.setFromTriplets(entries.begin(), entries.end());
    if (!which.factors) {
      which.factors = std::make_unique<Factors>();
      which.factors->analyzePattern(which.all);
    }
    which.factored.clear();
  }

  /// Factors the matrix of the active contacts with these terms added to its diagonal. The other contacts have rows and
  /// columns of the identity.
  bool factor(Cluster& which, const std::vector<char>& active, const Eigen::VectorXd& added) {
    if (active == which.factored && added == which.added) return true;
    which.factored = active;
    which.added = added;
    Eigen::SparseMatrix<double> matrix = which.all;
    for (Eigen::Index column = 0; column < matrix.outerSize(); ++column)
      for (Eigen::SparseMatrix<double>::InnerIterator at(matrix, column); at; ++at) {
        const bool diagonal = at.row() == column;
        if (!active[at.row()] || !active[column])
          at.valueRef() = diagonal;
        else if (diagonal)
          at.valueRef() += added[column];
      }
    which.factors->factorize(matrix);
    return which.factors->info() == Eigen::Success;
  }

  /// Comes near the solution through positive reactions and openings, by the predictor and corrector of Mehrotra (SIAM
  /// J. Optim. 2 (1992) 575; Nocedal, Wright, Numerical Optimization, ch. 16.6): in about 20 rounds, however large the
  /// cluster is. Ends where reactions times openings are on average below the square of `close` times the largest gap.
  /// Returns false if no reactions seem to hold the contacts, as where walls squeeze a sphere.
  bool approach(Cluster& which, const Eigen::VectorXd& gap, double close, Eigen::VectorXd& reaction,
                Eigen::VectorXd& opening) {
    const auto count = static_cast<double>(gap.size());
    const double wanted = close * gap.cwiseAbs().maxCoeff();
    const std::vector<char> every(gap.size(), 1);
    bool possible = false;
    for (int round = 0; round < kRounds; ++round) {
      const Eigen::VectorXd off = opening - which.all.template selfadjointView<Eigen::Lower>() * reaction - gap;
      const double mean = reaction.dot(opening) / count;
      possible = off.cwiseAbs().maxCoeff() <= wanted;
      if (possible && mean <= wanted * wanted) break;
      const Eigen::VectorXd ratio = opening.cwiseQuotient(reaction);
      if (!factor(which, every, (ratio.array() + kInteriorProximal).matrix())) break;
      Eigen::VectorXd step, opens, target = Eigen::VectorXd::Zero(gap.size());
      const auto longest = [&] {  // the share of the step that keeps all reactions and openings positive
        step = which.factors->solve(off - opening + target);
        opens = target - opening - ratio.cwiseProduct(step);
        double share = 1;
        for (Eigen::Index k = 0; k < gap.size(); ++k) {
          if (step[k] < 0) share = std::min(share, -kInside * reaction[k] / step[k]);
          if (opens[k] < 0) share = std::min(share, -kInside * opening[k] / opens[k]);
        }
        return share;
      };
      const double predicted = longest();
      const double after = (reaction + predicted * step).dot(opening + predicted * opens) / count;
      target = (after * (after / mean) * (after / mean) - step.cwiseProduct(opens).array()) / reaction.array();
      const double share = longest();
      if (!step.allFinite() || !opens.allFinite()) break;
      reaction += share * step;
      opening += share * opens;
    }
    return possible;
  }

  bool tied_;
  std::vector<EventKey<D>> keys_;  // of the contacts
  std::vector<Body> bodies_;
  std::vector<Arm> arms_;
  std::vector<Cluster> clusters_;
  std::span<RestingContact<D>> contacts_;
  std::span<Vec<D>> w_;
  std::vector<char> active_;  // by contact of the cluster that is being solved
  double proximal_ = 0;
};

template <int D>
ReactionSolver<D>::ReactionSolver() = default;
template <int D>
ReactionSolver<D>::~ReactionSolver() = default;

template <int D>
void ReactionSolver<D>::forget() {
  problem_.reset();
}

template <int D>
bool ReactionSolver<D>::solve(std::span<RestingContact<D>> contacts, const std::vector<double>& mass,
                              std::span<Vec<D>> w, double* lost) {
  if (contacts.empty()) return true;
  if (!problem_ || !problem_->suits(contacts)) problem_ = std::make_unique<Problem>(contacts, mass, false);
  problem_->begin(contacts, w);
  return problem_->solve(lost);
}

template <int D>
double keep_tangential(std::span<RestingContact<D>> contacts, const std::vector<double>& mass, std::span<Vec<D>> v) {
  if (contacts.empty()) return 0;
  typename ReactionSolver<D>::Problem problem(contacts, mass, true);
  problem.begin(contacts, v);
  return problem.solve_and_stretch();
}

template class ReactionSolver<2>;
template class ReactionSolver<3>;
template double keep_tangential<2>(std::span<RestingContact<2>>, const std::vector<double>&, std::span<Vec<2>>);
template double keep_tangential<3>(std::span<RestingContact<3>>, const std::vector<double>&, std::span<Vec<3>>);

}  // namespace carom
