#include "renderer/camera/camera.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/constants.h"
#include "base/errors.h"
#include "renderer/surfaces/plate.h"

namespace tensorray {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

double height_of_angle(double angle) {
  require(angle > 0 && angle < 180,
          "the camera's angle of view must be above 0 and below 180 degrees, not " + std::to_string(angle));
  return 2 * std::tan(angle / 2 * pi / 180);
}

/// Makes a camera without its projection and height.
Camera facing(const Vector3d& direction, const Vector3d& up, const Eigen::Vector2i& resolution) {
  require(direction.allFinite() && direction.stableNorm() > 0,
          "the camera must look somewhere: its direction must be finite and not zero");
  require(up.allFinite(), "the camera's up must be finite");
  require(resolution.minCoeff() > 0, "the camera's resolution must be at least 1 x 1 pixels");
  Camera camera;
  camera.forward = direction.stableNormalized();
  camera.up = upright(camera.forward, up);
  camera.right = camera.forward.cross(camera.up);
  camera.resolution = resolution;
  return camera;
}

Camera look_at(const Vector3d& position, const Vector3d& target, const Vector3d& up,
               const Eigen::Vector2i& resolution) {
  require(position.allFinite() && target.allFinite(), "the camera's position and target must be finite");
  require(position != target, "the camera's position and target must be two points");
  Camera camera = facing(target - position, up, resolution);
  camera.position = position;
  camera.focus_distance = (target - position).stableNorm();
  return camera;
}

double aspect(const Camera& camera) { return static_cast<double>(camera.resolution.x()) / camera.resolution.y(); }

/// Converts a vector to camera space: components along right, up and forward.
Vector3d to_camera(const Camera& camera, const Vector3d& vector) {
  return {vector.dot(camera.right), vector.dot(camera.up), vector.dot(camera.forward)};
}

/// Finds the eye that sees all points, given as (across, depth), within `slope` of its axis on both sides.
/// A point is within if |x − eye.x| <= slope (z − eye.z). This gives two half planes; the farthest points set both.
class Wedge {
 public:
  Wedge(const std::vector<Vector3d>& points, int axis) : points_(points), axis_(axis) {}

  /// The eye nearest to the points that sees them all: both sides of its wedge touch points.
  Vector2d eye(double slope) const {
    double right = -INFINITY, left = INFINITY;
    for (const Vector3d& p : points_) {
      right = std::max(right, p[axis_] - slope * p.z());
      left = std::min(left, p[axis_] + slope * p.z());
    }
    return {(left + right) / 2, (left - right) / (2 * slope)};
  }

  /// Where across, at a given depth, the eye sees all points in the narrowest wedge: by bisection, as slope grows with
  /// depth.
  double middle(double depth, double widest) const {
    double low = 0, high = widest;
    for (int i = 0; i < 60; ++i) {
      const double slope = (low + high) / 2;
      (eye(slope).y() < depth ? low : high) = slope;
    }
    return eye(high).x();
  }

 private:
  const std::vector<Vector3d>& points_;
  int axis_;
};

}  // namespace

Camera perspective_camera(const Vector3d& position, const Vector3d& target, const Vector3d& up, double angle,
                          const Eigen::Vector2i& resolution) {
  Camera camera = look_at(position, target, up, resolution);
  camera.height = height_of_angle(angle);
  return camera;
}

Camera orthographic_camera(const Vector3d& position, const Vector3d& target, const Vector3d& up, double height,
                           const Eigen::Vector2i& resolution) {
  require(height > 0 && std::isfinite(height),
          "the camera's height of view must be above 0, not " + std::to_string(height));
  Camera camera = look_at(position, target, up, resolution);
  camera.projection = Projection::orthographic;
  camera.height = height;
  return camera;
}

Camera frame_points(const std::vector<Vector3d>& points, const Framing& framing) {
  require(framing.margin >= 0 && framing.margin < 0.5, "the camera's margin must be at least 0 and below 0.5");
  Camera camera = facing(framing.direction, framing.up, framing.resolution);
  camera.projection = framing.projection;

  require(!points.empty(), "there is nothing that the camera could look at: give a camera");
  Eigen::AlignedBox3d bounds;
  for (const Vector3d& point : points) {
    require(point.allFinite(), "the camera cannot look at a point that is not finite: give a camera");
    bounds.extend(point);
  }
  const Vector3d center = bounds.center();
  std::vector<Vector3d> seen;
  Eigen::AlignedBox3d box;  // In camera space, relative to the center.
  for (const Vector3d& point : points) {
    seen.push_back(to_camera(camera, point - center));
    box.extend(seen.back());
  }
  // A perspective camera would move onto a single point, or onto a line along the view: such points get a small width.
  const double size = bounds.diagonal().stableNorm(), width = size > 0 ? 1e-6 * size : 1;
  const Vector3d widening = ((Vector3d(width, width, 0) - box.sizes()) / 2).cwiseMax(0);
  for (std::size_t i = points.size(); i-- > 0;) {
    seen.push_back(seen[i] + widening);
    seen[i] -= widening;
  }
  box = {box.min() - widening, box.max() + widening};

  const double share = 1 - 2 * framing.margin;
  Vector3d eye = box.center();
  if (camera.projection == Projection::orthographic) {
    camera.height = std::max(box.sizes().y(), box.sizes().x() / aspect(camera)) / share;
    eye.z() = box.min().z() - camera.height;
  } else {
    camera.height = height_of_angle(framing.angle);
    const double slope_y = share * camera.height / 2, slope_x = slope_y * aspect(camera);
    const Wedge wide(seen, 0), high(seen, 1);
    eye.z() = std::min(wide.eye(slope_x).y(), high.eye(slope_y).y());
    eye.x() = wide.middle(eye.z(), slope_x);
    eye.y() = high.middle(eye.z(), slope_y);
  }
  camera.position = center + eye.x() * camera.right + eye.y() * camera.up + eye.z() * camera.forward;
  camera.focus_distance = box.center().z() - eye.z();
  return camera;
}

/// A ray through the lens' centre (orthographic: a ray parallel to the axis) meets the plane of focus at a point. The
/// lens sends all rays of the pixel to this point. Without a lens the plane of focus has no effect.
CameraRay camera_ray(const Camera& camera, const Vector2d& pixel, const Vector2d& lens) {
  const double pixel_height = camera.height / camera.resolution.y();
  const Vector2d window = pixel - camera.resolution.cast<double>() / 2;
  const Vector3d place = (pixel_height * window.x()) * camera.right - (pixel_height * window.y()) * camera.up;

  CameraRay ray;
  ray.origin = camera.position;
  Vector3d towards = camera.forward;  // From the lens to the point in focus, divided by the focus distance.
  (camera.projection == Projection::perspective ? towards : ray.origin) += place;
  if (camera.lens_radius > 0) {
    const Vector3d on_lens = camera.lens_radius * (lens.x() * camera.right + lens.y() * camera.up);
    ray.origin += on_lens;
    towards -= on_lens / camera.focus_distance;
  }
  ray.direction = towards / towards.norm();
  return ray;
}

std::optional<Vector2d> to_pixel(const Camera& camera, const Vector3d& point) {
  const Vector3d p = to_camera(camera, point - camera.position);
  const bool is_perspective = camera.projection == Projection::perspective;
  if (is_perspective && !(p.z() > 0)) return std::nullopt;
  const double pixels = camera.resolution.y() / (camera.height * (is_perspective ? p.z() : 1));
  return Vector2d(camera.resolution.x() / 2.0 + pixels * p.x(), camera.resolution.y() / 2.0 - pixels * p.y());
}

double pixel_size(const Camera& camera, const Vector3d& point) {
  const double height = camera.height / camera.resolution.y();
  if (camera.projection == Projection::orthographic) return height;
  return height * std::abs(camera.forward.dot(point - camera.position));
}

}  // namespace tensorray
