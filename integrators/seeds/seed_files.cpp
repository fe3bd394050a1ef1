#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>
#include <string>

#include "base/errors.h"
#include "base/text/text.h"
#include "integrators/seeds/seeds.h"

namespace tensorray {
namespace {

std::vector<std::string> words_of(std::string line) {
  const std::string separators = " \t\r,;";
  line.resize(std::min(line.find('#'), line.size()));
  std::vector<std::string> words;
  for (std::size_t first = 0; (first = line.find_first_not_of(separators, first)) != std::string::npos;) {
    const std::size_t last = std::min(line.find_first_of(separators, first), line.size());
    words.push_back(line.substr(first, last - first));
    first = last;
  }
  return words;
}

/// A line, which ends with a line feed, a carriage return, or both. @return false at the end of the file.
bool get_line(std::istream& file, std::string& line) {
  line.clear();
  std::istream::int_type c = 0;
  while ((c = file.get()) != std::istream::traits_type::eof() && c != '\n' && c != '\r') line += static_cast<char>(c);
  if (c == '\r' && file.peek() == '\n') file.get();
  return !line.empty() || c != std::istream::traits_type::eof();
}

bool is_header(const std::vector<std::string>& words) {
  return std::none_of(words.begin(), words.end(), [](const std::string& word) { return parse_number(word); });
}

void add_seed(const std::vector<std::string>& words, SeedList& seeds) {
  double numbers[6];
  for (std::size_t i = 0; i < words.size(); ++i) {
    numbers[i] = parse_number(words[i]).value_or(NAN);
    if (!std::isfinite(numbers[i]))
      throw std::runtime_error("\"" + escaped(words[i].substr(0, 40)) + "\" is not a finite number");
  }
  seeds.positions.emplace_back(numbers[0], numbers[1], numbers[2]);
  if (words.size() == 3) return;
  const Eigen::Vector3d direction = Eigen::Vector3d(numbers[3], numbers[4], numbers[5]).stableNormalized();
  if (direction.isZero()) throw std::runtime_error("the direction has length zero: give a vector that is not zero");
  seeds.directions.push_back(direction);
}

}  // namespace

SeedList read_seeds(const std::filesystem::path& path) {
  require_readable(path);
  std::ifstream file(path);
  SeedList seeds;
  std::size_t columns = 0;
  std::string line;
  for (std::size_t number = 1; get_line(file, line); ++number) {
    if (number == 1 && line.compare(0, 3, "\xef\xbb\xbf") == 0) line.erase(0, 3);
    const std::vector<std::string> words = words_of(line);
    if (words.empty()) continue;
    try {
      if (words.size() != 3 && words.size() != 6)
        throw std::runtime_error("a seed is three numbers (x y z), or six (x y z and a direction), not " +
                                 std::to_string(words.size()));
      if (columns != 0 && words.size() != columns)
        throw std::runtime_error("all lines must have the same number of values: the lines above have " +
                                 std::to_string(columns));
      const bool header = columns == 0 && is_header(words);
      columns = words.size();
      if (!header) add_seed(words, seeds);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(path.string() + ": line " + std::to_string(number) + ": " + error.what());
    }
  }
  if (file.bad()) throw std::runtime_error(path.string() + ": cannot be read to its end");
  if (seeds.positions.empty())
    throw std::runtime_error(path.string() + ": contains no seeds: write one point x y z in each line");
  return seeds;
}

}  // namespace tensorray
