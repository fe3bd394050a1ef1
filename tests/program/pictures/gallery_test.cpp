// The pictures of the documentation are those that the commands beside them make: small versions, by tools/gallery, are
// compared with the pictures.

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <map>
#include <numeric>

#include "renderer/images/image.h"
#include "tests/data_folder.h"
#include "tests/program/support.h"

namespace tensorray {
namespace {

using namespace test;
namespace fs = std::filesystem;

/// Pictures that are made in a second or two each. TENSORRAY_GALLERY=all, which `tools/gallery --check` sets, takes
/// all.
constexpr const char* quick_pictures =
    "constant helix vortex shear notch hemisphere_lens_top paper/figure_6a compared/rims_mesh compared/rims_gaussian "
    "reading/constant_1 reading/scale_4 reading/spread reading/tubes_0.2 reading/vortex_along";

/// Mean differences of linear light, from 0 to 1. Small versions differ from their own pictures by up to 0.005, and by
/// 0.016 if these are images through a lens, which are filtered otherwise. Pictures of light on a plate that were made
/// with another scale (by a quarter or more) differ by 0.015 to 0.05.
constexpr double greatest_distance = 0.017;

/// Some pictures show the same light, and differ by less than what the resolution makes.
constexpr double alike = 0.004;

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

/// The pictures in a folder and below it, relative to it.
std::vector<fs::path> files_below(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const fs::path ending = entry.path().extension();
    if (ending == ".png" || ending == ".jpg") files.push_back(fs::relative(entry.path(), folder));
  }
  return files;
}

class Gallery : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    if (std::system("python3 -c '' 2>/dev/null") != 0) GTEST_SKIP() << "Python 3 is not installed";
  }

  /// Runs tools/gallery, which must succeed. @return what it prints.
  std::string gallery(const std::string& arguments) const {
    const std::string command = "TENSORRAY_DATA=" + quoted(data_folder()) + " " +
                                quoted(source_folder() / "tools" / "gallery") + " " + arguments + " >" +
                                quoted(in_folder("stdout")) + " 2>/dev/null";
    EXPECT_EQ(std::system(command.c_str()), 0) << command << "\n" << read_file(in_folder("stdout"));
    return read_file(in_folder("stdout"));
  }
};

TEST_F(Gallery, EachPictureHasACommandOrAReason) { EXPECT_FALSE(gallery("--list").empty()); }

TEST_F(Gallery, PicturesAreWhatTheirCommandsMake) {
  const char* const wanted = std::getenv("TENSORRAY_GALLERY");
  const bool all = wanted && std::string(wanted) == "all";
  const fs::path made = in_folder("small");
  const std::string notes = gallery((all ? "" : std::string(quick_pictures)) + " --small " + quoted(made) +
                                    " --program " + quoted(TENSORRAY_BINARY));
  if (!notes.empty()) std::cout << notes;  // What was skipped.

  std::map<fs::path, std::vector<double>> pictures;
  for (const fs::path& file : files_below(source_folder() / "docs" / "gallery")) pictures[file] = {};
  for (const fs::path& file : files_below(made)) ASSERT_TRUE(pictures.count(file)) << file;
  for (auto& [file, values] : pictures) values = shrunk(source_folder() / "docs" / "gallery" / file);
  for (const fs::path& file : files_below(made)) {
    const std::vector<double> values = shrunk(made / file);
    const double own = distance(values, pictures.at(file));
    EXPECT_LT(own, greatest_distance) << file << " is not what its command makes: tools/gallery " << file;
    for (const auto& [other, others] : pictures)
      EXPECT_LT(own, distance(values, others) + alike) << file << " is nearer to " << other;
  }
}

}  // namespace
}  // namespace tensorray
