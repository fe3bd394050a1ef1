#pragma once
/// Checks rules between several values of a scene file. The limits of each single value are checked by the reader.

#include "base/files/output_file.h"
#include "scenes/description/description.h"

namespace tensorray {

/// Adds warnings about likely mistakes to `scene.warnings`, and removes outputs that the method cannot make.
/// @param json  The scene as written. It shows which values were given and which are defaults.
/// @throw SceneError with the JSON pointer of the wrong value.
void check_scene(SceneDescription& scene, const Json& json, const SceneSource& source);

// The functions below are for Method::check:

/// Whether the scene file gives the key at a JSON pointer.
bool given(const Json& json, const char* pointer);

/// Warns that `key` has no effect if both `key` and `because_of` are given.
void warn_unused(SceneDescription& scene, const Json& json, const char* key, const char* because_of);

/// Draws these over the picture where they have a meaning, if the scene file does not say what is drawn.
void default_annotations(SceneDescription& scene, const Json& json, std::vector<Annotation> annotations);

/// @throw SceneError if the normal is perpendicular to the light, so that the plane would be seen edge-on.
void check_normal(const std::optional<Eigen::Vector3d>& normal, const char* pointer, const LightDescription& light,
                  const SceneSource& source);

/// @throw SceneError if `bytes`, and what the program takes, are more than this process may have (memory_limit).
/// Estimates are within a third of what large pictures take.
/// @param what  The keys that need the memory, for the message.
void check_memory(double bytes, const std::string& what, const SceneSource& source);

/// Checks the memory of the picture of the receiver.
/// @param bytes_per_pixel  What the method needs, with its outputs.
void check_receiver_memory(const SceneDescription& scene, double bytes_per_pixel, const SceneSource& source);

/// Channels of light: bands, or three colours.
int channel_count(const SceneDescription& scene);

/// Refuses a spectral picture in RGB mode, whose light has no wavelengths.
/// @throw SceneError if the scene has both `output.spectral` and `bending.rgb`.
void check_spectral_output(const SceneDescription& scene, const SceneSource& source);

// The files that a render of a scene reads and writes:

/// The scene file, all input files that it names for any method, and the OCIO config of the environment ($OCIO).
std::vector<NamedFile> input_files(const SceneDescription& scene);

/// @param more  Further outputs of the run, in addition to those of the scene. @param read  Further inputs.
/// @throw SceneError if an output is the same file as an input or as another output.
void check_files(const SceneDescription& scene, const std::vector<NamedFile>& more = {},
                 const std::vector<NamedFile>& read = {});

}  // namespace tensorray
