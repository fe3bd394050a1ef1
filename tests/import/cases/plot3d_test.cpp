#include <cstdint>
#include <utility>

#include <vtkDataArray.h>
#include <vtkPointData.h>
#include <vtkStructuredGrid.h>

#include "base/text/byte_order.h"
#include "tests/import/mesh_files.h"
#include "tools/import/cases/case_files.h"

namespace tensorray {
namespace {

struct Form {
  bool big_endian = false, marks = false, count = false, blanking = false, doubles = false;
};

Form form_of(int bits) { return {bool(bits & 1), bool(bits & 2), bool(bits & 4), bool(bits & 8), bool(bits & 16)}; }

class Writer {
 public:
  explicit Writer(const Form& form) : form_(form), order_(form.big_endian ? ByteOrder::big : ByteOrder::little) {}
  void integer(std::int32_t value) { append_number(value, order_, record_); }
  void real(double value) {
    form_.doubles ? append_number(value, order_, record_) : append_number(static_cast<float>(value), order_, record_);
  }
  void end_record() {
    const auto length = static_cast<std::int32_t>(record_.size());
    if (form_.marks) append_number(length, order_, bytes_);
    bytes_ += std::exchange(record_, "");
    if (form_.marks) append_number(length, order_, bytes_);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  Form form_;
  ByteOrder order_;
  std::string bytes_, record_;
};

constexpr int nx = 4, ny = 3, nz = 5, points = nx * ny * nz;

double x_of(int i, int axis) { return (axis + 1) * 0.37 * i + 0.5 * axis - 1; }
double q_of(int i, int number) { return number == 0 ? 1 + 0.25 * (i % 7) : number * 0.75 - 0.125 * i; }

void write_sizes(Writer& writer, const Form& form, const std::vector<int>& sizes) {
  if (form.count) {
    writer.integer(static_cast<int>(sizes.size() / 3));
    writer.end_record();
  }
  for (const int size : sizes) writer.integer(size);
  writer.end_record();
}

std::string grid_bytes(const Form& form) {
  Writer writer(form);
  write_sizes(writer, form, {nx, ny, nz});
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < points; ++i) writer.real(x_of(i, axis));
  for (int i = 0; form.blanking && i < points; ++i) writer.integer(i % 11 == 3 ? 0 : 1 - 2 * (i % 2));
  writer.end_record();
  return writer.bytes();
}

std::string q_bytes(const Form& form, const std::vector<int>& sizes = {nx, ny, nz}) {
  Writer writer(form);
  write_sizes(writer, form, sizes);
  for (const double number : {0.8, 5.0, 1e6, 0.25}) writer.real(number);
  writer.end_record();
  for (int number = 0; number < 5; ++number)
    for (int i = 0; i < sizes[0] * sizes[1] * sizes[2]; ++i) writer.real(q_of(i, number));
  writer.end_record();
  return writer.bytes();
}

vtkSmartPointer<vtkDataSet> read_parts(const std::filesystem::path& folder, const std::string& grid,
                                       const std::string& q) {
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
    const Form form = form_of(bits);
    SCOPED_TRACE(bits);
    const auto mesh = read_parts(folder, grid_bytes(form), q_bytes(form));
    expect_content(*mesh, form);
    EXPECT_EQ(mesh->GetPointData()->GetArray("velocity")->GetDataType(), form.doubles ? VTK_DOUBLE : VTK_FLOAT);
  }
}

TEST(Plot3dTest, PointsOfZeroDensityHaveNoVelocity) {
  const TemporaryFolder folder;
  std::string q = q_bytes({});
  std::fill_n(q.begin() + 28, 4, '\0');  // the first density, which follows three sizes and four numbers
  const auto mesh = read_parts(folder, grid_bytes({}), q);
  EXPECT_TRUE(std::isnan(mesh->GetPointData()->GetArray("velocity")->GetComponent(0, 0)));
  EXPECT_FALSE(std::isnan(mesh->GetPointData()->GetArray("velocity")->GetComponent(1, 0)));
}

/// VTK's reader crashes on some of them.
TEST(Plot3dTest, FilesThatAreCutOffOrDoNotFitAreErrors) {
  const TemporaryFolder folder;
  const auto refuses = [&](const std::string& grid, const std::string& q, const std::string& name) {
    SCOPED_TRACE(testing::PrintToString(grid.substr(0, 40)) + " and " + testing::PrintToString(q.substr(0, 40)));
    EXPECT_THAT(error_in_child(folder / name, [&] { read_parts(folder, grid, q); }), HasSubstr(name + ": "));
  };
  for (int bits = 0; bits < 32; bits += 3) {
    const Form form = form_of(bits);
    const std::string grid = grid_bytes(form), q = q_bytes(form);
    SCOPED_TRACE(bits);
    for (const std::size_t cut : {12, 100, 700}) {  // A record mark is no number.
      refuses(grid.substr(0, grid.size() - cut), q, "grid.bin");
      refuses(grid, q.substr(0, q.size() - cut), "q.bin");
    }
  }
  const std::string grid = grid_bytes({}), q = q_bytes({});
  Form marks;
  marks.marks = true;
  for (const std::string& other : {q_bytes({}, {nx, nz, ny}), q_bytes(marks), grid, std::string()})
    refuses(grid, other, "q.bin");
  refuses("3 3 3\n0.0 0.5 1.0 0.0 0.5 1.0 0.0 0.5 1.0 0.0 0.5 1.0 0.0 0.5 1.0\n", q, "grid.bin");
  refuses(grid + std::string(5000, '\0'), q, "grid.bin");
  std::string endless = grid;
  std::fill_n(endless.begin() + 12 + 40, 4, '\xff');
  refuses(endless, q, "grid.bin");
  for (const int size : {2000, 1 << 20}) {
    Writer writer({});
    write_sizes(writer, {}, {size, size, size});
    refuses(writer.bytes(), q, "grid.bin");
  }
  EXPECT_THAT(error_of([&] { read_plot3d(folder / "grid.bin", folder / "none.bin"); }),
              HasSubstr("none.bin: does not exist"));
}

TEST(Plot3dTest, SeveralBlocksAreNamed) {
  const TemporaryFolder folder;
  Form form;
  form.marks = form.count = true;
  Writer blocks(form);
  write_sizes(blocks, form, {2, 2, 2, 3, 2, 2});
  for (const int count : {8, 12}) {
    for (int i = 0; i < 3 * count; ++i) blocks.real(i);
    blocks.end_record();
  }
  EXPECT_THAT(error_of([&] { read_parts(folder, blocks.bytes(), q_bytes(form)); }), HasSubstr("2 blocks"));
}

}  // namespace
}  // namespace tensorray
