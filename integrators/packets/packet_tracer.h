#pragma once
/// @file integrators/packets/packet_tracer.h
/// Traces a batch of rays in packets (packet_kernel.h) inside the field. Outside the field and on surfaces it traces
/// rays one by one (scalar_tracer.h). A part of trace.cpp.

#include "integrators/bending/bending.h"
#include "integrators/bending/scalar_tracer.h"

namespace tensorray {

/// The same as `trace`. @return false if packets cannot trace this batch; the batch is then unchanged.
bool trace_in_packets(const TensorField& field, const Geometry& geometry, const BendingSettings& settings,
                      RayBatch& batch, const Recordings& recordings);

}  // namespace tensorray
