#pragma once
/// The light of a flow map on the pixels of its plate: each triangle's light is spread evenly over the triangle between
/// its landings, and each pixel gets the exact area that it shares with it.

#include <array>
#include <vector>

#include <Eigen/Core>

#include "base/process/progress.h"
#include "base/process/ranks.h"
#include "renderer/film/film.h"
#include "tracing/flow/flow_map.h"

namespace tensorray {

/// A part of the light that lands together: a narrow band of wavelengths, or a colour in RGB mode.
struct CausticBand {
  double sample = 0;        ///< Its middle, as a place among the wavelength samples of the map.
  double width = 0;         ///< In a range: it goes from half a width before `sample` to half a width after it.
  std::size_t channel = 0;  ///< The channel that it belongs to.
  double weight = 1;        ///< Its part of the channel's power; the sum over the bands of a channel is 1.
  /// The colour that it adds where its irradiance is that of the undisturbed beam.
  Eigen::Vector3d color = Eigen::Vector3d::Zero();
};

/// How finely a spectrum is divided into bands.
struct BandStep {
  double pixels = 1;  ///< Light moves by no more than this from band to band, for 99 of 100 vertices whose light moves.
  int least = 1;      ///< Number of bands, at least; ...
  int most = 128;     ///< ... and at most.
};

/// The number of bands: a multiple of `channels`, whatever the limits are; one a channel if all light bends alike.
int band_count(const FlowMap& map, int channels, const BandStep& step = {});

struct Caustic {
  Film color;       ///< Red, green and blue: the sum of the bands' colours times their irradiance.
  Film irradiance;  ///< If asked for: a plane for each channel, where 1 is the undisturbed beam in that channel.
  std::vector<std::array<double, ray_end_count>> power;  ///< Parts of each channel's power by the end of its light.
  std::vector<EndCounts> ends;                           ///< Number of vertices by the end of each channel's light.
};

/// Distance, in pixels, between the places where a triangle is drawn. (With 1, the light of a sheared strip is within
/// 2%: Caustic.ABandIsSweptInStepsOfAPixel.)
constexpr double usual_step = 0.65;

struct CausticSettings {
  std::size_t channels = 1;
  bool by_channel = true;    ///< Whether the result has the irradiance of each channel.
  double step = usual_step;  ///< Pixels.
  Ranks* ranks = nullptr;    ///< Who have the same map, and draw it together; null: this process is alone.
};

/// Draws each triangle once for each `step` by which its light moves, from the first band to the last. Where light
/// moves little and always ends on the same thing, several bands in a row are drawn as one; where it moves far, a
/// band is drawn at most 16 times (6, if it does not always end on the same thing). If not all corners of a triangle
/// land, it is cut along the edge of the shadow (lit_part); where this is not known, each corner takes a third of the
/// light. That of a corner on the plate is spread over the triangles beside it that land, or if there are none, it is
/// in the pixel where the corner lands. So is that of small triangles at a tear. What lands beside the plate counts as
/// missed.
/// @param plate  The plate of the map.
/// @param bands  In the order of their places, without gaps between those that have a width.
/// The sums are integers, so that films are the same for any number of threads and ranks. All ranks have them; the
/// power of all ends has the root alone. Memory: the films, and 32 bytes for each pixel and thread, if this is no more
/// than 256 MiB; else the plate is drawn in strips. @throw Cancelled; as Ranks::sum.
Caustic draw_caustic(const FlowMap& map, const Plate& plate, const std::vector<CausticBand>& bands,
                     const CausticSettings& settings, const Progress& progress);

}  // namespace tensorray
