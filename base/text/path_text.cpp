#include "base/text/path_text.h"

#include <algorithm>
#include <cctype>

#include <fmt/core.h>
#include <unistd.h>

#include "base/text/content_hash.h"

namespace tensorray {
namespace {

unsigned byte_at(const std::string& text, std::size_t at) {
  return at < text.size() ? static_cast<unsigned char>(text[at]) : 0u;
}

bool is_continuation(unsigned byte) { return (byte & 0xc0u) == 0x80u; }

/// The number of bytes of the UTF-8 character that begins at `at`; 0 if none does (RFC 3629, section 4).
std::size_t character_at(const std::string& text, std::size_t at) {
  const unsigned first = byte_at(text, at), second = byte_at(text, at + 1);
  if (first < 0x80) return 1;
  const std::size_t size = first >= 0xc2 && first < 0xe0   ? 2
                           : (first & 0xf0u) == 0xe0       ? 3
                           : first >= 0xf0 && first < 0xf5 ? 4
                                                           : 0;
  for (std::size_t i = 1; i < size; ++i)
    if (!is_continuation(byte_at(text, at + i))) return 0;
  const bool is_too_long = (first == 0xe0 && second < 0xa0) || (first == 0xf0 && second < 0x90);
  const bool is_surrogate = first == 0xed && second >= 0xa0;
  const bool is_too_large = first == 0xf4 && second >= 0x90;
  return is_too_long || is_surrogate || is_too_large ? 0 : size;
}

/// The byte that the character at `at` stands for; -1: none. U+F780 to U+F7FF are EF 9E 80 to EF 9F BF.
int byte_of_character(const std::string& text, std::size_t at) {
  const unsigned second = byte_at(text, at + 1), third = byte_at(text, at + 2);
  if (byte_at(text, at) != 0xef || (second != 0x9e && second != 0x9f) || !is_continuation(third)) return -1;
  return static_cast<int>((second & 0x3fu) << 6 | (third & 0x3fu)) & 0xff;
}

void append_byte(unsigned byte, std::string& text) {
  const unsigned character = 0xf700u | byte;
  for (const unsigned each : {0xe0u | character >> 12, 0x80u | (character >> 6 & 0x3fu), 0x80u | (character & 0x3fu)})
    text += static_cast<char>(each);
}

std::size_t longest_name(const std::filesystem::path& folder) {
  constexpr std::size_t usual = 255;
  const long longest = pathconf(folder.empty() ? "." : folder.c_str(), _PC_NAME_MAX);
  return longest > 0 ? static_cast<std::size_t>(longest) : usual;
}

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

std::string utf8_of(const std::string& bytes) {
  std::string text;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t size = byte_of_character(bytes, at) >= 0 ? 0 : character_at(bytes, at);
    if (size == 0) append_byte(byte_at(bytes, at), text);
    text += bytes.substr(at, size);
    at += size == 0 ? 1 : size;
  }
  return text;
}

std::string bytes_of_utf8(const std::string& text) {
  std::string bytes;
  for (std::size_t at = 0; at < text.size();) {
    const int byte = byte_of_character(text, at);
    bytes += byte >= 0 ? static_cast<char>(byte) : text[at];
    at += byte >= 0 ? 3 : 1;
  }
  return bytes;
}

std::filesystem::path with_suffix(const std::filesystem::path& file, const std::string& suffix) {
  const std::string name = file.filename().string();
  const std::size_t longest = longest_name(file.parent_path());
  if (name.size() + suffix.size() <= longest) return file.string() + suffix;
  const std::string end = fmt::format("-{:016x}{}", content_hash(name), suffix);
  std::size_t kept = longest > end.size() ? longest - end.size() : 0;
  while (kept > 0 && is_continuation(byte_at(name, kept))) --kept;  // Whole characters.
  return file.parent_path() / (name.substr(0, kept) + end);
}

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
