// Light of great flexibility follows the major eigenvector, as the hyperstreamlines of Delmarcelle and Hesselink (1993)
// do: VTK's vtkHyperStreamline is an independent reference.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <sstream>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "integrators/paths/paths.h"
#include "tests/integrators/support.h"
#include "tests/renderer/support.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {
namespace {

using namespace test;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int voxels = 17;

/// The eigenvector of the greatest eigenvalue: its lines wind gently.
Vector3d major_direction(const Vector3d& p) {
  return Vector3d(-0.6 * p.y() + 0.2 * p.z(), 0.6 * p.x(), 1).normalized();
}

/// Symmetric and positive definite, its eigenvalues about 3, 1 and 1/2, and smooth.
Matrix3d positive_tensor(const Vector3d& p) {
  const Vector3d major = major_direction(p), across = major.cross(Vector3d(1, p.z(), 0)).normalized();
  const Vector3d last = major.cross(across);
  return (3 + 0.5 * p.x()) * major * major.transpose() + across * across.transpose() + 0.5 * last * last.transpose();
}

/// The cube [-1, 1]³ as a legacy VTK file.
std::string vtk_text(const TensorField& field) {
  std::ostringstream text;
  text.precision(9);
  text << "# vtk DataFile Version 3.0\nfield\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS " << voxels << ' ' << voxels
       << ' ' << voxels << "\nORIGIN -1 -1 -1\nSPACING " << 2.0 / (voxels - 1) << ' ' << 2.0 / (voxels - 1) << ' '
       << 2.0 / (voxels - 1) << "\nPOINT_DATA " << voxels * voxels * voxels << "\nTENSORS T float\n";
  TensorSampler sampler(field);
  for (int z = 0; z < voxels; ++z)
    for (int y = 0; y < voxels; ++y)
      for (int x = 0; x < voxels; ++x) text << sampler.at(field.to_world() * Vector3d(x, y, z)) << '\n';
  return text.str();
}

/// Arguments: the file of the field, the length of a step in voxels, and a seed's x, y and z. Writes the centres of the
/// tube's rings, a line each: those of the polygons whose corners are its vertices.
constexpr const char* script = R"(
import sys, vtk
reader = vtk.vtkStructuredPointsReader()
reader.SetFileName(sys.argv[1])
reader.Update()
sides = 6
lines = vtk.vtkHyperStreamline()
lines.SetInputData(reader.GetOutput())
lines.SetStartPosition([float(word) for word in sys.argv[3:6]])
lines.SetIntegrationStepLength(float(sys.argv[2]))
lines.SetStepLength(0.01)
lines.SetMaximumPropagationDistance(1000.0)
lines.SetNumberOfSides(sides)
lines.IntegrateMajorEigenvector()
lines.SetIntegrationDirectionToIntegrateBothDirections()
lines.Update()
points = lines.GetOutput().GetPoints()
for first in range(0, points.GetNumberOfPoints(), sides):
    ring = [points.GetPoint(first + i) for i in range(sides)]
    print(*(sum(axis) / sides for axis in zip(*ring)))
)";

std::string python_with_vtk() {
  for (const std::string python : {"python3", "/usr/bin/python3"})
    if (std::system((python + " -c 'import vtk' > /dev/null 2>&1").c_str()) == 0) return python;
  return "";
}

/// The part of the hyperstreamline that light from the seed would follow. Its two parts meet at the seed, which is left
/// out.
std::vector<Vector3d> hyperstreamline(const std::string& python, const std::string& files, double step,
                                      const Vector3d& seed) {
  std::ostringstream command;
  command << python << ' ' << files << ' ' << step << ' ' << seed.x() << ' ' << seed.y() << ' ' << seed.z();
  FILE* const output = popen(command.str().c_str(), "r");
  std::vector<Vector3d> points;
  for (Vector3d p; std::fscanf(output, "%lf %lf %lf", &p.x(), &p.y(), &p.z()) == 3;)
    if ((p - seed).dot(major_direction(seed)) > 1e-3) points.push_back(p);
  EXPECT_EQ(pclose(output), 0);
  return points;
}

std::vector<Vector3d> path(const TensorField& field, const Vector3d& from, double flexibility) {
  PathSeed seed;
  seed.position = from;
  seed.direction = major_direction(from);
  seed.flexibility = flexibility;
  PathSettings settings;
  settings.backwards = false;
  settings.tolerance = settings.tensor_tolerance = 0;
  BendingSettings bending;
  bending.method = BendingMethod::dopri5;
  bending.tolerance = 1e-6;
  const Geometry geometry{surfaces_of(field)};
  const std::vector<Path> paths = trace_paths(field, geometry, bending, {seed}, settings, Progress());
  std::vector<Vector3d> points;
  for (const PathPoint& point : paths.at(0).points) points.push_back(point.position);
  return points;
}

/// The greatest distance of one of `points` from the polyline `line`.
double distance(const std::vector<Vector3d>& points, const std::vector<Vector3d>& line) {
  double greatest = 0;
  for (const Vector3d& point : points) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 1; i < line.size(); ++i) {
      const Vector3d chord = line[i] - line[i - 1];
      const double squared = chord.squaredNorm();
      const double t = squared > 0 ? std::clamp((point - line[i - 1]).dot(chord) / squared, 0.0, 1.0) : 0;
      least = std::min(least, (line[i - 1] + t * chord - point).norm());
    }
    greatest = std::max(greatest, least);
  }
  return greatest;
}

TEST(Hyperstreamlines, ArePathsOfGreatFlexibility) {
  const std::string python = python_with_vtk();
  if (python.empty()) GTEST_SKIP() << "python3 with VTK is not installed (python3-vtk9)";
  const TensorField field = cube_field(voxels, positive_tensor);
  const Temporary program("hyperstreamline.py", script), data("field.vtk", vtk_text(field));
  const std::string files = program.path().string() + ' ' + data.path().string();
  for (const Vector3d& seed : {Vector3d(0.3, 0.2, -0.95), Vector3d(-0.4, 0.1, -0.9)}) {
    const std::vector<Vector3d> coarse = hyperstreamline(python, files, 0.02, seed);
    const std::vector<Vector3d> fine = hyperstreamline(python, files, 0.01, seed);
    ASSERT_GT(fine.size(), 20u);
    ASSERT_GT((fine.back() - seed).norm(), 1.5);
    const std::vector<Vector3d> bent = path(field, seed, 200), more = path(field, seed, 400);
    // Light lags behind the eigenvector as 1 / s: the change when s is doubled is the lag that remains. The same is
    // assumed of VTK's steps, and VTK's numbers are in single precision.
    const double lag = distance(bent, more), steps = distance(coarse, fine) + 1e-6;
    EXPECT_LT(distance(fine, more), 1.2 * lag + 1.2 * steps);
    EXPECT_LT(distance(fine, more), 0.6 * distance(fine, bent) + 1.2 * steps);
    EXPECT_LT(distance(fine, more), 0.02 * voxel_size(field));
  }
}

}  // namespace
}  // namespace tensorray
