#pragma once
/// Files that hold results of a render: checkpoints and shards.

#include <filesystem>
#include <string>
#include <vector>

#include "base/process/job.h"
#include "scenes/keys/json_reader.h"
#include "scenes/scene/scene.h"

namespace tensorray {

struct WorkFile {
  Json origin;                       ///< What the results belong to; see origin_of.
  std::filesystem::path scene_file;  ///< Absolute. Paths in the scene are relative to its folder.
  WorkPart part;
  bool is_complete = false;  ///< Whether it has all results of its part.
  Results results;
};

/// Replaces `path` so that it is complete at any moment (output_file.h). @throw std::runtime_error naming the file.
void write_work(const std::filesystem::path& path, const WorkFile& work);

/// @throw std::runtime_error naming the file if it is missing, no such file, cut off or damaged.
WorkFile read_work(const std::filesystem::path& path);

/// The shards of a render, put together: their part has the number of shards.
/// @param files  In any order.
/// @throw std::invalid_argument naming shards that are missing, repeated, incomplete or of another render.
WorkFile read_shards(const std::vector<std::string>& files);

/// The version of the program; the method; the scene with its changes, but without its output files; the scale and the
/// direction of the light, which a scene may leave open; and of each file that the scene reads the size, the time of
/// its last change, and the hash, by which copies on other machines are the same.
/// @param hashes_all  False: large files have no hash, so that they are not read again.
/// @throw std::runtime_error naming a file that cannot be read.
Json origin_of(const Scene& scene, bool hashes_all = true);

/// Whether a file's JSON has all that an origin has.
bool is_origin(const Json& json);

/// The first difference between two origins, as "`/camera/resolution` is [800,800] there, [400,400] here"; empty if
/// there is none. Files are compared by hashes where both have one. @param here  Of the loaded scene.
std::string difference(const Json& there, const Json& here);

/// Sets what a scene leaves open to what the origin has. The scene must be that of the origin.
void set_chosen(const Json& origin, SceneDescription& description);

}  // namespace tensorray
