#include <gtest/gtest.h>

#include "renderer/film/spectral_image.h"

namespace tensorray {
namespace {

TEST(ImageDistance, IsAPartOfTheExactPicture) {
  Image exact(2, 1, {"R"}), other(2, 1, {"R"});
  exact.pixels = {3, 4};
  other.pixels = {3, 5};
  EXPECT_DOUBLE_EQ(relative_distance(other, exact), 0.2);
  EXPECT_EQ(relative_distance(exact, exact), 0);
  Image more(1, 1, {"R", "G", "B", "folds"}), less = more;
  more.pixels = {1, 1, 1, 8};
  less.pixels = {1, 1, 1, 2};
  EXPECT_EQ(relative_distance(more, less), 0) << "only colours count";
  EXPECT_EQ(relative_distance(exact, Image(2, 1, {"R"})), 0);
  EXPECT_THROW(relative_distance(exact, Image(1, 2, {"R"})), std::invalid_argument);
  EXPECT_THROW(relative_distance(exact, Image(2, 1, {"R", "G"})), std::invalid_argument);
}

}  // namespace
}  // namespace tensorray
