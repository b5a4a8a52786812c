// SPDX-License-Identifier: BSD-3-Clause
// The `carom` command.
//
//   carom run inputs/five-springs.toml --set integrator.step=0.02 -o runs/trial
//   carom branch runs/trial --set integrator.step=0.01 --set run.steps=9000 -o runs/finer
//   carom validate DECK     carom schema --markdown     carom methods     carom info FILE     carom --version
//   carom convert RUN --to extxyz
//   carom view RUN     carom demo
//
// Exit codes: 0 done; 2 deck or usage; 3 impossible initial state; 4 numerical failure; 5 file trouble; 75
// interrupted.

#include <CLI/CLI.hpp>
#include <functional>
#include <iostream>
#include <optional>

#include "engine/base/error.h"
#include "io/command/command.h"
#include "io/command/convert.h"
#include "io/command/run.h"
#include "io/deck/deck_problems.h"
#include "io/deck/options.h"
#include "io/deck/schema.h"
#include "io/files/info.h"
#include "io/files/thermo.h"
#include "io/view/view.h"
#include "parallel/world.h"

namespace {

constexpr int usage_error = 2;

/// Former commands, and what to do instead.
constexpr const char* kFormer[][2] = {
    {"bench",
     "carom bench is now a separate program; from the sources: cmake --build build/release --target carom_bench && "
     "build/release/tests/benchmarks/carom_bench, with the same options (--state and --save-state are gone: a deck "
     "describes a state)"},
    {"completion",
     "the scripts that complete commands are installed with carom; from the sources: io/about in the build"},
    {"manual", "the manual page is installed with carom: man carom; from the sources: io/about/carom.1 in the build"},
};

/// Each --set takes one value, which is not split at commas or brackets.
void add_set(CLI::App& command, std::vector<std::string>& set) {
  command.add_option("--set", set, "Change a value of the deck: table.key=value, list.0.key=value; may be repeated")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
}

int print(const std::string& page) {
  std::cout << page;
  return 0;
}

void add_page(CLI::App& command, std::uint16_t& port, bool& browser, CLI::Option* needs = nullptr) {
  auto* at = command.add_option("--port", port, "Port of the page on 127.0.0.1; default: any free one");
  at->type_name("PORT")->check(CLI::Range(0, 65535));
  auto* none = command.add_flag_callback(
      "--no-browser", [&] { browser = false; }, "Only print the address of the page; do not open a browser");
  if (needs != nullptr) at->needs(needs), none->needs(needs);
}

/// `carom view`, `carom demo`.
struct Views {
  CLI::App *view, *demo;
  carom::ViewOptions options;
  std::optional<std::filesystem::path> directory;

  explicit Views(CLI::App& app)
      : view(app.add_subcommand(
            "view", "Show runs on a page in the browser, with spheres and curves, also while they are active")),
        demo(app.add_subcommand("demo", "Show two methods side by side from the same start")) {
    view->add_option("run", options.runs, "Directories of runs, which are shown side by side")
        ->required()
        ->type_name("RUN");
    auto* to =
        view->add_option("--export", options.export_to, "Write a page with its data to this file; it needs no server");
    to->type_name("FILE");
    view->add_option("--max-size", options.most_megabytes,
                     "Largest size of the exported file; determines how many frames it has")
        ->needs(to)
        ->capture_default_str()
        ->type_name("MB")
        ->check(CLI::Range(1, 4000));
    view->add_flag("--led", options.led, "The run is about to begin; end with standard input")->group("");
    add_page(*view, options.port, options.browser);
    demo->add_option("directory", directory, "Directory for the files of the runs; default: they are not kept")
        ->type_name("DIR");
    add_page(*demo, options.port, options.browser);
  }
};

/// The error message if the first word names no command; else empty.
std::string unknown_command(CLI::App& app, int argc, char** argv) {
  const std::string_view word = argc > 1 ? argv[1] : "";
  if (word.empty() || word[0] == '-') return {};
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (command->get_name() == word) return {};
    if (!command->get_group().empty()) names.push_back(command->get_name());
  }
  std::string text = "there is no command '";
  text.append(word).append("'; ").append(carom::suggestion(word, names));
  return text;
}

/// Runs `work` on rank 0 only, however many processes a launcher has started.
int once(const std::function<int()>& work) { return carom::World().on_first(work); }

int carom_main(int argc, char** argv) {
  // 1. The options.
  CLI::App app{"Carom: event-driven molecular dynamics with smooth forces"};
  app.set_version_flag("--version", carom::version_page, "Version, git hash, compiler, flags, library versions");
  app.require_subcommand(1);

  carom::RunOptions options;
  CLI::App& run = *app.add_subcommand("run", "Run a deck");
  auto* const run_deck = run.add_option("deck", options.deck, "The deck (TOML)")->type_name("DECK");
  auto* const go_on =
      run.add_option("--continue", options.go_on, "Continue the run in this directory from its last checkpoint");
  go_on->type_name("DIR")->excludes(run_deck);
  run.add_flag("--take-over", options.take_over,
               "With --continue: states that the process of the run on another host has ended")
      ->needs(go_on);
  run.add_option("-o,--output", options.output, "Output directory, instead of output.directory")
      ->type_name("DIR")
      ->excludes(go_on);
  CLI::App& branch = *app.add_subcommand("branch", "Start a new run from a checkpoint, with a changed deck");
  branch.add_option("from", options.branch, "A checkpoint, or the directory of a run, whose last checkpoint is used")
      ->required()
      ->type_name("CHECKPOINT");
  branch.add_option("-o,--output", options.output, "Directory of the new run")->type_name("DIR")->required();
  const auto wall_time = [&](const std::string& text) {
    options.max_wall_seconds = carom::wall_seconds(text);
    if (!options.max_wall_seconds) throw CLI::ValidationError("--max-wall", "'" + text + "' is not hh:mm:ss");
  };
  for (CLI::App* command : {&run, &branch}) {
    add_set(*command, options.set);
    command
        ->add_option_function<std::string>("--max-wall", wall_time,
                                           "Stop after this wall time with a checkpoint and exit code 75")
        ->type_name("HH:MM:SS");
    command
        ->add_option("--silence", options.silence,
                     "End the run when a rank has not answered for so many seconds; 0: never")
        ->capture_default_str()
        ->type_name("SECONDS")
        ->check(CLI::NonNegativeNumber);
    command->add_flag("--quiet", options.quiet, "No banner and no progress line");
  }
  auto* const seen = run.add_flag("--view", options.view, "Show the run on a page in the browser");
  add_page(run, options.port, options.browser, seen);

  std::filesystem::path deck, file;
  std::vector<std::string> set;
  CLI::App& validate =
      *app.add_subcommand("validate", "Read and check a deck, build its initial state, and print what would run");
  validate.add_option("deck", deck, "The deck (TOML)")->required()->type_name("DECK");
  add_set(validate, set);

  bool markdown = false;
  CLI::App& schema = *app.add_subcommand("schema", "Print all keys of a deck: type, unit, default, meaning");
  schema.add_flag("--markdown", markdown, "Print Markdown");
  CLI::App& methods = *app.add_subcommand(
      "methods", "Print all integrators with order, conserved quantities, parameters and source, and all averages");
  CLI::App& info =
      *app.add_subcommand("info", "Describe a trajectory, a file of events, a checkpoint or the directory of a run");
  info.add_option("file", file, "The file or directory")->required()->type_name("FILE");

  carom::ConvertOptions to;
  CLI::App& convert = *app.add_subcommand("convert", "Write frames of a run in the format of another program");
  convert.add_option("run", to.run, "The directory of a run, or a trajectory")->required()->type_name("RUN");
  convert.add_option("--to", to.format, "The format")->required()->check(CLI::IsMember(carom::format_names()));
  convert.add_option("-o,--output", to.output, "The file; default: beside the trajectory")->type_name("FILE");
  convert
      .add_option("--frames", to.frames, "A frame (7, -1) or a slice (0:100:10); default: all, lammps-data: the last")
      ->type_name("FRAMES");
  Views views(app);

  for (const auto& [name, instead] : kFormer) app.add_subcommand(name, "")->group("")->allow_extras()->set_help_flag();

  // 2. The command.
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    const std::string unknown = unknown_command(app, argc, argv);
    if (!unknown.empty()) return once([&]() -> int { throw carom::Error(carom::Failure::deck, unknown); });
    return once([&] { return app.exit(e) == 0 ? 0 : usage_error; });
  }

  if (run.parsed() && options.deck.empty() && !options.go_on)
    return once([&] { return app.exit(CLI::RequiredError("DECK, or --continue DIR,")) == 0 ? 0 : usage_error; });

  // 3. Run it.
  if (run.parsed() || branch.parsed()) return carom::run_command(options);
  return once([&] {
    if (validate.parsed()) return carom::validate_command(deck, set);
    if (schema.parsed()) return print(carom::schema_page(markdown));
    if (methods.parsed()) return print(carom::methods_page() + carom::columns_page());
    if (info.parsed()) return carom::info_command(file);
    if (convert.parsed()) return carom::convert_command(to);
    if (views.view->parsed()) return carom::view_command(views.options);
    for (const auto& [name, instead] : kFormer)
      if (app.got_subcommand(name)) throw carom::Error(carom::Failure::deck, instead);
    return carom::demo_command(views.directory, views.options);
  });
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return carom_main(argc, argv);
  } catch (const carom::Error& e) {
    std::cerr << e.what() << '\n';
    return e.exit_code();
  } catch (const std::exception& e) {
    std::cerr << "internal error: " << e.what() << '\n';
    return carom::kFault;
  }
}
