#include "tools/benchmark/measures/tables.h"

#include <algorithm>
#include <vector>

#include <fmt/format.h>

namespace tensorray::benchmark {
namespace {

using Row = std::vector<std::string>;

/// The columns that a terminal needs: only the first byte of each character counts.
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xc0) != 0x80; }));
}

/// The first row is the heading. The first column is flush left.
std::string table(const std::vector<Row>& rows) {
  std::vector<std::size_t> widths(rows[0].size(), 0);
  for (const Row& row : rows)
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], width_of(row[i]));
  std::string text;
  for (const Row& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::string space(widths[i] - width_of(row[i]), ' ');
      line += i == 0 ? row[i] + space : "  " + space + row[i];
    }
    text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

double number(const Json& json, const char* key) { return json.value(key, 0.0); }

std::string percent(const Json& json, const char* key) {
  return json.contains(key) ? fmt::format("{:.0f}%", 100 * number(json, key)) : "";
}

std::string machine_text(const Json& machine) {
  std::string text = fmt::format("{}, {} threads, {}\n", machine.at("processor").get<std::string>(),
                                 machine.at("threads").get<int>(), machine.at("compiler").get<std::string>());
  text += fmt::format("clock: {:.2f} GHz\n", number(machine, "cycles_per_second") / 1e9);
  for (const Json& rate : machine.at("vectors"))
    text += fmt::format(
        "{}, vectors of {} floats, billions a second on one thread: {:.2f} multiply-adds, {:.2f} adds, {:.2f} of "
        "both\n",
        rate.at("instructions").get<std::string>(), rate.at("lanes").get<int>(),
        number(rate, "multiply_adds_per_second") / 1e9, number(rate, "adds_per_second") / 1e9,
        number(rate, "both_per_second") / 1e9);
  for (const Json& rate : machine.at("memory"))
    text += fmt::format("memory, {} thread{}: {:.1f} GB/s read, {:.1f} GB/s triad\n", rate.at("threads").get<int>(),
                        rate.at("threads") == 1 ? "" : "s", number(rate, "read_bytes_per_second") / 1e9,
                        number(rate, "triad_bytes_per_second") / 1e9);
  return text;
}

std::string rate_and_ratio(const Json& row) {
  return fmt::format("{:.3g} ({:.3g}x)", number(row, "samples_per_second") / 1e6, number(row, "ratio"));
}

/// One row per kernel, one column per measurement.
std::string kernel_rates(const Json& measurements, const Json& missing) {
  std::vector<Row> rows{{"millions of samples a second, one thread"}};
  for (const Json& row : measurements[0].at("kernels")) rows.push_back({row.at("kernel")});
  for (const Json& measurement : measurements) {
    rows[0].push_back(measurement.at("name"));
    for (std::size_t i = 1; i < rows.size(); ++i) {
      const Json& kernels = measurement.at("kernels");
      const auto found =
          std::find_if(kernels.begin(), kernels.end(), [&](const Json& row) { return row.at("kernel") == rows[i][0]; });
      rows[i].push_back(found == kernels.end() ? "" : rate_and_ratio(*found));
    }
  }
  for (const auto& [kernel, why] : missing.items()) rows.push_back({kernel, why});
  return table(rows);
}

std::string kernel_details(const Json& measurements) {
  std::vector<Row> rows{{"", "kernel", "rays/s", "samples/ray", "of issue bound", "of memory read",
                         "difference, voxels", "least to most", "ends"}};
  for (const Json& measurement : measurements)
    for (const Json& row : measurement.at("kernels")) {
      if (!row.contains("rays_per_second")) continue;
      rows.push_back(
          {measurement.at("name"), row.at("kernel"), fmt::format("{:.0f}", number(row, "rays_per_second")),
           fmt::format("{:.0f}", number(row, "samples_per_ray")), percent(row, "issue_fraction"),
           percent(row, "bandwidth_fraction"), fmt::format("{:.1e}", number(row, "greatest_difference_in_voxels")),
           fmt::format("{:.3g} to {:.3g}", number(row, "least") / 1e6, number(row, "most") / 1e6), row.at("ends")});
    }
  return table(rows);
}

std::string loading_text(const Json& loading) {
  return fmt::format(
      "{}: {:.2f} s from file to bricks, of which {:.2f} s to find the leaves of the file\n"
      "this is {:.2f} GB/s of tensors, {:.2f} GB/s of tensors and bricks, {:.0f}% of the triad\n"
      "bricks take {:.2f} times the active voxels' 36 bytes\n",
      loading.at("field").get<std::string>(), number(loading, "seconds"), number(loading, "seconds_opening"),
      number(loading, "bytes_per_second") / 1e9, number(loading, "moved_bytes_per_second") / 1e9,
      100 * number(loading, "bandwidth_fraction"), number(loading, "memory_ratio"));
}

std::string jobs_text(const Json& jobs) {
  Row heading{"seconds, scene file to picture", "voxels", "rays", "threads"};
  const std::vector<std::string> phases{"load", "trace", "density", "draw", "color", "write", "total"};
  heading.insert(heading.end(), phases.begin(), phases.end());
  heading.push_back("speed-up");
  std::vector<Row> rows{heading};
  for (const Json& job : jobs.at("renders")) {
    Row row{job.at("name"), fmt::format("{}³", job.at("resolution").get<int>())};
    if (job.contains("skipped")) {
      row.push_back(job.at("skipped"));
    } else {
      row.push_back(fmt::format("{}", job.at("rays").get<std::uint64_t>()));
      row.push_back(fmt::format("{}", job.at("threads").get<int>()));
      for (const std::string& phase : phases)
        row.push_back(fmt::format("{:.2f}", number(job.at("seconds"), phase.c_str())));
      if (job.contains("speed_up")) row.push_back(fmt::format("{:.2f}", number(job, "speed_up")));
    }
    rows.push_back(row);
  }
  const Json& against = jobs.at("box_sampler");
  return table(rows) + fmt::format(
                           "a position of 32 wavelengths in {0}³ is traced {1:.1f} times faster than with OpenVDB's "
                           "BoxSampler in the same program ({2} threads, {3} and {4} positions)\n",
                           against.at("resolution").get<int>(), number(against, "ratio"),
                           against.at("threads").get<int>(), against.at("positions")[1].get<std::uint64_t>(),
                           against.at("positions")[0].get<std::uint64_t>());
}

std::string keeping_text(const Json& keeping) {
  std::vector<Row> rows{{"checkpoints", "without", "every", "with", "one takes", "of 60 s"}};
  for (const Json& job : keeping.at("checkpoints"))
    rows.push_back({job.at("name"), fmt::format("{:.2f} s", number(job, "seconds")),
                    fmt::format("{:g} s", number(job, "interval")),
                    fmt::format("{:.2f} s", number(job, "seconds_with_checkpoints")),
                    fmt::format("{:.3f} s", number(job, "seconds_of_one")),
                    fmt::format("{:.3f}%", 100 * number(job, "part_at_default_interval"))});
  return table(rows);
}

std::string view_text(const Json& view) {
  std::vector<Row> rows{{"live view, seconds after a change", "pixels", "first picture", "pictures a second, dragging",
                         "finished picture", "of it: load", "trace", "light", "color", "encode"}};
  for (const Json& job : view) {
    const Json& phases = job.at("phases");
    rows.push_back({job.at("scene"), fmt::format("{}²", job.at("side").get<int>()),
                    fmt::format("{:.3f}", number(job, "first_picture")),
                    fmt::format("{:.1f}", number(job, "pictures_per_second")),
                    fmt::format("{:.2f}", number(job, "final_picture"))});
    for (const char* phase : {"load", "trace", "light", "color", "encode"})
      rows.back().push_back(fmt::format("{:.2f}", number(phases, phase)));
  }
  return table(rows);
}

std::string caustics_text(const Json& caustics) {
  std::string text;
  for (const Json& scene : caustics) {
    std::vector<Row> rows{
        {fmt::format("light on a plate: {}, {}²", scene.at("scene").get<std::string>(), scene.at("side").get<int>()),
         "positions", "trace and draw", "total", "error", "where even", "estimate"}};
    for (const Json& row : scene.at("rows")) {
      rows.push_back({row.at("name"), fmt::format("{}", row.at("positions").get<std::uint64_t>()),
                      fmt::format("{:.2f} s", number(row, "seconds_of_light")),
                      fmt::format("{:.2f} s", number(row, "seconds")),
                      fmt::format("{:.2f}%", 100 * number(row, "error")),
                      fmt::format("{:.2f}%", 100 * number(row, "even_error"))});
      if (row.contains("estimate")) rows.back().push_back(fmt::format("{:.2f}%", 100 * number(row, "estimate")));
    }
    text += table(rows);
    text += fmt::format(
        "even: {:.0f}% of the pixels, whose light differs from their neighbours' by less than a tenth of "
        "the mean\n",
        100 * number(scene, "even_part"));
    if (scene.contains("photons_over_mesh"))
      text += fmt::format("photons take {:.0f} times as long for the error of the first row\n",
                          number(scene, "photons_over_mesh"));
    text += "\n";
  }
  return text;
}

std::string interpolation_text(const Json& interpolation) {
  std::string text;
  for (const Json& field : interpolation) {
    std::vector<Row> rows{
        {fmt::format("{}, {}², against 257³", field.at("field").get<std::string>(), field.at("side").get<int>()),
         "error", "with the default tolerance", "samples", "trace"}};
    for (const Json& row : field.at("rows"))
      rows.push_back({row.at("name"), fmt::format("{:.4f}", number(row, "error")),
                      fmt::format("{:.4f}", number(row, "usual_error")),
                      fmt::format("{:.2f} million", 1e-6 * number(row, "samples")),
                      fmt::format("{:.2f} s", number(row, "seconds"))});
    text += table(rows) + "\n";
  }
  return text;
}

}  // namespace

std::string tables(const Json& results) {
  std::string text;
  if (results.contains("machine")) text += machine_text(results.at("machine"));
  if (results.contains("kernels")) {
    const Json& kernels = results.at("kernels");
    text += "\n" + kernel_rates(kernels.at("measurements"), kernels.at("not_measured"));
    text += "\n" + kernel_details(kernels.at("measurements"));
  }
  if (results.contains("loading")) text += "\n" + loading_text(results.at("loading"));
  if (results.contains("jobs")) text += "\n" + jobs_text(results.at("jobs"));
  if (results.contains("keeping")) text += "\n" + keeping_text(results.at("keeping"));
  if (results.contains("caustics")) text += "\n" + caustics_text(results.at("caustics"));
  if (results.contains("interpolation")) text += "\n" + interpolation_text(results.at("interpolation"));
  if (results.contains("view")) text += "\n" + view_text(results.at("view"));
  return text;
}

}  // namespace tensorray::benchmark
