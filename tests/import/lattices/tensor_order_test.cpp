#include "tools/import/lattices/tensor_order.h"

#include <gtest/gtest.h>

namespace tensorray {
namespace {

/// Entry (i, j) is 10 i + j (11 to 33); a symmetric tensor repeats its upper entries.
Eigen::Matrix3d numbered(bool symmetric) {
  Eigen::Matrix3d tensor;
  tensor << 11, 12, 13, 21, 22, 23, 31, 32, 33;
  if (symmetric) tensor.triangularView<Eigen::StrictlyLower>() = tensor.transpose();
  return tensor;
}

TEST(TensorOrder, EachOrderPutsComponentsInTheirPlaces) {
  const double vtk[] = {11, 22, 33, 12, 23, 13}, fsl[] = {11, 12, 13, 22, 23, 33}, mrtrix[] = {11, 22, 33, 12, 13, 23},
               voigt[] = {11, 22, 33, 23, 13, 12}, lower[] = {11, 12, 22, 13, 23, 33},
               full[] = {11, 12, 13, 21, 22, 23, 31, 32, 33};
  EXPECT_EQ(tensor_of(vtk, TensorOrder::vtk), numbered(true));
  EXPECT_EQ(tensor_of(fsl, TensorOrder::fsl), numbered(true));
  EXPECT_EQ(tensor_of(mrtrix, TensorOrder::mrtrix), numbered(true));
  EXPECT_EQ(tensor_of(voigt, TensorOrder::voigt), numbered(true));
  EXPECT_EQ(tensor_of(lower, TensorOrder::lower_triangle), numbered(true));
  EXPECT_EQ(tensor_of(full, TensorOrder::full), numbered(false));
  const double plane[] = {11, 22, 33, 12}, two_by_two[] = {11, 12, 21, 22};
  Eigen::Matrix3d expected;
  expected << 11, 12, 0, 12, 22, 0, 0, 0, 33;
  EXPECT_EQ(tensor_of(plane, TensorOrder::plane), expected);
  expected << 11, 12, 0, 21, 22, 0, 0, 0, 0;
  EXPECT_EQ(tensor_of(two_by_two, TensorOrder::two_by_two), expected);
}

}  // namespace
}  // namespace tensorray
