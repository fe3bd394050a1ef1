// Where `tensorray-import` is not built: all that needs no VTK works, and the rest says what to do.

#include <cstdlib>
#include <filesystem>

#include "tests/program/support.h"

namespace tensorray::test {
namespace {

class WithoutImport : public Program {
 protected:
  /// Runs a copy of the program, beside which nothing lies.
  Outcome run_alone(const std::string& arguments) const {
    const std::filesystem::path alone = in_folder("bin") / "tensorray";
    std::filesystem::create_directories(alone.parent_path());
    std::filesystem::copy_file(TENSORRAY_BINARY, alone, std::filesystem::copy_options::skip_existing);
    const int status = std::system(
        ("cd '" + in_folder("").string() + "' && bin/tensorray " + arguments + " > stdout 2> stderr").c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_file(in_folder("stdout")),
            read_file(in_folder("stderr"))};
  }
};

TEST_F(WithoutImport, TheErrorSaysHowToBuildIt) {
  write("scene.json", small_scene());
  write("a.vtu", "");
  write("lines.vtp", "<VTKFile/>");
  for (const std::string arguments :
       {"import a.vtu -o a.vdb",
        "render scene.json -q --set integrator.type=path_tracing --set integrator.paths=lines.vtp -o a.png"}) {
    const Outcome outcome = run_alone(arguments);
    EXPECT_EQ(outcome.status, 1) << arguments;
    EXPECT_NE(outcome.error.find("`tools/setup release import`"), std::string::npos) << outcome.error;
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
  }
}

TEST_F(WithoutImport, PicturesAreRenderedAndVtkFilesWritten) {
  write("scene.json", small_scene());
  const Outcome outcome = run_alone("render scene.json -q -o a.png -o photons.vtp");
  EXPECT_EQ(outcome.status, 0) << outcome.error;
  for (const char* file : {"a.png", "photons.vtp"}) EXPECT_TRUE(std::filesystem::exists(in_folder(file))) << file;
}

}  // namespace
}  // namespace tensorray::test
