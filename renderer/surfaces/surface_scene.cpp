#include "renderer/surfaces/surface_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "base/errors.h"
#include "renderer/surfaces/embree_handles.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using embree::check;
using embree::Owned;

/// As a fraction of the scene's size: more than single precision moves the coordinates of rays and surfaces.
constexpr double offset_fraction = 1e-6;
/// Fraction of the distance to a target that is left out at its end.
constexpr double end_fraction = 5e-5;
/// Embree's setting that lets it use AVX-512: a picture of tubes then takes 3 % less time (Zen 4).
constexpr const char* widest_vectors = "frequency_level=simd512";
/// With fewer triangles, a slower build is worth its time, as it splits long thin triangles. With more, memory limits
/// the picture, so the search tree keeps no copies of the triangles.
constexpr std::size_t large_scene = 2'000'000;

bool ascends_to(const std::vector<std::uint32_t>& ends, std::size_t last) {
  return std::is_sorted(ends.begin(), ends.end()) && (ends.empty() ? 0 : ends.back()) == last;
}

/// Tests the values in single precision.
template <class Values>
bool all_finite(const Values& values) {
  const auto is_finite = [](const auto& value) { return value.template cast<float>().allFinite(); };
  return std::all_of(values.begin(), values.end(), is_finite);
}

bool all_finite(const std::vector<float>& values) {
  return std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); });
}

void require_shape(const ShadedSurface& surface, const TriangleMesh& mesh) {
  require(all_finite(mesh.vertices), "a vertex is not finite in single precision");
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t corner : triangle)
      require(corner < mesh.vertices.size(), "a triangle has a corner that is none of the vertices");
  require(surface.path_ends.empty() || ascends_to(surface.path_ends, mesh.triangles.size()),
          "path_ends must ascend to the number of triangles");
}

void require_shape(const ShadedSurface& surface, const RoundCurves& curves) {
  require(all_finite(curves.points), "a point is not finite in single precision");
  require(curves.radii.size() == curves.points.size(), "there must be one radius for each point");
  require(std::all_of(curves.radii.begin(), curves.radii.end(), [](float r) { return r >= 0 && std::isfinite(r); }),
          "a radius is not a finite value >= 0");
  require(ascends_to(curves.strand_ends, curves.points.size()), "strand_ends must ascend to the number of points");
  require(surface.normals.empty() && surface.path_ends.empty(), "curves have neither normals nor path_ends");
  require(surface.light < 0, "curves cannot be lights");
}

const std::vector<Vector3d>& points(const ShadedSurface& surface) {
  if (const auto* mesh = std::get_if<TriangleMesh>(&surface.shape)) return mesh->vertices;
  return std::get<RoundCurves>(surface.shape).points;
}

void require_valid(const ShadedSurface& surface) {
  std::visit([&](const auto& shape) { require_shape(surface, shape); }, surface.shape);
  const auto fits = [&](const auto& values) {
    return (values.empty() || values.size() == points(surface).size()) && all_finite(values);
  };
  require(fits(surface.normals), "there must be no normals, or a finite one for each point");
  require(fits(surface.colors), "there must be no colors, or a finite one for each point");
  require(!surface.pictures || (fits(surface.places) && !surface.places.empty()),
          "a mesh with pictures must have a finite place for each point");
  require(fits(surface.forces), "there must be no forces, or a finite one for each point");
  require(fits(surface.arc_lengths), "there must be no arc_lengths, or a finite one for each point");
  require(surface.material >= 0, "the material's index must be >= 0");
}

Eigen::AlignedBox3d bounds_of(const std::vector<ShadedSurface>& surfaces) {
  Eigen::AlignedBox3d box;
  for (const ShadedSurface& surface : surfaces) {
    const auto* curves = std::get_if<RoundCurves>(&surface.shape);
    for (std::size_t i = 0; i < points(surface).size(); ++i) {
      const Vector3d reach = Vector3d::Constant(curves ? curves->radii[i] : 0.0);
      box.extend(points(surface)[i] - reach).extend(points(surface)[i] + reach);
    }
  }
  return box;
}

/// The points of the triangle or segment that was hit, and their interpolation weights.
struct Corners {
  std::array<std::uint32_t, 3> point{};
  std::array<double, 3> weight{};

  template <class Value>
  Value mean(const std::vector<Value>& values) const {
    using Scalar = typename Value::Scalar;
    return static_cast<Scalar>(weight[0]) * values[point[0]] + static_cast<Scalar>(weight[1]) * values[point[1]] +
           static_cast<Scalar>(weight[2]) * values[point[2]];
  }
  float mean(const std::vector<float>& values) const {
    return static_cast<float>(weight[0] * values[point[0]] + weight[1] * values[point[1]] +
                              weight[2] * values[point[2]]);
  }
};

/// Index of the range that contains `index`; `ends` holds the ends of the ranges.
std::uint32_t range_of(const std::vector<std::uint32_t>& ends, std::uint32_t index) {
  return static_cast<std::uint32_t>(std::upper_bound(ends.begin(), ends.end(), index) - ends.begin());
}

/// Moves `position` above the tangent planes that the normals at the corners define: the smooth surface is there.
/// @param outwards  The triangle's normal on this side.
Vector3d lifted(const std::vector<Vector3d>& vertices, const std::vector<Vector3f>& normals, const Corners& corners,
                const Vector3d& position, const Vector3d& outwards, double side) {
  Vector3d result = position;
  for (int i = 0; i < 3; ++i) {
    Vector3d normal = side * normals[corners.point[i]].cast<double>();
    if (normal.dot(outwards) < 0) normal = -normal;  // The mesh is poor here.
    const double below = std::min(0.0, (position - vertices[corners.point[i]]).dot(normal));
    result -= corners.weight[i] * below * normal;
  }
  return result;
}

/// The segments of curves that Embree traces, in buffers that Embree shares.
struct Segments {
  std::vector<std::uint32_t> first_point;
  std::vector<unsigned char> neighbors;  ///< RTC_CURVE_FLAG_...: the sides on which the strand continues.
};

/// Repeated points make no segment.
Segments segments_of(const RoundCurves& curves) {
  Segments segments;
  std::uint32_t first = 0;
  for (const std::uint32_t end : curves.strand_ends) {
    const auto has_segment = [&](std::uint32_t i) { return i + 1 < end && curves.points[i] != curves.points[i + 1]; };
    for (std::uint32_t i = first; i < end; ++i) {
      if (!has_segment(i)) continue;
      const bool left = i > first && has_segment(i - 1), right = has_segment(i + 1);
      segments.first_point.push_back(i);
      segments.neighbors.push_back(static_cast<unsigned char>((left ? RTC_CURVE_FLAG_NEIGHBOR_LEFT : 0) |
                                                              (right ? RTC_CURVE_FLAG_NEIGHBOR_RIGHT : 0)));
    }
    first = end;
  }
  return segments;
}

/// Tangent of the smooth axis: halfway between the directions of the segments that meet at a point.
Vector3d tangent(const RoundCurves& curves, std::uint32_t point, const Vector3d& axis) {
  const Vector3d mean = (curves.points[point] - curves.points[point - 1]).stableNormalized() +
                        (curves.points[point + 1] - curves.points[point]).stableNormalized();
  return mean.squaredNorm() > 0.01 ? Vector3d(mean.normalized()) : axis;
}

Vector3f value_at(const MeshPictures::Picture& picture, const Eigen::Vector2f& place) {
  const auto wrapped = [](double x, int size) { return static_cast<int>(x - size * std::floor(x / size)) % size; };
  const Eigen::Array2d at(place.x() * double(picture.width) - 0.5, (1 - double(place.y())) * picture.height - 0.5);
  const Eigen::Array2d corner = at.floor();
  const Eigen::Array2f part = (at - corner).cast<float>();
  const auto row = [&](double y) -> Vector3f {
    const auto pixel = [&](double x) -> const Vector3f& {
      return picture
          .pixels[static_cast<std::size_t>(wrapped(y, picture.height)) * picture.width + wrapped(x, picture.width)];
    };
    return (1 - part.x()) * pixel(corner.x()) + part.x() * pixel(corner.x() + 1);
  };
  return (1 - part.y()) * row(corner.y()) + part.y() * row(corner.y() + 1);
}

/// The shading normal, tilted by a picture of normals. Where it would be below the triangle, it is on it.
Vector3d tilted(const TriangleMesh& mesh, const std::vector<Eigen::Vector2f>& places, const Corners& corners,
                const SurfaceHit& hit, const Vector3f& pixel) {
  const auto& [a, b, c] = corners.point;
  const Vector3d x = mesh.vertices[b] - mesh.vertices[a], y = mesh.vertices[c] - mesh.vertices[a];
  const Eigen::Vector2d s = (places[b] - places[a]).cast<double>(), t = (places[c] - places[a]).cast<double>();
  const double area = s.x() * t.y() - s.y() * t.x();
  if (area == 0) return hit.shading_normal;
  const Vector3d& N = hit.shading_normal;
  const Vector3d along_u = (t.y() * x - s.y() * y) / area, across = along_u - N.dot(along_u) * N;
  const Vector3d u = across.normalized(), v = N.cross(u) * (area * N.dot(x.cross(y)) < 0 ? -1 : 1);
  const Vector3d tilt = 2 * pixel.cast<double>() - Vector3d::Ones();
  const Vector3d result = tilt.x() * u + tilt.y() * v + tilt.z() * N;
  return result.dot(hit.normal) > 0 ? Vector3d(result.normalized()) : hit.shading_normal;
}

Vector3f color_at(const SurfaceTexture& texture, const Vector3d& point) {
  const Plate& plate = texture.plate;
  const Eigen::Vector2i last = plate.resolution.array() - 1;
  const auto pixel = [&](const Eigen::Vector2i& at) -> const Vector3f& {
    const Eigen::Vector2i inside = at.cwiseMax(0).cwiseMin(last);
    return texture.colors[static_cast<std::size_t>(inside.y()) * static_cast<std::size_t>(last.x() + 1) +
                          static_cast<std::size_t>(inside.x())];
  };
  // Far beyond the edges all colours are those of the edge, and integers do not overflow.
  const Eigen::Vector2d at =
      plate.to_pixel(point).cwiseMax(-1.0).cwiseMin(last.cast<double>().array().matrix() + Eigen::Vector2d(2, 2));
  if (!texture.smooth) return pixel(at.array().floor().cast<int>());
  const Eigen::Array2d corner = (at.array() - 0.5).floor();
  const Eigen::Array2f part = (at.array() - 0.5 - corner).cast<float>();
  const Eigen::Vector2i first = corner.cast<int>();
  const auto row = [&](int y) -> Vector3f {
    return (1 - part.x()) * pixel(first + Eigen::Vector2i(0, y)) + part.x() * pixel(first + Eigen::Vector2i(1, y));
  };
  return (1 - part.y()) * row(0) + part.y() * row(1);
}

}  // namespace

struct SurfaceScene::State {
  std::vector<ShadedSurface> surfaces;
  std::vector<Segments> segments;  // One for each surface; empty for meshes.
  Eigen::AlignedBox3d bounds;
  Vector3d origin = Vector3d::Zero();
  double unit = 1;
  Owned<RTCDevice> device;
  Owned<RTCScene> scene;

  void build() {
    device = embree::make_device(widest_vectors);
    scene.reset(rtcNewScene(device.get()));
    check(device.get());
    std::size_t triangles = 0;
    for (const ShadedSurface& surface : surfaces)
      if (const auto* mesh = std::get_if<TriangleMesh>(&surface.shape)) triangles += mesh->triangles.size();
    const bool is_large = triangles >= large_scene;
    rtcSetSceneFlags(scene.get(), is_large ? RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_COMPACT : RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene.get(), is_large ? RTC_BUILD_QUALITY_MEDIUM : RTC_BUILD_QUALITY_HIGH);
    segments.resize(surfaces.size());
    for (std::size_t i = 0; i < surfaces.size(); ++i)
      std::visit([&](const auto& shape) { attach(static_cast<unsigned>(i), shape); }, surfaces[i].shape);
    rtcCommitScene(scene.get());
    check(device.get());
  }

  void attach(unsigned id, const TriangleMesh& mesh) {
    if (mesh.triangles.empty()) return;
    const Owned<RTCGeometry> geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
    new_points(geometry.get(), mesh.vertices, nullptr);
    rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.triangles.data(), 0,
                               sizeof(mesh.triangles[0]), mesh.triangles.size());
    if (surfaces[id].opacity < 1) embree::let_through(geometry.get(), surfaces[id].opacity);
    commit(id, geometry.get());
  }

  void attach(unsigned id, const RoundCurves& curves) {
    const Owned<RTCGeometry> geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_ROUND_LINEAR_CURVE));
    Segments& parts = segments[id];
    parts = segments_of(curves);
    if (parts.first_point.empty()) return;
    new_points(geometry.get(), curves.points, &curves.radii);
    rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT, parts.first_point.data(), 0,
                               sizeof(std::uint32_t), parts.first_point.size());
    rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_FLAGS, 0, RTC_FORMAT_UCHAR, parts.neighbors.data(), 0, 1,
                               parts.neighbors.size());
    commit(id, geometry.get());
  }

  /// Makes Embree's own copy of the points, in the scene's coordinates.
  float* new_points(RTCGeometry geometry, const std::vector<Vector3d>& positions, const std::vector<float>* radii) {
    const std::size_t values = radii ? 4 : 3;
    auto* const buffer = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                                     radii ? RTC_FORMAT_FLOAT4 : RTC_FORMAT_FLOAT3,
                                                                     values * sizeof(float), positions.size()));
    check(device.get());
    float* next = buffer;
    for (std::size_t i = 0; i < positions.size(); ++i) {
      for (int axis = 0; axis < 3; ++axis) *next++ = static_cast<float>((positions[i][axis] - origin[axis]) / unit);
      if (radii) *next++ = static_cast<float>((*radii)[i] / unit);
    }
    return buffer;
  }

  void commit(unsigned id, RTCGeometry geometry) {
    check(device.get());
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene.get(), geometry, id);
    check(device.get());
  }

  RTCRay ray(const Vector3d& start, const Vector3d& direction, double distance) const {
    const double scale = 1 / unit;
    return embree::ray_of((scale * (start - origin)).cast<float>(), direction, scale * distance);
  }

  /// Distance that a ray travels before it comes near the scene. Far from the scene, single precision is not enough.
  double approach(const Vector3d& from, const Vector3d& direction) const {
    const Vector3d way = origin - from;
    return way.squaredNorm() > 4 * unit * unit ? std::max(0.0, way.dot(direction) - 1.5 * unit) : 0.0;
  }

  RTCRayHit search(const StraightRay& ray) const {
    const Vector3d start = ray.origin + approach(ray.origin, ray.direction) * ray.direction;
    return embree::search_along(this->ray(start, ray.direction, std::numeric_limits<double>::infinity()));
  }

  /// What Embree's `result` of `search` is.
  std::optional<SurfaceHit> found(const StraightRay& ray, const RTCRayHit& result) const {
    if (result.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
    std::optional<SurfaceHit> found(std::in_place);
    SurfaceHit& hit = *found;
    hit.surface = result.hit.geomID;
    hit.primitive = result.hit.primID;
    hit.u = result.hit.u;
    const ShadedSurface& surface = surfaces[hit.surface];
    const auto* mesh = std::get_if<TriangleMesh>(&surface.shape);
    if (mesh) hit.v = result.hit.v;
    // Colours come first, so that they are loaded while the rest is computed.
    if (!surface.texture && !surface.colors.empty()) hit.color = corners(hit).mean(surface.colors);
    if (mesh) {
      complete(*mesh, ray.direction, hit);
    } else {
      const double distance = approach(ray.origin, ray.direction) + result.ray.tfar * unit;
      hit.position = ray.origin + distance * ray.direction;
      hit.normal = Vector3d(result.hit.Ng_x, result.hit.Ng_y, result.hit.Ng_z).stableNormalized();
      complete(std::get<RoundCurves>(surface.shape), hit);
    }
    hit.distance = (hit.position - ray.origin).dot(ray.direction);
    if (surface.texture) hit.color = color_at(*surface.texture, hit.position);
    if (surface.pictures && mesh) look_up(surface, *mesh, hit);
    return found;
  }

  void look_up(const ShadedSurface& surface, const TriangleMesh& mesh, SurfaceHit& hit) const {
    const MeshPictures& pictures = *surface.pictures;
    const Corners corner = corners(hit);
    const Eigen::Vector2f place = corner.mean(surface.places);
    if (!pictures.color.pixels.empty()) hit.color = value_at(pictures.color, place);
    if (!pictures.roughness.pixels.empty()) {
      const double roughness = std::clamp(double{value_at(pictures.roughness, place).y()}, 0.0, 1.0);
      hit.roughness_step = static_cast<std::uint32_t>(std::lround(roughness * (pictures.roughness_steps - 1)));
    }
    if (!pictures.normal.pixels.empty())
      hit.shading_normal = tilted(mesh, surface.places, corner, hit, value_at(pictures.normal, place));
  }

  Corners corners(const SurfaceHit& hit) const {
    if (const auto* mesh = std::get_if<TriangleMesh>(&surfaces[hit.surface].shape))
      return {mesh->triangles[hit.primitive], {1.0 - hit.u - hit.v, hit.u, hit.v}};
    const std::uint32_t point = segments[hit.surface].first_point[hit.primitive];
    return {{point, point + 1, point}, {1.0 - hit.u, hit.u, 0.0}};
  }

  void complete(const TriangleMesh& mesh, const Vector3d& direction, SurfaceHit& hit) const {
    const Corners corner = corners(hit);
    const auto& [a, b, c] = corner.point;
    const Vector3d cross = (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
    hit.position = hit.lifted_position = corner.mean(mesh.vertices);
    hit.normal = hit.shading_normal = cross.normalized();
    const std::vector<Vector3f>& normals = surfaces[hit.surface].normals;
    if (normals.empty()) return;
    const Vector3d smooth = corner.mean(normals).cast<double>();
    if (!(smooth.squaredNorm() > 0)) return;
    hit.shading_normal = smooth.dot(hit.normal) < 0 ? Vector3d(-smooth.normalized()) : smooth.normalized();
    const double side = hit.normal.dot(direction) > 0 ? -1 : 1;
    hit.lifted_position = lifted(mesh.vertices, normals, corner, hit.position, side * hit.normal, side);
  }

  /// Tilts the shading normal as the smooth axis is tilted against the segment's axis.
  void complete(const RoundCurves& curves, SurfaceHit& hit) const {
    hit.lifted_position = hit.position;
    hit.shading_normal = hit.normal;
    const std::uint32_t point = segments[hit.surface].first_point[hit.primitive];
    const Vector3d axis = (curves.points[point + 1] - curves.points[point]).stableNormalized();
    const int neighbors = segments[hit.surface].neighbors[hit.primitive];
    const bool left = neighbors & RTC_CURVE_FLAG_NEIGHBOR_LEFT, right = neighbors & RTC_CURVE_FLAG_NEIGHBOR_RIGHT;
    const bool on_cap = (hit.u <= 0 && !left) || (hit.u >= 1 && !right);
    if (on_cap) return;
    const Vector3d begin = left ? tangent(curves, point, axis) : axis;
    const Vector3d end = right ? tangent(curves, point + 1, axis) : axis;
    const Vector3d smooth_axis = ((1.0 - hit.u) * begin + hit.u * end).normalized();
    const double along = hit.normal.dot(axis);
    const Vector3d across = hit.normal - hit.normal.dot(smooth_axis) * smooth_axis;
    if (!(across.squaredNorm() > 0.01)) return;
    const Vector3d turned = std::sqrt(std::max(0.0, 1 - along * along)) * across.normalized() + along * smooth_axis;
    if (turned.dot(hit.normal) > 0) hit.shading_normal = turned.normalized();
  }
};

SurfaceScene::SurfaceScene(std::vector<ShadedSurface> surfaces) : state_(new State) {
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    try {
      require_valid(surfaces[i]);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("surface " + std::to_string(i) + ": " + error.what());
    }
    for (Vector3f& normal : surfaces[i].normals) normal.normalize();
  }
  state_->surfaces = std::move(surfaces);
  state_->bounds = bounds_of(state_->surfaces);
  if (!state_->bounds.isEmpty()) {
    state_->origin = state_->bounds.center();
    const double radius = state_->bounds.diagonal().norm() / 2;
    state_->unit = radius > 0 ? radius : 1;
  }
  offset_ = offset_fraction * state_->unit;
  state_->build();
}

const std::vector<ShadedSurface>& SurfaceScene::surfaces() const { return state_->surfaces; }
const Eigen::AlignedBox3d& SurfaceScene::bounds() const { return state_->bounds; }

std::optional<SurfaceHit> SurfaceScene::intersect(const Vector3d& origin, const Vector3d& direction) const {
  const StraightRay ray{origin, direction};
  RTCRayHit result = state_->search(ray);
  embree::intersect(state_->scene.get(), result);
  return state_->found(ray, result);
}

void SurfaceScene::intersect(const std::vector<StraightRay>& rays, std::vector<std::optional<SurfaceHit>>& hits) const {
  std::vector<RTCRayHit> results;
  results.reserve(rays.size());
  for (const StraightRay& ray : rays) results.push_back(state_->search(ray));
  embree::intersect(state_->scene.get(), results);
  hits.clear();
  for (std::size_t i = 0; i < rays.size(); ++i) hits.push_back(state_->found(rays[i], results[i]));
}

bool SurfaceScene::occluded(const Vector3d& origin, const Vector3d& direction, double distance) const {
  const State& state = *state_;
  const double approach = state.approach(origin, direction);
  const double rest = distance * (1 - end_fraction) - 4 * offset_ - approach;
  if (!(rest > 0)) return false;
  RTCRay ray = state.ray(origin + approach * direction, direction, rest);
  embree::occluded(state.scene.get(), ray);
  return ray.tfar < 0;
}

SurfaceData SurfaceScene::data(const SurfaceHit& hit) const {
  const ShadedSurface& surface = state_->surfaces[hit.surface];
  const Corners corners = state_->corners(hit);
  SurfaceData data;
  if (!surface.forces.empty()) data.force = corners.mean(surface.forces);
  if (!surface.arc_lengths.empty()) data.arc_length = corners.mean(surface.arc_lengths);
  if (surface.strands_are_paths)
    data.path = surface.first_path + range_of(std::get<RoundCurves>(surface.shape).strand_ends, corners.point[0]);
  else if (!surface.path_ends.empty())
    data.path = surface.first_path + range_of(surface.path_ends, hit.primitive);
  return data;
}

}  // namespace tensorray
