// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/potentials/ewald.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "engine/base/elementary.h"
#include "engine/base/error.h"
#include "engine/forces/potentials/balanced_forces.h"
#include "engine/forces/potentials/damped_coulomb.h"
#include "engine/forces/potentials/ewald_pair.h"
#include "engine/forces/potentials/field_term.h"
#include "engine/forces/potentials/inverse_distance.h"
#include "engine/forces/potentials/uniform_field.h"
#include "engine/forces/potentials/wave_sums.h"
#include "engine/ranks/communicator.h"

namespace carom {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::size_t kMostWaves = std::size_t{1} << 24;

using Vec3 = Vec<3>;

struct EwaldOptions {
  EwaldSplit split;
  double constant;
  PairWeight weight;       // charges or masses
  Vec3 edges;              // of the box that is repeated: that of the system, or one with room between its two walls
  Vec3 surface;            // V has the terms (C/2) surface_k (M_k² − Q Σ q_j x_jk² − Q² L_k²/12) [1/volume]
  double excess;           // Q; 0 if the charges are neutral
  double constant_energy;  // of each charge with itself and with the background, and of charged walls [energy]
  double background;       // the latter
  std::size_t total;       // number of particles on all ranks
  ChargeSums charges;      // of all ranks
};

class EwaldTerm final : public Interaction<3> {
 public:
  EwaldTerm(const Box<3>& box, const Particles<3>& particles, const EwaldOptions& options,
            std::shared_ptr<const Waves> waves, std::vector<std::unique_ptr<Interaction<3>>> parts)
      : box_(box),
        particles_(particles),
        options_(options),
        parts_(std::move(parts)),
        charge_(*pair_factors(options_.weight, particles_)),
        waves_(std::move(waves), particles, charge_, options.charges.largest, options.total) {}

  void add_energy(Positions<3> x, PotentialSums& sums) const override {
    for (const auto& part : parts_) part->add_energy(x, sums);
    need_inside(x);
    add_sums(x, sums);
  }

  /// The stress of a wave is that of its energy, δ_ab − 2 k_a k_b (1/k² + 1/4α²) times it (Nosé, Klein, Mol. Phys. 50
  /// (1983) 1055). A charge's share of energy and stress, with Re S*(k) q_j e^(ik·x_j) in the place of |S(k)|², times
  /// its velocity is its share of the heat flux (Bernu, Vieillefosse, Phys. Rev. A 18 (1978) 2345).
  void add_fluxes(Positions<3> x, Positions<3> v, PairFluxes<3>& fluxes) const override {
    if (has_surface())
      throw Error(Failure::deck,
                  "ewald with surface = \"vacuum\" or between walls has no formula for the pressure tensor; use the "
                  "default surface, or no pressure_tensor and no transport");
    if (!fluxes.slab_of.empty())
      throw Error(Failure::deck, "ewald has no formula for the pressure in slabs; set profile_pressure = false");
    for (const auto& part : parts_) part->add_fluxes(x, v, fluxes);
    need_inside(x);
    const Amplitudes& s = structure(x);
    const std::array<Amplitudes, 3> current = waves_.current(x, v);
    const double own = options_.constant * options_.split.alpha / std::sqrt(kPi);
    const double background = options_.excess == 0 ? 0.0 : 2 * options_.background / options_.excess;
    const Vec3 constant = total([&](Id j) { return Vec3(charge_[j] * (background - own * charge_[j]) * v[j]); });
    if (waves_.ranks().rank() != 0) return;
    for (const std::size_t k : {0, 4, 8}) fluxes.stress[k].add(options_.background);
    for (int a = 0; a < 3; ++a) fluxes.heat[a].add(constant[a]);
    const double scale = 0.25 / (options_.split.alpha * options_.split.alpha);
    for (const WaveRow& row : waves_.waves().rows)
      for (unsigned m = 0; m < 2 * row.count; ++m) {
        const int sign = m < row.count ? 1 : -1;
        const std::size_t k = row.first + m % row.count;
        if (waves_.waves().weight[k] == 0) continue;
        const Vec3 wave = waves_.waves().unit.cwiseProduct(Vec3(row.a, row.b, sign * static_cast<int>(m % row.count)));
        const std::array<double, 2> here = wave_of(s, k, sign);
        Vec3 work;  // Re S*(k) Σ q v e^(ik·x)
        for (int a = 0; a < 3; ++a) {
          const std::array<double, 2> flow = wave_of(current[a], k, sign);
          work[a] = 0.5 * waves_.waves().weight[k] * (here[0] * flow[0] + here[1] * flow[1]);
        }
        const double energy = 0.5 * waves_.waves().weight[k] * (here[0] * here[0] + here[1] * here[1]);
        for (int a = 0; a < 3; ++a) {
          fluxes.heat[a].add(work[a]);
          for (int b = 0; b < 3; ++b) {
            const double tensor = (a == b ? 1 : 0) - 2 * wave[a] * wave[b] * (1 / waves_.waves().squared[k] + scale);
            fluxes.stress[3 * a + b].add(energy * tensor);
            fluxes.heat[a].add(tensor * work[b]);
          }
        }
      }
  }

  void add_forces(Positions<3> x, ForceSums<3>& forces, PotentialSums* sums) const override {
    add_forces_early(x, forces, sums, [] {});
  }
  bool ages() const override {
    return std::ranges::any_of(parts_, [](const auto& part) { return part->ages(); });
  }
  void renew() const override {
    for (const auto& part : parts_) part->renew();
  }
  void add_forces_early(Positions<3> x, ForceSums<3>& forces, PotentialSums* sums,
                        const Arrival& arrive) const override {
    for (const auto& part : parts_) part->add_forces_early(x, forces, sums, arrive);
    need_inside(x);
    std::vector<Vec3> f = waves_.pull(x, waves_.potential(structure(x)));
    add_surface(dipole(x, x), x, f);
    if (!add(rounded(f, forces.quantum()), charged(), forces, 1))
      throw Error(Failure::numerical,
                  "a force of the Ewald sum is too large or no number; use a smaller "
                  "integrator.step, or place the charges farther apart");
    if (sums) add_sums(x, *sums);
  }

  std::uint64_t add_mean_forces(Positions<3> x, Positions<3> x_new, ForceSums<3>& forces, const char* changed,
                                int sign) const override {
    std::uint64_t own = 0;
    for (const auto& part : parts_) own += part->add_mean_forces(x, x_new, forces, changed, sign);
    // All charges feel a change of one of them, so `changed` does not matter here. What is subtracted has been added
    // before; other ranks take no part in that.
    if (sign > 0 || !same(x, mean_.x) || !same(x_new, mean_.x_new) || mean_.quantum != forces.quantum()) {
      mean_.x.assign(x.begin(), x.end());
      mean_.x_new.assign(x_new.begin(), x_new.end());
      mean_.quantum = forces.quantum();
      mean_.force = rounded(mean_forces(x, x_new), mean_.quantum);
    }
    if (!add(mean_.force, charged(), forces, sign)) forces.invalidate();
    return own;
  }

  void add_hessian_product(Positions<3> x, Positions<3> w, ForceSums<3>& out) const override {
    for (const auto& part : parts_) part->add_hessian_product(x, w, out);
    if (!all_moderate(x, w)) return out.invalidate();
    std::vector<Vec3> f = waves_.pull(x, waves_.potential(waves_.structure_change(x, w)));
    const std::vector<Vec3> own = waves_.pull_change(x, waves_.potential(structure(x)), w);
    for (const Id j : charged()) f[j] = -(f[j] + own[j]);
    if (has_surface()) add_surface(total([&](Id j) { return Vec3(charge_[j] * w[j]); }), w, f, -1);
    if (!add(rounded(f, out.quantum()), charged(), out, 1)) out.invalidate();
  }

  std::unique_ptr<Interaction<3>> among(const Particles<3>& some) const override {
    std::vector<std::unique_ptr<Interaction<3>>> parts;
    for (const auto& part : parts_)
      if (parts.push_back(part->among(some)); !parts.back()) return nullptr;
    return std::make_unique<EwaldTerm>(box_, some, options_, waves_.shared(), std::move(parts));
  }
  void join(Communicator& ranks) override { waves_.join(ranks); }
  void add_listed_pairs(std::span<std::uint32_t> of_particle) const override {
    for (const auto& part : parts_) part->add_listed_pairs(of_particle);
  }
  double reach(Positions<3> x) const override {
    double reach = 0;
    for (const auto& part : parts_) reach = std::max(reach, part->reach(x));
    return reach;
  }
  double reach(const Particles<3>& block, Communicator& ranks) const override {
    double reach = 0;
    for (const auto& part : parts_) reach = std::max(reach, part->reach(block, ranks));
    return reach;
  }
  std::uint64_t interacting_pairs(Positions<3> x) const override {
    std::uint64_t own = 0;
    for (const auto& part : parts_) own += part->interacting_pairs(x);
    return own;
  }
  ForceScale scale(double distance) const override { return parts_.front()->scale(distance); }
  bool keeps_momentum() const override {
    return std::ranges::all_of(parts_, [](const auto& part) { return part->keeps_momentum(); });
  }
  Caution caution() const override {
    if (options_.background == 0 || has_surface()) return {};
    if (options_.weight == PairWeight::masses)
      return {
          "a uniform background of negative mass fills the periodic box, without which the sum over all images does "
          "not exist (the Jeans swindle)",
          "use form = \"plain\" and open boundaries or walls for a system that is alone in space"};
    return {"the charges add up to " + short_text(options_.charges.total.value()) +
                ", which a uniform background neutralises",
            "change the charges if that is not what you mean"};
  }
  void use(const PairKernels& kernels) override {
    for (const auto& part : parts_) part->use(kernels);
  }

 private:
  /// Whether own charges are at the same places.
  bool same(Positions<3> x, const std::vector<Vec3>& y) const {
    const auto same_place = [&](Id j) { return x[j] == y[j]; };
    return x.size() == y.size() && std::ranges::all_of(charged(), same_place);
  }
  /// Whether the vectors of all charges on all ranks are finite and so small that their number of edges fits an
  /// integer.
  bool all_moderate(Positions<3> x, Positions<3> y) const {
    const double most = 0x1p40 * options_.edges.minCoeff();
    const auto moderate = [&](Id j) { return (x[j].array().abs() < most).all() && (y[j].array().abs() < most).all(); };
    return !any(!std::ranges::all_of(charged(), moderate));
  }

  /// Positions must be finite, and between the walls if there are any.
  void need_inside(Positions<3> x) const {
    need_finite(particles_, x);
    for (int k = 0; k < 3; ++k)
      for (const Id j : charged())
        if (!box_.periodic(k) && !(x[j][k] >= 0 && x[j][k] <= box_.edges[k]))
          throw Error(Failure::numerical, "particle " + std::to_string(particles_.id_of(j)) +
                                              " is not between the walls, as its Ewald sum requires; use a smaller "
                                              "integrator.step, or an integrator with hard cores");
  }

  // Functions of all ranks.

  bool any(bool here) const { return largest(here ? 1 : 0) > 0; }
  double largest(double value) const {
    waves_.ranks().largest({&value, 1});
    return value;
  }
  /// The exact sum of vector(j) over all charges.
  Vec3 total(auto&& vector) const {
    struct Sums {
      std::array<ExactSum, 3> of;
      void add(const Sums& other) {
        for (int k = 0; k < 3; ++k) of[k].add(other.of[k]);
      }
    } sums;
    std::array<ExactSeries, 3> own;
    for (const Id j : charged()) {
      const Vec3 term = vector(j);
      for (int k = 0; k < 3; ++k) own[k].add(term[k]);
    }
    for (int k = 0; k < 3; ++k) sums.of[k] = own[k].sum();
    sums = sum_of_all(waves_.ranks(), sums);
    return {sums.of[0].value(), sums.of[1].value(), sums.of[2].value()};
  }

  /// The mass of a charge, or its limit relative to those of fixed ones.
  double weight(Id i) const {
    if (options_.charges.fixed == 0) return particles_.mass[i];
    return particles_.fixed(i) ? 1 : 0;
  }
  double whole_weight() const {
    return options_.charges.fixed == 0 ? options_.charges.mass.value() : options_.charges.fixed;
  }
  const std::vector<Id>& charged() const { return waves_.charged(); }

  /// S(k), kept for the last positions.
  const Amplitudes& structure(Positions<3> x) const {
    if (any(!same(x, at_))) {
      structure_ = waves_.structure(x);
      at_.assign(x.begin(), x.end());
    }
    return structure_;
  }
  /// The mean forces on own charges; NaN if positions are not moderate.
  std::vector<Vec3> mean_forces(Positions<3> x, Positions<3> x_new) const {
    if (!all_moderate(x, x_new)) return {x.size(), Vec3::Constant(std::numeric_limits<double>::quiet_NaN())};
    // The motion of the centre of mass.
    const Vec3 centre = total([&](Id j) { return Vec3(weight(j) * (x_new[j] - x[j])); }) / whole_weight();
    std::vector<Vec3> relative(x.begin(), x.end());
    for (const Id j : charged()) relative[j] = x_new[j] - centre;
    Amplitudes mean = waves_.structure(relative);
    const Amplitudes& before = structure(x);
    for (std::size_t k = 0; k < mean.size(); ++k) mean[k] = 0.5 * (before[k] + mean[k]);
    std::vector<Vec3> middle(x.begin(), x.end()), half(x.size());
    for (const Id j : charged()) {
      middle[j] = 0.5 * (x[j] + relative[j]);
      half[j] = 0.5 * (relative[j] - x[j]);
    }
    std::vector<Vec3> f = waves_.pull_moved(middle, waves_.potential(mean), half);
    if (has_surface()) {
      for (const Id j : charged()) middle[j] = 0.5 * (x[j] + x_new[j]);
      add_surface(0.5 * (dipole(x, x) + dipole(x, x_new)), middle, f);
    }
    return f;
  }

  /// Σ q x_new, where x_new is unwrapped: x is in the image that is the nearest to the particles' own positions.
  Vec3 dipole(Positions<3> x, Positions<3> x_new) const {
    if (!has_surface()) return Vec3::Zero();
    return total([&](Id j) {
      Vec3 moment;
      for (int k = 0; k < 3; ++k) {
        const double edge = box_.edges[k], moved = box_.periodic(k) ? particles_.x[j][k] - x[j][k] : 0;
        const double edges = particles_.image[j][k] + std::nearbyint(moved / edge);
        moment[k] = charge_[j] * (x_new[j][k] + edges * edge);
      }
      return moment;
    });
  }
  bool has_surface() const { return !options_.surface.isZero(0); }
  /// Adds the forces of the terms with `surface`, −C surface_k q_j (M_k − Q x_jk), times `sign`.
  void add_surface(const Vec3& dipole, Positions<3> x, std::vector<Vec3>& f, double sign = 1) const {
    if (!has_surface()) return;
    const Vec3 slope = -sign * options_.constant * options_.surface;
    for (const Id j : charged()) f[j] += charge_[j] * slope.cwiseProduct(dipole - options_.excess * x[j]);
  }

  void add_sums(Positions<3> x, PotentialSums& sums) const {
    const auto add = [&](double energy, double virial) {
      sums.energy.add(energy);
      sums.magnitude.add(std::abs(energy));
      sums.virial.add(virial);
    };
    const Amplitudes& s = structure(x);
    Vec3 squares = dipole(x, x).cwiseAbs2();
    if (const double q = options_.excess; q != 0)
      squares -=
          q * (total([&](Id j) { return Vec3(charge_[j] * x[j].cwiseAbs2()); }) + q / 12 * options_.edges.cwiseAbs2());
    const double scale = 0.5 / (options_.split.alpha * options_.split.alpha);
    const auto me = static_cast<std::size_t>(waves_.ranks().rank()),
               ranks = static_cast<std::size_t>(waves_.ranks().size());
    for (std::size_t k = me; k < waves_.waves().size(); k += ranks) {
      double squares_here = 0;
      for (unsigned product = 0; product < WaveRow::kProducts; ++product) {
        const double amplitude = s[place_of(k, product)];
        squares_here += amplitude * amplitude;
      }
      const double energy = waves_.waves().weight[k] * squares_here;
      add(energy, energy * (1 - scale * waves_.waves().squared[k]));
    }
    if (me != 0) return;
    add(options_.constant_energy - options_.background, 0);
    add(options_.background, 3 * options_.background);
    if (has_surface()) {
      const double energy = 0.5 * options_.constant * options_.surface.dot(squares);
      add(energy, energy);
    }
  }

  /// The forces on own charges, which add up to zero over all ranks. Collective.
  BalancedForces rounded(const std::vector<Vec3>& f, double quantum) const {
    return balanced(
        f, charged(), particles_, options_.charges.first, quantum, [&](Id j) { return weight(j) / whole_weight(); },
        waves_.ranks());
  }

  const Box<3>& box_;
  const Particles<3>& particles_;
  EwaldOptions options_;
  std::vector<std::unique_ptr<Interaction<3>>> parts_;  // the pairs; bonded pairs that are excluded; charged walls
  const std::vector<double>& charge_;
  WaveSums waves_;
  // Caches, which do not affect the sums.
  mutable std::vector<Vec3> at_;
  mutable Amplitudes structure_;  // S(k) at at_
  mutable struct {
    std::vector<Vec3> x, x_new;
    double quantum;
    BalancedForces force;
  } mean_{};  // the last mean forces
};

}  // namespace

std::unique_ptr<Interaction<3>> ewald(std::string_view type, double constant, PairWeight weight, const Parameters& p,
                                      const InteractionContext<3>& context) {
  const Box<3>& box = context.box;
  int walled = -1;  // the axis with two walls
  for (int k = 0; k < 3; ++k) {
    if (box.periodic(k)) continue;
    if (!box.walled(k) || walled >= 0 || weight == PairWeight::masses)
      options::refuse(type, weight == PairWeight::masses
                                ? "form = \"ewald\" needs a box that is periodic along all three axes; make the "
                                  "boundaries 'periodic', or use form = \"plain\""
                                : "form = \"ewald\" needs a box that is periodic along all three axes, or has walls "
                                  "along one of them; make the boundaries 'periodic', or use form = \"plain\"");
    walled = k;
  }
  for (const WallOptions<3>& wall : box.options)
    if (walled >= 0 && (wall.number == 2 * static_cast<Id>(walled) || wall.number == 2 * static_cast<Id>(walled) + 1) &&
        (wall.moves() || wall.one_way))
      options::refuse(type, "form = \"ewald\" takes no walls of the box that move or let spheres pass; leave that out");
  if (p.has("species"))
    options::refuse(type,
                    "form = \"ewald\" acts between all charges; leave out 'species', and give particles that take "
                    "no part the charge 0");
  const double accuracy = p.has("accuracy") ? p.real("accuracy") : 1e-5;
  // The rounding of both sums causes errors of 1.5 to 4e-13 (20, 200 and 1000 charges at random places).
  if (!(accuracy >= 1e-12 && accuracy <= 0.1))
    options::refuse(
        type, "'accuracy' is out of range, numbers in double precision reach 1e-12; give a number from 1e-12 to 0.1");
  ChargeSums charges;
  const std::vector<double>& charge = *pair_factors(weight, context.particles);
  for (Id i = 0; i < charge.size(); ++i) charges.add(context.particles, i, charge[i]);
  if (context.ranks) charges = sum_of_all(*context.ranks, charges);
  if (charges.count.value() == 0) {
    if (context.placed)
      options::refuse(type,
                      "form = \"ewald\" finds no charges; give the species a 'charge', or leave the interaction out");
    charges.squares.add(1.0), charges.count.add(1.0);
  }
  const double n = charges.count.value(), total = charges.total.value(), volume = box.edges.prod();
  const bool vacuum = p.has("surface") && p.text("surface") == "vacuum";
  const bool neutral = std::abs(total) <= 1e-12 * charges.absolute.value();
  std::vector<double> plates = {0, 0};
  if (p.has("wall_charges")) {
    plates = p.get<std::vector<double>>("wall_charges");
    if (walled < 0 || plates.size() != 2)
      options::refuse(type,
                      "'wall_charges' takes two numbers, the charge per area of the lower and of the upper wall, in "
                      "a box with walls along one axis and periodic boundaries along the others; correct it");
  }
  const double area = walled >= 0 ? volume / box.edges[walled] : 0, on_walls = area * (plates[0] + plates[1]);
  const double absolute = charges.absolute.value() + area * (std::abs(plates[0]) + std::abs(plates[1]));
  const bool balanced = walled < 0 ? neutral : std::abs(total + on_walls) <= 1e-12 * absolute;
  if (context.placed && !balanced && (vacuum || walled >= 0))
    options::refuse(type, std::string(vacuum ? "surface = \"vacuum\"" : "form = \"ewald\" between walls") +
                              " needs a neutral system, but the charges add up to " + short_text(total) +
                              (vacuum ? "; change the charges, or use surface = \"conducting\""
                                      : " and those on the walls to " + short_text(on_walls) +
                                            "; change 'wall_charges' or the charges of particles"));
  if (p.has("surface") && walled >= 0)
    options::refuse(type, "'surface' is for boxes that are periodic along three axes; leave it out between walls");
  Vec3 edges = box.edges, surface = Vec3::Zero();
  double longest = 0.5 * edges.minCoeff();
  if (walled >= 0) {
    Vec3 wall = edges;
    wall[walled] = 0;
    const double gap = slab_gap(accuracy, n, volume, area, wall.maxCoeff());
    wall[walled] = 2 * gap;
    longest = 0.5 * wall.minCoeff();
    edges[walled] += gap;
    surface[walled] = 4 * kPi / edges.prod();
  } else if (vacuum) {
    surface.setConstant(4 * kPi / 3 / volume);
  }
  const double repeated = edges.prod();
  const EwaldSplit split = ewald_split(accuracy, charges, volume, repeated, longest);
  const double sphere = split.wave_cutoff / (2 * kPi);
  if (4 * kPi / 3 * sphere * sphere * sphere * repeated > 2 * static_cast<double>(kMostWaves))
    options::refuse(type, "form = \"ewald\" would need more than " + std::to_string(kMostWaves) +
                              " waves; make the box less elongated, or 'accuracy' less strict");
  const double background =
      neutral ? 0.0 : -constant * kPi * total * total / (2 * split.alpha * split.alpha * repeated);
  const double self = -constant * split.alpha / std::sqrt(kPi) * charges.squares.value();
  const EwaldPair pair(constant, split.alpha, split.cutoff, split.pair_error);
  std::vector<std::unique_ptr<Interaction<3>>> parts;
  parts.push_back(options::within_reach<3>(
      type, Cut<EwaldPair>(pair, split.cutoff, CutKind::switched, split.switch_from), weight, p, context, pair));
  if (p.has("exclude") && p.text("exclude") == "bonded") {
    // The waves contain the pairs that are excluded: −C erf(αr)/r.
    const Bonds<3> bonds(box, context.bonds->list());
    const InverseDistance whole(-constant);
    parts.push_back(options::term<3>(DampedCoulomb(constant, split.alpha), weight, context, bonds, whole));
    parts.push_back(options::term<3>(whole, weight, context, bonds, whole));
  }
  double walls = 0;
  if (plates != std::vector<double>{0, 0}) {
    // Two planes of charge: V = −2πC Σ q_i [σ z_i + σ' (L − z_i)] − 2πC A σ σ' L.
    Vec3 field = Vec3::Zero();
    field[walled] = 2 * kPi * constant * (plates[0] - plates[1]);
    walls = -2 * kPi * constant * box.edges[walled] * plates[1] * (total + area * plates[0]);
    parts.push_back(std::make_unique<FieldTerm<3, UniformField<3>>>(context.particles,
                                                                    UniformField<3>(weight, context.particles, field)));
  }
  return std::make_unique<EwaldTerm>(box, context.particles,
                                     EwaldOptions{split, constant, weight, edges, surface, neutral ? 0.0 : total,
                                                  self + background + walls, background, context.total, charges},
                                     std::make_shared<const Waves>(split, edges, constant), std::move(parts));
}

}  // namespace carom
