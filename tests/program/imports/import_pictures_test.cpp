// Imported tensors turn with their voxels: files that are turned or mirrored give pictures that are turned or mirrored.

#include "renderer/images/image.h"
#include "tests/program/import_support.h"

namespace tensorray {
namespace {

using namespace test;

class ImportPictures : public Import {
 protected:
  /// The light on a plate behind the field of FILE. The caller turns light and plate with the field.
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
    scene["integrator"] = {{"type", "photon_distribution"}, {"density", {{"kind", "gaussian"}, {"tau", 1.5}}}};
    write("scene.json", scene.dump());
    run_well({"render", "scene.json", "-q", "-o", "picture.exr"});
    return read_image(in_folder("picture.exr"));
  }
};

/// The greatest difference between pixels, in units of the undisturbed plate. `where` maps pixels of `a` to `b`.
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

/// Limit for equal pictures. Photons start on a grid that turns with the light, so that only the rounding of 32-bit
/// rays and pixels differs.
constexpr double same = 0.01;
/// Limit for different pictures: much more than `same`.
constexpr double different = 0.3;

const Vector3d slanted(0.4, -0.3, -0.85), up(0, 1, 0);

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
  // FSL's first axis points left in both files, so that the components of the mirrored head are the same as those of
  // the other head in world axes.
  write("fsl.nii", nifti(place(mirror), components(Matrix3d::Identity(), row_by_row)));
  const Vector3d light = -Vector3d::UnitZ();
  const auto mirrored = [](int x, int y) { return std::array<int, 2>{63 - x, y}; };
  const Image world = picture({"world.nii", "--order", "mrtrix"}, light, up);
  EXPECT_LT(difference(picture({"mirrored.nii", "--order", "mrtrix"}, light, up), world, mirrored), same);
  EXPECT_LT(difference(picture({"fsl.nii", "--order", "fsl"}, light, up), world, mirrored), same);
  EXPECT_GT(difference(picture({"mirrored.nii", "--order", "fsl"}, light, up), world, mirrored), different);
}

}  // namespace
}  // namespace tensorray
