#pragma once
/// @file tools/viewer/server/http_connection.h
/// One connection of a browser: a file of the page, or the beginning of a WebSocket.

#include "tools/viewer/server/server_state.h"

namespace tensorray {

/// Reads one request and answers it. The connection keeps itself alive while it has something to do.
void serve_connection(const std::shared_ptr<Server::State>& state, tcp::socket socket);

}  // namespace tensorray
