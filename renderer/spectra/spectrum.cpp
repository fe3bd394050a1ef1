#include "renderer/spectra/spectrum.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <stdexcept>

#include "base/errors.h"
#include "base/text/text.h"

namespace tensorray {
namespace {

constexpr double illuminant_min = 300, illuminant_max = 830;

// Published tables (CIE 015): the 1931 2° standard observer (x̄, ȳ, z̄) for each nanometre, and the relative spectral
// power of the standard illuminant D65 every 5 nm.
// clang-format off
constexpr std::array<double, 3 * 471> cie_1931_observer{
#include "renderer/spectra/cie_1931_observer.inc"
};
constexpr std::array<double, 107> cie_d65{
#include "renderer/spectra/cie_d65.inc"
};
// clang-format on

std::string text(double number) {
  char digits[32];
  return std::string(digits, std::to_chars(digits, std::end(digits), number).ptr);
}

/// Samples `value(wavelength)` at every nanometre from 300 to 830 nm.
template <class Value>
Spectrum tabulate(const Value& value) {
  Spectrum spectrum;
  for (double wavelength = illuminant_min; wavelength <= illuminant_max; ++wavelength) {
    spectrum.wavelengths.push_back(wavelength);
    spectrum.values.push_back(value(wavelength));
  }
  return spectrum;
}

/// Planck's law relative to 560 nm; `scale` is hc/(kT) in nm. It equals (560/λ)⁵ (e^(scale/560) − 1)/(e^(scale/λ) − 1),
/// in a form that does not overflow for cold bodies.
double planck(double wavelength, double scale) {
  return std::pow(560 / wavelength, 5) * std::exp(scale / 560 - scale / wavelength) * std::expm1(-scale / 560) /
         std::expm1(-scale / wavelength);
}

Spectrum illuminant_d65() {
  Spectrum spectrum;
  for (std::size_t i = 0; i < cie_d65.size(); ++i) {
    spectrum.wavelengths.push_back(illuminant_min + 5.0 * static_cast<double>(i));
    spectrum.values.push_back(cie_d65[i]);
  }
  return spectrum;
}

/// The power and the XYZ of light at a wavelength or in a band.
struct Amount {
  double power = 0;
  Eigen::Vector3d xyz = Eigen::Vector3d::Zero();
};

/// The wavelengths within [min, max] between which light and observer are both linear.
std::vector<double> knots(const Spectrum& light, double min, double max) {
  std::vector<double> result{min, max};
  const auto add = [&](double wavelength) {
    if (wavelength > min && wavelength < max) result.push_back(wavelength);
  };
  for (const double wavelength : light.wavelengths) add(wavelength);
  for (double wavelength = observer_min; wavelength <= observer_max; ++wavelength) add(wavelength);
  std::sort(result.begin(), result.end());
  return result;
}

/// Integrates exactly over [min, max]: between knots the product of light and observer is quadratic, so that two Gauss
/// points suffice. They lie inside the intervals: jumps at the ends do no harm.
Amount integrate(const Spectrum& light, double min, double max) {
  Amount sum;
  const std::vector<double> ends = knots(light, min, max);
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
    const double middle = (ends[i] + ends[i + 1]) / 2, half = (ends[i + 1] - ends[i]) / 2;
    for (const double node : {-1 / std::sqrt(3.0), 1 / std::sqrt(3.0)}) {
      const double wavelength = middle + node * half, power = light.at(wavelength) * half;
      sum.power += power;
      sum.xyz += power * observer(wavelength);
    }
  }
  return sum;
}

void check_range(double min, double max, int count) {
  if (count < 1) throw std::invalid_argument("the number of wavelengths must be at least 1, not " + text(count));
  if (!(min > 0 && min <= max && std::isfinite(max)))
    throw std::invalid_argument("the range of wavelengths must be 0 < min <= max in nm, not " + text(min) + " to " +
                                text(max));
  if (min == max && count != 1)
    throw std::invalid_argument("light of a single wavelength (" + text(min) + " nm) takes 1 wavelength, not " +
                                text(count));
}

void normalize(std::vector<Band>& bands, const std::string& range) {
  Amount sum;
  for (const Band& band : bands) {
    sum.power += band.power;
    sum.xyz += band.xyz;
  }
  if (!(sum.power > 0)) throw std::invalid_argument("the light has no power " + range + "; widen the range");
  if (!(sum.xyz.y() > 0))
    throw std::invalid_argument("the light has no visible power " + range + "; the eye sees 360 to 830 nm");
  for (Band& band : bands) {
    band.power /= sum.power;
    band.xyz /= sum.xyz.y();
  }
}

/// Splits a line at blanks, commas and semicolons. Drops '#' and what follows it.
std::vector<std::string> split_columns(const std::string& line) {
  const std::string content = line.substr(0, line.find('#'));
  constexpr const char* separators = " \t\r,;";
  std::vector<std::string> columns;
  std::size_t begin = content.find_first_not_of(separators);
  while (begin != std::string::npos) {
    const std::size_t end = std::min(content.find_first_of(separators, begin), content.size());
    columns.push_back(content.substr(begin, end - begin));
    begin = content.find_first_not_of(separators, end);
  }
  return columns;
}

/// Parses a number whose decimal sign is a point, in any locale.
bool parse_number(const std::string& word, double& number) {
  const char* begin = word.data() + (word.front() == '+' ? 1 : 0);
  const char* end = word.data() + word.size();
  const std::from_chars_result result = std::from_chars(begin, end, number);
  return result.ec == std::errc() && result.ptr == end;
}

/// @throw std::runtime_error; the message begins with `where`.
void append_sample(Spectrum& spectrum, const std::vector<std::string>& columns, bool any_sign,
                   const std::string& where) {
  double wavelength = 0, value = 0;
  if (columns.size() != 2)
    throw std::runtime_error(where + "expected two columns, wavelength (nm) and value, found " +
                             std::to_string(columns.size()));
  if (!parse_number(columns[0], wavelength) || !parse_number(columns[1], value))
    throw std::runtime_error(where + "expected two numbers, wavelength (nm) and value");
  if (!std::isfinite(wavelength) || wavelength <= 0)
    throw std::runtime_error(where + "the wavelength must be above 0 nm");
  if (!std::isfinite(value) || (value < 0 && !any_sign))
    throw std::runtime_error(where + "the value must be finite" + (any_sign ? "" : " and not negative"));
  if (!spectrum.wavelengths.empty() && wavelength <= spectrum.wavelengths.back())
    throw std::runtime_error(where + "wavelengths must increase; sort the lines, and give each wavelength once");
  spectrum.wavelengths.push_back(wavelength);
  spectrum.values.push_back(value);
}

}  // namespace

double Spectrum::at(double wavelength) const {
  if (!(wavelength >= wavelengths.front() && wavelength <= wavelengths.back())) return 0;
  const auto above = std::lower_bound(wavelengths.begin(), wavelengths.end(), wavelength);
  const std::size_t i = above - wavelengths.begin();
  if (*above == wavelength) return values[i];
  const double weight = (wavelength - wavelengths[i - 1]) / (wavelengths[i] - wavelengths[i - 1]);
  return (1 - weight) * values[i - 1] + weight * values[i];
}

std::vector<std::string> illuminant_names() { return {"D65", "E", "A"}; }

Spectrum illuminant(const std::string& name) {
  if (name == "D65") return illuminant_d65();
  if (name == "E") return {{illuminant_min, illuminant_max}, {100, 100}};
  if (name == "A") {
    // The CIE defines A with the value of hc/k and the temperature of that time.
    return tabulate([](double wavelength) { return 100 * planck(wavelength, 1.435e7 / 2848); });
  }
  throw std::invalid_argument("unknown illuminant \"" + name + "\"; known: " + joined(illuminant_names()));
}

Spectrum blackbody(double kelvin) {
  if (!(kelvin >= 100 && kelvin <= 1e9))
    throw std::invalid_argument("the temperature of a black body must be 100 to 1e9 K, not " + text(kelvin));
  constexpr double second_radiation_constant = 1.438776877e7;  // hc/k, nm K
  return tabulate([&](double wavelength) { return planck(wavelength, second_radiation_constant / kelvin); });
}

Spectrum read_spectrum(const std::filesystem::path& path, bool any_sign) {
  require_readable(path);
  std::ifstream file(path);
  Spectrum spectrum;
  std::string line;
  bool heading_allowed = true;
  for (int number = 1; std::getline(file, line); ++number) {
    if (number == 1 && line.rfind("\xEF\xBB\xBF", 0) == 0) line.erase(0, 3);  // UTF-8 byte order mark.
    const std::vector<std::string> columns = split_columns(line);
    if (columns.empty()) continue;
    double first = 0;
    const bool heading = heading_allowed && !parse_number(columns.front(), first);
    heading_allowed = false;
    if (!heading) append_sample(spectrum, columns, any_sign, path.string() + ", line " + std::to_string(number) + ": ");
  }
  if (spectrum.wavelengths.empty())
    throw std::runtime_error(path.string() + ": no samples; a spectrum is lines of wavelength (nm) and value");
  return spectrum;
}

Eigen::Vector3d observer(double wavelength) {
  if (!(wavelength >= observer_min && wavelength <= observer_max)) return Eigen::Vector3d::Zero();
  const double position = wavelength - observer_min;
  const std::size_t i = std::min(static_cast<std::size_t>(position), cie_1931_observer.size() / 3 - 2);
  const double weight = position - static_cast<double>(i);
  const Eigen::Map<const Eigen::Vector3d> below(&cie_1931_observer[3 * i]), above(&cie_1931_observer[3 * i + 3]);
  return (1 - weight) * below + weight * above;
}

std::vector<Band> make_bands(const Spectrum& light, double min, double max, int count) {
  check_range(min, max, count);
  std::vector<Band> bands(count);
  for (int i = 0; i < count; ++i) {
    Band& band = bands[i];
    if (min == max) {
      band = {min, 1, light.at(min), light.at(min) * observer(min)};
      continue;
    }
    const double begin = min + (max - min) * i / count, end = min + (max - min) * (i + 1) / count;
    const Amount amount = integrate(light, begin, end);
    band = {(begin + end) / 2, end - begin, amount.power, amount.xyz};
  }
  normalize(bands, min == max ? "at " + text(min) + " nm" : "between " + text(min) + " and " + text(max) + " nm");
  return bands;
}

}  // namespace tensorray
