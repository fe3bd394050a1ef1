#pragma once
/// @file tracing/trace/packet_tracer.h
/// Traces a batch of rays in packets (packet_kernel.h) inside the field. The scalar tracer (scalar_tracer.h)
/// does the rest, ray by ray: the way to the field and behind it, steps that end on surfaces or are too short for
/// single precision, and the last step of rays with differentials.

#include "tracing/bending/bending.h"
#include "tracing/bending/geometry.h"
#include "tracing/bending/ray_record.h"
#include "volumes/bricks/tensor_field.h"

namespace tensorray {

/// The same as `trace`.
/// @param records  Empty, one for each ray; or null.
/// @return false, with the batch unchanged, if packets cannot trace it: they have `splitting4` in cubic fields,
/// `splitting` with a given step there, and no automatic steps with a tolerance below 1e-5.
bool trace_in_packets(const TensorField& field, const Geometry& geometry, const BendingSettings& settings,
                      RayBatch& batch, RayRecord* records);

}  // namespace tensorray
