#pragma once
/// @file scenes/description/description.h
/// A scene file as plain data: what was written, with defaults for what was not. Nothing is loaded yet.
/// Lengths are world units (the field's), wavelengths nm.

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "integrators/bending/bending.h"
#include "integrators/bending/flexibility.h"
#include "renderer/lights/beam.h"
#include "renderer/shading/camera.h"
#include "scenes/description/method.h"
#include "scenes/description/spectrum_description.h"
#include "scenes/keys/generate_grid.h"
#include "volumes/files/tensor_files.h"
#include "volumes/tensors/eigenvalues.h"

namespace tensorray {

struct FieldDescription {
  std::filesystem::path file;                   ///< Either this ...
  std::string name;                             ///< In the file; empty: the only one.
  std::optional<GenerateDescription> generate;  ///< ... or this.
  Derive derive = Derive::none;
  Eigenvalues eigenvalues = Eigenvalues::automatic;
  std::optional<double> scale;   ///< None: "auto".
  std::filesystem::path bounds;  ///< A closed mesh that cuts the volume; empty: none.
};

struct BendingDescription {
  Flexibility flexibility;
  std::optional<Eigen::Vector3d> rgb;  ///< Three flexibilities, one a colour channel, instead of wavelengths.
  BendingSettings settings;
};

struct ApertureDescription {
  std::optional<Eigen::Vector3d> center;  ///< None: the middle of the silhouette.
  Eigen::Vector2d size{1, 1};             ///< Along right and up of the light's frame; > 0.
};

struct LightDescription {
  Eigen::Vector3d direction{0, 0, -1};  ///< Not zero; need not be unit.
  std::optional<Eigen::Vector3d> up;    ///< Frame of aperture and receiver; none: +z, or +y for light along z.
  std::uint64_t photons = 1u << 20;
  BeamPattern pattern = BeamPattern::stratified;
  SpectrumDescription spectrum;
  double wavelength_min = 380, wavelength_max = 730;
  int wavelength_count = 32;
  int wavelengths_per_photon = 0;               ///< 0: all.
  double irradiance = 1;                        ///< W per world unit², of the undisturbed beam; > 0.
  std::optional<ApertureDescription> aperture;  ///< None: the silhouette of the volume.
};

struct ReceiverDescription {
  std::optional<double> distance;  ///< Behind the volume, along the light; none: a quarter of the volume's depth.
  std::optional<Eigen::Vector3d> center;      ///< None: behind the middle of the volume, at `distance`.
  std::optional<Eigen::Vector3d> normal;      ///< None: against the light.
  std::optional<Eigen::Vector3d> up;          ///< None: the light's.
  std::optional<Eigen::Vector2d> size;        ///< None: 1.25 times the extent of the beam.
  std::optional<Eigen::Vector2i> resolution;  ///< Pixels; none: 512 along the longer side, square pixels.
};

struct CameraDescription {
  Projection projection = Projection::perspective;
  std::optional<Eigen::Vector3d> position;   ///< None: chosen so that everything is seen.
  std::optional<Eigen::Vector3d> target;     ///< Of a camera with a position; none: the middle of what there is.
  std::optional<Eigen::Vector3d> direction;  ///< Of a chosen camera's view; none: from above, obliquely.
  std::optional<Eigen::Vector3d> up;         ///< None: +z.
  double angle = 30;
  std::optional<double> height;  ///< Orthographic, with a position: of what is seen.
  double lens_radius = 0;
  std::optional<double> focus_distance;  ///< None: the target's.
  Eigen::Vector2i resolution{800, 800};
};

enum class LightKind { constant, environment, directional, area };

/// An item of `lights`.
struct LightSourceDescription {
  LightKind kind = LightKind::constant;
  Eigen::Vector3d color{1, 1, 1};            ///< Linear Rec. 709; of `environment`, a factor of the picture.
  double strength = 1;                       ///< Radiance; of `directional`, irradiance over π.
  std::optional<Eigen::Vector3d> direction;  ///< directional: in which it travels; area: that it faces.
  double angle = 0;                          ///< directional: of the disk, from rim to rim.
  std::optional<Eigen::Vector3d> center;     ///< area.
  Eigen::Vector2d size{1, 1};                ///< area.
  std::filesystem::path file;                ///< environment: a latitude-longitude picture.
  double rotation = 0;                       ///< environment: about +z.
};

/// `integrator`.
struct IntegratorDescription {
  Word type;                                     ///< The chosen method's name.
  std::vector<std::shared_ptr<Method>> methods;  ///< All that there are, with their settings.

  const Method& method() const;  ///< The chosen one.

  /// The settings of one method. @throw std::logic_error if no method has such settings.
  template <class Settings>
  const Settings& settings() const {
    for (const auto& method : methods)
      if (const auto* found = dynamic_cast<const MethodWith<Settings>*>(method.get())) return found->settings();
    throw std::logic_error("no method has such settings");
  }
};

struct OutputDescription {
  std::vector<Output> kinds;                           ///< All that any method can write.
  std::map<std::string, std::filesystem::path> files;  ///< What is wanted, by Output::key.
  bool fluence_bands = false;                          ///< Whether `fluence` also has a grid for each band.
  std::optional<double> exposure;                      ///< Stops, for `image`; none: "auto".
  bool white_balance = true;                           ///< Adapt the light's white to the working space's.
  std::filesystem::path ocio;                          ///< OCIO config; empty: $OCIO, or the built-in one.
  std::string display, view;                           ///< Empty: the config's default.

  bool wants(const std::string& key) const { return files.count(key) > 0; }
};

struct SceneDescription {
  std::filesystem::path path;  ///< The scene file.
  std::string text;            ///< The scene as JSON, overrides applied: provenance of the pictures.
  std::uint64_t seed = 0;
  FieldDescription field;
  BendingDescription bending;
  LightDescription light;
  std::vector<std::filesystem::path> obstacles;
  ReceiverDescription receiver;
  IntegratorDescription integrator;
  CameraDescription camera;
  std::vector<LightSourceDescription> lights;  ///< Empty: a white sky and a lamp.
  OutputDescription output;
  std::vector<std::string> warnings;  ///< Things that are allowed but likely a mistake, a line each.
};

}  // namespace tensorray
