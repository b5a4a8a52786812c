// SPDX-License-Identifier: BSD-3-Clause
#include "io/view/child.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include "engine/base/error.h"

namespace carom {

namespace {

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> all;
  all.reserve(texts.size() + 1);
  for (std::string& text : texts) all.push_back(text.data());
  all.push_back(nullptr);
  return all;
}

/// The environment without the variables of an MPI job.
std::vector<std::string> plain_environment() {
  std::vector<std::string> kept;
  for (char** entry = environ; *entry != nullptr; ++entry)
    if (const std::string_view text = *entry; !text.starts_with("PMIX_") && !text.starts_with("PMI_"))
      kept.emplace_back(text);
  return kept;
}

/// Starts a program; a negative descriptor stands for /dev/null. Returns its number, or 0.
pid_t spawn(const char* program, std::vector<std::string> arguments, int input, int output) {
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  const auto give = [&](int from, int to, int mode) {
    if (from >= 0)
      posix_spawn_file_actions_adddup2(&files, from, to);
    else
      posix_spawn_file_actions_addopen(&files, to, "/dev/null", mode, 0);
  };
  give(input, STDIN_FILENO, O_RDONLY);
  give(output, STDOUT_FILENO, O_WRONLY);
  auto environment = plain_environment();
  pid_t process = 0;
  const int error =
      posix_spawnp(&process, program, &files, nullptr, pointers(arguments).data(), pointers(environment).data());
  posix_spawn_file_actions_destroy(&files);
  return error == 0 ? process : 0;
}

}  // namespace

Child::Child(const std::vector<std::string>& arguments) {
  std::array<int, 2> in{-1, -1}, out{-1, -1};
  const bool piped = ::pipe2(in.data(), O_CLOEXEC) == 0 && ::pipe2(out.data(), O_CLOEXEC) == 0;
  const Descriptor its_input(in[0]), its_output(out[1]);
  input_ = Descriptor(in[1]);
  output_ = Descriptor(out[0]);
  std::vector<std::string> all = {"carom"};
  all.insert(all.end(), arguments.begin(), arguments.end());
  if (piped) process_ = spawn("/proc/self/exe", all, in[0], out[1]);
  if (process_ == 0) throw Error(Failure::file, std::string("cannot start carom once more: ") + std::strerror(errno));
}

Child::~Child() {
  constexpr int kTimeToEnd = 5000;  // [ms]
  ::kill(process_, SIGTERM);
  pollfd ended{.fd = output_.number(), .events = 0, .revents = 0};
  int changes = 0;
  while ((changes = ::poll(&ended, 1, kTimeToEnd)) < 0 && errno == EINTR) continue;
  if (changes == 0) ::kill(process_, SIGKILL);
  while (::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) continue;
}

std::string Child::first_line() const {
  std::string line;
  for (char c = 0; ::read(output_.number(), &c, 1) == 1 && c != '\n';) line += c;
  return line;
}

std::string open_in_browser(const std::string& address) {
  if (std::getenv("DISPLAY") == nullptr && std::getenv("WAYLAND_DISPLAY") == nullptr) return {};
  const char* folder = std::getenv("XDG_RUNTIME_DIR");
  std::string name = std::string(folder != nullptr ? folder : "/tmp") + "/carom-XXXXXX.html";
  const Descriptor file(::mkostemps(name.data(), 5, O_CLOEXEC));  // which other users cannot read
  const std::string text = "<!doctype html><meta http-equiv=refresh content=\"0;url=" + address + "\">\n";
  if (!file.is_open() || ::write(file.number(), text.data(), text.size()) != static_cast<ssize_t>(text.size()))
    return {};
  spawn("xdg-open", {"xdg-open", name}, -1, -1);
  return name;
}

}  // namespace carom
