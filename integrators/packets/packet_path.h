#pragma once
/// @file integrators/packets/packet_path.h
/// The path of a ray between the ends of its step, in double precision: only few lanes need it. A part of
/// packet_kernel-inl.h.

#include <vector>

#include "integrators/packets/packet_medium.h"

namespace tensorray::packets {

/// Whether the step of a lane, from p to p_next, meets a surface.
bool step_meets_surface(const PacketMedium& medium, const Packet& packet, int lane);

/// Records points between the ends of a lane's step of `splitting4`, which may be long.
void add_inner_points(const PacketMedium& medium, const Packet& packet, int lane, std::vector<StepPoint>& points);

}  // namespace tensorray::packets
