#include <algorithm>
#include <deque>
#include <memory>
#include <utility>

#include <boost/asio/post.hpp>
#include <boost/beast/websocket.hpp>

#include "tools/viewer/server/server_state.h"

namespace tensorray {
namespace {

namespace websocket = beast::websocket;

class PageSocket : public std::enable_shared_from_this<PageSocket> {
 public:
  PageSocket(std::shared_ptr<Server::State> state, beast::tcp_stream stream)
      : state_(std::move(state)), counted_(state_->sockets), socket_(std::move(stream)) {}

  ~PageSocket() {
    if (page_ != 0) state_->pages.close(page_);
  }

  void accept(const HttpRequest& request) {
    websocket::stream_base::timeout limits = websocket::stream_base::timeout::suggested(beast::role_type::server);
    limits.keep_alive_pings = true;  // A page that is gone is noticed.
    limits.idle_timeout = std::chrono::seconds(60);
    socket_.set_option(limits);
    socket_.read_message_max(Server::max_message_bytes);
    socket_.async_accept(request, [self = shared_from_this()](beast::error_code error) {
      if (error) return;
      self->page_ = self->state_->pages.open(self->sender());
      self->read();
    });
  }

 private:
  /// Moves messages of another thread to the server's, while there is a server and a page.
  Pages::Send sender() {
    return [socket = weak_from_this(), io = std::weak_ptr(state_->io)](PageMessage message) {
      if (const auto server = io.lock())
        asio::post(*server, [socket, message = std::move(message)]() mutable {
          if (const auto page = socket.lock()) page->send(std::move(message));
        });
    };
  }

  void read() {
    socket_.async_read(buffer_, [self = shared_from_this()](beast::error_code error, std::size_t) {
      if (error) return;
      self->state_->pages.receive(self->page_, beast::buffers_to_string(self->buffer_.data()));
      self->buffer_.consume(self->buffer_.size());
      self->read();
    });
  }

  /// Messages wait while a slow page reads. A picture that waits is replaced by a newer one.
  void send(PageMessage message) {
    const auto waiting = std::find_if(queue_.begin() + (writes_ ? 1 : 0), queue_.end(),
                                      [](const PageMessage& other) { return other.is_picture; });
    if (message.is_picture && waiting != queue_.end()) {
      waiting_bytes_ -= waiting->data.size();
      queue_.erase(waiting);
    }
    if (waits_for_too_much()) return beast::get_lowest_layer(socket_).close();
    waiting_bytes_ += message.data.size();
    queue_.push_back(std::move(message));
    if (!writes_) write();
  }

  /// One message, such as a large picture, may have any size, and others behind it do not make it too large.
  bool waits_for_too_much() const {
    std::size_t largest = 0;
    for (const PageMessage& message : queue_) largest = std::max(largest, message.data.size());
    return waiting_bytes_ - largest > state_->settings.max_waiting_bytes;
  }

  void write() {
    writes_ = true;
    socket_.binary(queue_.front().is_binary);
    socket_.async_write(asio::buffer(queue_.front().data),
                        [self = shared_from_this()](beast::error_code error, std::size_t) {
                          self->writes_ = false;
                          if (error) return;
                          self->waiting_bytes_ -= self->queue_.front().data.size();
                          self->queue_.pop_front();
                          if (!self->queue_.empty()) self->write();
                        });
  }

  std::shared_ptr<Server::State> state_;
  Counted counted_;
  websocket::stream<beast::tcp_stream> socket_;
  beast::flat_buffer buffer_;
  std::deque<PageMessage> queue_;  ///< The first is being written if `writes_`.
  std::size_t waiting_bytes_ = 0;
  bool writes_ = false;
  Pages::Id page_ = 0;
};

}  // namespace

void open_page_socket(const std::shared_ptr<Server::State>& state, beast::tcp_stream stream,
                      const HttpRequest& request) {
  std::make_shared<PageSocket>(state, std::move(stream))->accept(request);
}

}  // namespace tensorray
