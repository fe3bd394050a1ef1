// Other programs' files come in with their numbers, places and axes; or one line says why they do not.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include "renderer/image.h"
#include "tests/import/openfoam_case.h"
#include "tests/program/support.h"
#include "volumes/tensor_files.h"

namespace tensorray {
namespace {

using namespace test;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3i;
using Arguments = std::vector<std::string>;
using nlohmann::json;

void for_each_voxel(const TensorGrid& grid, const std::function<void(const Vector3i&, const Eigen::Matrix3f&)>& visit) {
  for (const TensorBlock& block : grid.blocks)
    for (int offset = 0; offset < TensorBlock::voxels; ++offset)
      if (block.active[offset]) visit(block.origin + TensorBlock::position(offset), block.values[offset]);
}

/// The same voxels with the same numbers, bit for bit.
void expect_same(const TensorGrid& a, const TensorGrid& b) {
  EXPECT_LT((a.to_world.matrix() - b.to_world.matrix()).norm(), 1e-12 * a.to_world.matrix().norm());
  ASSERT_EQ(a.blocks.size(), b.blocks.size());
  for (std::size_t i = 0; i < a.blocks.size(); ++i) {
    ASSERT_EQ(a.blocks[i].origin, b.blocks[i].origin);
    ASSERT_EQ(a.blocks[i].active, b.blocks[i].active);
    for (int offset = 0; offset < TensorBlock::voxels; ++offset)
      ASSERT_EQ(a.blocks[i].values[offset], b.blocks[i].values[offset]) << a.blocks[i].origin.transpose();
  }
}

template <class Number>
std::string bytes_of(const std::vector<Number>& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number)};
}

class Import : public Program {
 protected:
  /// Imports into FIELD.vdb. @return what `info` says of the field.
  json import(Arguments arguments, const std::string& field) {
    arguments.insert(arguments.begin(), "import");
    arguments.insert(arguments.end(), {"-q", "-o", field + ".vdb"});
    imported_ = run_well(arguments);
    return info(field);
  }
  json info(const std::string& field) const {
    const json all = json::parse(run_well({"info", field + ".vdb", "--json"}).out);
    return all["fields"][0];
  }
  TensorGrid field(const std::string& name) const { return read_tensor_vdb(in_folder(name + ".vdb")); }

  /// Expects one line that has `parts`, `status`, and that all files stay as they were, the old output among them.
  void refuses(const Arguments& arguments, int status, const std::vector<std::string>& parts) const {
    write("old.vdb", "what was there before");
    const auto before = files();
    Arguments all{"import", "-q", "-o", "old.vdb"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const Outcome outcome = run(all);
    const std::string trace = fmt::format("{}: {}", fmt::join(arguments, " "), outcome.error);
    EXPECT_EQ(outcome.status, status) << trace;
    EXPECT_EQ(outcome.out, "") << trace;
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << trace;
    for (const std::string& part : parts)
      EXPECT_NE(outcome.error.find(part), std::string::npos) << part << "\n" << trace;
    EXPECT_EQ(files(), before) << trace;
    EXPECT_EQ(read_file(in_folder("old.vdb")), "what was there before") << trace;
  }

  Outcome imported_;  ///< What the last import said.
};

double at(const json& value, const char* group, const char* key) { return value[group][key].get<double>(); }

void expect_extent(const json& field, const Vector3d& min, const Vector3d& max, double tolerance) {
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(field["world_extent"]["min"][axis].get<double>(), min[axis], tolerance) << "axis " << axis;
    EXPECT_NEAR(field["world_extent"]["max"][axis].get<double>(), max[axis], tolerance) << "axis " << axis;
  }
}

Vector3i voxels_of(const json& field) {
  Vector3i size;
  for (int axis = 0; axis < 3; ++axis)
    size[axis] = field["index_extent"]["max"][axis].get<int>() - field["index_extent"]["min"][axis].get<int>() + 1;
  return size;
}

// ---- Data sets: the facts of their README, and what their own readers and headers say.

TEST_F(Import, NotchWhoseMidSideNodesHoldNothing) {
  const std::string folder = data_file("notch_stress");
  SKIP_WITHOUT(folder);
  const json notch = import({folder + "/notch_stress.vtk", "--array", "Nodal Stress", "--order", "vtk"}, "notch");
  // On the mesh the eigenvalues go from -3.402e5 to 8.1078e6; without a warning the grid has 95% of that.
  EXPECT_EQ(imported_.error, "");
  EXPECT_GT(at(notch, "eigenvalues", "real_max"), 0.94 * 8.1078e6);
  EXPECT_LE(at(notch, "eigenvalues", "real_max"), 8.1078e6);
  EXPECT_GE(at(notch, "eigenvalues", "real_min"), -3.4021e5);
  EXPECT_EQ(notch["asymmetry"], 0);
  EXPECT_EQ(notch["name"], "Nodal Stress");
  expect_extent(notch, Vector3d::Zero(), Vector3d(0.4, 0.1, 0.01), 0.004);
  import({folder + "/notch_stress_fixed.vtk", "--array", "Nodal Stress", "--order", "vtk"}, "fixed");
  expect_same(field("notch"), field("fixed"));
}

TEST_F(Import, BrainInItsObliqueAxes) {
  const std::string file = data_file("brain_dti/tensorLAS.nii.gz");
  SKIP_WITHOUT(file);
  const json brain = import({file, "--order", "fsl"}, "brain");
  EXPECT_EQ(brain["active_voxels"], 93524);
  EXPECT_NE(imported_.out.find("367276 background"), std::string::npos) << imported_.out;
  EXPECT_NEAR(at(brain, "eigenvalues", "real_min"), -4.9e-3, 5e-5);
  EXPECT_NEAR(at(brain, "eigenvalues", "real_max"), 5.5e-3, 5e-5);
  EXPECT_NEAR(at(brain, "eigenvalues", "negative_fraction") * 93524, 864, 0.01);
  const std::array<std::array<double, 4>, 3> sform{{{-2.49987030, -0.00688329, 0.02452171, 121.26437378},
                                                    {-0.00939895, 2.48641157, -0.26002878, -102.28897095},
                                                    {0.02368196, 0.26021153, 2.48531413, -126.12567902}}};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 4; ++j) EXPECT_NEAR(brain["index_to_world"][i][j].get<double>(), sform[i][j], 1e-7);
}

TEST_F(Import, BrainWithItsBackgroundNotANumber) {
  const std::string file = data_file("nan/brain_nan_background.vti");
  SKIP_WITHOUT(file);
  const json brain = import({file}, "brain");
  EXPECT_EQ(brain["name"], "diffusion_tensor");
  EXPECT_EQ(brain["active_voxels"], 93524);
  EXPECT_EQ(brain["non_finite_voxels"], 0);
  EXPECT_NE(imported_.out.find("367276 not finite"), std::string::npos) << imported_.out;
  EXPECT_NEAR(at(brain, "eigenvalues", "negative_fraction") * 93524, 864, 0.01);
}

TEST_F(Import, DiffusionThatDoesNotSayItsOrder) {
  const std::string file = data_file("dmri_crop/tensor.nii.gz");
  SKIP_WITHOUT(file);
  refuses({file}, 2, {"--order", "mrtrix"});
  const json crop = import({file, "--order", "mrtrix", "--name", "water", "--units", "mm2/s"}, "crop");
  EXPECT_EQ(crop["active_voxels"], 16 * 16 * 5);
  EXPECT_NEAR(at(crop, "eigenvalues", "real_min"), 1.5e-4, 5e-6);
  EXPECT_NEAR(at(crop, "eigenvalues", "real_max"), 1.7e-3, 5e-5);
  EXPECT_EQ(crop["name"], "water");
  EXPECT_EQ(crop["metadata"]["tensorray:field"], "water");
  EXPECT_EQ(crop["metadata"]["tensorray:units"], "mm2/s");
}

TEST_F(Import, HelixInBothSpaces) {
  const std::string folder = data_file("dt_helix");
  SKIP_WITHOUT(folder);
  const json ras = import({folder + "/dt-helix.nrrd"}, "ras");
  EXPECT_NEAR(at(ras, "eigenvalues", "real_min"), 0.237, 5e-4);
  EXPECT_NEAR(at(ras, "eigenvalues", "real_max"), 0.303, 5e-4);
  EXPECT_EQ(voxels_of(ras), Vector3i(38, 39, 40));
  const json lps = import({folder + "/dt-helix-ref-RotationAndAffine.nrrd"}, "lps");
  EXPECT_NEAR(at(lps, "eigenvalues", "real_max"), 0.303, 5e-4);
  EXPECT_GT(at(lps, "eigenvalues", "real_min"), 0);
  for (const json& helix : {ras, lps})
    expect_extent(helix, {-2.336842, -2.338462, -2.34}, {2.33685, 2.338464, 2.34}, 1e-6);
}

TEST_F(Import, BluntFinWhoseBoundaryLayerIsThinnerThanAVoxel) {
  const std::string folder = data_file("bluntfin");
  SKIP_WITHOUT(folder);
  const json fin = import({folder + "/bluntfinxyz.bin", folder + "/bluntfinq.bin", "--gradient-of", "velocity",
                           "--resolution", "100", "--boundary", "fin.ply"},
                          "fin");
  EXPECT_NE(imported_.out.find("peak 1942 ->"), std::string::npos) << imported_.out;
  const std::size_t median = imported_.out.find("median ");
  ASSERT_NE(median, std::string::npos) << imported_.out;
  EXPECT_NEAR(std::stod(imported_.out.substr(median + 7)), 6.49, 0.03);  // Some nodes have no gradient.
  EXPECT_EQ(std::count(imported_.error.begin(), imported_.error.end(), '\n'), 1) << imported_.error;
  EXPECT_NE(imported_.error.find("warning: the grid holds"), std::string::npos) << imported_.error;
  EXPECT_EQ(voxels_of(fin).x(), 100);
  EXPECT_GT(fin["asymmetry"].get<double>(), 1.13);  // Of the nodes' mean; that of simple shear alone is the root of 2.
  EXPECT_LT(at(fin, "norm", "p100"), 1942.5);
  EXPECT_EQ(read_file(in_folder("fin.ply")).compare(0, 4, "ply\n"), 0);
  EXPECT_EQ(files(), (std::vector<std::string>{"fin.ply", "fin.vdb"}));
}

TEST_F(Import, CarotidAwayFromTheOrigin) {
  const std::string file = data_file("carotid/carotid.vtk");
  SKIP_WITHOUT(file);
  const json flow = import({file, "--gradient-of", "vectors"}, "flow");
  EXPECT_EQ(flow["active_voxels"], 76 * 49 * 45);
  expect_extent(flow, {100, 80, 1}, {175, 128, 45}, 1e-9);
  float least = 0, greatest = 0;
  for_each_voxel(field("flow"), [&](const Vector3i&, const Eigen::Matrix3f& gradient) {
    least = std::min(least, gradient.minCoeff());
    greatest = std::max(greatest, gradient.maxCoeff());
  });
  EXPECT_NEAR(least, -15.9, 0.05);
  EXPECT_NEAR(greatest, 15.4, 0.05);
  const json strain =
      import({file, "--strain-of", "vectors", "--bounds", "110", "120", "90", "100", "5", "8"}, "strain");
  EXPECT_LT(strain["asymmetry"].get<double>(), 1e-7);
  EXPECT_EQ(strain["active_voxels"], 11 * 11 * 4);
  expect_extent(strain, {110, 90, 5}, {120, 100, 8}, 1e-9);
}

TEST_F(Import, DiskThatFillsItsBoxInPart) {
  const std::string file = data_file("disk_out_ref/disk_out_ref.ex2");
  SKIP_WITHOUT(file);
  const json disk = import({file, "--gradient-of", "V", "--voxel-size", "0.2"}, "disk");
  const double box = 11.5 * 11.5 * 20.16 / std::pow(0.2, 3);
  EXPECT_NEAR(disk["active_voxels"].get<double>() / box, 0.59, 0.03);
  expect_extent(disk, {-5.75, -5.75, -10}, {5.75, 5.75, 10.16}, 0.81);
  EXPECT_GT(disk["asymmetry"].get<double>(), 0.5);
}

TEST_F(Import, PlasmaOfOneSliceInFourPieces) {
  const std::string file = data_file("pv_tensors/tensors.pvti");
  SKIP_WITHOUT(file);
  const json plasma = import({file}, "plasma");
  EXPECT_EQ(voxels_of(plasma), Vector3i(64, 1, 64));
  EXPECT_EQ(plasma["active_voxels"], 64 * 64);
  EXPECT_EQ(plasma["index_to_world"][0][3], 6950 + 256);
  EXPECT_EQ(plasma["index_to_world"][2][3], 900 + 81);
  EXPECT_GT(plasma["asymmetry"].get<double>(), 0.5);
  float greatest = 0;
  for_each_voxel(field("plasma"), [&](const Vector3i&, const Eigen::Matrix3f& gradient) {
    greatest = std::max(greatest, gradient.cwiseAbs().maxCoeff());
  });
  EXPECT_NEAR(greatest, 1.4e-3, 5e-5);
}

TEST_F(Import, EightTensorsOfOneCell) {
  const std::string file = data_file("vtk_tensors/tensors.vtk");
  SKIP_WITHOUT(file);
  const json eight = import({file, "--resolution", "2"}, "eight");
  EXPECT_EQ(eight["active_voxels"], 8);
  std::map<std::array<int, 3>, Matrix3d> tensors;
  for_each_voxel(field("eight"), [&](const Vector3i& index, const Eigen::Matrix3f& tensor) {
    tensors[{index.x(), index.y(), index.z()}] = tensor.cast<double>();
  });
  Matrix3d dense;
  dense << 2, 1, 1, 1, 2, 1, 1, 1, 3;
  EXPECT_LT((tensors[{0, 0, 0}] - Matrix3d::Identity()).norm(), 1e-6);
  EXPECT_LT((tensors[{1, 0, 0}] - Matrix3d(Vector3d(-2, -2, 3).asDiagonal())).norm(), 1e-6);
  EXPECT_LT((tensors[{1, 1, 0}] - dense).norm(), 1e-6);
  EXPECT_LT((tensors[{1, 1, 1}]).norm(), 1e-6);
}

TEST_F(Import, PointLoadIsBoussinesqs) {
  const std::string file = data_file("pointload/pointload_32.vti");
  SKIP_WITHOUT(file);
  const json load = import({file}, "load");
  EXPECT_EQ(load["active_voxels"], 32 * 32 * 32);
  expect_extent(load, {-10, -10, -10}, {10, 10, 10}, 1e-9);
  const TensorGrid grid = field("load");
  for_each_voxel(grid, [&](const Vector3i& index, const Eigen::Matrix3f& stress) {
    const Vector3d r = grid.to_world * index.cast<double>() - Vector3d(0, 0, 10);
    const double pressed = 3 * 100 / (2 * 3.14159265358979) * std::pow(r.z(), 3) / std::pow(r.norm(), 5);
    ASSERT_NEAR(stress(2, 2), pressed, 1e-6 * (1 + std::abs(pressed)));  // r.z() <= 0: pressure is negative.
    ASSERT_NEAR(stress(0, 2) * r.z(), pressed * r.x(), 1e-5 * (1 + std::abs(pressed)));
  });
}

// ---- Files that the tests write: a field of lumps without any symmetry.

constexpr int lump_size[3] = {18, 14, 12};
const Vector3i lumps_size(lump_size[0], lump_size[1], lump_size[2]);

/// @param p  From the lattice's centre. @return a symmetric tensor, nowhere zero.
Matrix3d lumps(const Vector3d& p) {
  Matrix3d a, b, c;
  a << 0.2, 0.1, 0.35, 0.1, -0.1, 0.15, 0.35, 0.15, 0.3;
  b << -0.3, 0.2, -0.2, 0.2, 0.2, 0.3, -0.2, 0.3, 0.1;
  c << 0.1, -0.3, 0.1, -0.3, 0.4, -0.25, 0.1, -0.25, -0.2;
  const auto lump = [&](double x, double y, double z, double width) {
    return std::exp(-(p - Vector3d(x, y, z)).squaredNorm() / (width * width));
  };
  return a * lump(-3, 2, 1, 4) + b * lump(4, -2.5, -2, 3) + c * lump(1, 3, 0, 5);
}

/// `put(tensor)` for every voxel, x fastest.
template <class Put>
void for_lumps(const Put& put) {
  for (int z = 0; z < lumps_size.z(); ++z)
    for (int y = 0; y < lumps_size.y(); ++y)
      for (int x = 0; x < lumps_size.x(); ++x)
        put(lumps(Vector3d(x, y, z) - 0.5 * (lumps_size.cast<double>() - Vector3d::Ones())));
}

/// World position of the first voxel, if the centre of the lattice, with axes `turn`, is the world's origin.
Vector3d lumps_origin(const Matrix3d& turn) { return turn * (-0.5 * (lumps_size.cast<double>() - Vector3d::Ones())); }

/// The components (row, column) of all tensors, after `turn` has turned their axes.
std::vector<float> components(const Matrix3d& turn, const std::vector<std::array<int, 2>>& which) {
  std::vector<float> numbers;
  for_lumps([&](const Matrix3d& tensor) {
    const Matrix3d turned = turn * tensor * turn.transpose();
    for (const auto& [row, column] : which) numbers.push_back(static_cast<float>(turned(row, column)));
  });
  return numbers;
}

const std::vector<std::array<int, 2>> nine{{0, 0}, {0, 1}, {0, 2}, {1, 0}, {1, 1}, {1, 2}, {2, 0}, {2, 1}, {2, 2}};
const std::vector<std::array<int, 2>> row_by_row{{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}};
const std::vector<std::array<int, 2>> mrtrix{{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};

/// `turn` is where the axes of the voxels point; `frame` those of the components, which stay what they are.
std::string nrrd_of_lumps(const Matrix3d& turn, const Matrix3d& frame) {
  const auto vector = [](const Vector3d& v) { return fmt::format("({:.17g},{:.17g},{:.17g})", v.x(), v.y(), v.z()); };
  const auto columns = [&](const Matrix3d& m) {
    return vector(m.col(0)) + " " + vector(m.col(1)) + " " + vector(m.col(2));
  };
  return fmt::format(
             "NRRD0005\ntype: float\ndimension: 4\nspace: right-anterior-superior\nsizes: 6 {} {} {}\n"
             "space directions: none {}\nkinds: 3D-symmetric-matrix space space space\nendian: little\n"
             "encoding: raw\nspace origin: {}\nmeasurement frame: {}\n\n",
             lumps_size.x(), lumps_size.y(), lumps_size.z(), columns(turn), vector(lumps_origin(turn)),
             columns(frame)) +
         bytes_of(components(Matrix3d::Identity(), row_by_row));
}

/// An image in ASCII XML with nine components in world axes.
std::string vti(const Vector3i& size, const Vector3d& origin, const Vector3d& spacing, const Matrix3d& direction,
                const std::vector<float>& numbers) {
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> rows = direction;
  const auto extent = fmt::format("0 {} 0 {} 0 {}", size.x() - 1, size.y() - 1, size.z() - 1);
  std::string values;
  for (const float number : numbers) values += fmt::format("{:.9g} ", number);
  return fmt::format(
      "<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\"><ImageData WholeExtent=\"{}\" "
      "Origin=\"{:.17g} {:.17g} {:.17g}\" Spacing=\"{:.17g} {:.17g} {:.17g}\" Direction=\"{:.17g}\"><Piece "
      "Extent=\"{}\">"
      "<PointData Tensors=\"lumps\"><DataArray type=\"Float32\" Name=\"lumps\" NumberOfComponents=\"9\" "
      "format=\"ascii\">{}</DataArray></PointData></Piece></ImageData></VTKFile>",
      extent, origin.x(), origin.y(), origin.z(), spacing.x(), spacing.y(), spacing.z(),
      fmt::join(rows.data(), rows.data() + 9, " "), extent, values);
}

/// As numpy.save writes 32-bit floats.
std::string npy_header(const std::string& shape) {
  std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (" + shape + "), }";
  header.resize(117, ' ');
  return std::string("\x93NUMPY\x01\x00\x76\x00", 10) + header + "\n";
}

/// A NIfTI-1 file of six volumes; `sform` is its three rows.
std::string nifti(const Eigen::Matrix<float, 3, 4>& sform, const std::vector<float>& numbers) {
  std::string header(352, '\0');
  const auto put = [&](std::size_t offset, auto value) { std::memcpy(&header[offset], &value, sizeof value); };
  put(0, std::int32_t{348});
  const std::array<int, 8> sizes{4, lumps_size.x(), lumps_size.y(), lumps_size.z(), 6, 1, 1, 1};
  for (std::size_t i = 0; i < 8; ++i) {
    put(40 + 2 * i, static_cast<std::int16_t>(sizes[i]));
    put(76 + 4 * i, 1.0f);
  }
  put(70, std::int16_t{16});
  put(72, std::int16_t{32});
  put(108, 352.0f);
  put(254, std::int16_t{1});
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      put(static_cast<std::size_t>(280 + 16 * row + 4 * column), sform(row, column));
  std::memcpy(&header[344], "n+1", 4);
  std::vector<float> volumes;
  for (std::size_t component = 0; component < 6; ++component)
    for (std::size_t i = component; i < numbers.size(); i += 6) volumes.push_back(numbers[i]);
  return header + bytes_of(volumes);
}

TEST_F(Import, WhatMakeMadeComesBackBitForBit) {
  run_well({"make", "vortex", "-o", "made.vdb", "--resolution", "9"});
  const TensorGrid made = field("made");
  const Vector3i size = made.active_box().sizes() + Vector3i::Ones();
  std::vector<float> numbers(static_cast<std::size_t>(size.prod()) * 9);
  for_each_voxel(made, [&](const Vector3i& index, const Eigen::Matrix3f& tensor) {
    const auto first = static_cast<std::size_t>((index.z() * size.y() + index.y()) * size.x() + index.x()) * 9;
    for (std::size_t i = 0; i < 9; ++i) numbers[first + i] = tensor(static_cast<int>(i / 3), static_cast<int>(i % 3));
  });
  const Matrix3d edges = made.to_world.linear();
  write("made.vti", vti(size, made.to_world.translation(), edges.diagonal(), Matrix3d::Identity(), numbers));
  EXPECT_EQ(import({"made.vti"}, "image")["name"], "lumps");
  expect_same(made, field("image"));

  write("made.npy", npy_header(fmt::format("{}, {}, {}, 3, 3", size.z(), size.y(), size.x())) + bytes_of(numbers));
  import({"made.npy"}, "array");
  TensorGrid array = field("array");
  EXPECT_TRUE(array.to_world.matrix().isIdentity());
  array.to_world = made.to_world;
  expect_same(made, array);

  const json half = import({"made.npy", "--half"}, "half");
  EXPECT_EQ(half["active_voxels"], size.prod());
  EXPECT_NEAR(at(half, "norm", "p100"), at(info("made"), "norm", "p100"), 1e-3 * at(half, "norm", "p100"));
}

TEST_F(Import, PythonReadsTheRows) {
  write("lumps.npy", npy_header("12, 14, 18, 3, 3") + bytes_of(components(Matrix3d::Identity(), nine)));
  import({"lumps.npy"}, "lumps");
  write("rows.py",
        "try: import pyopenvdb as vdb\nexcept ImportError: import openvdb as vdb\n"
        "for row in range(3):\n"
        "  grid = vdb.read('lumps.vdb', 'tensor_row%d' % row)\n"
        "  read = grid.getConstAccessor()\n"
        "  print(grid.activeVoxelCount(), *read.getValue((5, 3, 2)), *read.getValue((17, 13, 11)))\n");
  const std::string command = "cd '" + in_folder("").string() + "' && /usr/bin/python3 rows.py > rows.txt 2> /dev/null";
  if (std::system(command.c_str()) != 0) GTEST_SKIP() << "python3 has no OpenVDB (python3-openvdb)";
  std::ifstream rows(in_folder("rows.txt"));
  const Vector3d center(8.5, 6.5, 5.5);
  for (int row = 0; row < 3; ++row) {
    std::size_t active = 0;
    rows >> active;
    EXPECT_EQ(active, 18u * 14 * 12);
    for (const Vector3d& index : {Vector3d(5, 3, 2), Vector3d(17, 13, 11)})
      for (int column = 0; column < 3; ++column) {
        double value = -1;
        rows >> value;
        EXPECT_EQ(static_cast<float>(value), static_cast<float>(lumps(index - center)(row, column)));
      }
  }
}

TEST_F(Import, OpenFoamsLastTimeStep) {
  OpenFoamCase::write(in_folder("case"));
  const json stress = import({"case", "--array", "sigma", "--order", "vtk", "--resolution", "4"}, "stress");
  EXPECT_EQ(stress["name"], "sigma");
  EXPECT_GT(at(stress, "norm", "p0"), 1000);  // The values of the time before are below.
  EXPECT_EQ(import({"case", "--gradient-of", "U", "--resolution", "4"}, "flow")["name"], "U_gradient");
}

// ---- Pictures: tensors turn with their voxels.

class ImportPictures : public Import {
 protected:
  /// The light that the field of FILE throws on a plate behind it: everything is turned with the field.
  Image picture(const Arguments& file, const Vector3d& direction, const Vector3d& up,
                const Vector3d& center = Vector3d::Zero()) {
    Arguments arguments{"import", "-q", "-o", "field.vdb"};
    arguments.insert(arguments.end(), file.begin(), file.end());
    run_well(arguments);
    const auto list = [](const Vector3d& v) { return json{v.x(), v.y(), v.z()}; };
    const Vector3d plate = center + 14 * direction.normalized();
    json scene;
    scene["field"] = {{"file", "field.vdb"}, {"eigenvalues", "raw"}, {"scale", 1}};
    scene["light"] = {{"direction", list(direction)},
                      {"up", list(up)},
                      {"photons", 40000},
                      {"pattern", "grid"},
                      {"wavelengths", {{"count", 4}}},
                      {"aperture", {{"center", list(center)}, {"size", {24, 24}}}}};
    scene["receiver"] = {{"center", list(plate)}, {"up", list(up)}, {"size", {26, 26}}, {"resolution", {64, 64}}};
    scene["integrator"] = {{"type", "photon_distribution"}, {"density", {{"tau", 1.5}}}};
    write("scene.json", scene.dump());
    run_well({"render", "scene.json", "-q", "-o", "picture.exr"});
    return read_image(in_folder("picture.exr"));
  }
};

/// The greatest difference of pixels, in units of the undisturbed plate; `where` is the place in `b` of one in `a`.
double difference(
    const Image& a, const Image& b, const std::function<std::array<int, 2>(int, int)>& where = [](int x, int y) {
      return std::array<int, 2>{x, y};
    }) {
  double greatest = 0;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x)
      for (int channel = 0; channel < 3; ++channel) {
        const auto [other_x, other_y] = where(x, y);
        greatest = std::max<double>(greatest, std::abs(a.pixel(x, y)[channel] - b.pixel(other_x, other_y)[channel]));
      }
  return greatest;
}

/// Photons lie on a grid that turns with the light, so that only rounding differs: that of 32-bit rays and pixels.
constexpr double same = 0.01;
/// What tells pictures apart: much more than `same`.
constexpr double different = 0.3;

const Vector3d slanted(0.4, -0.3, -0.85), up(0, 1, 0);
const Matrix3d turn = Eigen::AngleAxisd(0.9, Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();

TEST_F(ImportPictures, TurnWithAnNrrdsDirectionsAndItsFrame) {
  write("straight.nrrd", nrrd_of_lumps(Matrix3d::Identity(), Matrix3d::Identity()));
  write("turned.nrrd", nrrd_of_lumps(turn, turn));
  write("half.nrrd", nrrd_of_lumps(turn, Matrix3d::Identity()));
  const Image straight = picture({"straight.nrrd"}, slanted, up);
  EXPECT_LT(difference(straight, picture({"turned.nrrd"}, turn * slanted, turn * up)), same);
  EXPECT_GT(difference(straight, picture({"half.nrrd"}, turn * slanted, turn * up)), different);
}

TEST_F(ImportPictures, TurnWithAnImagesDirectionWhoseComponentsAreInWorldAxes) {
  write("straight.vti", vti(lumps_size, lumps_origin(Matrix3d::Identity()), Vector3d::Ones(), Matrix3d::Identity(),
                            components(Matrix3d::Identity(), nine)));
  write("turned.vti", vti(lumps_size, lumps_origin(turn), Vector3d::Ones(), turn, components(turn, nine)));
  const Image straight = picture({"straight.vti"}, slanted, up);
  EXPECT_LT(difference(straight, picture({"turned.vti"}, turn * slanted, turn * up)), same);
  EXPECT_GT(difference(straight, picture({"straight.vti"}, turn * slanted, turn * up)), different);
}

TEST_F(ImportPictures, TurnByARightAngleAboutTheLight) {
  const std::vector<float> numbers = components(Matrix3d::Identity(), nine);
  write("straight.npy", npy_header("12, 14, 18, 3, 3") + bytes_of(numbers));
  // x, y -> -y, x: voxel (x, y) goes to (13 - y, x).
  const Matrix3d right_angle = (Matrix3d() << 0, -1, 0, 1, 0, 0, 0, 0, 1).finished();
  const std::vector<float> turned_numbers = components(right_angle, nine);
  std::vector<float> moved;
  for (int z = 0; z < 12; ++z)
    for (int y = 0; y < 18; ++y)
      for (int x = 0; x < 14; ++x) {
        const auto first = turned_numbers.begin() + 9 * ((z * 14 + 13 - x) * 18 + y);
        moved.insert(moved.end(), first, first + 9);
      }
  write("turned.npy", npy_header("12, 18, 14, 3, 3") + bytes_of(moved));
  const Image straight = picture({"straight.npy"}, -Vector3d::UnitZ(), up, {8.5, 6.5, 5.5});
  const Image turned = picture({"turned.npy"}, -Vector3d::UnitZ(), up, {6.5, 8.5, 5.5});
  EXPECT_LT(difference(turned, straight, [](int x, int y) { return std::array<int, 2>{63 - y, x}; }), same);
  EXPECT_GT(difference(turned, straight), different);
  EXPECT_GT(difference(turned, straight, [](int x, int y) { return std::array<int, 2>{y, 63 - x}; }), different);
}

TEST_F(ImportPictures, MirrorWithAHeadInEitherOrder) {
  const Matrix3d mirror = Vector3d(-1, 1, 1).asDiagonal();
  Eigen::Matrix<float, 3, 4> sform = Eigen::Matrix<float, 3, 4>::Zero();
  const auto place = [&](const Matrix3d& axes) {
    sform.leftCols<3>() = axes.cast<float>();
    sform.col(3) = lumps_origin(axes).cast<float>();
    return sform;
  };
  write("world.nii", nifti(place(Matrix3d::Identity()), components(Matrix3d::Identity(), mrtrix)));
  write("mirrored.nii", nifti(place(mirror), components(mirror, mrtrix)));
  // FSL's first axis points left in both, so that the numbers of the mirrored head are those of its image in world
  // axes.
  write("fsl.nii", nifti(place(mirror), components(Matrix3d::Identity(), row_by_row)));
  const Vector3d light = -Vector3d::UnitZ();
  const auto mirrored = [](int x, int y) { return std::array<int, 2>{63 - x, y}; };
  const Image world = picture({"world.nii", "--order", "mrtrix"}, light, up);
  EXPECT_LT(difference(picture({"mirrored.nii", "--order", "mrtrix"}, light, up), world, mirrored), same);
  EXPECT_LT(difference(picture({"fsl.nii", "--order", "fsl"}, light, up), world, mirrored), same);
  EXPECT_GT(difference(picture({"mirrored.nii", "--order", "fsl"}, light, up), world, mirrored), different);
}

// ---- Wrong inputs.

class ImportErrors : public Import {
 protected:
  /// The beginning of a data set's file; `part` of its bytes.
  void cut(const std::string& data, const std::string& name, double part = 0.5) const {
    const std::string bytes = read_file(data_file(data));
    write(name, bytes.substr(0, static_cast<std::size_t>(part * static_cast<double>(bytes.size()))));
  }
  std::string npy() const { return npy_header("12, 14, 18, 3, 3") + bytes_of(components(Matrix3d::Identity(), nine)); }
  std::string image() const {
    return vti(lumps_size, Vector3d::Zero(), Vector3d::Ones(), Matrix3d::Identity(),
               components(Matrix3d::Identity(), nine));
  }
};

TEST_F(ImportErrors, FilesThatAreCutOff) {
  SKIP_WITHOUT(data_file("bluntfin"));
  const std::string fin = data_file("bluntfin/bluntfinxyz.bin"), q = data_file("bluntfin/bluntfinq.bin");
  cut("bluntfin/bluntfinxyz.bin", "half.xyz");
  cut("bluntfin/bluntfinq.bin", "half.q");
  refuses({"half.xyz", q, "--gradient-of", "velocity"}, 1, {"half.xyz", "cut off"});
  refuses({fin, "half.q", "--gradient-of", "velocity"}, 1, {"half.q", "cut off"});
  cut("notch_stress/notch_stress_fixed.vtk", "half.vtk");
  refuses({"half.vtk", "--array", "Nodal Stress", "--order", "vtk"}, 1, {"half.vtk"});
  cut("disk_out_ref/disk_out_ref.ex2", "half.ex2");
  refuses({"half.ex2", "--gradient-of", "V"}, 1, {"half.ex2", "cut off"});
  cut("dt_helix/dt-helix-ref-RotationAndAffine.nrrd", "half.nrrd");  // Compressed.
  refuses({"half.nrrd"}, 1, {"half.nrrd", "cut off"});
  cut("dmri_crop/tensor.nii.gz", "half.nii.gz");
  refuses({"half.nii.gz", "--order", "mrtrix"}, 1, {"half.nii.gz", "cut off"});
  write("pieces.pvti", read_file(data_file("pv_tensors/tensors.pvti")));
  refuses({"pieces.pvti"}, 1, {"pieces.pvti", "tensors_0.vti"});
}

TEST_F(ImportErrors, WrittenFilesThatAreCutOffOrEmpty) {
  write("half.npy", npy().substr(0, 20000));
  refuses({"half.npy"}, 1, {"half.npy", "cut off"});
  write("half.vti", image().substr(0, 20000));
  refuses({"half.vti"}, 1, {"half.vti", "cut off"});
  write("half.nrrd", nrrd_of_lumps(turn, turn).substr(0, 20000));
  refuses({"half.nrrd"}, 1, {"half.nrrd", "cut off"});
  write("half.nii", nifti(Eigen::Matrix<float, 3, 4>::Identity(), components(turn, mrtrix)).substr(0, 20000));
  refuses({"half.nii", "--order", "fsl"}, 1, {"half.nii", "cut off"});
  for (const std::string name : {"none.vtu", "none.vtk", "none.ex2", "none.nrrd", "none.nii.gz", "none.npy"}) {
    write(name, "");
    refuses({name}, 1, {name});
  }
}

TEST_F(ImportErrors, FilesThatAreSomethingElse) {
  write("image.vtu", image());
  refuses({"image.vtu"}, 1, {"image.vtu", ".vti"});
  write("image.nii", image());
  refuses({"image.nii"}, 1, {"image.nii", "NIfTI"});
  write("array.nrrd", npy());
  refuses({"array.nrrd"}, 1, {"array.nrrd", "NRRD"});
  write("head.npy", nifti(Eigen::Matrix<float, 3, 4>::Identity(), components(turn, mrtrix)));
  refuses({"head.npy"}, 1, {"head.npy"});
  write("array.vtk", npy());
  refuses({"array.vtk"}, 1, {"array.vtk"});
  write("flat.npy", npy_header("12, 14, 18, 4") + std::string(12 * 14 * 18 * 4 * 4, 'a'));
  refuses({"flat.npy"}, 1, {"flat.npy"});
  refuses({"missing.vti"}, 1, {"missing.vti", "does not exist"});
  std::filesystem::create_directory(in_folder("folder"));
  refuses({"folder"}, 1, {"folder", "OpenFOAM"});
}

TEST_F(ImportErrors, Plot3dNeedsItsTwoFiles) {
  const std::string folder = data_file("bluntfin");
  SKIP_WITHOUT(folder);
  const std::string grid = folder + "/bluntfinxyz.bin", q = folder + "/bluntfinq.bin";
  refuses({grid, "--gradient-of", "velocity"}, 1, {grid});
  refuses({grid, "missing.q", "--gradient-of", "velocity"}, 1, {"missing.q", "does not exist"});
  refuses({q, grid, "--gradient-of", "velocity"}, 1, {q});
  refuses({grid, q}, 2, {"density", "momentum", "energy", "velocity"});
  refuses({grid, q, "--array", "velocity"}, 2, {"velocity", "3 components"});
}

TEST_F(ImportErrors, WrongArguments) {
  write("image.vti", image());
  refuses({"image.vti", "--array", "stress"}, 2, {"stress", "lumps (9 components"});
  refuses({"image.vti", "--gradient-of", "lumps"}, 2, {"lumps", "--gradient-of"});
  refuses({"image.vti", "--array", "lumps", "--gradient-of", "v"}, 2, {"--array", "--gradient-of"});
  refuses({"image.vti", "--order", "xyz"}, 2, {"--order", "vtk", "fsl", "mrtrix", "voigt"});
  refuses({"image.vti", "--voxel-size", "0"}, 2, {"--voxel-size"});
  refuses({"image.vti", "--voxel-size", "1e-6"}, 2, {"--voxel-size", "limit"});
  refuses({"image.vti", "--resolution", "8", "8"}, 2, {"--resolution"});
  refuses({"image.vti", "--bounds", "1", "0", "0", "1", "0", "1"}, 2, {"--bounds"});
  refuses({"image.vti", "--boundary", "body.stl"}, 2, {"--boundary", ".ply"});
  refuses({"image.vti", "-o", "image.txt"}, 2, {"--output"});
  write("array.npy", npy());
  refuses({"array.npy", "--resolution", "8"}, 2, {"array.npy", "--resolution"});
  const Outcome elsewhere = run({"import", "image.vti", "-q", "-o", "missing/image.vdb"});
  EXPECT_EQ(elsewhere.status, 1);
  EXPECT_NE(elsewhere.error.find("missing"), std::string::npos) << elsewhere.error;
}

TEST_F(ImportErrors, BoundsWithNothingInside) {
  write("image.vti", image());
  const Arguments far{"--bounds", "50", "60", "50", "60", "50", "60"};
  Arguments voxels{"image.vti"}, mesh{"image.vti", "--resolution", "8"};
  for (Arguments* const arguments : {&voxels, &mesh}) arguments->insert(arguments->end(), far.begin(), far.end());
  refuses(voxels, 2, {"--bounds"});
  refuses(mesh, 2, {"--bounds"});
}

TEST_F(ImportErrors, AFullDiskLeavesWhatWasThere) {
  write("array.npy", npy());
  write("old.vdb", "what was there before");
  const Outcome outcome = run({"import", "array.npy", "-q", "-o", "old.vdb"}, 16);
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
  EXPECT_EQ(read_file(in_folder("old.vdb")), "what was there before");
  EXPECT_EQ(files(), (std::vector<std::string>{"array.npy", "old.vdb"}));
}

TEST_F(ImportErrors, HelpNamesEveryFlagAndFormat) {
  const std::string help = run_well({"import", "--help"}).out;
  for (const char* word :
       {"--array", "--gradient-of", "--strain-of", "--order",  "--resolution", "--voxel-size", "--bounds", "--boundary",
        "--half",  "--name",        "--units",     "--output", "--quiet",      ".pvtu",        ".vtk",     ".ex2",
        ".foam",   ".nrrd",         ".nii.gz",     ".npy",     "PLOT3D",       "mrtrix",       "voigt"})
    EXPECT_NE(help.find(word), std::string::npos) << word;
}

// ---- The process that reads.

constexpr std::size_t large_numbers = 128 * 128 * 128 * 9;

class ImportProcess : public Import {
 protected:
  /// A file of 128³ tensors: `header`, then numbers, then `footer`.
  void write_large(const std::string& name, const std::string& header, const std::string& footer = "") const {
    std::ofstream file(in_folder(name), std::ios::binary);
    file << header;
    std::vector<float> slice(large_numbers / 128);
    for (int z = 0; z < 128; ++z) {
      for (std::size_t i = 0; i < slice.size(); ++i) slice[i] = static_cast<float>((i * 2654435761u + 97u * z) % 1024);
      file << bytes_of(slice);
    }
    file << footer;
  }

  /// The most memory that an import had resident, whichever of its processes had it.
  double peak_bytes(const std::string& file) const {
    const pid_t program = start({"import", file, "-q", "-o", "field.vdb"});
    int status = 0;
    rusage usage{};
    wait4(program, &status, 0, &usage);
    EXPECT_EQ(status, 0) << read_file(in_folder("stderr"));
    return 1024.0 * static_cast<double>(usage.ru_maxrss);
  }

  /// Starts an import that takes a while. @return its process and, once it is there, the one that reads; 0 if none.
  std::array<pid_t, 2> start_reading() const {
    write_large("large.npy", npy_header("128, 128, 128, 3, 3"));
    const pid_t program = start({"import", "large.npy", "-q", "-o", "field.vdb"});
    const std::string children = fmt::format("/proc/{0}/task/{0}/children", program);
    for (int i = 0; i < 60000; ++i) {
      pid_t reader = 0;
      if (std::ifstream(children) >> reader) return {program, reader};
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return {program, 0};
  }
};

TEST_F(ImportProcess, AReaderThatCrashesIsOneLine) {
  if (!std::filesystem::exists(fmt::format("/proc/{0}/task/{0}/children", getpid())))
    GTEST_SKIP() << "this system does not tell a process's children";
  const auto [program, reader] = start_reading();
  ASSERT_GT(reader, 0);
  kill(reader, SIGSEGV);
  const Outcome outcome = wait_for(program);
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.error.find("large.npy: reading it ended the reader"), std::string::npos) << outcome.error;
  EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
  EXPECT_EQ(files(), std::vector<std::string>{"large.npy"});
}

TEST_F(ImportProcess, AnInterruptedImportLeavesNothing) {
  if (!std::filesystem::exists(fmt::format("/proc/{0}/task/{0}/children", getpid())))
    GTEST_SKIP() << "this system does not tell a process's children";
  const auto [program, reader] = start_reading();
  ASSERT_GT(reader, 0);
  kill(program, SIGINT);
  const Outcome outcome = wait_for(program);
  EXPECT_EQ(outcome.status, 130);
  EXPECT_EQ(outcome.error, "tensorray: interrupted; nothing was written\n");
  EXPECT_EQ(files(), std::vector<std::string>{"large.npy"});
}

TEST_F(ImportProcess, TakesLessThanTwiceTheData) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer's own memory is larger";
#endif
  write("small.npy", npy_header("2, 2, 2, 3, 3") + bytes_of(std::vector<float>(72, 1.0f)));
  write("small.vti",
        vti({2, 2, 2}, Vector3d::Zero(), Vector3d::Ones(), Matrix3d::Identity(), std::vector<float>(72, 1.0f)));
  const double data = 4.0 * large_numbers;
  write_large("large.npy", npy_header("128, 128, 128, 3, 3"));
  EXPECT_LT(peak_bytes("large.npy") - peak_bytes("small.npy"), 2 * data);
  std::string image =
      "<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\"><ImageData "
      "WholeExtent=\"0 127 0 127 0 127\" Origin=\"0 0 0\" Spacing=\"1 1 1\"><Piece Extent=\"0 127 0 127 0 127\">"
      "<PointData><DataArray type=\"Float32\" Name=\"T\" NumberOfComponents=\"9\" format=\"appended\" offset=\"0\"/>"
      "</PointData></Piece></ImageData><AppendedData encoding=\"raw\">_";
  image += bytes_of(std::vector<std::uint64_t>{4 * large_numbers});
  write_large("large.vti", image, "</AppendedData></VTKFile>");
  EXPECT_LT(peak_bytes("large.vti") - peak_bytes("small.vti"), 2 * data);
}

}  // namespace
}  // namespace tensorray
