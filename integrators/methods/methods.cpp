#include <algorithm>
#include <cstring>

#include "integrators/lens/lens_method.h"
#include "integrators/methods/read_scene.h"
#include "integrators/path_tracing/path_tracing_method.h"
#include "integrators/photon_distribution/photon_distribution_method.h"
#include "integrators/polariscope/polariscope_method.h"
#include "integrators/scene/scene_method.h"
#include "integrators/stretch/stretch_method.h"

namespace tensorray {
namespace {

std::vector<std::shared_ptr<Method>> all_methods() {
  return {photon_distribution_method(), lens_method(), path_tracing_method(), stretch_method(), scene_method(),
          polariscope_method()};
}

}  // namespace

SceneDescription default_scene() {
  SceneDescription scene;
  scene.integrator.methods = all_methods();
  for (const auto& method : scene.integrator.methods) {
    scene.integrator.type.allowed.push_back(method->name());
    for (const Output& output : method->outputs()) {
      const bool is_new =
          std::none_of(scene.output.kinds.begin(), scene.output.kinds.end(),
                       [&output](const Output& other) { return std::strcmp(other.key, output.key) == 0; });
      if (is_new) scene.output.kinds.push_back(output);
    }
  }
  return scene;
}

}  // namespace tensorray
