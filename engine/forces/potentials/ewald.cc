// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/potentials/ewald.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <utility>

#include "engine/base/elementary.h"
#include "engine/base/error.h"
#include "engine/base/normal_deviates.h"
#include "engine/forces/potentials/damped_coulomb.h"
#include "engine/forces/simd/wave_kernels.h"

namespace carom {
namespace {

constexpr double kPi = std::numbers::pi;
// From here to the cutoff the switching function takes the pair term to zero; the force error that it causes is about
// that of ending the pair term here.
constexpr double kSwitchFrom = 0.95;  // of the cutoff
// α = √π (c N/Ω²)^(1/6) makes pairs and waves cost the same, c the cost of a pair over that of a wave of a particle
// (Kolafa, Perram); c is taken as 9.3, the sixth power of:
constexpr double kPairCost = 1.45;
constexpr std::size_t kMostWaves = std::size_t{1} << 24;

using Vec3 = Vec<3>;

/// The numbers e^(2πi n u), n = −most … most.
class Phases {
 public:
  explicit Phases(int most) : most_(most), re_(2 * most + 1 + WaveRow::kMultiple), im_(re_.size()) {}

  void set(double u) {
    const auto [cos, sin] = cosine_and_sine(u);
    re_[most_] = 1;
    im_[most_] = 0;
    for (int n = 1; n <= most_; ++n) {
      const double re = re_[most_ + n - 1], im = im_[most_ + n - 1];
      re_[most_ + n] = re * cos - im * sin;
      im_[most_ + n] = re * sin + im * cos;
      re_[most_ - n] = re_[most_ + n];
      im_[most_ - n] = -im_[most_ + n];
    }
  }
  const double* re() const { return re_.data() + most_; }  // of n = 0
  const double* im() const { return im_.data() + most_; }

 private:
  int most_;
  std::vector<double> re_, im_;
};

/// One half of the vectors k = 2π (a/L_x, b/L_y, c/L_z) with 0 < |k| ≤ k_c, in rows of consecutive c.
struct Waves {
  std::array<int, 3> most;  // largest |a|, |b|, |c|
  Vec3 unit;                // 2π/L
  double longest;           // k_c
  std::vector<WaveRow> rows;
  std::vector<double> weight;   // 2 (C/2Ω) (4π/k²) e^(−k²/4α²): for both halves; padding has 0
  std::vector<double> squared;  // k²

  Waves(const EwaldSplit& split, const Vec3& edges, double constant) : longest(split.wave_cutoff) {
    const double volume = edges.prod();
    for (int k = 0; k < 3; ++k) {
      unit[k] = 2 * kPi / edges[k];
      most[k] = static_cast<int>(std::min(longest / unit[k], 1e6));
    }
    for (int a = 0; a <= most[0]; ++a)
      for (int b = a == 0 ? 0 : -most[1]; b <= most[1]; ++b) {
        const double flat = unit[0] * unit[0] * a * a + unit[1] * unit[1] * b * b;
        if (flat > longest * longest) continue;
        const int end = static_cast<int>(std::sqrt(longest * longest - flat) / unit[2]);
        const int start = a == 0 && b == 0 ? 1 : -end;
        if (end < start) continue;
        const auto first = static_cast<unsigned>(weight.size()), count = static_cast<unsigned>(end - start + 1);
        const unsigned padded = (count + WaveRow::kMultiple - 1) / WaveRow::kMultiple * WaveRow::kMultiple;
        rows.push_back({a, b, start, first, padded});
        for (int c = start; c <= end; ++c) {
          const double k2 = flat + unit[2] * unit[2] * c * c;
          squared.push_back(k2);
          weight.push_back(constant / volume * 4 * kPi / k2 * elementary::exp(-k2 / (4 * split.alpha * split.alpha)));
        }
        weight.resize(first + padded, 0.0);
        squared.resize(first + padded, 0.0);
      }
  }
  std::size_t size() const { return weight.size(); }
};

/// One complex number for each k.
struct Amplitudes {
  std::vector<double> re, im;
};

double sinc(double y) { return y == 0 ? 1 : cosine_and_sine(y / (2 * kPi))[1] / y; }

struct EwaldOptions {
  EwaldSplit split;
  double constant;
  bool vacuum;
  double constant_energy;  // of each charge with itself and with the background [energy]
  double background;       // the latter
  std::size_t total;       // number of particles on all ranks
};

class EwaldTerm final : public Interaction<3> {
 public:
  EwaldTerm(const Box<3>& box, const Particles<3>& particles, EwaldOptions options, std::shared_ptr<const Waves> waves,
            std::unique_ptr<Interaction<3>> pairs)
      : box_(box),
        particles_(particles),
        options_(options),
        waves_(std::move(waves)),
        pairs_(std::move(pairs)),
        phases_{Phases(waves_->most[0]), Phases(waves_->most[1]), Phases(waves_->most[2])} {}

  void add_energy(Positions<3> x, PotentialSums& sums) const override {
    pairs_->add_energy(x, sums);
    need_finite(particles_, x);
    add_sums(x, sums);
  }

  /// The stress of a wave is that of its energy, δ_ab − 2 k_a k_b (1/k² + 1/4α²) times it (Nosé, Klein, Mol. Phys. 50
  /// (1983) 1055).
  void add_fluxes(Positions<3> x, Positions<3> v, PairFluxes<3>& fluxes) const override {
    if (options_.vacuum)
      throw Error(Failure::deck,
                  "ewald with surface = \"vacuum\" has no formula for the pressure tensor; use the default surface, or "
                  "no pressure_tensor and no transport");
    pairs_->add_fluxes(x, v, fluxes);
    fluxes.heat_known = false;
    need_finite(particles_, x);
    if (x.empty() || !particles_.owns(0)) return;  // as in add_sums()
    const Amplitudes& s = structure(x);
    const double scale = 0.25 / (options_.split.alpha * options_.split.alpha);
    for (const WaveRow& row : waves_->rows)
      for (unsigned m = 0; m < row.count; ++m) {
        const std::size_t k = row.first + m;
        const double energy = waves_->weight[k] * (s.re[k] * s.re[k] + s.im[k] * s.im[k]);
        if (waves_->weight[k] == 0) continue;
        const Vec3 wave = waves_->unit.cwiseProduct(Vec3(row.a, row.b, row.c + static_cast<int>(m)));
        for (int a = 0; a < 3; ++a)
          for (int b = 0; b < 3; ++b)
            fluxes.stress[3 * a + b].add(energy *
                                         ((a == b ? 1 : 0) - 2 * wave[a] * wave[b] * (1 / waves_->squared[k] + scale)));
      }
    for (const std::size_t k : {0, 4, 8}) fluxes.stress[k].add(options_.background);
  }

  void add_forces(Positions<3> x, ForceSums<3>& forces, PotentialSums* sums) const override {
    pairs_->add_forces(x, forces, sums);
    need_finite(particles_, x);
    const Amplitudes field = weighted(structure(x));
    std::vector<Vec3> f(x.size(), Vec3::Zero());
    for (const Id j : charged()) f[j] = particles_.charge[j] * pull(x[j], field, Vec3::Zero());
    add_surface(dipole(x, x), f);
    if (!add_rounded(f, forces, 1))
      throw Error(Failure::numerical,
                  "a force of the Ewald sum is too large or no number; use a smaller "
                  "integrator.step, or place the charges farther apart");
    if (sums) add_sums(x, *sums);
  }

  std::uint64_t add_mean_forces(Positions<3> x, Positions<3> x_new, ForceSums<3>& forces, const char* changed,
                                int sign) const override {
    const std::uint64_t own = pairs_->add_mean_forces(x, x_new, forces, changed, sign);
    // All charges feel a change of one of them, so `changed` does not matter here.
    if (!same(x, mean_.x) || !same(x_new, mean_.x_new)) {
      mean_.x.assign(x.begin(), x.end());
      mean_.x_new.assign(x_new.begin(), x_new.end());
      find_mean_forces(x, x_new);
    }
    if (!add_rounded(mean_.force, forces, sign)) forces.invalidate();
    return own;
  }

  void add_hessian_product(Positions<3> x, Positions<3> w, ForceSums<3>& out) const override {
    pairs_->add_hessian_product(x, w, out);
    std::vector<Vec3> f(x.size(), Vec3::Zero());
    if (!moderate(x) || !moderate(w)) return out.invalidate();
    const Amplitudes field = weighted(structure(x)), change = weighted(structure_change(x, w));
    for (const Id j : charged())
      f[j] = -particles_.charge[j] * (pull(x[j], change, Vec3::Zero()) + pull_change(x[j], field, w[j]));
    add_surface(-weighted_sum(w), f);
    if (!add_rounded(f, out, 1)) out.invalidate();
  }

  std::unique_ptr<Interaction<3>> among(const Particles<3>& some) const override {
    if (some.size() < options_.total) return nullptr;
    auto pairs = pairs_->among(some);
    if (!pairs) return nullptr;
    return std::make_unique<EwaldTerm>(box_, some, options_, waves_, std::move(pairs));
  }
  double reach(Positions<3>) const override { return std::numeric_limits<double>::infinity(); }
  double reach(const Particles<3>&, Communicator&) const override { return std::numeric_limits<double>::infinity(); }
  std::uint64_t interacting_pairs(Positions<3> x) const override { return pairs_->interacting_pairs(x); }
  ForceScale scale(double distance) const override { return pairs_->scale(distance); }
  void use(const PairKernels& kernels) override { pairs_->use(kernels); }

 private:
  static bool same(Positions<3> x, const std::vector<Vec3>& y) {
    return x.size() == y.size() && !y.empty() && std::memcmp(x.data(), y.data(), sizeof(Vec3) * y.size()) == 0;
  }
  /// Whether all vectors are finite and so small that their number of edges fits an integer.
  bool moderate(Positions<3> x) const {
    const double most = 0x1p40 * box_.edges.minCoeff();
    return std::ranges::all_of(x, [&](const Vec3& each) { return (each.array().abs() < most).all(); });
  }

  /// The mass of a charge, or its limit relative to those of fixed ones.
  double weight(Id i) const {
    if (!fixed_) return particles_.mass[i];
    return particles_.fixed(i) ? 1 : 0;
  }
  const std::vector<Id>& charged() const {
    if (charged_.empty())
      for (Id i = 0; i < particles_.size(); ++i)
        if (particles_.charge[i] != 0) {
          charged_.push_back(i);
          fixed_ |= particles_.fixed(i);
          largest_charge_ = std::max(largest_charge_, std::abs(particles_.charge[i]));
        }
    if (mass_ == 0)
      for (const Id i : charged_) mass_ += weight(i);
    return charged_;
  }

  /// The waves at x.
  WaveTask waves_at(const Vec3& x) const {
    WaveTask task{waves_->rows.data(), waves_->rows.size(), {}, {}};
    for (int k = 0; k < 3; ++k) {
      phases_[k].set(x[k] / box_.edges[k]);
      task.re[k] = phases_[k].re();
      task.im[k] = phases_[k].im();
    }
    return task;
  }

  /// Σ_j factor_j(k) e^(ik·x_j) in fixed point, |factor_j| ≤ 2^exponent. Terms are rounded to the quantum by adding a
  /// constant; the integers are then the mantissas' differences.
  template <class Factor>
  void sum_terms(Positions<3> x, int exponent, Factor&& factor, Amplitudes& sum) const {
    const double n = static_cast<double>(options_.total);
    const double quantum = std::ldexp(std::max(0x1p-50, std::ldexp(1.0, std::ilogb(n) - 60)), exponent);
    const double shift = 0x1.8p52 * quantum;
    std::vector<std::uint64_t> re(waves_->size()), im(waves_->size());
    for (const Id j : charged()) kernels_->add(waves_at(x[j]), factor(j), shift, re.data(), im.data());
    const std::uint64_t shifts = charged().size() * std::bit_cast<std::uint64_t>(shift);
    sum.re.resize(waves_->size());
    sum.im.resize(waves_->size());
    for (std::size_t k = 0; k < waves_->size(); ++k) {
      sum.re[k] = quantum * static_cast<double>(static_cast<std::int64_t>(re[k] - shifts));
      sum.im[k] = quantum * static_cast<double>(static_cast<std::int64_t>(im[k] - shifts));
    }
  }

  /// S(k)
  void sum_structure(Positions<3> x, Amplitudes& sum) const {
    charged();
    sum_terms(
        x, std::ilogb(largest_charge_) + 1,
        [&](Id j) {
          return WaveFactor{particles_.charge[j], 0, 0, 0};
        },
        sum);
  }
  /// S(k), kept for the last positions.
  const Amplitudes& structure(Positions<3> x) const {
    if (!same(x, at_)) {
      sum_structure(x, structure_);
      at_.assign(x.begin(), x.end());
    }
    return structure_;
  }
  /// The derivative of S(k) along w, over i: Σ q_j (k·w_j) e^(ik·x_j), times i.
  Amplitudes structure_change(Positions<3> x, Positions<3> w) const {
    charged();
    double longest = 0;
    for (const Id j : charged()) longest = std::max(longest, w[j].norm());
    Amplitudes sum;
    const double most = std::max(largest_charge_ * longest * waves_->longest, 0x1p-900);
    sum_terms(
        x, std::ilogb(most) + 2,
        [&](Id j) {
          const Vec3 step = particles_.charge[j] * waves_->unit.cwiseProduct(w[j]);
          return WaveFactor{0, step[0], step[1], step[2]};
        },
        sum);
    for (std::size_t k = 0; k < sum.re.size(); ++k) {
      const double re = sum.re[k];
      sum.re[k] = -sum.im[k];
      sum.im[k] = re;
    }
    return sum;
  }
  /// 2 A S for each k of the half.
  Amplitudes weighted(const Amplitudes& s) const {
    Amplitudes field{s.re, s.im};
    for (std::size_t k = 0; k < waves_->size(); ++k) {
      field.re[k] *= 2 * waves_->weight[k];
      field.im[k] *= 2 * waves_->weight[k];
    }
    return field;
  }

  /// The force on a unit charge that moves by `moved` about x: Σ_k k sinc(k·Δ/2) Im[field* e^(ik·x)].
  Vec3 pull(const Vec3& x, const Amplitudes& field, const Vec3& moved) const {
    const WaveTask task = waves_at(x);
    const Vec3 turn = 0.5 * moved.cwiseProduct(waves_->unit);
    Vec3 sum = Vec3::Zero();
    if (moved.isZero(0)) {
      kernels_->pull(task, field.re.data(), field.im.data(), sum.data());
    } else if (0.5 * waves_->longest * moved.norm() < 1 - 1e-9) {
      kernels_->pull_moved(task, {0, turn[0], turn[1], turn[2]}, field.re.data(), field.im.data(), sum.data());
    } else {
      for (const WaveRow& row : waves_->rows)
        for (unsigned m = 0; m < row.count; ++m) {
          const Vec3 index(row.a, row.b, row.c + static_cast<int>(m));
          double re = 1, im = 0;
          for (int k = 0; k < 3; ++k) {
            const auto n = static_cast<int>(index[k]);
            const double last = re;
            re = last * task.re[k][n] - im * task.im[k][n];
            im = last * task.im[k][n] + im * task.re[k][n];
          }
          sum += index * ((field.re[row.first + m] * im - field.im[row.first + m] * re) * sinc(index.dot(turn)));
        }
    }
    return sum.cwiseProduct(waves_->unit);
  }
  /// The change of the force on a unit charge as it moves along w in a constant field.
  Vec3 pull_change(const Vec3& x, const Amplitudes& field, const Vec3& w) const {
    const Vec3 along = w.cwiseProduct(waves_->unit);
    Vec3 sum;
    kernels_->pull_change(waves_at(x), {0, along[0], along[1], along[2]}, field.re.data(), field.im.data(), sum.data());
    return sum.cwiseProduct(waves_->unit);
  }

  void find_mean_forces(Positions<3> x, Positions<3> x_new) const {
    auto& f = mean_.force;
    f.assign(x.size(), Vec3::Constant(std::numeric_limits<double>::quiet_NaN()));
    if (!moderate(x) || !moderate(x_new)) return;
    std::ranges::fill(f, Vec3::Zero());
    Vec3 centre = Vec3::Zero();  // motion of the centre of mass
    for (const Id j : charged()) centre += weight(j) * (x_new[j] - x[j]);
    centre /= mass_;
    std::vector<Vec3> relative(x.begin(), x.end());
    for (const Id j : charged()) relative[j] = x_new[j] - centre;
    Amplitudes field, after;
    sum_structure(relative, after);
    field = structure(x);
    for (std::size_t k = 0; k < waves_->size(); ++k) {
      field.re[k] = 0.5 * (field.re[k] + after.re[k]);
      field.im[k] = 0.5 * (field.im[k] + after.im[k]);
    }
    field = weighted(field);
    for (const Id j : charged())
      f[j] = particles_.charge[j] * pull(0.5 * (x[j] + relative[j]), field, relative[j] - x[j]);
    if (options_.vacuum) add_surface(0.5 * (dipole(x, x) + dipole(x, x_new)), f);
  }

  Vec3 weighted_sum(Positions<3> w) const {
    Vec3 sum = Vec3::Zero();
    for (const Id j : charged()) sum += particles_.charge[j] * w[j];
    return sum;
  }
  /// Σ q x_new, where x_new is unwrapped: x is in the image that is the nearest to the particles' own positions.
  Vec3 dipole(Positions<3> x, Positions<3> x_new) const {
    Vec3 sum = Vec3::Zero();
    if (!options_.vacuum) return sum;
    for (const Id j : charged())
      for (int k = 0; k < 3; ++k) {
        const double edge = box_.edges[k];
        const double edges = particles_.image[j][k] + std::nearbyint((particles_.x[j][k] - x[j][k]) / edge);
        sum[k] += particles_.charge[j] * (x_new[j][k] + edges * edge);
      }
    return sum;
  }
  /// Adds the forces of the surface of charge around a sphere in vacuum.
  void add_surface(const Vec3& dipole, std::vector<Vec3>& f) const {
    if (!options_.vacuum) return;
    const Vec3 field = -options_.constant * 4 * kPi / 3 / box_.edges.prod() * dipole;
    for (const Id j : charged()) f[j] += particles_.charge[j] * field;
  }

  void add_sums(Positions<3> x, PotentialSums& sums) const {
    if (x.empty() || !particles_.owns(0)) return;  // every rank has all particles; one of them adds
    const auto add = [&](double energy, double virial) {
      sums.energy.add(energy);
      sums.magnitude.add(std::abs(energy));
      sums.virial.add(virial);
    };
    const Amplitudes& s = structure(x);
    const double scale = 0.5 / (options_.split.alpha * options_.split.alpha);
    for (std::size_t k = 0; k < waves_->size(); ++k) {
      const double energy = waves_->weight[k] * (s.re[k] * s.re[k] + s.im[k] * s.im[k]);
      add(energy, energy * (1 - scale * waves_->squared[k]));
    }
    add(options_.constant_energy - options_.background, 0);
    add(options_.background, 3 * options_.background);
    if (options_.vacuum) {
      const double energy = options_.constant * 2 * kPi / 3 / box_.edges.prod() * dipole(x, x).squaredNorm();
      add(energy, energy);
    }
  }

  /// Adds forces on own particles, rounded to quanta so that their sum over all particles is exactly zero. Returns
  /// false if one is too large or no number.
  bool add_rounded(const std::vector<Vec3>& f, ForceSums<3>& forces, int sign) const {
    using Whole = ForceSums<3>::Whole;
    constexpr std::int64_t kHalf = std::int64_t{1} << 31;  // both parts of a sum of quanta are exact as doubles
    const ForceLimits limits = forces.make_room(2);
    const auto& charges = charged();
    std::vector<std::array<std::int64_t, 3>> rounded(charges.size());
    for (int k = 0; k < 3; ++k) {
      Whole net = 0;
      for (std::size_t n = 0; n < charges.size(); ++n) {
        const double quanta = f[charges[n]][k] / forces.quantum();
        if (!(std::abs(quanta) < 0x1p61)) return false;
        net += rounded[n][k] = std::llrint(quanta);
      }
      const double per_mass = static_cast<double>(net) / mass_;
      for (std::size_t n = 0; n < charges.size(); ++n) {
        const std::int64_t share = std::llrint(per_mass * weight(charges[n]));
        rounded[n][k] -= share;
        net -= share;
      }
      for (std::size_t n = 0; net != 0; n = (n + 1) % charges.size()) {  // the rounding of the shares
        const int one = net > 0 ? 1 : -1;
        rounded[n][k] -= one;
        net -= one;
      }
    }
    for (std::size_t n = 0; n < charges.size(); ++n) {
      if (!particles_.owns(charges[n])) continue;
      Vec3 upper, lower;
      for (int k = 0; k < 3; ++k) {
        const std::int64_t low = rounded[n][k] % kHalf;
        upper[k] = static_cast<double>(rounded[n][k] - low);
        lower[k] = static_cast<double>(low);
      }
      for (const Vec3& part : {upper, lower})
        if (!forces.add(charges[n], sign * forces.quantum() * part, limits)) return false;
    }
    return true;
  }

  const Box<3>& box_;
  const Particles<3>& particles_;
  EwaldOptions options_;
  std::shared_ptr<const Waves> waves_;
  std::unique_ptr<Interaction<3>> pairs_;
  const WaveKernels* kernels_ = &widest_kernels<WaveKernels>();
  // Caches and scratch, which do not affect the sums.
  mutable std::array<Phases, 3> phases_;
  mutable std::vector<Id> charged_;
  mutable double mass_ = 0, largest_charge_ = 0;  // of the charged particles
  mutable bool fixed_ = false;                    // whether one of them is fixed
  mutable std::vector<Vec3> at_;
  mutable Amplitudes structure_;                                // S(k) at at_
  mutable struct { std::vector<Vec3> x, x_new, force; } mean_;  // the last mean forces
};

}  // namespace

EwaldSplit ewald_split(double accuracy, const ChargeSums& charges, double volume, double longest) {
  const double n = charges.count.value(), q2 = charges.squares.value();
  const double spacing = elementary::cbrt(volume / n);
  const double error = 0.5 * accuracy * q2 / n / (spacing * spacing);  // of either sum
  const auto root_log = [](double x) { return std::sqrt(std::max(1.0, elementary::log(x))); };
  double alpha = kPairCost * std::sqrt(kPi) * elementary::pow(n / (volume * volume), 1.0 / 6);
  const auto pairs = [&](double r) { return root_log(2 * q2 / (std::sqrt(n * r * volume) * error)); };
  double end = 3 / alpha;  // where the pair sum is cut off
  for (int turn = 0; turn < 20; ++turn) end = pairs(end) / alpha;
  if (end > kSwitchFrom * longest) {
    end = kSwitchFrom * longest;
    alpha = pairs(end) / end;
  }
  double t = 3;  // k_c/2α
  for (int turn = 0; turn < 20; ++turn) {
    t = root_log(q2 * alpha * std::sqrt(8 / (n * volume * 2 * alpha * t)) / error);
  }
  return {alpha, end, end / kSwitchFrom, 2 * alpha * t};
}

std::unique_ptr<Interaction<3>> ewald(const Parameters& p, const InteractionContext<3>& context) {
  constexpr std::string_view type = "coulomb";
  const Box<3>& box = context.box;
  for (int k = 0; k < 3; ++k)
    if (!box.periodic(k))
      options::refuse(type,
                      "form = \"ewald\" needs a box that is periodic along all three axes; make the boundaries "
                      "'periodic', or use form = \"plain\"");
  if (p.has("species") || (p.has("exclude") && p.text("exclude") == "bonded"))
    options::refuse(type, "form = \"ewald\" acts between all charges so far; leave out 'species' and 'exclude'");
  const double accuracy = p.has("accuracy") ? p.real("accuracy") : 1e-5;
  if (!(accuracy >= 1e-14 && accuracy <= 0.1))
    options::refuse(type, "'accuracy' is out of range; give a number from 1e-14 to 0.1");
  ChargeSums charges;
  for (const double q : context.particles.charge) {
    if (q == 0) continue;
    charges.total.add(q);
    charges.absolute.add(std::abs(q));
    charges.squares.add(q * q);
    charges.count.add(1.0);
  }
  if (context.ranks) charges = sum_of_all(*context.ranks, charges);
  if (charges.count.value() == 0) {
    if (context.placed)
      options::refuse(type,
                      "form = \"ewald\" finds no charges; give the species a 'charge', or leave the interaction out");
    charges.squares.add(1.0), charges.count.add(1.0);
  }
  const double constant = p.real("constant"), total = charges.total.value(), volume = box.edges.prod();
  const bool vacuum = p.has("surface") && p.text("surface") == "vacuum";
  const bool neutral = std::abs(total) <= 1e-12 * charges.absolute.value();
  if (vacuum && !neutral)
    options::refuse(type, "surface = \"vacuum\" needs a neutral system, but the charges add up to " +
                              short_text(total) + "; change the charges, or use surface = \"conducting\"");
  const EwaldSplit split = ewald_split(accuracy, charges, volume, 0.5 * box.edges.minCoeff());
  const double sphere = split.wave_cutoff / (2 * kPi);
  if (4 * kPi / 3 * sphere * sphere * sphere * volume > 2 * static_cast<double>(kMostWaves))
    options::refuse(type, "form = \"ewald\" would need more than " + std::to_string(kMostWaves) +
                              " waves; make the box less elongated, or 'accuracy' less strict");
  const double background = neutral ? 0.0 : -constant * kPi * total * total / (2 * split.alpha * split.alpha * volume);
  const double self = -constant * split.alpha / std::sqrt(kPi) * charges.squares.value();
  const DampedCoulomb whole(constant, split.alpha);
  auto pairs =
      options::within_reach<3>(type, Cut<DampedCoulomb>(whole, split.cutoff, CutKind::switched, split.switch_from),
                               PairWeight::charges, p, context, whole);
  return std::make_unique<EwaldTerm>(
      box, context.particles, EwaldOptions{split, constant, vacuum, self + background, background, context.total},
      std::make_shared<const Waves>(split, box.edges, constant), std::move(pairs));
}

}  // namespace carom
