#include "tracing/steps/path_tensors.h"

#include "tracing/steps/bending_steps.h"

namespace tensorray {

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
