// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// rdf.csv and similar files: averages computed during a run (engine/run/observable.h) instead of written frame by
// frame. Units are reduced; numbers have the fewest digits that reproduce them exactly.
//
// The whole file is replaced whenever the number of samples has doubled, and at the end: after a kill it holds at least
// half of the samples.

#include <filesystem>
#include <memory>

#include "engine/run/observable.h"

namespace carom {

template <int D>
class AverageWriter : public Observer<D> {
 public:
  AverageWriter(std::filesystem::path path, std::unique_ptr<Observable<D>> average);

  Sampling sampling() const override { return average_->sampling(); }
  bool divided() const override { return average_->divided(); }
  bool needs_contacts() const override { return average_->needs_contacts(); }
  void contacts(double slab_start, std::span<const Contact<D>> contacts) override {
    average_->contacts(slab_start, contacts);
  }
  void add_state(Fields& fields, const std::string& name) override { average_->add_state(fields, name); }
  /// Throws Error(Failure::file).
  void sample(double time, const Particles<D>& particles) override;
  /// The average up to now. Throws Error(Failure::file).
  void close() const;
  const Observable<D>& average() const { return *average_; }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  std::unique_ptr<Observable<D>> average_;
};

}  // namespace carom
