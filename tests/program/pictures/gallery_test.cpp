// The pictures of the documentation are those that the commands beside them make: small versions, by tools/gallery, are
// compared with the pictures.

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <numeric>

#include "renderer/images/image.h"
#include "tests/program/support.h"

namespace tensorray {
namespace {

using namespace test;
namespace fs = std::filesystem;

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

}  // namespace
}  // namespace tensorray
