// SPDX-License-Identifier: BSD-3-Clause
#include "engine/events/contact.h"

#include <gtest/gtest.h>

#include <boost/multiprecision/cpp_bin_float.hpp>
#include <random>

#include "engine/events/meeting.h"

namespace carom::contact_test {
namespace {

using Precise = boost::multiprecision::cpp_bin_float_50;

template <int D>
Vec<D> random_vector(std::mt19937_64& random, double size) {
  std::uniform_real_distribution<double> uniform(-size, size);
  Vec<D> x;
  for (int k = 0; k < D; ++k) x[k] = uniform(random);
  return x;
}

/// |d + v s + a s²/2|² − sigma² in 50 digits.
template <int D>
Precise gap_squared(const Vec<D>& d, const Vec<D>& v, const Vec<D>& a, double sigma, double s) {
  Precise sum = -Precise(sigma) * sigma;
  for (int k = 0; k < D; ++k) {
    const Precise x = Precise(d[k]) + Precise(v[k]) * s + Precise(a[k]) * s * s / 2;
    sum += x * x;
  }
  return sum;
}

/// The end of the first of so many equal intervals of [0, rest] in which the gap closes, by bisection; kNever if none.
double walked_root(auto&& gap, double rest, int steps) {
  for (int k = 0; k < steps; ++k) {
    double lo = rest * k / steps, hi = rest * (k + 1) / steps;
    if (!(gap(lo) > 0 && gap(hi) <= 0)) continue;
    for (int bisection = 0; bisection < 80; ++bisection) (gap(0.5 * (lo + hi)) > 0 ? lo : hi) = 0.5 * (lo + hi);
    return hi;
  }
  return kNever;
}

/// Finds the first contact by small steps along the path: slow, and it misses only overlaps shorter than a step.
template <int D>
double walked_contact(const Vec<D>& d, const Vec<D>& v, const Vec<D>& a, double sigma, double rest, int steps) {
  auto gap = [&](double s) { return (d + s * v + (0.5 * s * s) * a).squaredNorm() - sigma * sigma; };
  return walked_root(gap, rest, steps);
}

template <class T>
class Contact : public testing::Test {};
struct Two {
  static constexpr int kD = 2;
};
struct Three {
  static constexpr int kD = 3;
};
using Dimensions = testing::Types<Two, Three>;
TYPED_TEST_SUITE(Contact, Dimensions);

TYPED_TEST(Contact, StraightFlightsEndAtTheContactDistance) {
  constexpr int D = TypeParam::kD;
  std::mt19937_64 random(1);
  int hits = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const double reach = trial % 2 ? 3 : 200;  // also far away: the discriminant must not cancel
    const Vec<D> d = random_vector<D>(random, reach), aim = random_vector<D>(random, 0.99 / std::sqrt(D));
    const Vec<D> v = (aim - d) * (0.1 + 0.001 * (trial % 1000));
    if (d.norm() < 1.001) continue;
    const double s = contact_time<D>(d, v, 1.0, 0.0);
    ASSERT_LT(s, kNever) << "d " << d.transpose() << " v " << v.transpose();
    ++hits;
    // The remaining gap is due to the last bit of s and d.
    const double gap = static_cast<double>(gap_squared<D>(d, v, Vec<D>::Zero(), 1.0, s)) / 2;
    EXPECT_LE(std::abs(gap), 1e-15 * (reach + 4)) << "d " << d.transpose();
    EXPECT_LE((d + s * v).dot(v), 0);  // the earlier root
  }
  EXPECT_GT(hits, 15000);
}

TYPED_TEST(Contact, StraightFlightsThatPassOrPartNeverTouch) {
  constexpr int D = TypeParam::kD;
  Vec<D> d = Vec<D>::Zero(), v = Vec<D>::Zero();
  d[0] = 5;
  v[0] = -1;
  d[1] = 1.0 + 1e-15;
  EXPECT_EQ(contact_time<D>(d, v, 1.0, 0.0), kNever);  // grazes
  d[1] = 0;
  EXPECT_DOUBLE_EQ(contact_time<D>(d, v, 1.0, 0.0), 4.0);
  EXPECT_EQ(contact_time<D>(d, -v, 1.0, 0.0), kNever);
  d[0] = 1.0;  // touching: at once when approaching, never when parting
  EXPECT_EQ(contact_time<D>(d, v, 1.0, 0.0), 0.0);
  EXPECT_EQ(contact_time<D>(d, -v, 1.0, 0.0), kNever);
  EXPECT_EQ(contact_time<D>(d, 1e-17 * v, 1.0, 1e-15), kNever);  // approach below rounding
}

/// |d + v s|² − (sigma + w s)², in 50 digits.
template <int D>
Precise grown_gap(const Vec<D>& d, const Vec<D>& v, double sigma, double w, double s) {
  const Precise reach = Precise(sigma) + Precise(w) * s;
  return gap_squared<D>(d, v, Vec<D>::Zero(), 0.0, s) - reach * reach;
}

/// Finds the first contact of growing spheres by small steps.
template <int D>
double walked_growth(const Vec<D>& d, const Vec<D>& v, double sigma, double w, double rest, int steps) {
  auto gap = [&](double s) { return (d + s * v).norm() - (sigma + w * s); };
  return walked_root(gap, rest, steps);
}

TYPED_TEST(Contact, GrowingSpheresMeetWhereWalkingFindsThem) {
  constexpr int D = TypeParam::kD;
  std::mt19937_64 random(6);
  int parting = 0, approaching = 0, misses = 0;
  for (int trial = 0; trial < 12000; ++trial) {
    const Vec<D> d = random_vector<D>(random, 4), v = random_vector<D>(random, trial % 3 == 0 ? 0.3 : 2);
    const double w = 0.001 * (trial % 1000), rest = 5;
    if (d.norm() < 1.01) continue;
    const double s = contact_time<D>(d, v, 1.0, w, 0.0);
    const double walked = walked_growth<D>(d, v, 1.0, w, rest, 1000);
    if (walked == kNever) {
      ++misses;
      if (s >= rest) continue;
      EXPECT_LT((d + s * v).norm() - (1 + w * s), 1e-13);  // a shallow overlap between two steps
      EXPECT_GT((d + (s + 0.0025) * v).norm() - (1 + w * (s + 0.0025)), -1e-4);
      continue;
    }
    ++(d.dot(v) > 0 ? parting : approaching);
    ASSERT_LE(s, walked * (1 + 1e-12)) << "d " << d.transpose() << " v " << v.transpose() << " w " << w;
    EXPECT_LE(std::abs(static_cast<double>(grown_gap<D>(d, v, 1.0, w, s))), 2e-13);
    const double falling = (d + s * v).dot(v) - (1 + w * s) * w;
    EXPECT_LE(falling, 1e-12);
  }
  EXPECT_GT(parting, 100);
  EXPECT_GT(approaching, 1000);
  EXPECT_GT(misses, 1000);
}

TYPED_TEST(Contact, WithoutGrowthTheBitsAreThoseOfStraightFlights) {
  constexpr int D = TypeParam::kD;
  std::mt19937_64 random(7);
  int hits = 0;
  for (int trial = 0; trial < 5000; ++trial) {
    const Vec<D> d = random_vector<D>(random, 1.5), v = random_vector<D>(random, 2);  // some overlap
    const double plain = contact_time<D>(d, v, 1.0, 1e-3), grown = contact_time<D>(d, v, 1.0, 0.0, 1e-3);
    EXPECT_EQ(plain, grown);
    if (plain < kNever) ++hits;
  }
  EXPECT_GT(hits, 500);
}

TYPED_TEST(Contact, GrowthBringsPartingAndRestingSpheresTogether) {
  constexpr int D = TypeParam::kD;
  const Vec<D> d = 2 * Vec<D>::Unit(0), v = Vec<D>::Unit(0), still = Vec<D>::Zero();
  EXPECT_DOUBLE_EQ(contact_time<D>(d, still, 1.0, 0.5, 0.0), 2.0);     // 2 = 1 + s/2
  EXPECT_DOUBLE_EQ(contact_time<D>(d, 0.25 * v, 1.0, 0.5, 0.0), 4.0);  // 2 + s/4 = 1 + s/2
  EXPECT_DOUBLE_EQ(contact_time<D>(d, -0.5 * v, 1.0, 0.5, 0.0), 1.0);  // 2 − s/2 = 1 + s/2: A = 0
  EXPECT_EQ(contact_time<D>(d, 0.5 * v, 1.0, 0.5, 0.0), kNever);       // as fast as they grow
  EXPECT_EQ(contact_time<D>(d, v, 1.0, 0.5, 0.0), kNever);
  const Vec<D> touching = Vec<D>::Unit(0);
  EXPECT_EQ(contact_time<D>(touching, 0.4 * v, 1.0, 0.5, 1e-15), 0.0);  // separates slower than it grows
  EXPECT_EQ(contact_time<D>(touching, 0.6 * v, 1.0, 0.5, 1e-15), kNever);
}

TYPED_TEST(Contact, GrowingSpheresPartFasterThanTheyGrow) {
  constexpr int D = TypeParam::kD;
  std::mt19937_64 random(8);
  for (int trial = 0; trial < 2000; ++trial) {
    Vec<D> d = random_vector<D>(random, 1);
    const Vec<D> v_i = random_vector<D>(random, 2), v_j = random_vector<D>(random, 2);
    const double m_i = 0.1 + trial % 7, m_j = 0.3 + trial % 5, w = 0.001 * trial, sigma = d.norm();
    const Vec<D> impulse = collision_factor<D>(d, v_i - v_j, m_i, m_j, sigma, w) * d;
    const Vec<D> w_i = v_i + impulse / m_i, w_j = v_j - impulse / m_j;
    const double before = d.dot(v_i - v_j) / sigma, after = d.dot(w_i - w_j) / sigma;
    EXPECT_NEAR(after, 2 * w - before, 1e-12);
    EXPECT_LT((m_i * w_i + m_j * w_j - m_i * v_i - m_j * v_j).norm(), 1e-12);
    // Just after the collision, which did not change the gap, the spheres do not collide again.
    if (before >= w) continue;
    EXPECT_EQ(contact_time<D>(d, w_i - w_j, sigma, w, approach_slack(sigma, 4, 4 + w)), kNever);
  }
}

TYPED_TEST(Contact, ParabolasMissNoContactAndInventNone) {
  constexpr int D = TypeParam::kD;
  std::mt19937_64 random(2);
  int hits = 0, misses = 0;
  for (int trial = 0; trial < 12000; ++trial) {
    const Vec<D> d = random_vector<D>(random, 3), v = random_vector<D>(random, 4), a = random_vector<D>(random, 8);
    if (d.norm() < 1.01) continue;
    const double rest = 0.2 + 0.001 * (trial % 2000);
    const double s = contact_time<D>(d, v, a, 1.0, rest, false, 0.0);
    const double walked = walked_contact<D>(d, v, a, 1.0, rest, 1000);
    if (walked == kNever) {
      // There is no contact, or a shallow overlap between two steps.
      if (s < kNever) {
        const double depth = (d + (s + rest / 2000) * v + (0.5 * (s + rest / 2000) * (s + rest / 2000)) * a).norm() - 1;
        EXPECT_GT(depth, -1e-3);
      }
      ++misses;
      continue;
    }
    ++hits;
    ASSERT_LE(s, walked * (1 + 1e-9)) << "d " << d.transpose() << " v " << v.transpose() << " a " << a.transpose();
    EXPECT_LT(std::abs(static_cast<double>(gap_squared<D>(d, v, a, 1.0, s))), 1e-13);
    EXPECT_LT((d + s * v + 0.5 * s * s * a).dot(v + s * a), 0);
  }
  EXPECT_GT(hits, 500);
  EXPECT_GT(misses, 500);
}

TYPED_TEST(Contact, ParabolasWithoutAccelerationAreStraight) {
  constexpr int D = TypeParam::kD;
  std::mt19937_64 random(4);
  for (int trial = 0; trial < 1000; ++trial) {
    const Vec<D> d = random_vector<D>(random, 4), v = random_vector<D>(random, 4);
    if (d.norm() < 1.01) continue;
    const double straight = contact_time<D>(d, v, 1.0, 0.0);
    const double parabola = contact_time<D>(d, v, Vec<D>::Zero(), 1.0, 1e3, false, 0.0);
    if (straight == kNever)
      EXPECT_EQ(parabola, kNever);
    else
      EXPECT_NEAR(parabola, straight, 1e-12 * (1 + straight));
  }
}

TYPED_TEST(Contact, ABounceUnderAttractionReturnsAfterTwiceSpeedOverAcceleration) {
  constexpr int D = TypeParam::kD;
  Vec<D> d = Vec<D>::Unit(0), v = 1e-3 * Vec<D>::Unit(0), a = -Vec<D>::Unit(0);
  for (double gap : {0.0, 1e-16, -1e-16, 5e-14, -5e-14}) {
    d[0] = 1 + gap;
    EXPECT_NEAR(contact_time<D>(d, v, a, 1.0, 1.0, true, 1e-15), 2e-3, 1e-9) << "gap " << gap;
  }
  EXPECT_EQ(contact_time<D>(d, v, a, 1.0, 1e-3, true, 1e-15), kNever);               // not within the time left
  EXPECT_EQ(contact_time<D>(d, Vec<D>::Zero(), a, 1.0, 1.0, true, 1e-15), 0.0);      // rests, pressed
  EXPECT_EQ(contact_time<D>(d, Vec<D>::Zero(), -a, 1.0, 1.0, true, 1e-15), kNever);  // pulled apart
}

TEST(WallContact, MatchesTheQuadratic) {
  EXPECT_DOUBLE_EQ(wall_contact_time(2, -1, 0, 10, false, 0), 2);
  EXPECT_EQ(wall_contact_time(2, -1, 0, 2, false, 0), kNever);  // [0, rest) is half open
  EXPECT_EQ(wall_contact_time(2, 1, 0, 10, false, 0), kNever);
  EXPECT_NEAR(wall_contact_time(1, 1, -1, 10, false, 0), 1 + std::sqrt(3.0), 1e-15);
  EXPECT_EQ(wall_contact_time(1, -1, 1, 10, false, 0), kNever);  // turns back before the wall
  EXPECT_DOUBLE_EQ(wall_contact_time(0, 1, -2, 10, true, 0), 1);
  EXPECT_EQ(wall_contact_time(0, 0, -2, 10, true, 1e-16), 0);
}

TYPED_TEST(Contact, CollisionKeepsEnergyAndMomentum) {
  constexpr int D = TypeParam::kD;
  std::mt19937_64 random(5);
  for (int trial = 0; trial < 2000; ++trial) {
    const Vec<D> d = random_vector<D>(random, 1), v_i = random_vector<D>(random, 2), v_j = random_vector<D>(random, 2);
    const double m_i = 0.1 + trial % 7, m_j = 0.3 + trial % 5;
    const Vec<D> impulse = collision_factor<D>(d, v_i - v_j, m_i, m_j) * d;
    const Vec<D> w_i = v_i + impulse / m_i, w_j = v_j - impulse / m_j;
    EXPECT_NEAR(d.dot(w_i - w_j), -d.dot(v_i - v_j), 1e-13);
    EXPECT_NEAR(m_i * w_i.squaredNorm() + m_j * w_j.squaredNorm(), m_i * v_i.squaredNorm() + m_j * v_j.squaredNorm(),
                1e-12);
    EXPECT_LT((m_i * w_i + m_j * w_j - m_i * v_i - m_j * v_j).norm(), 1e-13);
  }
}

TEST(Polynomial, FindsTheFirstFallAmongClusteredRoots) {
  // (s − 1)(s − 1.001)(s − 2)(s − 3): positive, falls at 1, rises at 1.001, falls at 2.
  auto from_roots = [](double a, double b, double c, double d) {
    return Polynomial<4>{{a * b * c * d, -(a * b * c + a * b * d + a * c * d + b * c * d),
                          a * b + a * c + a * d + b * c + b * d + c * d, -(a + b + c + d), 1}};
  };
  EXPECT_NEAR(first_fall(from_roots(1, 1.001, 2, 3), 10.0), 1, 1e-11);
  EXPECT_NEAR(first_fall(from_roots(-1, 1.001, 2, 3), 10.0), 2,
              1e-12);  // rises at −1 … it is negative at 0, falls at 2
  EXPECT_EQ(first_fall(from_roots(5, 6, 7, 8), 4.0), kNever);
  EXPECT_EQ(first_fall(Polynomial<4>{{1, 0, 0, 0, 1}}, 100.0), kNever);
  EXPECT_EQ(first_fall(Polynomial<4>{{0, -1, 0, 0, 0}}, 1.0), 0.0);
}

}  // namespace
}  // namespace carom::contact_test
