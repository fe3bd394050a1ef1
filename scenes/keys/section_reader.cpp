#include "scenes/keys/section_reader.h"

#include <algorithm>
#include <stdexcept>
#include <utility>
#include <variant>

#include <fmt/core.h>

#include "base/text/habits.h"
#include "base/text/text.h"

namespace tensorray {

template class MemberOf<int>;
template class MemberOf<double>;
template class MemberOf<std::optional<double>>;
template class MemberOf<std::optional<Eigen::Vector3d>>;

namespace {

/// How many letters must be inserted, removed, replaced or swapped with their neighbour to turn `b` into `a`.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> distance(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        distance[i][j] = i + j;
        continue;
      }
      const std::size_t replace = distance[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      distance[i][j] = std::min({distance[i - 1][j] + 1, distance[i][j - 1] + 1, replace});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        distance[i][j] = std::min(distance[i][j], distance[i - 2][j - 2] + 1);
    }
  }
  return distance[a.size()][b.size()];
}

std::string quoted_list(const std::vector<std::string>& names, const std::string& separator) {
  return "`" + joined(names, ("`" + separator + "`").c_str()) + "`";
}

/// "did you mean `light`?"; if no known key is similar to `key`, what it is here, or the list of known keys.
/// @param pointer  Of the section; places within deeper ones are not the camera's.
std::string suggestion(const std::string& key, const std::string& pointer, const std::set<std::string>& known) {
  const std::string here = name_here(key);
  if (here == "camera.position" && known.count("position") > 0) return "did you mean `position`?";
  constexpr std::size_t longest = 64;  // All keys are shorter. edit_distance takes quadratic time.
  std::string nearest;
  std::size_t least = key.size() > longest ? 0 : std::max<std::size_t>(2, key.size() / 2);
  for (const std::string& name : known) {
    const std::size_t distance = key.size() > longest ? longest : edit_distance(key, name);
    if (distance > std::max<std::size_t>(1, std::min(key.size(), name.size()) / 2)) continue;
    if (distance > least || (distance == least && !nearest.empty())) continue;
    nearest = name;
    least = distance;
  }
  if (!nearest.empty()) return fmt::format("did you mean `{}`?", nearest);
  const bool is_elsewhere = starts_with(here, "camera.") && pointer.find('/', 1) != std::string::npos;
  if (!here.empty() && !is_elsewhere) return "here it is " + here;
  return "known keys are " + quoted_list({known.begin(), known.end()}, ", ");
}

/// A position or direction of a scene in which y is up, in axes in which z is; other values as they are.
Json turned(const std::string& key, const Json& value) {
  static const std::set<std::string> in_world{"direction", "up",     "center", "normal",
                                              "position",  "target", "from",   "to"};
  const auto is_number = [](const Json& item) { return item.is_number(); };
  if (!in_world.count(key) || !value.is_array() || value.size() != 3) return value;
  if (!std::all_of(value.begin(), value.end(), is_number)) return value;
  return {value[0], 0.0 - value[2].get<double>(), value[1]};
}

/// Voxels along each axis of `extent`: `longest` along the longest axis, and voxels as close to cubes as possible.
Eigen::Vector3i cubic_resolution(const Eigen::Vector3d& extent, int longest) {
  const double length = extent.maxCoeff();
  if (longest == 1 || !(length > 0)) return Eigen::Vector3i::Ones();
  return ((extent / length * (longest - 1)).array().round() + 1).cast<int>();
}

void check(const GridSettings& grid) {
  if ((grid.max - grid.min).minCoeff() < 0) throw std::invalid_argument("`max` must not be below `min` on any axis");
  if (!(grid.max - grid.min).allFinite()) throw std::invalid_argument("`min` and `max` are too far apart");
  const Eigen::Vector3i& n = grid.resolution;
  if (n.minCoeff() < 1) throw std::invalid_argument("`resolution` must be at least 1 on every axis");
  if (((grid.max - grid.min).array() == 0 && n.array() > 1).any())
    throw std::invalid_argument("`resolution` must be 1 on an axis where `min` and `max` are equal");
  if (n.cast<double>().prod() > voxel_limit)
    throw std::invalid_argument(
        fmt::format("`resolution` asks for {} x {} x {} voxels, more than 2^31; ask for fewer", n.x(), n.y(), n.z()));
}

}  // namespace

SectionReader::SectionReader(const Json& object, std::string pointer, const SceneSource& source)
    : object_(object), pointer_(std::move(pointer)), source_(source) {}

const Json* SectionReader::find(const char* key) {
  known_.insert(key);
  const auto found = object_.find(key);
  return found == object_.end() ? nullptr : &*found;
}

std::string SectionReader::pointer_to(const std::string& key) const {
  std::string pointer = pointer_ + "/";
  for (const char c : key) {  // Escapes of RFC 6901.
    if (c == '~')
      pointer += "~0";
    else if (c == '/')
      pointer += "~1";
    else
      pointer += c;
  }
  return pointer;
}

void SectionReader::refuse(const std::string& key, const std::string& expected, const char* word) const {
  const std::string alternative = word ? fmt::format(", or \"{}\"", word) : "";
  source_.fail(
      fmt::format("`{}` must be {}{}, but is {}", pointer_to(key), expected, alternative, excerpt(object_.at(key))));
}

void SectionReader::value(const char* key, KeyMember& member, const char* /*meaning*/, const Limits& limits) {
  const Json* value = find(key);
  if (!value) return;
  if (limits.word && *value == limits.word)
    member.set_word();
  else if (!member.read(source_.is_y_up ? turned(key, *value) : *value, limits))
    refuse(key, member.expectation(limits), limits.word);
  member.resolve(source_);
}

void SectionReader::object(const char* key, const char* /*meaning*/, const Describe& describe_keys) {
  if (const Json* value = find(key)) read_object(*value, key, describe_keys);
}

void SectionReader::objects(const char* key, const char* /*meaning*/, const Describe& describe_next) {
  const Json* value = find(key);
  if (!value) return;
  if (!value->is_array()) refuse(key, "a list of objects");
  const SectionReader items(*value, pointer_to(key), source_);
  for (std::size_t i = 0; i < value->size(); ++i) items.read_object((*value)[i], std::to_string(i), describe_next);
}

void SectionReader::read_object(const Json& value, const std::string& key, const Describe& describe_keys) const {
  if (!value.is_object())
    source_.fail(fmt::format("`{}` must be an object, but is {}", pointer_to(key), excerpt(value)));
  SectionReader inner(value, pointer_to(key), source_);
  describe_keys(inner);
  inner.finish();
}

void SectionReader::only_where(std::initializer_list<const char*> keys, const char* chooser, const std::string& word,
                               const std::vector<std::string>& words) {
  if (std::find(words.begin(), words.end(), word) != words.end()) return;
  const std::string allowed = "\"" + joined(words, "\" or \"") + "\"";
  for (const char* key : keys)
    if (object_.contains(key)) strays_.push_back({key, chooser, word, allowed});
}

void SectionReader::generator(const char* key, std::optional<GenerateDescription>& member, const char* /*meaning*/) {
  const Json* value = find(key);
  if (!value) return;
  if (!value->is_object()) refuse(key, "an object");
  const SceneSource upright{source_.path};  // Generators have z up.
  SectionReader inner(*value, pointer_to(key), upright);
  const std::string kinds = "one of " + quoted_list(generator_kinds(), ", ");
  const Json* kind = inner.find("kind");
  if (!kind) source_.fail(fmt::format("`{}` needs the key `kind`: {}", pointer_to(key), kinds));
  const auto& known = generator_kinds();
  if (!kind->is_string() || std::find(known.begin(), known.end(), kind->get<std::string>()) == known.end())
    inner.refuse("kind", kinds);

  member.emplace();
  member->generator = generator_of(kind->get<std::string>());
  GridRequest grid;
  describe(grid, inner);
  std::visit([&inner](auto& parameters) { describe(parameters, inner); }, member->generator);
  inner.finish();
  try {
    member->grid = choose_grid(member->generator, grid);
    GridSettings small = default_grid(member->generator, 4);
    small.levels = grid.levels;
    generate(member->generator, small);  // Checks the ranges of the parameters.
  } catch (const std::invalid_argument& error) {
    source_.fail(fmt::format("`{}`: {}", pointer_to(key), error.what()));
  }
}

void SectionReader::require(std::initializer_list<const char*> keys) {
  required_.insert(required_.end(), keys.begin(), keys.end());
}

void SectionReader::exactly_one(std::initializer_list<const char*> keys) {
  alternatives_.insert(alternatives_.end(), keys.begin(), keys.end());
}

void SectionReader::exclude(const char* key, std::initializer_list<const char*> others) {
  for (const char* other : others) exclusions_.push_back({key, other});
}

void SectionReader::refuse_unknown_keys() const {
  for (const auto& item : object_.items()) {
    if (known_.count(item.key()) > 0) continue;
    source_.fail(fmt::format("unknown key `{}`; {}", pointer_to(item.key()), suggestion(item.key(), pointer_, known_)));
  }
}

void SectionReader::finish() const {
  refuse_unknown_keys();
  const std::string where = pointer_.empty() ? "the scene" : fmt::format("`{}`", pointer_);
  for (const std::string& key : required_)
    if (!object_.contains(key)) source_.fail(fmt::format("{} needs the key `{}`", where, key));
  const auto given = std::count_if(alternatives_.begin(), alternatives_.end(),
                                   [this](const std::string& key) { return object_.contains(key); });
  if (!alternatives_.empty() && given != 1)
    source_.fail(fmt::format("{} needs exactly one of {}", where, quoted_list(alternatives_, " and ")));
  for (const Stray& stray : strays_)
    source_.fail(fmt::format("`{}` has a meaning only where `{}` is {}, but that is \"{}\"; remove one of the two keys",
                             pointer_to(stray.key), pointer_to(stray.chooser), stray.allowed, stray.value));
  for (const Exclusion& exclusion : exclusions_) {
    if (!object_.contains(exclusion.key) || !object_.contains(exclusion.other)) continue;
    source_.fail(fmt::format("`{}` and `{}` exclude each other; remove one", pointer_to(exclusion.key),
                             pointer_to(exclusion.other)));
  }
}

void SchemaWriter::value(const char* key, KeyMember& member, const char* meaning, const Limits& limits) {
  Json schema = {{"description", meaning}};
  const Json value = member.schema(limits);
  if (limits.word)
    schema["anyOf"] = {value, {{"const", limits.word}}};
  else
    schema.update(value);
  const Json standard = limits.word && member.is_word() ? Json(limits.word) : member.json();
  const bool is_required = std::find(required_.begin(), required_.end(), key) != required_.end();
  if (!standard.is_null() && !is_required) schema["default"] = standard;
  if (!limits.examples.empty()) schema["examples"] = limits.examples;
  if (limits.is_knob) schema["knob"] = limits.from < limits.to ? Json{limits.from, limits.to} : Json(true);
  properties_[key] = schema;
}

void SchemaWriter::object(const char* key, const char* meaning, const Describe& describe_keys) {
  SchemaWriter inner;
  describe_keys(inner);
  properties_[key] = inner.finish(meaning);
}

void SchemaWriter::objects(const char* key, const char* meaning, const Describe& describe_next) {
  SchemaWriter inner;
  describe_next(inner);
  properties_[key] = {{"description", meaning}, {"type", "array"}, {"items", inner.finish("")}};
}

void SchemaWriter::only_where(std::initializer_list<const char*> keys, const char* chooser, const std::string& word,
                              const std::vector<std::string>& words) {
  Json chosen = {{"properties", {{chooser, {{"enum", words}}}}}};
  const bool is_default = std::find(words.begin(), words.end(), word) != words.end();
  if (!is_default) chosen["required"] = {chooser};
  for (const char* key : keys) rules_.push_back({{"anyOf", {chosen, {{"not", {{"required", {key}}}}}}}});
}

void SchemaWriter::generator(const char* key, std::optional<GenerateDescription>& /*member*/, const char* meaning) {
  Json kinds = Json::array();
  for (const std::string& kind : generator_kinds()) {
    SchemaWriter inner;
    inner.require({"kind"});
    inner.properties_["kind"] = {{"description", "kind of field"}, {"const", kind}};
    GridRequest grid;
    describe(grid, inner);
    Generator parameters = generator_of(kind);
    std::visit([&inner](auto& alternative) { describe(alternative, inner); }, parameters);
    kinds.push_back(inner.finish(""));
  }
  properties_[key] = {{"description", meaning}, {"oneOf", kinds}};
}

void SchemaWriter::require(std::initializer_list<const char*> keys) {
  required_.insert(required_.end(), keys.begin(), keys.end());
}

void SchemaWriter::exactly_one(std::initializer_list<const char*> keys) {
  for (const char* key : keys) alternatives_.push_back({{"required", {key}}});
}

void SchemaWriter::exclude(const char* key, std::initializer_list<const char*> others) {
  for (const char* other : others) rules_.push_back({{"not", {{"required", {key, other}}}}});
}

Json SchemaWriter::finish(const std::string& meaning) const {
  Json schema;
  if (!meaning.empty()) schema["description"] = meaning;
  schema["type"] = "object";
  schema["properties"] = properties_;
  schema["additionalProperties"] = false;
  if (!required_.empty()) schema["required"] = required_;
  if (!alternatives_.empty()) schema["oneOf"] = alternatives_;
  if (!rules_.empty()) schema["allOf"] = rules_;
  return schema;
}

GridSettings choose_grid(const Generator& generator, const GridRequest& request) {
  const auto* each = std::get_if<Eigen::Vector3i>(&request.resolution);
  const int longest = each ? each->maxCoeff() : std::get<int>(request.resolution);
  if (longest < 1) throw std::invalid_argument("`resolution` must be at least 1");

  GridSettings grid = default_grid(generator, std::max(longest, 2));  // With one voxel the box would have no extent.
  if (request.min) grid.min = *request.min;
  if (request.max) grid.max = *request.max;
  grid.levels = request.levels;
  if (each)
    grid.resolution = *each;
  else if (request.min || request.max || longest == 1)
    grid.resolution = cubic_resolution(grid.max - grid.min, longest);
  check(grid);
  return grid;
}

}  // namespace tensorray
