#include "tools/rendering/tev_display.h"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <netdb.h>
#include <sys/socket.h>

#include "base/files/descriptor.h"
#include "base/text/byte_order.h"
#include "scenes/keys/scene_source.h"
#include "tools/command_line/tell.h"

namespace tensorray {
namespace {

constexpr int tile_size = 64;  ///< Pixels.
constexpr int patience = 3;    ///< Seconds after which a viewer that does not read is gone.
enum class Kind : std::uint8_t { create_image = 4, update_image = 6 };

struct Address {
  std::string host, port = "14158";
};

Address address_of(const std::string& text) {
  Address address;
  const std::size_t colon = text.rfind(':');
  address.host = text.substr(0, colon);
  if (colon != std::string::npos) address.port = text.substr(colon + 1);
  return address;
}

class Message {
 public:
  explicit Message(Kind kind) : bytes_(sizeof(std::uint32_t), 0) { bytes_ += static_cast<char>(kind); }

  template <class Number>
  Message& number(Number value) {
    append_number(value, ByteOrder::little, bytes_);
    return *this;
  }
  Message& flag(bool value) {
    bytes_ += value ? '\1' : '\0';
    return *this;
  }
  Message& text(const std::string& value) {
    bytes_.append(value.c_str(), value.size() + 1);
    return *this;
  }

  /// With its length in front.
  std::string bytes() && {
    std::string length;
    append_number(static_cast<std::uint32_t>(bytes_.size()), ByteOrder::little, length);
    return std::move(bytes_.replace(0, length.size(), length));
  }

 private:
  std::string bytes_;
};

/// The channels that are sent: three colours, and alpha if the picture has it.
int sent_channels(const Image& picture) {
  const std::vector<std::string>& channels = picture.channels;
  return channels.size() > 3 && channels[3] == "A" ? 4 : std::min<int>(3, static_cast<int>(channels.size()));
}

bool is_equal(const Image& a, const Image& b, int left, int top, int width, int height) {
  const std::size_t row = static_cast<std::size_t>(width) * a.channels.size() * sizeof(float);
  for (int y = top; y < top + height; ++y)
    if (std::memcmp(a.pixel(left, y), b.pixel(left, y), row) != 0) return false;
  return true;
}

/// A socket that is connected, or none. It waits `patience` seconds at most, also later when it sends.
Descriptor connect_to(const Address& address) {
  addrinfo wanted{}, *found = nullptr;
  wanted.ai_socktype = SOCK_STREAM;
  if (getaddrinfo(address.host.c_str(), address.port.c_str(), &wanted, &found) != 0) return {};
  Descriptor connected;
  for (const addrinfo* each = found; each && !connected.is_open(); each = each->ai_next) {
    Descriptor handle(socket(each->ai_family, each->ai_socktype | SOCK_CLOEXEC, each->ai_protocol));
    if (!handle.is_open()) continue;
    const timeval limit{patience, 0};
    setsockopt(handle.get(), SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);  // Also limits connect().
    if (connect(handle.get(), each->ai_addr, each->ai_addrlen) == 0) connected = std::move(handle);
  }
  freeaddrinfo(found);
  return connected;
}

}  // namespace

void check_display_address(const std::string& text) {
  const Address address = address_of(text);
  const bool is_number = !address.port.empty() && address.port.size() <= 5 &&
                         address.port.find_first_not_of("0123456789") == std::string::npos;
  if (address.host.empty() || !is_number || std::stoi(address.port) < 1 || std::stoi(address.port) > 65535)
    throw std::invalid_argument("--display " + printable(text) + ": give HOST:PORT, as 127.0.0.1:14158");
}

TevDisplay::TevDisplay(const std::string& address, std::string name)
    : address_(address), name_(std::move(name)), socket_(connect_to(address_of(address))) {
  if (!socket_.is_open()) lose("cannot be reached");
}

void TevDisplay::lose(const std::string& why) {
  tell({fmt::format("warning: --display {}: the viewer {}; the render goes on without it", printable(address_), why)},
       false);
  socket_.close();
}

void TevDisplay::send(const std::string& message) {
  for (std::size_t sent = 0; socket_.is_open() && sent < message.size();) {
    const ssize_t size = ::send(socket_.get(), message.data() + sent, message.size() - sent, MSG_NOSIGNAL);
    if (size > 0)
      sent += static_cast<std::size_t>(size);
    else if (size == 0 || errno != EINTR)
      lose("has gone");
  }
}

void TevDisplay::send_tile(const Image& picture, int left, int top) {
  const int width = std::min(tile_size, picture.width - left), height = std::min(tile_size, picture.height - top);
  if (is_equal(picture, shown_, left, top, width, height)) return;
  const int channels = sent_channels(picture);
  Message message(Kind::update_image);
  message.flag(false).text(name_).number<std::int32_t>(channels);
  for (int i = 0; i < channels; ++i) message.text(picture.channels[static_cast<std::size_t>(i)]);
  for (const std::int32_t value : {left, top, width, height}) message.number(value);
  for (int i = 0; i < channels; ++i) message.number<std::int64_t>(i);         // Where the channel begins,
  for (int i = 0; i < channels; ++i) message.number<std::int64_t>(channels);  // and how far pixels are apart.
  for (int y = top; y < top + height; ++y)
    for (int x = left; x < left + width; ++x)
      for (int i = 0; i < channels; ++i) message.number(picture.pixel(x, y)[i]);
  send(std::move(message).bytes());
}

void TevDisplay::show(const Image& linear) {
  if (!socket_.is_open() || linear.pixels.empty()) return;
  if (shown_.pixels.empty()) {
    shown_ = Image(linear.width, linear.height, linear.channels);
    const int channels = sent_channels(linear);
    Message message(Kind::create_image);
    message.flag(true).text(name_).number<std::int32_t>(linear.width).number<std::int32_t>(linear.height);
    message.number<std::int32_t>(channels);
    for (int i = 0; i < channels; ++i) message.text(linear.channels[static_cast<std::size_t>(i)]);
    send(std::move(message).bytes());
  }
  for (int top = 0; top < linear.height; top += tile_size)
    for (int left = 0; left < linear.width; left += tile_size) send_tile(linear, left, top);
  shown_ = linear;
}

}  // namespace tensorray
