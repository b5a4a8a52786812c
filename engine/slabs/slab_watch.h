// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A step that takes long can be left before its end, with the state that it started from.
//
// Between pieces, sweeps and contacts an integrator calls cut() or look(); where the run is to stop they throw SlabLeft
// on all ranks together. The first cut() of a slab keeps the state in memory, so a slab that is done at one stroke
// costs no copy. Only what was registered as state of particles, and of the run by the integrator, changes within a
// slab.

#include <cstring>
#include <functional>
#include <utility>
#include <vector>

#include "engine/base/fields.h"

namespace carom {

/// Thrown on all ranks together: the slab is not to be ended.
struct SlabLeft {};

class SlabWatch {
 public:
  /// `leave`: whether to leave the slab, asked now and then; collective. `leave_here`: the same of this rank alone.
  /// `first`: what the integrator has of the run stands behind so many entries of the registry.
  SlabWatch(Fields& fields, std::size_t first, std::function<bool()> leave, std::function<bool()> leave_here)
      : fields_(fields), first_(first), leave_(std::move(leave)), leave_here_(std::move(leave_here)) {}

  // For integrators.

  /// Before the system changes within a slab that is to go on: keeps the state at its start, and look(). Collective.
  void cut() {
    if (!kept_ && leave_) keep();
    look();
  }
  /// Throws SlabLeft where the run is to stop. Collective.
  void look() const {
    if (leave_ && leave_()) throw SlabLeft{};
  }
  /// Whether this rank has been asked to stop: it may leave off what it does, and has all ranks throw SlabLeft.
  bool asked_here() const { return leave_here_ && leave_here_(); }

  // For the run.

  /// A slab starts, or starts anew.
  void begin() { kept_ = false; }
  /// After SlabLeft: the state is that of the slab's start.
  void restore() {
    if (!kept_) return;
    std::size_t k = 0;
    for (const auto& field : fields_.of_particles()) {
      if (field->kind == Fields::Kind::constant) continue;
      const Bytes& copy = of_particles_[k++];
      field->resize(copy.size() / field->size);
      if (!copy.empty()) std::memcpy(field->data(), copy.data(), copy.size());
    }
    for (k = 0; k < of_run_.size(); ++k) {
      Archive archive(std::move(of_run_[k]));
      fields_.of_run()[first_ + k].archive(archive);
    }
    kept_ = false;
  }

 private:
  void keep() {
    std::size_t k = 0;
    of_particles_.resize(fields_.of_particles().size());
    for (const auto& field : fields_.of_particles()) {
      if (field->kind == Fields::Kind::constant) continue;
      const std::byte* const data = field->data();
      of_particles_[k++].assign(data, data + field->entries() * field->size);
    }
    of_run_.clear();
    for (k = first_; k < fields_.of_run().size(); ++k) {
      Archive archive;
      fields_.of_run()[k].archive(archive);
      of_run_.push_back(archive.bytes());
    }
    kept_ = true;
  }

  Fields& fields_;
  std::size_t first_;
  std::function<bool()> leave_, leave_here_;
  bool kept_ = false;
  std::vector<Bytes> of_particles_, of_run_;
};

}  // namespace carom
