#include "tools/import/cases/plot3d.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <vtkDataArray.h>
#include <vtkDoubleArray.h>
#include <vtkGradientFilter.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkStructuredGrid.h>

#include "tests/import/mesh_files.h"

namespace tensorray {
namespace {

struct Form {
  bool big_endian = false, marks = false, count = false, blanking = false, doubles = false;
};

/// Writes PLOT3D records in any of the forms.
class Writer {
 public:
  explicit Writer(const Form& form) : form_(form) {}
  void integer(std::int32_t value) { put(&value, sizeof value, record_); }
  void real(double value) {
    const auto single = static_cast<float>(value);
    form_.doubles ? put(&value, sizeof value, record_) : put(&single, sizeof single, record_);
  }
  void end_record() {
    const auto length = static_cast<std::int32_t>(record_.size());
    if (form_.marks) put(&length, 4, bytes_);
    bytes_ += record_;
    if (form_.marks) put(&length, 4, bytes_);
    record_.clear();
  }
  const std::string& bytes() const { return bytes_; }

 private:
  void put(const void* value, std::size_t size, std::string& to) {
    std::string bytes(static_cast<const char*>(value), size);
    if (form_.big_endian) std::reverse(bytes.begin(), bytes.end());  // the tests run on little-endian machines
    to += bytes;
  }
  Form form_;
  std::string bytes_, record_;
};

constexpr int nx = 4, ny = 3, nz = 5, points = nx * ny * nz;

double x_of(int i, int axis) { return (axis + 1) * 0.37 * i + 0.5 * axis - 1; }
double q_of(int i, int number) { return number == 0 ? 1 + 0.25 * (i % 7) : number * 0.75 - 0.125 * i; }

void write_sizes(Writer& writer, const Form& form, const std::vector<int>& sizes) {
  if (form.count) {
    writer.integer(1);
    writer.end_record();
  }
  for (const int size : sizes) writer.integer(size);
  writer.end_record();
}

std::string grid_bytes(const Form& form) {
  Writer writer(form);
  write_sizes(writer, form, {nx, ny, nz});
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < points; ++i) writer.real(x_of(i, axis));
  }
  if (form.blanking) {
    for (int i = 0; i < points; ++i) writer.integer(i % 11 == 3 ? 0 : 1 - 2 * (i % 2));
  }
  writer.end_record();
  return writer.bytes();
}

std::string q_bytes(const Form& form, const std::vector<int>& sizes = {nx, ny, nz}) {
  Writer writer(form);
  write_sizes(writer, form, sizes);
  for (const double number : {0.8, 5.0, 1e6, 0.25}) writer.real(number);
  writer.end_record();
  for (int number = 0; number < 5; ++number) {
    for (int i = 0; i < sizes[0] * sizes[1] * sizes[2]; ++i) writer.real(q_of(i, number));
  }
  writer.end_record();
  return writer.bytes();
}

vtkSmartPointer<vtkDataSet> read(const std::filesystem::path& folder, const std::string& grid, const std::string& q) {
  write_bytes(folder / "grid.bin", grid);
  write_bytes(folder / "q.bin", q);
  return read_plot3d(folder / "grid.bin", folder / "q.bin");
}

void expect_content(vtkDataSet& mesh, const Form& form) {
  ASSERT_EQ(mesh.GetNumberOfPoints(), points);
  vtkPointData& data = *mesh.GetPointData();
  const double rounding = form.doubles ? 1e-14 : 1e-6;
  for (int i = 0; i < points; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(mesh.GetPoint(i)[axis], x_of(i, axis), 50 * rounding);
      EXPECT_NEAR(data.GetArray("momentum")->GetComponent(i, axis), q_of(i, axis + 1), 10 * rounding);
      EXPECT_NEAR(data.GetArray("velocity")->GetComponent(i, axis), q_of(i, axis + 1) / q_of(i, 0), 10 * rounding);
    }
    EXPECT_NEAR(data.GetArray("density")->GetComponent(i, 0), q_of(i, 0), 10 * rounding);
    EXPECT_NEAR(data.GetArray("energy")->GetComponent(i, 0), q_of(i, 4), 10 * rounding);
    EXPECT_EQ(vtkStructuredGrid::SafeDownCast(&mesh)->IsPointVisible(i) == 0, form.blanking && i % 11 == 3);
  }
}

TEST(Plot3dTest, EveryForm) {
  const TemporaryFolder folder;
  for (int bits = 0; bits < 32; ++bits) {
    const Form form{bool(bits & 1), bool(bits & 2), bool(bits & 4), bool(bits & 8), bool(bits & 16)};
    SCOPED_TRACE(bits);
    const auto mesh = read(folder, grid_bytes(form), q_bytes(form));
    expect_content(*mesh, form);
    EXPECT_EQ(mesh->GetPointData()->GetArray("velocity")->GetDataType(), form.doubles ? VTK_DOUBLE : VTK_FLOAT);
  }
}

TEST(Plot3dTest, FormsOfTheTwoFilesMayDifferAndFillingIsPassedOver) {
  const TemporaryFolder folder;
  Form grid, q;
  grid.big_endian = grid.blanking = q.marks = true;
  const auto mesh = read(folder, grid_bytes(grid) + std::string(17, '\0'), q_bytes(q) + std::string(484, '\0'));
  expect_content(*mesh, grid);
}

TEST(Plot3dTest, PointsOfZeroDensityHaveNoVelocity) {
  const TemporaryFolder folder;
  const Form form;
  std::string q = q_bytes(form);
  std::fill_n(q.begin() + 28, 4, '\0');  // the first density, which follows three sizes and four numbers
  const auto mesh = read(folder, grid_bytes(form), q);
  EXPECT_TRUE(std::isnan(mesh->GetPointData()->GetArray("velocity")->GetComponent(0, 0)));
  EXPECT_FALSE(std::isnan(mesh->GetPointData()->GetArray("velocity")->GetComponent(1, 0)));
}

TEST(Plot3dTest, EveryTruncationIsAnError) {
  const TemporaryFolder folder;
  for (int bits = 0; bits < 32; ++bits) {
    const Form form{bool(bits & 1), bool(bits & 2), bool(bits & 4), bool(bits & 8), bool(bits & 16)};
    const std::string grid = grid_bytes(form), q = q_bytes(form);
    for (const std::size_t cut : {1, 4, 7, 100, 236, 241, 700, 710}) {
      SCOPED_TRACE(testing::Message() << "form " << bits << ", cut " << cut);
      if (cut < grid.size()) {
        const std::string less = grid.substr(0, grid.size() - cut);
        EXPECT_NE(error_of([&] { read(folder, less, q); }).find("grid.bin: "), std::string::npos);
      }
      if (cut < q.size()) {
        const std::string less = q.substr(0, q.size() - cut);
        EXPECT_NE(error_of([&] { read(folder, grid, less); }).find("q.bin: "), std::string::npos);
      }
    }
  }
}

TEST(Plot3dTest, FilesThatDoNotFit) {
  const TemporaryFolder folder;
  const std::string grid = grid_bytes({}), q = q_bytes({});
  const auto error = [&](const std::string& grid_file, const std::string& q_file) {
    return error_of([&] { read(folder, grid_file, q_file); });
  };
  EXPECT_NE(error(grid, q_bytes({}, {nx, nz, ny})).find("4x5x3"), std::string::npos);
  EXPECT_NE(error(grid, grid).find("q.bin: "), std::string::npos);
  EXPECT_NE(error(q, q).find("grid.bin: "), std::string::npos);
  EXPECT_NE(error(grid, "").find("q.bin: is empty"), std::string::npos);
  EXPECT_NE(error("3 3 3\n0.0 0.5 1.0 0.0 0.5 1.0 0.0 0.5 1.0 0.0 0.5 1.0 0.0 0.5 1.0 0.0 0.5 1.0\n", q).find("text"),
            std::string::npos);
  EXPECT_NE(error(grid + "not zero", q).find("grid.bin: "), std::string::npos);
  std::string wild(grid.size(), '\x5a');
  wild[0] = '\1';
  EXPECT_NE(error(wild, q).find("no PLOT3D grid"), std::string::npos);
  std::string endless = grid;
  std::fill_n(endless.begin() + 12 + 40, 4, '\xff');
  EXPECT_NE(error(endless, q).find("grid.bin: is damaged, or not of the form it seems: point 10 "), std::string::npos);
  const float far = 1e31f;
  std::string remote = grid;
  std::memcpy(&remote[12 + 40], &far, sizeof far);
  EXPECT_NE(error(remote, q).find("not finite, or beyond 1e30"), std::string::npos);

  write_bytes(folder / "grid.bin", grid);
  const std::string missing = error_of([&] { read_plot3d(folder / "grid.bin", folder / "none.bin"); });
  EXPECT_NE(missing.find("none.bin: does not exist"), std::string::npos) << missing;
}

/// 2⁶⁰ points of 16 bytes are 2⁶⁴ bytes, which overflows to 0 in 64 bits: the bare header looked like the whole file.
TEST(Plot3dTest, SizesBeyondSixtyFourBitsAreDamage) {
  const TemporaryFolder folder;
  for (const bool count : {false, true}) {
    Form form;
    form.count = count;
    Writer writer(form);
    write_sizes(writer, form, {1 << 20, 1 << 20, 1 << 20});
    const std::string error = error_of([&] { read(folder, writer.bytes(), q_bytes(form)); });
    EXPECT_NE(error.find("grid.bin: is "), std::string::npos) << error;
  }
}

TEST(Plot3dTest, SeveralBlocksAndTwoDimensionsAreNamed) {
  const TemporaryFolder folder;
  for (const bool marks : {false, true}) {
    Form form;
    form.marks = marks;
    Writer blocks(form);
    blocks.integer(2);
    blocks.end_record();
    for (const int size : {2, 2, 2, 3, 2, 2}) blocks.integer(size);
    blocks.end_record();
    for (const int count : {8, 12}) {
      for (int i = 0; i < 3 * count; ++i) blocks.real(i);
      blocks.end_record();
    }
    const std::string error = error_of([&] { read(folder, blocks.bytes(), q_bytes(form)); });
    EXPECT_NE(error.find("2 blocks"), std::string::npos) << error;
  }
  Form form;
  form.marks = true;
  Writer flat(form);
  write_sizes(flat, form, {4, 3});
  for (int i = 0; i < 24; ++i) flat.real(i);
  flat.end_record();
  const std::string error = error_of([&] { read(folder, flat.bytes(), q_bytes(form)); });
  EXPECT_NE(error.find("two-dimensional"), std::string::npos) << error;
}

/// Known values of the data set. Its gradient is computed by VTK's own filter, which is independent of this reader.
TEST(Plot3dTest, BluntFin) {
  const std::filesystem::path grid = data_file("bluntfin/bluntfinxyz.bin"), q = data_file("bluntfin/bluntfinq.bin");
  SKIP_WITHOUT(grid);
  const vtkSmartPointer<vtkStructuredGrid> mesh = vtkStructuredGrid::SafeDownCast(read_plot3d(grid, q).Get());
  ASSERT_TRUE(mesh);
  int size[3];
  mesh->GetDimensions(size);
  EXPECT_EQ(Eigen::Vector3i(size), Eigen::Vector3i(40, 32, 32));

  vtkNew<vtkGradientFilter> filter;
  filter->SetInputData(mesh);
  filter->SetInputScalars(vtkDataObject::FIELD_ASSOCIATION_POINTS, "velocity");
  filter->SetResultArrayName("gradient");
  filter->Update();
  vtkDataArray& gradient = *vtkDataSet::SafeDownCast(filter->GetOutput())->GetPointData()->GetArray("gradient");
  std::vector<double> norms;
  int complex = 0;
  double asymmetry = 0;
  for (vtkIdType i = 0; i < gradient.GetNumberOfTuples(); ++i) {
    Eigen::Matrix3d t;
    gradient.GetTuple(i, t.data());
    norms.push_back(t.norm());
    complex += t.eigenvalues().imag().cwiseAbs().maxCoeff() > 1e-9 * t.norm();
    if (t.norm() > 0) asymmetry += (t - t.transpose()).norm() / t.norm();
  }
  asymmetry /= static_cast<double>(norms.size());
  EXPECT_EQ(std::count(norms.begin(), norms.end(), 0.0), 40);
  const auto zeros = norms.begin() + 40, middle = zeros + (norms.end() - zeros) / 2;
  std::nth_element(norms.begin(), middle, norms.end());
  EXPECT_NEAR(norms[20480 + 20], 6.49, 0.005) << "the median of the nodes that have a gradient";
  EXPECT_NEAR(*std::max_element(norms.begin(), norms.end()), 1942, 1);
  EXPECT_NEAR(complex / 40960.0, 0.34, 0.01);
  EXPECT_NEAR(asymmetry, 1.13, 0.01);
}

}  // namespace
}  // namespace tensorray
