#include "renderer/materials/reflectance_table.h"

#include <algorithm>

namespace tensorray {
namespace {

constexpr int cells = 16;  ///< Along an edge of the cube of colours.
constexpr int stride = cells + 1;

}  // namespace

ReflectanceTable::ReflectanceTable(const ReflectanceModel& model, const std::vector<Band>& bands,
                                   const Eigen::Matrix3d& xyz_to_rgb)
    : nodes_(bands.size(), stride * stride * stride), colors_(4, bands.size()), luminance_(bands.size()) {
  for (Eigen::Index band = 0; band < luminance_.size(); ++band) {
    colors_.col(band) << xyz_to_rgb * bands[band].xyz, 0;
    luminance_[band] = bands[band].xyz.y();
  }
  for (int node = 0; node < nodes_.cols(); ++node) {
    const Eigen::Vector3d rgb(node % stride, node / stride % stride, node / (stride * stride));
    const ReflectanceSpectrum spectrum = model.spectrum(rgb / cells);
    for (Eigen::Index band = 0; band < luminance_.size(); ++band)
      nodes_(band, node) = static_cast<float>(std::clamp(spectrum.at(bands[band].wavelength), 0.0, 1.0));
  }
}

void ReflectanceTable::reflectance(const Eigen::Vector3f& color, BandsOut reflectance, Eigen::Index first_band) const {
  const Eigen::Array3f place = color.array().max(0).min(1) * cells;
  const Eigen::Array3i node = place.cast<int>().min(cells - 1);
  const Eigen::Array3f above = place - node.cast<float>(), below = 1 - above;
  const auto node_at = [&](int x, int y, int z) {
    return nodes_.col(node[0] + x + stride * (node[1] + y + stride * (node[2] + z)))
        .segment(first_band, reflectance.size());
  };
  const auto line = [&](int y, int z) { return below[0] * node_at(0, y, z) + above[0] * node_at(1, y, z); };
  const auto near = below[1] * line(0, 0) + above[1] * line(1, 0), far = below[1] * line(0, 1) + above[1] * line(1, 1);
  reflectance = (below[2] * near + above[2] * far).cast<double>();
}

}  // namespace tensorray
