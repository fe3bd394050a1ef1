#include "volumes/vdb/vdb_archive.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include <openvdb/io/Archive.h>
#include <openvdb/io/DelayedLoadMetadata.h>
#include <openvdb/io/GridDescriptor.h>
#include <tbb/parallel_for.h>

#include "base/errors.h"
#include "base/files/output_file.h"
#include "base/text/byte_order.h"
#include "base/text/content_hash.h"
#include "base/text/text.h"

namespace tensorray {
namespace {

constexpr std::ios::iostate any_failure = std::ios::failbit | std::ios::badbit | std::ios::eofbit;
constexpr std::size_t stream_buffer = 1 << 20;

// OpenVDB's header: magic number, versions of the format (4 bytes) and of the library (8 bytes), a flag, then the
// unique tag as text.
constexpr std::streamoff version_offset = 8, tag_offset = 21;

[[noreturn]] void fail_damaged(const std::filesystem::path& path, const std::string& how) {
  fail(path, "is truncated or damaged" + how + "; copy or write it again");
}

StoredTree stored_tree(const openvdb::io::GridDescriptor& descriptor, std::uint32_t compression) {
  StoredTree tree;
  tree.type = descriptor.gridType();
  tree.half = descriptor.saveFloatAsHalf();
  tree.blosc = compression & openvdb::io::COMPRESS_BLOSC;
  tree.zip = compression & openvdb::io::COMPRESS_ZIP;
  tree.active_only = compression & openvdb::io::COMPRESS_ACTIVE_MASK;
  return tree;
}

/// Reads the table of grids itself: GridDescriptor::read refuses the whole file if one grid has an unknown type.
class Reader : private openvdb::io::Archive {
 public:
  explicit Reader(const std::filesystem::path& path) : path_(path), buffer_(stream_buffer) {
    if (std::filesystem::is_directory(path)) fail(path, "is a folder; name an OpenVDB file");
    if (is_device(path)) fail(path, "is a pipe or a device; write what it gives to a file");
    in_.rdbuf()->pubsetbuf(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
    errno = 0;
    in_.open(path, std::ios::binary);
    if (!in_) fail(path, "cannot be opened: " + std::generic_category().message(errno) + "; check the path");
    in_.exceptions(any_failure);
    size_ = static_cast<std::int64_t>(std::filesystem::file_size(path));
    read_file_header();
  }

  VdbFile read(const std::set<std::string>& wanted) {
    VdbFile file;
    file.metadata = read_metadata();
    const std::int32_t count = readGridCount(in_);
    std::vector<openvdb::io::GridDescriptor> table;
    std::map<std::string, VdbGrid> grids;  // By the names in the file.
    for (std::int32_t i = 0; i < count; ++i) {
      table.push_back(read_descriptor());
      if (inputHasGridOffsets())
        skip(table.back());
      else  // Written as a stream: only reading a grid tells where it ends.
        grids[table.back().uniqueName()] = read_grid(table.back());
    }
    if (inputHasGridOffsets()) grids = read_wanted(table, wanted);
    for (const auto& descriptor : table) {
      VdbGrid grid = wanted.count(name_of(descriptor)) ? grids.at(descriptor.uniqueName()) : VdbGrid();
      grid.name = name_of(descriptor);
      grid.type = descriptor.gridType();
      grid.half = descriptor.saveFloatAsHalf();
      if (grid.grid && descriptor.isInstance()) {
        const VdbGrid& parent = grids.at(descriptor.instanceParentName());
        grid.grid->setTree(parent.grid->baseTreePtr());
        grid.stored = parent.stored;
      }
      file.grids.push_back(std::move(grid));
    }
    return file;
  }

 private:
  static std::string name_of(const openvdb::io::GridDescriptor& descriptor) {
    return openvdb::io::GridDescriptor::nameAsString(descriptor.uniqueName());
  }

  template <class Number>
  Number read_stored() {
    std::array<char, sizeof(Number)> bytes;
    in_.read(bytes.data(), bytes.size());
    return read_number<Number>(bytes.data(), ByteOrder::little);
  }

  void read_file_header() {
    if (size_ < version_offset + 4 || read_stored<std::int64_t>() != openvdb::OPENVDB_MAGIC)
      fail(path_, "is not an OpenVDB file; `tensorray import` makes one of other programs' files");
    const auto version = read_stored<std::uint32_t>();
    if (version > openvdb::OPENVDB_FILE_VERSION)
      fail(path_, "was written by a newer OpenVDB than this program has; write it in an older format");
    if (version < openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION)
      fail(path_, "was written by OpenVDB 2 or older; write it again with a newer one");
    in_.seekg(0);
    readHeader(in_);
    setFormatVersion(in_);
    setLibraryVersion(in_);
    setDataCompression(in_);
  }

  /// The length of what follows. OpenVDB allocates and fills as many bytes as a length says, up to 4 GB, before it
  /// reads.
  std::uint32_t read_length() {
    const std::uint32_t length = read_stored<std::uint32_t>();
    if (length > size_ - in_.tellg()) fail_damaged(path_, "");
    return length;
  }

  std::string read_string() {
    std::string text(read_length(), ' ');
    in_.read(text.data(), static_cast<std::streamsize>(text.size()));
    return text;
  }

  /// As MetaMap::readMeta, but for OpenVDB's table of leaves, which it unpacks whatever its lengths are.
  openvdb::MetaMap read_metadata() {
    openvdb::MetaMap metadata;
    for (std::uint32_t left = read_stored<std::uint32_t>(); left > 0; --left) {
      const std::string name = read_string(), type = read_string();
      const std::streamoff value = in_.tellg(), end = value + 4 + static_cast<std::streamoff>(read_length());
      if (type != openvdb::io::DelayedLoadMetadata::staticTypeName()) {
        const openvdb::Metadata::Ptr read = openvdb::Metadata::isRegisteredType(type)
                                                ? openvdb::Metadata::createMetadata(type)
                                                : std::make_shared<openvdb::UnknownMetadata>(type);
        in_.seekg(value);
        read->read(in_);
        metadata.insertMeta(name, *read);
      }
      in_.seekg(end);
    }
    return metadata;
  }

  openvdb::io::GridDescriptor read_descriptor() {
    static const std::string half_suffix = "_HalfFloat";
    const std::string name = read_string();
    std::string type = read_string();
    const bool half = ends_with(type, half_suffix);
    if (half) type.resize(type.size() - half_suffix.size());
    openvdb::io::GridDescriptor descriptor(name, type, half);
    descriptor.setInstanceParentName(read_string());
    descriptor.setGridPos(read_stored<std::int64_t>());
    descriptor.setBlockPos(read_stored<std::int64_t>());
    descriptor.setEndPos(read_stored<std::int64_t>());
    return descriptor;
  }

  void skip(const openvdb::io::GridDescriptor& descriptor) {
    if (descriptor.getGridPos() < in_.tellg() || descriptor.getEndPos() < descriptor.getGridPos() ||
        descriptor.getEndPos() > size_)
      fail_damaged(path_, "");
    descriptor.seekToEnd(in_);
  }

  /// Reads the grid that begins at the stream's position, without the values of its leaves, and goes behind it.
  VdbGrid read_grid(const openvdb::io::GridDescriptor& descriptor) {
    readGridCompression(in_);
    VdbGrid read;
    if (!value_size(descriptor.gridType()))
      fail(path_, "grid " + name_of(descriptor) + " has the type " + descriptor.gridType() +
                      ", which this program cannot read; write the file without it");
    read.grid = openvdb::GridBase::createGrid(descriptor.gridType());
    static_cast<openvdb::MetaMap&>(*read.grid) = read_metadata();
    read.grid->setSaveFloatAsHalf(descriptor.saveFloatAsHalf());  // Whatever its metadata say.
    const std::streamoff transform = in_.tellg();
    read_length();  // The transform's type is a string.
    in_.seekg(transform);
    read.grid->readTransform(in_);
    if (descriptor.isInstance()) return read;
    const auto stored = std::make_shared<StoredLeaves>();
    stored->file.emplace(path_);
    stored->compression = openvdb::io::getDataCompression(in_);
    stored->tree = stored_tree(descriptor, stored->compression);
    if (!tree_fits(*stored->file, in_.tellg(), stored->tree, stored->leaves)) fail_damaged(path_, "");
    read.grid->readTopology(in_);
    number_leaves(*read.grid, stored->leaves);
    if (!stored->leaves.empty()) in_.seekg(stored->leaves.back().at + stored->leaves.back().bytes);
    read.stored = stored;
    return read;
  }

  /// The file has the leaves in the order of the tree, unless it is damaged.
  void number_leaves(openvdb::GridBase& grid, const std::vector<StoredLeaf>& stored) const {
    std::size_t count = 0;
    grid.apply<FieldGridTypes>([&](auto& typed) {
      for (auto leaf = typed.tree().beginLeaf(); leaf; ++leaf, ++count) {
        if (count >= stored.size() || voxel_mask(*leaf) != stored[count].active) fail_damaged(path_, "");
        leaf->setTransientData(static_cast<openvdb::Index32>(count));
      }
    });
    if (count != stored.size()) fail_damaged(path_, "");
  }

  /// Reads the wanted grids, and the grids whose trees they share, in parallel. Each grid has its own stream.
  std::map<std::string, VdbGrid> read_wanted(const std::vector<openvdb::io::GridDescriptor>& table,
                                             const std::set<std::string>& wanted) {
    std::set<std::string> needed;
    for (const auto& descriptor : table) {
      if (!wanted.count(name_of(descriptor))) continue;
      needed.insert(descriptor.uniqueName());
      if (descriptor.isInstance()) needed.insert(descriptor.instanceParentName());
    }
    std::vector<std::pair<const openvdb::io::GridDescriptor*, VdbGrid>> read;
    for (const auto& descriptor : table)
      if (needed.count(descriptor.uniqueName())) read.emplace_back(&descriptor, VdbGrid());
    tbb::parallel_for(std::size_t{0}, read.size(), [&](std::size_t i) {
      Reader reader(path_);
      read[i].first->seekToGrid(reader.in_);
      read[i].second = reader.read_grid(*read[i].first);
    });
    std::map<std::string, VdbGrid> grids;
    for (const auto& [descriptor, grid] : read) grids[descriptor->uniqueName()] = grid;
    return grids;
  }

  std::filesystem::path path_;
  std::vector<char> buffer_;
  std::ifstream in_;
  std::int64_t size_ = 0;
};

class Writer : private openvdb::io::Archive {
 public:
  explicit Writer(VdbCompression compression) {
    using namespace openvdb::io;
    if (compression == VdbCompression::zip) setCompression(COMPRESS_ZIP | COMPRESS_ACTIVE_MASK);
    if (compression == VdbCompression::none) setCompression(COMPRESS_ACTIVE_MASK);
  }

  void write_file(std::fstream& file, const std::vector<WrittenGrid>& grids, const openvdb::MetaMap& metadata) {
    auto stream_metadata = std::make_shared<openvdb::io::StreamMetadata>();
    openvdb::io::setStreamMetadataPtr(file, stream_metadata, /*transfer=*/false);
    writeHeader(file, /*seekable=*/true);
    metadata.writeMeta(file);
    const auto count = static_cast<std::int32_t>(grids.size());
    file.write(reinterpret_cast<const char*>(&count), sizeof count);
    for (const WrittenGrid& written : grids) write_grid(file, written);
    file.flush();
    make_tag_of_contents(file);
  }

 private:
  /// As Archive::writeGrid, but without a table of leaves: for that, all values must be in memory, and are compressed
  /// twice.
  void write_grid(std::ostream& file, const WrittenGrid& written) const {
    openvdb::GridBase& grid = *written.grid;
    openvdb::io::GridDescriptor descriptor(grid.getName(), grid.type(), grid.saveFloatAsHalf());
    descriptor.writeHeader(file);
    const std::streampos positions = file.tellp();
    descriptor.writeStreamPos(file);
    descriptor.setGridPos(file.tellp());
    setGridCompression(file, grid);
    grid.addStatsMetadata();
    grid.insertMeta(openvdb::GridBase::META_FILE_MEM_BYTES,
                    openvdb::Int64Metadata(static_cast<openvdb::Int64>(grid.memUsage() + written.value_bytes)));
    const std::string compressed = openvdb::io::compressionToString(openvdb::io::getDataCompression(file));
    grid.insertMeta(openvdb::GridBase::META_FILE_COMPRESSION, openvdb::StringMetadata(compressed));
    grid.writeMeta(file);
    grid.writeTransform(file);
    grid.writeTopology(file);
    descriptor.setBlockPos(file.tellp());
    if (written.write_values)
      written.write_values(file);
    else
      grid.writeBuffers(file);
    descriptor.setEndPos(file.tellp());
    file.seekp(positions);
    descriptor.writeStreamPos(file);
    descriptor.seekToEnd(file);
  }

  /// Replaces the random tag in the header by a hash of the bytes after the tag.
  void make_tag_of_contents(std::fstream& file) const {
    const std::streamoff end = file.tellp();
    std::string tag = getUniqueTag();
    std::string stored(tag.size(), ' ');
    file.seekg(tag_offset);
    file.read(&stored[0], static_cast<std::streamsize>(stored.size()));
    if (stored != tag) return;        // The format is not the expected one.
    std::uint64_t low = 0, high = 1;  // Two hashes of the same bytes, as a tag has 128 bits.
    std::vector<char> chunk(stream_buffer);
    for (std::streamoff at = file.tellg(); at < end; at += static_cast<std::streamoff>(chunk.size())) {
      chunk.resize(static_cast<std::size_t>(std::min<std::streamoff>(end - at, stream_buffer)));
      file.read(chunk.data(), static_cast<std::streamsize>(chunk.size()));
      const std::string_view bytes(chunk.data(), chunk.size());
      low = content_hash(bytes, low);
      high = content_hash(bytes, high);
    }
    for (std::size_t i = 0, digit = 0; i < tag.size(); ++i)
      if (tag[i] != '-') {
        tag[i] = "0123456789abcdef"[(digit < 16 ? low : high) >> (digit % 16 * 4) & 15];
        ++digit;
      }
    file.seekp(tag_offset);
    file.write(tag.data(), static_cast<std::streamsize>(tag.size()));
  }
};

constexpr double min_determinant = 1e-14;  // OpenVDB's own limit is 3e-15.

/// OpenVDB multiplies row vectors from the left, Eigen column vectors from the right.
openvdb::Mat4d to_openvdb(const Eigen::Affine3d& affine) {
  openvdb::Mat4d matrix;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) matrix(column, row) = affine.matrix()(row, column);
  return matrix;
}

Eigen::Affine3d to_eigen(const openvdb::Mat4d& matrix) {
  Eigen::Affine3d affine;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) affine.matrix()(row, column) = matrix(column, row);
  return affine;
}

double length_unit(const std::filesystem::path& path, const openvdb::GridBase& grid) {
  const auto stored = grid.getMetadata<openvdb::StringMetadata>(length_unit_key);
  if (!stored) return 1;
  char* end = nullptr;
  const double unit = std::strtod(stored->value().c_str(), &end);
  if (*end != '\0' || !(unit > 0) || !std::isfinite(unit))
    fail(path, "grid " + grid.getName() + " has a " + length_unit_key + " that is no positive number; write it again");
  return unit;
}

}  // namespace

VdbFile read_vdb(const std::filesystem::path& path, const std::set<std::string>& wanted) {
  openvdb::initialize();
  try {
    return Reader(path).read(wanted);
  } catch (const std::ios_base::failure&) {
    fail_damaged(path, "");
  } catch (const openvdb::Exception& error) {
    fail_damaged(path, " (" + one_line(error.what()) + ")");
  } catch (const std::bad_alloc&) {
    fail_damaged(path, ", or larger than the memory");
  } catch (const std::logic_error&) {  // A damaged length, or a name that is not in a table.
    fail_damaged(path, "");
  }
}

void fail_damaged_voxels(const std::filesystem::path& path) { fail_damaged(path, ""); }

void write_vdb(const std::filesystem::path& path, const std::vector<WrittenGrid>& grids,
               const openvdb::MetaMap& metadata, VdbCompression compression) {
  openvdb::initialize();
  std::vector<char> buffer(stream_buffer);
  std::fstream file;
  file.rdbuf()->pubsetbuf(buffer.data(), static_cast<std::streamsize>(buffer.size()));
  errno = 0;
  try {
    file.exceptions(any_failure);
    file.open(path, std::ios::in | std::ios::out | std::ios::binary | std::ios::trunc);
    Writer(compression).write_file(file, grids, metadata);
    file.close();
  } catch (const std::ios_base::failure&) {
    fail(path, "cannot be written: " + (errno ? std::generic_category().message(errno) : "the write failed"));
  } catch (const openvdb::Exception& error) {
    fail(path, "cannot be written: " + one_line(error.what()));
  }
}

LengthUnit length_unit_for(double determinant) {
  if (!(std::abs(determinant) < min_determinant) || determinant == 0) return {};
  const std::string text = "1e" + std::to_string(static_cast<int>(std::floor(std::log10(std::abs(determinant)) / 3)));
  return {std::stod(text), text};  // The number that a reader gets.
}

void note_unit(openvdb::GridBase& grid, const LengthUnit& unit) {
  if (unit.value != 1) grid.insertMeta(length_unit_key, openvdb::StringMetadata(unit.text));
}

void place(openvdb::GridBase& grid, const Eigen::Affine3d& to_world) {
  const LengthUnit unit = length_unit_for(to_world.linear().determinant());
  grid.setTransform(openvdb::math::Transform::createLinearTransform(
      to_openvdb(Eigen::Affine3d(to_world.matrix().topRows<3>() / unit.value))));
  note_unit(grid, unit);
}

Eigen::Affine3d placement(const std::filesystem::path& path, const openvdb::GridBase& grid) {
  if (!grid.transform().isLinear())
    fail(path, "grid " + grid.getName() + " has a transform that is not affine (a frustum); resample it first");
  Eigen::Affine3d affine = to_eigen(grid.transform().baseMap()->getAffineMap()->getMat4());
  affine.matrix().topRows<3>() *= length_unit(path, grid);
  if (!affine.matrix().allFinite() || !affine.inverse().matrix().allFinite())
    fail(path, "grid " + grid.getName() + " has a transform that cannot be inverted; give it voxels of some size");
  return affine;
}

}  // namespace tensorray
