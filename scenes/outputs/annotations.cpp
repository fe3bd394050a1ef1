#include "renderer/charts/annotations.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include <Eigen/LU>
#include <fmt/format.h>

#include "renderer/color/color.h"
#include "renderer/spectra/spectrum.h"
#include "scenes/outputs/picture_outputs.h"

namespace tensorray {
namespace {

constexpr double unseen = 0.5;  // Grey of wavelengths that the eye does not see.
constexpr double pale = 0.03;   // Part of white in the colour of a wavelength, which makes it reproducible.

ColorStrip wavelength_strip(const Scene& scene) {
  const double min = scene.description.light.wavelength_min, max = scene.description.light.wavelength_max;
  const Eigen::Matrix3d from_rec709 = scene.color.xyz_to_working() * rec709_to_xyz();
  ColorStrip strip;
  if (min < max) strip.left = fmt::format("{:g}", min);
  strip.right = fmt::format("{:g} nm", max);
  strip.color = [=](double position) -> Eigen::Vector3d {
    return from_rec709 * wavelength_color(min + position * (max - min));
  };
  return strip;
}

/// Red, green and blue, with their flexibilities.
ColorStrip rgb_strip(const Scene& scene) {
  const Eigen::Vector3d& s = *scene.description.bending.rgb;
  std::vector<Eigen::Vector3d> colors;
  for (const Band& band : scene.bands) {
    const Eigen::Vector3d color = to_working(scene) * band.xyz;
    colors.push_back(color / color.maxCoeff());
  }
  ColorStrip strip;
  strip.right = fmt::format("s = {:.3g}, {:.3g}, {:.3g}", s[0], s[1], s[2]);
  strip.color = [colors](double position) {
    return colors[std::min(static_cast<std::size_t>(position * static_cast<double>(colors.size())), colors.size() - 1)];
  };
  return strip;
}

}  // namespace

PictureView picture_view(const Plate& plate) { return {plate.right, plate.up, plate.pixel_size().x()}; }

PictureView picture_view(const Camera& camera) {
  PictureView view{camera.right, camera.up, {}};
  if (camera.projection == Projection::orthographic) view.pixel_size = camera.height / camera.resolution.y();
  return view;
}

std::function<void(Image&, double)> light_legend(const Scene& scene) {
  const ColorStrip strip = scene.description.bending.rgb ? rgb_strip(scene) : wavelength_strip(scene);
  return [strip](Image& image, double exposure) {
    ColorStrip with_exposure = strip;
    with_exposure.note = fmt::format("{:+.1f} stops", exposure);
    draw_color_strip(image, with_exposure);
  };
}

void draw_annotations(const OutputDescription& output, const Render& render, Image& image) {
  if (!output.caption.empty()) draw_caption(image, output.caption);
  if (!render.view) return;
  if (output.wants(Annotation::scale) && render.view->pixel_size) draw_scale_bar(image, *render.view->pixel_size);
  if (output.wants(Annotation::axes)) draw_axes(image, render.view->right, render.view->up);
}

Eigen::Vector3d wavelength_color(double wavelength) {
  Eigen::Vector3d rgb = rec709_to_xyz().inverse() * observer(wavelength);
  rgb.array() -= std::min(0.0, rgb.minCoeff());
  const double greatest = rgb.maxCoeff();
  if (!(greatest > 0)) return Eigen::Vector3d::Constant(unseen);
  return rgb / greatest * (1 - pale) + Eigen::Vector3d::Constant(pale);
}

}  // namespace tensorray
