#include "scenes/write_outputs.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <tbb/parallel_invoke.h>

#include "base/text.h"
#include "integrators/paths/path_files.h"
#include "renderer/images/image.h"
#include "volumes/files/point_files.h"
#include "volumes/files/scalar_files.h"
#include "volumes/files/vtk_files.h"

namespace tensorray {
namespace {

ImageMetadata provenance(const Scene& scene, const Render& render) {
  ImageMetadata metadata = render.metadata;
  metadata.insert({{"Software", "tensorray " TENSORRAY_VERSION},
                   {"tensorray:version", TENSORRAY_VERSION},
                   {"tensorray:scene", scene.description.text},
                   {"tensorray:seed", std::to_string(scene.description.seed)},

                   {"tensorray:scale", fmt::format("{:.17g}", scene.scale.scale)},
                   {"tensorray:ocio_config", scene.color.config_name()},
                   {"tensorray:color_space", scene.color.working_space()}});
  return metadata;
}

/// R, G, B as the display shows them, and the alpha if there is one. Formats with an alpha hold colours that are not
/// multiplied by it; in others the picture is seen on black.
Image display_image(const Scene& scene, const Render& render) {
  const Image& linear = render.linear;
  const double exposure =
      scene.description.output.exposure.value_or(render.exposure.value_or(automatic_exposure(linear)));
  const auto gain = static_cast<float>(std::exp2(exposure));
  const bool has_alpha = linear.channels.size() > 3 && linear.channels[3] == "A";
  const bool divides = has_alpha && holds_alpha(scene.description.output.image);
  const std::size_t from = linear.channels.size(), to = has_alpha ? 4 : 3;
  Image image(linear.width, linear.height,
              {linear.channels.begin(), linear.channels.begin() + static_cast<std::ptrdiff_t>(to)});
  for (std::size_t i = 0; i < image.pixels.size() / to; ++i) {
    const float* const in = &linear.pixels[i * from];
    float* const out = &image.pixels[i * to];
    const float alpha = divides && in[3] > 0 ? in[3] : 1;
    for (int c = 0; c < 3; ++c) out[c] = gain * in[c] / alpha;
    if (has_alpha) out[3] = in[3];
  }
  if (render.annotate) render.annotate(image);
  scene.color.to_display(image);
  return image;
}

PointCloud point_cloud(const PhotonMap& photons, const ImageMetadata& metadata) {
  PointCloud points;
  points.metadata = metadata;
  std::vector<float>&wavelength = points.scalars["wavelength"], &power = points.scalars["power"];
  std::vector<Eigen::Vector3f>&direction = points.vectors["direction"], &origin = points.vectors["origin"];
  for (const Photon& photon : photons) {
    points.positions.push_back(photon.position);
    wavelength.push_back(photon.wavelength);
    power.push_back(photon.power);
    direction.push_back(photon.direction);
    origin.push_back(photon.origin);
  }
  return points;
}

}  // namespace

double automatic_exposure(const Image& linear) {
  constexpr float lit = 0.02f;        // Of the undisturbed light, or of the brightest pixel where that is darker.
  constexpr double brightest = 0.99;  // This fraction of the lit pixels is darker than ...
  constexpr double shown_as = 0.9;    // ... this display-linear value.
  const std::size_t channels = linear.channels.size();
  std::vector<float> values;
  for (std::size_t i = 0; i + 2 < linear.pixels.size(); i += channels) {
    const float value = std::max({linear.pixels[i], linear.pixels[i + 1], linear.pixels[i + 2]});
    values.push_back(value);
  }
  const float brightest_value = values.empty() ? 0 : *std::max_element(values.begin(), values.end());
  if (!(brightest_value > 0)) return 0;
  const float threshold = lit * std::min(1.0f, brightest_value);
  values.erase(std::remove_if(values.begin(), values.end(), [&](float value) { return value <= threshold; }),
               values.end());
  const auto bright = values.begin() + static_cast<std::ptrdiff_t>(brightest * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), bright, values.end());
  return std::log2(shown_as / *bright);
}

OutputFiles open_outputs(const OutputDescription& output) {
  for (const std::filesystem::path& path : {output.photons, output.paths})
    if (lower_case_ending(path) == ".vtp") require_vtk_program();
  OutputFiles files;
  if (!output.image.empty()) files.image.emplace(output.image);
  if (!output.exr.empty()) files.exr.emplace(output.exr);
  if (!output.spectral.empty()) files.spectral.emplace(output.spectral);
  if (!output.photons.empty()) files.photons.emplace(output.photons);
  if (!output.paths.empty()) files.paths.emplace(output.paths);
  if (!output.tubes.empty()) files.tubes.emplace(output.tubes);
  if (!output.fluence.empty()) files.fluence.emplace(output.fluence);
  return files;
}

std::vector<std::filesystem::path> write_outputs(const Render& render, const Scene& scene, OutputFiles files) {
  const ImageMetadata metadata = provenance(scene, render);
  const auto write_picture = [](std::optional<OutputFile>& file, const Image& image, const ImageMetadata& header) {
    file->write([&](const std::filesystem::path& path) { write_image(path, image, header); });
  };
  tbb::parallel_invoke(  // Most of the time goes into compressing each by one thread.
      [&] {
        if (files.image) write_picture(files.image, display_image(scene, render), metadata);
      },
      [&] {
        if (files.exr) write_picture(files.exr, render.linear, metadata);
      });
  if (files.spectral) {
    ImageMetadata spectral = metadata;
    spectral.insert(render.spectral->metadata.begin(), render.spectral->metadata.end());
    write_picture(files.spectral, render.spectral->image, spectral);
  }
  if (files.photons)
    files.photons->write(
        [&](const std::filesystem::path& path) { write_points(path, point_cloud(render.photons, metadata)); });
  if (files.paths) files.paths->write([&](const std::filesystem::path& path) { write_paths(path, render.paths); });
  if (files.tubes)
    files.tubes->write([&](const std::filesystem::path& path) { render.write_tubes(path, render.paths); });
  if (files.fluence)
    files.fluence->write([&](const std::filesystem::path& path) { write_scalar_vdb(path, render.fluence, metadata); });

  std::vector<OutputFile> complete;
  std::vector<std::filesystem::path> written;
  for (std::optional<OutputFile>* file :
       {&files.image, &files.exr, &files.spectral, &files.photons, &files.paths, &files.tubes, &files.fluence}) {
    if (!*file) continue;
    written.push_back((*file)->target());
    complete.push_back(std::move(**file));
  }
  commit_all(complete);
  return written;
}

}  // namespace tensorray
