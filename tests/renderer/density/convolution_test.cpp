#include "renderer/density/convolution.h"

#include <random>

#include <gtest/gtest.h>

namespace tensorray {
namespace {

std::vector<double> even_filter(int radius) {
  std::vector<double> filter(2 * radius + 1);
  for (int k = 0; k <= radius; ++k) filter[radius - k] = filter[radius + k] = 1.0 / (1 + k * k);
  return filter;
}

TEST(Convolution, IsTheSumOverTheFilter) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (const std::size_t count : {1, 7, 32, 33, 100})
    for (const int radius : {0, 1, 5, 39})
      for (const std::size_t step : {std::size_t{1}, std::size_t{3}, convolution_room(count)}) {
        const std::vector<double> filter = even_filter(radius);
        std::vector<double> in(convolution_room(count) + 2 * radius * step), out(convolution_room(count));
        for (double& value : in) value = uniform(random);
        convolve(in.data(), step, filter, out.data(), count);
        for (std::size_t i = 0; i < count; ++i) {
          double sum = 0;
          for (std::size_t k = 0; k < filter.size(); ++k) sum += filter[k] * in[i + k * step];
          ASSERT_NEAR(out[i], sum, 1e-14) << count << " " << radius << " " << step << " " << i;
        }
      }
}

}  // namespace
}  // namespace tensorray
