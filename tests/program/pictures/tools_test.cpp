// Programs beside `tensorray`: tools/clip, tools/gallery and the benchmark.

#include <iostream>
#include <numeric>

#include "renderer/images/image.h"
#include "tests/program/support.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;

class Clip : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
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
    const std::string probe = fmt::format(
        "cd '{}' && ffprobe -v error -count_frames -select_streams v -show_entries stream=nb_read_frames,r_frame_rate "
        "-of csv=p=0 {} >probe",
        in_folder("").string(), name);
    ASSERT_EQ(std::system(probe.c_str()), 0);
    const std::string found = read_file(in_folder("probe"));  // GIF counts hundredths of a second.
    EXPECT_NE(found.find(",3\n"), std::string::npos) << found;
    EXPECT_TRUE(std::string(name) == "a.gif" || found.substr(0, 5) == "12/1,") << found;
  }
}

TEST_F(Clip, APictureIsASheetOfAllFrames) {
  if (std::system("command -v ffmpeg >/dev/null") != 0) GTEST_SKIP() << "ffmpeg is not installed";
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
std::vector<double> shrunk(const fs::path& file) {
  const Image image = read_image(file);
  constexpr int samples = 24;  // Of a cell, along a side.
  std::vector<double> means(3 * cells * cells);
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
double distance(const std::vector<double>& a, const std::vector<double>& b) {
  const double sum_a = std::accumulate(a.begin(), a.end(), 1e-9), sum_b = std::accumulate(b.begin(), b.end(), 1e-9);
  const double gain = std::clamp(sum_a / sum_b, 1 / 1.35, 1.35);
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::abs(a[i] - gain * b[i]);
  return sum / static_cast<double>(a.size());
}

class Gallery : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
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
  const std::string out = in_folder("out").string();
  const auto measure = [&](const std::string& options) {
    const int status = std::system(("'" + benchmark.string() + "' " + options + " > '" + out + "' 2>&1").c_str());
    EXPECT_EQ(status, 0) << read_file(out);
    return read_file(out);
  };
  const std::string questions = measure("--benchmark_list_tests");
  for (const char* const question : {"rays/", "pictures/", "caustics/", "loading/", "view/"})
    EXPECT_NE(questions.find(question), std::string::npos) << question;

  const std::string rates = measure("--benchmark_filter='^loading/64' --benchmark_min_time=0.001");
  for (const char* const word : {"processor: ", "loading/64_voxels/vdb", "ratio=1"})
    EXPECT_NE(rates.find(word), std::string::npos) << rates;
}

}  // namespace
}  // namespace tensorray
