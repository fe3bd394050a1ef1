#pragma once
/// A scene file as plain data: the values that the file gives, and defaults for the others. No other file is loaded.
/// Lengths are in world units (those of the field), wavelengths in nm.

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "renderer/camera/camera.h"
#include "renderer/lights/beam.h"
#include "renderer/spectra/spectrum.h"
#include "renderer/textures/test_images.h"
#include "scenes/description/method.h"
#include "scenes/keys/key_visitor.h"
#include "scenes/keys/values.h"
#include "tracing/bending/bending.h"
#include "volumes/files/tensor_files.h"
#include "volumes/tensors/eigenvalues.h"

namespace tensorray {

struct Illuminant {
  std::string name = "D65";  ///< One of `illuminant_names`.
};

struct BlackBody {
  double kelvin = 0;  ///< 100 to 1e9.
};

using SpectrumDescription = std::variant<Illuminant, BlackBody, std::filesystem::path>;

TENSORRAY_VALUE(SpectrumDescription);

/// @throw std::runtime_error naming the file that cannot be read.
Spectrum load_spectrum(const SpectrumDescription& description);

enum class MaterialKind { diffuse, principled, metal, glass };
enum class Metal { gold, silver, copper, aluminium };

struct MaterialDescription {
  MaterialKind kind = MaterialKind::principled;
  Eigen::Vector3d color{0.7, 0.7, 0.7};  ///< Used if the surface has no colours of its own; linear Rec. 709.
  double roughness = 0.4;
  double metallic = 0, specular = 0.5, clearcoat = 0;  ///< principled.
  Metal metal = Metal::gold;                           ///< metal.
  double index = 1.5;                                  ///< glass: index of refraction.
};

inline Words words(MaterialKind) { return {"diffuse", "principled", "metal", "glass"}; }
inline Words words(Metal) { return {"gold", "silver", "copper", "aluminium"}; }

inline void describe(MaterialDescription& material, KeyVisitor& visit) {
  visit("kind", material.kind, "kind of material");
  visit("color", material.color, "colour of a surface without colours of its own, linear Rec. 709", between(0, 1));
  visit("roughness", material.roughness, "roughness: 0 polished, 1 matt (not diffuse)", between(0, 1));
  visit("metallic", material.metallic, "principled: share of metal: 0 plastic, 1 metal", between(0, 1));
  visit("specular", material.specular, "principled: reflection of plastic, 0.5 is 4 %", between(0, 1));
  visit("clearcoat", material.clearcoat, "principled: strength of the clear coat", between(0, 1));
  visit("metal", material.metal, "metal: its kind");
  visit("index", material.index, "glass: index of refraction", between(1.01, 5));
  visit.only_for({"roughness"}, "kind", material.kind,
                 {MaterialKind::principled, MaterialKind::metal, MaterialKind::glass});
  visit.only_for({"metallic", "specular", "clearcoat"}, "kind", material.kind, {MaterialKind::principled});
  visit.only_for({"metal"}, "kind", material.kind, {MaterialKind::metal});
  visit.only_for({"index"}, "kind", material.kind, {MaterialKind::glass});
}

/// What interpolation takes inactive voxels for (Border); `automatic`: `extend` where the field has a surface, or
/// obstacles or bounds are given, which stop light at the body that the active voxels are, else `fade`.
enum class BorderChoice { automatic, fade, extend };

/// Where light bends: `automatic`: within the surface of the field's body, if it has one; `none`: in the whole box.
enum class BoundsChoice { automatic, none };

struct FieldDescription {
  std::filesystem::path file;                   ///< OpenVDB file with the field; empty if `generate` is given.
  std::filesystem::path imported;               ///< The field that an import made of `file`; empty: `file` is one.
  std::string name;                             ///< Name of the field in the file; empty: the only field.
  std::optional<GenerateDescription> generate;  ///< Generated field, instead of a file.
  Derive derive = Derive::none;
  std::string unit;           ///< Of the tensor; empty: that of the file.
  ComponentGrids components;  ///< The grids that are the field's components; empty: found by their names.
  double smooth = 0;          ///< Deviation of the Gaussian that smooths the field, voxels; 0: none.
  bool noise = false;         ///< Whether the field is replaced by its noise alone (keep_noise).
  Eigenvalues eigenvalues = Eigenvalues::automatic;
  Interpolation interpolation = Interpolation::cubic;
  BorderChoice border = BorderChoice::automatic;
  std::optional<double> scale;                               ///< Factor on the flexibility; none: "auto".
  std::variant<BoundsChoice, std::filesystem::path> bounds;  ///< A file: a closed mesh that cuts the volume.

  const std::filesystem::path& file_to_read() const { return imported.empty() ? file : imported; }
};

struct BendingDescription {
  Flexibility flexibility;
  std::optional<Eigen::Vector3d> rgb;  ///< RGB mode: flexibilities of red, green and blue, instead of wavelengths.
  BendingSettings settings;
};

struct ApertureDescription {
  std::optional<Eigen::Vector3d> center;  ///< World; none: the middle of the volume's silhouette.
  Eigen::Vector2d size{1, 1};             ///< Along the right and up axes of the light's frame; > 0.
};

/// How far the beam reaches, if there is no aperture: over the plate, so that undisturbed light is all around the
/// volume's; or as far as the volume's silhouette.
enum class BeamReach { plate, volume };

struct LightDescription {
  /// Direction in which light travels; not zero, any length. None: "auto".
  std::optional<Eigen::Vector3d> direction = Eigen::Vector3d(0, 0, -1);
  std::optional<Eigen::Vector3d> up;  ///< Up axis of aperture and receiver; none: +z, or +y for light along z.
  std::uint64_t photons = 1u << 20;   ///< Approximate number of positions that emit.
  BeamPattern pattern = BeamPattern::stratified;
  SpectrumDescription spectrum;
  double wavelength_min = 380, wavelength_max = 730;
  int wavelength_count = 32;
  int wavelengths_per_photon = 0;  ///< Bands that one photon carries; 0: all.
  double irradiance = 1;           ///< Irradiance of the undisturbed beam, W per world unit²; > 0.
  BeamReach beam = BeamReach::plate;
  std::optional<ApertureDescription> aperture;  ///< Rectangle that light comes from; none: as `beam` says.

  bool fills_plate() const { return beam == BeamReach::plate && !aperture; }
};

struct ReceiverDescription {
  /// Distance of the plate behind the volume, along the light; none: a quarter of the volume's depth.
  std::optional<double> distance;
  std::optional<Eigen::Vector3d> center;  ///< Middle, world; none: behind the middle of the volume, at `distance`.
  std::optional<Eigen::Vector3d> normal;  ///< None: opposite to the light's direction.
  std::optional<Eigen::Vector3d> up;      ///< Up axis of the plate; none: that of the light.
  std::optional<Eigen::Vector2d> size;    ///< Width and height; none: the volume's as light projects it, or 1.25
                                          ///< times the beam's if that does not fill the plate.
  /// Pixels along width and height; none: 512 along the longer side, square pixels.
  std::optional<Eigen::Vector2i> resolution;
};

struct CameraDescription {
  Projection projection = Projection::perspective;
  std::optional<Eigen::Vector3d> position;   ///< World; none: chosen so that everything is visible.
  std::optional<Eigen::Vector3d> target;     ///< If there is a position: what it looks at; none: the scene's middle.
  std::optional<Eigen::Vector3d> direction;  ///< If there is no position: view direction; none: obliquely from above.
  std::optional<Eigen::Vector3d> up;         ///< Up in the picture; none: +z.
  double angle = 30;                         ///< Perspective: angle from lower to upper edge, degrees.
  std::optional<double> height;  ///< Orthographic camera with a position: visible height; none: everything is visible.
  double lens_radius = 0;        ///< Radius of a thin lens; 0: everything is sharp.
  std::optional<double> focus_distance;  ///< Distance of what is sharp; none: that of the target.
  Eigen::Vector2i resolution{800, 800};  ///< Pixels along width and height.
};

enum class LightKind { constant, environment, directional, area, point };

/// How light of a directional light or a point is found that comes to objects through the field.
enum class LightCaustic { automatic, map, photons };

/// An item of `lights`.
struct LightSourceDescription {
  LightKind kind = LightKind::constant;
  Eigen::Vector3d color{1, 1, 1};  ///< Linear Rec. 709; environment: a factor on the picture.
  double strength = 1;  ///< Radiance; directional: irradiance / π; point: the same at a distance of 1 world unit.
  std::optional<Eigen::Vector3d> direction;  ///< directional: where light travels to; area: where its front faces.
  double angle = 0;                          ///< directional: angular diameter of the disk, degrees.
  std::optional<Eigen::Vector3d> center;     ///< area: middle, world.
  Eigen::Vector2d size{1, 1};                ///< area: width and height.
  std::optional<Eigen::Vector3d> position;   ///< point: world.
  std::filesystem::path file;                ///< environment: a latitude-longitude picture.
  std::string layer;                         ///< environment: layer of the file; empty: any.
  double rotation = 0;                       ///< environment: rotation about +z, degrees.
  LightCaustic caustic = LightCaustic::automatic;
  std::string group;  ///< Its light is also a layer of the EXR with this name; empty: it is not.
};

/// A flat rectangle among the objects.
struct PlateDescription {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< World.
  Eigen::Vector3d normal{0, 0, 1};                   ///< Not zero, any length.
  std::optional<Eigen::Vector3d> up;                 ///< Up axis of its texture; none: +z, or +y.
  Eigen::Vector2d size{1, 1};                        ///< Width and height; > 0.
};

/// Paths of light among the objects, as tubes. Seeds, style, radius and colours are those of `integrator`.
struct PathsDescription {
  std::optional<std::uint64_t> count;  ///< Approximate number of seeds; none: that of `integrator.seeds`.
};

enum class Pattern { none, checkerboard };

/// An item of `objects`: a plate, a mesh, or paths.
struct ObjectDescription {
  std::optional<PlateDescription> plate;
  std::filesystem::path file;  ///< A mesh.
  /// Of a mesh: edges look smooth where triangles are turned by at most this, degrees; none: as its normals say.
  std::optional<double> smooth_angle;
  std::optional<PathsDescription> paths;
  std::variant<Pattern, std::filesystem::path> texture = Pattern::none;  ///< A pattern (of a plate), or a picture.
  std::string texture_layer;                                             ///< Layer of the picture; empty: any.
  std::filesystem::path roughness_texture, normal_texture;               ///< Pictures on a mesh; empty: none.
  int squares = 16;                                                      ///< checkerboard: along the shorter side.
  MaterialDescription material;
};

/// `integrator`.
struct IntegratorDescription {
  Word type;                                     ///< Name of the chosen method.
  std::vector<std::shared_ptr<Method>> methods;  ///< All methods, with their settings.

  const Method& method() const;  ///< The chosen method.

  /// The settings of the method that has settings of this type. @throw std::logic_error if there is none.
  template <class Settings>
  const Settings& settings() const {
    for (const auto& method : methods)
      if (const auto* found = dynamic_cast<const MethodWith<Settings>*>(method.get())) return found->settings();
    throw std::logic_error("no method has such settings");
  }
};

/// What is drawn over `image`.
enum class Annotation { scale, axes, legend, body, hidden };

/// How an EXR stores colours and normals.
enum class ExrType { single, half };

struct OutputDescription {
  std::vector<Output> kinds;                           ///< All kinds of output that any method can write.
  std::map<std::string, std::filesystem::path> files;  ///< Files to write, by Output::key.
  bool fluence_bands = false;                          ///< Whether `fluence` also has a grid for each band.
  bool stokes = false;                                 ///< Whether `spectral` has Stokes' parameters.
  ExrType exr_type = ExrType::single;
  std::optional<std::vector<std::string>> exr_layers;  ///< Of `exr`, beside R, G, B and A; none: all.
  std::optional<double> exposure;                      ///< Exposure of `image` in stops; none: "auto".
  bool white_balance = true;  ///< Whether the white of the light is adapted to that of the working space.
  std::string ocio;           ///< OCIO config, as of ColorSettings; empty: $OCIO, or the built-in one.
  std::string display, view;  ///< Empty: the default of the config.
  std::vector<Annotation> annotations;
  bool default_annotations = false;  ///< The method has chosen them: where one has no meaning, it is left out.
  std::string caption;               ///< A line that is drawn over `image`; with the values of keys.

  bool wants(const std::string& key) const { return files.count(key) > 0; }
  bool wants(Annotation annotation) const {
    return std::find(annotations.begin(), annotations.end(), annotation) != annotations.end();
  }
};

/// The axis that points up in a scene, and in the files that it names.
enum class UpAxis { z, y };

struct WorldDescription {
  UpAxis up = UpAxis::z;
  std::string unit;  ///< Of lengths; empty: that of the field's file.
};

struct SceneDescription {
  std::filesystem::path path;  ///< The scene file.
  std::string text;            ///< The scene as JSON, with overrides applied; written into the headers of the outputs.
  std::uint64_t seed = 0;
  WorldDescription world;
  FieldDescription field;
  BendingDescription bending;
  LightDescription light;
  std::vector<std::filesystem::path> obstacles;
  ReceiverDescription receiver;
  IntegratorDescription integrator;
  CameraDescription camera;
  std::vector<LightSourceDescription> lights;
  std::vector<ObjectDescription> objects;
  bool default_lights = true;   ///< No `lights` are given: there are a white sky and a lamp, or a sky and the sun.
  bool default_objects = true;  ///< No `objects` are given: there is a floor.
  OutputDescription output;
  std::vector<std::string> warnings;  ///< Likely mistakes that are allowed; one line each.
  bool judges_scale = true;           ///< Whether notes say how much a given scale shows, which takes probe rays.

  /// From the axes of the scene and its files to those of the program, in which z is up. Positions and directions in
  /// this struct are turned already.
  Eigen::Matrix3d turn() const {
    Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
    if (world.up == UpAxis::y) turn << 1, 0, 0, 0, 0, -1, 0, 1, 0;
    return turn;
  }
};

}  // namespace tensorray
