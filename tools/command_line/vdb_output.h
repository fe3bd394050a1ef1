#pragma once
/// @file tools/command_line/vdb_output.h
/// The check of the command line that an output will be known as an OpenVDB file.

#include <filesystem>
#include <string>
#include <system_error>

namespace tensorray {

/// Empty, or what is wrong: an ending that other programs will not know the file by. Devices and pipes have none.
inline std::string check_vdb_output(const std::string& text) {
  const std::filesystem::path path(text);
  std::error_code error;
  if (path.extension() == ".vdb" || std::filesystem::is_other(path, error)) return "";
  return text + " must end in .vdb";
}

}  // namespace tensorray
