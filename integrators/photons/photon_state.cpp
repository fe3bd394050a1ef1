#include "integrators/photons/photon_state.h"

#include <cstring>
#include <stdexcept>

namespace tensorray {

std::string bytes_of(const PhotonState& state) {
  const std::uint64_t head[] = {state.next, state.ray_steps, state.tensor_samples};
  std::string bytes(sizeof head + state.ends.size() * sizeof(EndCounts), 0);
  std::memcpy(bytes.data(), head, sizeof head);
  std::memcpy(bytes.data() + sizeof head, state.ends.data(), bytes.size() - sizeof head);
  return bytes + state.sums;
}

PhotonState photon_state(const std::string& bytes, std::size_t channels) {
  std::uint64_t head[3];
  const std::size_t counts = channels * sizeof(EndCounts);
  if (bytes.size() < sizeof head + counts) throw std::runtime_error("photons that were kept have other channels");
  std::memcpy(head, bytes.data(), sizeof head);
  PhotonState state{head[0], head[1], head[2], std::vector<EndCounts>(channels), bytes.substr(sizeof head + counts)};
  std::memcpy(state.ends.data(), bytes.data() + sizeof head, counts);
  return state;
}

}  // namespace tensorray
