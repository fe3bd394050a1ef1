#pragma once
/// What readers of voxel files share: headers of text, and numbers that are plain bytes in any order of the axes.

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "base/text/byte_order.h"
#include "volumes/grids/page_memory.h"

namespace tensorray {

/// @throw std::runtime_error naming the path, if it leads to no file.
void require_file(const std::filesystem::path& path);

/// @throw std::runtime_error naming the path and what `is_what` says, unless a transform is finite and has an inverse.
void require_invertible(const std::filesystem::path& path, const Eigen::Affine3d& transform,
                        const std::string& is_what);

/// How many numbers there are at each voxel, in words for errors, and whether a file may have so many.
inline bool is_component_count(double count, bool is_mask) {
  return is_mask ? count == 1 : count == 3 || count == 6 || count == 9;
}
inline const char* component_words(bool is_mask) {
  return is_mask ? "a mask has one number at each voxel"
                 : "a tensor has six or nine numbers at each voxel, a vector three";
}

struct NumberType {
  const char* name = nullptr;
  int bytes = 0;  ///< 0: bits, of which the first is the highest of a byte (masks of MRtrix).
  double (*read)(const char* bytes, ByteOrder order) = nullptr;
};

/// The type with a name as in "Float32", "uint8", without a byte order. @throw std::runtime_error naming the path, and
/// the type as `shown`, if there is no such type.
NumberType number_type(const std::filesystem::path& path, const std::string& name, const std::string& shown);

/// Where bytes are in a file.
struct RawPlace {
  std::filesystem::path file;
  std::uint64_t offset = 0;    ///< Of the bytes, or of the compressed stream.
  bool is_compressed = false;  ///< A stream of zlib, or streams of gzip, which end with the file or before.
  std::uint64_t skipped = 0;   ///< Bytes of the stream's contents that are before the wanted ones.
};

/// Reads at most `count` bytes. @throw std::runtime_error naming the file: it cannot be read, or its stream is damaged.
std::vector<char, PageAllocator<char>> read_some(const RawPlace& place, std::size_t count);

/// The lines of a header of text.
struct HeaderLines {
  std::filesystem::path path;
  std::map<std::string, std::string> values;  ///< By name; those of lines with one name, with line ends between them.
  std::uint64_t end = 0;                      ///< Offset of what follows the last line.

  std::string text(const std::string& name) const;  ///< Empty if there is none.

  /// The numbers between blanks or commas; `standard` if there is no such name.
  /// @throw std::runtime_error naming the file and the name, if there is anything else.
  std::vector<double> numbers(const std::string& name, std::vector<double> standard = {}) const;
};

/// Reads lines of a name, a separator and a value, up to one with the name `last`, in at most 4 MB of what `place` has.
HeaderLines header_lines(const RawPlace& place, char separator, const std::string& last);

/// Numbers of voxels.
struct RawVoxels {
  std::shared_ptr<const char> bytes;
  NumberType type;
  ByteOrder order = host_byte_order();
  std::int64_t first = 0;                 ///< Which number is component 0 of voxel (0, 0, 0).
  std::array<std::int64_t, 4> strides{};  ///< From one x, y, z or component to the next, in numbers; may be negative.
  bool by_columns = false;                ///< The components are the columns of a 3 x 3 matrix, one after the other.
  double slope = 1, intercept = 0;        ///< The value is slope · number + intercept.
};

/// The numbers of size.x() · size.y() · size.z() · components values: what is not compressed is mapped, and read when
/// it is needed, so that the file must not change meanwhile. Checks first that the file may hold them.
/// @throw std::runtime_error naming `path`, the file that the user gave.
std::shared_ptr<const char> read_numbers(const std::filesystem::path& path, const RawPlace& place,
                                         const NumberType& type, const Eigen::Vector3i& size, int components);

/// The `read_slice` of a lattice (lattice.h).
std::function<void(int z, double* values)> slices_of(RawVoxels voxels, const Eigen::Vector3i& size, int components);

}  // namespace tensorray
