// SPDX-License-Identifier: BSD-3-Clause
#include "engine/slabs/resting.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "engine/base/particles.h"

namespace carom {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
// The proximal terms, added to a diagonal of ones. The first term makes all pivots similar, so that few exchanges find
// the contacts under pressure; the last is 10⁶ times the rounding of the factors, and small compared with the smallest
// relevant eigenvalue, so that each repetition reduces the error by several digits.
constexpr double kFirstProximal = 1e-2, kProximalRatio = 0.03, kLastProximal = 1e-10;
constexpr int kRepetitions = 400, kPatientRepetitions = 40;
constexpr int kBeforeLowering = 4;  // repetitions with a raised proximal term, before a lower one is tried again
// A solution is sought to the rounding of the two spheres of each contact. In a cluster with light loads beside heavy
// ones this may be less than the rounding of the factors; then a solution is accepted that would also be kept.
constexpr int kStrictRepetitions = 8;
constexpr int kExchanges = 50;
constexpr int kFruitlessExchanges = 5;          // of all wrong contacts, before only one is exchanged at a time
constexpr double kFewRoundings = 8 * kEpsilon;  // relative error of a sum of a few terms
constexpr double kMostStretched = 0.1;          // of the kinetic energy: the turn of a sliding pair takes less
constexpr int kWall = -1;                       // in place of a second body

/// The contacts of a system, with the spheres that they act on.
template <int D>
class Problem {
 public:
  Problem(std::span<RestingContact<D>> contacts, const std::vector<double>& mass, std::span<Vec<D>> w, bool tied)
      : contacts_(contacts), w_(w), tied_(tied) {
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
      Arm arm{place[contact.key.lo], pair(contact) ? place[contact.key.hi] : kWall};
      const double inverse_mass = bodies_[arm.lo].inverse_mass + (arm.hi == kWall ? 0.0 : bodies_[arm.hi].inverse_mass);
      arm.scale = std::sqrt(contact.normal.squaredNorm() * inverse_mass);
      arms_.push_back(arm);
    }
  }

  /// Solves each cluster that is not solved yet, and adds the effect of the reactions to w.
  bool solve(double* lost) {
    bool solved = true;
    if (std::vector<int> all = everything(); !settled(all, true)) {
      for (const auto& cluster : clusters()) solved &= settled(cluster, true) || solve(cluster);
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
    for (const auto& cluster : clusters()) {
      if (!settled(cluster, true)) solve(cluster);
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

  std::vector<int> everything() const {
    std::vector<int> all(size());
    std::iota(all.begin(), all.end(), 0);
    return all;
  }
  static bool pair(const RestingContact<D>& contact) { return contact.key.kind == EventKind::pair; }
  int size() const { return static_cast<int>(contacts_.size()); }

  /// The contacts of each cluster that shared spheres connect, ascending.
  std::vector<std::vector<int>> clusters() {
    for (int k = 0; k < size(); ++k)
      for (const int body : {arms_[k].lo, arms_[k].hi})
        if (body != kWall && bodies_[body].mass > 0) bodies_[body].contacts.push_back(k);
    std::vector<std::vector<int>> found;
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
      found.push_back(std::move(cluster));
    }
    return found;
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

  bool solve(const std::vector<int>& cluster) {
    const int m = static_cast<int>(cluster.size());
    std::vector<double> last(m);
    for (int k = 0; k < m; ++k) last[k] = contacts_[cluster[k]].lambda;
    const std::vector<double> none(m, 0.0);
    return solve(cluster, last, kLastProximal, false) || solve(cluster, none, kFirstProximal, false) ||
           solve(cluster, none, kFirstProximal, true);
  }

  /// Starts from these reactions. If all are zero, it starts from the contacts that approach, and with the first
  /// proximal term from all contacts. Where pivoting makes no progress, the proximal term is raised again, unless
  /// `patient`: then contacts are exchanged one by one.
  bool solve(const std::vector<int>& cluster, const std::vector<double>& start, double proximal, bool patient) {
    const int m = static_cast<int>(cluster.size());
    const bool known = std::ranges::any_of(start, [](double lambda) { return lambda > 0; });
    const bool all = tied_ || proximal == kFirstProximal;
    Eigen::VectorXd reaction(m), before(m), gap(m);
    active_.assign(m, 0);
    factored_.clear();
    for (int k = 0; k < m; ++k) {
      reaction[k] = start[k] * arms_[cluster[k]].scale;
      contacts_[cluster[k]].lambda = 0;
    }
    push(cluster);
    for (int k = 0; k < m; ++k) {
      gap[k] = excess(cluster[k]) / arms_[cluster[k]].scale;
      active_[k] = all || (known ? start[k] > 0 : gap[k] < 0);
    }
    bool solved = false;
    double lowest = kLastProximal;
    int raised = 0;  // in this repetition
    for (int repetition = 0; repetition < (patient ? kPatientRepetitions : kRepetitions); ++repetition) {
      before = reaction;
      proximal_ = proximal;
      const std::vector<char> active = active_;
      if (!pivot(cluster, gap, before, reaction, patient || proximal == kFirstProximal)) {
        if (repetition == 0 || proximal == kFirstProximal) return false;
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
  bool pivot(const std::vector<int>& cluster, const Eigen::VectorXd& gap, const Eigen::VectorXd& before,
             Eigen::VectorXd& reaction, bool patient) {
    const int m = static_cast<int>(cluster.size());
    // Exchanging all wrong contacts takes few rounds but may cycle. Where it makes no progress, only the last wrong
    // contact is exchanged, which terminates (Murty, Linear Algebra Appl. 7 (1974) 65).
    int fewest = m + 1, exchanges_left = kFruitlessExchanges;
    std::vector<int> wrong;
    for (int round = 0; round < kExchanges + 4 * m; ++round) {
      if (!factor(cluster)) return false;
      Eigen::VectorXd right(static_cast<Eigen::Index>(factored_.size()));
      for (std::size_t at = 0; at < factored_.size(); ++at)
        right[static_cast<Eigen::Index>(at)] = proximal_ * before[factored_[at]] - gap[factored_[at]];
      reaction.setZero();
      if (right.size() > 0) {
        const Eigen::VectorXd found = solver_.solve(right);
        for (std::size_t at = 0; at < factored_.size(); ++at)
          reaction[factored_[at]] = found[static_cast<Eigen::Index>(at)];
      }
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

  /// Factors the scaled matrix of the active contacts of a cluster, unless it is factored already.
  bool factor(const std::vector<int>& cluster) {
    std::vector<int> wanted, place(size(), kWall);
    for (int k = 0; k < static_cast<int>(cluster.size()); ++k)
      if (active_[k]) {
        place[cluster[k]] = static_cast<int>(wanted.size());
        wanted.push_back(k);
      }
    if (wanted == factored_ && proximal_ == factored_proximal_) return true;
    factored_ = wanted;
    factored_proximal_ = proximal_;
    if (wanted.empty()) return true;
    std::vector<Eigen::Triplet<double>> entries;
    for (int row = 0; row < static_cast<int>(wanted.size()); ++row) {
      entries.emplace_back(row, row, proximal_);
      const int k = cluster[wanted[row]];
      for (const int b : {arms_[k].lo, arms_[k].hi}) {
        if (b == kWall) continue;
        for (const int l : bodies_[b].contacts) {
          const int column = place[l];
          if (column == kWall || column > row) continue;
          const double sign = (arms_[k].lo == b) == (arms_[l].lo == b) ? 1 : -1;
          const double value = sign * bodies_[b].inverse_mass * contacts_[k].normal.dot(contacts_[l].normal);
          entries.emplace_back(row, column, value / (arms_[k].scale * arms_[l].scale));
        }
      }
    }
    const auto n = static_cast<Eigen::Index>(wanted.size());
    Eigen::SparseMatrix<double> matrix(n, n);
    matrix.setFromTriplets(entries.begin(), entries.end());
    solver_.compute(matrix);
    return solver_.info() == Eigen::Success;
  }

  std::span<RestingContact<D>> contacts_;
  std::span<Vec<D>> w_;
  bool tied_;
  std::vector<Body> bodies_;
  std::vector<Arm> arms_;
  std::vector<char> active_;   // by contact of the cluster that is being solved
  std::vector<int> factored_;  // the contacts that solver_ holds the factors for
  double proximal_ = 0, factored_proximal_ = 0;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver_;
};

}  // namespace

template <int D>
bool solve_reactions(std::span<RestingContact<D>> contacts, const std::vector<double>& mass, std::span<Vec<D>> w,
                     double* lost) {
  return contacts.empty() || Problem<D>(contacts, mass, w, false).solve(lost);
}

template <int D>
double keep_tangential(std::span<RestingContact<D>> contacts, const std::vector<double>& mass, std::span<Vec<D>> v) {
  return contacts.empty() ? 0 : Problem<D>(contacts, mass, v, true).solve_and_stretch();
}

template bool solve_reactions<2>(std::span<RestingContact<2>>, const std::vector<double>&, std::span<Vec<2>>, double*);
template bool solve_reactions<3>(std::span<RestingContact<3>>, const std::vector<double>&, std::span<Vec<3>>, double*);
template double keep_tangential<2>(std::span<RestingContact<2>>, const std::vector<double>&, std::span<Vec<2>>);
template double keep_tangential<3>(std::span<RestingContact<3>>, const std::vector<double>&, std::span<Vec<3>>);

}  // namespace carom
