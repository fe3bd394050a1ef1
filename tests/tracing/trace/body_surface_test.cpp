// Rays through bodies that end at their surface, against rays through the formula within the true surface.

#include <cstdint>
#include <functional>

#include "base/constants.h"
#include "tests/renderer/shapes.h"
#include "tests/tracing/support.h"
#include "tests/volumes/grid_support.h"
#include "tracing/trace/trace.h"

namespace tensorray {
namespace {

constexpr double across = 1.4;  // Width of the bodies, which lie within 0.8 of the origin.
constexpr double plate_height = 1.2, start_height = -1.2, body_flexibility = 0.6;

struct Body {
  std::string name;
  std::function<double(const Vector3d&)> distance;  ///< To its surface; negative inside.
  TriangleMesh mesh;
};

/// A closed outline of points (radius, z), counter-clockwise, turned about the z axis.
TriangleMesh turned_mesh(const std::vector<Vector2d>& outline, std::uint32_t count) {
  TriangleMesh mesh;
  const auto points = static_cast<std::uint32_t>(outline.size());
  for (std::uint32_t i = 0; i < count; ++i) {
    const Affine3d turn(Eigen::AngleAxisd(2 * pi * i / count, Vector3d::UnitZ()));
    for (std::uint32_t k = 0; k < points; ++k) {
      mesh.vertices.push_back(turn * Vector3d(outline[k].x(), 0, outline[k].y()));
      const std::uint32_t a = i * points, b = (i + 1) % count * points, next = (k + 1) % points;
      mesh.triangles.push_back({a + k, b + next, a + next});
      mesh.triangles.push_back({a + k, b + k, b + next});
    }
  }
  return mesh;
}

std::vector<Body> bodies() {
  const Vector3d half(0.7, 0.6, 0.55);
  const Affine3d turn(Eigen::AngleAxisd(0.3, Vector3d(1, 2, 3).normalized()));
  const auto box = [=](const Vector3d& p) { return ((turn.inverse() * p).cwiseAbs() - half).maxCoeff(); };
  const Vector3d on_voxels(0.55, 0.6, across / 2);  // At phase 0, its faces are those of the field's box.
  const auto tube = [](const Vector3d& p) {
    const double radius = p.head<2>().norm();
    return std::max({radius - 0.7, 0.33 - radius, std::abs(p.z()) - 0.61});
  };
  auto ball = std::get<TriangleMesh>(sphere(160).shape);
  for (Vector3d& vertex : ball.vertices) vertex *= 0.7;
  return {{"ball", [](const Vector3d& p) { return p.norm() - 0.7; }, ball},
          {"tube", tube, turned_mesh({{0.33, -0.61}, {0.7, -0.61}, {0.7, 0.61}, {0.33, 0.61}}, 1024)},
          {"box", box, box_between(-half, half, turn)},
          {"upright box", [=](const Vector3d& p) { return (p.cwiseAbs() - on_voxels).maxCoeff(); },
           box_between(-on_voxels, on_voxels)}};
}

/// Light from below over the whole body, a bit oblique.
std::vector<Ray> beam() {
  std::vector<Ray> starts;
  const Vector3d V = Vector3d(0.13, -0.07, 1).normalized();
  for (int i = -9; i <= 9; ++i)
    for (int j = -9; j <= 9; ++j)
      starts.push_back({Vector3d(0.0713 * i + 0.011, 0.0691 * j - 0.007, 0) + start_height / V.z() * V, V});
  return starts;
}

/// Where a ray lands on the plate; `grazes` gets whether it meets the surface, or an edge of it, at a small angle:
/// there the way depends on less than a mesh has.
Ray true_ray(const Body& body, const TensorFunction& T, const Ray& start, bool& grazes) {
  constexpr double h = 2e-3;
  Ray ray = start;
  bool inside = false;
  const auto step = [&](double length) {
    return inside ? stepped(T, body_flexibility, ray, length)
                  : Ray{ray.position + length * ray.direction, ray.direction};
  };
  grazes = false;
  while (ray.position.z() < plate_height && ray.direction.z() > 0.2) {
    const Ray next = step(h);
    const double before = body.distance(ray.position), after = body.distance(next.position);
    if (std::abs(after) < 0.01 && std::abs(after - before) < 0.3 * h) grazes = true;
    if ((after < 0) == inside) {
      ray = next;
      continue;
    }
    double low = 0, high = h;
    for (int i = 0; i < 40; ++i) {
      const double middle = (low + high) / 2;
      ((body.distance(step(middle).position) < 0) == inside ? low : high) = middle;
    }
    ray = step(high);
    inside = !inside;
  }
  if (ray.direction.z() <= 0.2) grazes = true;
  ray.position -= (ray.position.z() - plate_height) / ray.direction.z() * ray.direction;
  return ray;
}

/// The body's voxels. @param phase  Shifts the lattice, voxels.
TensorField body_field(const Body& body, const TensorFunction& T, int voxels, const Vector3d& phase,
                       Interpolation between) {
  const double h = across / voxels;
  Affine3d to_world(Eigen::Translation3d(h * phase) * Eigen::Scaling(h));
  const Vector3i last = Vector3i::Constant(static_cast<int>(0.85 / h) + 2);
  TensorGrid grid =
      dense_grid({-last, last}, to_world, [&](const Vector3i& i) { return T(to_world * i.cast<double>()); });
  clear_voxels(grid.blocks, [&](const Vector3i& at) { return body.distance(to_world * at.cast<double>()) >= 0; });
  grid.surface = body.mesh;
  return TensorField(grid, {between, Border::extend});
}

struct Truth {
  std::vector<Ray> starts;
  std::vector<Vector3d> landings;

  Truth(const Body& body, const TensorFunction& T) {
    for (const Ray& start : beam()) {
      bool grazes = false;
      const Ray ray = true_ray(body, T, start, grazes);
      if (grazes) continue;
      starts.push_back(start);
      landings.push_back(ray.position);
    }
  }
};

/// The greatest distance of landings from the true ones, voxels.
double landing_error(const TensorField& field, const Truth& truth) {
  Surfaces surfaces = surfaces_of(field);
  surfaces.cut = field.surface();
  surfaces.plate = plate_across(Vector3d::UnitZ(), plate_height);
  const Geometry geometry(std::move(surfaces));
  BendingSettings settings;
  settings.tolerance = 1e-4;
  RayBatch batch;
  for (const Ray& start : truth.starts) batch.add(start.position, start.direction, body_flexibility);
  trace(field, geometry, settings, batch);
  double greatest = 0;
  for (std::size_t i = 0; i < truth.starts.size(); ++i) {
    EXPECT_EQ(batch.end[i], RayEnd::plate);
    greatest = std::max(greatest, (batch.position[i] - truth.landings[i]).norm());
  }
  return greatest / voxel_size(field);
}

TEST(BodySurface, LandingsAreExactWhateverThePhaseOfTheVoxels) {
  for (const Body& body : bodies()) {
    const Truth truth(body, linear_tensor);
    EXPECT_GT(truth.starts.size(), 150u);
    for (const double phase : {0.0, 0.27, 0.5, 0.81})
      for (const Interpolation between : {Interpolation::cubic, Interpolation::linear}) {
        const TensorField field = body_field(body, linear_tensor, 32, phase * Vector3d(1, -0.7, 1.3), between);
        EXPECT_LT(landing_error(field, truth), 0.01)
            << body.name << ", phase " << phase << ", " << static_cast<int>(between);
      }
  }
}

/// Of a field that is not linear: half the voxels, a quarter of the error in the world, half of it in voxels.
TEST(BodySurface, LandingsAreOfOrderTwoInTheVoxel) {
  const TensorFunction T = [](const Vector3d& p) {
    return Matrix3d(std::cos(1.5 * p.x() - p.z()) * general_tensor() + 0.5 * std::sin(2 * p.y()) * Matrix3d::Ones());
  };
  for (const Body& body : bodies()) {
    const Truth truth(body, T);
    double coarse = 0, fine = 0;
    for (const double phase : {0.1, 0.4, 0.7}) {
      coarse += landing_error(body_field(body, T, 12, Vector3d::Constant(phase), Interpolation::cubic), truth) / 12;
      fine += landing_error(body_field(body, T, 24, Vector3d::Constant(phase), Interpolation::cubic), truth) / 24;
    }
    EXPECT_GT(std::log2(coarse / fine), 1.8) << body.name << " " << coarse << " " << fine;
    EXPECT_LT(24 * fine / 3, 0.05) << body.name;
  }
}

/// One voxel along z, as of a flat mesh, and a surface between these heights.
TEST(BodySurface, TheExtentGrowsToWholeVoxels) {
  struct Case {
    Vector3d from, to;                    ///< Of the surface, index space.
    Vector3d expected_from, expected_to;  ///< Of the extent.
    double beyond;
  };
  const Case cases[] = {
      {{0, 0, -0.5}, {4, 4, 0.5}, {0, 0, -0.5}, {4, 4, 0.5}, 0},
      {{0.2, -0.3, -0.5}, {4.4, 4, 0.5}, {0, -1, -0.5}, {5, 4, 0.5}, 0},
      {{0, 0, -0.7}, {4, 4, 0.5}, {0, 0, -1}, {4, 4, 1}, 0},
      {{-3.5, 0, -0.5}, {4, 5.9, 0.5}, {-2, 0, -0.5}, {4, 6, 0.5}, 1.5},
      {{1, 1, -0.1}, {2, 2, 0.1}, {0, 0, -0.5}, {4, 4, 0.5}, 0},
  };
  const Affine3d to_world =
      Eigen::Translation3d(1, -2, 3) * Eigen::AngleAxisd(0.4, Vector3d(3, 1, 2).normalized()) * Eigen::Scaling(0.37);
  for (const Case& each : cases) {
    TensorGrid grid = dense_grid({Vector3i(0, 0, 0), Vector3i(4, 4, 0)}, to_world,
                                 [](const Vector3i& i) { return linear_tensor(i.cast<double>()); });
    grid.surface = box_mesh({each.from, each.to}, to_world);
    for (const Interpolation between : {Interpolation::cubic, Interpolation::linear}) {
      const TensorField field(grid, {between, Border::extend});
      EXPECT_EQ(field.index_bounds().min(), each.expected_from);
      EXPECT_EQ(field.index_bounds().max(), each.expected_to);
      EXPECT_NEAR(field.surface_beyond(), each.beyond, 1e-9);
    }
  }
}

}  // namespace
}  // namespace tensorray
