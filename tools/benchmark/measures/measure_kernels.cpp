#include <algorithm>
#include <cstring>
#include <stdexcept>

#include <fmt/format.h>

#include "integrators/kernels/packet_kernel.h"
#include "integrators/tracing/trace.h"
#include "tools/benchmark/kernels/kernels.h"
#include "tools/benchmark/kernels/workload.h"
#include "tools/benchmark/measures/parts.h"
#include "tools/benchmark/support/repeat.h"

namespace tensorray::benchmark {
namespace {

/// Bytes that a packet reads for a cell that is not in the cache: the four voxels that it does not share with its
/// neighbour.
double bytes_per_cold_cell(int components) {
  return 4.0 * sizeof(float) * TensorBrick::trailing_offset(components) / TensorBrick::voxels;
}

int components_of(const TestField& test) {
  return test.field.is_symmetric() ? TensorBrick::symmetric : TensorBrick::general;
}

struct Measurement {
  std::string name;
  Order order;
};

struct MeasuredField {
  std::string about;
  FieldRequest request;
  std::vector<Measurement> measurements;
};

/// The rays of a packet diverge by a tenth of a voxel in the weakest field, and by one voxel in the weak one.
std::vector<MeasuredField> fields_to_measure(bool quick) {
  constexpr double weakest = 0.001, weak = 0.01, automatic = 0.15, strong = 1.5;
  const Eigen::Vector3d down(0.1, 0.07, -1), across(-1, 0.1, 0.05);
  const int small = quick ? 24 : 128, large = quick ? 32 : 256;
  const auto size = [](int n) { return std::to_string(n) + "³"; };
  FieldRequest half_empty{PointLoad(), large, down, weakest};
  half_empty.half_empty = true;
  return {
      {"point load, weakest", {PointLoad(), small, down, weakest}, {{"coherent " + size(small), Order::warm}}},
      {"point load, weakest",
       {PointLoad(), large, down, weakest},
       {{"coherent " + size(large), Order::warm}, {"cold cells " + size(large), Order::fresh}}},
      {"point load, weakest, every second cube of 64³ voxels inactive",
       half_empty,
       {{"half empty " + size(large), Order::warm}}},
      {"point load, weak", {PointLoad(), small, down, weak}, {{"parting " + size(small), Order::warm}}},
      {"point load as rendered",
       {PointLoad(), small, down, automatic},
       {{"as rendered " + size(small), Order::fresh},
        {"Morton order " + size(small), Order::morton},
        {"dense " + size(small), Order::dense}}},
      {"vortex, strong", {Vortex(), small, across, strong}, {{"diverging " + size(small), Order::fresh}}},
  };
}

/// The greatest distance, in voxels, between the ends of a ray traced by the kernel and by the reference.
double greatest_difference(const TestField& test, Order order, const TraceFunction& kernel,
                           const BendingSettings& settings) {
  RayBatch rays = make_batches(test, order, 0, 1)[0], expected = rays;
  kernel(rays);
  trace_reference(test.field, test.geometry, settings, expected);
  double greatest = 0;
  for (std::size_t i = 0; i < rays.size(); ++i)
    greatest = std::max(greatest, (rays.position[i] - expected.position[i]).norm() / test.voxel());
  return greatest;
}

void add_to_hash(const Eigen::Vector3d& values, std::uint64_t& hash) {
  for (const double value : values) {
    std::uint64_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    hash = (hash ^ bits) * 0x100000001b3;
    hash ^= hash >> 32;
  }
}

/// A number of the positions and directions where some rays end. Two kernels have the same one if these are the same,
/// bit for bit.
std::string ends(const TestField& test, Order order, const TraceFunction& kernel) {
  constexpr std::uint64_t packets = 64;
  std::uint64_t hash = 0xcbf29ce484222325;
  for (RayBatch& rays : make_batches(test, order, 0, packets)) {
    kernel(rays);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      add_to_hash(rays.position[i], hash);
      add_to_hash(rays.direction[i], hash);
    }
  }
  return fmt::format("{:016x}", hash);
}

struct KernelRate {
  Rate samples;
  double samples_per_ray = 0;
};

KernelRate measure_kernel(const TestField& test, Order order, const TraceFunction& kernel, double seconds) {
  constexpr std::uint64_t packets = 16;  // Packets per round.
  std::uint64_t next = 0, rays = 0, samples = 0;
  const auto prepare = [&](std::uint64_t rounds) {
    next += rounds * packets;
    return make_batches(test, order, next - rounds * packets, rounds * packets);
  };
  const auto work = [&](std::vector<RayBatch>& batches) {
    std::uint64_t units = 0;
    for (RayBatch& batch : batches) {
      kernel(batch);
      units += batch.tensor_samples;
      rays += batch.size();
    }
    samples += units;
    return units;
  };
  const Rate rate = repeat(prepare, work, thread_seconds, seconds);
  return {rate, static_cast<double>(samples) / static_cast<double>(rays)};
}

/// The rate as a fraction of the highest one at which vectors of these instructions can be issued: the pipes that
/// multiply limit it, those that add, or all of them together.
double issue_fraction(double samples_per_second, const std::string& instructions, int components, const Json& machine) {
  const int multiply_adds = 6 + 36 + 7 * components, adds = 10 + 1 + 3 * components;  // Of a step in a linear field.
  for (const Json& rate : machine.at("vectors"))
    if (rate.at("instructions") == instructions) {
      const auto seconds = [&](int operations, const char* kind) { return operations / rate.at(kind).get<double>(); };
      const double least =
          std::max({seconds(multiply_adds, "multiply_adds_per_second"), seconds(adds, "adds_per_second"),
                    seconds(multiply_adds + adds, "both_per_second")});
      return samples_per_second * least / rate.at("lanes").get<double>();
    }
  throw std::logic_error("no rate was measured for " + instructions);
}

double bandwidth_fraction(double samples_per_second, int components, const Json& machine) {
  const double cells_per_second = samples_per_second / packet_rays * step;
  return cells_per_second * bytes_per_cold_cell(components) /
         machine.at("memory")[0].at("read_bytes_per_second").get<double>();
}

Json describe_kernel(const TestField& test, Order order, const Kernel& kernel, const TraceFunction& function,
                     double seconds, const Json& machine) {
  const KernelRate rate = measure_kernel(test, order, function, seconds);
  Json row = {{"kernel", kernel.name},
              {"samples_per_second", rate.samples.median},
              {"least", rate.samples.least},
              {"most", rate.samples.most}};
  if (!kernel.follows_the_rule) return row;
  row["rays_per_second"] = rate.samples.median / rate.samples_per_ray;
  row["samples_per_ray"] = rate.samples_per_ray;
  row["ends"] = ends(test, order, function);
  row["greatest_difference_in_voxels"] = greatest_difference(test, order, function, kernel.settings);
  if (!kernel.instructions.empty())
    row["issue_fraction"] = issue_fraction(rate.samples.median, kernel.instructions, components_of(test), machine);
  if (order == Order::fresh)
    row["bandwidth_fraction"] = bandwidth_fraction(rate.samples.median, components_of(test), machine);
  return row;
}

void add_ratios(Json& rows) {
  if (rows.empty()) return;
  const double first = rows[0].at("samples_per_second");
  for (Json& row : rows) row["ratio"] = row.at("samples_per_second").get<double>() / first;
}

/// The kernels whose names contain a text.
std::vector<Kernel> kernels_named(const std::string& text) {
  std::vector<Kernel> kernels = all_kernels();
  const auto differs = [&](const Kernel& kernel) { return kernel.name.find(text) == std::string::npos; };
  kernels.erase(std::remove_if(kernels.begin(), kernels.end(), differs), kernels.end());
  if (kernels.empty()) throw std::invalid_argument("no kernel's name contains \"" + text + "\"");
  return kernels;
}

}  // namespace

Json measure_kernels(const Options& options, const Json& machine) {
  const double seconds = options.quick ? 0.001 : 0.25;
  Json result = {{"step_in_voxels", step}, {"rays_per_packet", packet_rays}, {"not_measured", Json::object()}};
  Json& measured = result["measurements"] = Json::array();
  const std::vector<Kernel> kernels = kernels_named(options.kernels);
  bool first = true;
  for (const MeasuredField& field : fields_to_measure(options.quick)) {
    options.announce(field.measurements[0].name + ": making the field");
    const TestField test = make_field(field.request);
    std::vector<Json> rows(field.measurements.size(), Json::array());
    for (const Kernel& kernel : kernels) {
      if (!kernel.missing.empty()) result["not_measured"][kernel.name] = kernel.missing;
      if (!kernel.missing.empty() || (kernel.on_one_field && !first)) continue;
      const TraceFunction function = kernel.make(test);
      packets::use_instruction_set(kernel.instructions);
      for (std::size_t i = 0; i < rows.size(); ++i) {
        options.announce(field.measurements[i].name + ": " + kernel.name);
        rows[i].push_back(describe_kernel(test, field.measurements[i].order, kernel, function, seconds, machine));
      }
    }
    for (std::size_t i = 0; i < rows.size(); ++i) {
      add_ratios(rows[i]);
      measured.push_back({{"name", field.measurements[i].name}, {"field", field.about}, {"kernels", rows[i]}});
    }
    first = false;
  }
  packets::use_instruction_set("");
  return result;
}

}  // namespace tensorray::benchmark
