// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// rdf.csv and its like: what is averaged while a run goes on (engine/run/observable.h) instead of being written frame
// by frame. Reduced units; numbers in the fewest digits that give them back exactly.
//
// A file is put in place anew as a whole, whenever the number of samples has doubled, and at the end: after a kill at
// least half of the samples are there.

#include <filesystem>
#include <memory>

#include "engine/run/observable.h"

namespace carom {

template <int D>
class AverageWriter : public Observer<D> {
 public:
  AverageWriter(std::filesystem::path path, std::unique_ptr<Observable<D>> average);

  Sampling sampling() const override { return average_->sampling(); }
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
