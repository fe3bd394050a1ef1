#include "base/geometry/triangle_mesh.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace tensorray {

std::size_t open_edges(const TriangleMesh& mesh) {
  using Edge = std::pair<std::uint32_t, std::uint32_t>;
  std::vector<Edge> forwards, backwards;  // From the lower to the higher vertex index, and the reverse.
  for (const auto& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t from = t[i], to = t[(i + 1) % 3];
      (from < to ? forwards : backwards).push_back(std::minmax(from, to));
    }
  std::sort(forwards.begin(), forwards.end());
  std::sort(backwards.begin(), backwards.end());
  std::vector<Edge> open;
  std::set_symmetric_difference(forwards.begin(), forwards.end(), backwards.begin(), backwards.end(),
                                std::back_inserter(open));
  return open.size();
}

}  // namespace tensorray
