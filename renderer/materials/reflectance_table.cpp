#include "renderer/materials/reflectance_table.h"

#include <algorithm>
#include <array>

namespace tensorray {
namespace {

constexpr int cells = 16;  ///< Along an edge of the cube of colours.
constexpr int stride = cells + 1;

}  // namespace

ReflectanceTable::ReflectanceTable(const ReflectanceModel& model, const std::vector<Band>& bands,
                                   const Eigen::Matrix3d& xyz_to_rgb)
    : nodes_(bands.size(), stride * stride * stride), colors_(3, bands.size()), luminance_(bands.size()) {
  for (Eigen::Index band = 0; band < luminance_.size(); ++band) {
    colors_.col(band) = xyz_to_rgb * bands[band].xyz;
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
  std::array<const float*, 8> spectra;
  std::array<float, 8> weights;
  for (int corner = 0; corner < 8; ++corner) {
    const int x = corner & 1, y = corner >> 1 & 1, z = corner >> 2;
    weights[corner] = (x ? above : below)[0] * (y ? above : below)[1] * (z ? above : below)[2];
    spectra[corner] = nodes_.col(node[0] + x + stride * (node[1] + y + stride * (node[2] + z))).data() + first_band;
  }
  for (Eigen::Index band = 0; band < reflectance.size(); ++band) {
    float sum = 0;
    for (int corner = 0; corner < 8; ++corner) sum += weights[corner] * spectra[corner][band];
    reflectance[band] = sum;
  }
}

}  // namespace tensorray
