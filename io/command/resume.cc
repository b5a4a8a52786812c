// SPDX-License-Identifier: BSD-3-Clause
#include "io/command/resume.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "io/files/output_directory.h"

namespace carom {
namespace {

/// A word quoted for a shell.
std::string quoted(const std::string& word) {
  const auto plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           std::string_view("_-+=./:,%@").find(c) != std::string_view::npos;
  };
  if (!word.empty() && std::ranges::all_of(word, plain)) return word;
  std::string all = "'";
  for (const char c : word) all += c == '\'' ? "'\\''" : std::string(1, c);
  return all + "'";
}

/// Sends what rank 0 has read from its checkpoint to all ranks.
void share_head(Resumed& from, Communicator& ranks) {
  const auto archive = [&](Archive& all) {
    from.head.archive(all);
    all(from.head.deck, from.count, from.reached);
  };
  Archive out;
  if (ranks.rank() == 0) {
    from.head = from.checkpoint->head();
    Archive(from.checkpoint->read("step count"))(from.count);
    archive(out);
  }
  Archive in(std::move(ranks.gather(out.bytes())[0]));
  archive(in);
}

/// Throws if a continued run would end before the point that it has reached. `before`: the deck that it had.
void check_end(const Deck& deck, const Deck& before, const Resumed& from) {
  const auto refuse = [&](const std::string& key, const std::string& unit, auto end, auto reached) {
    const std::string set = fmt::format("--set run.{}=", key);
    const bool fresh = from.head.branched_from.empty();  // else deck.toml starts elsewhere
    throw Error(Failure::deck,
                fmt::format("{}{}: the run has come to {} {} already; give that or more ({}{}){}", set, end, unit,
                            reached, set, reached,
                            fresh ? fmt::format(", or start anew: carom run {} {}{} -o {}",
                                                quoted((from.directory / run_file::deck).string()), set, end,
                                                quoted(from.directory.lexically_normal().string() + "-earlier"))
                                  : ""));
  };
  const Plan &plan = deck.plan, &old = before.plan;
  const ThermoPoint& reached = from.reached;
  if (plan.steps && plan.steps != old.steps && *plan.steps < reached.step)
    refuse("steps", "step", *plan.steps, reached.step);
  // Within an epoch the last collision is at the time of the state, and a run that ends at that time omits it.
  const double time = reached.time + (from.count.within > 0 ? 2 * plan.slack() : 0);
  if (plan.end_time && plan.end_time != old.end_time && *plan.end_time < time - plan.slack())
    refuse("end_time", "time", *plan.end_time, time);
  if (plan.collisions && plan.collisions != old.collisions && *plan.collisions < reached.collisions)
    refuse("collisions", "collision", *plan.collisions, reached.collisions);
}

/// How far a run has come: its checkpoint, or its last row, which may be later.
ThermoPoint reached_by(const Checkpoint& checkpoint, const std::filesystem::path& directory) {
  Statistics statistics;
  StepCount count;
  Archive(checkpoint.read("statistics"))(statistics);
  Archive(checkpoint.read("step count"))(count);
  const ThermoPoint row = last_thermo_point(directory / run_file::thermo);
  ThermoPoint reached{
      std::max(row.time, statistics.end_time),
      std::max(row.step, statistics.steps + (count.within > 0 ? 1 : 0)),  // a step that has begun is completed
      std::max(row.collisions, statistics.counters.sphere_sphere)};
  // Free flight would have ended at the last collision, before the state.
  if (!find_integrator(checkpoint.head().integrator).stepping) ++reached.collisions;
  return reached;
}

/// Throws if a branch has nothing to do.
void check_end(const Deck& deck, const CheckpointHead& head) {
  const auto refuse = [&](const std::string& key, const std::string& is) {
    throw Error(Failure::deck, "run." + key + " = " + is + ": the branch starts at step " + std::to_string(head.step) +
                                   ", time " + short_text(head.time) +
                                   ", and would end at once; give a later end, --set run." + key + "=…");
  };
  if (deck.plan.steps && *deck.plan.steps <= head.step) refuse("steps", std::to_string(*deck.plan.steps));
  if (deck.plan.end_time && *deck.plan.end_time <= head.time) refuse("end_time", short_text(*deck.plan.end_time));
}

}  // namespace

StateReader Resumed::reader() const {
  return [this](const std::string& name) {
    const bool known = end.empty() ? checkpoint->has(name) : end.contains(name);
    if (name == "spin" && is_branch() && !known) return Bytes();  // contacts were smooth so far
    return end.empty() ? checkpoint->read(name) : end.at(name);
  };
}

Resumed find_run(const std::filesystem::path& directory, bool take_over, Communicator& ranks) {
  Resumed found;
  found.directory = directory;
  if (ranks.rank() == 0) {
    if (std::filesystem::is_directory(directory)) found.lock = std::make_unique<DirectoryLock>(directory, take_over);
    found.checkpoint.emplace(last_checkpoint(directory, found.warning));
    found.reached = reached_by(*found.checkpoint, directory);
  }
  share_head(found, ranks);
  return found;
}

Resumed find_state(const std::filesystem::path& checkpoint, const std::filesystem::path& output, Communicator& ranks) {
  namespace fs = std::filesystem;
  Resumed found;
  std::string file;
  if (ranks.rank() == 0) {
    if (fs::is_directory(checkpoint)) {
      found.checkpoint.emplace(last_checkpoint(checkpoint, found.warning));
      if (found.warning.empty()) found.reached = last_thermo_point(checkpoint / run_file::thermo);
    } else {
      found.checkpoint.emplace(checkpoint);
    }
    const fs::path place = fs::absolute(found.checkpoint->file()).lexically_normal();
    std::error_code ignored;
    if (fs::equivalent(place.parent_path(), output, ignored))
      throw Error(
          Failure::deck,
          "-o " + output.string() + ": this is the directory of the run to branch off; give the branch one of its own");
    file = place.string();
  }
  share_head(found, ranks);
  Archive out;
  out(file);
  Archive(std::move(ranks.gather(out.bytes())[0]))(file);
  found.head.branched_from = file;
  found.directory = fs::path(file).parent_path();
  return found;
}

Deck deck_of(Resumed& from, const RunOptions& options, Communicator& ranks) {
  const auto file = from.directory / run_file::deck;
  const TextReader others = reader_for(ranks);
  const TextReader reader = [&](const std::filesystem::path& path) {
    // Positions are in the checkpoint: their file may be gone.
    return path == file ? from.head.deck : others(path).value_or("");
  };
  Deck deck;
  if (options.branch) {
    from.of = read_deck(file, {}, reader);
    deck = read_branch(*from.of, options.set, reader, from.same_motion);
    set_output_directory(deck, *options.output);
  } else {
    const auto other = std::ranges::find_if_not(options.set, [](const auto& set) { return set.starts_with("run."); });
    if (other != options.set.end()) {
      std::string branch = "carom branch " + quoted(from.directory.string());
      for (const std::string& set : options.set) branch += " --set " + quoted(set);
      throw Error(Failure::deck, "--set " + *other +
                                     ": a run that is continued keeps its deck; only its end may be set anew "
                                     "(run.steps, run.end_time, run.collisions); to start a new run from its last "
                                     "checkpoint with another deck: " +
                                     branch + " -o " + quoted(from.directory.lexically_normal().string() + "-branch"));
    }
    deck = read_deck(file, options.set, reader);
    set_output_directory(deck, from.directory);
    deck.warnings = from.head.warnings;
    if (ranks.rank() == 0) check_files(deck, from.head.files, from.head.log);
    check_end(deck, read_deck(file, {}, reader), from);
  }
  deck.file = from.head.deck_file;
  return deck;
}

template <int D>
void go_to_end(Resumed& from, Communicator& ranks) {
  Deck& deck = *from.of;
  const Plan& plan = deck.plan;
  const ThermoPoint& reached = from.reached;
  const bool ended = (plan.steps && reached.step >= *plan.steps) ||
                     (plan.end_time && reached.time >= *plan.end_time - plan.slack()) ||
                     (plan.collisions && reached.collisions >= *plan.collisions);
  if (!ended || reached.time <= from.head.time + plan.slack()) return;
  const GivenState given{from.reader(), from.head.bonds, from.head.time};
  auto system = build_system<D>(deck, ranks.size() > 1 ? &ranks : nullptr, &given);
  const IntegratorInfo& info = find_integrator(deck.integrator);
  Simulation<D> run(std::move(system), info, info.make<D>(deck.integrator_parameters), plan);
  std::map<std::string, Bytes> end;
  const auto save = [&] {  // before each of the few slabs, and at the end
    end.clear();
    save_state(run.system(), into(end));
    return false;
  };
  run.run({.should_stop = save, .restore = [&] { restore_state(run.system(), given.read); }});
  from.end = std::move(end);
  from.head.step = run.statistics().steps;
  from.head.time = run.statistics().end_time;
  from.count = {from.head.step, from.head.time};
}

template <int D>
GivenState state_of(Resumed& from, const Deck& deck) {
  if (from.is_branch()) check_end(deck, from.head);
  return {from.reader(), from.head.bonds, from.head.time, from.head.step, from.is_branch()};
}

template <int D>
void set_hooks(const Resumed& from, const Deck& deck, Simulation<D>& simulation, typename Simulation<D>::Hooks& hooks) {
  if (from.is_continued() || from.same_motion)
    hooks.restore = [&from, &simulation] { restore_state(simulation.system(), from.reader()); };
  if (from.is_continued()) return;
  const StepCount start{from.head.step, from.head.time}, &count = from.count;
  const double step = deck.plan.step;
  const bool counted = step == from.of->plan.step &&
                       start.time == count.time + static_cast<double>(start.steps - count.steps) * step + count.within;
  hooks.branch = {start, counted ? count : start};
}

template void go_to_end<2>(Resumed&, Communicator&);
template void go_to_end<3>(Resumed&, Communicator&);
template GivenState state_of<2>(Resumed&, const Deck&);
template GivenState state_of<3>(Resumed&, const Deck&);
template void set_hooks(const Resumed&, const Deck&, Simulation<2>&, Simulation<2>::Hooks&);
template void set_hooks(const Resumed&, const Deck&, Simulation<3>&, Simulation<3>::Hooks&);

}  // namespace carom
