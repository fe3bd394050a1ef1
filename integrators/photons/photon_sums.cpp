#include "integrators/photons/photon_sums.h"

#include <stdexcept>
#include <string_view>

#include "base/process/work.h"
#include "base/text/copy_bytes.h"

// The bytes: the numbers of SumsHead; for each channel, how its rays ended; the fluence; for each chunk with photons,
// its number, how many they are, and the photons; the light on the plate.

namespace tensorray {
namespace {

struct SumsHead {
  std::uint64_t candidates, ray_steps, tensor_samples;
  std::uint64_t channels, fluence_bytes, is_colored, has_photons, chunks;
};

/// Takes bytes apart from their front.
class SumsReader {
 public:
  explicit SumsReader(const std::string& bytes) : rest_(bytes) {}

  std::string_view take(std::uint64_t count, std::size_t size = 1) {
    if (count > rest_.size() / size) throw DamagedWork("photons that were kept are cut off");
    const std::string_view bytes = rest_.substr(0, count * size);
    rest_.remove_prefix(bytes.size());
    return bytes;
  }

  template <class Value>
  std::vector<Value> values(std::uint64_t count) {
    const std::string_view bytes = take(count, sizeof(Value));
    std::vector<Value> copies(count);
    copy_bytes(static_cast<void*>(copies.data()), bytes.data(), bytes.size());
    return copies;
  }

  std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
};

template <class Value>
void append(const Value* values, std::size_t count, std::string& bytes) {
  bytes.append(reinterpret_cast<const char*>(values), count * sizeof(Value));
}

void add_ends(const std::vector<EndCounts>& ends, PhotonSums& sums) {
  for (std::size_t channel = 0; channel < ends.size(); ++channel)
    for (int end = 0; end < ray_end_count; ++end) sums.ends[channel][end] += ends[channel][end];
}

/// Of a chunk.
void add_photons(SumsReader& reader, PhotonSums& sums) {
  const auto numbers = reader.values<std::uint64_t>(2);
  if (sums.has_photons)
    sums.photons[numbers[0]] = reader.values<PlatePhoton>(numbers[1]);
  else
    reader.take(numbers[1], sizeof(PlatePhoton));
}

}  // namespace

std::string bytes_of(const PhotonSums& sums) {
  std::string fluence;
  if (sums.fluence) sums.fluence->append_sums(fluence);
  std::size_t photons_size = 0;
  for (const auto& [chunk, photons] : sums.photons)
    photons_size += 2 * sizeof chunk + photons.size() * sizeof photons[0];
  const SumsHead head{sums.candidates,
                      sums.ray_steps,
                      sums.tensor_samples,
                      sums.ends.size(),
                      fluence.size(),
                      sums.is_colored ? 1u : 0u,
                      sums.has_photons ? 1u : 0u,
                      sums.photons.size()};
  std::string bytes;
  bytes.reserve(sizeof head + sums.ends.size() * sizeof sums.ends[0] + fluence.size() + photons_size +
                sums.density->sums_size());
  append(&head, 1, bytes);
  append(sums.ends.data(), sums.ends.size(), bytes);
  bytes += fluence;
  for (const auto& [chunk, photons] : sums.photons) {
    const std::uint64_t numbers[] = {chunk, photons.size()};
    append(numbers, 2, bytes);
    append(photons.data(), photons.size(), bytes);
  }
  sums.density->append_sums(bytes);
  return bytes;
}

void add_bytes(const std::string& bytes, PhotonSums& sums) {
  SumsReader reader(bytes);
  const SumsHead head = reader.values<SumsHead>(1).front();
  if (head.channels != sums.ends.size()) throw DamagedWork("photons that were kept have other channels");
  const std::vector<EndCounts> ends = reader.values<EndCounts>(head.channels);
  const std::string_view fluence = reader.take(head.fluence_bytes);
  for (std::uint64_t chunk = 0; chunk < head.chunks; ++chunk) add_photons(reader, sums);
  const bool has_all_outputs = !(sums.fluence && fluence.empty()) && !(sums.has_photons && head.has_photons == 0);
  if (!has_all_outputs || sums.is_colored != (head.is_colored != 0) ||
      reader.rest().size() != sums.density->sums_size())
    throw DamagedWork(
        "the photons that were kept are those of other outputs: from the beginning, ask for the same of `spectral`, "
        "`photons` and `fluence`");
  sums.candidates += head.candidates;
  sums.ray_steps += head.ray_steps;
  sums.tensor_samples += head.tensor_samples;
  add_ends(ends, sums);
  if (sums.fluence) sums.fluence->add_sums(fluence);
  sums.density->add_sums(reader.rest());
}

void collect_in_turn(Team& team, const std::string& mine, std::size_t at_once,
                     const std::function<void(const std::string& bytes)>& take) {
  for (std::size_t process = 1; process < team.count(); ++process) {
    // Nobody sends the next bytes before process 0 has those before.
    std::vector<std::uint64_t> sizes(team.count(), mine.size());
    exchange_parts(team, sizes.size(), sizes.size(),
                   [&](std::size_t each, PartBytes& bytes) { bytes.copy(&sizes[each], sizeof sizes[each]); });
    std::string bytes;
    if (has_all(&team)) bytes.reserve(sizes[process]);
    for (std::size_t begin = 0; begin < sizes[process]; begin += at_once) {
      const bool is_mine = team.index() == process;
      const std::vector<std::string> given = team.collect(is_mine ? mine.substr(begin, at_once) : std::string());
      if (has_all(&team)) bytes += given.at(process);
    }
    if (has_all(&team)) take(bytes);
  }
}

}  // namespace tensorray
