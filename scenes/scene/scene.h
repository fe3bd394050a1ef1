#pragma once
/// Everything that a render needs. Immutable after loading.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/process/progress.h"
#include "renderer/color/color.h"
#include "renderer/lights/beam.h"
#include "renderer/spectra/spectrum.h"
#include "scenes/description/description.h"
#include "tracing/bending/bending.h"
#include "tracing/bending/geometry.h"
#include "tracing/scale/auto_scale.h"
#include "volumes/bricks/tensor_field.h"
#include "volumes/tensors/eigenvalues.h"

namespace tensorray {

class KeptResults;

/// What the numbers of a field are; empty: not known.
struct FieldUnits {
  std::string length, tensor;
  bool is_anatomical = false;  ///< World space is RAS: x to the right of a patient, y to the front, z to the head.
};

struct Scene {
  Scene(SceneDescription d, TensorField f, Geometry g, ColorManagement c)
      : description(std::move(d)), field(std::move(f)), geometry(std::move(g)), color(std::move(c)) {}

  SceneDescription description;
  TensorField field;      ///< Preprocessed; values in the units of its file.
  std::string field_key;  ///< Of the field, when it was loaded.
  Geometry geometry;
  ColorManagement color;
  Beam beam;
  BendingSettings bending;  ///< Settings of the scene file, with the scale of the field.

  Spectrum spectrum;  ///< Of the light; empty in RGB mode.

  /// Bands of wavelengths, or in RGB mode the three primaries (wavelength 0).
  std::vector<Band> bands;
  std::vector<LightChannel> channels;  ///< Flexibility and power of each band.

  std::shared_ptr<KeptResults> kept;  ///< Of the field; null: nothing is kept.

  std::shared_ptr<const LoadedMethod> method;  ///< The method that renders the scene.

  FieldUnits file_units;  ///< Of the field's file.
  EigenvalueReport eigenvalues;
  AutoScale scale;
  std::size_t non_finite = 0;      ///< Number of voxels that were not finite and were removed.
  std::vector<std::string> notes;  ///< What was chosen or found, for the user; one line each.
  double seconds = 0;              ///< Duration of loading.
};

/// A field that light can be traced through, and what its preparation found.
struct LoadedField {
  TensorField field;
  EigenvalueReport eigenvalues;
  std::size_t non_finite = 0;
  std::vector<std::string> notes;
  FieldUnits units = {};  ///< Of its file.
  bool is_known = false;  ///< Notes about it, and warnings about the description, were told with an earlier scene.
  std::shared_ptr<KeptResults> kept = nullptr;
};

/// The units that a scene names, else those of the field's file.
FieldUnits units_of(const Scene& scene);

/// Metres in a unit of length; 1 if it is empty, or of another name.
double metres_in(const std::string& unit);

/// What is made of a field's voxels.
struct FieldChoices {
  double smoothing = 0;  ///< Deviation of a Gaussian, voxels; 0: none.
  bool noise = false;    ///< Whether only the noise of the field is kept, before it is smoothed.
  Eigenvalues eigenvalues = Eigenvalues::automatic;
  Interpolant interpolant;
  bool keeps_surface = true;           ///< Whether the field ends at its surface, if it has one.
  Border at_surface = Border::extend;  ///< Instead of the interpolant's, of a field that does.
};

inline bool operator!=(const FieldChoices& a, const FieldChoices& b) {
  return a.smoothing != b.smoothing || a.noise != b.noise || a.eigenvalues != b.eigenvalues ||
         a.interpolant != b.interpolant || a.keeps_surface != b.keeps_surface || a.at_surface != b.at_surface;
}

FieldChoices choices_of(const SceneDescription& description);

/// Removes voxels that are not finite, smooths the others, and then changes their eigenvalues.
/// @param source  Names the field in notes and errors. @throw std::runtime_error if no voxel is left.
LoadedField prepare_field(const BlockSource& blocks, FieldChoices choices, const std::string& source);

/// The field of a description, from its file or generator. @throw as load_scene.
LoadedField load_field(const SceneDescription& description, const Progress& progress);

/// Descriptions of scenes with the same field have the same key: all keys of the field but `scale` and `bounds`, what
/// is between its voxels, whether it keeps its surface, its eigenvalues, and what tells whether its file has changed.
std::string field_key(const SceneDescription& description);

/// The field of a scene that was loaded before, if a description has the same; both share the voxels.
std::optional<LoadedField> field_of(const std::optional<Scene>& before, const SceneDescription& description);

/// SceneDescription → Scene: loads fields, meshes and spectra, and chooses all values that the scene leaves open.
/// @param field  A field that is in memory; then only `scale` and `bounds` of `description.field` are used. Nothing:
/// the field of the description is loaded.
/// @throw std::runtime_error, one line that names the file and the fix; SceneError if a value of the scene does not fit
/// the loaded data; Cancelled.
Scene load_scene(SceneDescription description, const Progress& progress, std::optional<LoadedField> field = {});

/// The surface of a field's body, as what cuts the volume. @param source  Names the field in errors.
/// @throw std::runtime_error, one line that names the fix, if it is not closed.
TriangleMesh closed_surface(TriangleMesh surface, const std::string& source);

/// @param pointer  JSON pointer of the rectangle in the scene file.
/// @throw SceneError if the rectangle is too large, or too far from the volume, for single precision.
void require_near(const Plate& plate, const char* pointer, const SceneDescription& description,
                  const TensorField& field);

/// Whether the light of the scene has a white that pictures can be adapted to. Nearly monochromatic light has none.
bool has_white(const Scene& scene);

/// Matrix from XYZ to the working space. The white of the light becomes neutral if the scene asks for white balance.
Eigen::Matrix3d to_working(const Scene& scene);

/// The field of a scene. Where memory has a bound, processes of one user on one machine that want the same field have
/// one copy of its bricks: the first one loads it, and the others wait, and map its file.
/// @param key  Of the field, and of the program. @throw what `load` throws; Cancelled.
LoadedField share_field(const std::string& key, const std::function<LoadedField()>& load, const Progress& progress);

// The light of a scene as a continuum of wavelengths: narrow bands within its channels, in which light is bent as one.

/// The flexibilities of a scene's light.
struct LightRange {
  std::vector<double> flexibilities;  ///< The two ends of a range, or those of red, green and blue.
  bool is_range = false;
};

LightRange light_range(const Scene& scene);

/// A narrow part of a channel. `begin` and `end` are places in the range of the light, from 0 to 1 (in RGB mode both
/// are the channel's place: 0, ½ or 1).
struct FineBand {
  Band band;
  double begin = 0, end = 0;
  std::size_t channel = 0;
  double weight = 1;  ///< Its part of the channel's power.
};

/// The channel that maps of the light describe: the one nearest to 550 nm, or green.
std::size_t reference_channel(const Scene& scene);

/// Its middle, as a place in the range of the light, from 0 to 1.
double reference_place(const Scene& scene);

/// @param count  Number of bands: a multiple of that of the channels. In RGB mode there is one band a channel.
std::vector<FineBand> fine_bands(const Scene& scene, int count);

}  // namespace tensorray
