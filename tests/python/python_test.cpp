// The Python package, in the Python that it was built for. The tests themselves are the *_test.py in this folder.

#include <cstdlib>

#include "tests/data_folder.h"
#include "tests/names.h"

namespace tensorray {
namespace {

/// What Python needs to load a module that is built with the sanitizer of addresses: the sanitizer's library first,
/// that of C++, whose functions it replaces, and where the module's libraries are, since it opens them for the module.
/// Python itself leaves objects at its end.
std::string sanitizer() {
  const std::string library = TENSORRAY_SANITIZER_LIBRARY;
  if (library.empty()) return "";
  return "LD_PRELOAD='" + library + ":libstdc++.so.6' LD_LIBRARY_PATH='" +
         std::filesystem::path(TENSORRAY_BINARY).parent_path().string() +
         "' ASAN_OPTIONS=\"$ASAN_OPTIONS:detect_leaks=0\" ";
}

/// Whether Python finds these modules.
bool has_modules(const std::string& names) {
  return std::system(("'" TENSORRAY_PYTHON_PROGRAM "' -c 'import " + names + "' 2>/dev/null").c_str()) == 0;
}

/// Runs a file of this folder with `program`, the words of a shell, which finds the package.
void run_with(const std::string& program, const std::string& file, const std::string& options = "") {
  const std::filesystem::path test = test::source_folder() / "tests" / "python" / file;
  const std::string command = "export PYTHONPATH='" TENSORRAY_PYTHON_FOLDER
                              "' PYTHONDONTWRITEBYTECODE=1 TENSORRAY_BINARY='" TENSORRAY_BINARY "'; " +
                              program + " '" + test.string() + "' " + options;
  EXPECT_EQ(std::system(command.c_str()), 0);
}

void run(const std::string& file) {
  static const bool has_numpy = has_modules("numpy");
  if (!has_numpy) GTEST_SKIP() << "NumPy is not installed";
  run_with(sanitizer() + "'" TENSORRAY_PYTHON_PROGRAM "'", file, "-v");
}

// CTest's two shards take every other test: the longest, `Doors`, is in one, and the next ones are in the other.
TEST(Python, Doors) { run("../doors"); }
TEST(Python, Shards) { run("shards_test.py"); }
TEST(Python, Fields) { run("fields_test.py"); }
TEST(Python, LongCalls) { run("long_calls_test.py"); }
TEST(Python, Rays) { run("rays_test.py"); }
TEST(Python, Renders) { run("renders_test.py"); }
TEST(Python, Package) { run("package_test.py"); }

TEST(Python, Notebooks) {
  if (!has_modules("ipykernel, matplotlib, nbconvert, scipy"))
    GTEST_SKIP() << "Jupyter (nbconvert, ipykernel), Matplotlib or SciPy is not installed";
  run("notebooks_test.py");
}

TEST(Python, ParaView) {
  if (std::system("pvpython --version >/dev/null 2>&1") != 0) GTEST_SKIP() << "ParaView (pvpython) is not installed";
  const std::filesystem::path compatibility = test::source_folder() / "tools" / "paraview" / "compatibility";
  run_with("PYTHONPATH=\"$PYTHONPATH:" + compatibility.string() + "\" pvpython", "paraview_test.py");
}

TEST(Python, Blender) {
  if (std::system("blender --version >/dev/null 2>&1") != 0) GTEST_SKIP() << "Blender is not installed";
  run_with("blender --background --python-use-system-env --factory-startup --python-exit-code 1 --python",
           "blender_test.py");
}

}  // namespace
}  // namespace tensorray
