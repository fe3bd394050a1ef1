#pragma once
/// Tables of keys. `describe(keys, visit)` of a struct shows each of its keys to a visitor: the reader
/// (SectionReader) or the schema writer (SchemaWriter), which so agree.

#include <filesystem>
#include <functional>
#include <initializer_list>
#include <optional>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "scenes/keys/json_reader.h"
#include "scenes/keys/values.h"
#include "volumes/making/generators.h"

namespace tensorray {

/// `field.generate`.
struct GenerateDescription {
  Generator generator;
  GridSettings grid;
};

/// The keys of the grid, in scene files (`field.generate`) and in `tensorray make`.
struct GridRequest {
  /// Voxels along the longest axis of the box (voxels are then cubes); or voxels along x, y and z.
  std::variant<int, Eigen::Vector3i> resolution = 64;
  std::optional<Eigen::Vector3d> min, max;  ///< Centres of the outermost voxels, world; none: the generator's.
  int levels = 1;                           ///< As GridSettings::levels.
};

constexpr int resolution_limit = 32768;       ///< Voxels along an axis.
constexpr double voxel_limit = 2147483648.0;  ///< Voxels of a generated grid: 72 GiB of tensors.

/// The keys of the grid; the generator has further keys.
template <class Visitor>
void describe(GridRequest& grid, Visitor& visit) {
  visit("resolution", grid.resolution,
        "voxels along the longest axis of the box (voxels are then cubes), or along x, y and z",
        between(1, resolution_limit));
  visit("min", grid.min, "least corner of the box, world; default: that of the kind");
  visit("max", grid.max, "greatest corner of the box, world; default: that of the kind");
  visit("levels", grid.levels, "of a point load: levels of voxels, each half as large, that are near the load",
        between(1, max_levels));
}

/// @throw std::invalid_argument that names the key: max below min, no voxel, too many voxels.
GridSettings choose_grid(const Generator& generator, const GridRequest& request);

/// The member of a struct that has the value of a key.
class KeyMember {
 public:
  virtual ~KeyMember() = default;

  // As of Value:
  virtual bool read(const Json& json, const Limits& limits) = 0;
  virtual std::string expectation(const Limits& limits) const = 0;
  virtual Json schema(const Limits& limits) const = 0;
  virtual Json json() const = 0;

  virtual void set_word() = 0;  ///< Sets the value that Limits::word means: none, or 0.
  virtual bool is_word() const = 0;
  virtual void resolve(const SceneSource& source) = 0;  ///< Of a path that was read.
};

template <class T>
class MemberOf final : public KeyMember {
 public:
  explicit MemberOf(T& member) : member_(member) {}

  bool read(const Json& json, const Limits& limits) override { return Value<T>::read(json, limits, member_); }
  std::string expectation(const Limits& limits) const override { return Value<T>::expectation(member_, limits); }
  Json schema(const Limits& limits) const override { return Value<T>::schema(member_, limits); }
  Json json() const override { return Value<T>::json(member_); }

  void set_word() override { set_word(member_); }
  bool is_word() const override { return is_word(member_); }
  void resolve(const SceneSource& source) override { resolve(source, member_); }

 private:
  template <class Any>
  static void set_word(Any& member) {
    if constexpr (std::is_arithmetic_v<Any>) member = 0;
  }
  static void set_word(std::string& member) { member.clear(); }
  template <class Any>
  static void set_word(std::optional<Any>& member) {
    member.reset();
  }

  template <class Any>
  static bool is_word(const Any& member) {
    if constexpr (std::is_arithmetic_v<Any>) return member == Any{};
    return false;
  }
  template <class Any>
  static bool is_word(const std::optional<Any>& member) {
    return !member;
  }

  template <class Any>
  static void resolve(const SceneSource&, Any&) {}
  static void resolve(const SceneSource& source, std::filesystem::path& path) { path = source.resolve(path); }
  template <class... Types>
  static void resolve(const SceneSource& source, std::variant<Types...>& value) {
    std::visit([&source](auto& each) { resolve(source, each); }, value);
  }

  T& member_;
};

// Of many structs: compiled once, in section_reader.cpp.
extern template class MemberOf<int>;
extern template class MemberOf<double>;
extern template class MemberOf<std::optional<double>>;
extern template class MemberOf<std::optional<Eigen::Vector3d>>;

class KeyVisitor {
 public:
  virtual ~KeyVisitor() = default;

  /// A key with a value.
  template <class T>
  void operator()(const char* key, T& member, const char* meaning, const Limits& limits = {}) {
    MemberOf<T> typed(member);
    value(key, typed, meaning, limits);
  }

  /// An object with keys of its own.
  template <class Keys>
  void section(const char* key, Keys&& keys, const char* meaning) {
    object(key, meaning, [&keys](KeyVisitor& inner) { describe(keys, inner); });
  }
  template <class Keys>
  void section(const char* key, std::optional<Keys>& keys, const char* meaning) {
    object(key, meaning, [&keys](KeyVisitor& inner) { describe(keys.emplace(), inner); });
  }

  /// A list of such objects. @param keys_of  The keys of an item.
  template <class Item, class KeysOf>
  void list(const char* key, std::vector<Item>& items, const char* meaning, KeysOf keys_of) {
    objects(key, meaning, [&](KeyVisitor& inner) {
      auto&& keys = keys_of(items.emplace_back());
      describe(keys, inner);
    });
  }

  /// Keys that are allowed only if `value`, the member of the key `chooser`, is one of `values`.
  template <class Enum>
  void only_for(std::initializer_list<const char*> keys, const char* chooser, Enum value,
                std::initializer_list<Enum> values) {
    std::vector<std::string> words;
    for (const Enum each : values) words.push_back(choice_name(each));
    only_where(keys, chooser, choice_name(value), words);
  }

  /// An object whose keys depend on its `kind`.
  virtual void generator(const char* key, std::optional<GenerateDescription>& member, const char* meaning) = 0;

  // Rules for several keys of one object:
  virtual void require(std::initializer_list<const char*> keys) = 0;
  virtual void exactly_one(std::initializer_list<const char*> keys) = 0;
  virtual void exclude(const char* key, std::initializer_list<const char*> others) = 0;

 protected:
  using Describe = std::function<void(KeyVisitor& inner)>;

  virtual void value(const char* key, KeyMember& member, const char* meaning, const Limits& limits) = 0;
  virtual void object(const char* key, const char* meaning, const Describe& describe_keys) = 0;
  virtual void objects(const char* key, const char* meaning, const Describe& describe_next) = 0;
  virtual void only_where(std::initializer_list<const char*> keys, const char* chooser, const std::string& word,
                          const std::vector<std::string>& words) = 0;
};

}  // namespace tensorray
