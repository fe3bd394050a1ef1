#pragma once
/// Checks on the command line that other programs will recognize an output as an OpenVDB file.

#include <filesystem>
#include <string>
#include <system_error>

namespace tensorray {

/// @return an error message if the name has another ending, else an empty string. Devices and pipes need no ending.
inline std::string check_vdb_output(const std::string& text) {
  const std::filesystem::path path(text);
  std::error_code error;
  if (path.extension() == ".vdb" || std::filesystem::is_other(path, error)) return "";
  return text + " must end in .vdb";
}

}  // namespace tensorray
