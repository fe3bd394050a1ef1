#include "integrators/seeds/seeds.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>

#include <tbb/parallel_for.h>

#include "base/constants.h"
#include "base/errors.h"
#include "base/geometry/box.h"
#include "base/text/text.h"
#include "renderer/sampling/random.h"
#include "volumes/sampling/brick_point.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {
namespace {

constexpr double disk_distance = 0.75;  // In units of √(area / count); random packing reaches 0.83.
constexpr std::uint64_t max_disks = 10'000'000;

void require_some(std::uint64_t count) {
  if (count == 0) throw std::invalid_argument("the count of seeds must be 1 or more");
}

/// Points in a grid whose cells are too small for two. It finds whether a point lies within a distance of another one.
class NeighbourGrid {
 public:
  NeighbourGrid(const Eigen::Vector2d& corner, const Eigen::Vector2d& extent, double distance)
      : corner_(corner),
        distance_(distance),
        cell_(distance / std::sqrt(2.0)),
        columns_(static_cast<int>(extent.x() / cell_) + 1),
        rows_(static_cast<int>(extent.y() / cell_) + 1),
        cells_(static_cast<std::size_t>(columns_) * rows_, empty) {}

  /// Adds `point` if no other point is nearer than the distance. @return whether it was added.
  bool add(const Eigen::Vector2d& point) {
    const Eigen::Vector2i at = ((point - corner_) / cell_).cast<int>();
    for (int y = std::max(at.y() - 2, 0); y <= std::min(at.y() + 2, rows_ - 1); ++y)
      for (int x = std::max(at.x() - 2, 0); x <= std::min(at.x() + 2, columns_ - 1); ++x)
        if (const std::uint32_t other = cell(x, y); other != empty && (points_[other] - point).norm() < distance_)
          return false;
    cell(at.x(), at.y()) = static_cast<std::uint32_t>(points_.size());
    points_.push_back(point);
    return true;
  }

  const std::vector<Eigen::Vector2d>& points() const { return points_; }

 private:
  static constexpr std::uint32_t empty = 0xffffffffu;
  std::uint32_t& cell(int x, int y) { return cells_[static_cast<std::size_t>(y) * columns_ + x]; }

  Eigen::Vector2d corner_;
  double distance_, cell_;
  int columns_, rows_;
  std::vector<std::uint32_t> cells_;
  std::vector<Eigen::Vector2d> points_;
};

constexpr std::uint32_t block = 1u << 16;  // Candidates that are evaluated between two checks of their number.
constexpr std::uint32_t enough_to_give_up = 1u << 20;  // Stop after so many candidates if none is selected.
constexpr std::uint32_t max_candidates = 1u << 26;

/// The sequence of points among which seeds are selected.
struct CandidateSequence {
  Eigen::AlignedBox3d box;
  std::uint64_t seed;

  Eigen::Vector3d at(std::uint32_t i) const {
    const Eigen::Vector3d u(sobol(seed, i, 0), sobol(seed, i, 1), sobol(seed, i, 2));
    return box.min() + u.cwiseProduct(box.sizes());
  }
};

/// Candidates that are sampled together.
struct Candidates {
  static constexpr std::uint32_t count = 1024;
  float places[3][sampled_room(count)];
  float tensors[9][sampled_room(count)];
  bool inside[count];
};

/// Sets the values of the candidates from `first` on; NaN outside the extent.
void judge_some(const TensorField& field, const Threshold& threshold, const CandidateSequence& sequence,
                std::uint32_t first, Candidates& candidates, double* values) {
  const BrickPoint corner = brick_point(field, field.voxels().min());
  const Eigen::Vector3i first_brick(corner.brick[0], corner.brick[1], corner.brick[2]);
  const Eigen::Vector3d origin = index_position({corner.brick, {}});
  for (std::uint32_t i = 0; i < Candidates::count; ++i) {
    const Eigen::Vector3d index = field.to_index() * sequence.at(first + i);
    candidates.inside[i] = field.index_bounds().contains(index);
    for (int axis = 0; axis < 3; ++axis) candidates.places[axis][i] = static_cast<float>(index[axis] - origin[axis]);
  }
  const IndexPoints points{
      first_brick, {candidates.places[0], candidates.places[1], candidates.places[2]}, Candidates::count};
  sample_tensors(field, points, 1, candidates.tensors[0], sampled_room(Candidates::count));
  for (std::uint32_t i = 0; i < Candidates::count; ++i) {
    if (!candidates.inside[i]) continue;
    Eigen::Matrix3d tensor;
    for (int component = 0; component < 9; ++component)
      tensor.data()[component] = double{candidates.tensors[component][i]};
    values[i] = invariant(threshold.invariant, tensor);
  }
}

/// Values of the candidates from `first` on; NaN outside the extent.
std::vector<double> judge(const TensorField& field, const Threshold& threshold, const CandidateSequence& sequence,
                          std::uint32_t first) {
  std::vector<double> values(block, std::nan(""));
  tbb::parallel_for(0u, block / Candidates::count, [&](std::uint32_t i) {
    const auto candidates = std::make_unique<Candidates>();
    const std::uint32_t begin = i * Candidates::count;
    judge_some(field, threshold, sequence, first + begin, *candidates, &values[begin]);
  });
  return values;
}

[[noreturn]] void refuse(const Threshold& threshold, std::size_t found, std::uint64_t count, double smallest,
                         double largest) {
  std::ostringstream text;
  text << "only " << found << " of " << count << " seeds found where the threshold wants values from " << threshold.min
       << " to " << threshold.max << ": in the box they are from " << smallest << " to " << largest
       << "; widen the threshold, or ask for fewer seeds";
  throw std::invalid_argument(text.str());
}

std::vector<std::string> words_of(std::string line) {
  const std::string separators = " \t\r,;";
  line.resize(std::min(line.find('#'), line.size()));
  std::vector<std::string> words;
  for (std::size_t first = 0; (first = line.find_first_not_of(separators, first)) != std::string::npos;) {
    const std::size_t last = std::min(line.find_first_of(separators, first), line.size());
    words.push_back(line.substr(first, last - first));
    first = last;
  }
  return words;
}

/// A line, which ends with a line feed, a carriage return, or both. @return false at the end of the file.
bool get_line(std::istream& file, std::string& line) {
  line.clear();
  std::istream::int_type c = 0;
  while ((c = file.get()) != std::istream::traits_type::eof() && c != '\n' && c != '\r') line += static_cast<char>(c);
  if (c == '\r' && file.peek() == '\n') file.get();
  return !line.empty() || c != std::istream::traits_type::eof();
}

bool is_header(const std::vector<std::string>& words) {
  return std::none_of(words.begin(), words.end(), [](const std::string& word) { return parse_number(word); });
}

void add_seed(const std::vector<std::string>& words, SeedList& seeds) {
  double numbers[6];
  for (std::size_t i = 0; i < words.size(); ++i) {
    numbers[i] = parse_number(words[i]).value_or(NAN);
    if (!std::isfinite(numbers[i]))
      throw std::runtime_error("\"" + escaped(words[i].substr(0, 40)) + "\" is not a finite number");
  }
  seeds.positions.emplace_back(numbers[0], numbers[1], numbers[2]);
  if (words.size() == 3) return;
  const Eigen::Vector3d direction = Eigen::Vector3d(numbers[3], numbers[4], numbers[5]).stableNormalized();
  if (direction.isZero()) throw std::runtime_error("the direction has length zero: give a vector that is not zero");
  seeds.directions.push_back(direction);
}

}  // namespace

std::vector<Eigen::Vector3d> grid_seeds(const Beam& beam, std::uint64_t count) {
  require_some(count);
  const BeamSampler sampler(beam, BeamPattern::grid, count, 0);
  std::vector<Eigen::Vector3d> seeds;
  Emission emission;
  for (std::uint64_t i = 0; i < sampler.candidates(); ++i)
    if (sampler.sample(i, emission)) seeds.push_back(emission.origin);
  return seeds;
}

/// Dart throwing. The discs, which do not overlap, cover a fraction of 0.44 of the area. Random darts reach 0.547
/// before no room is left, so that the loop ends.
std::vector<Eigen::Vector3d> poisson_disk_seeds(const Beam& beam, std::uint64_t count, std::uint64_t seed) {
  require_some(count);
  if (count > max_disks) throw std::invalid_argument("there are at most 10,000,000 Poisson disk seeds: use the grid");
  const double distance = disk_distance * std::sqrt(area(beam.aperture) / static_cast<double>(count));
  const Eigen::AlignedBox2d box = box_of(beam.aperture);
  NeighbourGrid grid(box.min(), box.sizes(), distance);
  const BeamSampler sampler(beam, BeamPattern::random, count, seed);
  Emission emission;
  for (std::uint64_t dart = 0; grid.points().size() < count; ++dart) {
    if (!sampler.sample(dart, emission)) continue;
    const Eigen::Vector3d from_center = emission.origin - beam.center;
    grid.add({from_center.dot(beam.right), from_center.dot(beam.up)});
  }
  std::vector<Eigen::Vector3d> seeds;
  for (const Eigen::Vector2d& at : grid.points()) seeds.push_back(beam.start(at));
  return seeds;
}

std::vector<Eigen::Vector3d> line_seeds(const Eigen::Vector3d& from, const Eigen::Vector3d& to, std::uint64_t count) {
  require_some(count);
  if (count == 1) return {(from + to) / 2};
  std::vector<Eigen::Vector3d> seeds;
  for (std::uint64_t i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) / static_cast<double>(count - 1);
    seeds.push_back((1 - t) * from + t * to);
  }
  return seeds;
}

std::vector<Eigen::Vector3d> sphere_seeds(const Eigen::Vector3d& center, double radius, std::uint64_t count,
                                          std::uint64_t seed) {
  require_some(count);
  if (count > (std::uint64_t{1} << 32)) throw std::invalid_argument("there are at most 2^32 seeds in a sphere");
  if (!(radius > 0)) throw std::invalid_argument("the radius of a sphere of seeds must be positive");
  std::vector<Eigen::Vector3d> seeds;
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto u = [&](std::uint32_t dimension) { return sobol(seed, static_cast<std::uint32_t>(i), dimension); };
    const double r = radius * std::cbrt(u(0)), z = 1 - 2 * u(1), across = std::sqrt(1 - z * z), turn = 2 * pi * u(2);
    seeds.push_back(center + r * Eigen::Vector3d(across * std::cos(turn), across * std::sin(turn), z));
  }
  return seeds;
}

std::vector<Eigen::Vector3d> threshold_seeds(const TensorField& field, const Threshold& threshold, std::uint64_t count,
                                             std::uint64_t seed) {
  if (count == 0) throw std::invalid_argument("the count of seeds must be 1 or more");
  if (!(threshold.min <= threshold.max))
    throw std::invalid_argument("the threshold of seeds is empty: its max must not be below its min");
  const CandidateSequence sequence{field.world_box(), seed};
  std::vector<Eigen::Vector3d> seeds;
  double smallest = std::numeric_limits<double>::infinity(), largest = -smallest;
  for (std::uint32_t first = 0; first < (seeds.empty() ? enough_to_give_up : max_candidates); first += block) {
    const std::vector<double> values = judge(field, threshold, sequence, first);
    for (std::uint32_t i = 0; i < block; ++i) {
      if (std::isnan(values[i])) continue;
      smallest = std::min(smallest, values[i]);
      largest = std::max(largest, values[i]);
      if (values[i] < threshold.min || values[i] > threshold.max) continue;
      seeds.push_back(sequence.at(first + i));
      if (seeds.size() == count) return seeds;
    }
  }
  refuse(threshold, seeds.size(), count, smallest, largest);
}

SeedList read_seeds(const std::filesystem::path& path) {
  require_readable(path);
  std::ifstream file(path);
  SeedList seeds;
  std::size_t columns = 0;
  std::string line;
  for (std::size_t number = 1; get_line(file, line); ++number) {
    if (number == 1 && line.compare(0, 3, "\xef\xbb\xbf") == 0) line.erase(0, 3);
    const std::vector<std::string> words = words_of(line);
    if (words.empty()) continue;
    try {
      if (words.size() != 3 && words.size() != 6)
        throw std::runtime_error("a seed is three numbers (x y z), or six (x y z and a direction), not " +
                                 std::to_string(words.size()));
      if (columns != 0 && words.size() != columns)
        throw std::runtime_error("all lines must have the same number of values: the lines above have " +
                                 std::to_string(columns));
      const bool header = columns == 0 && is_header(words);
      columns = words.size();
      if (!header) add_seed(words, seeds);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(path.string() + ": line " + std::to_string(number) + ": " + error.what());
    }
  }
  if (file.bad()) throw std::runtime_error(path.string() + ": cannot be read to its end");
  if (seeds.positions.empty())
    throw std::runtime_error(path.string() + ": contains no seeds: write one point x y z in each line");
  return seeds;
}

}  // namespace tensorray
