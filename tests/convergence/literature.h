// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Equations of state of hard spheres, hard discs and mixtures of spheres, from the literature.
//
// Z = pV/(N k T). The comments give the accuracy of each formula.

#include <cmath>
#include <initializer_list>
#include <numbers>
#include <span>
#include <utility>

namespace carom::literature {

/// 1 + Σ c x^i at x = η/(1 − η): the form of the fits of Kolafa and his colleagues to their molecular dynamics.
inline double kolafa_series(std::initializer_list<std::pair<int, double>> terms, double eta) {
  double z = 1;
  for (const auto& [power, c] : terms) z += c * std::pow(eta / (1 - eta), power);
  return z;
}

/// Hard spheres, stable fluid: Kolafa, Labík, Malijevský, Phys. Chem. Chem. Phys. 6 (2004) 2335. Their data are
/// accurate to 4e-5 of Z at 95 % confidence. The expansion in η gives B2 … B6 = 4, 10, 18.36477, 28.22445, 39.8155
/// (exact or to six digits) and B7, B8 within 0.3 %; Hansen-Goos, J. Chem. Phys. 144 (2016) 164506, differs by at most
/// 1.1e-4 of Z up to η = 0.49.
inline double spheres(double eta) {
  return kolafa_series({{1, 4},
                        {2, 6},
                        {3, 2.3647684},
                        {4, -0.8698551},
                        {5, 1.1062803},
                        {6, -1.1014221},
                        {7, 0.66605866},
                        {8, -0.03633431},
                        {10, -0.20965164},
                        {14, 0.10555569},
                        {22, -0.00872380}},
                       eta);
}

/// Hard discs, stable fluid up to density 0.88 (η = 0.691): Kolafa, Rottner, Mol. Phys. 104 (2006) 3435, section 3.2.
/// It agrees with the fifteen values of their table 1 within their standard errors (3e-5 of Z at density 0.88, below
/// 1e-5 up to 0.85).
inline double discs(double eta) {
  return kolafa_series({{1, 2.0},
                        {2, 1.12801775},
                        {3, 0.00181895291},
                        {4, -0.0526134737},
                        {5, 0.0504951668},
                        {6, -0.0325433846},
                        {7, 0.0133946531},
                        {8, 0.00174265604},
                        {9, -0.00944632202},
                        {10, 0.00851111768},
                        {11, -0.0035963525},
                        {12, 0.000577345106},
                        {19, -1.06399127e-7}},
                       eta);
}

template <int D>
double fluid(double eta) {
  return D == 3 ? spheres(eta) : discs(eta);
}

/// Z of a periodic box of n particles: the pressure of the canonical ensemble differs from that of the grand canonical
/// one by −½⟨ΔN²⟩ ∂²p/∂N², so Z_n = Z − (ρ/2n) (∂²(ρZ)/∂ρ²)/(∂(ρZ)/∂ρ), to first order in 1/n (Lebowitz, Percus,
/// Verlet, Phys. Rev. 153 (1967) 250). For Z = 1 + Bρ this is the exact 1 + Bρ(1 − 1/n).
template <int D>
double finite_fluid(double eta, double n) {
  const double h = 1e-3 * eta;
  const auto p = [](double e) { return e * fluid<D>(e); };
  const double first = (p(eta + h) - p(eta - h)) / (2 * h);
  const double second = (p(eta + h) - 2 * p(eta) + p(eta - h)) / (h * h);
  return fluid<D>(eta) - eta / (2 * n) * second / first;
}

/// g at contact for this Z.
template <int D>
double contact_value(double eta) {
  return (fluid<D>(eta) - 1) / ((D == 3 ? 4 : 2) * eta);
}

/// Collisions of one sphere of diameter 1 and mass 1 per unit time at temperature 1: Enskog's rate, exact in
/// equilibrium (Chapman, Cowling, Mathematical Theory of Non-uniform Gases, 1970, section 16.2).
template <int D>
double enskog_rate(double eta) {
  const double pi = std::numbers::pi, density = D == 3 ? 6 * eta / pi : 4 * eta / pi;
  return (D == 3 ? 4 * std::sqrt(pi) : 2 * std::sqrt(pi)) * density * contact_value<D>(eta);
}

/// The mean of |v| at mass 1 and temperature 1.
template <int D>
double mean_speed() {
  return D == 3 ? std::sqrt(8 / std::numbers::pi) : std::sqrt(std::numbers::pi / 2);
}

/// One species of a mixture: its fraction of all particles, and its diameter.
struct Component {
  double fraction, diameter;
};

/// a = ⟨σ⟩⟨σ²⟩/⟨σ³⟩ and b = ⟨σ²⟩³/⟨σ³⟩²: both equations below depend on these alone; 1 for equal spheres.
struct MixtureMoments {
  double a, b;
  explicit MixtureMoments(std::span<const Component> components) {
    double m1 = 0, m2 = 0, m3 = 0;
    for (const auto& c : components) {
      m1 += c.fraction * c.diameter;
      m2 += c.fraction * std::pow(c.diameter, 2);
      m3 += c.fraction * std::pow(c.diameter, 3);
    }
    a = m1 * m2 / m3;
    b = m2 * m2 * m2 / (m3 * m3);
  }
};

/// A mixture of hard spheres: Mansoori, Carnahan, Starling, Leland, J. Chem. Phys. 54 (1971) 1523. B2 and B3 are exact.
/// For equal spheres it is the equation of Carnahan and Starling, 0.3 % low at packing fractions about 0.35; for
/// mixtures it is up to 0.7 % below extended_mixture().
inline double mixture(std::span<const Component> components, double eta) {
  const MixtureMoments m(components);
  const double e = 1 - eta;
  return 1 / e + 3 * eta * m.a / (e * e) + eta * eta * (3 - eta) * m.b / (e * e * e);
}

/// A mixture from the equation of state of equal spheres: Santos, Yuste, López de Haro, Mol. Phys. 96 (1999) 1, with
/// Kolafa's spheres(). B2 and B3 are exact.
inline double extended_mixture(std::span<const Component> components, double eta) {
  const MixtureMoments m(components);
  return 1 + (spheres(eta) - 1) * (m.a + m.b) / 2 + eta / (1 - eta) * (1 + m.a - 2 * m.b);
}

}  // namespace carom::literature
