#include <memory>
#include <optional>
#include <utility>

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "base/process/process_limits.h"
#include "base/process/seconds.h"
#include "integrators/methods/read_scene.h"
#include "python/module/arrays.h"
#include "python/module/scene_request.h"
#include "python/module/work.h"
#include "scenes/jobs/work_file.h"
#include "scenes/outputs/picture_outputs.h"
#include "scenes/outputs/write_outputs.h"
#include "scenes/scene/render.h"

namespace tensorray {
namespace {

/// A scene and its render. Arrays that Python gets are its memory. Immutable.
struct Rendered {
  Scene scene;
  Render render;
  Image display;
  std::string statistics;    ///< JSON.
  std::optional<int> frame;  ///< Of a scene with keyframes.
};

OutputFiles open_requested(const RequestedScene& requested) {
  OutputDescription written = requested.description.output;
  written.files = requested.files;
  return open_outputs(written);
}

/// What the scene's shards belong to. A field that Python has is no file, whatever its keys say.
Json origin_of_request(const SceneRequest& request, Scene& scene) {
  if (!request.field) return origin_of(scene);
  std::filesystem::path& file = scene.description.field.file;
  const std::filesystem::path name = std::exchange(file, {});
  Json origin = origin_of(scene);
  file = name;
  return origin;
}

/// The picture of a scene whose shards, with this origin, are made.
Render merge(const Scene& scene, const Json& origin, const std::vector<std::string>& shards, const Progress& progress) {
  WorkFile work = read_shards(shards);
  const std::string other = difference(work.origin, origin);
  if (!other.empty()) throw std::runtime_error(printable("the scene has changed since its shards were made: " + other));
  RenderJob job(work.part, std::move(work.results));
  Render result = render(scene, progress, &job);
  if (job.stopping) throw Cancelled();
  return result;
}

/// What `tensorray render` does, with the scene of a request. @param shards  All of its shards, if there are such.
std::shared_ptr<Rendered> render_request(const SceneRequest& request, const std::vector<std::string>& shards,
                                         int threads, const Progress& progress) {
  const RequestedScene requested = read_request(request);
  OutputFiles files = open_requested(requested);
  Scene scene = load_request(request, requested, progress);
  Render result =
      shards.empty() ? render(scene, progress) : merge(scene, origin_of_request(request, scene), shards, progress);
  const auto start = Clock::now();
  write_outputs(result, scene, files);
  Image display = display_image(scene, result, true);
  const int used = threads > 0 ? threads : static_cast<int>(usable_processors());
  std::string statistics = statistics_json(scene, result.statistics, seconds_since(start), used);
  auto rendered = std::make_shared<Rendered>(
      Rendered{std::move(scene), std::move(result), std::move(display), std::move(statistics), request.frame});
  commit_outputs(std::move(files));
  return rendered;
}

std::shared_ptr<Rendered> render_for_python(const SceneRequest& request, const std::vector<std::string>& shards,
                                            int threads, const py::object& report) {
  std::shared_ptr<Rendered> rendered;
  run(report, threads,
      [&](const Progress& progress) { rendered = render_request(request, shards, threads, progress); });
  return rendered;
}

/// What `tensorray render --shard` does.
void render_shard(const SceneRequest& request, const WorkPart& part, const std::filesystem::path& file,
                  const Progress& progress) {
  const RequestedScene requested = read_request(request);
  Scene scene = load_request(request, requested, progress);
  const Json origin = origin_of_request(request, scene);  // Now, while files are those that were loaded.
  RenderJob job(part);
  job.is_shard = true;
  render(scene, progress, &job);
  if (job.stopping) throw Cancelled();
  write_work(file, {origin, std::filesystem::absolute(scene.description.path), part, true, job.results()});
}

/// Writes further files of a render: of kinds that it has made.
void write_more(const Rendered& rendered, const std::vector<std::filesystem::path>& outputs) {
  const SceneDescription& made = rendered.scene.description;
  const SceneDescription description =
      read_scene_json(parse_value(made.text), made.path, {{}, outputs, rendered.frame});
  for (const auto& [key, path] : description.output.files)
    if (!made.output.wants(key))
      throw std::invalid_argument(printable(path.string()) + ": the render has not kept its `" + key +
                                  "`; render with keep=[\"" + key + "\"]");
  run(py::none(), 0, [&](const Progress&) {
    OutputFiles files = open_outputs(description.output);
    write_outputs(rendered.render, rendered.scene, files);
    commit_outputs(std::move(files));
  });
}

py::array pixels(const Image& image, const py::object& owner) {
  const auto channels = static_cast<py::ssize_t>(image.channels.size());
  return view(image.pixels.data(), {image.height, image.width, channels}, owner);
}

py::object spectral(const py::object& self) {
  const auto& render = self.cast<const Rendered&>().render;
  if (!render.spectral) return py::none();
  return py::make_tuple(pixels(render.spectral->image, self), render.spectral->image.channels);
}

/// Photons as rows of 11 floats, which Python names.
py::array photons(const py::object& self) {
  static_assert(sizeof(PlatePhoton) == 11 * sizeof(float), "a photon is 11 floats");
  const std::vector<PlatePhoton>& photons = self.cast<const Rendered&>().render.photons;
  return view(reinterpret_cast<const float*>(photons.data()), {static_cast<py::ssize_t>(photons.size()), 11}, self);
}

/// A path as a dictionary of arrays, one row a point.
py::dict path_arrays(const Path& path, const py::object& self) {
  const auto count = static_cast<py::ssize_t>(path.points.size());
  constexpr py::ssize_t stride = sizeof(PathPoint), number = sizeof(double);
  const PathPoint none;
  const PathPoint& first = path.points.empty() ? none : path.points.front();
  py::dict arrays;
  arrays["position"] = view(first.position.data(), {count, 3}, self, {stride, number});
  arrays["direction"] = view(first.direction.data(), {count, 3}, self, {stride, number});
  arrays["length"] = view(&first.length, {count}, self, {stride});
  arrays["tensor"] = view(first.tensor.data(), {count, 3, 3}, self, {stride, number, 3 * number});
  arrays["change"] = view(first.change.data(), {count, 3}, self, {stride, number});
  arrays["in_field"] = view(&first.in_field, {count}, self, {stride});
  arrays["flexibility"] = path.flexibility;
  arrays["wavelength"] = path.wavelength;
  arrays["end"] = to_string(path.end);
  return arrays;
}

py::list paths(const py::object& self) {
  py::list list;
  for (const Path& path : self.cast<const Rendered&>().render.paths) list.append(path_arrays(path, self));
  return list;
}

}  // namespace

void add_renders(py::module_& module) {
  py::class_<Rendered, std::shared_ptr<Rendered>>(module, "Rendered")
      .def("linear", [](const py::object& self) { return pixels(self.cast<const Rendered&>().render.linear, self); })
      .def("channels", [](const Rendered& self) { return self.render.linear.channels; })
      .def("display", [](const py::object& self) { return pixels(self.cast<const Rendered&>().display, self); })
      .def("spectral", &spectral)
      .def("photons", &photons)
      .def("paths", &paths)
      .def("statistics", [](const Rendered& self) { return self.statistics; })
      .def("scene", [](const Rendered& self) { return self.scene.description.text; })
      .def("scale", [](const Rendered& self) { return self.scene.scale.scale; })
      .def("notes", [](const Rendered& self) { return self.scene.notes; })
      .def("warnings", [](const Rendered& self) { return self.render.warnings; })
      .def("write", &write_more);
  module.def("render", &render_for_python);
  // Finds what would be an error of each shard, or after all of them, before the first one begins.
  module.def("check_shards", [](const SceneRequest& request) { open_requested(read_request(request)); });
  module.def("render_shard", [](const SceneRequest& request, std::size_t index, std::size_t count,
                                const std::filesystem::path& file, int threads, const py::object& report) {
    run(report, threads, [&](const Progress& progress) { render_shard(request, {index, count}, file, progress); });
  });
  module.def("schema", [] { return scene_schema(); });
}

}  // namespace tensorray
