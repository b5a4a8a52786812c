// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Lets a run stop within a long step, or repeat a step that is too long, from the state at the start of the step.
//
// Between pieces, sweeps and contacts an integrator calls before_change() or look(), which throw SlabLeft on all ranks
// together if the run is to stop. The first before_change() of a slab copies the state, so a slab without one costs no
// copy. Within a slab only registered state changes: that of the particles, and that which the integrator has
// registered for the run.

#include <cstring>
#include <functional>
#include <utility>
#include <vector>

#include "engine/base/fields.h"

namespace carom {

/// Thrown on all ranks together: the slab is abandoned. StepTooLong (local_error.h) repeats it.
struct SlabLeft {};

class SlabWatch {
 public:
  /// `leave` says whether to abandon the slab; it is called now and then and is collective. `leave_here` is the request
  /// of this rank alone. `repeats`: a slab may be repeated after StepTooLong. The integrator's entries in the registry
  /// of run state begin at `first`.
  SlabWatch(Fields& fields, std::size_t first, std::function<bool()> leave, std::function<bool()> leave_here,
            bool repeats = false)
      : fields_(fields),
        first_(first),
        leave_(std::move(leave)),
        leave_here_(std::move(leave_here)),
        repeats_(repeats) {}

  // Functions that integrators call.

  /// Call this before the system changes within a slab: copies the state at its start once, then look(). Collective.
  void before_change() {
    if (!kept_ && (leave_ || repeats_)) keep();
    look();
  }
  /// Throws SlabLeft if the run is to stop. Collective.
  void look() const {
    if (leave_ && leave_()) throw SlabLeft{};
  }
  /// Whether this rank was asked to stop: it may abandon its work, and all ranks will throw SlabLeft.
  bool asked_here() const { return leave_here_ && leave_here_(); }

  // Functions that the run calls.

  /// Call this when a slab starts, or starts again.
  void begin() { kept_ = false; }
  /// Call this after SlabLeft or StepTooLong: restores the state at the slab's start.
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
  bool repeats_;
  bool kept_ = false;
  std::vector<Bytes> of_particles_, of_run_;
};

}  // namespace carom
