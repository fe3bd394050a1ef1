// `tensorray explore`: a sheet of pictures of a field, and the scene of one of them.

#include "tests/program/support.h"

namespace tensorray {
namespace {

constexpr int size = 32, gap = 8, columns = 6;

class Explore : public Program {
 protected:
  void SetUp() override { run_well({"make", "point_load", "-o", "stress.vdb", "--resolution", "9"}); }

  Outcome explore(const Arguments& arguments) const {
    return run(joined({"explore", "stress.vdb", "--set", "light.wavelengths.count=4", "-q"}, arguments));
  }

  /// The sheet that `explore` must make.
  Image sheet(const Arguments& arguments) const {
    const Outcome outcome = explore(joined({"-o", "sheet.png"}, arguments));
    EXPECT_EQ(outcome.status, 0) << outcome.error;
    return read_image(in_folder("sheet.png"));
  }
};

TEST_F(Explore, ThePicturesAreThoseOfTheirScenes) {
  const Image all = sheet({"--size", "32"});
  EXPECT_EQ(all.width, columns * (size + gap) + gap);
  for (const int number : {5, 12}) {
    ASSERT_EQ(explore({"--pick", std::to_string(number), "--save-scene", "cell.json"}).status, 0);
    run_well({"render", "cell.json", "--set", "light.photons=1000", "-o", "shape.png", "-q"});
    const Image shape = read_image(in_folder("shape.png"));  // Of the plate, which turns with the light.
    const double step = std::max(shape.width, shape.height) / double{size};
    const int width = static_cast<int>(std::round(shape.width / step));
    const int height = static_cast<int>(std::round(shape.height / step));
    run_well(joined({"render", "cell.json", "-o", "cell.png", "-q"},
                    changes({fmt::format("receiver.resolution=[{},{}]", width, height), "light.photons=2560",
                             "output.annotations=[]", R"(integrator.density={"kind":"gaussian","tau":1})",
                             "light.wavelengths.count=16", "light.wavelengths.per_photon=4"})));
    const Image cell = read_image(in_folder("cell.png"));
    const int left = gap + (number - 1) % columns * (size + gap) + (size - width) / 2;
    const int top = gap + (number - 1) / columns * ((all.height - gap) / 3) + (size - height) / 2;
    for (int y = 0; y < height; ++y)
      ASSERT_TRUE(std::equal(all.pixel(left, top + y), all.pixel(left + width, top + y), cell.pixel(0, y)))
          << number << ": " << y;
    EXPECT_GT(*std::max_element(cell.pixels.begin(), cell.pixels.end()), 0.2);
  }
}

/// Of the polariscope, rows have coefficients of their own: with twice the coefficient, a picture has twice the
/// fringes.
TEST_F(Explore, RowsOfThePolariscopeAreItsCoefficients) {
  const Image all = sheet({"--method", "polariscope"});
  const int row = (all.height - gap) / 3;
  int different = 0;
  for (int y = 0; y < 200; ++y)
    for (int x = 0; x < 200; ++x)
      different += std::abs(all.pixel(gap + x, gap + y)[1] - all.pixel(gap + x, gap + y + row)[1]) > 0.1f;
  EXPECT_GT(different, 4000);
  ASSERT_EQ(explore({"--method", "polariscope", "--pick", "3", "--save-scene", "cell.json"}).status, 0);
  const json cell = read_json("cell.json");
  EXPECT_EQ(cell["integrator"]["type"], "polariscope");
  EXPECT_GT(cell["integrator"]["stress_optic"].get<double>(), 0);
}

/// Several depths of a lens are side by side, and the stretch has pixels of its own.
TEST_F(Explore, PicturesOfOtherMethodsStayInTheirCells) {
  for (const Arguments& method : std::vector<Arguments>{
           {"integrator.type=stretch", "integrator.stretch.pixels=64", "integrator.stretch.resolution=8"},
           {"integrator.type=path_tracing", "integrator.seeds.count=9", "integrator.max_samples=1",
            "integrator.min_samples=1"},
           {"integrator.type=lens", "integrator.image_plane.depth=[0,0.5]", "integrator.mode=gather"}}) {
    const Image all = sheet(joined({"--size", "32"}, changes(method)));
    for (int y = 0; y < all.height; ++y)
      for (int column = 0; column <= columns; ++column)
        ASSERT_EQ(all.pixel(column * (size + gap) + gap / 2, y)[0], all.pixel(0, 0)[0]) << method[0] << " " << y;
    double brightest = 0;
    for (int x = 0; x < size; ++x)
      for (int y = 0; y < size; ++y) brightest = std::max(brightest, double{all.pixel(gap + x, gap + y)[0]});
    EXPECT_GT(brightest, 0.2) << method[0];
  }
}

TEST_F(Explore, WrongOptionsAreRefused) {
  const std::pair<const char*, Arguments> wrong[] = {
      {"nothing to do", {}},
      {"sheet.exr", {"-o", "sheet.exr"}},
      {"--save-scene", {"-o", "sheet.png", "--pick", "3"}},
      {"--save-scene", {"--pick", "3", "--save-scene", "stress.vdb"}},
      {"nothing", {"-o", "sheet.png", "--set", "integrator.type=nothing"}}};
  const std::string field = contents("stress.vdb");
  for (const auto& [text, arguments] : wrong) expect_one_line(explore(arguments), text, 2);
  EXPECT_EQ(contents("stress.vdb"), field);
  write("stress.nii", std::string(400, 'n'));
  expect_error("stress.nii: is not a NIfTI file", {"explore", "stress.nii", "-o", "sheet.png"});
  EXPECT_FALSE(has("sheet.png"));
}

}  // namespace
}  // namespace tensorray
