#include "scenes/scene/turning.h"

#include <algorithm>
#include <utility>

namespace tensorray {
namespace {

using Fill = std::function<void(std::size_t i, TensorBlock& block)>;

Fill turned_fill(Fill fill, const Eigen::Matrix3d& turn) {
  return [fill = std::move(fill), turn = Eigen::Matrix3f(turn.cast<float>())](std::size_t i, TensorBlock& block) {
    fill(i, block);
    for (std::size_t k = 0; k < TensorBlock::voxels; ++k)
      if (block.active[k]) block.values[k] = turn * block.values[k].eval() * turn.transpose();
  };
}

/// Turns the vectors that three channels of the picture are, such as normal.X to normal.Z.
void turn_channels(Image& image, const std::string& layer, const char* axes, const Eigen::Matrix3f& turn) {
  const auto first = std::find(image.channels.begin(), image.channels.end(), layer + '.' + axes[0]);
  if (image.channels.end() - first < 3) return;
  const std::size_t count = image.channels.size();
  for (auto i = static_cast<std::size_t>(first - image.channels.begin()); i < image.pixels.size(); i += count) {
    Eigen::Map<Eigen::Vector3f> vector(&image.pixels[i]);
    vector = (turn * vector).eval();
  }
}

}  // namespace

BlockSource turned(BlockSource field, const Eigen::Matrix3d& turn) {
  field.to_world = turn * field.to_world;
  for (Eigen::Vector3d& vertex : field.surface.vertices) vertex = turn * vertex;
  field.fill = turned_fill(std::move(field.fill), turn);
  for (BlockLevel& level : field.finer) level.fill = turned_fill(std::move(level.fill), turn);
  return field;
}

Render turned(Render render, const Eigen::Matrix3d& turn) {
  const Eigen::Matrix3f single = turn.cast<float>();
  turn_channels(render.linear, "normal", "XYZ", single);
  turn_channels(render.linear, "displacement", "xyz", single);
  for (PlatePhoton& photon : render.photons)
    for (Eigen::Vector3f* vector : {&photon.position, &photon.direction, &photon.origin})
      *vector = (single * *vector).eval();
  for (ScalarGrid& grid : render.grids) grid.to_world = turn * grid.to_world;
  turn_paths(render.paths, turn);
  if (render.view)
    for (Eigen::Vector3d* vector : {&render.view->right, &render.view->up}) *vector = (turn * *vector).eval();
  return render;
}

void turn_paths(std::vector<Path>& paths, const Eigen::Matrix3d& turn) {
  for (Path& path : paths)
    for (PathPoint& point : path.points) {
      for (Eigen::Vector3d* vector : {&point.position, &point.direction, &point.change})
        *vector = (turn * *vector).eval();
      point.tensor = (turn * point.tensor * turn.transpose()).eval();
    }
}

}  // namespace tensorray
