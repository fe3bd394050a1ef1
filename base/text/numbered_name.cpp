#include "base/text/numbered_name.h"

#include <algorithm>
#include <cctype>
#include <cstddef>

namespace tensorray {
namespace {

constexpr std::size_t max_digits = 2;  ///< Of a width.

struct NumberSign {
  std::size_t size = 0;   ///< Characters of the sign; 0: there is none.
  std::size_t width = 0;  ///< The least number of digits.
};

std::size_t digits_at(const std::string& text, std::size_t at) {
  std::size_t count = 0;
  while (at + count < text.size() && std::isdigit(static_cast<unsigned char>(text[at + count])) != 0) ++count;
  return count;
}

std::size_t width_at(const std::string& text, std::size_t at, std::size_t digits) {
  return digits == 0 ? 1 : std::stoul(text.substr(at, digits));
}

/// #, ##, ###, ...
NumberSign hash_sign(const std::string& text, std::size_t at) {
  const std::size_t end = std::min(text.find_first_not_of('#', at), text.size());
  return {end - at, end - at};
}

/// %d, %04d
NumberSign percent_sign(const std::string& text, std::size_t at) {
  const std::size_t digits = text[at] == '%' ? digits_at(text, at + 1) : 0, end = at + 1 + digits;
  const bool is_sign = text[at] == '%' && end < text.size() && text[end] == 'd' && digits <= max_digits &&
                       (digits == 0 || text[at + 1] == '0');
  if (!is_sign) return {};
  return {digits + 2, width_at(text, at + 1, digits)};
}

/// $F, $F4
NumberSign dollar_sign(const std::string& text, std::size_t at) {
  if (text.compare(at, 2, "$F") != 0) return {};
  const std::size_t digits = digits_at(text, at + 2), end = at + 2 + digits;
  const bool is_word =
      end < text.size() && (std::isalpha(static_cast<unsigned char>(text[end])) != 0 || text[end] == '_');
  if (is_word || digits > max_digits) return {};
  return {digits + 2, width_at(text, at + 2, digits)};
}

NumberSign foreign_sign(const std::string& text, std::size_t at) {
  const NumberSign sign = percent_sign(text, at);
  return sign.size > 0 ? sign : dollar_sign(text, at);
}

NumberSign sign_at(const std::string& text, std::size_t at) {
  const NumberSign sign = hash_sign(text, at);
  return sign.size > 0 ? sign : foreign_sign(text, at);
}

template <class Find>
bool has_any(const std::string& text, const Find& find) {
  for (std::size_t at = 0; at < text.size(); ++at)
    if (find(text, at).size > 0) return true;
  return false;
}

}  // namespace

bool has_number_sign(const std::string& name) { return has_any(name, sign_at); }

bool has_foreign_number_sign(const std::string& name) { return has_any(name, foreign_sign); }

std::string numbered(const std::string& text, int number) {
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    const NumberSign sign = sign_at(text, at);
    if (sign.size == 0) {
      result += text[at++];
      continue;
    }
    const std::string digits = std::to_string(number);
    if (digits.size() < sign.width) result.append(sign.width - digits.size(), '0');
    result += digits;
    at += sign.size;
  }
  return result;
}

}  // namespace tensorray
