#include "integrators/flow/node_prediction.h"

#include <algorithm>

namespace tensorray {
namespace {

constexpr std::size_t quarters = 4, quarter_nodes = (range_nodes - 1) / quarters;
constexpr float beside_quarter = 4;  // Nodes beside a quarter may miss so many times as much as its own.

/// The first node of a quarter, and its last one, which is also the first one of the next quarter.
std::size_t first_of(std::size_t quarter) { return quarter * quarter_nodes; }
std::size_t last_of(std::size_t quarter) { return (quarter + 1) * quarter_nodes; }

/// Whether the nodes from `first` to `last` have some of a quarter's between them.
bool overlaps(std::size_t first, std::size_t last, std::size_t quarter) {
  return first < last_of(quarter) && last > first_of(quarter);
}

/// The value at a node of the polynomial through `count` nodes from `first` on.
struct Stencil {
  std::size_t first = 0;
  std::array<float, 4> weights{};
};

/// Stencils of all nodes, for traced nodes that are `step` apart.
struct Polynomials {
  std::size_t step, count;
  std::array<Stencil, range_nodes> stencils;

  explicit Polynomials(std::size_t distance)
      : step(distance), count(std::min<std::size_t>(4, (range_nodes - 1) / distance + 1)) {
    for (std::size_t node = 0; node < range_nodes; ++node) {
      // The first of those that are nearest to the node.
      const std::size_t before = node / step, last = (range_nodes - 1) / step + 1 - count;
      Stencil& stencil = stencils[node];
      stencil.first = std::min(before > 0 ? before - 1 : 0, last) * step;
      const double t = (static_cast<double>(node) - static_cast<double>(stencil.first)) / static_cast<double>(step);
      for (std::size_t i = 0; i < count; ++i) {
        double weight = 1;
        for (std::size_t j = 0; j < count; ++j)
          if (j != i) weight *= (t - static_cast<double>(j)) / (static_cast<double>(i) - static_cast<double>(j));
        stencil.weights[i] = static_cast<float>(weight);
      }
    }
  }

  Eigen::Vector2f at(const Eigen::Vector2f* landings, std::size_t node) const {
    const Stencil& stencil = stencils[node];
    Eigen::Vector2f sum(0, 0);
    for (std::size_t i = 0; i < count; ++i) sum += stencil.weights[i] * landings[stencil.first + i * step];
    return sum;
  }
};

const Polynomials& polynomials(std::size_t step) {
  static const std::array<Polynomials, 5> all{Polynomials(2), Polynomials(4), Polynomials(8), Polynomials(16),
                                              Polynomials(32)};
  return *std::find_if(all.begin(), all.end(), [&](const Polynomials& each) { return each.step == step; });
}

/// What the polynomials through every `step`-th node miss at a node.
Eigen::Vector2f missed(const Eigen::Vector2f* landings, std::size_t step, std::size_t node) {
  return landings[node] - polynomials(step).at(landings, node);
}

/// Whether every `step`-th node from `first` to `last` has one face.
bool is_one_face(std::size_t first, std::size_t last, std::size_t step, const ExitFaces& faces) {
  for (std::size_t node = first + step; node <= last; node += step)
    if (faces[node] != faces[first]) return false;
  return true;
}

/// Whether the nodes from which a quarter's are predicted have one face.
bool is_one_face(std::size_t quarter, std::size_t step, const ExitFaces& faces) {
  const Polynomials& all = polynomials(step);
  const std::size_t first = all.stencils[first_of(quarter) + 1].first, last = all.stencils[last_of(quarter) - 1].first;
  return is_one_face(first, last + (all.count - 1) * step, step, faces);
}

}  // namespace

NodePrediction::NodePrediction(FlowMap& map, std::size_t position, const Parents& parents, const Eigen::Array2f& plate)
    : landings_(&map.landings[position * range_nodes]), ends_(&map.ends[position * range_nodes]), plate_(plate) {
  for (std::size_t i = 0; i < parents.count; ++i) {
    const std::size_t first = parents.positions[i] * range_nodes;
    const auto ends = map.ends.begin() + static_cast<std::ptrdiff_t>(first);
    if (std::any_of(ends, ends + range_nodes, [](RayEnd end) { return end != RayEnd::plate; })) return;
    parents_[i] = &map.landings[first];
  }
  parent_count_ = parents.count;
  for (std::size_t node = 0; parent_count_ > 0 && node < range_nodes; ++node) {
    mean_[node].setZero();
    for (std::size_t i = 0; i < parent_count_; ++i) mean_[node] += parents_[i][node];
    mean_[node] /= static_cast<float>(parent_count_);
  }
}

bool NodePrediction::is_on_plate(std::size_t node) const {
  return landed(node) && (landings_[node].array() >= 0).all() && (landings_[node].array() <= plate_).all();
}

/// Whether light between this node and the next one may fall on the plate.
bool NodePrediction::matters(std::size_t node, std::size_t step) const {
  const std::size_t next = node + step;
  return (landed(node) && landed(next)) || is_on_plate(node) || is_on_plate(next);
}

bool NodePrediction::is_open(std::size_t node) const {
  for (std::size_t quarter = 0; quarter < quarters; ++quarter)
    if (!is_predicted_[quarter] && first_of(quarter) <= node && node <= last_of(quarter)) return true;
  return false;
}

bool NodePrediction::parents_agree(std::size_t step, float tolerance) const {
  for (std::size_t quarter = 0; quarter < quarters; ++quarter)
    if (!parents_agree(quarter, step, tolerance)) return false;
  return true;
}

bool NodePrediction::parents_agree(std::size_t quarter, std::size_t step, float tolerance) const {
  if (parent_count_ == 0) return false;
  // Of two, each differs from the mean as much as the other one.
  for (std::size_t i = parent_count_ == 2 ? 1 : 0; i < parent_count_; ++i) {
    for (std::size_t node = first_of(quarter); node <= last_of(quarter); ++node) {
      const Eigen::Vector2f difference = missed(parents_[i], step, node) - missed(mean_.data(), step, node);
      if (!(difference.norm() <= tolerance)) return false;
    }
  }
  return true;
}

bool NodePrediction::is_smooth(std::size_t quarter, std::size_t step, float tolerance, const ExitFaces& faces) const {
  const std::size_t coarse = 2 * step, reach = (polynomials(coarse).count - 1) * coarse;
  for (std::size_t node = step; node < range_nodes; node += coarse) {
    const bool is_within = overlaps(node - step, node + step, quarter);
    if (!is_within && !overlaps(node - std::min(node, 3 * step), node + 3 * step, quarter)) continue;
    if (!matters(node - step, step) && !matters(node, step)) continue;
    const Stencil& stencil = polynomials(coarse).stencils[node];
    if (!is_within && !is_one_face(stencil.first, stencil.first + reach, coarse, faces)) continue;
    for (std::size_t i = 0; i < polynomials(coarse).count; ++i)
      if (!landed(stencil.first + i * coarse)) return false;
    const float allowed = is_within ? tolerance : beside_quarter * tolerance;
    if (!landed(node) || !(missed(landings_, coarse, node).norm() <= allowed)) return false;
  }
  return true;
}

bool NodePrediction::is_smooth_beside_parents(std::size_t quarter, std::size_t step, float tolerance) const {
  for (std::size_t node = 0; node < range_nodes; node += step)
    if (!landed(node)) return false;
  if (!parents_agree(quarter, step, tolerance)) return false;
  for (std::size_t node = step; node < range_nodes; node += 2 * step) {
    if (!overlaps(node - step, node + step, quarter)) continue;
    const Eigen::Vector2f differs = missed(landings_, 2 * step, node) - missed(mean_.data(), 2 * step, node);
    if (!(differs.norm() <= tolerance)) return false;
  }
  return true;
}

/// Between two traced nodes of which only one landed, the nearer one counts.
Eigen::Vector2f NodePrediction::between(std::size_t node, std::size_t step) const {
  const std::size_t before = node / step * step, after = before + step;
  if (!landed(before) || !landed(after)) return landings_[2 * (node - before) < step ? before : after];
  const Polynomials& all = polynomials(step);
  for (std::size_t i = 0; i < all.count; ++i)
    if (!landed(all.stencils[node].first + i * step)) {
      const float part = static_cast<float>(node - before) / static_cast<float>(step);
      return (1 - part) * landings_[before] + part * landings_[after];
    }
  return all.at(landings_, node);
}

/// Sets the nodes of a quarter that are not traced.
void NodePrediction::set(std::size_t quarter, std::size_t step, bool beside_parents, ExitFaces& faces) {
  for (std::size_t node = first_of(quarter); node <= last_of(quarter); ++node) {
    if (node % step == 0) continue;
    const std::size_t before = node / step * step;
    ends_[node] = ends_[2 * (node - before) < step ? before : before + step];
    faces[node] = faces[before];
    landings_[node] = between(node, step);
    if (beside_parents) landings_[node] += missed(mean_.data(), step, node);
  }
}

bool NodePrediction::predict(std::size_t step, float tolerance, ExitFaces& faces) {
  if (step == 1) return true;
  std::array<bool, quarters> is_ready{}, beside_parents{};
  for (std::size_t quarter = 0; quarter < quarters; ++quarter) {
    if (is_predicted_[quarter] || !is_one_face(quarter, step, faces)) continue;
    beside_parents[quarter] = is_smooth_beside_parents(quarter, step, tolerance);
    // Three nodes do not tell by themselves how smooth landings are.
    is_ready[quarter] =
        beside_parents[quarter] || (step <= quarter_nodes && is_smooth(quarter, step, tolerance, faces));
  }
  const auto is_true = [](bool each) { return each; };
  if (step > quarter_nodes && !std::all_of(is_ready.begin(), is_ready.end(), is_true)) return false;
  for (std::size_t quarter = 0; quarter < quarters; ++quarter) {
    if (!is_ready[quarter]) continue;
    set(quarter, step, beside_parents[quarter], faces);
    is_predicted_[quarter] = true;
  }
  return std::all_of(is_predicted_.begin(), is_predicted_.end(), is_true);
}

}  // namespace tensorray
