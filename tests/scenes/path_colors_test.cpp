#include "integrators/path_tracing/path_colors.h"

#include <vector>

#include <gtest/gtest.h>

#include "scenes/outputs/picture_outputs.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

/// A path down from the origin that turns aside by one unit after a way of 1, and goes on down.
Path path_of(double wavelength, double aside) {
  Path path;
  path.wavelength = wavelength;
  for (const Vector3d& position :
       {Vector3d(0, 0, 0), Vector3d(0, 0, -1), Vector3d(aside, 0, -2), Vector3d(aside, 0, -3)}) {
    PathPoint point;
    point.position = position;
    path.points.push_back(point);
  }
  return path;
}

std::vector<std::vector<Vector3d>> colors_of(const std::vector<Path>& paths, double radius) {
  PathColorDescription description;
  description.by = PathColor::wavelength;
  return path_colors(description, paths, radius).of_points;
}

/// Where paths of one seed lie in one another they have one colour, so that it does not matter which is seen.
TEST(PathColors, WavelengthsMixUntilTheyPart) {
  const std::vector<Path> paths{path_of(450, 0), path_of(550, 1), path_of(650, 2)};
  const auto colors = colors_of(paths, 0.4);
  const Vector3d mean = (wavelength_color(450) + wavelength_color(550) + wavelength_color(650)) / 3;
  for (std::size_t path = 0; path < paths.size(); ++path) {
    for (const std::size_t point : {0, 1}) EXPECT_TRUE(colors[path][point].isApprox(mean)) << path << point;
    for (const std::size_t point : {2, 3})
      EXPECT_TRUE(colors[path][point].isApprox(wavelength_color(paths[path].wavelength))) << path << point;
  }
}

/// Of red, green and blue, red comes first.
TEST(PathColors, FallingWavelengthsMixToo) {
  const auto colors = colors_of({path_of(650, 0), path_of(450, 1), path_of(650, 0), path_of(450, 1)}, 0.5);
  const Vector3d mean = (wavelength_color(450) + wavelength_color(650)) / 2;
  for (const auto& path : colors) EXPECT_TRUE(path[0].isApprox(mean));
}

/// At half the radius from another path, its colour counts half.
TEST(PathColors, MixByTheirDistance) {
  const auto colors = colors_of({path_of(450, 0), path_of(650, 1)}, 2);
  EXPECT_TRUE(colors[0][3].isApprox((wavelength_color(450) + 0.5 * wavelength_color(650)) / 1.5));
}

/// Paths have none of the colours of another seed.
TEST(PathColors, SeedsDoNotMix) {
  const auto colors = colors_of({path_of(450, 0), path_of(650, 0), path_of(550, 0), path_of(700, 0)}, 1);
  EXPECT_TRUE(colors[0][0].isApprox((wavelength_color(450) + wavelength_color(650)) / 2));
  EXPECT_TRUE(colors[3][0].isApprox((wavelength_color(550) + wavelength_color(700)) / 2));
}

}  // namespace
}  // namespace tensorray
