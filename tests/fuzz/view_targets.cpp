#include "tests/fuzz/view_targets.h"

#include <condition_variable>
#include <memory>
#include <mutex>
#include <stdexcept>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>

#include "tests/viewer/view_support.h"

namespace tensorray::test {
namespace {

namespace asio = boost::asio;
using tcp = asio::ip::tcp;

/// A server of a small scene, until the program ends.
RunningView& view() {
  static RunningView only([] {
    ServerSettings settings;
    settings.token = "secret";
    return settings;
  }());
  return only;
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size())
    text.replace(at, what.size(), by);
  return text;
}

}  // namespace

bool read_http(const std::string& bytes) {
  const std::string port = view().port();
  asio::io_context context;
  tcp::socket socket(context, tcp::v4());
  // Of one address, a port may not be used again for a minute: ports would come to an end.
  static std::uint32_t connections = 0;
  const std::uint32_t address = 0x7F000100u + connections++ % 0xFFFFu;
  socket.bind({asio::ip::address_v4(address), 0});
  boost::system::error_code ignored;  // The server may end the connection at any time.
  socket.connect({asio::ip::make_address("127.0.0.1"), static_cast<std::uint16_t>(std::stoi(port))}, ignored);
  if (ignored) return false;  // The fuzzer's clock has interrupted it.
  asio::write(socket, asio::buffer(replaced(bytes, "PORT", port)), ignored);
  socket.shutdown(tcp::socket::shutdown_send, ignored);
  std::string answer;
  asio::read(socket, asio::dynamic_buffer(answer), ignored);
  if (!answer.empty() && answer.compare(0, 9, "HTTP/1.1 ") != 0 && answer.compare(0, 9, "HTTP/1.0 ") != 0)
    throw std::logic_error("this is no answer of HTTP: " + answer.substr(0, 100));
  const std::string status = answer.substr(0, 12);
  return status == "HTTP/1.1 200" || status == "HTTP/1.1 101";
}

bool read_page_message(const std::string& bytes) {
  struct Answer {
    std::mutex mutex;
    std::condition_variable arrived;
    bool is_there = false, has_error = false;
  };
  const auto answer = std::make_shared<Answer>();  // A message may come after the page was closed.
  const Pages::Id id = view().pages().open([answer](const PageMessage& message) {
    const std::lock_guard<std::mutex> lock(answer->mutex);
    const Json json = received(message).json;
    answer->is_there |= json.value("id", Json()) == "the last message";
    answer->has_error |= json.value("type", Json()) == "error";
    answer->arrived.notify_all();
  });
  view().pages().receive(id, bytes);
  view().pages().receive(id, R"({"type": "space", "id": "the last message"})");
  {
    std::unique_lock<std::mutex> lock(answer->mutex);
    answer->arrived.wait(lock, [&] { return answer->is_there; });
  }
  view().pages().close(id);
  const std::lock_guard<std::mutex> lock(answer->mutex);
  return !answer->has_error;
}

}  // namespace tensorray::test
