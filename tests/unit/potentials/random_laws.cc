// SPDX-License-Identifier: BSD-3-Clause
#include "tests/unit/potentials/random_laws.h"

#include <array>

namespace carom::test {

using namespace std::string_literals;

Sized Law::quotient(Real a, Real b) const {
  if (b < a) std::swap(a, b);
  if (a == b) return slope(a);
  const Sized ends = (value(b) - value(a)) / (b - a);
  const Real steepest = std::max(slope(a).size, slope(b).size);
  if (b - a > 1e-4L * b) return {ends.v, std::min(ends.size, steepest) + 0x1p-11L * ends.size};  // rounding of 64 bits
  Real from = a, sum = 0;
  const auto add = [&](Real to) {
    if (!(to > from)) return;
    for (const int node : {-1, 0, 1})
      sum += (node == 0 ? 8 : 5) * (to - from) / 18 * slope(from + (to - from) * (1 + node * std::sqrt(0.6L)) / 2).v;
    from = to;
  };
  for (const double at : breaks) add(std::min<Real>(at, b));
  add(b);
  return {sum / (b - a), steepest};
}

void Law::cut(double cutoff, const std::string& kind, Real curvature) {
  const Function v = value, s = slope;
  const Real end = cutoff2 = cutoff * cutoff, from = (0.9 * cutoff) * (0.9 * cutoff), width = end - from;
  breaks.push_back(static_cast<double>(end));
  if (kind == "switch") {
    breaks = {static_cast<double>(from), static_cast<double>(end)};
    const auto rest = [=](Real rho) { return Sized(std::clamp<Real>((end - rho) / width, 0, 1), 1); };
    const auto factor = [=](Sized t) { return t * t * t * (10 - t * (15 - 6 * t)); };
    value = [=](Real rho) { return v(rho) * factor(rest(rho)); };
    slope = [=](Real rho) {
      const Sized t = rest(rho), u(1 - t.v, 1);
      return s(rho) * factor(t) - v(rho) * (30 / width) * t * t * u * u;
    };
    return;
  }
  const Sized at_end = v(end), in_r = kind == "force-shifted" ? 2 * Sized(cutoff) * s(end) : Sized(0);
  const Sized in_rho = kind == "quadratic" ? s(end) : Sized(0);
  value = [=](Real rho) {
    if (rho >= end) return Sized(0);
    const Sized z = Sized(rho) - end;
    return v(rho) - at_end - z * (in_rho + z * curvature / 2) - in_r * (Sized(std::sqrt(rho)) - cutoff);
  };
  slope = [=](Real rho) {
    if (rho >= end) return Sized(0);
    const Sized rest = s(rho) - in_rho - (Sized(rho) - end) * curvature;
    return in_r.v == 0 ? rest : rest - in_r / (2 * std::sqrt(rho));
  };
}

namespace {

Law bonds(Dice& dice, std::size_t particles, double strength, double length) {
  const double rest = dice.one_in(4) ? 0 : length;
  Law law{.type = "harmonic-bond"};
  for (Id i = 0; i < particles; ++i)
    for (Id j = i + 1; j < particles; ++j)
      if (dice.one_in(3) || (i == 0 && j == 1)) law.bonds.push_back({i, j});
  law.given = {{"pairs", law.bonds}, {"stiffness", strength}, {"rest_length", rest}};
  law.value = [=](Real rho) {
    const Sized stretch = Sized(std::sqrt(rho)) - rest;
    return strength / 2 * stretch * stretch;
  };
  law.slope = [=](Real rho) {
    return rest == 0 ? Sized(strength / 2) : strength / 2 * (1 - Sized(rest) / std::sqrt(rho));
  };
  return law;
}

Law lennard_jones(double strength, double length, bool wca) {
  const Real sigma2 = length * length;
  Law law{.type = wca ? "wca" : "lennard-jones", .given = {{"epsilon", strength}, {"sigma", length}}};
  law.value = [=](Real rho) {
    const Real x = sigma2 / rho, u = x * x * x;
    return 4 * strength * Sized(u) * (Sized(u) - 1);
  };
  law.slope = [=](Real rho) {
    const Real x = sigma2 / rho, u = x * x * x;
    return -12 * strength / sigma2 * Sized(x * u) * (2 * Sized(u) - 1);
  };
  if (wca) law.cut(std::pow(2, 1.0 / 6) * length, "shifted");
  return law;
}

Law inverse_power(double strength, double length, double exponent) {
  const Real n = exponent / 2.0L, error = 4 + 4 * n;
  Law law{.type = "inverse-power"};
  law.given = {{"epsilon", strength}, {"sigma", length}, {"exponent", exponent}};
  law.value = [=](Real rho) {
    const Real v = strength * std::pow(length * length / rho, n);
    return Sized(v, error * std::abs(v));
  };
  law.slope = [=, value = law.value](Real rho) { return -n * value(rho) / rho; };
  return law;
}

Law yukawa(double strength, double kappa, bool charges) {
  Law law{.type = "yukawa", .given = {{"amplitude", strength}, {"kappa", kappa}, {"charges", charges}}};
  law.value = [=](Real rho) {
    const Real r = std::sqrt(rho), v = strength * std::exp(-kappa * r) / r;
    return Sized(v, (4 + kappa * r) * std::abs(v));
  };
  law.slope = [=, value = law.value](Real rho) { return -0.5L * value(rho) * (1 + kappa * std::sqrt(rho)) / rho; };
  if (charges) law.weight = Law::charges;
  return law;
}

Law morse(double depth, double alpha, double r0) {
  Law law{.type = "morse", .given = {{"depth", depth}, {"alpha", alpha}, {"r0", r0}}};
  const auto decay = [=](Real r) {
    const Real u = std::exp(-alpha * (r - r0));
    return Sized(u, (4 + alpha * (r + r0)) * u);
  };
  law.value = [=](Real rho) {
    const Sized u = decay(std::sqrt(rho));
    return depth * u * (u - 2);
  };
  law.slope = [=](Real rho) {
    const Real r = std::sqrt(rho);
    const Sized u = decay(r);
    return Sized(-depth * alpha / r) * u * (u - 1);
  };
  return law;
}

Law damped_coulomb(double strength, double damping, double cutoff) {
  Law law{.type = "coulomb", .weight = Law::charges};
  law.given = {{"constant", strength}, {"form", "damped-shifted"s}, {"damping", damping}, {"cutoff", cutoff}};
  const auto sized = [=](Real v, Real rho) { return Sized(v, (4 + 4 * damping * damping * rho) * std::abs(v)); };
  law.value = [=](Real rho) {
    const Real r = std::sqrt(rho);
    return sized(strength * std::erfc(damping * r) / r, rho);
  };
  const auto gauss = [=](Real rho) {
    return sized(strength * 2 / std::sqrt(std::acos(-1.0L)) * damping * std::exp(-damping * damping * rho), rho);
  };
  law.slope = [=, v = law.value](Real rho) { return -0.5L * (v(rho) + gauss(rho)) / rho; };
  const Real end = cutoff * cutoff;
  law.cut(cutoff, "quadratic", (0.5L * damping * damping * gauss(end).v - 1.5L * law.slope(end).v) / end);
  return law;
}

Law inverse_distance(const char* type, double strength) {
  Law law{.type = type, .given = {{"constant", strength}}, .weight = Law::charges};
  if (type == "gravity"s)
    law.weight = Law::masses, strength = -strength;
  else
    law.given.set("form", "plain"s);
  law.value = [=](Real rho) { return Sized(strength / std::sqrt(rho)); };
  law.slope = [=](Real rho) { return Sized(-strength / (2 * rho * std::sqrt(rho))); };
  return law;
}

/// Points of a cubic in ρ, and the interpolation between them.
Law table(Dice& dice, double strength, double last) {
  std::array<Real, 4> c;
  for (Real& each : c) each = dice.uniform(-strength, strength);
  const double first = dice.uniform(0.2, 0.5) * last;
  const Real start = Real(first) * first, unit = Real(last) * last;
  const auto at = [=](Real rho, int derivative) {
    const Real z = rho / unit;
    return derivative == 0   ? c[0] + z * (c[1] + z * (c[2] + z * c[3]))
           : derivative == 1 ? (c[1] + z * (2 * c[2] + z * 3 * c[3])) / unit
                             : (2 * c[2] + z * 6 * c[3]) / (unit * unit);
  };
  Law law{.type = "table", .breaks = {static_cast<double>(start)}};
  std::vector<double> r, values, slopes;
  for (int k = 0; k <= 6; ++k) {
    r.push_back(k == 6 ? last : first + (last - first) * k / 6);
    values.push_back(static_cast<double>(at(Real(r[k]) * r[k], 0)));
  }
  for (const double end : {first, last}) slopes.push_back(static_cast<double>(2 * end * at(Real(end) * end, 1)));
  law.given = {{"r", r}, {"value", values}, {"slope", slopes}};
  law.value = [=](Real rho) {
    const Real below = std::min<Real>(rho - start, 0), in = rho - below;
    return Sized(at(in, 0) + below * (at(in, 1) + below / 2 * at(in, 2)), 400 * strength);
  };
  law.slope = [=](Real rho) {  // also below the first point
    const Real below = std::min<Real>(rho - start, 0), in = rho - below;
    return Sized(at(in, 1) + below * at(in, 2), 400 * strength / unit);
  };
  return law;
}

}  // namespace

Law random_law(Dice& dice, std::size_t particles, double edge, bool periodic) {
  const double strength = dice.decades(-8, 8), either = dice.one_in(2) ? strength : -strength;
  const double length = edge * dice.decades(-3, -0.3);
  const std::size_t type = dice.below(periodic ? 8 : 10);
  if (type == 0) return bonds(dice, particles, strength, length);
  if (type == 1) return lennard_jones(strength, length, true);
  if (type == 2) return damped_coulomb(strength, dice.decades(-1, 1) / edge, edge * dice.uniform(0.05, 0.7));
  if (type == 8) return inverse_distance("gravity", strength);
  if (type == 9) return inverse_distance("coulomb", either);
  Law law = type == 3   ? lennard_jones(strength, length, false)
            : type == 4 ? inverse_power(either, length, dice.uniform(0.5, 40))
            : type == 7 ? morse(strength, dice.uniform(0.5, 20) / length, length)
            : type == 5 ? yukawa(either, dice.decades(-1, 3) / edge, dice.one_in(2))
                        : table(dice, strength, length);
  if (!periodic && type != 6 && dice.one_in(2)) return law;
  const std::string kind = std::array{"switch", "shifted", "force-shifted"}[dice.below(3)];
  const double cutoff = type == 6 ? length : edge * dice.uniform(0.05, 1.2);
  if (type != 6) law.given.set("cutoff", cutoff);
  law.given.set("cut", kind);
  law.cut(cutoff, kind);
  return law;
}

}  // namespace carom::test
