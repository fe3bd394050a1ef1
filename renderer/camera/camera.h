#pragma once
/// The camera that takes a picture.

#include <optional>
#include <vector>

#include <Eigen/Geometry>

namespace tensorray {

enum class Projection { perspective, orthographic };

/// A camera in world space. Pixel coordinates are as in Plate: continuous, pixel (x, y) covers [x, x+1) × [y, y+1), and
/// (0, 0) is the upper left corner of the picture. Pixels are square.
///
/// A lens_radius > 0 makes it a thin lens, perspective or telecentric: objects at `focus_distance` are sharp.
struct Camera {
  Projection projection = Projection::perspective;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< Centre of the lens.
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();    ///< Unit.
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();       ///< Unit, normal to `right`.
  Eigen::Vector3d forward = Eigen::Vector3d::UnitY();  ///< up × right: the direction of the view.
  double height = 1;  ///< Height of the view. Perspective: 2 tan(angle / 2), at distance 1. Orthographic: world units.
  double lens_radius = 0;                ///< World units; 0: a pinhole camera, everything is sharp.
  double focus_distance = 1;             ///< Along `forward`, world units; > 0.
  Eigen::Vector2i resolution{512, 512};  ///< Pixels.
};

struct CameraRay {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitY();  ///< Unit.
};

/// A camera at `position`, focused on `target`. `up` (world +z if zero or along the view) is upwards in the picture.
/// @param angle  Angle of view from the picture's lower edge to its upper edge, degrees; above 0 and below 180.
/// @throw std::invalid_argument naming a parameter that is out of range or not finite, or if both points are equal.
Camera perspective_camera(const Eigen::Vector3d& position, const Eigen::Vector3d& target, const Eigen::Vector3d& up,
                          double angle, const Eigen::Vector2i& resolution);

/// As `perspective_camera`, but with parallel rays.
/// @param height  Height of the view, world units; > 0.
Camera orthographic_camera(const Eigen::Vector3d& position, const Eigen::Vector3d& target, const Eigen::Vector3d& up,
                           double height, const Eigen::Vector2i& resolution);

/// Settings of an automatic camera.
struct Framing {
  Projection projection = Projection::perspective;
  Eigen::Vector3d direction{-0.48, 0.74, -0.47};  ///< View direction, any length; default: from above, x right, y away.
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  double angle = 30;     ///< Angle of view, as in `perspective_camera`.
  double margin = 0.05;  ///< Fraction of the picture's width and height left free on each side; at least 0, below ½.
  Eigen::Vector2i resolution{512, 512};
};

/// The camera that sees all points as large as possible, in the middle of the picture. It is focused on the middle of
/// their depth and has no lens. A single point is framed like an object of size 1.
/// @throw std::invalid_argument if there are no points, a point is not finite, or a setting is out of range.
Camera frame_points(const std::vector<Eigen::Vector3d>& points, const Framing& framing);

/// The ray that sees `pixel`. Any thread may call this function.
/// @param lens  Point in the unit disk: where the ray passes through the lens.
CameraRay camera_ray(const Camera& camera, const Eigen::Vector2d& pixel, const Eigen::Vector2d& lens);

/// The pixel coordinates of a point seen through the lens' centre; nothing if it is behind a perspective camera.
std::optional<Eigen::Vector2d> to_pixel(const Camera& camera, const Eigen::Vector3d& point);

/// The size, in world units, of a pixel in the plane through `point` normal to `forward`; 0 at the camera.
double pixel_size(const Camera& camera, const Eigen::Vector3d& point);

}  // namespace tensorray
