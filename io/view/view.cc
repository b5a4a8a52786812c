// SPDX-License-Identifier: BSD-3-Clause
#include "io/view/view.h"

#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstdlib>

#include "engine/base/error.h"
#include "io/files/output_directory.h"
#include "io/files/text_file.h"
#include "io/view/child.h"
#include "io/view/run_source.h"
#include "io/view/server.h"

namespace carom {

namespace fs = std::filesystem;

namespace {

void say(const std::string& text) {
  std::fputs((text + '\n').c_str(), stdout);
  if (std::fflush(stdout) != 0) throw Error(Failure::file, "standard output: cannot write to it");
}

/// A page of these runs: `runs` answers with a list of their states, `K/…` with the answer of run K.
class Page {
 public:
  explicit Page(const ViewOptions& options) {
    for (const fs::path& run : options.runs) runs_.emplace_back(run, options.awaited || options.led);
  }

  std::optional<Answer> answer(std::string_view path) {
    if (path.empty()) return Answer{"text/html; charset=utf-8", kPage};
    if (path == "runs") {
      auto states = nlohmann::json::array();
      for (RunSource& run : runs_) states.push_back(run.state());
      return Answer{"application/json", states.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)};
    }
    const std::size_t slash = path.find('/');
    std::size_t number = 0;
    if (slash == std::string_view::npos) return {};
    const auto [end, error] = std::from_chars(path.data(), path.data() + slash, number);
    if (error != std::errc{} || end != path.data() + slash || number >= runs_.size()) return {};
    return runs_[number].answer(path.substr(slash + 1));
  }

 private:
  std::vector<RunSource> runs_;
};

/// Serves a page, and prints its address.
void show(const ViewOptions& options) {
  Page page(options);
  PageServer server(options.port, [&](std::string_view path) { return page.answer(path); });
  say(options.led ? server.address() : "page: " + server.address() + "\nCtrl-C ends it");
  const std::string opened = options.browser ? open_in_browser(server.address()) : "";
  server.serve(options.led);
  if (!opened.empty()) ::unlink(opened.c_str());
}

}  // namespace

int view_command(const ViewOptions& options) {
  if (options.export_to)
    export_page(options);
  else
    show(options);
  return 0;
}

int demo_command(const std::optional<fs::path>& given, const ViewOptions& options) {
  std::string name = fs::temp_directory_path() / "carom-demo-XXXXXX";
  if (!given && ::mkdtemp(name.data()) == nullptr)
    throw Error(Failure::file, name + ": cannot make a temporary directory; name one: carom demo DIR");
  const fs::path directory = given.value_or(name);
  make_output_directory(directory);
  write_file_atomically(directory / "demo.toml", kDemoDeck);
  {
    ViewOptions both = options;
    both.runs = {directory / "psa", directory / "edda"};
    both.awaited = true;
    std::vector<std::unique_ptr<Child>> runs;
    for (const fs::path& run : both.runs) {
      std::vector<std::string> arguments = {"run", directory / "demo.toml", "-o", run, "--quiet"};
      for (const std::string& set : {"integrator.type=" + run.filename().string(), std::string("run.steps=6000"),
                                     std::string("output.frame_interval=0.1")})
        arguments.insert(arguments.end(), {"--set", set});
      runs.push_back(std::make_unique<Child>(arguments));
    }
    show(both);
  }
  std::error_code ignored;
  if (!given) fs::remove_all(directory, ignored);
  return 0;
}

RunView::RunView(const fs::path& directory, std::uint16_t port, bool browser) {
  std::vector<std::string> arguments = {"view", directory, "--led", "--port", std::to_string(port)};
  if (!browser) arguments.emplace_back("--no-browser");
  server_ = std::make_unique<Child>(arguments);
  const std::string address = server_->first_line();
  if (address.empty()) throw Error(Failure::deck, "--view: there is no page, for the reason above");
  say("page: " + address);
}

RunView::~RunView() = default;

void RunView::stay() const {
  if (isatty(STDIN_FILENO) == 0) return;
  say("the run has ended; its page stays until Ctrl-C");
  sigset_t ends;
  sigemptyset(&ends);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&ends, signal);
  sigprocmask(SIG_BLOCK, &ends, nullptr);
  int signal = 0;
  sigwait(&ends, &signal);
}

}  // namespace carom
