#pragma once
/// Where the tests find files that they do not make themselves.

#include <filesystem>

namespace tensorray::test {

/// The folder of the sources: example scenes, and the sources themselves.
std::filesystem::path source_folder();

/// The folder of the data sets: the environment variable TENSORRAY_DATA, or else shared/data beside the source folder.
/// It need not exist: tests that look for a file in it skip where the file is absent.
std::filesystem::path data_folder();

}  // namespace tensorray::test
