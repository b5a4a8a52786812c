#pragma once
// Fixed-point iterations that contract slowly, made faster by mixing their last iterates.

#include <Eigen/QR>
#include <algorithm>

namespace carom::integrator {

/// Anderson acceleration: the last few iterates, mixed so that what they lack would vanish as far as it can were it
/// linear in them. (Anderson, J. ACM 12 (1965) 547; for linear problems GMRES.)
class Mixing {
 public:
  void clear() { columns_ = 0; }
  /// Takes an iterate and what the next plain one would add to it; what else is to be added is left in correction().
  void add(const Eigen::VectorXd& iterate, const Eigen::VectorXd& lacking) {
    correction_.setZero(iterate.size());
    if (columns_ == 0) {
      moves_.resize(iterate.size(), kDepth);
      changes_.resize(iterate.size(), kDepth);
    } else {
      const Eigen::Index at = (columns_ - 1) % kDepth, known = std::min(columns_, kDepth);
      moves_.col(at) = iterate - iterate_;
      changes_.col(at) = lacking - lacking_;
      const Eigen::VectorXd share = changes_.leftCols(known).colPivHouseholderQr().solve(lacking);
      correction_ = -(moves_.leftCols(known) + changes_.leftCols(known)) * share;
    }
    iterate_ = iterate;
    lacking_ = lacking;
    ++columns_;
  }
  const Eigen::VectorXd& correction() const { return correction_; }

 private:
  static constexpr Eigen::Index kDepth = 6;

  Eigen::Index columns_ = 0;
  Eigen::MatrixXd moves_, changes_;
  Eigen::VectorXd iterate_, lacking_, correction_;
};

}  // namespace carom::integrator
