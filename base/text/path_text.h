#pragma once
/// Paths as UTF-8, which JSON and other text formats need. A path of Linux is any bytes.

#include <filesystem>
#include <string>

namespace tensorray {

/// `bytes` as valid UTF-8. Bytes that are no UTF-8 become characters that no name has for another reason, U+F700 and
/// the byte, from Unicode's private use area; UTF-8 stays as it is. Those in `bytes` are written byte by byte, too.
std::string utf8_of(const std::string& bytes);

/// The bytes that utf8_of was given. Any other text stays as it is.
std::string bytes_of_utf8(const std::string& text);

inline std::string text_of_path(const std::filesystem::path& path) { return utf8_of(path.string()); }
inline std::filesystem::path path_of_text(const std::string& text) { return bytes_of_utf8(text); }

/// `file` with `suffix` at its end. Where the name would be longer than names may be, its middle is left out, and a
/// hash of it takes its place: names that differ stay different.
std::filesystem::path with_suffix(const std::filesystem::path& file, const std::string& suffix);

// Names of files of a sequence, in which a sign stands for the number of a frame or of a step of time: ####, or as
// other programs write it, %04d or $F4. All three are at least four digits; #, %d and $F are at least one.

/// Whether a name has a number.
bool has_number_sign(const std::string& name);

/// Whether a name has a number in a form of other programs (%04d, $F4), which no name has by chance.
bool has_foreign_number_sign(const std::string& name);

/// `text` with each sign replaced by the number: "flow.####.vdb" becomes "flow.0007.vdb".
std::string numbered(const std::string& text, int number);

}  // namespace tensorray
