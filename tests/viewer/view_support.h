#pragma once
/// A small scene in a folder of its own, a server of it, and messages of pages.

#include <condition_variable>
#include <cstring>
#include <mutex>
#include <optional>
#include <thread>

#include "base/files/temporary_folder.h"
#include "tests/files.h"
#include "tools/viewer/pages.h"
#include "tools/viewer/server/server.h"

namespace tensorray::test {

inline Json small_scene() {
  return {{"field", {{"generate", {{"kind", "point_load"}, {"resolution", 12}}}, {"scale", 4}}},
          {"light", {{"direction", {0, 0, -1}}, {"photons", 20000}, {"wavelengths", {{"count", 8}}}}},
          {"receiver", {{"resolution", {64, 48}}}},
          {"integrator", {{"type", "photon_distribution"}}}};
}

class ViewFolder {
 public:
  ViewFolder() { write_bytes(scene_file(), small_scene().dump()); }

  std::filesystem::path in_folder(const std::string& name) const { return folder_ / name; }
  std::filesystem::path scene_file() const { return in_folder("scene.json"); }
  ViewedScene viewed() const { return {scene_file(), {}, in_folder("scene.view.json")}; }

 private:
  TemporaryFolder folder_;
};

/// A server of the small scene, which runs in a thread.
class RunningView : public ViewFolder {
 public:
  explicit RunningView(ServerSettings settings) {
    for (const std::string name : {"index.html", "view.js", "view.css"})
      write_bytes(in_folder(name), "content of " + name);
    settings.page = in_folder("");
    pages_.emplace(viewed(), progress_);
    server_.emplace(settings, *pages_);
    const std::string url = server_->url(), before = "http://127.0.0.1:";
    port_ = url.substr(before.size(), url.find('/', before.size()) - before.size());
    thread_ = std::thread([this] { server_->run(progress_); });
  }
  ~RunningView() {
    progress_.cancelled = true;
    thread_.join();
  }

  Pages& pages() { return *pages_; }
  const std::string& port() const { return port_; }

 private:
  Progress progress_;
  std::optional<Pages> pages_;
  std::optional<Server> server_;
  std::string port_;
  std::thread thread_;
};

/// A received message; of a binary one, `json` is the header.
struct Received {
  Json json;
  std::string bytes;
};

inline Received received(const PageMessage& message) {
  if (!message.is_binary) return {Json::parse(message.data), ""};
  std::uint32_t size = 0;
  std::memcpy(&size, message.data.data(), sizeof size);
  return {Json::parse(message.data.substr(4, size)), message.data.substr(4 + size)};
}

class ViewTest : public ::testing::Test, protected ViewFolder {};

inline Json scene_message(int id, const Json& scene) { return {{"type", "scene"}, {"id", id}, {"scene", scene}}; }

/// What a page gets. It must not end before the Pages, whose thread sends to it.
class Mailbox {
 public:
  Pages::Send sender() {
    return [this](const PageMessage& message) {
      const std::lock_guard<std::mutex> lock(mutex_);
      messages_.push_back(received(message));
      arrived_.notify_all();
    };
  }

  /// The first message that has these members; it waits for it.
  Received wait(const Json& members) {
    const auto items = members.items();
    const auto has_them = [&](const Received& message) {
      return std::all_of(items.begin(), items.end(), [&](const auto& member) {
        return message.json.value(member.key(), Json()) == member.value();
      });
    };
    std::unique_lock<std::mutex> lock(mutex_);
    auto found = messages_.end();
    arrived_.wait(lock, [&] {
      found = std::find_if(messages_.begin(), messages_.end(), has_them);
      return found != messages_.end();
    });
    return *found;
  }

  Json hello() { return wait({{"type", "hello"}}).json; }
  Received wait(const std::string& type, int id) { return wait({{"type", type}, {"id", id}}); }
  Received final_picture(int id) { return wait({{"type", "picture"}, {"id", id}, {"final", true}}); }

  /// Opens the page whose messages come here, and for which the following functions send.
  void open(Pages& pages) {
    pages_ = &pages;
    page_ = pages.open(sender());
  }
  void close() { pages_->close(page_); }
  void send_text(const std::string& text) { pages_->receive(page_, text); }
  void send(const Json& message) { send_text(message.dump()); }

  // Each of these sends first, and waits for the answer: of a type, an error's text, a scene's picture.
  Received answer(const std::string& type, const Json& message) {
    send(message);
    return wait(type, message.at("id"));
  }
  std::string refusal_of(const Json& message) { return answer("error", message).json.at("message"); }
  Received picture_of_scene(int id, const Json& scene) {
    send(scene_message(id, scene));
    return final_picture(id);
  }

  std::vector<Received> all() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return messages_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::vector<Received> messages_;
  Pages* pages_ = nullptr;
  Pages::Id page_ = 0;
};

}  // namespace tensorray::test
