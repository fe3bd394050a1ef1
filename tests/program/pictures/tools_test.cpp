// Programs beside `tensorray`: tools/clip, tools/gallery and the benchmark.

#include <iostream>

#include "tests/program/support.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;

class Clip : public Program {
 protected:
  void SetUp() override {
    write("scene.json", R"({"field": {"generate": {"kind": "point_load", "resolution": 9}, "scale": 2},
        "light": {"photons": 500, "wavelengths": {"count": 4}, "direction": {"keys": [[1, [0, 0, -1]], [9, [0, 1, -1]]]}},
        "receiver": {"resolution": [33, 24]}, "integrator": {"type": "photon_distribution"}})");
    run_well({"render", "scene.json", "-q", "--frames", "1-9x4", "-o", "frame.##.png"});
  }
};

TEST_F(Clip, HasAllFrames) {
  if (std::system("command -v ffmpeg >/dev/null && command -v ffprobe >/dev/null") != 0)
    GTEST_SKIP() << "ffmpeg is not installed";
  for (const char* name : {"a.mp4", "a.gif"}) {
    const Outcome outcome = run_script("clip", fmt::format("'frame.##.png' {} 12", name));
    ASSERT_EQ(outcome.status, 0) << outcome.error;
    EXPECT_EQ(outcome.out, fmt::format("wrote {}, 3 frames\n", name));
    const std::string probe =
        "ffprobe -v error -count_frames -select_streams v -show_entries stream=nb_read_frames,r_frame_rate "
        "-of csv=p=0 ";
    const std::string found = run_shell(probe + name).out;  // GIF counts hundredths of a second.
    EXPECT_THAT(found, HasSubstr(",3\n"));
    EXPECT_TRUE(std::string(name) == "a.gif" || found.substr(0, 5) == "12/1,") << found;
  }
  const Outcome outcome = run_script("clip", "'frame.##.png' sheet.png");
  ASSERT_EQ(outcome.status, 0) << outcome.error;
  const Image sheet = read_image(in_folder("sheet.png")), first = read_image(in_folder("frame.01.png"));
  EXPECT_EQ(sheet.width, 2 * first.width);  // Three frames: two rows.
  EXPECT_EQ(sheet.height, 2 * first.height);
}

TEST_F(Clip, ErrorsAreOneLine) {
  const std::pair<std::string, std::string> wrong[] = {{"frame.01.png a.mp4", "the number of a frame is #"},
                                                       {"'none.##.png' a.mp4", "there is no such file"},
                                                       {"'frame.##.png' a.mp4 fast", "is no number of frames a second"},
                                                       {"'frame.##.png' frame.05.png", "is one of the frames"},
                                                       {"'frame.##.png'", "give the frames"}};
  for (const auto& [arguments, text] : wrong) expect_one_line(run_script("clip", arguments), text, 2);
}

// The pictures of the documentation are those that the commands beside them make: small versions, by tools/gallery, are
// compared with the pictures.

/// Pictures that are made in a second or two each.
constexpr const char* quick_pictures = "constant shear hemisphere_lens_top compared/rims_gaussian reading/spread";

/// Mean differences of linear light, from 0 to 1. Small versions differ from their own pictures by up to 0.005, and by
/// 0.016 if these are images through a lens, which are filtered otherwise. Pictures of light on a plate that were made
/// with another scale (by a quarter or more) differ by 0.015 to 0.05.
constexpr double max_distance = 0.017;

/// Both sides are shrunk to this many cells along a side, so that neither noise nor fine lines count.
constexpr int cells = 16;

std::string quoted(const fs::path& path) { return "'" + path.string() + "'"; }

/// Mean light of the cells of a picture, about linear and multiplied by alpha; three values a cell.
Eigen::ArrayXd shrunk(const fs::path& file) {
  const Image image = read_image(file);
  constexpr int samples = 24;  // Of a cell, along a side.
  Eigen::ArrayXd means = Eigen::ArrayXd::Zero(3 * cells * cells);
  for (int y = 0; y < cells * samples; ++y)
    for (int x = 0; x < cells * samples; ++x) {
      const float* const pixel = image.pixel(x * image.width / (cells * samples), y * image.height / (cells * samples));
      const double alpha = image.channels.size() == 4 ? pixel[3] : 1;
      double* const mean = &means[3 * (y / samples * cells + x / samples)];
      for (int i = 0; i < 3; ++i) mean[i] += alpha * std::pow(pixel[i], 2.2) / (samples * samples);
    }
  return means;
}

/// Mean difference of the cells' values. The automatic exposure depends on the resolution: a factor of up to 1.35,
/// which all cells have in common, is no difference.
double distance(const Eigen::ArrayXd& a, const Eigen::ArrayXd& b) {
  const double gain = std::clamp((a.sum() + 1e-9) / (b.sum() + 1e-9), 1 / 1.35, 1.35);
  return (a - gain * b).abs().mean();
}

class Gallery : public Program {
 protected:
  void SetUp() override {
    if (std::system("python3 -c '' 2>/dev/null") != 0) GTEST_SKIP() << "Python 3 is not installed";
  }

  /// Runs tools/gallery, which must succeed. @return what it prints.
  std::string gallery(const std::string& arguments) const {
    const Outcome outcome = run_script("gallery", arguments, "TENSORRAY_DATA=" + quoted(data_folder()));
    EXPECT_EQ(outcome.status, 0) << arguments << "\n" << outcome.out;
    return outcome.out;
  }
};

TEST_F(Gallery, EachPictureHasACommandOrAReason) { EXPECT_FALSE(gallery("--list").empty()); }

TEST_F(Gallery, PicturesAreWhatTheirCommandsMake) {
  const fs::path made = in_folder("small");
  const std::string notes =
      gallery(std::string(quick_pictures) + " --small " + quoted(made) + " --program " + quoted(TENSORRAY_BINARY));
  if (!notes.empty()) std::cout << notes;  // What was skipped.
  int compared = 0;
  for (const auto& entry : fs::recursive_directory_iterator(made)) {
    if (entry.is_directory()) continue;
    const fs::path file = fs::relative(entry.path(), made);
    EXPECT_LT(distance(shrunk(entry.path()), shrunk(source_folder() / "docs" / "gallery" / file)), max_distance)
        << file << " is not what its command makes: tools/gallery " << file;
    ++compared;
  }
  EXPECT_GE(compared, 4);
}

TEST_F(Program, TheBenchmarkPrintsRatesAndRatios) {
  const auto benchmark = std::filesystem::path(TENSORRAY_BINARY).replace_filename("tensorray_bench");
  const auto measure = [&](const std::string& options) {
    const Outcome outcome = run_shell(quoted(benchmark) + " " + options);
    EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.error;
    return outcome.out + outcome.error;
  };
  const std::string questions = measure("--benchmark_list_tests");
  for (const char* const question : {"rays/", "pictures/", "caustics/", "loading/", "view/"})
    EXPECT_THAT(questions, HasSubstr(question));

  const std::string rates = measure("--benchmark_filter='^loading/64' --benchmark_min_time=0.001");
  for (const char* const word : {"processor: ", "loading/64_voxels/vdb", "ratio=1"})
    EXPECT_THAT(rates, HasSubstr(word));
}

}  // namespace
}  // namespace tensorray
