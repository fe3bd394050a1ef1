#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "integrators/lens/lens_method.h"
#include "renderer/textures/test_images.h"

namespace tensorray {
namespace {

constexpr double default_image_distance = 0.25;  // Distance of the image before the volume, in depths of the volume.
constexpr int test_image_pixels = 4096;  // Most pixels along the longer side; otherwise 4 per pixel of the receiver.

Image load_test_image(TestImage which, const Plate& receiver, const ColorManagement& color) {
  const int longest = std::min(test_image_pixels, 4 * receiver.resolution.maxCoeff());
  const Eigen::Vector2d pixels = longest * receiver.size / receiver.size.maxCoeff();
  Image image = test_image(which, std::max(1, static_cast<int>(std::lround(pixels.x()))),
                           std::max(1, static_cast<int>(std::lround(pixels.y()))));
  const Eigen::Matrix3f to_working = (color.xyz_to_working() * rec709_to_xyz()).cast<float>();
  tbb::parallel_for(0, image.height, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      Eigen::Map<Eigen::Vector3f> pixel(image.pixel(x, y));
      pixel = to_working * pixel;
    }
  });
  return image;
}

/// Whether the image continues beyond its edges. In the mode `scatter` light starts from the image only.
bool goes_on(const LensDescription& lens) { return lens.wrap != Wrap::none && lens.mode == LensMode::gather; }

Texture load_image(const LensDescription& lens, const Plate& receiver, const ColorManagement& color,
                   std::vector<std::string>& notes) {
  const Wrap wrap = goes_on(lens) ? lens.wrap : Wrap::clamp;  // The lens cuts clamped images sharply at their edges.
  if (const TestImage* which = std::get_if<TestImage>(&lens.image))
    return {load_test_image(*which, receiver, color), wrap};
  return {std::get<std::filesystem::path>(lens.image), color, lens.image_color_space, wrap, lens.image_layer, &notes};
}

/// The plate as it is seen from its other side.
Plate from_behind(Plate plate) {
  plate.right = -plate.right;
  return plate;
}

/// The smallest rectangle in the proportions of the image that covers the receiver.
Eigen::Vector2d covering_size(const Plate& receiver, const Texture& image) {
  const double aspect = static_cast<double>(image.width()) / image.height();
  const Eigen::Vector2d size = receiver.size;
  // If the proportions agree up to rounding to pixels, the image has exactly the receiver's size.
  if (std::abs(aspect * size.y() / size.x() - 1) < 0.5 / std::max(image.width(), image.height())) return size;
  return {std::max(size.x(), size.y() * aspect), std::max(size.y(), size.x() / aspect)};
}

}  // namespace

LensScene load_lens(const Scene& scene, const LensDescription& lens, std::vector<std::string>& notes) {
  const Eigen::Vector3d& direction = scene.beam.direction;
  const Plate receiver = from_behind(*scene.geometry.surfaces().plate);
  LensScene result{load_image(lens, receiver, scene.color, notes), receiver, {}, goes_on(lens)};

  Plate plane = receiver;
  if (lens.plane.normal || lens.plane.up) {
    Eigen::Vector3d normal = lens.plane.normal.value_or(receiver.normal()).normalized();
    if (normal.dot(direction) < 0) normal = -normal;
    plane.up = upright(normal, lens.plane.up.value_or(receiver.up));
    plane.right = plane.up.cross(normal);
  }
  plane.size = lens.plane.size.value_or(covering_size(receiver, result.image));

  const DepthRange depths = depth_range(scene.field, Eigen::Vector3d::Zero(), direction);
  const double depth = depths.far - depths.near, receiver_at = receiver.center.dot(direction);
  const auto add = [&](const Eigen::Vector3d& center) {
    if (!(receiver.normal().dot(receiver.center - center) > 0))
      throw SceneError(
          fmt::format("{}: `/integrator/image_plane`: the image must be before the receiver, which is at depth {:.6g} "
                      "of the volume; move the image or the receiver",
                      scene.description.path.string(), (receiver_at - depths.near) / depth));
    plane.center = center;
    require_near(plane, "/integrator/image_plane", scene.description, scene.field);
    result.planes.push_back(plane);
  };
  const auto along = [&](double position) -> Eigen::Vector3d {
    return receiver.center + (position - receiver_at) * direction;
  };
  if (lens.plane.center) {
    add(*lens.plane.center);
  } else if (lens.plane.depth) {
    for (const double part : *lens.plane.depth) add(along(depths.near + part * depth));
  } else {
    add(along(depths.near - lens.plane.distance.value_or(default_image_distance * depth)));
  }
  return result;
}

}  // namespace tensorray
