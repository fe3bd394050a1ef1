/// Seconds from a page's message with a changed scale, or a turned analyser, to a picture's bytes, without the network:
/// the first, coarse picture and the finished one, with its phases.

#include <condition_variable>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <string>

#include <benchmark/benchmark.h>

#include "integrators/methods/read_scene.h"
#include "tools/benchmark/questions.h"
#include "tools/viewer/pages.h"

namespace tensorray::bench {
namespace {

/// A page that waits for the answers to its scenes.
class TimedPage {
 public:
  explicit TimedPage(Pages& pages) : pages_(pages) {
    id_ = pages_.open([this](const PageMessage& message) { receive(message); });
  }
  ~TimedPage() { pages_.close(id_); }

  /// Sends a scene, and waits for its first or its finished picture. @return the picture's header.
  Json picture_of(const Json& scene, bool finished) {
    const int message = ++last_;
    pages_.receive(id_, Json{{"type", "scene"}, {"id", message}, {"scene", scene}}.dump());
    std::unique_lock<std::mutex> lock(mutex_);
    arrived_.wait(lock,
                  [&] { return header_.value("id", 0) == message && (!finished || header_.value("final", false)); });
    return header_;
  }

 private:
  void receive(const PageMessage& message) {
    if (!message.is_picture) return;
    std::uint32_t size = 0;
    std::memcpy(&size, message.data.data(), sizeof size);
    const std::lock_guard<std::mutex> lock(mutex_);
    header_ = Json::parse(message.data.substr(sizeof size, size));
    arrived_.notify_all();
  }

  Pages& pages_;
  Pages::Id id_ = 0;
  int last_ = 0;
  std::mutex mutex_;
  std::condition_variable arrived_;
  Json header_ = Json::object();
};

void change(benchmark::State& state, const std::string& file, bool finished) {
  const ViewedScene viewed{std::filesystem::path(TENSORRAY_SCENES) / file,
                           {"receiver.resolution=[512,512]"},
                           std::filesystem::temp_directory_path() / "tensorray_bench.view.json"};
  Progress progress;
  Pages pages(viewed, progress);
  TimedPage page(pages);
  Json scene = scene_json(viewed.file, viewed.overrides);
  const Json chosen = page.picture_of(scene, true).at("chosen");
  const bool turns = scene["integrator"]["type"] == "polariscope";
  int change = 0;
  for (auto _ : state) {
    if (turns)
      scene["integrator"]["analyzer"] = ++change;
    else
      scene["field"]["scale"] = chosen.at("/field/scale"_json_pointer).get<double>() * (1 + 0.01 * ++change);
    const Json header = page.picture_of(scene, finished);
    for (const auto& [phase, seconds] : header.at("phases").items()) state.counters[phase] = seconds.get<double>();
  }
}

}  // namespace

void add_view() {
  for (const char* const name :
       {"point_load_photons", "point_load_lens", "hemisphere_photons_side", "point_load_polariscope"})
    for (const bool finished : {false, true}) {
      const auto run = [=](benchmark::State& state) { change(state, std::string(name) + ".json", finished); };
      benchmark::RegisterBenchmark(
          (std::string("view/") + name + (finished ? "/finished_picture" : "/first_picture")).c_str(), run)
          ->Iterations(finished && name != std::string("point_load_polariscope") ? 3 : 20)
          ->UseRealTime()
          ->Unit(benchmark::kSecond);
    }
}

}  // namespace tensorray::bench
