#include "tools/benchmark/kernels/kernels.h"

#ifdef TENSORRAY_HAS_VTK_FLOW_PATHS

#include <cmath>
#include <memory>

#include <vtkFloatArray.h>
#include <vtkHyperStreamline.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkStreamTracer.h>

namespace tensorray::benchmark {
namespace {

using Image = vtkNew<vtkImageData>;

/// The field as an image in index space, with `components` floats per point. `values` converts a tensor to these.
template <class Values>
std::shared_ptr<Image> make_image(const TestField& test, int components, const Values& values) {
  auto image = std::make_shared<Image>();
  const Eigen::Vector3i last = test.grid.active_box().max();
  (*image)->SetDimensions(last.x() + 1, last.y() + 1, last.z() + 1);
  vtkNew<vtkFloatArray> array;
  array->SetName("field");
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples((*image)->GetNumberOfPoints());
  array->Fill(0);
  for (const TensorBlock& block : test.grid.blocks)
    for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
      if (!block.active[offset]) continue;
      Eigen::Vector3i at = block.origin + TensorBlock::position(offset);
      const auto tuple = values(block.values[offset]);
      array->SetTypedTuple((*image)->ComputePointId(at.data()), tuple.data());
    }
  (*image)->GetPointData()->AddArray(array);
  return image;
}

double way_through(const TestField& test) { return test.field.index_bounds().sizes().norm(); }

/// Streamlines of the vector T·z, from the origins of the rays, by the Runge–Kutta method of order 4. It counts steps,
/// each of which takes four samples.
TraceFunction stream_tracer(const TestField& test) {
  const auto image = make_image(test, 3, [](const Eigen::Matrix3f& T) -> Eigen::Vector3f { return T.col(2); });
  (*image)->GetPointData()->SetActiveVectors("field");
  return [&test, image](RayBatch& batch) {
    vtkNew<vtkPoints> origins;
    for (std::size_t i = 0; i < batch.size(); i += packet_rays) {
      const Eigen::Vector3d at = test.field.to_index() * batch.position[i];
      origins->InsertNextPoint(at.data());
    }
    vtkNew<vtkPolyData> seeds;
    seeds->SetPoints(origins);
    vtkNew<vtkStreamTracer> tracer;
    tracer->SetInputData(*image);
    tracer->SetSourceData(seeds);
    tracer->SetIntegratorTypeToRungeKutta4();
    tracer->SetIntegrationDirectionToBoth();
    tracer->SetIntegrationStepUnit(vtkStreamTracer::LENGTH_UNIT);
    tracer->SetInitialIntegrationStep(step);
    tracer->SetMaximumPropagation(way_through(test));
    tracer->SetMaximumNumberOfSteps(20000);
    tracer->SetTerminalSpeed(0);
    tracer->SetComputeVorticity(false);
    tracer->Update();
    batch.tensor_samples += static_cast<std::uint64_t>(tracer->GetOutput()->GetNumberOfPoints());
  };
}

/// Hyperstreamlines of the minor eigenvector, the direction of the greatest pressure, from the origins of the rays.
/// They have one point for every step.
TraceFunction hyperstreamline_tracer(const TestField& test) {
  constexpr int sides = 3;  // Sides of the tube that VTK makes about the line: the least that it accepts.
  const auto image = make_image(test, 9, [](const Eigen::Matrix3f& T) { return T; });
  (*image)->GetPointData()->SetActiveTensors("field");
  return [&test, image](RayBatch& batch) {
    for (std::size_t i = 0; i < batch.size(); i += packet_rays) {
      // Begin inside: vtkHyperStreamline does not begin on a face.
      const Eigen::Vector3d at = test.field.to_index() * batch.position[i] + test.direction;
      vtkNew<vtkHyperStreamline> tracer;
      tracer->SetInputData(*image);
      tracer->SetStartPosition(at.x(), at.y(), at.z());
      tracer->IntegrateMinorEigenvector();
      tracer->SetIntegrationDirectionToIntegrateBothDirections();
      tracer->SetIntegrationStepLength(step / std::sqrt(3.0));  // In diagonals of a voxel.
      tracer->SetStepLength(step / way_through(test));  // Spacing of the tube's points, in diagonals of the field.
      tracer->SetMaximumPropagationDistance(way_through(test));
      tracer->SetTerminalEigenvalue(0);
      tracer->SetNumberOfSides(sides);
      tracer->Update();
      batch.tensor_samples += static_cast<std::uint64_t>(tracer->GetOutput()->GetNumberOfPoints()) / sides;
    }
  };
}

}  // namespace

std::vector<Kernel> vtk_kernels() {
  std::vector<Kernel> kernels(2);
  kernels[0].name = "VTK, vtkStreamTracer (steps)";
  kernels[0].make = stream_tracer;
  kernels[1].name = "VTK, vtkHyperStreamline (steps)";
  kernels[1].make = hyperstreamline_tracer;
  for (Kernel& kernel : kernels) {
    kernel.follows_the_rule = false;
    kernel.on_one_field = true;
  }
  return kernels;
}

}  // namespace tensorray::benchmark

#else

namespace tensorray::benchmark {

std::vector<Kernel> vtk_kernels() {
  Kernel kernel;
  kernel.name = "VTK, vtkStreamTracer and vtkHyperStreamline";
  kernel.missing = "not installed";
  return {kernel};
}

}  // namespace tensorray::benchmark

#endif
