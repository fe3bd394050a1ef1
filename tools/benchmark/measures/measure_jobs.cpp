#include <algorithm>
#include <fstream>

#include <fmt/format.h>
#include <unistd.h>

#include "base/files/temporary_folder.h"
#include "tools/benchmark/measures/parts.h"
#include "tools/benchmark/support/child.h"
#include "tools/benchmark/support/machine.h"

namespace tensorray::benchmark {
namespace {

struct RenderJob {
  std::string name;
  int resolution = 64;  ///< Voxels along the longest axis of the field.
  Json scene;           ///< The scene without the tensors of its field.
  std::vector<std::string> outputs{"picture.png", "picture.exr"};
};

/// @param side  Edge of the square picture, pixels.
RenderJob photon_job(int resolution, std::uint64_t photons, int side) {
  return {fmt::format("photon distribution, {} positions, {}²", photons, side),
          resolution,
          {{"light", {{"photons", photons}, {"wavelengths", {{"count", 32}}}}},
           {"receiver", {{"resolution", {side, side}}}},
           {"integrator", {{"type", "photon_distribution"}, {"density", {{"kind", "gaussian"}}}}}}};
}

RenderJob lens_job(int resolution, int side) {
  return {fmt::format("lens (gather), {}²", side),
          resolution,
          {{"light", {{"wavelengths", {{"count", 32}}}}},
           {"receiver", {{"resolution", {side, side}}}},
           {"integrator", {{"type", "lens"}, {"mode", "gather"}, {"image", "checkerboard"}}}}};
}

RenderJob path_job(int resolution, int seeds, int side) {
  return {fmt::format("path tracing, {} tubes, {}²", seeds, side),
          resolution,
          {{"integrator", {{"type", "path_tracing"}, {"seeds", {{"kind", "grid"}, {"count", seeds}}}}},
           {"camera", {{"resolution", {side, side}}}}}};
}

/// The bent rays alone, as a file.
RenderJob track_job(int resolution, int seeds) {
  return {fmt::format("{} paths, .tck", seeds),
          resolution,
          {{"integrator", {{"type", "path_tracing"}, {"seeds", {{"kind", "grid"}, {"count", seeds}}}}}},
          {"paths.tck"}};
}

/// Larger fields get fewer rays, so that each job takes a few seconds apart from loading its field.
std::vector<RenderJob> jobs(bool quick) {
  if (quick) return {photon_job(16, 200, 32), lens_job(16, 32), path_job(16, 9, 32), track_job(16, 9)};
  std::vector<RenderJob> result;
  for (const int resolution : {64, 128, 256, 512}) {
    result.push_back(photon_job(resolution, 4194304u / static_cast<unsigned>(resolution), 1024));
    result.push_back(lens_job(resolution, std::min(256, 32768 / resolution)));
    result.push_back(path_job(resolution, 1000, 256));
    result.push_back(track_job(resolution, 200000));
  }
  return result;
}

/// Runs the job. @return its statistics (`tensorray render --stats`).
Json run_job(const TemporaryFolder& folder, const RenderJob& job, int threads, const std::string& program = "tensorray",
             const std::vector<std::string>& options = {}) {
  Json scene = job.scene;
  scene["field"]["generate"] = {{"kind", "point_load"}, {"resolution", job.resolution}};
  scene["field"]["eigenvalues"] = "raw";
  scene["field"]["interpolation"] = "linear";  // As OpenVDB's BoxSampler, which jobs are compared with.
  const auto scene_path = folder / "scene.json", statistics_path = folder / "statistics.json";
  std::ofstream(scene_path) << scene;
  std::vector<std::string> arguments{"render",    scene_path.string(),     "--stats", statistics_path.string(),
                                     "--threads", std::to_string(threads), "--quiet"};
  for (const std::string& output : job.outputs) {
    arguments.push_back("-o");
    arguments.push_back((folder / output).string());
  }
  arguments.insert(arguments.end(), options.begin(), options.end());
  run_program(sibling(program), arguments);
  std::ifstream file(statistics_path);
  return Json::parse(file);
}

Json describe(const RenderJob& job, int threads, const Json& statistics) {
  return {{"name", job.name},
          {"resolution", job.resolution},
          {"threads", threads},
          {"rays", statistics.at("photons").at("emitted")},
          {"tensor_samples", statistics.at("tensor_samples")},
          {"seconds", statistics.at("seconds")},
          {"peak_memory_bytes", statistics.at("peak_memory_bytes")}};
}

/// Whether the memory suffices, roughly: at its peak a job holds the field as a grid and as bricks.
bool fits_in_memory(const RenderJob& job) {
  constexpr double bytes_per_voxel = 110;
  const double needed = bytes_per_voxel * job.resolution * job.resolution * job.resolution;
  const double there = static_cast<double>(sysconf(_SC_AVPHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
  return needed < there;
}

/// Runs a job with one thread and with all threads, and appends the results.
void add_job(const Options& options, const TemporaryFolder& folder, const RenderJob& job, Json& results) {
  if (!fits_in_memory(job)) {
    results.push_back({{"name", job.name}, {"resolution", job.resolution}, {"skipped", "not enough memory"}});
    return;
  }
  double alone = 0;
  for (const int threads : {1, processor().threads}) {
    options.announce(fmt::format("jobs: {}, {}³, threads: {}", job.name, job.resolution, threads));
    Json result = describe(job, threads, run_job(folder, job, threads));
    const double seconds = result.at("seconds").at("total");
    if (threads == 1)
      alone = seconds;
    else
      result["speed_up"] = alone / seconds;
    results.push_back(std::move(result));
  }
}

/// How many times faster a position is traced than with OpenVDB's sampler. That sampler gets fewer positions, because
/// it is slow.
Json compare_box_sampler(const Options& options, const TemporaryFolder& folder) {
  const int resolution = options.quick ? 16 : 128, side = options.quick ? 32 : 1024, threads = processor().threads;
  RenderJob few = photon_job(resolution, options.quick ? 100 : 2048, side),
            many = photon_job(resolution, options.quick ? 100 : 262144, side);
  few.scene["field"]["scale"] = many.scene["field"]["scale"] = 5;  // The automatic scale needs derivatives of rays.
  options.announce("jobs: OpenVDB's BoxSampler in the tracer's place");
  const Json slow = run_job(folder, few, threads, "tensorray_box_sampler"), fast = run_job(folder, many, threads);
  const auto seconds_per_position = [](const Json& job) {
    return job.at("seconds").at("trace").get<double>() / job.at("positions").get<double>();
  };
  return {{"resolution", resolution},
          {"threads", threads},
          {"positions", {slow.at("positions"), fast.at("positions")}},
          {"samples_per_position",
           {slow.at("tensor_samples").get<double>() / slow.at("positions").get<double>(),
            fast.at("tensor_samples").get<double>() / fast.at("positions").get<double>()}},
          {"seconds_per_position", {seconds_per_position(slow), seconds_per_position(fast)}},
          {"ratio", seconds_per_position(slow) / seconds_per_position(fast)}};
}

}  // namespace

Json measure_jobs(const Options& options) {
  const TemporaryFolder folder;
  Json results = Json::array();
  for (const RenderJob& job : jobs(options.quick)) add_job(options, folder, job, results);
  if (options.million) add_job(options, folder, photon_job(128, options.quick ? 1000 : 1u << 20, 1024), results);
  return {{"renders", results}, {"box_sampler", compare_box_sampler(options, folder)}};
}

}  // namespace tensorray::benchmark
