#pragma once
/// Random fields and rays, and functions that compare packets with the reference.

#include <cstdint>
#include <cstring>
#include <random>
#include <sstream>

#include "base/constants.h"
#include "tests/tracing/support.h"
#include "tracing/bending/bending.h"
#include "tracing/kernels/packet_kernel.h"
#include "tracing/trace/trace.h"

namespace tensorray::test {

/// Random numbers that are the same with every standard library and compiler. (These may evaluate the arguments of a
/// call in any order: two numbers are drawn in two statements.)
class Numbers {
 public:
  explicit Numbers(unsigned seed) : engine_(seed) {}

  double next() { return static_cast<double>(engine_()) / 4294967296.0; }  ///< In [0, 1).
  double between(double low, double high) { return low + (high - low) * next(); }
  std::size_t below(std::size_t count) { return static_cast<std::size_t>(next() * static_cast<double>(count)); }

  Vector3d in(const AlignedBox3d& box) {
    const double z = next(), y = next(), x = next();
    return box.min() + box.sizes().cwiseProduct(Vector3d(x, y, z));
  }
  Vector3d direction() {
    while (true) {
      const double z = between(-1, 1), y = between(-1, 1), x = between(-1, 1);
      const Vector3d v(x, y, z);
      if (v.norm() < 1 && v.norm() > 0.1) return v.normalized();
    }
  }
  Vector2d two_between(double low, double high) {
    const double y = between(low, high), x = between(low, high);
    return {x, y};
  }
  Matrix3d tensor() {
    Matrix3d T;
    for (int i = 0; i < 9; ++i) T.data()[i] = between(-1, 1);
    return T;
  }

 private:
  std::mt19937 engine_;
};

/// A sum of four waves of 24 to 64 units: smooth where the unit is a voxel. Its Frobenius norm is at most 1.
inline TensorFunction smooth_tensor(unsigned seed) {
  struct Wave {
    Matrix3d amplitude;
    Vector3d k;
    double phase;
  };
  Numbers numbers(seed);
  std::vector<Wave> waves(4);
  for (Wave& wave : waves) {
    wave.amplitude = numbers.tensor().normalized() / static_cast<double>(waves.size());
    const Vector3d along = numbers.direction();
    wave.k = 2 * pi / numbers.between(24, 64) * along;
    wave.phase = numbers.between(0, 2 * pi);
  }
  return [waves](const Vector3d& p) {
    Matrix3d T = Matrix3d::Zero();
    for (const Wave& wave : waves) T += std::sin(wave.k.dot(p) + wave.phase) * wave.amplitude;
    return T;
  };
}

/// Shapes of voxels; their mean edge is 0.05.
struct Lattice {
  std::string name;
  Affine3d to_world = Affine3d::Identity();
};

constexpr double mean_edge = 0.05;

inline std::vector<Lattice> lattices() {
  const Matrix3d oblong = Vector3d(0.5, 1, 2).asDiagonal();
  const Matrix3d turned = Eigen::AngleAxisd(0.7, Vector3d(1, -2, 3).normalized()) * oblong;
  const std::pair<std::string, Matrix3d> edges[] = {{"cubes", Matrix3d::Identity()},
                                                    {"oblong", oblong},
                                                    {"turned_oblong", turned},
                                                    {"mirrored_cubes", Vector3d(-1, 1, 1).asDiagonal()},
                                                    {"mirrored_turned", turned * Vector3d(1, -1, 1).asDiagonal()}};
  std::vector<Lattice> result;
  for (const auto& [name, axes] : edges)
    result.push_back({name, Eigen::Translation3d(3, -2, 1) * Affine3d(Matrix3d(mean_edge * axes))});
  return result;
}

inline AlignedBox3i index_box(const Vector3i& first, const Vector3i& voxels) {
  return {first, Vector3i(first + voxels - Vector3i::Ones())};
}

/// The kind of field that packets trace.
inline TensorField cubic_field(const TensorGrid& grid) {
  return TensorField(grid, Interpolant{Interpolation::cubic, Border::fade});
}

/// `tensor` takes an index position and returns T times the edge of a voxel: s times its norm is the kick of a step of
/// one voxel.
inline TensorGrid lattice_grid(const AlignedBox3i& box, const Lattice& lattice, const TensorFunction& tensor) {
  return dense_grid(box, lattice.to_world,
                    [&](const Vector3i& index) { return Matrix3d(tensor(index.cast<double>()) / mean_edge); });
}

inline TensorField lattice_field(const AlignedBox3i& box, const Lattice& lattice, const TensorFunction& tensor) {
  return cubic_field(lattice_grid(box, lattice, tensor));
}

/// The field of a grid that was made for another lattice.
inline TensorField placed(TensorGrid grid, const Lattice& lattice) {
  grid.to_world = lattice.to_world;
  return cubic_field(grid);
}

inline TensorGrid without_blocks(TensorGrid grid, double fraction, unsigned seed) {
  Numbers numbers(seed);
  const auto taken = [&](const TensorBlock&) { return numbers.next() < fraction; };
  grid.blocks.erase(std::remove_if(grid.blocks.begin(), grid.blocks.end(), taken), grid.blocks.end());
  return grid;
}

/// Adds a ray, given in index space, once for each flexibility.
inline void add_bundle(RayBatch& batch, const TensorField& field, const Vector3d& from, const Vector3d& along,
                       const std::vector<double>& flexibilities) {
  for (const double s : flexibilities)
    batch.add(field.to_world() * from, (field.to_world().linear() * along).normalized(), s);
}

/// Bundles that come from outside, begin inside or on a face, miss the field, and graze its faces.
inline RayBatch random_rays(const TensorField& field, int bundles, const std::vector<double>& flexibilities,
                            unsigned seed) {
  Numbers numbers(seed);
  const AlignedBox3d& box = field.index_bounds();
  RayBatch batch;
  for (int i = 0; i < bundles; ++i) {
    Vector3d target = numbers.in(box), along = numbers.direction();
    const auto axis = static_cast<Eigen::Index>(numbers.below(3));
    const bool far = numbers.next() < 0.5;
    const double face = far ? box.max()[axis] : box.min()[axis], inwards = far ? -1 : 1;
    double distance = 0;
    switch (i % 8) {
      case 0:  // Begins inside.
        break;
      case 1:  // On a face, inwards or outwards.
        target[axis] = face;
        break;
      case 2:  // Passes by.
        target[axis] = face - 0.5 * inwards;
        along[axis] = 0;
        distance = box.diagonal().norm();
        break;
      case 3:  // Along a face.
        target[axis] = face + 0.3 * inwards * numbers.next();
        along[axis] *= 0.1;
        break;
      default:
        distance = box.diagonal().norm();
    }
    add_bundle(batch, field, target - distance * along.normalized(), along, flexibilities);
  }
  return batch;
}

/// Five flexibilities. The greatest one causes `kick` per voxel where the field is strongest.
inline std::vector<double> wavelengths(double kick) { return {0.2 * kick, -0.4 * kick, 0.6 * kick, 0.8 * kick, kick}; }

/// Extents that begin and end anywhere in a brick.
inline AlignedBox3i odd_box() { return index_box({-13, 5, -30}, {27, 34, 41}); }

inline double distance_in_voxels(const Vector3d& a, const Vector3d& b) { return (a - b).norm() / mean_edge; }

struct Scene {
  std::string name;
  TensorField field;
  Geometry geometry;
  BendingSettings settings;
  RayBatch rays;
};

inline Scene make_scene(std::string name, TensorField field, Surfaces surfaces, double step, RayBatch rays) {
  surfaces.bounds = box_mesh(field.index_bounds(), field.to_world());
  Geometry geometry(std::move(surfaces));
  BendingSettings settings = settings_of(BendingMethod::splitting4, step);
  // The smallest tolerance that packets are made for. The errors of a few hundred steps stay below the differences that
  // tests accept.
  settings.tolerance = 1e-5;
  settings.max_steps = 1000;
  return {std::move(name), std::move(field), std::move(geometry), settings, std::move(rays)};
}

inline RayBatch traced(const Scene& scene, RayBatch rays) {
  trace(scene.field, scene.geometry, scene.settings, rays);
  return rays;
}

inline RayBatch traced_by_reference(const Scene& scene, RayBatch rays) {
  trace_reference(scene.field, scene.geometry, scene.settings, rays);
  return rays;
}

/// The rays, turned by as much as the errors of single precision may turn them along the path: 3e-7 radian, or more
/// where the exponential of a step, exp(h s T), has a large argument. s changes by a factor of 1 + 3e-7, which stands
/// for an error of all tensors.
inline RayBatch turned_a_little(const Scene& scene) {
  RayBatch rays = scene.rays;
  const double step = scene.settings.step > 0 ? scene.settings.step : 1.0 / 64;
  const double strength = step * mean_edge * std::abs(scene.settings.scale) * scene.field.max_norm();
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const double turn = 3e-7 * std::max(1.0, strength * std::abs(rays.flexibility[i]));
    rays.flexibility[i] *= 1 + 3e-7;
    const Vector3d across = upright(rays.direction[i], Vector3d(1, 2, 3).normalized());
    rays.direction[i] = (rays.direction[i] + std::min(turn, 1.0) * across).normalized();
  }
  return rays;
}

constexpr double position_tolerance = 1e-3;  // Voxels.
constexpr double length_tolerance = 1e-5;    // Relative to the length plus one voxel.

/// Whether ray i has the same path in both, to single precision.
inline bool agree(const RayBatch& a, const RayBatch& b, std::size_t i, double steps_allowed = 1) {
  const double steps_apart = std::abs(double(a.steps[i]) - double(b.steps[i]));
  const double apart = (a.position[i] - b.position[i]).norm();  // Lengths may differ by as much.
  return a.end[i] == b.end[i] && distance_in_voxels(a.position[i], b.position[i]) < position_tolerance &&
         std::abs(a.length[i] - b.length[i]) <= length_tolerance * (b.length[i] + mean_edge) + apart &&
         steps_apart <= steps_allowed;
}

inline std::string description(const TensorField& field, const RayBatch& rays, std::size_t i) {
  std::ostringstream text;
  text << to_string(rays.end[i]) << " at voxel " << (field.to_index() * rays.position[i]).transpose() << " after "
       << rays.steps[i] << " steps, length " << rays.length[i] / mean_edge;
  return text.str();
}

/// Whether a ray that left the field did not end on its face. In very strong fields a step may turn light about, and
/// then no length of that step ends on the face.
inline bool ends_beside_face(const Scene& scene, const RayBatch& rays, std::size_t i) {
  if (rays.end[i] != RayEnd::missed || rays.steps[i] == 0) return false;
  if (scene.geometry.has_cut() || std::isfinite(scene.settings.max_length)) return false;
  const Vector3d index = scene.field.to_index() * rays.position[i];
  const AlignedBox3d& box = scene.field.index_bounds();
  return std::min((index - box.min()).cwiseAbs().minCoeff(), (index - box.max()).cwiseAbs().minCoeff()) > 1e-6;
}

/// Compares packets with the reference. A ray is left out if the result of the reference also changes when the start
/// changes by the errors of single precision; `sensitive` is the greatest fraction of such rays.
inline void expect_reference(const Scene& scene, double sensitive = 0) {
  SCOPED_TRACE(scene.name);
  const RayBatch fast = traced(scene, scene.rays), exact = traced_by_reference(scene, scene.rays);
  const RayBatch moved = traced_by_reference(scene, turned_a_little(scene));
  const bool adaptive = scene.settings.step == 0;  // Rounding can decide whether a step is repeated.
  std::size_t unstable = 0, steps_apart = 0, wrong = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    const double steps_allowed = adaptive ? 10 + 0.25 * exact.steps[i] : 1;
    if (!agree(moved, exact, i, steps_allowed) || ends_beside_face(scene, exact, i)) {
      ++unstable;
      continue;
    }
    steps_apart += fast.steps[i] != exact.steps[i];
    if (agree(fast, exact, i, steps_allowed) || ++wrong > 3) continue;
    ADD_FAILURE() << "ray " << i << " from voxel " << (scene.field.to_index() * scene.rays.position[i]).transpose()
                  << ", s " << scene.rays.flexibility[i] << ":\n  packets:   " << description(scene.field, fast, i)
                  << "\n  reference: " << description(scene.field, exact, i);
  }
  const auto count = static_cast<double>(exact.size());
  EXPECT_EQ(wrong, 0u);
  EXPECT_LE(static_cast<double>(unstable), sensitive * count);
  EXPECT_TRUE(adaptive || static_cast<double>(steps_apart) <= 0.02 * count + 1) << "rounding at faces is rare";
}

/// Distances between the ends of rays, in voxels, sorted.
inline std::vector<double> distances(const RayBatch& a, const RayBatch& b) {
  std::vector<double> result;
  for (std::size_t i = 0; i < a.size(); ++i) result.push_back(distance_in_voxels(a.position[i], b.position[i]));
  std::sort(result.begin(), result.end());
  return result;
}

/// Where errors decide about automatic steps, they depend on rounding. The errors of packets are then as large as those
/// of the reference, but not equal to them. Both are compared with the reference at a hundredth of the tolerance.
inline void expect_as_exact_as_reference(const Scene& scene) {
  SCOPED_TRACE(scene.name);
  BendingSettings settings = scene.settings;
  settings.tolerance /= 100;
  RayBatch truth = scene.rays;
  trace_reference(scene.field, scene.geometry, settings, truth);
  const std::vector<double> errors = distances(traced(scene, scene.rays), truth);
  const std::vector<double> usual_errors = distances(traced_by_reference(scene, scene.rays), truth);
  for (const double part : {0.5, 0.75, 0.9}) {
    const auto i = static_cast<std::size_t>(part * static_cast<double>(errors.size()));
    EXPECT_LE(errors[i], 2 * usual_errors[i] + position_tolerance) << part;
    EXPECT_LE(usual_errors[i], 2 * errors[i] + position_tolerance) << part;
  }
}

/// Whether a ray of one batch and one of another are the same, bit for bit, in all that both batches have.
inline bool identical(const RayBatch& a, std::size_t i, const RayBatch& b, std::size_t j) {
  const auto numbers_of = [&](const RayBatch& rays, std::size_t k) {
    std::vector<Vector3d> all{rays.position[k], rays.direction[k]};
    all.emplace_back(rays.length[k], rays.steps[k], static_cast<int>(rays.end[k]));
    if (a.wants_log_radiance_scale && b.wants_log_radiance_scale) all.emplace_back(rays.log_radiance_scale[k], 0, 0);
    if (!a.differentials.empty() && !b.differentials.empty())
      for (const auto& derivatives : {rays.differentials[k].position, rays.differentials[k].direction})
        all.insert(all.end(), {derivatives.col(0), derivatives.col(1)});
    return all;
  };
  const std::vector<Vector3d> one = numbers_of(a, i), other = numbers_of(b, j);
  return std::memcmp(one.data(), other.data(), one.size() * sizeof(Vector3d)) == 0;
}

/// Traces some rays of a scene, in any order: they are those of the whole batch, to the last bit.
inline void expect_identical(const Scene& scene, const RayBatch& all, const std::vector<std::size_t>& order) {
  const RayBatch& rays = scene.rays;
  RayBatch some;
  some.wants_log_radiance_scale = rays.wants_log_radiance_scale;
  for (const std::size_t i : order) some.add(rays.position[i], rays.direction[i], rays.flexibility[i]);
  some = traced(scene, some);
  std::size_t differ = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (identical(some, i, all, order[i]) || ++differ > 3) continue;
    ADD_FAILURE() << "ray " << order[i] << ", s " << rays.flexibility[order[i]]
                  << ":\n  here: " << description(scene.field, some, i)
                  << "\n  in the batch: " << description(scene.field, all, order[i]);
  }
  EXPECT_EQ(differ, 0u);
}

/// Rays with derivatives, along a parallel shift and along a shift with a turn.
inline RayBatch with_differentials(RayBatch rays) {
  for (const Vector3d& direction : rays.direction) {
    RayDifferential differential;
    const Vector3d across = upright(direction, Vector3d(1, 2, 3).normalized());
    differential.position.col(0) = across;
    differential.position.col(1) = direction.cross(across);
    differential.direction.col(1) = 0.3 * direction.cross(across);
    rays.differentials.push_back(differential);
  }
  return rays;
}

/// Compares the differentials of packets with those of the reference.
inline void expect_differentials(const Scene& scene, double tolerance) {
  SCOPED_TRACE(scene.name);
  const RayBatch fast = traced(scene, scene.rays), exact = traced_by_reference(scene, scene.rays);
  RayBatch turned = turned_a_little(scene);
  turned.differentials = scene.rays.differentials;
  const RayBatch moved = traced_by_reference(scene, turned);
  std::size_t compared = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    const auto apart = [&](const RayBatch& a) {
      const RayDifferential &of = a.differentials[i], &right = exact.differentials[i];
      return std::max((of.position - right.position).norm() / right.position.norm(),
                      (of.direction - right.direction).norm() / (right.direction.norm() + right.position.norm()));
    };
    if (moved.end[i] != exact.end[i] || apart(moved) > 1e-4) continue;  // The light grazes a surface.
    ++compared;
    EXPECT_EQ(fast.end[i], exact.end[i]);
    EXPECT_LT(apart(fast), tolerance) << "ray " << i << " after " << exact.steps[i] << " steps";
  }
  EXPECT_GT(compared, exact.size() * 8 / 10);
}

/// Tests that run with each of the kernel's instruction sets.
class EveryInstructionSet : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { packets::use_instruction_set(GetParam()); }
  void TearDown() override { packets::use_instruction_set({}); }

  /// All lattices with the processor's best instructions, and two with others, so that tests stay quick.
  static std::vector<Lattice> tested_lattices() {
    std::vector<Lattice> all = lattices();
    if (GetParam() == packets::instruction_sets().front()) return all;
    return {all.front(), all.back()};
  }
};

inline auto instruction_sets() { return ::testing::ValuesIn(packets::instruction_sets()); }
inline std::string instruction_set_name(const ::testing::TestParamInfo<std::string>& info) { return info.param; }

}  // namespace tensorray::test
