#include "io/view/server.h"

#include <sys/random.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <exception>
#include <utility>

// What Boost 1.74's awaitable.hpp leaves out stands above.
#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>

#include "engine/base/error.h"

namespace carom {

namespace {

namespace asio = boost::asio;
namespace http = boost::beast::http;
using asio::ip::tcp;
using Request = http::request<http::empty_body>;
using Response = http::response<http::string_body>;

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

  Response response_to(const Request& request) const {
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
    const std::string_view target(request.target().data(), request.target().size());
    if (!target.starts_with(root)) {
      refuse(http::status::forbidden, "not this address: take the whole one that carom has printed");
    } else if (request.method() != http::verb::get) {
      refuse(http::status::method_not_allowed, "this page can only be read");
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
    response.prepare_payload();
    return response;
  }

  asio::awaitable<void> talk(tcp::socket socket) {
    try {
      boost::beast::flat_buffer buffer;
      for (bool more = true; more;) {
        Request request;
        co_await http::async_read(socket, buffer, request, asio::use_awaitable);
        Response response = response_to(request);
        more = response.keep_alive();
        co_await http::async_write(socket, response, asio::use_awaitable);
      }
    } catch (const boost::system::system_error&) {  // the browser has gone, or speaks no HTTP
    }
  }

  asio::awaitable<void> accept() {
    while (true) {
      boost::system::error_code error;
      tcp::socket socket = co_await acceptor.async_accept(asio::redirect_error(asio::use_awaitable, error));
      if (!error) asio::co_spawn(context, talk(std::move(socket)), asio::detached);
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
