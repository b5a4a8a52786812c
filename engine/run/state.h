// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The state of a run as bytes, field by field: what a checkpoint holds, on any number of ranks.

#include <algorithm>
#include <functional>
#include <map>
#include <span>
#include <string>

#include "engine/base/error.h"
#include "engine/ranks/system.h"

namespace carom {

/// Where a state goes: fields of particles, whole and in the order of ids, and what there is one of a run.
struct StateWriter {
  std::function<void(const Fields::Field&, std::span<const std::byte>)> field;
  std::function<void(const std::string& name, const Bytes&)> of_run;
};

/// Keeps a state in memory, by names.
inline StateWriter into(std::map<std::string, Bytes>& state) {
  return {[&state](const Fields::Field& field, auto bytes) {
            state[field.name] = {bytes.begin(), bytes.end()};
          },
          [&state](const std::string& name, const Bytes& bytes) { state[name] = bytes; }};
}

/// Gives rank 0's writer the state of a run: in Simulation::Hooks::should_stop all that it needs to go on. Collective.
template <int D>
void save_state(System<D>& system, const StateWriter& writer) {
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

/// Where a state comes from; called on rank 0 only.
using StateReader = std::function<Bytes(const std::string& name)>;

/// Sets a field of a system that is in blocks of ids. Throws Error(Failure::file) where the length is wrong.
/// Collective.
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

/// Sets the particles of a system: what a run that is to be continued starts from.
template <int D>
void restore_particles(System<D>& system, const StateReader& read) {
  for (const auto& field : system.fields.of_particles())
    if (field->kind != Fields::Kind::constant) restore_field(system, *field, read);
}

/// Sets the whole state, in Simulation::Hooks::restore. Collective.
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
