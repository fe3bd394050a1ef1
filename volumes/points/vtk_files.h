#pragma once
/// @file volumes/points/vtk_files.h
/// Points and polylines as VTK polydata (.vtp). Reading starts another program, `tensorray-import`, which contains VTK.
/// Rendering therefore needs no VTK, and where VTK prints or ends the process because a file is damaged, the caller
/// gets an exception. The programs exchange the data in a file without a name (poly_data.h).

#include <filesystem>
#include <set>
#include <string>

#include "volumes/points/point_files.h"
#include "volumes/points/poly_data.h"

namespace tensorray {

/// Writes one vertex per point, the scalars and vectors as point data, and the metadata as string field data; in place,
/// on all threads, and without VTK, which takes four times as long. Arrays are inline, in base64 and not compressed,
/// which most programs can read: data at the end of the file stop Debian 12's ParaView, whose libexpat is newer than
/// itself. @throw std::runtime_error naming the file and the reason, also when the disk is full.
void write_vtp(const std::filesystem::path& path, const PointCloud& points);

/// Writes polylines in the same way, and the texts as string field data. @throw as above.
void write_vtp(const std::filesystem::path& path, const PolylineData& lines);

/// Reads the polylines of a .vtp file in any of VTK's encodings (ASCII, binary or appended; compressed or not; either
/// byte order; any number of pieces), and those of the `wanted` numeric arrays that the file has, as doubles. Ignores
/// everything else. Points that several lines share are repeated; points of no line are dropped.
/// @throw std::runtime_error with the reason (without the file): not VTK polydata, damaged or cut off, a line refers
/// to a point that does not exist, the file announces more than memory holds; Cancelled.
PolylineData read_vtp_lines(const std::filesystem::path& path, const std::set<std::string>& wanted);

}  // namespace tensorray
