#pragma once
/// Small helpers for text.

#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tensorray {

/// Makes one line of a library's error text: line ends become "; ", and blanks at the ends of lines are removed.
std::string one_line(const std::string& text);

/// `text` with its control characters as escapes ("\n", "\x1b"), so that a message stays one line on any terminal.
std::string escaped(const std::string& text);

/// Joins words to one text: "a, b, c".
std::string joined(const std::vector<std::string>& words, const char* separator = ", ");

/// Without the blanks, tabs and carriage returns at both ends.
std::string trimmed(const std::string& text);

bool starts_with(const std::string& text, const std::string& beginning);
bool ends_with(const std::string& text, const std::string& ending);

/// Changes ASCII letters to lower case.
std::string lower_case(std::string text);

/// The file name's ending with its dot, in lower case: ".png".
std::string lower_case_ending(const std::filesystem::path& path);

/// A number of bytes with its unit: "693.0 KiB", "1.5 MiB", "2.3 GiB".
std::string bytes_text(double bytes);

/// The number that all of `text` is, as data files write it, in every locale: "1", "+2.5e-3", "nan". Numbers that
/// double precision does not hold become 0 or infinite.
std::optional<double> parse_number(std::string_view text);

// The lines of files that have words and numbers, and perhaps bytes of any kind between them.

/// Calls `visit(line)` for each line of a file until it returns false. A line of more than `longest` characters is
/// passed as an empty one: it has no word that is looked for.
template <class Visit>
void for_each_short_line(const std::filesystem::path& path, std::size_t longest, const Visit& visit) {
  std::ifstream file(path, std::ios::binary);
  std::string line(longest + 2, '\0');
  while (!file.eof() && !file.bad()) {
    file.getline(line.data(), static_cast<std::streamsize>(line.size()));
    const bool is_long = file.fail() && !file.eof() && !file.bad();
    if (is_long) {
      file.clear();
      file.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
    }
    if (!visit(is_long ? std::string() : std::string(line.c_str()))) return;
  }
}

}  // namespace tensorray
