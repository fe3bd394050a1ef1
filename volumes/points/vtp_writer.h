#pragma once
/// @file volumes/points/vtp_writer.h
/// Writes VTK polydata (.vtp) without VTK, which takes four times as long.

#include <filesystem>

#include "volumes/points/poly_data.h"

namespace tensorray {

/// Writes vertices or polylines in place. Arrays are inline, in base64 and not compressed, which most programs can
/// read: data at the end of the file stop Debian 12's ParaView, whose libexpat is newer than itself. Runs on all
/// threads.
/// @throw std::runtime_error with the reason (without the file), also when the disk is full.
void write_vtp_file(const std::filesystem::path& path, const PolyDataView& data);

}  // namespace tensorray
