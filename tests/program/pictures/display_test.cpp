// `tensorray render --display`: the viewer gets the picture, and the render does not need the viewer.

#include <cstdint>
#include <cstring>
#include <map>

#include <arpa/inet.h>
#include <fmt/core.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "renderer/images/image.h"
#include "tests/program/support.h"

namespace tensorray {
namespace {

using namespace test;

/// Takes values from the front of a message.
struct Message {
  std::string bytes;
  std::size_t at = 0;

  template <class Number>
  Number number() {
    Number value{};
    EXPECT_LE(at + sizeof value, bytes.size());
    std::memcpy(&value, bytes.data() + at, sizeof value);
    at += sizeof value;
    return value;
  }
  std::string text() {
    const std::string value = bytes.c_str() + at;
    at += value.size() + 1;
    return value;
  }
  std::vector<std::string> texts(int count) {
    std::vector<std::string> values;
    for (int i = 0; i < count; ++i) values.push_back(text());
    return values;
  }
};

/// A viewer that keeps what it is told.
class Viewer {
 public:
  /// @param messages  The number that it reads before it goes away.
  explicit Viewer(int messages = 1 << 30) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    EXPECT_EQ(bind(socket_, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(listen(socket_, 1), 0);
    getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this, messages] { serve(messages); });
  }
  ~Viewer() {
    shutdown(socket_, SHUT_RDWR);
    thread_.join();
    close(socket_);
  }

  std::string address() const { return fmt::format("127.0.0.1:{}", port_); }

  /// After the program has ended.
  const Image& picture() {
    while (!is_closed_) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return picture_;
  }
  int creations = 0, updates = 0;
  std::string name;

 private:
  static bool read_all(int from, char* bytes, std::size_t size) {
    while (size > 0) {
      const ssize_t got = recv(from, bytes, size, 0);
      if (got <= 0) return false;
      bytes += got;
      size -= static_cast<std::size_t>(got);
    }
    return true;
  }

  void serve(int messages) {
    const int from = accept(socket_, nullptr, nullptr);
    for (int i = 0; i < messages && from >= 0; ++i) {
      std::uint32_t size = 0;
      if (!read_all(from, reinterpret_cast<char*>(&size), sizeof size) || size < sizeof size) break;
      Message message{std::string(size - sizeof size, 0)};
      if (!read_all(from, message.bytes.data(), message.bytes.size())) break;
      take(message);
    }
    if (from >= 0) close(from);
    is_closed_ = true;
  }

  void take(Message& message) {
    const int kind = message.number<std::uint8_t>();
    message.number<std::uint8_t>();  // Whether the viewer comes to the front.
    name = message.text();
    if (kind == 4) {
      ++creations;
      const int width = message.number<std::int32_t>(), height = message.number<std::int32_t>();
      picture_ = Image(width, height, message.texts(message.number<std::int32_t>()));
    } else if (kind == 6) {
      ++updates;
      update(message);
    } else {
      ADD_FAILURE() << "kind " << kind;
    }
    EXPECT_EQ(message.at, message.bytes.size());
  }

  void update(Message& message) {
    const int channels = message.number<std::int32_t>();
    EXPECT_EQ(message.texts(channels), picture_.channels);
    const int left = message.number<std::int32_t>(), top = message.number<std::int32_t>();
    const int width = message.number<std::int32_t>(), height = message.number<std::int32_t>();
    std::vector<std::int64_t> begins, strides;
    for (int i = 0; i < channels; ++i) begins.push_back(message.number<std::int64_t>());
    for (int i = 0; i < channels; ++i) strides.push_back(message.number<std::int64_t>());
    std::vector<float> data((message.bytes.size() - message.at) / sizeof(float));
    for (float& value : data) value = message.number<float>();
    ASSERT_LE(left + width, picture_.width);
    ASSERT_LE(top + height, picture_.height);
    for (int i = 0; i < width * height; ++i)
      for (int channel = 0; channel < channels; ++channel)
        picture_.pixel(left + i % width, top + i / width)[channel] = data.at(static_cast<std::size_t>(
            begins[static_cast<std::size_t>(channel)] + i * strides[static_cast<std::size_t>(channel)]));
  }

  const int socket_;
  int port_ = 0;
  Image picture_;
  std::atomic<bool> is_closed_{false};
  std::thread thread_;
};

class Display : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    write("scene.json", R"({
      "field": {"generate": {"kind": "point_load", "resolution": 17}, "scale": 4},
      "integrator": {"type": "path_tracing", "max_samples": 64, "min_samples": 8, "bands": 8},
      "camera": {"resolution": [150, 100]}})");
  }
};

TEST_F(Display, TheViewerGetsThePicture) {
  Viewer viewer;
  run_well({"render", "scene.json", "-q", "-o", "a.exr", "--display", viewer.address()});
  const Image file = read_image(in_folder("a.exr")), &shown = viewer.picture();
  EXPECT_EQ(viewer.name, "a.exr");
  EXPECT_EQ(viewer.creations, 1);
  EXPECT_GE(viewer.updates, 3 * 2);  // Tiles of 64 pixels.
  ASSERT_EQ(shown.width, file.width);
  ASSERT_EQ(shown.height, file.height);
  for (int y = 0; y < file.height; ++y)
    for (int x = 0; x < file.width; ++x)
      for (std::size_t i = 0; i < shown.channels.size(); ++i) {
        const auto channel = std::find(file.channels.begin(), file.channels.end(), shown.channels[i]);
        ASSERT_NE(channel, file.channels.end());
        ASSERT_EQ(shown.pixel(x, y)[i], file.pixel(x, y)[channel - file.channels.begin()]) << x << " " << y;
      }
}

TEST_F(Display, ARenderDoesNotNeedItsViewer) {
  run_well({"render", "scene.json", "-q", "-o", "alone.exr"});
  std::string gone;
  {
    Viewer viewer(2);
    gone = viewer.address();
    const Outcome outcome = run_well({"render", "scene.json", "-q", "-o", "a.exr", "--display", viewer.address()});
    EXPECT_LE(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
  }
  const Outcome outcome = run_well({"render", "scene.json", "-q", "-o", "b.exr", "--display", gone});
  EXPECT_NE(outcome.error.find("the viewer cannot be reached"), std::string::npos) << outcome.error;
  EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
  EXPECT_TRUE(read_file(in_folder("a.exr")) == read_file(in_folder("alone.exr")));
  EXPECT_TRUE(read_file(in_folder("b.exr")) == read_file(in_folder("alone.exr")));
  for (const char* address : {"host:", ":14158", "host:0", "host:x", "host:99999"}) {
    const Outcome wrong = run({"render", "scene.json", "--display", address});
    EXPECT_EQ(wrong.status, 2) << address;
    EXPECT_NE(wrong.error.find("--display"), std::string::npos) << wrong.error;
  }
}

}  // namespace
}  // namespace tensorray
