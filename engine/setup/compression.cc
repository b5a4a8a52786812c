// SPDX-License-Identifier: BSD-3-Clause
#include "engine/setup/compression.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/base/elementary.h"
#include "engine/events/event_core.h"

namespace carom {
namespace {

constexpr double kTarget = 1 + 1e-13;  // final factor: a gap of rounding size, so that no spheres overlap
// Z is measured once a slab. Growth into a tenth of the free volume raises Z ≈ 1/(1 − s/s_J) by a ninth meanwhile.
constexpr double kFreePart = 0.1;
constexpr std::uint64_t kBetweenPauses = 100'000;  // collisions, some tenths of a second
constexpr double kMaxLength = 10;  // longest slab, in diameters at the thermal speed, for growth rates below 0.01
// By free-volume theory s_J is 1/Z ahead. Above this Z, at 0.3 % from jamming, the theory is trusted to a factor of 5.
constexpr double kJammedPressure = 300, kTooFar = 5;

template <int D>
class Compressor {
 public:
  Compressor(const Box<D>& box, std::span<const double> radius, const CompressionOptions& options)
      : box_(box), radius_(radius), options_(options), core_(box_) {
    for (WallOptions<D>& each : box_.options) {
      each.moved = each.displacement(0);
      each.velocity = each.amplitude = each.temperature = 0;
    }
    box_.bath = {};
    box_.shear_rate = box_.tilt = 0;
    box_.shear_rates.clear();
    const std::size_t n = radius.size();
    particles_.x.resize(n);
    particles_.v.assign(n, Vec<D>::Zero());
    particles_.mass.assign(n, 1.0);
    particles_.radius.resize(n);
    particles_.species.assign(n, 0);
    particles_.image.assign(n, Image<D>{});
    largest_ = *std::max_element(radius.begin(), radius.end());
  }

  Compression<D> run() {
    result_.end = start() ? grow() : Compression<D>::End::no_room;
    result_.x = std::move(particles_.x);
    return std::move(result_);
  }

 private:
  using End = typename Compression<D>::End;

  /// Inserts small spheres at random and draws velocities.
  bool start() {
    for (int k = 0; k < D; ++k)
      if (box_.edges[k] < 2 * kTarget * largest_) return false;
    std::vector<Id> all(radius_.size());
    std::iota(all.begin(), all.end(), Id{0});
    constexpr double dilute = D == 2 ? 0.2 : 0.1, least = 1e-3;
    const double filled = packing_fraction<D>(box_.volume(), radius_);
    result_.factor = std::min(0.8, D == 2 ? std::sqrt(dilute / filled) : elementary::cbrt(dilute / filled));
    for (const double first = result_.factor; !insert(all); result_.factor *= 0.8)
      if (result_.factor < least * first) return false;
    draw_velocities<D>(particles_, all, std::vector<double>(radius_.size(), 1.0), options_.seed,
                       RandomPurpose::compression);
    return true;
  }

  bool insert(const std::vector<Id>& all) {
    scale_radii();
    return insert_at_random<D>(box_, particles_.x, particles_.radius, all, options_.seed, options_.pause) == all.size();
  }

  void scale_radii() {
    for (std::size_t i = 0; i < radius_.size(); ++i) particles_.radius[i] = result_.factor * radius_[i];
  }

  End grow() {
    for (double slabs = 1; result_.factor < kTarget; ++slabs) {
      slab();
      const double left = kTarget / result_.factor - 1;
      if (result_.reduced_pressure > kJammedPressure && left * result_.reduced_pressure > kTooFar) return End::jammed;
      if (left > 0 && std::max(result_.collisions, slabs) > options_.max_collisions) return End::too_many_collisions;
    }
    return End::reached;
  }

  /// Grows for a time in which the factor uses kFreePart of the free volume, or for fewer collisions.
  void slab() {
    const auto n = static_cast<double>(radius_.size());
    const double diameter = 2 * result_.factor * largest_;
    const double growth = options_.growth_rate / (diameter * result_.reduced_pressure);
    const double to_the_end = (kTarget / result_.factor - 1) / growth;
    const double length = std::min(diameter * std::min(kFreePart / options_.growth_rate, kMaxLength), to_the_end);
    // At most ten times the predicted collisions: if the spheres jam on the way, there are more.
    const double expected = 100 + 10 * collision_rate_ * length;
    const double most = n * std::min(expected, 1 + options_.max_collisions - result_.collisions);
    Counters counters;
    core_.load(particles_, Vec<D>::Zero(), length, growth);
    const auto limit = static_cast<std::uint64_t>(most);
    double reached = 0;
    do {
      if (options_.pause) options_.pause();
      reached = core_.run(
          length, {.counters = counters, .collision_limit = std::min(counters.sphere_sphere + kBetweenPauses, limit)});
    } while (reached < length && counters.sphere_sphere < limit);
    core_.copy_at(reached, particles_);
    for (std::size_t i = 0; i < particles_.size(); ++i) box_.wrap(particles_.x[i], particles_.image[i]);
    result_.factor = reached == to_the_end ? kTarget : result_.factor * (1 + growth * reached);
    scale_radii();

    const double collisions = static_cast<double>(counters.sphere_sphere) / n;
    const double heated = cool();
    if (reached > 0) {
      collision_rate_ = collisions / reached;
      result_.reduced_pressure =
          std::max(1.0, 1 + counters.collision_virial.value() / (D * n * reached * (1 + heated) / 2));
    }
    result_.collisions += collisions;
  }

  /// Scales the velocities to temperature 1; returns the previous temperature.
  double cool() {
    double twice_kinetic = 0;
    for (const Vec<D>& v : particles_.v) twice_kinetic += v.squaredNorm();
    const double temperature = twice_kinetic / (D * static_cast<double>(particles_.size()));
    const double scale = 1 / std::sqrt(temperature);
    for (Vec<D>& v : particles_.v) v *= scale;
    return temperature;
  }

  Box<D> box_;
  const std::span<const double> radius_;
  const CompressionOptions options_;
  double largest_ = 0;
  double collision_rate_ = 0;  // collisions of a particle in a unit of time, in the last slab
  Particles<D> particles_;
  EventCore<D> core_;
  Compression<D> result_;
};

}  // namespace

template <int D>
Compression<D> compress(const Box<D>& box, std::span<const double> radius, const CompressionOptions& options) {
  return Compressor<D>(box, radius, options).run();
}

template Compression<2> compress(const Box<2>&, std::span<const double>, const CompressionOptions&);
template Compression<3> compress(const Box<3>&, std::span<const double>, const CompressionOptions&);

}  // namespace carom
