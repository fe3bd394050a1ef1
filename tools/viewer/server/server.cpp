#include "tools/viewer/server/server.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <random>
#include <stdexcept>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>

#include "base/files/descriptor.h"
#include "base/text/text.h"
#include "tools/viewer/server/server_state.h"

namespace tensorray {
namespace {

/// Compares in a time that does not tell where two texts differ.
bool same_secret(beast::string_view a, const std::string& b) {
  unsigned difference = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < std::min<std::size_t>(a.size(), b.size()); ++i)
    difference |= static_cast<unsigned>(static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]));
  return difference == 0;
}

std::string with_brackets(const std::string& address) {
  return address.find(':') == std::string::npos ? address : "[" + address + "]";  // IPv6
}

void accept_next(const std::shared_ptr<Server::State>& state);

/// Where a connection cannot be accepted (there are no descriptors left), the next attempt would fail at once.
void accept_later(const std::shared_ptr<Server::State>& state) {
  const auto timer = std::make_shared<asio::steady_timer>(*state->io, std::chrono::milliseconds(100));
  timer->async_wait([state, timer](beast::error_code error) {
    if (!error) accept_next(state);
  });
}

/// Accepts connections; those above the limit are closed at once.
void accept_next(const std::shared_ptr<Server::State>& state) {
  state->acceptor->async_accept([state](beast::error_code error, tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (error) return accept_later(state);
    if (state->connections < Server::max_connections) serve_connection(state, std::move(socket));
    accept_next(state);
  });
}

constexpr std::size_t digits = 32;

/// The folder that a variable of the environment names; empty if it names none. A relative path would be one of the
/// working folder's, and counts as none (XDG Base Directory Specification).
std::filesystem::path folder_of(const char* variable) {
  const char* const text = std::getenv(variable);
  const std::filesystem::path folder = text ? text : "";
  return folder.is_absolute() ? folder : std::filesystem::path();
}

/// Empty if there is no such folder.
std::filesystem::path state_folder() {
  if (const auto state = folder_of("XDG_STATE_HOME"); !state.empty()) return state / "tensorray";
  if (const auto home = folder_of("HOME"); !home.empty()) return home / ".local" / "state" / "tensorray";
  return {};
}

bool is_token(const std::string& text) {
  return text.size() == digits && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

}  // namespace

Server::State::State(const ServerSettings& s, Pages& p) : settings(s), pages(p), acceptor(*io) {
  for (const auto& [path, file, type] :
       {std::array<const char*, 3>{"", "index.html", "text/html; charset=utf-8"},
        std::array<const char*, 3>{"view.js", "view.js", "text/javascript; charset=utf-8"},
        std::array<const char*, 3>{"view.css", "view.css", "text/css; charset=utf-8"}}) {
    std::ifstream stream(settings.page / file, std::ios::binary);
    if (!stream)
      throw std::runtime_error((settings.page / file).string() + ": the page is not built; `tools/view` builds it");
    files[path] = {type, {std::istreambuf_iterator<char>(stream), {}}};
  }
}

std::optional<std::string> Server::State::path_of(const HttpRequest& request) const {
  const beast::string_view whole = request.target(), target = whole.substr(0, whole.find('?'));
  const std::size_t end = std::min(target.find('/', 1), target.size());
  if (target.empty() || target[0] != '/') return std::nullopt;
  if (!same_secret(target.substr(1, end - 1), settings.token)) return std::nullopt;
  return end == target.size() ? no_slash : std::string(target.substr(end + 1));
}

bool Server::State::is_own_host(const HttpRequest& request) const {
  return request.count(http::field::host) == 1 && hosts.count(lower_case(std::string(request[http::field::host]))) > 0;
}

bool Server::State::is_own_origin(const HttpRequest& request) const {
  const beast::string_view scheme = "http://", origin = request[http::field::origin];
  return request.count(http::field::origin) == 1 && origin.starts_with(scheme) &&
         hosts.count(lower_case(std::string(origin.substr(scheme.size())))) > 0;
}

Server::Server(const ServerSettings& settings, Pages& pages) : state_(std::make_shared<State>(settings, pages)) {
  boost::system::error_code is_no_address;
  const tcp::endpoint endpoint(asio::ip::make_address(settings.address, is_no_address), settings.port);
  if (is_no_address)
    throw std::invalid_argument("--listen " + settings.address + ": not an IP address, such as 127.0.0.1");
  try {
    state_->acceptor->open(endpoint.protocol());
    state_->acceptor->set_option(asio::socket_base::reuse_address(true));
    state_->acceptor->bind(endpoint);
    state_->acceptor->listen();
  } catch (const boost::system::system_error& error) {
    throw std::runtime_error(fmt::format("cannot listen on {}:{}: {}; choose another --port or --listen",
                                         settings.address, settings.port, error.code().message()));
  }
  const int port = state_->acceptor->local_endpoint().port();
  std::vector<std::string> names = settings.hosts;
  names.insert(names.end(), {with_brackets(settings.address), "localhost"});
  for (const std::string& name : names) {
    state_->hosts.insert(lower_case(fmt::format("{}:{}", name, port)));
    if (port == 80) state_->hosts.insert(lower_case(name));  // Which browsers leave out.
  }
  accept_next(state_);
}

/// Connections hold the state, whose handlers hold them.
Server::~Server() {
  state_->acceptor.reset();
  state_->io.reset();
}

std::string Server::url() const {
  return fmt::format("http://{}:{}/{}/", with_brackets(state_->settings.address),
                     state_->acceptor->local_endpoint().port(), state_->settings.token);
}

void Server::run(const Progress& progress) {
  constexpr auto between_looks = std::chrono::milliseconds(100);
  while (!progress.cancelled) state_->io->run_for(between_looks);
}

std::string random_token() {
  std::random_device device;  // Of the system; see random(7).
  std::string token;
  for (std::size_t i = 0; i < digits / 8; ++i) token += fmt::format("{:08x}", device());
  return token;
}

std::string token_of_user() {
  const std::filesystem::path folder = state_folder();
  if (folder.empty()) return random_token();
  const std::filesystem::path file = folder / "view-token";
  std::string token;
  std::getline(std::ifstream(file) >> std::ws, token);
  if (is_token(token)) return token;
  token = random_token();
  std::error_code ignored;  // Without the file, the token is good for this run.
  std::filesystem::create_directories(folder, ignored);
  Descriptor written = open_file(file, O_WRONLY | O_CREAT | O_TRUNC, 0600);
  const bool is_kept = written.is_open() && write_whole(written.get(), token + "\n") && written.close();
  if (!is_kept) std::filesystem::remove(file, ignored);
  return token;
}

}  // namespace tensorray
