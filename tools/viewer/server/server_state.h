#pragma once
/// What all connections of a Server share. Private to the sources of the server: it includes Boost.

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>

#include "tools/viewer/server/server.h"

namespace tensorray {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using tcp = asio::ip::tcp;
using HttpRequest = http::request<http::empty_body>;

struct PageFile {
  const char* type;
  std::string bytes;
};

/// All handlers run on the one thread that calls Server::run.
struct Server::State {
  /// Reads the page's files. @throw std::runtime_error naming a file that is missing.
  State(const ServerSettings& settings, Pages& pages);

  /// A path that ends with the token, which is no path of the page.
  static constexpr const char* no_slash = "/";

  /// What follows the token in the path of a request, without a query; none if the token is wrong.
  std::optional<std::string> path_of(const HttpRequest& request) const;

  bool is_own_host(const HttpRequest& request) const;
  bool is_own_origin(const HttpRequest& request) const;

  ServerSettings settings;
  Pages& pages;
  std::map<std::string, PageFile> files;  ///< The page's files, by what follows the token in their paths.
  std::shared_ptr<asio::io_context> io = std::make_shared<asio::io_context>(1);
  std::optional<tcp::acceptor> acceptor;
  std::set<std::string> hosts;  ///< With the port.
  std::size_t connections = 0, sockets = 0;
};

/// Counts something while it exists.
class Counted {
 public:
  explicit Counted(std::size_t& count) : count_(count) { ++count_; }
  ~Counted() { --count_; }
  Counted(const Counted&) = delete;
  Counted& operator=(const Counted&) = delete;

 private:
  std::size_t& count_;
};

/// Reads one request of a browser and answers it: with a file of the page, or the beginning of a WebSocket. The
/// connection keeps itself alive while it has something to do. In http_connection.cpp.
void serve_connection(const std::shared_ptr<Server::State>& state, tcp::socket socket);

/// Accepts the WebSocket of a page, opens the page, and passes messages between them until one of the two ends. In
/// page_socket.cpp.
void open_page_socket(const std::shared_ptr<Server::State>& state, beast::tcp_stream stream,
                      const HttpRequest& request);

}  // namespace tensorray
