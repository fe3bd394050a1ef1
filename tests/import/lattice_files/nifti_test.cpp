#include <algorithm>
#include <random>

#include <nifti1.h>
#include <nifti2.h>

#include "base/process/progress.h"
#include "tests/import/voxel_support.h"
#include "tools/import/import_file.h"
#include "tools/import/lattice_files/lattice_files.h"

namespace tensorray {
namespace {

using Eigen::Affine3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3i;

/// A header of four axes, single precision, with a sform.
nifti_1_header header_of(const Vector3i& size, int volumes, const Affine3d& to_world) {
  nifti_1_header header{};
  header.sizeof_hdr = 348;
  const int dim[] = {4, size.x(), size.y(), size.z(), volumes, 1, 1, 1};
  for (int i = 0; i < 8; ++i) header.dim[i] = static_cast<short>(dim[i]), header.pixdim[i] = 1;
  header.datatype = DT_FLOAT32;
  header.bitpix = 32;
  header.vox_offset = 352;
  header.xyzt_units = NIFTI_UNITS_MM;
  header.sform_code = NIFTI_XFORM_SCANNER_ANAT;
  for (int i = 0; i < 4; ++i) {
    header.srow_x[i] = static_cast<float>(to_world(0, i));
    header.srow_y[i] = static_cast<float>(to_world(1, i));
    header.srow_z[i] = static_cast<float>(to_world(2, i));
  }
  std::memcpy(header.magic, "n+1", 4);
  return header;
}

template <class Header>
std::string file_of(const Header& header, const std::string& numbers) {
  return std::string(reinterpret_cast<const char*>(&header), sizeof header) + std::string(4, '\0') + numbers;
}

std::vector<float> fsl(const Matrix3d& t) {
  std::vector<float> six;
  for (const double c : {t(0, 0), t(0, 1), t(0, 2), t(1, 1), t(1, 2), t(2, 2)}) six.push_back(static_cast<float>(c));
  return six;
}

/// The values of `components(index)`, volume by volume, as the format stores them.
std::string volumes_of(const Vector3i& size, const std::function<std::vector<float>(const Vector3i&)>& components) {
  std::vector<float> numbers;
  for (std::size_t c = 0; c < components(Vector3i::Zero()).size(); ++c)
    for (int z = 0; z < size.z(); ++z)
      for (int y = 0; y < size.y(); ++y)
        for (int x = 0; x < size.x(); ++x) numbers.push_back(components({x, y, z})[c]);
  return test::bytes_of(numbers);
}

/// Reads a file whose voxels all have one tensor, and returns that tensor.
Matrix3d read_one(const nifti_1_header& header, const std::vector<float>& components, const std::string& order) {
  const Vector3i size(header.dim[1], header.dim[2], header.dim[3]);
  const test::TemporaryFile file("one.nii",
                                 file_of(header, volumes_of(size, [&](const Vector3i&) { return components; })));
  const TensorGrid grid = test::tensors_of(open_nifti(file), order);
  const Eigen::Matrix3f* tensor = test::voxel(grid, {0, 0, 0});
  return tensor ? Matrix3d(tensor->cast<double>()) : Matrix3d(Matrix3d::Constant(NAN));
}

/// Oblique and anisotropic; the determinant is negative if `sign` is −1.
Affine3d oblique(double sign) {
  Affine3d transform = Affine3d::Identity();
  transform.linear() = test::rotation() * Vector3d(sign * 2, 1.5, 3).asDiagonal();
  transform.translation() = Vector3d(-10, 20, 30);
  return transform;
}

const Matrix3d flip_x = Vector3d(-1, 1, 1).asDiagonal();

TEST(Nifti, BrainHasItsFacts) {
  const auto path = test::data_file("brain_dti/tensorLAS.nii.gz");
  TENSORRAY_NEEDS(path);
  const Lattice lattice = open_nifti(path);
  EXPECT_EQ(lattice.size, Vector3i(96, 96, 50));
  EXPECT_LT(lattice.to_world.linear().determinant(), 0);
  EXPECT_NEAR(lattice.to_world.linear().col(1).norm(), 2.5, 0.01);
  EXPECT_NEAR(lattice.to_world.translation().x(), 121.264, 1e-3);
  LatticeReport report;
  const TensorGrid grid = tensors_of(lattice, TensorOrder::fsl, report);
  EXPECT_EQ(report.active, 93524u);
  EXPECT_EQ(report.background, 96u * 96 * 50 - 93524);
  EXPECT_EQ(report.non_finite, 0u);
  const test::Spectrum spectrum = test::spectrum_of(grid);
  EXPECT_NEAR(spectrum.least, -4.9e-3, 5e-5);
  EXPECT_NEAR(spectrum.greatest, 5.5e-3, 5e-5);
  EXPECT_EQ(spectrum.negative, 864);
}

TEST(Nifti, FibresOfTheBrainGoOnInTheFrameOfFsl) {
  const auto path = test::data_file("brain_dti/tensorLAS.nii.gz");
  TENSORRAY_NEEDS(path);
  const TensorGrid grid = test::tensors_of(open_nifti(path), "fsl");
  const int right = test::coherence(grid, Matrix3d::Identity(), 4);
  EXPECT_GT(right, 5000);
  for (int axis = 0; axis < 3; ++axis) {
    Matrix3d flipped = Matrix3d::Identity();
    flipped(axis, axis) = -1;
    EXPECT_GT(right, 1.15 * test::coherence(grid, flipped, 4)) << axis;
  }
}

TEST(Nifti, CropOfMrtrixHasItsFactsAndAsksForItsOrder) {
  const auto path = test::data_file("dmri_crop/tensor.nii.gz");
  TENSORRAY_NEEDS(path);
  test::expect_error([&] { test::tensors_of(open_nifti(path)); }, {"--order"});
  const TensorGrid grid = test::tensors_of(open_nifti(path), "mrtrix");
  EXPECT_EQ(grid.active_voxels(), 16u * 16 * 5);
  EXPECT_TRUE(grid.to_world.matrix().isIdentity());
  const test::Spectrum spectrum = test::spectrum_of(grid);
  EXPECT_NEAR(spectrum.least, 1.5e-4, 5e-6);
  EXPECT_NEAR(spectrum.greatest, 1.7e-3, 5e-5);
  EXPECT_EQ(spectrum.negative, 0);
  EXPECT_GT(test::spectrum_of(test::tensors_of(open_nifti(path), "fsl")).negative, 0);
}

TEST(Nifti, ComponentsOfMrtrixAreInWorldAxes) {
  const Matrix3d t = test::symmetric_tensor();
  std::vector<float> six;
  for (const double c : {t(0, 0), t(1, 1), t(2, 2), t(0, 1), t(0, 2), t(1, 2)}) six.push_back(static_cast<float>(c));
  for (const double sign : {-1.0, 1.0})
    EXPECT_LT((read_one(header_of({2, 2, 2}, 6, oblique(sign)), six, "mrtrix") - t).norm(), 1e-6);
}

TEST(Nifti, ComponentsOfFslTurnWithTheImageAndItsConvention) {
  const Matrix3d t = test::symmetric_tensor(), turn = test::rotation();
  // In both cases FSL's first axis makes the frame left-handed.
  const Matrix3d frame = turn * flip_x, expected = frame * t * frame.transpose();
  for (const double sign : {-1.0, 1.0})
    EXPECT_LT((read_one(header_of({2, 2, 2}, 6, oblique(sign)), fsl(t), "fsl") - expected).norm(), 1e-5);
}

TEST(Nifti, PrincipalDirectionsTurnWithAnObliqueTransform) {
  const Matrix3d t = Vector3d(1, 3, 2).asDiagonal();
  const Matrix3d found = read_one(header_of({1, 1, 1}, 6, oblique(1)), fsl(t), "fsl");
  const Vector3d major = Eigen::SelfAdjointEigenSolver<Matrix3d>(found).eigenvectors().col(2);
  EXPECT_NEAR(std::abs(major.dot(test::rotation().col(1))), 1, 1e-6);
}

TEST(Nifti, AnImageStoredFromTheOtherSideIsTheSameField) {
  const Vector3i size(5, 3, 2);
  const auto tensor = [](const Vector3i& i) { return Matrix3d(test::symmetric_tensor() * (1 + i.x() + 5 * i.y())); };
  const Affine3d to_world = oblique(-1);
  Affine3d reversed = to_world;
  reversed.linear().col(0) *= -1;
  reversed.translation() = to_world * Vector3d(size.x() - 1, 0, 0);
  const test::TemporaryFile a("las.nii", file_of(header_of(size, 6, to_world),
                                                 volumes_of(size, [&](const Vector3i& i) { return fsl(tensor(i)); })));
  const test::TemporaryFile b("ras.nii", file_of(header_of(size, 6, reversed), volumes_of(size, [&](const Vector3i& i) {
                                                   return fsl(tensor({size.x() - 1 - i.x(), i.y(), i.z()}));
                                                 })));
  const TensorGrid las = test::tensors_of(open_nifti(a), "fsl"), ras = test::tensors_of(open_nifti(b), "fsl");
  test::for_each_voxel(las, [&](const Vector3i& index, const Matrix3d& found) {
    const Vector3i other(size.x() - 1 - index.x(), index.y(), index.z());
    EXPECT_LT((las.to_world * index.cast<double>() - ras.to_world * other.cast<double>()).norm(), 1e-4);
    test::expect_near(found, test::voxel(ras, other), 1e-5);
  });
}

TEST(Nifti, AMirroredImageIsTheMirroredField) {
  // A head mirrored left to right in the same storage, as a scanner would measure it: the voxels along x are
  // reversed, and the components with a single index x are negated.
  const Vector3i size(5, 3, 2);
  Affine3d to_world = Affine3d::Identity();
  to_world.linear() = Vector3d(-2, 2, 2).asDiagonal();
  to_world.translation() = Vector3d(4, 0, 0);  // Symmetric about x = 0.
  const auto tensor = [](const Vector3i& i) { return Matrix3d(test::symmetric_tensor() * (1 + i.x() + 5 * i.y())); };
  const test::TemporaryFile a("head.nii", file_of(header_of(size, 6, to_world),
                                                  volumes_of(size, [&](const Vector3i& i) { return fsl(tensor(i)); })));
  const test::TemporaryFile b("mirrored.nii",
                              file_of(header_of(size, 6, to_world), volumes_of(size, [&](const Vector3i& i) {
                                        const Vector3i other(size.x() - 1 - i.x(), i.y(), i.z());
                                        return fsl(flip_x * tensor(other) * flip_x);
                                      })));
  const TensorGrid head = test::tensors_of(open_nifti(a), "fsl"), mirrored = test::tensors_of(open_nifti(b), "fsl");
  test::for_each_voxel(head, [&](const Vector3i& index, const Matrix3d& found) {
    const Vector3d there = flip_x * (head.to_world * index.cast<double>());
    const Vector3i other = (mirrored.to_world.inverse() * there).array().round().cast<int>();
    test::expect_near(flip_x * found * flip_x, test::voxel(mirrored, other));
  });
}

TEST(Nifti, SymmetricMatricesByIntentAreLowerTriangles) {
  nifti_1_header header = header_of({1, 1, 1}, 1, Affine3d::Identity());
  header.dim[0] = 5;
  header.dim[5] = 6;
  header.intent_code = NIFTI_INTENT_SYMMATRIX;
  const Matrix3d expected = (Matrix3d() << 11, 12, 13, 12, 22, 23, 13, 23, 33).finished();
  EXPECT_EQ(read_one(header, {11, 12, 22, 13, 23, 33}, ""), expected);
}

TEST(Nifti, NineVolumesAreRows) {
  const Matrix3d expected = (Matrix3d() << 11, 12, 13, 21, 22, 23, 31, 32, 33).finished();
  EXPECT_EQ(read_one(header_of({1, 1, 1}, 9, oblique(1)), {11, 12, 13, 21, 22, 23, 31, 32, 33}, ""), expected);
}

TEST(Nifti, ThreeVolumesAreAVector) {
  const Vector3i size(4, 4, 4);
  const test::TemporaryFile file("vector.nii", file_of(header_of(size, 3, Affine3d::Identity()),
                                                       volumes_of(size, [](const Vector3i& i) -> std::vector<float> {
                                                         return {1, static_cast<float>(3 * i.x()), 0};
                                                       })));
  LatticeReport report;
  const TensorGrid grid = gradient_of(open_nifti(file), report);
  Matrix3d expected = Matrix3d::Zero();
  expected(1, 0) = 3;
  test::expect_near(expected, test::voxel(grid, {2, 2, 2}));
  test::expect_error([&] { test::tensors_of(open_nifti(file)); }, {"--gradient-of"});
}

TEST(Nifti, DisplacementsOfItkAreInLps) {
  const Vector3i size(4, 4, 4);
  const test::TemporaryFile file("warp.nii", file_of(header_of(size, 3, Affine3d::Identity()),
                                                     volumes_of(size, [](const Vector3i& i) -> std::vector<float> {
                                                       const Eigen::Vector3f at = i.cast<float>();
                                                       return {2 * at.y(), 3 * at.x(), 5 * at.x() + 1};
                                                     })));
  ImportSettings settings;
  settings.files = {file};
  settings.take = Take::gradient;
  settings.frame = ComponentFrame::lps;
  ImportReport report;
  Matrix3d expected = Matrix3d::Zero();
  expected(0, 1) = -2;
  expected(1, 0) = -3;
  expected(2, 0) = 5;
  test::expect_near(expected, test::voxel(import_tensors(settings, Progress(), report), {2, 2, 2}));
}

/// A transform stored from left to right or from right to left, the six components of one tensor in the order, and the
/// flags. What must come out, in RAS.
struct FrameCase {
  std::string name;
  bool by_intent = false;
  double first_axis = -2;  ///< Of the affine diag(., 2, 3).
  std::optional<TensorOrder> order;
  std::optional<ComponentFrame> frame;
  double sign = 1;  ///< Of xy and xz in RAS.
};

TEST(Nifti, TheFrameAndTheOrderAreTwoThings) {
  using Order = TensorOrder;
  using Frame = ComponentFrame;
  const std::vector<float> lower = {1, 0.2f, 0.6f, 0.1f, 0.05f, 0.3f}, upper = {1, 0.2f, 0.1f, 0.6f, 0.05f, 0.3f};
  const std::vector<FrameCase> cases = {
      {"intent alone: voxels", true, -2, {}, {}, -1},
      {"intent alone, other side", true, 2, {}, {}, 1},
      {"intent, voxels", true, -2, {}, Frame::voxels, -1},
      {"intent, fsl", true, -2, {}, Frame::fsl, -1},
      {"intent, fsl, other side: its flip", true, 2, {}, Frame::fsl, -1},
      {"intent, ras", true, -2, {}, Frame::ras, 1},
      {"intent, lps", true, -2, {}, Frame::lps, 1},  // the signs of xy cancel; xz changes, see below
      {"intent and its order", true, -2, Order::lower_triangle, {}, -1},
      {"lower alone: voxels", false, -2, Order::lower_triangle, {}, -1},
      {"lower, ras", false, -2, Order::lower_triangle, Frame::ras, 1},
      {"lower, fsl, other side", false, 2, Order::lower_triangle, Frame::fsl, -1},
      {"fsl alone", false, -2, Order::fsl, {}, -1},
      {"fsl alone, other side", false, 2, Order::fsl, {}, -1},
      {"order of fsl in voxels", false, 2, Order::fsl, Frame::voxels, 1},
      {"order of fsl in ras", false, -2, Order::fsl, Frame::ras, 1},
  };
  for (const FrameCase& one : cases) {
    const Affine3d to_world(Eigen::Scaling(one.first_axis, 2.0, 3.0));
    nifti_1_header header = header_of({1, 1, 1}, one.by_intent ? 1 : 6, to_world);
    if (one.by_intent) header.dim[0] = 5, header.dim[5] = 6, header.intent_code = NIFTI_INTENT_SYMMATRIX;
    const bool is_lower = one.by_intent || one.order == Order::lower_triangle;
    const test::TemporaryFile file("frame.nii", file_of(header, test::bytes_of(is_lower ? lower : upper)));
    ImportSettings settings;
    settings.files = {file};
    settings.order = one.order;
    settings.frame = one.frame;
    ImportReport report;
    const TensorGrid grid = import_tensors(settings, Progress(), report);
    const double xz = one.frame == Frame::lps ? -one.sign : one.sign, yz = one.frame == Frame::lps ? -1 : 1;
    Matrix3d expected;
    expected << 1, 0.2 * one.sign, 0.1 * xz, 0.2 * one.sign, 0.6, 0.05 * yz, 0.1 * xz, 0.05 * yz, 0.3;
    SCOPED_TRACE(one.name);
    test::expect_near(expected, test::voxel(grid, {0, 0, 0}));
    EXPECT_EQ(!report.lattice->notes.empty(), one.by_intent && !one.frame);
  }
}

TEST(Nifti, AnotherOrderThanThatOfTheIntentIsAnErrorThatNamesTheFrame) {
  nifti_1_header header = header_of({1, 1, 1}, 1, Affine3d::Identity());
  header.dim[0] = 5, header.dim[5] = 6, header.intent_code = NIFTI_INTENT_SYMMATRIX;
  const test::TemporaryFile file("intent.nii", file_of(header, test::bytes_of(std::vector<float>(6, 1))));
  test::expect_error([&] { test::tensors_of(open_nifti(file), "fsl"); }, {"--order", "--frame"});
}

TEST(Nifti, FilesWithoutAnOrientationAreTakenAsFslTakesAnalyze) {
  nifti_1_header header = header_of({2, 1, 1}, 6, Affine3d::Identity());
  header.sform_code = 0;
  header.pixdim[1] = 2, header.pixdim[2] = 3, header.pixdim[3] = 4;
  const std::vector<float> two = {1, 1, 0.2f, 0.2f, 0.1f, 0.1f, 0.6f, 0.6f, 0.05f, 0.05f, 0.3f, 0.3f};
  const test::TemporaryFile file("no_form.nii", file_of(header, test::bytes_of(two)));
  LatticeReport report;
  const TensorGrid grid = tensors_of(open_nifti(file), TensorOrder::fsl, report);
  EXPECT_EQ(grid.to_world.matrix(), Affine3d(Eigen::Scaling(-2.0, 3.0, 4.0)).matrix());
  ASSERT_EQ(report.notes.size(), 1u);
  EXPECT_NE(report.notes[0].find("sform"), std::string::npos);
  // FSL does not flip such an image: the components are in the axes of the voxels, of which the first one points left.
  test::expect_near((Matrix3d() << 1, -0.2, -0.1, -0.2, 0.6, 0.05, -0.1, 0.05, 0.3).finished(),
                    test::voxel(grid, {1, 0, 0}));
}

TEST(Nifti, SlopeAndInterceptAreApplied) {
  nifti_1_header header = header_of({1, 1, 1}, 6, Affine3d::Identity());
  header.scl_slope = 0.5;
  header.scl_inter = 2;
  const std::vector<float> six = {2, 4, 6, 0, 0, 0};
  EXPECT_EQ(read_one(header, six, "mrtrix"), (Matrix3d() << 3, 2, 2, 2, 4, 2, 2, 2, 5).finished());
  header.scl_slope = NAN;
  EXPECT_EQ(read_one(header, six, "mrtrix"), Matrix3d(Vector3d(2, 4, 6).asDiagonal()));
}

TEST(Nifti, TransformIsSformThenQformThenVoxelSizesInMillimetres) {
  nifti_1_header header = header_of({1, 1, 1}, 6, oblique(1));
  header.pixdim[1] = 2, header.pixdim[2] = 3, header.pixdim[3] = 4;
  header.qform_code = NIFTI_XFORM_SCANNER_ANAT;
  header.quatern_d = 1;  // Half a turn about z.
  header.qoffset_x = 7;
  const auto transform = [&] {
    const test::TemporaryFile file("transform.nii", file_of(header, test::bytes_of(std::vector<float>(6, 1))));
    return open_nifti(file).to_world.matrix();
  };
  EXPECT_LT((transform() - oblique(1).matrix()).norm(), 1e-5);
  header.sform_code = 0;
  Eigen::Matrix4d expected = Eigen::Vector4d(-2, -3, 4, 1).asDiagonal();
  expected(0, 3) = 7;
  EXPECT_LT((transform() - expected).norm(), 1e-5);
  header.qform_code = 0;
  EXPECT_LT((transform() - Eigen::Matrix4d(Eigen::Vector4d(-2, 3, 4, 1).asDiagonal())).norm(), 1e-5);
  header.xyzt_units = NIFTI_UNITS_METER;
  EXPECT_LT((transform() - Eigen::Matrix4d(Eigen::Vector4d(-2000, 3000, 4000, 1).asDiagonal())).norm(), 1e-2);
}

TEST(Nifti, NotANumberIsInactiveAndNotZero) {
  const Vector3i size(2, 1, 1);
  const test::TemporaryFile file(
      "nan.nii", file_of(header_of(size, 6, Affine3d::Identity()), volumes_of(size, [](const Vector3i& i) {
                           return std::vector<float>{1, 0, i.x() ? NAN : 0.0f, 2, 0, 3};
                         })));
  LatticeReport report;
  tensors_of(open_nifti(file), TensorOrder::fsl, report);
  EXPECT_EQ(report.active, 1u);
  EXPECT_EQ(report.non_finite, 1u);
}

TEST(Nifti, IntegersOfTheOtherByteOrderAndTwoFilesAreRead) {
  nifti_1_header header = header_of({2, 1, 1}, 6, Affine3d::Identity());
  header.datatype = DT_INT16;
  header.bitpix = 16;
  header.vox_offset = 0;
  std::memcpy(header.magic, "ni1", 4);
  const auto swap = [](auto& number) {
    auto* bytes = reinterpret_cast<char*>(&number);
    std::reverse(bytes, bytes + sizeof number);
  };
  for (short& extent : header.dim) swap(extent);
  for (float& size : header.pixdim) swap(size);
  for (float* row : {header.srow_x, header.srow_y, header.srow_z})
    for (int i = 0; i < 4; ++i) swap(row[i]);
  swap(header.sizeof_hdr), swap(header.datatype), swap(header.bitpix), swap(header.sform_code);
  std::vector<std::int16_t> numbers = {1, 258, 0, 0, 0, 0, 2, 2, 0, 0, 3, 3};
  for (std::int16_t& number : numbers) swap(number);
  const test::TemporaryFile head("pair.hdr", file_of(header, "")), image("pair.img", test::bytes_of(numbers));
  for (const auto* const path : {&head, &image}) {
    const std::filesystem::path& either = *path;
    const TensorGrid grid = test::tensors_of(open_nifti(either), "fsl");
    test::expect_near(Vector3d(258, 2, 3).asDiagonal(), test::voxel(grid, {1, 0, 0}));
    ImportSettings settings;
    settings.files = {either};
    settings.order = TensorOrder::fsl;
    settings.frame = ComponentFrame::voxels;
    EXPECT_EQ(time_steps(settings), 1);
    ImportReport report;
    EXPECT_EQ(import_tensors(settings, Progress(), report).active_voxels(), 2u);
  }
  std::filesystem::remove(image);
  test::expect_error([&] { open_nifti(head); }, {"pair.hdr", ".img"});
}

TEST(Nifti, SecondVersionIsRead) {
  nifti_2_header header{};
  header.sizeof_hdr = 540;
  const std::int64_t dim[] = {4, 1, 1, 1, 6, 1, 1, 1};
  for (int i = 0; i < 8; ++i) header.dim[i] = dim[i], header.pixdim[i] = 1;
  header.datatype = DT_FLOAT64;
  header.bitpix = 64;
  header.vox_offset = 544;
  std::memcpy(header.magic, "n+2\0\r\n\032\n", 8);
  const std::vector<double> six = {1, 0, 0, 2, 0, 3};
  const test::TemporaryFile file("second.nii", file_of(header, test::bytes_of(six)));
  const TensorGrid grid = test::tensors_of(open_nifti(file), "fsl");
  test::expect_near(Vector3d(1, 2, 3).asDiagonal(), test::voxel(grid, {0, 0, 0}));
  header.dim[1] = header.dim[2] = header.dim[3] = std::int64_t{1} << 40;
  file.write(file_of(header, test::bytes_of(six)));
  test::expect_error([&] { open_nifti(file); }, {"second.nii"});
}

TEST(Nifti, WrongFilesAreErrorsOfOneLine) {
  const nifti_1_header good = header_of({4, 4, 4}, 6, Affine3d::Identity());
  const std::string numbers(4 * 4 * 4 * 6 * 4, '\1');
  const auto expect = [&](const std::string& contents, const std::vector<std::string>& words) {
    const test::TemporaryFile file("wrong.nii", contents);
    std::vector<std::string> all = {"wrong.nii"};
    all.insert(all.end(), words.begin(), words.end());
    test::expect_error([&] { open_nifti(file); }, all);
  };
  test::expect_error([] { open_nifti("absent.nii"); }, {"absent.nii", "no such file"});
  expect("", {"not a NIfTI"});
  expect("NRRD0004\ntype: float\n", {"not a NIfTI"});
  expect("<nifti_image\n", {"not a NIfTI"});
  expect(file_of(good, numbers).substr(0, 200), {"NIfTI"});
  expect(file_of(good, numbers.substr(1)), {"cut off"});
  nifti_1_header header = good;
  header.dim[4] = 7;
  expect(file_of(header, numbers), {"4 x 4 x 4 x 7", "six or nine"});
  header = good;
  header.dim[1] = header.dim[2] = header.dim[3] = 32767;
  expect(file_of(header, numbers), {"announces", "cut off"});
  header = good;
  header.dim[2] = -4;
  expect(file_of(header, numbers), {});
  header = good;
  header.datatype = DT_RGB24, header.bitpix = 24;
  expect(file_of(header, numbers), {"RGB24"});
  header = good;
  std::memset(header.srow_y, 0, sizeof header.srow_y);
  expect(file_of(header, numbers), {"sform", "inverted"});
  header.srow_y[1] = NAN;
  expect(file_of(header, numbers), {"sform"});
  header = good;
  header.vox_offset = 1e9f;
  expect(file_of(header, numbers), {});
}

TEST(Nifti, CompressedFilesThatAreCutOffOrDamagedAreErrors) {
  const auto path = test::data_file("brain_dti/tensorLAS.nii.gz");
  TENSORRAY_NEEDS(path);
  const std::string contents = test::contents_of(path);
  const test::TemporaryFile file("cut.nii.gz", contents.substr(0, contents.size() / 2));
  test::expect_error([&] { open_nifti(file); }, {"cut.nii.gz", "cut off"});
  std::string damaged = contents;
  for (std::size_t i = 100000; i < 100100; ++i) damaged[i] = static_cast<char>(~damaged[i]);
  file.write(damaged);
  test::expect_error([&] { open_nifti(file); }, {"cut.nii.gz"});
}

TEST(Nifti, GarbledHeadersNeverCrash) {
  const nifti_1_header header = header_of({4, 4, 4}, 6, Affine3d::Identity());
  const std::string good = file_of(header, std::string(4 * 4 * 4 * 6 * 4, '\1'));
  std::mt19937 random(1);
  const test::TemporaryFile file("garbled.nii");
  for (int i = 0; i < 500; ++i) {
    std::string bad = good;
    for (int n = 0; n < 1 + i % 5; ++n) bad[random() % 352] = static_cast<char>(random());
    file.write(bad);
    try {
      test::tensors_of(open_nifti(file), "fsl");
    } catch (const std::exception& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace tensorray
