#pragma once
/// The method "lens": an image seen through the field. Its keys of `integrator`; lengths are in world units.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "integrators/lens/lens.h"
#include "renderer/surfaces/plate.h"
#include "renderer/textures/test_images.h"
#include "renderer/textures/texture.h"
#include "scenes/description/method.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// `integrator.image_plane`: at most one of distance, depth and center.
struct ImagePlaneDescription {
  /// Distance before the volume, along the light; none: a quarter of the volume's depth.
  std::optional<double> distance;
  /// Depths in the volume: 0 where light enters, 1 where it leaves. Each depth gives a picture; they are side by side.
  std::optional<std::vector<double>> depth;
  std::optional<Eigen::Vector3d> center;  ///< Middle; none: on the line along the light through the receiver's middle.
  std::optional<Eigen::Vector3d> normal;  ///< None: that of the receiver.
  std::optional<Eigen::Vector3d> up;      ///< None: that of the receiver.
  std::optional<Eigen::Vector2d> size;    ///< None: the smallest in the image's proportions that covers the receiver.
};

enum class Overlay { none, grid };

/// How the picture shows obstacles, where no light of the image arrives.
enum class ObstacleLook { hidden, shaded };

/// How the picture shows places that no light of the image reaches.
enum class EmptyLook { hatched, transparent };

struct LensDescription {
  LensMode mode = LensMode::scatter;
  std::variant<TestImage, std::filesystem::path> image = TestImage::checkerboard;
  std::string image_layer;        ///< Layer of the file; empty: any.
  std::string image_color_space;  ///< OpenColorIO colour space of the file; empty: "auto".
  ImagePlaneDescription plane;
  Wrap wrap = Wrap::none;
  int samples = 1;  ///< Samples per pixel along x and along y.
  Overlay overlay = Overlay::none;
  ObstacleLook obstacles = ObstacleLook::hidden;
  EmptyLook empty = EmptyLook::hatched;
};

inline Words words(LensMode) { return {"gather", "scatter"}; }
inline Words words(Wrap) { return {"none", "clamp", "repeat", "mirror"}; }
inline Words words(Overlay) { return {"none", "grid"}; }
inline Words words(EmptyLook) { return {"hatched", "transparent"}; }
inline Words words(ObstacleLook) { return {"hidden", "shaded"}; }

/// Names of the built-in images for `integrator.image`.
inline Words words(TestImage) { return {"checkerboard", "grid", "color_wheel", "line"}; }

inline void describe(ImagePlaneDescription& plane, KeyVisitor& visit) {
  visit.exclude("distance", {"depth", "center"});
  visit.exclude("depth", {"center"});
  visit("distance", plane.distance,
        "distance of the image before the volume, along the light; default: 1/4 of its depth", at_least(0));
  visit("depth", plane.depth,
        "depth of the image in the volume: 0 where light enters, 1 where it leaves; a list gives a picture for each "
        "depth, side by side");
  visit("center", plane.center, "middle of the image, world");
  visit("normal", plane.normal, "normal of the image; default: that of the receiver", not_zero());
  visit("up", plane.up, "up axis of the image; default: that of the receiver", not_zero());
  visit("size", plane.size, "width and height, world units; default: the receiver's, in the image's proportions",
        above(0));
}

inline void describe(LensDescription& lens, KeyVisitor& visit) {
  visit("mode", lens.mode, "lens: gather looks back from every pixel; scatter sends the image's light to the receiver",
        knob());
  visit("image", lens.image, "lens: the picture that is seen: a file, or checkerboard, grid, color_wheel, line",
        knob());
  visit("image_color_space", lens.image_color_space, "lens: OpenColorIO space of the file; auto: by its format",
        Limits().or_word("auto"));
  visit("image_layer", lens.image_layer, "lens: layer of the file (.exr); default: R, G, B, or the first layer");
  visit.section("image_plane", lens.plane, "lens: position and size of the image");
  visit("wrap", lens.wrap, "lens: how the image continues beyond its edges (gather)");
  visit("samples", lens.samples, "lens, polariscope: samples of a pixel along x and along y", between(1, 16));
  visit("overlay", lens.overlay, "lens: grid draws straight and distorted grid lines over the picture", knob());
  visit("obstacles", lens.obstacles, "lens: shaded draws the obstacles where no light of the image arrives");
  visit("empty", lens.empty, "lens: how `image` shows places that no light of the image reaches");
}

std::shared_ptr<Method> lens_method();

/// The viewer looks against the light, so that the normals of both rectangles point along the light.
struct LensScene {
  Texture image;
  Plate receiver;
  std::vector<Plate> planes;  ///< Planes of the image. Each gives a picture; they are side by side.
  bool wraps = false;         ///< Whether the image continues beyond its edges.
};

/// @throw std::runtime_error if the image cannot be read; SceneError if the image would be behind the receiver.
LensScene load_lens(const Scene& scene, const LensDescription& lens, std::vector<std::string>& notes);

}  // namespace tensorray
