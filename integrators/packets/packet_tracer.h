#pragma once
/// @file integrators/packets/packet_tracer.h
/// Traces a batch of rays by packets (packet_kernel.h) where these can, and one by one (scalar_tracer.h) where not: to
/// the volume, on surfaces within it, and beyond it. A part of bending.cpp.

#include "integrators/bending/bending.h"
#include "integrators/bending/scalar_tracer.h"

namespace tensorray {

/// As `trace` does. @return false if this batch is nothing for packets; it is unchanged then.
bool trace_in_packets(const TensorField& field, const Geometry& geometry, const BendingSettings& settings,
                      RayBatch& batch, const Recordings& recordings);

}  // namespace tensorray
