// SPDX-License-Identifier: BSD-3-Clause
#include "engine/base/elementary.h"

namespace carom::elementary {

double exp(double x) { return formula::exp(x); }
double expm1(double x) { return formula::expm1(x); }
double log(double x) { return formula::log(x); }
double log1p(double x) { return formula::log1p(x); }
double pow(double x, double y) { return formula::pow(x, y); }
double erfc(double x) { return formula::erfc(x); }

double cbrt(double x) {
  if (x == 0) return x;
  const double root = formula::pow(x, 1.0 / 3);
  const formula::Sum<double> square = formula::two_product(root, root), cube = formula::two_product(square.hi, root);
  return root - ((cube.hi - x) + (cube.lo + square.lo * root)) / (3 * square.hi);
}

}  // namespace carom::elementary
