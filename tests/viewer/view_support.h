#pragma once
/// A small scene in a folder of its own, and messages of pages.

#include <condition_variable>
#include <cstring>
#include <fstream>
#include <mutex>

#include "base/files/temporary_folder.h"
#include "tests/names.h"
#include "tools/viewer/pages.h"

namespace tensorray::test {

inline Json small_scene() {
  return {{"field", {{"generate", {{"kind", "point_load"}, {"resolution", 12}}}, {"scale", 4}}},
          {"light", {{"direction", {0, 0, -1}}, {"photons", 20000}, {"wavelengths", {{"count", 8}}}}},
          {"receiver", {{"resolution", {64, 48}}}},
          {"integrator", {{"type", "photon_distribution"}}}};
}

class ViewTest : public ::testing::Test {
 protected:
  ViewTest() { std::ofstream(scene_file()) << small_scene(); }

  std::filesystem::path in_folder(const std::string& name) const { return folder_ / name; }
  std::filesystem::path scene_file() const { return in_folder("scene.json"); }
  ViewedScene viewed() const { return {scene_file(), {}, in_folder("scene.view.json")}; }

 private:
  TemporaryFolder folder_;
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

class Mailbox {
 public:
  Pages::Send sender() {
    return [this](const PageMessage& message) {
      const std::lock_guard<std::mutex> lock(mutex_);
      messages_.push_back(received(message));
      arrived_.notify_all();
    };
  }

  /// The first message that `wanted` accepts; it waits for it.
  template <class Wanted>
  Received wait(const Wanted& wanted) {
    std::unique_lock<std::mutex> lock(mutex_);
    Received result;
    arrived_.wait(lock, [&] {
      for (const Received& message : messages_)
        if (wanted(message.json)) {
          result = message;
          return true;
        }
      return false;
    });
    return result;
  }

  Received wait(const std::string& type, int id) {
    return wait([&](const Json& json) { return json.value("type", "") == type && json.value("id", Json()) == id; });
  }

  Received final_picture(int id) {
    return wait([&](const Json& json) {
      return json.value("type", "") == "picture" && json.value("id", Json()) == id && json.value("final", false);
    });
  }

  std::vector<Received> all() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return messages_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::vector<Received> messages_;
};

}  // namespace tensorray::test
