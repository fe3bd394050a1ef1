#include <chrono>
#include <memory>
#include <utility>

#include <boost/beast/websocket.hpp>

#include "tools/viewer/server/server_state.h"

namespace tensorray {
namespace {

using Response = http::response<http::string_body>;

constexpr auto patience = std::chrono::seconds(10);  // For a request, and for its answer.
constexpr std::uint32_t max_header_bytes = 8192;

Response make_response(http::status status, const char* type, std::string bytes) {
  Response response(status, 11);
  response.set(http::field::content_type, type);
  response.set(http::field::cache_control, "no-store");
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Referrer-Policy", "no-referrer");  // The address holds the token.
  response.set("Cross-Origin-Resource-Policy", "same-origin");
  response.set("Content-Security-Policy",
               "default-src 'self'; img-src 'self' blob: data:; style-src 'self'; connect-src 'self'; "
               "frame-ancestors 'none'; base-uri 'none'; form-action 'none'");
  response.keep_alive(false);
  response.body() = std::move(bytes);
  response.prepare_payload();
  return response;
}

Response refusal(http::status status, const char* text) {
  return make_response(status, "text/plain; charset=utf-8", std::string(text) + "\n");
}

/// A file of the page; or, where the address lacks its last "/", without which the page would not find its files, the
/// right address.
Response answer_get(const Server::State& state, const HttpRequest& request) {
  const std::optional<std::string> path = state.path_of(request);
  if (path == Server::State::no_slash) {
    Response response = make_response(http::status::permanent_redirect, "text/plain; charset=utf-8", "");
    response.set(http::field::location, "/" + state.settings.token + "/");
    return response;
  }
  const auto file = path ? state.files.find(*path) : state.files.end();
  if (file == state.files.end())
    return refusal(http::status::not_found, "nothing is here; use the address that the program printed");
  return make_response(http::status::ok, file->second.type, file->second.bytes);
}

Response answer(const Server::State& state, const HttpRequest& request) {
  if (!state.is_own_host(request))
    return refusal(http::status::forbidden, "this server does not have that name; --host allows further ones");
  const bool is_head = request.method() == http::verb::head;
  Response response = answer_get(state, request);
  const bool is_found = response.result_int() < 400;
  if (is_found && !is_head && request.method() != http::verb::get) {
    response = refusal(http::status::method_not_allowed, "only GET and HEAD are answered");
    response.set(http::field::allow, "GET, HEAD");
  }
  if (is_head) response.body().clear();  // The length stays that of GET.
  return response;
}

class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(std::shared_ptr<Server::State> state, tcp::socket socket)
      : state_(std::move(state)), counted_(state_->connections), stream_(std::move(socket)) {}

  void read() {
    parser_.header_limit(max_header_bytes);
    stream_.expires_after(patience);
    http::async_read(stream_, buffer_, parser_, [self = shared_from_this()](beast::error_code error, std::size_t) {
      if (!error) self->handle();
      if (error && error.category() == http::make_error_code(http::error::bad_method).category() &&
          error != http::error::end_of_stream)
        self->write(refusal(http::status::bad_request, "this is not a request that a browser sends"));
    });
  }

 private:
  void handle() {
    const HttpRequest request = parser_.release();
    if (beast::websocket::is_upgrade(request)) return upgrade(request);
    write(answer(*state_, request));
  }

  void upgrade(const HttpRequest& request) {
    if (!state_->is_own_host(request) || !state_->is_own_origin(request))
      return write(refusal(http::status::forbidden, "a page of another site may not come here"));
    if (state_->path_of(request) != "socket")
      return write(refusal(http::status::not_found, "nothing is here; use the address that the program printed"));
    if (state_->sockets >= Server::max_pages)
      return write(refusal(http::status::service_unavailable, "too many pages are open; close one"));
    stream_.expires_never();  // The socket has its own limits of time.
    open_page_socket(state_, std::move(stream_), request);
  }

  void write(Response response) {
    response_ = std::move(response);
    stream_.expires_after(patience);
    http::async_write(stream_, response_, [self = shared_from_this()](beast::error_code, std::size_t) {
      beast::error_code ignored;
      self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    });
  }

  std::shared_ptr<Server::State> state_;
  Counted counted_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{2 * max_header_bytes};
  http::request_parser<http::empty_body> parser_;
  Response response_;
};

}  // namespace

void serve_connection(const std::shared_ptr<Server::State>& state, tcp::socket socket) {
  std::make_shared<Connection>(state, std::move(socket))->read();
}

}  // namespace tensorray
