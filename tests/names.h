#pragma once
/// What all tests have precompiled (CMakeLists.txt): GoogleTest, GoogleMock, Eigen, and what half of the tests use of
/// the standard library, with the names that they use all the time. The headers that tests share include it.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <gmock/gmock.h>

namespace tensorray {

using Eigen::Affine3d, Eigen::AlignedBox3d, Eigen::AlignedBox3i;
using Eigen::Matrix2d, Eigen::Matrix3d, Eigen::Matrix3f;
using Eigen::Vector2d, Eigen::Vector2i, Eigen::Vector3d, Eigen::Vector3f, Eigen::Vector3i, Eigen::Vector4f;
using testing::AllOf, testing::Contains, testing::ElementsAre, testing::EndsWith, testing::HasSubstr, testing::IsEmpty;
using testing::Not, testing::StartsWith, testing::ThrowsMessage;

}  // namespace tensorray
