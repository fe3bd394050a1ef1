// Traces a ray through a field, and renders a scene:  example SCENE.json

#include <cmath>
#include <cstdio>
#include <optional>
#include <stdexcept>
#include <utility>

#include <tensorray/tensorray.h>

namespace {

/// Light turns about the axis of a rotation. @return how far, radians.
double turn_in_a_rotation() {
  using namespace tensorray;
  Rotation rotation;
  rotation.rate = 1;
  const TensorField field(generate(rotation, default_grid(rotation, 16)));
  const Geometry geometry({box_mesh(field.index_bounds(), field.to_world()), std::nullopt, std::nullopt, {}});
  RayBatch rays;
  rays.add(Eigen::Vector3d(-1, 0, 0), Eigen::Vector3d(1, 0, 0), 0.5);
  trace(field, geometry, BendingSettings(), rays);
  return rays.length[0] > 0 ? std::acos(rays.direction[0].x()) / rays.length[0] : 0;
}

void render_file(const char* scene_file) {
  using namespace tensorray;
  const Progress progress;
  const SceneDescription description = read_scene(scene_file);
  const Scene scene = load_scene(description, progress);
  const Render picture = render(scene, progress);
  OutputFiles files = open_outputs(description.output);
  write_outputs(picture, scene, files);
  commit_outputs(std::move(files));
}

}  // namespace

int main(int argc, char** argv) {
  try {
    std::printf("tensorray %d.%d: %.3f radians per unit of length\n", TENSORRAY_VERSION_MAJOR, TENSORRAY_VERSION_MINOR,
                turn_in_a_rotation());
    if (argc > 1) render_file(argv[1]);
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "example: %s\n", error.what());
    return 2;
  }
}
