#include "volumes/points/vtk_files.h"

#include <stdexcept>
#include <system_error>
#include <utility>

#include "base/errors.h"
#include "base/process/child_program.h"
#include "base/text/text.h"
#include "volumes/points/vtp_writer.h"

namespace tensorray {
namespace {

template <class Number>
DataView view_of_vectors(const std::vector<Eigen::Matrix<Number, 3, 1>>& vectors) {
  static_assert(sizeof(Eigen::Matrix<Number, 3, 1>) == 3 * sizeof(Number), "vectors are contiguous");
  return {3, NumberSpan<Number>{reinterpret_cast<const Number*>(vectors.data()), 3 * vectors.size()}};
}

PolyDataView view_of_cloud(const PointCloud& cloud) {
  PolyDataView view;
  view.points = view_of_vectors(cloud.positions);
  for (const auto& [name, values] : cloud.scalars)
    view.point_data.emplace_back(name, DataView{1, NumberSpan<float>{values.data(), values.size()}});
  for (const auto& [name, values] : cloud.vectors) view.point_data.emplace_back(name, view_of_vectors(values));
  for (const auto& [key, value] : cloud.metadata) view.texts.emplace_back(key, Texts{value});
  return view;
}

PolyDataView view_of_lines(const PolylineData& lines) {
  PolyDataView view;
  view.points = view_of_vectors(lines.points);
  view.line_ends = &lines.line_ends;
  for (const auto& [name, values] : lines.point_data) view.point_data.emplace_back(name, view_of(values));
  for (const auto& [name, values] : lines.line_data) view.line_data.emplace_back(name, view_of(values));
  view.texts.assign(lines.texts.begin(), lines.texts.end());
  return view;
}

/// @throw std::runtime_error with the error that the program printed, or with `on_crash` if it printed none.
void run_vtk_program(const std::vector<std::string>& arguments, const UnnamedFile& shared,
                     const std::string& on_crash) {
  const std::filesystem::path program = sibling_program("tensorray-import");
  std::error_code none;
  if (!std::filesystem::exists(program, none))
    throw std::runtime_error("files of VTK need " + program.string() +
                             ", which is not built; run `tools/setup release import`");
  const ProgramEnd end = run_program(program, arguments, shared);
  if (end.signal != 0) throw std::runtime_error(on_crash);
  if (end.status == 0) return;
  const std::string reason = one_line(end.error);
  throw std::runtime_error(reason.empty() ? on_crash : reason);
}

void write(const std::filesystem::path& path, const PolyDataView& data) {
  try {
    write_vtp_file(path, data);
  } catch (const std::runtime_error& error) {
    fail(path, std::string("cannot be written: ") + error.what());
  }
}

}  // namespace

void write_vtp(const std::filesystem::path& path, const PointCloud& points) { write(path, view_of_cloud(points)); }

void write_vtp(const std::filesystem::path& path, const PolylineData& lines) { write(path, view_of_lines(lines)); }

PolylineData read_vtp_lines(const std::filesystem::path& path, const std::set<std::string>& wanted) {
  const UnnamedFile shared;
  std::vector<std::string> arguments{"--read-vtp", shared_file, path.string()};
  arguments.insert(arguments.end(), wanted.begin(), wanted.end());
  run_vtk_program(arguments, shared,
                  "reading it ended the reader; the file is damaged or cut off, or does not fit in memory");
  PolyLines data = read_poly_lines(shared.path());
  PolylineData lines;
  const std::vector<double>& points = data.points.numbers;
  lines.points.reserve(points.size() / 3);
  for (std::size_t i = 0; i + 2 < points.size(); i += 3) lines.points.emplace_back(&points[i]);
  lines.line_ends = std::move(data.line_ends);
  for (auto& [name, values] : data.point_data) lines.point_data[name] = {values.components, std::move(values.numbers)};
  for (auto& [name, values] : data.line_data) lines.line_data[name] = {values.components, std::move(values.numbers)};
  return lines;
}

}  // namespace tensorray
