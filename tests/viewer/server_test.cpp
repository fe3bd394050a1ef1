// The web server, by real connections: what it refuses, and that it lives on.

#include "tools/viewer/server/server.h"

#include <map>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

#include "tests/viewer/view_support.h"

namespace tensorray {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using tcp = asio::ip::tcp;
using Socket = beast::websocket::stream<tcp::socket>;

ServerSettings settings_of(const std::string& token) {
  ServerSettings settings;
  settings.token = token;
  settings.hosts = {"workstation"};
  settings.max_waiting_bytes = 1 << 20;
  return settings;
}

class ServerTest : public ::testing::Test {
 protected:
  tcp::socket connect() {
    tcp::socket socket(io_);
    socket.connect({asio::ip::make_address("127.0.0.1"), static_cast<std::uint16_t>(std::stoi(port_))});
    return socket;
  }

  std::string own_host() const { return "127.0.0.1:" + port_; }

  http::response<http::string_body> get(const std::string& path, const std::string& host,
                                        http::verb verb = http::verb::get) {
    tcp::socket socket = connect();
    http::request<http::empty_body> request(verb, path, 11);
    request.set(http::field::host, host);
    http::write(socket, request);
    beast::flat_buffer buffer;
    http::response_parser<http::string_body> parser;
    parser.skip(verb == http::verb::head);
    http::read(socket, buffer, parser);
    return parser.release();
  }

  /// Sends bytes and reads until the server closes. @return What came.
  std::string exchange(const std::string& bytes) {
    tcp::socket socket = connect();
    beast::error_code error;
    asio::write(socket, asio::buffer(bytes), error);
    std::string answer;
    asio::read(socket, asio::dynamic_buffer(answer), error);
    return answer;
  }

  /// @throw boost::system::system_error if the server refuses it.
  Socket open_socket(const std::string& origin, const std::string& path) {
    Socket socket(connect());
    socket.set_option(beast::websocket::stream_base::decorator([&](beast::websocket::request_type& request) {
      if (!origin.empty()) request.set(http::field::origin, origin);
    }));
    socket.read_message_max(64 << 20);
    socket.handshake(own_host(), path);
    return socket;
  }
  Socket open_socket() { return open_socket("http://" + own_host(), path("socket")); }

  std::string path(const std::string& name) const { return "/" + token_ + "/" + name; }

  Json read_json(Socket& socket) {
    beast::flat_buffer buffer;
    socket.read(buffer);
    read_bytes_ = buffer.size();
    PageMessage message{socket.got_binary(), false, beast::buffers_to_string(buffer.data())};
    return test::received(message).json;
  }

  static void write_json(Socket& socket, const Json& json) { socket.write(asio::buffer(json.dump())); }

  /// A new socket that has got the picture of a scene.
  Socket socket_with_picture(const Json& scene = test::small_scene()) {
    Socket socket = open_socket();
    EXPECT_EQ(read_json(socket).at("type"), "hello");
    write_json(socket, {{"type", "scene"}, {"id", 1}, {"scene", scene}});
    for (Json json = Json::object(); !json.value("final", false);) json = read_json(socket);
    return socket;
  }

  const std::string token_ = random_token();
  const ServerSettings settings_ = settings_of(token_);
  test::RunningView view_{settings_};
  const std::string port_ = view_.port();
  std::size_t read_bytes_ = 0;  ///< Of the last message.
  asio::io_context io_;
};

TEST_F(ServerTest, ServesItsFilesAndNoOthers) {
  const auto page = get(path(""), own_host());
  EXPECT_EQ(page.result_int(), 200u);
  EXPECT_EQ(page.body(), "content of index.html");
  EXPECT_NE(std::string(page["Content-Security-Policy"]).find("default-src 'self'"), std::string::npos);
  EXPECT_EQ(page["Referrer-Policy"], "no-referrer");
  EXPECT_EQ(get(path("view.js"), "localhost:" + port_).body(), "content of view.js");
  EXPECT_EQ(get(path("view.css"), "workstation:" + port_).body(), "content of view.css");
  for (const char* name : {"scene.json", "../scene.json", "%2e%2e/scene.json", "view.js/", "/etc/passwd", "socket"})
    EXPECT_EQ(get(path(name), own_host()).result_int(), 404u) << name;
  EXPECT_EQ(get(path(""), own_host(), http::verb::post).result_int(), 405u);
}

/// What people and programs make of the address that was printed.
TEST_F(ServerTest, AnswersWhatIsMeant) {
  EXPECT_EQ(get(path("?utm_source=/chat/"), own_host()).body(), "content of index.html");
  EXPECT_EQ(get(path("view.js?v=2"), own_host()).body(), "content of view.js");
  const auto head = get(path(""), own_host(), http::verb::head);
  EXPECT_EQ(head.result_int(), 200u);
  EXPECT_EQ(head[http::field::content_length], std::to_string(std::string("content of index.html").size()));
  const auto bare = get("/" + token_ + "?x", own_host());
  EXPECT_EQ(bare.result_int(), 308u);
  EXPECT_EQ(bare[http::field::location], path(""));
}

/// A picture may be larger than what a page may have waiting.
TEST_F(ServerTest, SendsAFileOfAnySize) {
  Json scene = test::small_scene();
  scene["receiver"]["resolution"] = {400, 400};  // Of 14 channels, of which some compress well.
  scene["light"]["photons"] = 2000;
  Socket socket = socket_with_picture(scene);
  write_json(socket, {{"type", "export"}, {"id", 2}, {"file", "exr"}});
  // Answers that come behind the file wait for it; some may come before.
  constexpr int looks = 20;
  for (int i = 0; i < looks; ++i) write_json(socket, {{"type", "look"}, {"id", 3}, {"x", 0.5}, {"y", 0.5}});
  std::map<std::string, int> answers;
  while (answers["file"] < 1 || answers["look"] < looks) {
    const Json json = read_json(socket);
    const std::string type = json.value("type", "");
    ++answers[type];
    if (type == "file") {
      EXPECT_GT(read_bytes_, settings_.max_waiting_bytes);
    }
    EXPECT_EQ(json.value("name", "scene.exr"), "scene.exr");
    ASSERT_NE(type, "error") << json;
  }
}

TEST_F(ServerTest, RefusesAWrongToken) {
  std::string near_token = token_;
  near_token.back() = near_token.back() == '0' ? '1' : '0';
  for (const std::string& token : {std::string("x"), near_token, token_ + "0", token_.substr(1)})
    EXPECT_EQ(get("/" + token + "/", own_host()).result_int(), 404u) << token;
  for (const char* target : {"/", "//", "*", "/index.html"})
    EXPECT_EQ(get(target, own_host()).result_int(), 404u) << target;
  EXPECT_THROW(open_socket("http://" + own_host(), "/" + near_token + "/socket"), boost::system::system_error);
}

/// Another site must reach the server neither by its own name nor by one that it makes to mean this machine.
TEST_F(ServerTest, RefusesForeignHostAndOrigin) {
  for (const std::string& host : {std::string("evil.example"), "evil.example:" + port_, std::string("127.0.0.1"),
                                  std::string("127.0.0.1:1"), own_host() + ".evil.example", std::string()})
    EXPECT_EQ(get(path(""), host).result_int(), 403u) << host;
  EXPECT_EQ(get(path(""), "LocalHost:" + port_).result_int(), 200u);  // Names have no case.
  for (const std::string& origin : {std::string("http://evil.example"), "https://" + own_host(), std::string("null"),
                                    "http://" + own_host() + ".evil.example", std::string()})
    EXPECT_THROW(open_socket(origin, path("socket")), boost::system::system_error) << origin;
  socket_with_picture();
}

TEST_F(ServerTest, SurvivesHostileBytes) {
  // The fuzzer `http` sends others.
  EXPECT_EQ(exchange("nonsense\r\n\r\n").substr(0, 12), "HTTP/1.1 400");
  exchange("GET / HTTP/1.1\r\nHost: " + std::string(100000, 'b') + "\r\n\r\n");
  Socket socket = open_socket();
  socket.binary(true);
  socket.write(asio::buffer(std::string("\xff\xfe\xfd")));
  socket.write(asio::buffer(std::string(Server::max_message_bytes + 1, ' ')));
  const auto read_on = [&] {
    while (true) read_json(socket);
  };
  EXPECT_THROW(read_on(), boost::system::system_error);
  socket_with_picture();
}

TEST_F(ServerTest, BoundsConnectionsAndPages) {
  {
    std::vector<tcp::socket> idle;
    for (int i = 0; i < 1000; ++i) idle.push_back(connect());
  }
  socket_with_picture();
  std::vector<Socket> sockets;
  const auto open_many = [&] {
    while (sockets.size() < Server::max_pages + 2) sockets.push_back(open_socket());
  };
  EXPECT_THROW(open_many(), boost::system::system_error);
  EXPECT_GE(sockets.size(), Server::max_pages - 1);
}

/// A page that asks and never reads.
TEST_F(ServerTest, DoesNotWaitForASlowReader) {
  Socket slow = open_socket();
  for (int id = 1; id <= 300; ++id) {
    Json scene = test::small_scene();
    scene["field"]["scale"] = 1 + 0.01 * id;
    write_json(slow, {{"type", "scene"}, {"id", id}, {"scene", scene}});
    write_json(slow, {{"type", "space"}, {"id", id}});
  }
  socket_with_picture();
}

}  // namespace
}  // namespace tensorray
