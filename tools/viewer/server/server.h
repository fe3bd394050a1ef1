#pragma once
/// The web server of the live view: a few files over HTTP, and a WebSocket for each page. It runs on one thread
/// and only passes messages on; Pages has the thread that renders. The view is a program of its own, `tensorray-view`,
/// because Boost.Beast takes long to compile and rendering does not need it.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/process/progress.h"
#include "tools/viewer/pages.h"

namespace tensorray {

struct ServerSettings {
  std::string address = "127.0.0.1";  ///< To listen on.
  std::uint16_t port = 0;             ///< 0: any that is free.
  std::string token;                  ///< The first part of all paths; nobody may guess it.
  std::vector<std::string> hosts;     ///< Names by which browsers may call the server, beside address and "localhost".
  std::filesystem::path page;         ///< The folder of index.html, view.js and view.css.
  /// A page that still has more than this to read, beside its largest message, when another comes is closed.
  std::size_t max_waiting_bytes = 64 << 20;
};

/// Answers only requests whose path begins with the token, whose `Host` is one of the server's, and, for a WebSocket,
/// whose `Origin` is one, too: no other site may reach the server, nor by DNS rebinding. Messages, connections, pages,
/// what waits to be sent, and the time of a client are bounded.
class Server {
 public:
  struct State;

  static constexpr std::size_t max_connections = 64, max_pages = 8;
  static constexpr std::size_t max_message_bytes = 1 << 20;

  /// Listens. @throw std::runtime_error if the address or port cannot be had, or the page is not built;
  /// std::invalid_argument if the address is none.
  Server(const ServerSettings& settings, Pages& pages);
  ~Server();

  /// The address to open in a browser.
  std::string url() const;

  /// Serves until `progress` is cancelled.
  void run(const Progress& progress);

 private:
  std::shared_ptr<State> state_;
};

// The secret in the address of a live view.

/// 128 random bits, as hexadecimal digits.
std::string random_token();

/// The token of this user, which stays the same, so that pages find a server that was started again. It is kept in
/// $XDG_STATE_HOME/tensorray or ~/.local/state/tensorray, in a file that only the user may read. Else it is new.
std::string token_of_user();

}  // namespace tensorray
