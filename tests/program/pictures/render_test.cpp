#include <algorithm>
#include <cmath>

#include "renderer/images/image.h"
#include "tests/program/support.h"

namespace tensorray {
namespace {

using namespace test;

constexpr const char* zero_field =
    R"({"generate": {"kind": "constant", "resolution": 9, "tensor": [[0, 0, 0], [0, 0, 0], [0, 0, 0]]}})";

TEST_F(Program, WritesPictureAndExrBesideTheScene) {
  write("scene.json", small_scene());
  const Outcome outcome = run_well({"render", "scene.json"});
  EXPECT_EQ(files(), (std::vector<std::string>{"scene.exr", "scene.json", "scene.png"}));
  EXPECT_NE(outcome.out.find("scene.png"), std::string::npos);
  EXPECT_NE(outcome.error.find("scale"), std::string::npos);  // The program reports what "auto" chose.
  const Image exr = read_image(in_folder("scene.exr"));
  EXPECT_EQ(exr.width, 32);
  EXPECT_EQ(exr.channels, (std::vector<std::string>{"R", "G", "B"}));
}

TEST_F(Program, QuietPrintsNothing) {
  write("scene.json", small_scene());
  const Outcome outcome = run_well({"render", "scene.json", "--quiet"});
  EXPECT_EQ(outcome.out + outcome.error, "");
}

TEST_F(Program, OutputOptionsTakeThePlaceOfTheScenes) {
  write("scene.json", small_scene());
  run_well({"render", "scene.json", "-o", "a.png", "-o", "b.spectral.exr", "-o", "c.vdb", "-o", "d.exr"});
  EXPECT_EQ(files(), (std::vector<std::string>{"a.png", "b.spectral.exr", "c.vdb", "d.exr", "scene.json"}));
  const Image spectral = read_image(in_folder("b.spectral.exr"));
  ASSERT_EQ(spectral.channels.size(), 3u + 4u);
  for (const double wavelength : {423.75, 511.25, 598.75, 686.25}) {
    char name[32];
    std::snprintf(name, sizeof name, "S0.%d,%06dnm", static_cast<int>(wavelength),
                  static_cast<int>(std::lround(1e6 * (wavelength - std::floor(wavelength)))));
    EXPECT_EQ(std::count(spectral.channels.begin(), spectral.channels.end(), name), 1) << name;
  }
}

TEST_F(Program, ThePictureIsTheSameWithAndWithoutSpectra) {
  write("scene.json", small_scene());
  const std::vector<std::string> light{"--set", "field.scale=20", "--set", "light.wavelengths.count=16"};
  const auto picture = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), light.begin(), light.end());
    run_well(arguments);
    return read_image(in_folder("out.exr"));
  };
  const Image colors = picture({"render", "scene.json", "-q", "-o", "out.exr"});
  const Image bands = picture({"render", "scene.json", "-q", "-o", "out.exr", "-o", "out.spectral.exr"});
  ASSERT_EQ(colors.pixels.size(), bands.pixels.size());
  const float greatest = *std::max_element(bands.pixels.begin(), bands.pixels.end());
  for (std::size_t i = 0; i < bands.pixels.size(); ++i)
    ASSERT_NEAR(colors.pixels[i], bands.pixels[i], 1e-6f * greatest) << i;
}

TEST_F(Program, ZeroFieldGivesANeutralUniformPlate) {
  write("scene.json", small_scene(zero_field));
  for (const std::string illuminant : {"D65", "A", "blackbody 3000"}) {
    run_well({"render", "scene.json", "-q", "-o", "out.exr", "--set", "light.pattern=grid", "--set",
              "light.photons=40000", "--set", "receiver.size=[1.5,1.5]", "--set", "light.spectrum=" + illuminant,
              "--set", "receiver.resolution=[64,64]"});
    const Image image = read_image(in_folder("out.exr"));
    double sum = 0, least = 1e9, greatest = 0;
    for (int y = 12; y < 52; ++y)  // Six standard deviations of the estimate away from the edge of the plate.
      for (int x = 12; x < 52; ++x)
        for (int c = 0; c < 3; ++c) {
          const double value = image.pixel(x, y)[c];
          sum += value / (40 * 40 * 3);
          least = std::min(least, value);
          greatest = std::max(greatest, value);
        }
    EXPECT_NEAR(sum, 1, 0.02) << illuminant;
    EXPECT_LT((greatest - least) / sum, 1e-6) << illuminant;
  }
}

TEST_F(Program, WithoutWhiteBalanceThePlateHasTheLightsColour) {
  write("scene.json", small_scene(zero_field));
  run_well({"render", "scene.json", "-q", "-o", "out.exr", "--set", "light.spectrum=A", "--set",
            "output.white_balance=false", "--set", "light.wavelengths.min=360", "--set", "light.wavelengths.max=830"});
  const Image image = read_image(in_folder("out.exr"));
  const float* rgb = image.pixel(16, 16);
  // Illuminant A, x = 0.4476, y = 0.4074, in linear Rec. 709 (IEC 61966-2-1) at Y = 1.
  const double X = 0.4476 / 0.4074, Z = (1 - 0.4476 - 0.4074) / 0.4074;
  const double red = 3.2406 * X - 1.5372 - 0.4986 * Z, green = -0.9689 * X + 1.8758 + 0.0415 * Z;
  const double blue = 0.0557 * X - 0.2040 + 1.0570 * Z;
  EXPECT_NEAR(rgb[0] / rgb[1], red / green, 3e-3);
  EXPECT_NEAR(rgb[2] / rgb[1], blue / green, 3e-3);
}

TEST_F(Program, TheSamePictureOnAnyNumberOfThreads) {
  write("scene.json", small_scene());
  std::string first;
  for (const std::string threads : {"1", "2", "8", "2"}) {
    run_well({"render", "scene.json", "-q", "-o", "out.exr", "-o", "out.png", "--threads", threads, "--seed", "5",
              "--set", "light.pattern=random"});
    const std::string bytes = read_file(in_folder("out.exr")) + read_file(in_folder("out.png"));
    if (first.empty()) first = bytes;
    EXPECT_TRUE(bytes == first) << threads;
  }
  run_well(
      {"render", "scene.json", "-q", "-o", "out.exr", "-o", "out.png", "--seed", "6", "--set", "light.pattern=random"});
  EXPECT_FALSE(read_file(in_folder("out.exr")) + read_file(in_folder("out.png")) == first);
}

TEST_F(Program, StatisticsBalance) {
  write("scene.json", small_scene());
  run_well({"render", "scene.json", "-q", "-o", "out.exr", "--stats", "stats.json", "--threads", "2", "--set",
            "field.scale=20"});
  const nlohmann::json stats = read_json("stats.json");
  const auto count = [&](const char* key) { return stats["photons"][key].get<std::uint64_t>(); };
  EXPECT_EQ(count("emitted"), 4 * stats["positions"].get<std::uint64_t>());
  std::uint64_t ended = count("deposited") + count("missed");
  for (const auto& [reason, stopped] : stats["photons"]["stopped"].items()) ended += stopped.get<std::uint64_t>();
  EXPECT_EQ(ended, count("emitted"));
  EXPECT_GT(count("deposited"), 0u);
  ASSERT_EQ(stats["channels"].size(), 4u);
  for (const auto& channel : stats["channels"]) {
    EXPECT_EQ(channel["rays"]["emitted"], stats["positions"]);
    EXPECT_GT(channel["ray_power"], 0);
  }
  EXPECT_NEAR(stats["power"]["emitted"], 4, 1e-3);  // Irradiance 1 times the area of the beam's cross section.
  for (const char* key : {"ray_steps", "tensor_samples", "peak_memory_bytes", "threads"})
    EXPECT_GT(stats[key], 0) << key;
  for (const char* phase : {"load", "trace", "density", "color", "write"})
    EXPECT_GE(stats["seconds"][phase], 0) << phase;
}

TEST_F(Program, RgbModeIsThePapers) {
  write("scene.json", small_scene());
  run_well({"render", "scene.json", "-q", "-o", "out.exr", "--set", "bending.rgb=[0.1,0.2,0.3]"});
  EXPECT_EQ(read_image(in_folder("out.exr")).channels.size(), 3u);
  // Equal flexibilities give no colour at all.
  run_well({"render", "scene.json", "-q", "-o", "out.exr", "--set", "bending.rgb=[0.2,0.2,0.2]"});
  const Image grey = read_image(in_folder("out.exr"));
  for (int i = 0; i < 32 * 32; ++i) {
    const float* rgb = grey.pixel(i % 32, i / 32);
    ASSERT_NEAR(rgb[0], rgb[1], 1e-5);
    ASSERT_NEAR(rgb[0], rgb[2], 1e-5);
  }
}

TEST_F(Program, OneBandIsNeutralIfItIsBroadAndColouredIfItIsNarrow) {
  write("scene.json", small_scene(zero_field));
  const auto middle = [&](const std::string& wavelengths) {
    run_well({"render", "scene.json", "-q", "-o", "out.exr", "--set", "light.wavelengths=" + wavelengths});
    const Image image = read_image(in_folder("out.exr"));
    return std::vector<float>(image.pixel(16, 16), image.pixel(16, 16) + 3);
  };
  const auto broad = middle(R"({"min": 380, "max": 730, "count": 1})");
  EXPECT_NEAR(broad[0], broad[1], 1e-4);
  EXPECT_NEAR(broad[2], broad[1], 1e-4);
  for (const char* green : {R"({"min": 550, "max": 550, "count": 1})", R"({"min": 549, "max": 551, "count": 2})"})
    EXPECT_GT(middle(green)[1], 2 * middle(green)[0]);
}

TEST_F(Program, APlateAnywhereIsSeenAlongTheLight) {
  write("scene.json", small_scene(zero_field));
  const auto column_of_light = [&](const std::vector<std::string>& receiver) {
    std::vector<std::string> arguments{"render",
                                       "scene.json",
                                       "-q",
                                       "-o",
                                       "out.exr",
                                       "--set",
                                       R"(light.aperture={"center":[0.5,0,0],"size":[0.5,0.5]})"};
    for (const std::string& value : receiver) arguments.insert(arguments.end(), {"--set", value});
    run_well(arguments);
    const Image image = read_image(in_folder("out.exr"));
    double sum = 0, moment = 0;
    for (int y = 0; y < 32; ++y)
      for (int x = 0; x < 32; ++x) {
        sum += image.pixel(x, y)[1];
        moment += image.pixel(x, y)[1] * (x + 0.5);
      }
    return moment / sum;
  };
  const std::string size = "receiver.size=[2,2]";
  EXPECT_NEAR(column_of_light({size}), 24, 0.2);
  EXPECT_NEAR(column_of_light({size, "receiver.normal=[0,0,-1]"}), 24, 0.2);  // The opposite normal.
  EXPECT_NEAR(column_of_light({size, "receiver.center=[0,0,5]"}), 24, 0.2);   // A plate before the volume.
  EXPECT_NEAR(column_of_light({size, "receiver.center=[0,0,0]"}), 24, 0.2);   // A plate in the volume.
  EXPECT_NEAR(column_of_light({"receiver.size=[4000,4000]", "receiver.distance=1e4"}), 16, 0.2);
}

TEST_F(Program, ProvenanceIsInTheHeader) {
  write("scene.json", small_scene());
  run_well({"render", "scene.json", "-q", "-o", "out.exr", "--seed", "77"});
  const std::string bytes = read_file(in_folder("out.exr"));
  for (const char* text : {"tensorray:version", "tensorray:scene", "point_load", "tensorray:seed", "77",
                           "tensorray:photons", "tensorray:ocio_config", "tensorray:color_space"})
    EXPECT_NE(bytes.find(text), std::string::npos) << text;
}

TEST_F(Program, FilesGoThroughMakeInfoAndRender) {
  const Outcome made = run_well({"make", "vortex", "-o", "vortex.vdb", "--resolution", "16", "--circulation", "3"});
  const nlohmann::json info = nlohmann::json::parse(run_well({"info", "vortex.vdb", "--json"}).out);
  EXPECT_NE(info.dump().find("circulation=3"), std::string::npos) << info.dump(2);
  EXPECT_NE(run_well({"info", "vortex.vdb"}).out.find("4096"), std::string::npos);
  write("scene.json", small_scene(R"({"file": "vortex.vdb"})"));
  run_well({"render", "scene.json", "-q"});
  // The same field gives the same picture if it is made in memory.
  const std::vector<float> from_file = read_image(in_folder("scene.exr")).pixels;
  write("scene.json", small_scene(R"({"generate": {"kind": "vortex", "resolution": 16, "circulation": 3}})"));
  run_well({"render", "scene.json", "-q"});
  EXPECT_EQ(read_image(in_folder("scene.exr")).pixels, from_file);
}

/// A row of a tensor is a vector grid: without the others it is no tensor, but has a gradient.
TEST_F(Program, GridsWithoutATensorAreDerived) {
  using nlohmann::json;
  run_well({"make", "vortex", "-o", "vortex.vdb", "--resolution", "16"});
  run_well({"derive", "vortex.vdb", "--invariant", "norm", "-o", "norm.vdb"});
  const std::string error = run({"render", "norm.vdb", "-o", "a.png"}).error;
  EXPECT_NE(error.find("`--set field.derive=hessian` makes one of"), std::string::npos) << error;
  EXPECT_NE(run_well({"info", "norm.vdb"}).out.find("--derive hessian"), std::string::npos);
  const json hessian = json::parse(run_well({"info", "norm.vdb", "--derive", "hessian", "--json"}).out);
  EXPECT_EQ(hessian["fields"][0]["active_voxels"], 4096);
  const std::string row = "vortex_row0";
  const json gradient =
      json::parse(run_well({"info", "vortex.vdb", "--field", row, "--derive", "gradient", "--json"}).out);
  EXPECT_EQ(gradient["fields"][0]["name"], row);
  write("scene.json", small_scene(R"({"file": "missing.####.vdb"})"));
  EXPECT_NE(run({"render", "scene.json"}).error.find("give --frames"), std::string::npos);
}

TEST_F(Program, PixelsThatAreNoSquaresAreToldOf) {
  write("scene.json", small_scene());
  const auto error = [&](const std::string& resolution) {
    return run_well({"render", "scene.json", "-o", "a.png", "--set", "receiver.size=[2,4]", "--set",
                     "receiver.resolution=" + resolution})
        .error;
  };
  EXPECT_EQ(error("[20,40]").find("stretched"), std::string::npos);
  EXPECT_NE(error("40").find("2 times as high as wide; [20, 40] pixels are squares"), std::string::npos) << error("40");
}

TEST_F(Program, ObstaclesAndCutsAreLoaded) {
  write("wall.obj", "v -9 -9 -2.2\nv 9 -9 -2.2\nv 9 9 -2.2\nv -9 9 -2.2\nf 1 2 3 4\n");
  write("scene.json", small_scene());
  run_well({"render", "scene.json", "-q", "-o", "out.exr", "--stats", "stats.json", "--set",
            R"(obstacles=[{"file":"wall.obj"}])"});
  EXPECT_EQ(read_json("stats.json")["photons"]["deposited"], 0);
  EXPECT_GT(read_json("stats.json")["photons"]["stopped"]["obstacle"], 0);

  // The volume is cut to a small box in a corner. Light outside the box goes straight.
  write("box.obj",
        "v 0.5 0.5 -1\nv 0.9 0.5 -1\nv 0.9 0.9 -1\nv 0.5 0.9 -1\n"
        "v 0.5 0.5 -0.5\nv 0.9 0.5 -0.5\nv 0.9 0.9 -0.5\nv 0.5 0.9 -0.5\n"
        "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
  run_well({"render", "scene.json", "-q", "-o", "cut.exr", "--set", "field.bounds=box.obj"});
  const Image cut = read_image(in_folder("cut.exr"));
  EXPECT_NEAR(cut.pixel(8, 24)[1], 1, 0.05);
}

TEST_F(Program, AnInterruptLeavesNothingBehind) {
  write("scene.json", small_scene());
  write("scene.png", "an old picture");
  const pid_t child = start({"render", "scene.json", "--set", "light.photons=1e9"});
  // Rendering has begun when the temporary files exist.
  while (files().size() < 4 && is_running(child)) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  kill(child, SIGINT);
  const Outcome outcome = wait_for(child);
  EXPECT_EQ(outcome.status, 130);
  EXPECT_EQ(files(), (std::vector<std::string>{"scene.json", "scene.png"}));
  EXPECT_EQ(read_file(in_folder("scene.png")), "an old picture");
}

TEST_F(Program, HelpAndVersion) {
  EXPECT_NE(run_well({"--help"}).out.find("render"), std::string::npos);
  EXPECT_NE(run_well({"render", "--help"}).out.find("--set"), std::string::npos);
  EXPECT_NE(run_well({"make", "vortex", "--help"}).out.find("--circulation"), std::string::npos);
  EXPECT_EQ(run_well({"--version"}).out.find("tensorray "), 0u);
  EXPECT_TRUE(nlohmann::json::parse(run_well({"schema"}).out).contains("$schema"));
}

}  // namespace
}  // namespace tensorray
