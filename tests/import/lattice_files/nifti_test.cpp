#include <Eigen/Eigenvalues>
#include <nifti1.h>
#include <nifti2.h>

#include "tests/import/imported.h"
#include "tests/import/voxel_support.h"
#include "tools/import/lattice_files/lattice_files.h"

namespace tensorray {
namespace {

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
  float* const rows[] = {header.srow_x, header.srow_y, header.srow_z};
  for (int i = 0; i < 12; ++i) rows[i / 4][i % 4] = static_cast<float>(to_world(i / 4, i % 4));
  std::memcpy(header.magic, "n+1", 4);
  return header;
}

template <class Header>
std::string file_of(const Header& header, const std::string& numbers) {
  return std::string(reinterpret_cast<const char*>(&header), sizeof header) + std::string(4, '\0') + numbers;
}

/// A file whose voxels all have these components: volume by volume, as the format stores them.
std::string uniform_file(const nifti_1_header& header, const std::vector<float>& components) {
  std::vector<float> numbers;
  for (const float component : components)
    numbers.insert(numbers.end(), header.dim[1] * header.dim[2] * header.dim[3], component);
  return file_of(header, test::bytes_of(numbers));
}

/// Reads a file whose voxels all have one tensor, and returns that tensor.
Matrix3d read_one(const nifti_1_header& header, const std::vector<float>& components, TensorOrder order) {
  const Temporary file("one.nii", uniform_file(header, components));
  return test::first_tensor(test::tensors_of(open_nifti(file), order));
}

/// Oblique and anisotropic; the determinant is negative if `sign` is −1.
Affine3d oblique(double sign) {
  return Eigen::Translation3d(-10, 20, 30) * test::rotation() * Eigen::Scaling(sign * 2, 1.5, 3.0);
}

const Matrix3d flip_x = Vector3d(-1, 1, 1).asDiagonal();

/// dipy's quadratic form, as nibabel writes an array (X, Y, Z, 3, 3): by columns, in the axes of the voxels.
TEST(Nifti, MatricesAlongTwoAxesAreInTheAxesOfTheVoxelsAndItIsSaid) {
  const Matrix3d T = (Matrix3d() << 1, 2, 3, 4, 5, 6, 7, 8, 10).finished();
  for (const double sign : {1, -1}) {
    const Affine3d transform = oblique(sign);
    nifti_1_header header = header_of({2, 3, 2}, 3, transform);
    header.dim[0] = 5, header.dim[5] = 3;
    const Temporary file("five.nii", uniform_file(header, test::rows(T.transpose())));
    const Matrix3d F = axes_of(ComponentFrame::voxels, transform.linear());
    for (const bool is_ras : {false, true}) {
      Lattice lattice = open_nifti(file);
      if (is_ras) take_frame(lattice, ComponentFrame::ras);
      LatticeReport report;
      const TensorGrid grid = tensors_of(lattice, {}, report);
      const Matrix3d expected = is_ras ? T : Matrix3d(F * T * F.transpose());
      for (const Vector3i& index : {Vector3i(0, 0, 0), Vector3i(1, 2, 1)})
        EXPECT_LT((find(grid, index)->cast<double>() - expected).norm(), 1e-5) << sign << is_ras;
      EXPECT_EQ(report.notes.size(), is_ras ? 0u : 1u);
    }
  }
}

TEST(Nifti, BrainHasItsFacts) {
  const auto path = data_file("brain_dti/tensorLAS.nii.gz");
  SKIP_WITHOUT(path);
  const Lattice lattice = open_nifti(path);
  EXPECT_EQ(lattice.size, Vector3i(96, 96, 50));
  EXPECT_TRUE(lattice.is_anatomical);
  EXPECT_LT(lattice.to_world.linear().determinant(), 0);
  EXPECT_NEAR(lattice.to_world.linear().col(1).norm(), 2.5, 0.01);
  EXPECT_NEAR(lattice.to_world.translation().x(), 121.264, 1e-3);
  LatticeReport report;
  const TensorGrid grid = tensors_of(lattice, TensorOrder::fsl, report);
  EXPECT_EQ(report.active, 93524u);
  EXPECT_EQ(report.background, 96u * 96 * 50 - 93524);
  EXPECT_EQ(report.non_finite, 0u);
  float least = INFINITY, greatest = -INFINITY;
  for_each_active(grid, [&](const Vector3i&, const Matrix3f& tensor) {
    const Vector3f values = tensor.selfadjointView<Eigen::Lower>().eigenvalues();
    least = std::min(least, values.minCoeff());
    greatest = std::max(greatest, values.maxCoeff());
  });
  EXPECT_NEAR(least, -4.9e-3, 5e-5);
  EXPECT_NEAR(greatest, 5.5e-3, 5e-5);
}

TEST(Nifti, ComponentsOfFslTurnWithTheImageAndItsConvention) {
  const Matrix3d t = test::symmetric_tensor(), turn = test::rotation();
  // In both cases FSL's first axis makes the frame left-handed.
  const Matrix3d frame = turn * flip_x, expected = frame * t * frame.transpose();
  for (const double sign : {-1.0, 1.0}) {
    const nifti_1_header header = header_of({2, 2, 2}, 6, oblique(sign));
    EXPECT_LT((read_one(header, test::upper_triangle(t), TensorOrder::fsl) - expected).norm(), 1e-5) << sign;
  }
}

/// A transform stored from left to right or from right to left, the six components of one tensor, and what is asked
/// for.
struct FrameCase {
  std::string name;
  double first_axis = -2;            ///< Of the affine diag(., 2, 3).
  std::optional<TensorOrder> order;  ///< None: the file's intent tells it.
  std::optional<ComponentFrame> frame;
  double sign = 1;  ///< Of xy and xz in RAS.
};

TEST(Nifti, TheFrameAndTheOrderAreTwoThings) {
  using Order = TensorOrder;
  using Frame = ComponentFrame;
  const std::vector<float> lower = {1, 0.2f, 0.6f, 0.1f, 0.05f, 0.3f}, upper = {1, 0.2f, 0.1f, 0.6f, 0.05f, 0.3f};
  const std::vector<FrameCase> cases = {
      {"intent alone: voxels", -2, {}, {}, -1},
      {"intent alone, other side", 2, {}, {}, 1},
      {"intent, fsl", -2, {}, Frame::fsl, -1},
      {"intent, fsl, other side: its flip", 2, {}, Frame::fsl, -1},
      {"intent, ras", -2, {}, Frame::ras, 1},
      {"intent, lps", -2, {}, Frame::lps, 1},  // the signs of xy cancel; xz changes, see below
      {"lower alone: voxels", -2, Order::lower_triangle, {}, -1},
      {"lower, ras", -2, Order::lower_triangle, Frame::ras, 1},
      {"lower, fsl, other side", 2, Order::lower_triangle, Frame::fsl, -1},
      {"fsl alone", -2, Order::fsl, {}, -1},
      {"fsl alone, other side", 2, Order::fsl, {}, -1},
      {"order of fsl in voxels", 2, Order::fsl, Frame::voxels, 1},
      {"order of fsl in ras", -2, Order::fsl, Frame::ras, 1},
  };
  for (const FrameCase& one : cases) {
    const Affine3d to_world(Eigen::Scaling(one.first_axis, 2.0, 3.0));
    nifti_1_header header = header_of({1, 1, 1}, one.order ? 6 : 1, to_world);
    if (!one.order) header.dim[0] = 5, header.dim[5] = 6, header.intent_code = NIFTI_INTENT_SYMMATRIX;
    const bool is_lower = !one.order || one.order == Order::lower_triangle;
    const Temporary file("frame.nii", file_of(header, test::bytes_of(is_lower ? lower : upper)));
    ImportSettings settings;
    settings.order = one.order;
    settings.frame = one.frame;
    const auto [grid, report] = imported(file, settings);
    const double xz = one.frame == Frame::lps ? -one.sign : one.sign, yz = one.frame == Frame::lps ? -1 : 1;
    SCOPED_TRACE(one.name);
    test::expect_near(test::symmetric({1, 0.2 * one.sign, 0.1 * xz, 0.6, 0.05 * yz, 0.3}), find(grid, {0, 0, 0}));
    EXPECT_EQ(!report.lattice->notes.empty(), !one.order && !one.frame);
  }
}

TEST(Nifti, FilesWithoutAnOrientationAreTakenAsFslTakesAnalyze) {
  nifti_1_header header = header_of({2, 1, 1}, 6, Affine3d::Identity());
  header.sform_code = 0;
  header.pixdim[1] = 2, header.pixdim[2] = 3, header.pixdim[3] = 4;
  const std::vector<float> two = {1, 1, 0.2f, 0.2f, 0.1f, 0.1f, 0.6f, 0.6f, 0.05f, 0.05f, 0.3f, 0.3f};
  const Temporary file("no_form.nii", file_of(header, test::bytes_of(two)));
  LatticeReport report;
  const TensorGrid grid = tensors_of(open_nifti(file), TensorOrder::fsl, report);
  EXPECT_EQ(grid.to_world.matrix(), Affine3d(Eigen::Scaling(-2.0, 3.0, 4.0)).matrix());
  EXPECT_THAT(report.notes, ElementsAre(HasSubstr("sform")));
  // FSL does not flip such an image: the components are in the axes of the voxels, of which the first one points left.
  test::expect_near(test::symmetric({1, -0.2, -0.1, 0.6, 0.05, 0.3}), find(grid, {1, 0, 0}));
}

/// Of nine components and of vectors, nothing tells the axes; no tensor can be made of eigenvectors.
TEST(Nifti, GuessesAreSaidAndEigenvectorsAreRefused) {
  const auto note_of = [](const std::vector<float>& components) {
    const nifti_1_header header = header_of({2, 2, 2}, static_cast<int>(components.size()), Affine3d::Identity());
    const Temporary file("guess.nii", uniform_file(header, components));
    LatticeReport report;
    tensors_of(open_nifti(file), std::nullopt, report);
    return report.notes.empty() ? "" : report.notes[0];
  };
  EXPECT_THAT(note_of(std::vector<float>(9, 1)), HasSubstr("taken as those of the scanner (RAS); --frame"));
  test::expect_error([&] { note_of({0.6f, 0, -0.8f}); }, {"vectors of length 1", "dti_V1", "--save_tensor"});
  test::expect_error([&] { note_of({0.6f, 0, -0.7f}); }, {"derive a tensor (--gradient-of)"});
}

TEST(Nifti, SlopeAndInterceptAreApplied) {
  nifti_1_header header = header_of({1, 1, 1}, 6, Affine3d::Identity());
  header.scl_slope = 0.5;
  header.scl_inter = 2;
  const std::vector<float> six = {2, 4, 6, 0, 0, 0};
  EXPECT_EQ(read_one(header, six, TensorOrder::mrtrix), (Matrix3d() << 3, 2, 2, 2, 4, 2, 2, 2, 5).finished());
  header.scl_slope = NAN;
  EXPECT_EQ(read_one(header, six, TensorOrder::mrtrix), Matrix3d(Vector3d(2, 4, 6).asDiagonal()));
}

TEST(Nifti, TransformIsSformThenQformThenVoxelSizesInMillimetres) {
  nifti_1_header header = header_of({1, 1, 1}, 6, oblique(1));
  header.pixdim[1] = 2, header.pixdim[2] = 3, header.pixdim[3] = 4;
  header.qform_code = NIFTI_XFORM_SCANNER_ANAT;
  header.quatern_d = 1;  // Half a turn about z.
  header.qoffset_x = 7;
  const auto transform = [&] {
    const Temporary file("transform.nii", file_of(header, test::bytes_of(std::vector<float>(6, 1))));
    return open_nifti(file).to_world.matrix();
  };
  EXPECT_LT((transform() - oblique(1).matrix()).norm(), 1e-5);
  header.sform_code = 0;
  const Affine3d turned = Eigen::Translation3d(7, 0, 0) * Eigen::Scaling(-2.0, -3.0, 4.0);
  EXPECT_LT((transform() - turned.matrix()).norm(), 1e-5);
  header.qform_code = 0;
  EXPECT_LT((transform() - Eigen::Matrix4d(Eigen::Vector4d(-2, 3, 4, 1).asDiagonal())).norm(), 1e-5);
  header.xyzt_units = NIFTI_UNITS_METER;
  EXPECT_LT((transform() - Eigen::Matrix4d(Eigen::Vector4d(-2000, 3000, 4000, 1).asDiagonal())).norm(), 1e-2);
}

TEST(Nifti, IntegersOfTheOtherByteOrderAndTwoFilesAreRead) {
  nifti_1_header header = header_of({2, 1, 1}, 6, Affine3d::Identity());
  header.datatype = DT_INT16;
  header.bitpix = 16;
  header.vox_offset = 0;
  std::memcpy(header.magic, "ni1", 4);
  const auto swap = [](auto& number) { number = test::swapped(number); };
  for (short& extent : header.dim) swap(extent);
  for (float& size : header.pixdim) swap(size);
  for (float* row : {header.srow_x, header.srow_y, header.srow_z})
    for (int i = 0; i < 4; ++i) swap(row[i]);
  swap(header.sizeof_hdr), swap(header.datatype), swap(header.bitpix), swap(header.sform_code);
  std::vector<std::int16_t> numbers = {1, 258, 0, 0, 0, 0, 2, 2, 0, 0, 3, 3};
  for (std::int16_t& number : numbers) swap(number);
  const Temporary head("pair.hdr", file_of(header, "")), image("pair.img", test::bytes_of(numbers));
  for (const auto* const path : {&head, &image}) {
    const TensorGrid grid = test::tensors_of(open_nifti(*path), TensorOrder::fsl);
    test::expect_near(Vector3d(258, 2, 3).asDiagonal(), find(grid, {1, 0, 0}));
    ImportSettings settings;
    settings.files = {*path};
    settings.order = TensorOrder::fsl;
    settings.frame = ComponentFrame::voxels;
    EXPECT_EQ(time_steps(settings), 1);
    EXPECT_EQ(imported(settings).voxels(), 2u);
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
  const Temporary file("second.nii", file_of(header, test::bytes_of(six)));
  const TensorGrid grid = test::tensors_of(open_nifti(file), TensorOrder::fsl);
  test::expect_near(Vector3d(1, 2, 3).asDiagonal(), find(grid, {0, 0, 0}));
  header.dim[1] = header.dim[2] = header.dim[3] = std::int64_t{1} << 40;
  write_bytes(file, file_of(header, test::bytes_of(six)));
  test::expect_error([&] { open_nifti(file); }, {"second.nii"});
}

TEST(Nifti, WrongFilesAreErrorsOfOneLine) {
  const nifti_1_header good = header_of({4, 4, 4}, 6, Affine3d::Identity());
  const std::string numbers(4 * 4 * 4 * 6 * 4, '\1');
  test::expect_error([] { open_nifti("absent.nii"); }, {"absent.nii", "no such file"});
  for (const char* other : {"", "NRRD0004\ntype: float\n", "<nifti_image\n"})
    test::refuses(open_nifti, "wrong.nii", other, {"not a NIfTI"});
  test::refuses(open_nifti, "wrong.nii", file_of(good, numbers).substr(0, 200), {"NIfTI"});
  test::refuses(open_nifti, "wrong.nii", file_of(good, numbers.substr(1)), {"cut off"});
  const auto refuses = [&](const std::vector<std::string>& words, const auto& change) {
    nifti_1_header header = good;
    change(header);
    test::refuses(open_nifti, "wrong.nii", file_of(header, numbers), words);
  };
  refuses({"4 x 4 x 4 x 7", "six or nine"}, [](auto& h) { h.dim[4] = 7; });
  refuses({"announces", "cut off"}, [](auto& h) { h.dim[1] = h.dim[2] = h.dim[3] = 32767; });
  refuses({}, [](auto& h) { h.dim[2] = -4; });
  refuses({"RGB24"}, [](auto& h) { h.datatype = DT_RGB24, h.bitpix = 24; });
  refuses({"sform", "inverted"}, [](auto& h) { h.srow_y[1] = 0; });
  refuses({"sform"}, [](auto& h) { h.srow_y[1] = NAN; });
  refuses({}, [](auto& h) { h.vox_offset = 1e9f; });
}

}  // namespace
}  // namespace tensorray
