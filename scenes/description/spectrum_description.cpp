#include <algorithm>
#include <vector>

#include "base/text/text.h"
#include "scenes/description/description.h"

namespace tensorray {
namespace {

const std::string blackbody_word = "blackbody";

}  // namespace

bool Value<SpectrumDescription>::read(const Json& json, const Limits& limits, SpectrumDescription& target) {
  if (!json.is_string()) return false;
  const std::string text = json.get<std::string>();
  const std::vector<std::string> names = illuminant_names();
  if (std::find(names.begin(), names.end(), text) != names.end()) {
    target = Illuminant{text};
    return true;
  }
  if (text == blackbody_word || starts_with(text, blackbody_word + " ")) {
    const double kelvin = parse_number(trimmed(text.substr(blackbody_word.size()))).value_or(0);
    target = BlackBody{kelvin};
    return kelvin >= 100 && kelvin <= 1e9;
  }
  return names_file(text) && Value<std::filesystem::path>::read(json, limits, target.emplace<std::filesystem::path>());
}

std::string Value<SpectrumDescription>::expectation(const SpectrumDescription&, const Limits&) {
  std::string names;
  for (const std::string& name : illuminant_names()) names += fmt::format("\"{}\", ", name);
  return fmt::format("one of {}\"blackbody KELVIN\" with a temperature from 100 to 1e9, or a file (NAME.txt)", names);
}

Json Value<SpectrumDescription>::schema(const SpectrumDescription&, const Limits&) { return {{"type", "string"}}; }

Json Value<SpectrumDescription>::json(const SpectrumDescription& value) {
  if (const auto* illuminant = std::get_if<Illuminant>(&value)) return illuminant->name;
  if (const auto* body = std::get_if<BlackBody>(&value)) return fmt::format("{} {}", blackbody_word, body->kelvin);
  return std::get<std::filesystem::path>(value).string();
}

Spectrum load_spectrum(const SpectrumDescription& description) {
  if (const auto* named = std::get_if<Illuminant>(&description)) return illuminant(named->name);
  if (const auto* body = std::get_if<BlackBody>(&description)) return blackbody(body->kelvin);
  return read_spectrum(std::get<std::filesystem::path>(description));
}

}  // namespace tensorray
