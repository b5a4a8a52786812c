// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Elementary functions with the same bits on every machine, for a double or for the lanes of a vector (lanes.h).
//
// The C library chooses its exp, log, … by processor (with or without fused multiply-add), so the last bits differ
// between machines, and a chaotic run amplifies the difference. These functions use plain double arithmetic, compiled
// like the rest of the engine. Errors against 50-digit arithmetic over the whole range: below 1 ulp (exp, expm1, log,
// log1p), 1.5 ulp (pow up to |y| = 50), 1.2 ulp (erfc). They do not set errno and guarantee no floating-point
// exceptions.

#include "engine/base/elementary_lanes.h"

namespace carom::elementary {

/// e^x; 0 below −745.2, infinity above 709.8.
double exp(double x);
/// e^x − 1 without cancellation at small x.
double expm1(double x);
/// Natural logarithm; −infinity at 0, NaN below.
double log(double x);
/// log(1 + x) without cancellation at small x.
double log1p(double x);
/// x^y for x > 0 (NaN for negative x; 0^y is 0, 1 or infinity).
double pow(double x, double y);
/// Cube root for 2^-900 < x < 2^900 and for 0; below 0.51 ulp, so that cubes have exact roots.
double cbrt(double x);
/// Complementary error function, 2/√π ∫_x^∞ e^(−t²) dt, in full relative precision until it underflows near x = 27.2.
double erfc(double x);

// The overloads for the lanes of a vector.
using formula::erfc;
using formula::exp;
using formula::expm1;
using formula::log;
using formula::log1p;
using formula::pow;

}  // namespace carom::elementary
