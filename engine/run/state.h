// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Stores the state of a run as bytes, field by field, as in a checkpoint; independent of the number of ranks.

#include <algorithm>
#include <functional>
#include <map>
#include <span>
#include <string>

#include "engine/base/error.h"
#include "engine/ranks/system.h"

namespace carom {

/// Receives a state: fields of all particles in the order of ids, and the entries that exist once per run.
struct StateWriter {
  std::function<void(const Fields::Field&, std::span<const std::byte>)> field;
  std::function<void(const std::string& name, const Bytes&)> of_run;
};

/// Stores a state in memory by names.
inline StateWriter into(std::map<std::string, Bytes>& state) {
  return {[&state](const Fields::Field& field, auto bytes) {
            state[field.name] = {bytes.begin(), bytes.end()};
          },
          [&state](const std::string& name, const Bytes& bytes) { state[name] = bytes; }};
}

/// Passes the state of a run to rank 0's writer; in Simulation::Hooks::should_stop, this is all that is needed to
/// continue. Collective.
template <int D>
void save_state(System<D>& system, const StateWriter& writer) {
  system.fields.settle();
  Communicator& ranks = system.decomposition.ranks();
  for (const auto& field : system.fields.of_particles()) {
    if (field->kind == Fields::Kind::constant) continue;
    if (ranks.size() == 1 && !system.decomposition.by_place()) {
      writer.field(*field, {field->data(), field->entries() * field->size});
      continue;
    }
    std::vector<Bytes> blocks = gather_on_first(ranks, system.decomposition.block_of(*field));
    Bytes all = std::move(blocks[0]);
    for (std::size_t n = 1; n < blocks.size(); ++n) all.insert(all.end(), blocks[n].begin(), blocks[n].end());
    if (ranks.rank() == 0) writer.field(*field, all);
  }
  if (ranks.rank() > 0) return;
  for (const Fields::OfRun& entry : system.fields.of_run()) {
    Archive archive;
    entry.archive(archive);
    writer.of_run(entry.name, archive.bytes());
  }
}

/// Returns a part of a state by its name; called on rank 0 only.
using StateReader = std::function<Bytes(const std::string& name)>;

/// Sets a field of a system that is in blocks of ids. Throws Error(Failure::file) if the length is wrong. Collective.
template <int D>
void restore_field(System<D>& system, Fields::Field& field, const StateReader& read) {
  Communicator& ranks = system.decomposition.ranks();
  const IdBlocks blocks = system.decomposition.blocks();
  std::vector<Bytes> outgoing(blocks.ranks);
  if (ranks.rank() == 0) {
    const Bytes all = read(field.name);
    if (!all.empty() && all.size() != blocks.particles * field.size)
      throw Error(Failure::file, "the state has no '" + field.name + "' for each particle of this run");
    for (int rank = 0; rank < ranks.size() && !all.empty(); ++rank) {
      const auto at = [&](Id id) { return all.begin() + static_cast<std::ptrdiff_t>(id * field.size); };
      outgoing[static_cast<std::size_t>(rank)].assign(at(blocks.first(rank)), at(blocks.first(rank + 1)));
    }
  }
  const Bytes mine = std::move(ranks.swap(std::move(outgoing))[0]);
  field.resize(mine.size() / field.size);
  if (!mine.empty()) std::memcpy(field.data(), mine.data(), mine.size());
}

/// Sets the particles of a system and the tilt of its images, from which a run will be continued. Collective.
template <int D>
void restore_particles(System<D>& system, const StateReader& read) {
  Communicator& ranks = system.decomposition.ranks();
  Archive tilt(std::move(ranks.gather(ranks.rank() == 0 ? read("tilt") : Bytes())[0]));
  tilt(system.box.tilt);
  for (const auto& field : system.fields.of_particles())
    if (field->kind != Fields::Kind::constant) restore_field(system, *field, read);
}

/// Sets the whole state; call in Simulation::Hooks::restore. Collective.
template <int D>
void restore_state(System<D>& system, const StateReader& read) {
  restore_particles(system, read);
  Communicator& ranks = system.decomposition.ranks();
  Archive all;
  for (const Fields::OfRun& entry : system.fields.of_run()) {
    if (ranks.rank() > 0) break;
    std::string name = entry.name;
    Bytes bytes = read(name);
    all(name, bytes);
  }
  Archive given(std::move(ranks.gather(all.bytes())[0]));
  while (given.more()) {
    std::string name;
    Bytes bytes;
    given(name, bytes);
    for (const Fields::OfRun& entry : system.fields.of_run()) {
      if (entry.name != name) continue;
      Archive archive(bytes);
      entry.archive(archive);
      archive.finish();
    }
  }
}

}  // namespace carom
