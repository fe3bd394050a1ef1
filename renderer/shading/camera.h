#pragma once
/// @file renderer/shading/camera.h
/// Where a picture is taken from.

#include <optional>
#include <vector>

#include <Eigen/Geometry>

namespace tensorray {

enum class Projection { perspective, orthographic };

/// A camera in world space. Pixel coordinates are as in Plate: continuous, pixel (x, y) covers [x, x+1) × [y, y+1), and
/// (0, 0) is the upper left corner of the picture. Pixels are square.
///
/// With a lens it is a thin lens, perspective or telecentric (orthographic): what lies in the plane at
/// `focus_distance` is sharp.
struct Camera {
  Projection projection = Projection::perspective;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< Of the lens' centre.
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();    ///< Unit.
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();       ///< Unit, normal to `right`.
  Eigen::Vector3d forward = Eigen::Vector3d::UnitY();  ///< up × right: where the camera looks.
  double height = 1;  ///< Of what is seen: perspective: 2 tan(angle / 2), its height at distance 1; else world units.
  double lens_radius = 0;                ///< World units; 0: a pinhole, everything is sharp.
  double focus_distance = 1;             ///< Along `forward`, world units, > 0.
  Eigen::Vector2i resolution{512, 512};  ///< Pixels.
};

struct CameraRay {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitY();  ///< Unit.
};

/// Looks from `position` at `target`, where it is focused; `up` (world +z if it is zero or along the view) is upwards
/// in the picture.
/// @param angle  Of view from the picture's lower edge to its upper edge, degrees, above 0 and below 180.
/// @throw std::invalid_argument naming the parameter that is out of range, not finite, or if the two points are one.
Camera perspective_camera(const Eigen::Vector3d& position, const Eigen::Vector3d& target, const Eigen::Vector3d& up,
                          double angle, const Eigen::Vector2i& resolution);

/// The same with parallel rays. @param height  Of what is seen, world units; > 0.
Camera orthographic_camera(const Eigen::Vector3d& position, const Eigen::Vector3d& target, const Eigen::Vector3d& up,
                           double height, const Eigen::Vector2i& resolution);

/// How to look at something that nobody has chosen a camera for.
struct Framing {
  Projection projection = Projection::perspective;
  Eigen::Vector3d direction{-0.48, 0.74, -0.47};  ///< Of the view, any length: from above, x to the right, y away.
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  double angle = 30;     ///< Of view, as in `perspective_camera`.
  double margin = 0.05;  ///< Of the picture's width and height that stays free on each side; at least 0, below ½.
  Eigen::Vector2i resolution{512, 512};
};

/// The camera that sees all points as large as possible, in the middle of the picture, and is focused on the middle of
/// their depth; it has no lens. A single point is seen as a thing of size 1 would be.
/// @throw std::invalid_argument if there are no points, one is not finite, or a setting is out of range.
Camera frame_points(const std::vector<Eigen::Vector3d>& points, const Framing& framing);

/// The ray that sees `pixel`. @param lens  In the unit disk: where it passes through the lens. Any thread may call it.
CameraRay camera_ray(const Camera& camera, const Eigen::Vector2d& pixel, const Eigen::Vector2d& lens);

/// Where a point is seen, on the picture or beside it; nothing if it is not before a perspective camera. Through the
/// centre of the lens.
std::optional<Eigen::Vector2d> to_pixel(const Camera& camera, const Eigen::Vector3d& point);

/// The size in the world of what a pixel sees in the plane through `point` normal to `forward`; 0 at the camera.
double pixel_size(const Camera& camera, const Eigen::Vector3d& point);

}  // namespace tensorray
