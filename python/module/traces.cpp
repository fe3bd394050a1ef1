#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <tbb/parallel_for.h>

#include "base/errors.h"
#include "python/module/arrays.h"
#include "python/module/scene_request.h"
#include "python/module/work.h"
#include "renderer/meshes/mesh.h"
#include "scenes/scene/scene.h"
#include "tracing/flow/flow_map.h"
#include "tracing/trace/trace.h"
#include "volumes/making/smoothing.h"

namespace tensorray {
namespace {

/// What `trace` needs beside the field; Python makes it.
struct TraceRequest {
  Doubles positions, directions, flexibilities;  ///< (n, 3), (n, 3) unit, (n).
  std::optional<Doubles> along, turning;         ///< (n, 3, 2): derivatives of the starts.
  std::optional<Plate> plate;
  std::string eigenvalues, interpolation, border, bounds;
  double smooth;  ///< Voxels.
  std::string method;
  double scale, step;
  int max_steps;
  double max_length;
  bool paths;
};

/// Some of the rays, which one thread traces.
struct TracedBatch {
  RayBatch rays;
  std::vector<std::vector<Eigen::Vector3d>> ways;  ///< Of each ray; or empty.
};

Eigen::Matrix<double, 3, 2> columns(const double* numbers) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 2, Eigen::RowMajor>>(numbers);
}

void check(const TraceRequest& request) {
  const py::ssize_t rays = request.flexibilities.size();
  require(request.positions.size() == 3 * rays && request.directions.size() == 3 * rays,
          "trace: positions and directions must have the shape (n, 3), and s one number a ray");
  for (const auto& derivatives : {request.along, request.turning})
    require(!derivatives || derivatives->size() == 6 * rays, "trace: derivatives must have the shape (n, 3, 2)");
  for (py::ssize_t i = 0; i < rays; ++i) {
    const Eigen::Vector3d P(request.positions.data() + 3 * i), V(request.directions.data() + 3 * i);
    require(P.allFinite() && V.allFinite() && std::isfinite(request.flexibilities.data()[i]),
            "trace: positions, directions and s must be finite");
    require(std::abs(V.norm() - 1) < 1e-6, "trace: directions must not be zero");
  }
  require(request.smooth >= 0 && request.smooth <= max_smoothing, "trace: smooth must be 0 to 20 voxels");
}

std::vector<TracedBatch> batches_of(const TraceRequest& request) {
  const py::ssize_t size = request.paths ? 64 : 512;  // Ctrl-C waits for one, and rays with ways may be long.
  std::vector<TracedBatch> batches;
  for (py::ssize_t i = 0; i < request.flexibilities.size(); ++i) {
    if (i % size == 0) batches.emplace_back();
    RayBatch& rays = batches.back().rays;
    rays.add(Eigen::Vector3d(request.positions.data() + 3 * i), Eigen::Vector3d(request.directions.data() + 3 * i),
             request.flexibilities.data()[i]);
    if (!request.along && !request.turning) continue;
    RayDifferential differential;
    if (request.along) differential.position = columns(request.along->data() + 6 * i);
    if (request.turning) differential.direction = columns(request.turning->data() + 6 * i);
    rays.differentials.push_back(differential);
  }
  return batches;
}

/// The positions of a ray's points.
std::vector<Eigen::Vector3d> way(const TensorField& field, const RayRecord& record) {
  std::vector<Eigen::Vector3d> positions;
  positions.reserve(record.size());
  for (std::size_t i = 0; i < record.size(); ++i) positions.push_back(path_point(field, record, i).position);
  return positions;
}

/// Follows all rays, on all threads.
void trace_all(const TensorField& field, const Geometry& geometry, const BendingSettings& bending, bool with_ways,
               std::vector<TracedBatch>& batches, const Progress& progress) {
  tbb::parallel_for(std::size_t{0}, batches.size(), [&](std::size_t i) {
    if (progress.cancelled) throw Cancelled();
    std::vector<RayRecord> records;
    trace(field, geometry, bending, batches[i].rays, with_ways ? &records : nullptr);
    for (const RayRecord& record : records) batches[i].ways.push_back(way(field, record));
  });
}

/// The values of a member of all batches.
template <class T>
std::vector<T> joined_values(const std::vector<TracedBatch>& batches, std::vector<T> RayBatch::*member) {
  std::vector<T> all;
  for (const TracedBatch& batch : batches)
    all.insert(all.end(), (batch.rays.*member).begin(), (batch.rays.*member).end());
  return all;
}

py::array ends_array(std::vector<RayEnd> ends, const Shape& shape) {
  std::vector<std::uint8_t> numbers(ends.size());
  std::transform(ends.begin(), ends.end(), numbers.begin(), [](RayEnd end) { return static_cast<std::uint8_t>(end); });
  return taken(std::move(numbers), shape);
}

py::dict arrays_of(std::vector<TracedBatch> batches, py::ssize_t count) {
  py::dict arrays;
  const std::vector<RayDifferential> differentials = joined_values(batches, &RayBatch::differentials);
  if (!differentials.empty()) {
    std::vector<Eigen::Matrix<double, 3, 2>> positions, directions;
    for (const RayDifferential& differential : differentials) {
      positions.push_back(differential.position);
      directions.push_back(differential.direction);
    }
    arrays["position_jacobians"] = taken_matrices(std::move(positions), {count, 2, 3}).attr("swapaxes")(1, 2);
    arrays["direction_jacobians"] = taken_matrices(std::move(directions), {count, 2, 3}).attr("swapaxes")(1, 2);
  }
  py::list ways;
  for (TracedBatch& batch : batches)
    for (std::vector<Eigen::Vector3d>& way : batch.ways) {
      const auto points = static_cast<py::ssize_t>(way.size());
      ways.append(taken_matrices(std::move(way), {points, 3}));
    }
  if (!ways.empty()) arrays["ways"] = ways;
  arrays["positions"] = taken_matrices(joined_values(batches, &RayBatch::position), {count, 3});
  arrays["directions"] = taken_matrices(joined_values(batches, &RayBatch::direction), {count, 3});
  arrays["lengths"] = taken(joined_values(batches, &RayBatch::length), {count});
  arrays["steps"] = taken(joined_values(batches, &RayBatch::steps), {count});
  arrays["ends"] = ends_array(joined_values(batches, &RayBatch::end), {count});
  return arrays;
}

py::dict trace_for_python(const Field& field, const TraceRequest& request, int threads, const py::object& report) {
  check(request);
  std::vector<TracedBatch> batches = batches_of(request);
  BendingSettings bending;
  bending.method = value_of<BendingMethod>("method", request.method);
  bending.scale = request.scale;
  bending.step = request.step;
  bending.max_steps = request.max_steps;
  bending.max_length = request.max_length;
  const auto border = value_of<BorderChoice>("border", request.border);
  FieldChoices choices;
  choices.smoothing = request.smooth;
  choices.eigenvalues = value_of<Eigenvalues>("eigenvalues", request.eigenvalues);
  choices.interpolant = {value_of<Interpolation>("interpolation", request.interpolation),
                         border == BorderChoice::extend ? Border::extend : Border::fade};
  choices.keeps_surface = value_of<BoundsChoice>("bounds", request.bounds) == BoundsChoice::automatic;
  choices.at_surface = border == BorderChoice::fade ? Border::fade : Border::extend;
  std::vector<std::string> notes;
  std::string eigenvalues;
  run(report, threads, [&](const Progress& progress) {
    progress.update("loading", 0, 1);
    const LoadedField loaded = field.loaded(choices);
    const TensorField& bricks = loaded.field;
    notes = loaded.notes;
    eigenvalues = choice_name(loaded.eigenvalues.chosen);
    Surfaces surfaces;
    surfaces.bounds = box_mesh(bricks.index_bounds(), bricks.to_world());
    if (!bricks.surface().triangles.empty()) surfaces.cut = closed_surface(bricks.surface(), field.source());
    surfaces.plate = request.plate;
    progress.update("tracing", 0, 1);
    trace_all(bricks, Geometry(std::move(surfaces)), bending, request.paths, batches, progress);
  });
  py::dict arrays = arrays_of(std::move(batches), request.flexibilities.size());
  arrays["eigenvalues"] = eigenvalues;
  arrays["notes"] = notes;
  return arrays;
}

Plate plate_of(const Doubles& center, const Doubles& normal, const Doubles& up, const Doubles& size) {
  Plate plate;
  plate.center = vector3(center, "center");
  const Eigen::Vector3d across = vector3(normal, "normal").normalized();
  const Eigen::Vector3d upper = vector3(up, "up");
  plate.up = upright(across, upper);
  plate.right = plate.up.cross(across);
  if (size.size() != 1 && size.size() != 2) throw std::invalid_argument("size: give one number, or two");
  plate.size = Eigen::Vector2d(size.data()[0], size.data()[size.size() - 1]);
  require(plate.center.allFinite() && plate.right.allFinite() && upper.allFinite() && plate.size.allFinite() &&
              plate.size.minCoeff() > 0,
          "plate: center, normal, up and size must be finite, normal not zero, and size greater than 0");
  return plate;
}

void put_plate(py::dict& arrays, const Plate& plate) {
  const auto three = [](const Eigen::Vector3d& v) { return py::array(py::dtype::of<double>(), Shape{3}, v.data()); };
  arrays["center"] = three(plate.center);
  arrays["right"] = three(plate.right);
  arrays["up"] = three(plate.up);
  arrays["size"] = py::make_tuple(plate.size.x(), plate.size.y());
  arrays["resolution"] = py::make_tuple(plate.resolution.x(), plate.resolution.y());
}

/// World positions of starts, which are in the beam's frame. @param back  From the program's axes to the scene's.
std::vector<Eigen::Vector3d> world_starts(const FlowMap& map, const Beam& beam, const Eigen::Matrix3d& back) {
  std::vector<Eigen::Vector3d> starts;
  for (const Eigen::Vector2d& start : map.starts)
    starts.push_back(back * (beam.center + start.x() * beam.right + start.y() * beam.up));
  return starts;
}

py::dict arrays_of(FlowMap map, const Scene& scene, std::vector<double> flexibilities) {
  const auto starts = static_cast<py::ssize_t>(map.starts.size()),
             wavelengths = static_cast<py::ssize_t>(map.wavelengths);
  const auto triangles = static_cast<py::ssize_t>(map.triangles.size());
  std::vector<std::uint32_t> corners;
  std::vector<double> areas;
  for (const FlowTriangle& triangle : map.triangles) {
    corners.insert(corners.end(), triangle.corners.begin(), triangle.corners.end());
    areas.push_back(triangle.area);
  }
  py::dict arrays;
  const Eigen::Matrix3d back = scene.description.turn().transpose();
  Plate plate = *scene.geometry.surfaces().plate;
  for (Eigen::Vector3d* vector : {&plate.center, &plate.right, &plate.up}) *vector = (back * *vector).eval();
  put_plate(arrays, plate);
  arrays["starts"] = taken_matrices(world_starts(map, scene.beam, back), {starts, 3});
  arrays["landings"] = taken_matrices(std::move(map.landings), {starts, wavelengths, 2});
  arrays["ends"] = ends_array(std::move(map.ends), {starts, wavelengths});
  arrays["triangles"] = taken(std::move(corners), {triangles, 3});
  arrays["areas"] = taken(std::move(areas), {triangles});
  arrays["flexibilities"] = taken(std::move(flexibilities), {wavelengths});
  return arrays;
}

/// The flow map of a scene's light. @param flexibilities  Empty: those of the scene's light, between its two ends.
py::dict landings(const SceneRequest& request, std::vector<double> flexibilities, double tolerance, int threads,
                  const py::object& report) {
  std::optional<Scene> scene;
  FlowMap map;
  run(report, threads, [&](const Progress& progress) {
    scene.emplace(load_request(request, read_request(request), progress));
    FlowSettings settings;
    settings.max_starts = static_cast<std::size_t>(scene->description.light.photons);
    settings.tolerance = tolerance;
    const LightRange range = light_range(*scene);
    settings.range = flexibilities.empty() && range.is_range;
    settings.flexibilities = flexibilities.empty() ? range.flexibilities : flexibilities;
    map = trace_flow_map(scene->field, scene->geometry, scene->beam, scene->bending, settings, progress);
    if (settings.range) {
      const double first = range.flexibilities.front(), last = range.flexibilities.back();
      const double steps = map.wavelengths < 2 ? 1 : static_cast<double>(map.wavelengths - 1);
      for (std::size_t sample = 0; sample < map.wavelengths; ++sample)
        flexibilities.push_back(first + (last - first) * static_cast<double>(sample) / steps);
    } else {
      flexibilities = settings.flexibilities;
    }
  });
  return arrays_of(std::move(map), *scene, std::move(flexibilities));
}

}  // namespace

void add_traces(py::module_& module) {
  py::class_<Plate>(module, "Plate").def(py::init(&plate_of));
  py::class_<TraceRequest>(module, "TraceRequest")
      .def(py::init<Doubles, Doubles, Doubles, std::optional<Doubles>, std::optional<Doubles>, std::optional<Plate>,
                    std::string, std::string, std::string, std::string, double, std::string, double, double, int,
                    double, bool>());
  module.def("trace", &trace_for_python);
  module.def("landings", &landings);
  std::vector<std::string> ends;
  for (int end = 0; end < ray_end_count; ++end) ends.emplace_back(to_string(static_cast<RayEnd>(end)));
  module.attr("ray_ends") = py::tuple(py::cast(ends));
}

}  // namespace tensorray
