#include "scenes/outputs/write_outputs.h"

#include <vector>

#include <tbb/parallel_for_each.h>

namespace tensorray {

OutputFiles open_outputs(const OutputDescription& output) {
  OutputFiles files;
  for (const auto& [key, path] : output.files) files.emplace(key, OutputFile(path));
  return files;
}

void write_outputs(const Render& render, const Scene& scene, OutputFiles& files) {
  std::vector<Output> wanted;
  for (const Output& output : scene.description.integrator.method().outputs())
    if (files.count(output.key) > 0) wanted.push_back(output);
  tbb::parallel_for_each(wanted, [&](const Output& output) {  // Most of the time one thread compresses a file.
    files.at(output.key).write([&](const std::filesystem::path& path) { output.write(path, scene, render); });
  });
}

void commit_outputs(OutputFiles files) {
  std::vector<OutputFile> complete;
  for (auto& [key, file] : files) complete.push_back(std::move(file));
  commit_all(complete);
}

}  // namespace tensorray
