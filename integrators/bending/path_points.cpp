#include "integrators/bending/path_points.h"

#include "integrators/bending/bending_steps.h"

namespace tensorray {

PathPoint path_point(const RayPoint& point) {
  PathPoint result;
  result.position = point.position;
  result.direction = point.direction;
  result.length = point.length;
  result.in_field = point.in_field;
  return result;
}

void set_tensors(const TensorField& field, double strength, PathPoints& points) {
  TensorSampler sampler(field);
  bending_steps::RayMedium<1> medium{sampler, strength};
  for (PathPoint& point : points) {
    if (!point.in_field) continue;
    point.change = medium.derivative({point.position, point.direction, 0}).V;
    point.tensor = medium.T;
  }
}

}  // namespace tensorray
