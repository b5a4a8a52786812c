// Sums over pairs: every bit of them, whatever computes them and in which order.

#include <cstdlib>

#include "engine/base/error.h"
#include "engine/forces/forces.h"
#include "engine/forces/potentials/cut.h"
#include "engine/forces/potentials/inverse_distance.h"
#include "engine/forces/potentials/lennard_jones.h"
#include "engine/forces/potentials/options.h"
#include "engine/forces/potentials/yukawa.h"
#include "engine/forces/simd/pair_kernels.h"
#include "tests/unit/potentials/cases.h"

namespace carom {
namespace {

using test::kQuantum;
using test::Scene;

template <int D>
using Quanta = std::vector<std::array<typename ForceSums<D>::Whole, D>>;

template <int D>
Quanta<D> quanta(const ForceSums<D>& sums) {
  Quanta<D> all;
  for (Id i = 0; i < sums.size(); ++i) all.push_back(sums.quanta(i));
  return all;
}

/// All that a term gives, as far as it shows.
template <int D>
struct Outcome {
  Quanta<D> forces, mean_forces, products;
  std::vector<double> sums;
  std::uint64_t pairs = 0;
  bool operator==(const Outcome&) const = default;
};

template <int D>
Outcome<D> outcome(const Interaction<D>& term, const std::vector<Vec<D>>& x, const std::vector<Vec<D>>& x_new) {
  Outcome<D> result;
  ForceSums<D> forces(x.size(), kQuantum), mean(x.size(), kQuantum), products(x.size(), kQuantum);
  PotentialSums sums{.quantum = kQuantum};
  term.add_forces(x, forces, &sums);
  result.pairs = term.add_mean_forces(x, x_new, mean);
  term.add_hessian_product(x, x_new, products);
  result.forces = quanta(forces);
  result.mean_forces = quanta(mean);
  result.products = quanta(products);
  const PotentialSums alone = test::sums(term, x);
  for (const PotentialSums* each : {static_cast<const PotentialSums*>(&sums), &alone})
    result.sums.insert(result.sums.end(), {each->energy.value(), each->magnitude.value(), each->virial.value()});
  ForceSums<D> without_sums(x.size(), kQuantum);
  term.add_forces(x, without_sums);
  EXPECT_TRUE(quanta(without_sums) == result.forces);
  return result;
}

/// The vector widths of this machine.
std::vector<std::string> widths() {
  std::vector<std::string> found;
  for (const PairKernels* kernels : available_pair_kernels()) found.emplace_back(kernels->name);
  return found;
}

template <int D>
void expect_the_same_in_all_widths() {
  std::vector<Outcome<D>> first;
  for (const std::string& width : widths()) {
    SCOPED_TRACE(width);
    setenv("CAROM_SIMD", width.c_str(), 1);
    std::size_t number = 0;
    test::for_each_case<D>([&](Scene<D>& scene, const Interaction<D>& term) {
      const auto x_new = test::displaced(scene.particles.x, scene.random_vectors(0.1), 1);
      const Outcome<D> result = outcome(term, scene.particles.x, x_new);
      if (number == first.size()) first.push_back(result);
      EXPECT_TRUE(result == first[number++]);
    });
  }
  unsetenv("CAROM_SIMD");
}

TEST(PairSums, AreTheSameInEveryVectorWidth) {
  expect_the_same_in_all_widths<2>();
  expect_the_same_in_all_widths<3>();
}

TEST(PairSums, AreOfTheKernelsThatAreToBeUsed) {
  test::for_each_case<3>([](Scene<3>& scene, Interaction<3>& term) {
    const auto& x = scene.particles.x;
    const auto forces = [&] {
      ForceSums<3> sums(x.size(), kQuantum);
      term.add_forces(x, sums);
      return quanta(sums);
    };
    const auto expected = forces();
    PairKernels broken = pair_kernels();
    broken.scatter = [](const PairBatch&, const std::int64_t(*)[PairBatch::kRoom], ForceWords*) {};
    term.use(broken);
    EXPECT_TRUE(forces() == (term.keeps_momentum() ? Quanta<3>(x.size()) : expected));  // fields have no kernels
    for (const PairKernels* kernels : available_pair_kernels()) {
      term.use(*kernels);
      EXPECT_TRUE(forces() == expected) << kernels->name;
    }
  });
}

/// Sums of a potential by plain double loops over pairs and images.
template <int D>
struct Reference {
  using Whole = typename ForceSums<D>::Whole;
  Quanta<D> forces, mean_forces;
  Whole energy = 0;

  template <class P>
  Reference(const Scene<D>& scene, const P& potential, double cutoff2, const std::vector<double>* weight,
            const std::vector<Vec<D>>& x, const std::vector<Vec<D>>& x_new, double quantum = kQuantum) {
    forces.resize(x.size());
    mean_forces.resize(x.size());
    const auto rounded = [&](double value) { return static_cast<Whole>(std::nearbyint(value / quantum)); };
    const int images = scene.box.periodic(0) ? 2 : 0;
    for (Id i = 0; i < x.size(); ++i)
      for (Id j = i + 1; j < x.size(); ++j)
        for (int n = 0; n < static_cast<int>(std::pow(2 * images + 1, D)); ++n) {
          Image<D> image;
          for (int k = 0, rest = n; k < D; ++k, rest /= 2 * images + 1) image[k] = rest % (2 * images + 1) - images;
          const Vec<D> shift = scene.box.shift(image), d = x[i] - x[j] + shift, d_new = x_new[i] - x_new[j] + shift;
          const double rho = d.squaredNorm(), rho_new = d_new.squaredNorm();
          const double w = weight ? (*weight)[i] * (*weight)[j] : 1;
          if (w == 0) continue;
          if (rho < cutoff2) {
            energy += rounded(w * potential.value(rho));
            for (int k = 0; k < D; ++k) add(forces, i, j, k, rounded(-2.0 * w * potential.derivative(rho) * d[k]));
          }
          if (rho < cutoff2 || rho_new < cutoff2)
            for (int k = 0; k < D; ++k)
              add(mean_forces, i, j, k, rounded(-w * potential.quotient(rho, rho_new) * (d[k] + d_new[k])));
        }
  }
  static void add(Quanta<D>& sums, Id i, Id j, int k, Whole force) {
    sums[i][k] += force;
    sums[j][k] -= force;
  }
};

template <int D, class P>
void expect_reference(const Scene<D>& scene, const Interaction<D>& term, const P& potential, double cutoff2,
                      const std::vector<double>* weight, const std::vector<Vec<D>>& x,
                      const std::vector<Vec<D>>& x_new) {
  const Reference<D> expected(scene, potential, cutoff2, weight, x, x_new);
  const Outcome<D> result = outcome(term, x, x_new);
  EXPECT_TRUE(result.forces == expected.forces);
  EXPECT_TRUE(result.mean_forces == expected.mean_forces);
  EXPECT_EQ(result.sums[0], static_cast<double>(expected.energy) * kQuantum);
}

using Given = std::vector<std::pair<std::string, ParameterValue>>;
using namespace std::string_literals;

Given cut_lennard_jones(double sigma, double cutoff) {
  return {{"epsilon", 1.0}, {"sigma", sigma}, {"cutoff", cutoff}, {"cut", "shifted"s}};
}

TEST(PairSums, AreThoseOfPlainLoopsOverPairs) {
  Scene<3> scene(150, 7, Boundary::periodic, 0.6);
  const auto& x = scene.particles.x;
  const auto x_new = test::displaced(x, scene.random_vectors(0.3), 1);
  const Cut fluid(LennardJones(1.0, 0.8), 2.0, CutKind::shifted);
  expect_reference(scene, *scene.make("lennard-jones", cut_lennard_jones(0.8, 2.0)), fluid, 4, nullptr, x, x_new);
  Scene<2> plane(150, 9, Boundary::wall, 0.2);
  plane.particles.charge[3] = 0;  // pairs of no weight add nothing
  plane.particles.charge[4] = 1e-3;
  const auto& q = plane.particles.x;
  const auto q_new = test::displaced(q, plane.random_vectors(0.3), 1);
  constexpr double kAll = std::numeric_limits<double>::infinity();
  expect_reference(plane, *plane.make("gravity", {{"constant", 0.7}}), InverseDistance(-0.7), kAll,
                   &plane.particles.mass, q, q_new);
  expect_reference(plane, *plane.make("yukawa", {{"amplitude", 2.0}, {"kappa", 1.1}, {"charges", true}}),
                   Yukawa(2, 1.1), kAll, &plane.particles.charge, q, q_new);
}

TEST(PairSums, HoldSeveralImagesOfAPairInASmallBox) {
  for (const double edge : {1.1, 1.7, 2.6, 4.1}) {  // the cutoff reaches round the box
    Scene<2> scene(7, edge, Boundary::periodic, 0.2);
    const auto& x = scene.particles.x;
    const auto x_new = test::displaced(x, scene.random_vectors(0.02), 1);
    const Cut potential(LennardJones(1.0, 0.4), 2.0, CutKind::shifted);
    expect_reference(scene, *scene.make("lennard-jones", cut_lennard_jones(0.4, 2.0)), potential, 4, nullptr, x, x_new);
  }
}

TEST(PairSums, PassOverManyPairsThatAreOnlyInTheSkin) {
  for (const Boundary boundary : {Boundary::wall, Boundary::periodic}) {
    Scene<2> scene(0, 61, boundary, 0);
    for (int k = 0; k < 400; ++k)
      for (const double beside : {0.0, k % 399 == 0 ? 0.9 : 1.25})
        scene.particles.x.push_back(Vec<2>(0.01 + 3 * (k % 20) + beside, 0.01 + 3 * (k / 20)));
    const auto& x = scene.particles.x;
    scene.particles.mass.resize(x.size(), 1);
    const Cut potential(LennardJones(1.0, 0.8), 1.2, CutKind::shifted);
    expect_reference(scene, *scene.make("lennard-jones", cut_lennard_jones(0.8, 1.2)), potential, 1.44, nullptr, x, x);
  }
}

TEST(PairSums, PassOverManyPairsOfNoWeight) {
  Scene<2> scene(600, 30, Boundary::wall, 0.2);
  for (std::size_t i = 1; i < 599; ++i) scene.particles.charge[i] = 0;
  const auto& x = scene.particles.x;
  expect_reference(scene, *scene.make("yukawa", {{"amplitude", 2.0}, {"kappa", 0.1}, {"charges", true}}),
                   Yukawa(2, 0.1), std::numeric_limits<double>::infinity(), &scene.particles.charge, x, x);
}

/// Moves particles about, wraps them now and then, and compares with plain loops all the time.
template <int D>
void travel(double edge, int particles, double speed, const std::string& width) {
  SCOPED_TRACE(width);
  setenv("CAROM_SIMD", width.c_str(), 1);
  Scene<D> scene(particles, edge, Boundary::periodic, 0.4);
  const auto travelled = scene.make(
      "yukawa", {{"amplitude", 1.0}, {"kappa", 1.1}, {"charges", false}, {"cutoff", 1.2}, {"cut", "shifted"s}});
  unsetenv("CAROM_SIMD");
  const Cut potential(Yukawa(1.0, 1.1), 1.2, CutKind::shifted);
  auto x = scene.particles.x;
  const auto drift = scene.random_vectors(speed);
  for (int step = 0; step < 30; ++step) {
    x = test::displaced(x, drift, 1);
    if (step % 3 == 2)
      for (auto& each : x) {
        Image<D> image{};
        scene.box.wrap(each, image);
      }
    if (step == 20) x[5][0] += 3 * edge;
    const auto x_new = test::displaced(x, drift, step % 4);
    ForceSums<D> forces(x.size(), kQuantum), mean(x.size(), kQuantum);
    travelled->add_forces(x, forces);
    travelled->add_mean_forces(x, x_new, mean);
    const Reference<D> expected(scene, potential, 1.44, nullptr, x, x_new);
    if (step == 20) {  // too far away for the plain loops
      x[5][0] -= 3 * edge;
      continue;
    }
    ASSERT_TRUE(quanta(forces) == expected.forces) << "step " << step;
    ASSERT_TRUE(quanta(mean) == expected.mean_forces) << "step " << step;
  }
}

TEST(PairSums, DoNotDependOnTheHistoryOfTheList) {
  for (const std::string& width : widths()) {
    travel<2>(6, 60, 0.01, width);
    travel<2>(6, 60, 0.07, width);
    travel<3>(4, 90, 0.02, width);
    travel<3>(1.5, 12, 0.03, width);
  }
}

/// No kernels are made for it.
struct OwnYukawa : Yukawa {
  using Yukawa::Yukawa;
};

TEST(PairSums, OfAPotentialThatIsNotListedAreTheSame) {
  Scene<3> scene(200, 6, Boundary::periodic, 0.4);
  const auto x_new = test::displaced(scene.particles.x, scene.random_vectors(0.1), 1);
  for (const char* cut : {"switch", "shifted", "force-shifted"}) {
    const Given given = {{"amplitude", 2.0}, {"kappa", 1.1}, {"charges", true}, {"cutoff", 2.0}, {"cut", cut + ""s}};
    Parameters parameters;
    for (const auto& [name, value] : given) parameters.set(name, value);
    const auto own = options::pair_term<3>(
        "own", OwnYukawa(2.0, 1.1), PairWeight::charges, parameters,
        {.box = scene.box, .particles = scene.particles, .species = scene.species, .bonds = nullptr});
    const Outcome<3> expected = outcome(*scene.make("yukawa", given), scene.particles.x, x_new);
    for (const PairKernels* kernels : available_pair_kernels()) {
      own->use(*kernels);
      EXPECT_TRUE(outcome(*own, scene.particles.x, x_new) == expected) << kernels->name;
    }
  }
}

TEST(PairSums, DoNotDependOnTheOrderOfTheParticles) {
  Scene<3> scene(120, 6, Boundary::periodic, 0.6);
  Scene<3> turned = scene;
  const auto reverse = [](auto& array) { std::ranges::reverse(array); };
  reverse(turned.particles.x);
  reverse(turned.particles.charge);
  reverse(turned.particles.species);
  const Given given = {{"constant", 1.3},
                       {"form", "damped-shifted"s},
                       {"damping", 0.9},
                       {"cutoff", 2.4},
                       {"species", std::vector<std::string>{"A", "B"}}};
  auto x_new = test::displaced(scene.particles.x, scene.random_vectors(0.2), 1);
  Outcome<3> one = outcome(*scene.make("coulomb", given), scene.particles.x, x_new);
  reverse(x_new);
  const Outcome<3> other = outcome(*turned.make("coulomb", given), turned.particles.x, x_new);
  for (auto* each : {&one.forces, &one.mean_forces, &one.products}) reverse(*each);
  EXPECT_TRUE(one == other);
}

TEST(PairSums, OfForcesAreExactlyZero) {
  test::for_each_case<3>([](Scene<3>& scene, const Interaction<3>& term) {
    if (!term.keeps_momentum()) return;
    const auto x_new = test::displaced(scene.particles.x, scene.random_vectors(0.1), 1);
    const Outcome<3> result = outcome(term, scene.particles.x, x_new);
    for (const auto* each : {&result.forces, &result.mean_forces, &result.products})
      for (int k = 0; k < 3; ++k) {
        ForceSums<3>::Whole sum = 0;
        for (const auto& force : *each) sum += force[k];
        EXPECT_TRUE(sum == 0);
      }
  });
}

TEST(PairSums, AreBroughtUpToDateExactly) {
  test::for_each_case<2>([](Scene<2>& scene, const Interaction<2>& term) {
    const auto& x = scene.particles.x;
    auto x_new = test::displaced(x, scene.random_vectors(0.05), 1);
    ForceSums<2> kept(x.size(), kQuantum);
    term.add_mean_forces(x, x_new, kept);
    for (int sweep = 0; sweep < 20; ++sweep) {
      std::vector<char> changed(x.size(), 0);
      auto next = x_new;
      for (std::size_t i = 0; i < x.size(); ++i) {
        changed[i] = scene.random() % 5 == 0;
        if (changed[i] != 0) next[i] += scene.random_vectors(0.02)[i];
      }
      const auto subtracted = term.add_mean_forces(x, x_new, kept, changed.data(), -1);
      const auto added = term.add_mean_forces(x, next, kept, changed.data());
      ForceSums<2> anew(x.size(), kQuantum);
      const auto all = term.add_mean_forces(x, next, anew);
      EXPECT_LE(std::max(subtracted, added), all + x.size());
      ASSERT_TRUE(quanta(kept) == quanta(anew)) << "sweep " << sweep;
      x_new = next;
    }
  });
}

/// The message of the Error(Failure::numerical) that these forces are.
template <int D>
std::string refusal(const Interaction<D>& term, const std::vector<Vec<D>>& x) {
  ForceSums<D> forces(x.size(), kQuantum);
  try {
    term.add_forces(x, forces);
  } catch (const Error& error) {
    EXPECT_EQ(error.failure(), Failure::numerical);
    return error.what();
  }
  return "none";
}

TEST(PairSums, NameThePairWhoseForceIsNoNumber) {
  Scene<3> scene(30, 8, Boundary::wall, 1);
  auto& x = scene.particles.x;
  x[17] = x[5];
  const std::string gravity = refusal(*scene.make("gravity", {{"constant", 1.0}}), x);
  EXPECT_NE(gravity.find("between particles 5 and 17"), std::string::npos) << gravity;
  const std::string fluid = refusal(*scene.make("lennard-jones", cut_lennard_jones(0.8, 2.0)), x);
  EXPECT_NE(fluid.find("between particles 5 and 17"), std::string::npos) << fluid;
  ForceSums<3> mean(x.size(), kQuantum);  // a step that is only tried
  scene.make("gravity", {{"constant", 1.0}})->add_mean_forces(x, x, mean);
  EXPECT_TRUE(std::isnan(mean.value(0)[0]));
  x[3][1] = std::numeric_limits<double>::quiet_NaN();
  const std::string lost = refusal(*scene.make("gravity", {{"constant", 1.0}}), x);
  EXPECT_NE(lost.find("the position of particle 3 is not finite"), std::string::npos) << lost;
}

TEST(PairSums, NameBondsAndStraysByTheIdsOfTheParticles) {
  Scene<2> scene(12, 8, Boundary::periodic, 0.5);
  scene.particles.x[4] = Vec<2>(1, 1), scene.particles.x[9] = Vec<2>(4.9, 1);
  Particles<2> some;
  for (const Id i : {4, 7, 9}) {
    some.x.push_back(scene.particles.x[i]);
    some.mass.push_back(1);
    some.species.push_back(0);
    some.id.push_back(i);
  }
  const auto bond =
      scene.make("harmonic-bond", {{"pairs", PairList{{4, 9}}}, {"stiffness", 1.0}, {"rest_length", 1.0}})->among(some);
  EXPECT_NE(refusal(*bond, some.x).find("the bond of particles 4 and 9 "), std::string::npos);
  const auto fluid = scene.make("lennard-jones", cut_lennard_jones(0.8, 2.0))->among(some);
  auto x_new = some.x;
  x_new[1][0] += 40;
  ForceSums<2> mean(3, kQuantum);
  try {
    fluid->add_mean_forces(some.x, x_new, mean);
    ADD_FAILURE() << "no error";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("particle 7 moves farther than"), std::string::npos) << error.what();
  }
  some.x[1][0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(refusal(*fluid, some.x).find("position of particle 7 is"), std::string::npos);
}

TEST(PairSums, HoldForcesOfAllMagnitudesOrSaySo) {
  Scene<3> scene(24, 6, Boundary::wall, 0.5);
  std::uniform_real_distribution<double> exponent(-9, 0), part(-1, 1);
  int held = 0, refused = 0;
  for (int round = 0; round < 300; ++round) {
    auto x = scene.particles.x;
    for (int n = 0; n < 3; ++n) {  // some come close to each other
      const auto i = scene.random() % x.size(), j = scene.random() % x.size();
      x[i] = x[j] + std::pow(10, exponent(scene.random)) * Vec<3>(part(scene.random), part(scene.random), 1);
    }
    for (double& q : scene.particles.charge) q = part(scene.random) * std::pow(10, 0.5 * exponent(scene.random));
    const InverseDistance potential(1.0);
    const auto term = scene.make("coulomb", {{"constant", 1.0}, {"form", "plain"s}});
    if (refusal(*term, x) != "none") {
      ++refused;
      continue;
    }
    ++held;
    constexpr double kAll = std::numeric_limits<double>::infinity();
    expect_reference(scene, *term, potential, kAll, &scene.particles.charge, x, x);
  }
  EXPECT_GT(held, 100);
  EXPECT_GT(refused, 10);
}

TEST(ForceSums, CarryWhereManyPassesAddUp) {
  ForceSums<2> sums(2, 1.0);
  const ForceLimits limits = sums.make_room(1);
  const Vec<2> large(limits.low - 1, -3e15);
  for (int n = 1; n < 20000; ++n) {
    sums.make_room(1);
    ASSERT_TRUE(sums.add(1, large, limits));
  }
  EXPECT_TRUE(sums.quanta(1)[0] == static_cast<ForceSums<2>::Whole>(limits.low - 1) * 19999);
  EXPECT_TRUE(sums.quanta(1)[1] == static_cast<ForceSums<2>::Whole>(-3e15) * 19999);
  EXPECT_EQ(sums.value(0), Vec<2>(0, 0));
}

TEST(ForceSums, DoNotWrapWhereManyTermsHaveManyPartners) {
  constexpr std::size_t kPartners = 1 << 16;
  ForceSums<2> sums(1, 1.0);
  ForceSums<2>::Whole expected = 0;
  for (int term = 0; term < 12; ++term) {
    const ForceLimits limits = sums.make_room(kPartners);
    ASSERT_GE(limits.high, 0x1p30);
    const double upper = std::nextafter(limits.high, 0) - 1, large = 0x1p40 * std::floor(upper);
    for (std::size_t n = 0; n < kPartners; ++n) ASSERT_TRUE(sums.add(0, Vec<2>(large, 0), limits));
    expected += static_cast<ForceSums<2>::Whole>(large) * kPartners;
    ASSERT_TRUE(sums.quanta(0)[0] == expected) << term;
  }
}

}  // namespace
}  // namespace carom
