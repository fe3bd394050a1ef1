// What the functions of all rooms refuse, with what their errors say of it.

#include <stdexcept>

#include "renderer/camera/camera.h"
#include "renderer/charts/color_bar.h"
#include "renderer/charts/ink.h"
#include "renderer/charts/lettering.h"
#include "renderer/coverage/area_deposit.h"
#include "renderer/density/density.h"
#include "renderer/lights/beam.h"
#include "renderer/materials/material.h"
#include "renderer/sampling/random.h"
#include "renderer/sampling/sampling.h"
#include "renderer/spectra/reflectance.h"
#include "renderer/surfaces/tube_mesh.h"
#include "renderer/textures/environment_map.h"
#include "renderer/textures/test_images.h"
#include "tests/names.h"

namespace tensorray {
namespace {

constexpr double not_a_number = NAN, infinite = INFINITY;

/// @param text  A part of the error.
template <class Action>
void refused(const std::string& text, const Action& action) {
  EXPECT_THAT(action, ThrowsMessage<std::invalid_argument>(AllOf(HasSubstr(text), Not(HasSubstr("\n")))));
}

/// As above, of each of these values.
template <class Action>
void refused(const std::string& text, std::initializer_list<double> values, const Action& action) {
  for (const double value : values) {
    SCOPED_TRACE(value);
    refused(text, [&] { action(value); });
  }
}

TEST(Refusals, OfCharts) {
  Image grey(4, 4, {"Y"}), image(4, 4, {"R", "G", "B"});
  const Vector3d paint(1, 0, 0);
  const auto red = [&](double) { return paint; };
  const auto lines = [&](const GridLines& wrong) { draw_grid_lines(image, std::vector<PixelCoordinates>(16), wrong); };
  refused("range", {1, infinite}, [](double high) { round_ticks({1, high}, 5); });
  refused("range", [] { round_ticks({0, 1, true}, 5); });
  refused("two ticks", [] { round_ticks({0, 1}, 1); });
  refused("R, G, B", [&] { draw_color_bar(grey, {"", {0, 1}, red}); });
  refused("R, G, B", [&] { draw_color_key(grey, {"", {{"x", {1, 0, 0}}, {"y", {0, 1, 0}}, {"z", {0, 0, 1}}}}); });
  refused("entries", [&] { draw_color_key(image, {"title", {}}); });
  refused("colours", [&] { draw_color_bar(image, {"title", {0, 1}, nullptr}); });
  refused("range", [&] { draw_color_bar(image, {"title", {1, 0}, red}); });
  refused("percentiles", [] { choose_range({1}, {50, 50, false, false}); });
  refused("percentiles", [] { choose_range({1}, {-1, 50, false, false}); });
  refused("percentiles", [] { choose_range({1}, {0, not_a_number, false, false}); });
  refused("symmetric", [] { choose_range({1}, {0, 100, true, true}); });
  refused("R, G, B", [&] { draw_grid_lines(grey, std::vector<PixelCoordinates>(16), {}); });
  refused("coordinates", [&] { draw_grid_lines(image, std::vector<PixelCoordinates>(12), {}); });
  refused("cell", [&] { lines({{0, 4}}); });
  refused("width", {-1, not_a_number}, [&](double width) { lines({{4, 4}, width}); });
  refused("opacity", {1.5, not_a_number}, [&](double opacity) { lines({{4, 4}, 1, {1, 1, 1}, opacity}); });
  refused("height", {0, not_a_number, infinite}, [&](double height) { draw_text(image, {1, 1}, height, "a", paint); });
  refused("position", {not_a_number, infinite}, [&](double x) { draw_text(image, {x, 1}, 5, "a", paint); });
}

TEST(Refusals, OfPlatesAndPictures) {
  const auto sky = [](const auto& change) {
    EnvironmentLight light;
    light.picture = Image(4, 2, {"Y"});
    light.channel_spectra = Eigen::MatrixXf::Identity(1, 1);
    change(light);
    EnvironmentMap(light, {1});
  };
  refused("pixel", [] { AreaDeposit(0, 5); });
  refused("pixel", [] { AreaDeposit(5, -1); });
  refused("pixel", {3, 6}, [](double end) { AreaDeposit(5, 5, 3, static_cast<int>(end)); });
  refused("one pixel", [] { DensityEstimator(0, 5, 1, {}); });
  refused("one channel", [] { DensityEstimator(5, 5, 0, {}); });
  refused("65000", [] { DensityEstimator(65001, 1, 1, {}); });
  refused("colour", [] { DensityEstimator(5, 5, 2, {}, {{1, 1, 1}}); });
  refused("tau", {0, not_a_number}, [](double tau) { DensityEstimator(5, 5, 1, {DensityKind::gaussian, tau}); });
  refused("pixels", [&] { sky([](EnvironmentLight& light) { light.picture = {}; }); });
  refused("pixels", [&] { sky([](EnvironmentLight& light) { light.picture.pixels.pop_back(); }); });
  refused("spectrum", [&] { sky([](EnvironmentLight& light) { light.channel_spectra.resize(1, 2); }); });
  refused("bands", [&] { sky([](EnvironmentLight& light) { light.channel_spectra.setOnes(2, 1); }); });
  refused("negative", [&] { sky([](EnvironmentLight& light) { light.channel_spectra(0, 0) = -1; }); });
  refused("rotation", [&] { sky([](EnvironmentLight& light) { light.to_world(0, 0) = -1; }); });
  refused("rotation", [&] { sky([](EnvironmentLight& light) { light.to_world *= 2; }); });
  refused("one value", [] { Distribution1D({}); });
  refused("negative", {-1, not_a_number}, [](double value) { Distribution1D({1, value}); });
  refused("finite", [] { Distribution1D({1e308, 1e308}); });
  refused("cells", [] { Distribution2D({1, 2, 3}, 2, 2); });
  refused("cells", [] { Distribution2D({}, 0, 0); });
  refused("one pixel", [] { test_image(TestImage::grid, 0, 5); });
  refused("one pixel", [] { test_image(TestImage::line, 5, -1); });
}

TEST(Refusals, OfCameras) {
  const Vector3d up = Vector3d::UnitZ();
  const auto look = [&](const Vector3d& target, const Vector3d& up_, double angle, int width) {
    perspective_camera({1, 2, 3}, target, up_, angle, {width, 10});
  };
  const auto framing = [](const std::vector<Vector3d>& points, double margin, const Vector3d& direction) {
    Framing settings;
    settings.margin = margin;
    settings.direction = direction;
    frame_points(points, settings);
  };
  refused("two points", [&] { look({1, 2, 3}, up, 40, 10); });
  refused("finite", [&] { look({1, 2, not_a_number}, up, 40, 10); });
  refused("up", [&] { look({0, 0, 0}, {0, not_a_number, 0}, 40, 10); });
  refused("angle", {0, 180, not_a_number}, [&](double angle) { look({0, 0, 0}, up, angle, 10); });
  refused("resolution", [&] { look({0, 0, 0}, up, 40, 0); });
  refused("height", {0, infinite}, [&](double high) { orthographic_camera({0, 0, 0}, {1, 2, 3}, up, high, {10, 10}); });
  refused("nothing", [&] { framing({}, 0, up); });
  refused("finite", [&] { framing({{0, 0, 0}, {1, not_a_number, 0}}, 0, up); });
  refused("margin", [&] { framing({{0, 0, 0}}, 0.5, up); });
  refused("direction", [&] { framing({{0, 0, 0}}, 0, Vector3d::Zero()); });
}

TEST(Refusals, OfLightAndMatter) {
  const Tube tube{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0}, {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}, 0}};
  const auto tubes = [&](const auto& change) {
    TubeSettings settings;
    change(settings);
    make_tube_mesh({tube}, settings);
  };
  const Beam beam = silhouette_beam({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, -1}, Vector3d::UnitY());
  const BandValues one = BandValues::Ones(1);
  const auto mirror = [&](double roughness, const BandValues& n, const BandValues& k, const BandValues& color) {
    make_material(RoughConductor{roughness, {n, k}}, color);
  };
  const auto bands = [](double low, double high, int count) { make_bands(illuminant("D65"), low, high, count); };
  refused("lengths", [&] { tubes([](TubeSettings& s) { s.tolerance = -1; }); });
  refused("lengths", [&] { tubes([](TubeSettings& s) { s.spacing = not_a_number; }); });
  refused("3 segments", [&] { tubes([](TubeSettings& s) { s.min_segments = 2; }); });
  refused("segments", [&] { tubes([](TubeSettings& s) { s.max_segments = 5; }); });
  refused("lines", [&] { tubes([](TubeSettings& s) { s.lines = -1; }); });
  refused("2^31", [&] { tubes([](TubeSettings& s) { s.max_triangles = std::uint64_t{1} << 32; }); });
  refused("ellipse", [&] { make_tube_mesh({{tube[0], {{0, 0, 1}, {1, 0, 0}, {1, 0, 0}, 0}}}, {}); });
  refused("area", [] { silhouette_beam({{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}}, {1, 0, 0}, Vector3d::UnitZ()); });
  refused("one photon", [&] { BeamSampler(beam, BeamPattern::grid, 0, 0); });
  refused("2^32", [&] { BeamSampler(beam, BeamPattern::sobol, std::uint64_t{1} << 33, 0); });
  refused("not 3", [] { sobol(0, 0, 3); });
  refused("roughness", [&] { mirror(1.5, 0 * one, one, one); });
  refused("bands", [&] { mirror(0.5, 0 * one, one, BandValues::Ones(3)); });
  refused("negative", [&] { mirror(0.2, one, -one, one); });
  refused("of k", [&] { mirror(0.2, one, BandValues::Ones(2), one); });
  refused("index", [&] { make_material(RoughDielectric{0.1, 1}, one); });
  refused("roughness", [&] { make_material(RoughDielectric{not_a_number, 1.5}, one); });
  refused("metallic", [&] { make_material(Principled{2, 0.5, 0.5, 0, 0}, one); });
  refused("specular", [&] { make_material(Principled{0, 0.5, -1, 0, 0}, one); });
  refused("clearcoat", [&] { make_material(Principled{0, 0.5, 0.5, 3, 0}, one); });
  refused("reflectance", [&] { make_material(Diffuse{}, 2 * one); });
  refused("\"gould\"; known are: gold, silver, copper, aluminium", [] { metal_index("gould", {500}); });
  refused("at least one band", [] { ReflectanceModel({}, Matrix3d::Identity()); });
  refused("at least 1", [&] { bands(400, 700, 0); });
  refused("700 to 400", [&] { bands(700, 400, 8); });
  refused("-1 to 400", [&] { bands(-1, 400, 8); });
  refused("min <= max", [&] { bands(500, not_a_number, 8); });
  refused("550 nm", [&] { bands(550, 550, 8); });
  refused("no power between 900 and 1000 nm", [&] { bands(900, 1000, 8); });
  refused("no visible power between 310 and 340 nm", [&] { bands(310, 340, 8); });
  refused("no power at 500 nm", [] { make_bands(Spectrum{{400}, {1}}, 500, 500, 1); });
}

}  // namespace
}  // namespace tensorray
