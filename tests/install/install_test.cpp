// What `cmake --install` installs works where it is installed: programs, the C++ library, the Python package.

#include <cstdlib>

#include "tests/data_folder.h"
#include "tests/files.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;

class Install : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_);
    install("programs");
  }

  /// Runs a command of the shell in the test's folder, with `prefix` as the variable of that name.
  void run(const std::string& command) const {
    const std::string shell = "cd '" + folder_.string() + "' && prefix='" + prefix().string() + "' && " + command;
    EXPECT_EQ(std::system(shell.c_str()), 0) << command;
  }

  void install(const std::string& component) const {
    run("cmake --install '" TENSORRAY_BUILD_FOLDER "' --prefix \"$prefix\" --component " + component + " >install.log");
  }

  fs::path prefix() const { return folder_ / "prefix"; }

 private:
  const Temporary folder_{"install"};
};

TEST_F(Install, ProgramsRun) {
  const std::string scene = (test::source_folder() / "scenes" / "constant.json").string();
  run("\"$prefix/bin/tensorray\" render '" + scene +
      "' --set light.photons=1000 -q -o a.png -o a.vtp && test -s a.png");
  EXPECT_TRUE(fs::exists(prefix() / "share" / "doc" / "tensorray" / "scenes" / "vortex.json"));
}

TEST_F(Install, AProjectFindsTheLibrary) {
  install("development");
  const std::string project = (test::source_folder() / "tests" / "install" / "example").string();
  run("cmake -S '" + project +
      "' -B build -DCMAKE_PREFIX_PATH=\"$prefix\" >configure.log && cmake --build build >build.log");
  run("echo '{\"field\": {\"generate\": {\"kind\": \"vortex\", \"resolution\": 8}}, \"light\": {\"photons\": 1000},"
      " \"integrator\": {\"type\": \"photon_distribution\"}}' >scene.json");
  run("build/example scene.json | grep -qx 'tensorray [0-9.]*: 0.500 radians per unit of length' && test -s scene.png");
  run("\"$prefix/bin/tensorray\" render scene.json -q -o b.exr && cmp scene.exr b.exr");
}

TEST_F(Install, PythonFindsThePackage) {
  if (std::system("'" TENSORRAY_PYTHON_PROGRAM "' -c 'import numpy' 2>/dev/null") != 0)
    GTEST_SKIP() << "NumPy is not installed";
  install("python");
  run("PYTHONPATH=\"$prefix/" TENSORRAY_PYTHON_FOLDER "\" PYTHONDONTWRITEBYTECODE=1 '" TENSORRAY_PYTHON_PROGRAM
      "' -c \"import tensorray as tr; assert tr.__file__.startswith('$prefix'); "
      "tr.render(field=tr.make('vortex', resolution=8), changes={'light.photons': 1000}, outputs=['a.png', "
      "'a.vtp'])\"");
}

bool has(const std::string& program) { return std::system(("command -v " + program + " >/dev/null").c_str()) == 0; }

TEST_F(Install, ManualPagesAreRead) {
  if (!has("man")) GTEST_SKIP() << "man is not installed";
  for (const char* page : {"tensorray", "tensorray-render", "tensorray-import", "tensorray-view", "tensorray-make"}) {
    const std::string file = "\"$prefix/share/man/man1/" + std::string(page) + ".1\"";
    run("man --warnings -l " + file + " >page.txt 2>warnings.txt && test -s page.txt && ! test -s warnings.txt");
  }
  run("man -l \"$prefix/share/man/man1/tensorray-make.1\" | col -b | grep -q -- --circulation");
}

TEST_F(Install, ShellsComplete) {
  const std::string words = "$prefix/share/";
  const std::string bash =
      "source \"$0\"; COMP_CWORD=$(($# - 1)); COMP_WORDS=(\"$@\"); _tensorray; echo \"${COMPREPLY[@]}\"";
  const auto completes = [&](const std::string& typed, const std::string& expected) {
    run("test \"$(bash -c '" + bash + "' \"" + words + "bash-completion/completions/tensorray\" " + typed + ")\" = '" +
        expected + "'");
  };
  completes("tensorray re", "render");
  completes("tensorray make vor", "vortex");
  completes("tensorray make vortex --ci", "--circulation");
  completes("tensorray render --until", "--until-error");
  completes("tensorray render scene.js", "");  // Left to the names of files.
  if (has("zsh")) run("zsh -n \"" + words + "zsh/vendor-completions/_tensorray\"");
  if (has("fish"))
    run("fish -c 'source '\"" + words +
        "fish/vendor_completions.d/tensorray.fish\"'; complete -C \"tensorray make vortex "
        "--ci\"' | grep -q '^--circulation'");
}

}  // namespace
}  // namespace tensorray
