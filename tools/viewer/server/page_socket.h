#pragma once
/// @file tools/viewer/server/page_socket.h
/// The WebSocket of one page.

#include "tools/viewer/server/server_state.h"

namespace tensorray {

/// Accepts the WebSocket, opens a page, and passes messages between them until one of the two ends.
void open_page_socket(const std::shared_ptr<Server::State>& state, beast::tcp_stream stream,
                      const HttpRequest& request);

}  // namespace tensorray
