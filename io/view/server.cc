// SPDX-License-Identifier: BSD-3-Clause
#include "io/view/server.h"

#include <sys/random.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <exception>
#include <utility>
#include <vector>

// The headers above are missing in Boost 1.74's awaitable.hpp.
#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>

#include "engine/base/error.h"

namespace carom {

namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using Request = http::request<http::empty_body>;
using Response = http::response<http::string_body>;

/// A browser keeps six connections, each with at most one answer in memory; beyond the limit the longest idle
/// connection is closed.
constexpr std::size_t kMostConnections = 24;
/// A connection on which no request comes and no byte of an answer goes for this long is closed.
constexpr std::chrono::seconds kTimeIdle(10);
/// The time until the next attempt if no connection can be accepted, for example without a free descriptor.
constexpr std::chrono::milliseconds kAcceptRetry(100);

struct Connection {
  beast::tcp_stream stream;
  bool trusted = false;  ///< a request on it had the token
};

/// Whether a Host header names this machine, with any port (ssh forwards from another one). Any other name may be an
/// attacker's that resolves to this machine, whose page would have the same origin for the browser.
bool names_this_machine(std::string_view host) {
  const auto is_port = [](std::string_view text) {
    return text.empty() || (text[0] == ':' && text.find_first_not_of("0123456789", 1) == text.npos);
  };
  for (const std::string_view name : {"localhost", "127.0.0.1", "[::1]"})
    if (beast::iequals({host.data(), std::min(host.size(), name.size())}, {name.data(), name.size()}))
      return is_port(host.substr(name.size()));
  return false;
}

std::string random_token() {
  std::array<unsigned char, 16> bytes{};
  if (::getentropy(bytes.data(), bytes.size()) != 0)
    throw Error(Failure::file, "no random numbers from the operating system for the page's address");
  std::string token;
  for (const unsigned char byte : bytes) {
    token += "0123456789abcdef"[byte >> 4];
    token += "0123456789abcdef"[byte & 15];
  }
  return token;
}

}  // namespace

struct PageServer::Sockets {
  Answers answers;
  std::string root = "/" + random_token() + "/";
  asio::io_context context{1};
  tcp::acceptor acceptor{context};
  asio::posix::stream_descriptor input{context};
  std::array<char, 64> ignored{};
  std::vector<Connection*> open{};  // the longest idle connection comes first

  Response response_to(const Request& request, Connection& connection) const {
    Response response(http::status::ok, request.version());
    response.keep_alive(request.keep_alive());
    response.set(http::field::cache_control, "no-store");
    response.set("Referrer-Policy", "no-referrer");
    response.set("X-Content-Type-Options", "nosniff");
    const auto refuse = [&](http::status status, const std::string& why) {
      response.result(status);
      response.set(http::field::content_type, "text/plain; charset=utf-8");
      response.body() = why + "\n";
    };
    const auto text = [](boost::string_view part) { return std::string_view(part.data(), part.size()); };
    const std::string_view target = text(request.target());
    const bool head = request.method() == http::verb::head;
    connection.trusted = false;
    if (request.count(http::field::host) != 1 || !names_this_machine(text(request[http::field::host]))) {
      refuse(http::status::misdirected_request, "no name of this machine: take 127.0.0.1 or localhost in the address");
    } else if (!target.starts_with(root)) {
      refuse(http::status::forbidden, "not this address: take the whole one that carom has printed");
    } else if (connection.trusted = true; request.method() != http::verb::get && !head) {
      refuse(http::status::method_not_allowed, "this page can only be read");
      response.set(http::field::allow, "GET, HEAD");
    } else {
      try {
        if (auto answer = answers(target.substr(root.size()))) {
          response.set(http::field::content_type, answer->type);
          response.body() = std::move(answer->body);
        } else {
          refuse(http::status::not_found, "no such thing here");
        }
      } catch (const std::exception& e) {
        refuse(http::status::service_unavailable, e.what());
      }
    }
    if (!connection.trusted) response.keep_alive(false);
    response.prepare_payload();
    if (head) response.body().clear();  // with the headers of GET
    return response;
  }

  /// Marks a connection as active: it becomes the last to be closed if there are too many.
  void has_moved(const Connection& connection) {
    if (const auto at = std::ranges::find(open, &connection); at != open.end()) std::rotate(at, at + 1, open.end());
  }

  void close_stillest() {
    auto at = std::ranges::find(open, false, &Connection::trusted);
    if (at == open.end()) at = open.begin();
    (*at)->stream.close();
    open.erase(at);
  }

  asio::awaitable<void> talk(tcp::socket socket) {
    Connection connection{.stream = beast::tcp_stream(std::move(socket))};
    if (open.size() == kMostConnections) close_stillest();
    open.push_back(&connection);
    try {
      beast::flat_buffer buffer;
      for (bool more = true; more;) {
        Request request;
        connection.stream.expires_after(kTimeIdle);
        co_await http::async_read(connection.stream, buffer, request, asio::use_awaitable);
        Response response = response_to(request, connection);
        more = response.keep_alive();
        for (http::response_serializer<http::string_body> rest(response); !rest.is_done();) {
          has_moved(connection);
          connection.stream.expires_after(kTimeIdle);
          co_await http::async_write_some(connection.stream, rest, asio::use_awaitable);
        }
      }
    } catch (const std::exception&) {  // the browser has gone, is too slow, or speaks no HTTP
    }
    std::erase(open, &connection);
  }

  asio::awaitable<void> accept() {
    asio::steady_timer pause(context);
    while (true) {
      boost::system::error_code error;
      tcp::socket socket = co_await acceptor.async_accept(asio::redirect_error(asio::use_awaitable, error));
      if (!error) {
        asio::co_spawn(context, talk(std::move(socket)), asio::detached);
      } else {
        pause.expires_after(kAcceptRetry);
        co_await pause.async_wait(asio::use_awaitable);
      }
    }
  }

  void until_input_ends() {
    input.async_read_some(asio::buffer(ignored), [this](const boost::system::error_code& error, std::size_t) {
      if (error) return context.stop();
      until_input_ends();
    });
  }
};

PageServer::PageServer(std::uint16_t port, Answers answers) : sockets_(new Sockets{.answers = std::move(answers)}) {
  const tcp::endpoint here(asio::ip::address_v4::loopback(), port);
  boost::system::error_code error;
  tcp::acceptor& acceptor = sockets_->acceptor;
  acceptor.open(here.protocol());
  acceptor.set_option(tcp::acceptor::reuse_address(true));
  acceptor.bind(here, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error)
    throw Error(Failure::deck, "--port " + std::to_string(port) + ": cannot listen there: " + error.message() +
                                   "; choose another one, or leave the option out");
  address_ = "http://127.0.0.1:" + std::to_string(acceptor.local_endpoint().port()) + sockets_->root;
  asio::co_spawn(sockets_->context, sockets_->accept(), asio::detached);
}

PageServer::~PageServer() = default;

void PageServer::serve(bool led) {
  asio::signal_set signals(sockets_->context, SIGTERM);
  if (led) {
    std::signal(SIGINT, SIG_IGN);
    std::signal(SIGHUP, SIG_IGN);
    sockets_->input.assign(::dup(STDIN_FILENO));
    sockets_->until_input_ends();
  } else {
    signals.add(SIGINT);
  }
  signals.async_wait([this](const boost::system::error_code&, int) { sockets_->context.stop(); });
  sockets_->context.run();
}

}  // namespace carom
