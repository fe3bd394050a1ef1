#include "tools/import/lattices/tensor_order.h"

#include <stdexcept>

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

TEST(TensorOrder, NamesAreThoseOfTheirOrders) {
  EXPECT_EQ(tensor_order_of("vtk"), TensorOrder::vtk);
  EXPECT_EQ(tensor_order_of("fsl"), TensorOrder::fsl);
  EXPECT_EQ(tensor_order_of("mrtrix"), TensorOrder::mrtrix);
  EXPECT_EQ(tensor_order_of("voigt"), TensorOrder::voigt);
  EXPECT_EQ(tensor_order_of("plane"), TensorOrder::plane);
  EXPECT_EQ(tensor_order_of("2x2"), TensorOrder::two_by_two);
  EXPECT_EQ(tensor_order_of("lower"), TensorOrder::lower_triangle);
  for (const std::string& name : tensor_order_names()) EXPECT_NO_THROW(tensor_order_of(name));
}

TEST(TensorOrder, UnknownNamesAreErrorsThatListTheKnown) {
  for (const std::string name : {"abaqus", "", "VTK"}) try {
      tensor_order_of(name);
      ADD_FAILURE() << name;
    } catch (const std::invalid_argument& error) {
      EXPECT_EQ(std::string(error.what()),
                "--order: unknown order \"" + name + "\"; there are vtk, fsl, mrtrix, voigt, lower, plane, 2x2");
    }
}

}  // namespace
}  // namespace tensorray
