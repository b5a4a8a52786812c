// SPDX-License-Identifier: BSD-3-Clause
// The end of a piece of cdda: contacts at the edge of the tolerance.

#include "engine/integrators/chord_contacts.h"

#include <gtest/gtest.h>

#include "tests/support/experiments.h"

namespace carom::integrator {
namespace {

/// Disc 0 moves left towards disc 1, or towards the wall if there is no disc 1, from the first to the second gap in a
/// time of 1. The box is large, so the tolerance is large compared with the rounding of positions near its corner.
struct Approach {
  Approach(bool wall, double from, double to) {
    std::vector<Vec<2>> x = {{wall ? 0.5 + from : 1.5 + from, 3}}, v = {{to - from, 0}};
    if (!wall) {
      x.push_back({0.5, 3});
      v.push_back({0, 0});
    }
    const auto system = test::make_system<2>({1000, 1000}, wall ? Boundary::wall : Boundary::open, x, v);
    Counters counters;
    std::vector<Reaction<2>> reactions;
    ContactScan<2> scan(*system, 100, reactions);
    scan.begin_step(counters, nullptr, nullptr, 1.0);
    DiscreteGradient<2> piece(*system, 2);
    EXPECT_TRUE(piece.solve(x, v, 1.0, scan, counters));
    end = ChordContacts<2>(*system, scan).judge(x, v, piece, 1.0);
  }
  PieceEnd<2> end;
};

TEST(ChordContacts, APieceEndsInContactOnlyWellWithinTheTolerance) {
  // Positions are rounded once more after the piece: at the edge the bodies might no longer touch, and the next piece
  // would have length 0.
  for (const bool wall : {false, true}) {
    SCOPED_TRACE(wall);
    const double tolerance = GapTolerance(1000)(wall ? 0.5 : 1.0);
    for (const double share : {-0.4, 0.0, 0.4}) {
      const auto end = Approach(wall, 0.25, share * tolerance).end;
      EXPECT_TRUE(end.touches) << share;
      EXPECT_FALSE(end.violates) << share;
    }
    for (const double share : {0.6, 0.9, 1.5}) {
      const auto end = Approach(wall, 0.25, share * tolerance).end;
      EXPECT_FALSE(end.touches) << share;
      EXPECT_FALSE(end.violates) << share;
      EXPECT_GT(end.contact, 1) << share;
    }
    for (const double share : {-0.6, -0.9, -1.5}) {
      const auto end = Approach(wall, 0.25, share * tolerance).end;
      EXPECT_FALSE(end.touches) << share;
      EXPECT_TRUE(end.violates) << share;
      EXPECT_LT(end.contact, 1) << share;
    }
  }
}

TEST(ChordContacts, AContactAtTheEdgeOfTheToleranceMayDepart) {
  for (const bool wall : {false, true}) {
    SCOPED_TRACE(wall);
    const double tolerance = GapTolerance(1000)(wall ? 0.5 : 1.0);
    for (const double from : {-1.2, -0.99, 0.0, 0.99}) {
      const auto end = Approach(wall, from * tolerance, 0.25).end;
      EXPECT_FALSE(end.touches) << from;
      EXPECT_FALSE(end.violates) << from;
    }
    EXPECT_TRUE(Approach(wall, 0.99 * tolerance, -1.2 * tolerance).end.violates);
    // A body that rounding has moved beyond the edge stays there.
    EXPECT_FALSE(Approach(wall, -1.2 * tolerance, -1.2 * tolerance).end.violates);
    // A body that returns at the end of the piece touches there.
    const auto again = Approach(wall, 0.0, -0.9 * tolerance).end;
    EXPECT_FALSE(again.violates);
    EXPECT_TRUE(again.touches);
  }
}

}  // namespace
}  // namespace carom::integrator
