#include <algorithm>
#include <memory>
#include <regex>
#include <stdexcept>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>

#include "tests/fuzz/targets.h"
#include "tests/viewer/view_support.h"

namespace tensorray::test {
namespace {

namespace asio = boost::asio;
using tcp = asio::ip::tcp;

/// A server of a small scene, until the program ends.
RunningView& view() {
  ServerSettings settings;
  settings.token = "secret";
  static RunningView only(settings);
  return only;
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
  asio::write(socket, asio::buffer(std::regex_replace(bytes, std::regex("PORT"), port)), ignored);
  socket.shutdown(tcp::socket::shutdown_send, ignored);
  std::string answer;
  asio::read(socket, asio::dynamic_buffer(answer), ignored);
  if (!answer.empty() && answer.compare(0, 9, "HTTP/1.1 ") != 0 && answer.compare(0, 9, "HTTP/1.0 ") != 0)
    throw std::logic_error("this is no answer of HTTP: " + answer.substr(0, 100));
  const std::string status = answer.substr(0, 12);
  return status == "HTTP/1.1 200" || status == "HTTP/1.1 101";
}

bool read_page_message(const std::string& bytes) {
  const auto mailbox = std::make_shared<Mailbox>();  // A message may come after the page was closed.
  const Pages::Id id = view().pages().open([mailbox](const PageMessage& message) { mailbox->sender()(message); });
  view().pages().receive(id, bytes);
  view().pages().receive(id, R"({"type": "space", "id": "the last message"})");
  mailbox->wait({{"id", "the last message"}});
  view().pages().close(id);
  const std::vector<Received> all = mailbox->all();
  return std::none_of(all.begin(), all.end(),
                      [](const Received& each) { return each.json.value("type", Json()) == "error"; });
}

}  // namespace tensorray::test
