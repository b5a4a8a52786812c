// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A page on this machine alone: HTTP on a port of 127.0.0.1, behind a random token that is the first part of its
// address. Only GET and HEAD, only for requests whose Host is a name of this machine; one thread, a bounded number of
// connections.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "io/view/run_source.h"

namespace carom {

class PageServer {
 public:
  /// The answer to a path behind the token, or nullopt for an unknown path. May throw: the page then shows the error.
  using Answers = std::function<std::optional<Answer>(std::string_view path)>;

  /// Listens from now on; `port` 0: any free one. Throws Error(Failure::deck) if the port is taken.
  PageServer(std::uint16_t port, Answers answers);
  ~PageServer();
  PageServer(const PageServer&) = delete;
  PageServer& operator=(const PageServer&) = delete;

  /// `http://127.0.0.1:PORT/TOKEN/`
  const std::string& address() const { return address_; }

  /// Answers until SIGINT or SIGTERM; `led`: until SIGTERM, or standard input ends, which happens when the parent
  /// process ends; SIGINT and SIGHUP are left to the parent.
  void serve(bool led);

 private:
  struct Sockets;
  std::unique_ptr<Sockets> sockets_;
  std::string address_;
};

}  // namespace carom
