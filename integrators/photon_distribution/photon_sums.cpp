#include "integrators/photon_distribution/photon_sums.h"

namespace tensorray {
namespace {

/// Which light it is, and what is kept of it.
struct Kind {
  std::uint64_t channels = 0;
  std::uint32_t is_colored = 0, has_fluence = 0, has_photons = 0;
};

void add_photons(Archive& archive, PhotonSums& sums) {
  std::uint64_t chunks = sums.photons.size(), chunk = 0;
  archive.copy(chunks);
  for (auto& [number, photons] : sums.photons) {
    if (archive.reads()) break;
    chunk = number;
    archive.copy(chunk);
    archive.copy_list(photons);
  }
  for (std::uint64_t i = 0; archive.reads() && i < chunks; ++i) {
    std::vector<PlatePhoton> photons;
    archive.copy(chunk);
    archive.copy_list(photons);
    if (sums.has_photons) sums.photons[chunk] = std::move(photons);
  }
}

/// As bytes of their own, which those who do not want it leave out.
void add_fluence(Archive& archive, PhotonSums& sums) {
  std::string bytes;
  if (sums.fluence && !archive.reads()) {
    Archive fluence;
    sums.fluence->copy_sums(fluence);
    bytes = fluence.take();
  }
  archive.copy_list(bytes);
  if (!sums.fluence || !archive.reads()) return;
  Archive fluence(bytes);
  sums.fluence->copy_sums(fluence);
  fluence.finish();
}

}  // namespace

void copy_sums(Archive& archive, PhotonSums& sums) {
  const Kind wanted{sums.ends.size(), sums.is_colored, sums.fluence != nullptr, sums.has_photons};
  Kind kind = wanted;
  archive.copy(kind);
  if (kind.channels != wanted.channels || kind.is_colored != wanted.is_colored ||
      kind.has_fluence < wanted.has_fluence || kind.has_photons < wanted.has_photons)
    throw DamagedArchive(
        "the photons that were kept are those of other outputs: from the beginning, ask for the same of `spectral`, "
        "`photons` and `fluence`");
  for (std::uint64_t* count : {&sums.candidates, &sums.ray_steps, &sums.tensor_samples}) archive.copy_sums(count, 1);
  for (EndCounts& ends : sums.ends) archive.copy_sums(ends.data(), ends.size());
  add_fluence(archive, sums);
  add_photons(archive, sums);
  sums.density->copy_sums(archive);
}

}  // namespace tensorray
