#pragma once
/// @file scenes/description.h
/// A scene file as plain data: what was written, with defaults for what was not. Nothing is loaded yet.
/// Lengths are world units (the field's), wavelengths nm.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "integrators/bending/bending.h"
#include "integrators/bending/flexibility.h"
#include "integrators/lens/lens.h"
#include "renderer/film/density.h"
#include "renderer/lights/beam.h"
#include "renderer/textures/texture.h"
#include "scenes/path_tracing_description.h"
#include "volumes/files/tensor_files.h"
#include "volumes/tensors/eigenvalues.h"
#include "volumes/tensors/generators.h"

namespace tensorray {

/// `field.generate`.
struct GenerateDescription {
  Generator generator;
  GridSettings grid;
};

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
  std::string spectrum = "D65";  ///< An illuminant, "blackbody 5500" (kelvin), or a two-column text file.
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

enum class IntegratorType { photon_distribution, lens, path_tracing };

/// `integrator.image_plane`: at most one of distance, depth and center.
struct ImagePlaneDescription {
  std::optional<double> distance;  ///< Before the volume, along the light; none: a quarter of the volume's depth.
  std::optional<std::vector<double>> depth;  ///< Into the volume, 0 where light enters it and 1 where it leaves: a
                                             ///< picture for each, side by side.
  std::optional<Eigen::Vector3d> center;     ///< None: on the line along the light through the receiver's.
  std::optional<Eigen::Vector3d> normal;     ///< None: the receiver's.
  std::optional<Eigen::Vector3d> up;         ///< None: the receiver's.
  std::optional<Eigen::Vector2d> size;       ///< None: the least that covers the receiver, in the image's proportions.
};

enum class Overlay { none, grid };

struct LensDescription {
  LensMode mode = LensMode::scatter;
  std::string image = "checkerboard";  ///< A built-in one, or a file.
  std::string image_color_space;       ///< Empty: "auto".
  ImagePlaneDescription plane;
  Wrap wrap = Wrap::none;
  int samples = 1;  ///< Per pixel along x and y.
  Overlay overlay = Overlay::none;
};

struct IntegratorDescription {
  IntegratorType type = IntegratorType::photon_distribution;
  DensitySettings density;
  LensDescription lens;
  PathTracingDescription paths;
};

struct OutputDescription {
  std::filesystem::path image;     ///< Display-referred picture (.png .jpg .tif); empty: none.
  std::filesystem::path exr;       ///< Scene-linear EXR; empty: none.
  std::filesystem::path spectral;  ///< Spectral EXR; empty: none.
  std::filesystem::path photons;   ///< Photon map (.vdb points or .vtp); empty: none.
  std::filesystem::path paths;     ///< Bent rays (.vtp or .tck); empty: none.
  std::filesystem::path tubes;     ///< Bent rays as a mesh (.ply or .obj); empty: none.
  std::filesystem::path fluence;   ///< The light inside the volume (.vdb); empty: none.
  bool fluence_bands = false;      ///< Whether `fluence` also has a grid for each band.
  std::optional<double> exposure;  ///< Stops, for `image`; none: "auto".
  bool white_balance = true;       ///< Adapt the light's white to the working space's.
  std::filesystem::path ocio;      ///< OCIO config; empty: $OCIO, or the built-in one.
  std::string display, view;       ///< Empty: the config's default.
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
  std::vector<LightSourceDescription> lights;  ///< Of path tracing; empty: a white sky and a lamp.
  OutputDescription output;
  std::vector<std::string> warnings;  ///< Things that are allowed but likely a mistake, a line each.
};

}  // namespace tensorray
