#include <algorithm>
#include <condition_variable>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "scenes/pipeline/read_scene.h"
#include "tools/benchmark/measures/parts.h"
#include "tools/benchmark/support/repeat.h"
#include "tools/viewer/pages.h"

namespace tensorray::benchmark {
namespace {

struct ViewJob {
  std::string name, file;
  int resolution = 512;
};

/// A page that waits for the answers to its scenes.
class TimedPage {
 public:
  explicit TimedPage(Pages& pages) : pages_(pages) {
    id_ = pages_.open([this](const PageMessage& message) { receive(message); });
  }
  ~TimedPage() { pages_.close(id_); }

  /// Sends a scene and waits for a picture of it. @param final  Whether for the finished one.
  /// @return its header, with `latency`, the seconds since the scene was sent.
  Json picture_of(const Json& scene, bool final) {
    const int message = ++last_;
    const double start = wall_seconds();
    pages_.receive(id_, Json{{"type", "scene"}, {"id", message}, {"scene", scene}}.dump());
    std::unique_lock<std::mutex> lock(mutex_);
    arrived_.wait(lock, [&] { return header_.value("id", 0) == message && (!final || header_.value("final", false)); });
    Json header = header_;
    header["latency"] = arrival_ - start;
    return header;
  }

 private:
  void receive(const PageMessage& message) {
    if (!message.is_picture) return;
    std::uint32_t size = 0;
    std::memcpy(&size, message.data.data(), sizeof size);
    const std::lock_guard<std::mutex> lock(mutex_);
    arrival_ = wall_seconds();
    header_ = Json::parse(message.data.substr(sizeof size, size));
    arrived_.notify_all();
  }

  Pages& pages_;
  Pages::Id id_ = 0;
  int last_ = 0;
  std::mutex mutex_;
  std::condition_variable arrived_;
  Json header_ = Json::object();
  double arrival_ = 0;
};

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Drags the scale: each change is sent when the first picture of the one before has come.
Json drag(TimedPage& page, Json scene, double scale, int steps) {
  std::vector<double> latencies;
  const double start = wall_seconds();
  for (int i = 0; i < steps; ++i) {
    scene["field"]["scale"] = scale * (0.5 + (i + 1.0) / steps);
    latencies.push_back(page.picture_of(scene, false).at("latency"));
  }
  return {{"first_picture", median(latencies)}, {"pictures_per_second", steps / (wall_seconds() - start)}};
}

Json measure_job(const Options& options, const ViewJob& job) {
  options.announce("view: " + job.name);
  const int side = options.quick ? 64 : job.resolution, steps = options.quick ? 3 : 20, repeats = options.quick ? 1 : 3;
  const ViewedScene viewed{std::filesystem::path(TENSORRAY_SCENES) / job.file,
                           {fmt::format("receiver.resolution=[{0},{0}]", side)},
                           std::filesystem::temp_directory_path() / "tensorray_bench.view.json"};
  Progress progress;
  Pages pages(viewed, progress);
  TimedPage page(pages);
  Json scene = scene_json(viewed.file, viewed.overrides);
  const double scale = page.picture_of(scene, true).at("/chosen/field/scale"_json_pointer);
  Json result{{"scene", job.name}, {"side", side}};
  result.update(drag(page, scene, scale, steps));
  std::vector<double> finals;
  Json last;
  for (int i = 0; i < repeats; ++i) {
    scene["field"]["scale"] = scale * (1 + 0.01 * (i + 1));
    last = page.picture_of(scene, true);
    finals.push_back(last.at("latency"));
  }
  result["final_picture"] = median(finals);
  result["phases"] = last.at("phases");
  return result;
}

}  // namespace

Json measure_view(const Options& options) {
  std::vector<ViewJob> jobs{{"point load, light on the plate", "point_load_photons.json", 512}};
  if (!options.quick) {
    jobs.push_back({"point load, lens", "point_load_lens.json", 512});
    jobs.push_back({"hemisphere flow, light on the plate", "hemisphere_photons_side.json", 512});
  }
  Json results = Json::array();
  for (const ViewJob& job : jobs) results.push_back(measure_job(options, job));
  return results;
}

}  // namespace tensorray::benchmark
