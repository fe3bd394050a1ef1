#include "scenes/scene/shared_field.h"

#include <memory>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include "base/files/shared_file.h"
#include "base/text/content_hash.h"
#include "volumes/grids/page_memory.h"
#include "volumes/making/field_file.h"

namespace tensorray {
namespace {

using Json = nlohmann::json;

/// What tells whether a file has the bytes that it had.
Json identity_of(const std::filesystem::path& file) {
  struct stat status {};
  if (stat(file.c_str(), &status) != 0) return nullptr;
  return {status.st_dev, status.st_ino, status.st_size, status.st_mtim.tv_sec, status.st_mtim.tv_nsec};
}

/// Of the program, and of all that the field depends on.
std::string key_of(const SceneDescription& scene) {
  const Interpolant interpolant = interpolant_of(scene);
  Json field = Json::parse(scene.text).at("field");
  if (field.is_object()) {
    field.erase("scale");
    field.erase("bounds");
  }
  const Json all{identity_of("/proc/self/exe"), field, identity_of(scene.field.file), interpolant.between,
                 interpolant.border};
  return fmt::format("{:016x}", content_hash(all.dump()));
}

std::string words_of(const LoadedField& loaded) {
  const EigenvalueReport& report = loaded.eigenvalues;
  return Json{{"chosen", report.chosen},
              {"defective", report.defective},
              {"norm_lost", report.norm_lost},
              {"non_finite", loaded.non_finite},
              {"notes", loaded.notes}}
      .dump(-1, ' ', false, Json::error_handler_t::replace);  // A name may not be UTF-8.
}

LoadedField loaded_of(FieldOfFile made) {
  const Json words = Json::parse(made.words);
  LoadedField loaded{std::move(made.field),
                     {},
                     words.at("non_finite").get<std::size_t>(),
                     words.at("notes").get<std::vector<std::string>>()};
  loaded.eigenvalues = {words.at("chosen").get<Eigenvalues>(), words.at("defective").get<std::size_t>(),
                        words.at("norm_lost").get<double>()};
  loaded.notes.emplace_back("the field is that of another process, which has loaded it");
  return loaded;
}

}  // namespace

LoadedField share_field(const SceneDescription& scene, const std::function<LoadedField()>& load,
                        const Progress& progress) {
  if (!memory_bound()) return load();
  const auto shared = std::make_shared<SharedFile>(
      key_of(scene), [&] { progress.update("waiting for the process that loads the field", 0, 1); });
  std::optional<FieldOfFile> found;
  if (shared->file().is_open()) found = field_of_file(duplicate(shared->file()));
  LoadedField loaded = found ? loaded_of(std::move(*found)) : load();
  if (!found && !complete_field_file(loaded.field, words_of(loaded))) return loaded;  // Others need not wait.
  if (!found) shared->offer(*loaded.field.memory().file);
  loaded.field.keep_with_bricks(shared);
  return loaded;
}

}  // namespace tensorray
