// tools/clip: makes a clip of the frames of a sequence.

#include "renderer/images/image.h"
#include "tests/program/support.h"

namespace tensorray {
namespace {

using namespace test;

class Clip : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    write("scene.json", R"({"field": {"generate": {"kind": "point_load", "resolution": 9}, "scale": 2},
        "light": {"photons": 500, "wavelengths": {"count": 4}, "direction": {"keys": [[1, [0, 0, -1]], [9, [0, 1, -1]]]}},
        "receiver": {"resolution": [33, 24]}, "integrator": {"type": "photon_distribution"}})");
    run_well({"render", "scene.json", "-q", "--frames", "1-9x4", "-o", "frame.##.png"});
  }
};

TEST_F(Clip, HasAllFrames) {
  if (std::system("command -v ffmpeg >/dev/null && command -v ffprobe >/dev/null") != 0)
    GTEST_SKIP() << "ffmpeg is not installed";
  for (const char* name : {"a.mp4", "a.gif"}) {
    const Outcome outcome = run_script("clip", fmt::format("'frame.##.png' {} 12", name));
    ASSERT_EQ(outcome.status, 0) << outcome.error;
    EXPECT_EQ(outcome.out, fmt::format("wrote {}, 3 frames\n", name));
    const std::string probe = fmt::format(
        "cd '{}' && ffprobe -v error -count_frames -select_streams v -show_entries stream=nb_read_frames,r_frame_rate "
        "-of csv=p=0 {} >probe",
        in_folder("").string(), name);
    ASSERT_EQ(std::system(probe.c_str()), 0);
    const std::string found = read_file(in_folder("probe"));  // GIF counts hundredths of a second.
    EXPECT_NE(found.find(",3\n"), std::string::npos) << found;
    EXPECT_TRUE(std::string(name) == "a.gif" || found.substr(0, 5) == "12/1,") << found;
  }
}

TEST_F(Clip, APictureIsASheetOfAllFrames) {
  if (std::system("command -v ffmpeg >/dev/null") != 0) GTEST_SKIP() << "ffmpeg is not installed";
  const Outcome outcome = run_script("clip", "'frame.##.png' sheet.png");
  ASSERT_EQ(outcome.status, 0) << outcome.error;
  const Image sheet = read_image(in_folder("sheet.png")), first = read_image(in_folder("frame.01.png"));
  EXPECT_EQ(sheet.width, 2 * first.width);  // Three frames: two rows.
  EXPECT_EQ(sheet.height, 2 * first.height);
}

TEST_F(Clip, ErrorsAreOneLine) {
  const std::pair<std::string, std::string> wrong[] = {{"frame.01.png a.mp4", "the number of a frame is #"},
                                                       {"'none.##.png' a.mp4", "there is no such file"},
                                                       {"'frame.##.png' a.mp4 fast", "is no number of frames a second"},
                                                       {"'frame.##.png' frame.05.png", "is one of the frames"},
                                                       {"'frame.##.png'", "give the frames"}};
  for (const auto& [arguments, text] : wrong) expect_one_line(run_script("clip", arguments), text, 2);
}

}  // namespace
}  // namespace tensorray
