#pragma once
/// @file tools/rendering/tev_display.h
/// Shows a picture in the viewer tev while it is rendered, by tev's protocol over TCP. A message is its length in bytes
/// (32 bits, with themselves), its kind (8 bits), and its values; numbers are little-endian, texts end with a zero.

#include <string>

#include "base/files/descriptor.h"
#include "renderer/images/image.h"

namespace tensorray {

class TevDisplay {
 public:
  /// Connects. Where there is no viewer, or it goes away later, one warning says so, and nothing is shown.
  /// @param address  HOST or HOST:PORT (14158).
  /// @param name     Of the picture, in the viewer.
  TevDisplay(const std::string& address, std::string name);

  /// Sends the tiles whose pixels have changed since the last call, in linear light: red, green, blue, and alpha.
  void show(const Image& linear);

 private:
  void send(const std::string& message);
  void send_tile(const Image& picture, int left, int top);
  void lose(const std::string& why);

  const std::string address_, name_;
  Descriptor socket_;
  Image shown_;  ///< What the viewer has.
};

/// @throw std::invalid_argument if this is no address.
void check_display_address(const std::string& address);

}  // namespace tensorray
