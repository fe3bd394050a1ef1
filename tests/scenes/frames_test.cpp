// Tests keyframes, and numbers of frames in file names.

#include "scenes/source/overrides.h"
#include "tests/files.h"

namespace tensorray {
namespace {

const SceneSource source{"scene.json"};

Json at(const char* text, int frame) {
  Json scene = parse_value(text);
  set_frame(scene, frame, source);
  return scene;
}

TEST(Frames, AreReadFromTheirRange) {
  EXPECT_THAT(parse_frames("7"), ElementsAre(7));
  EXPECT_THAT(parse_frames("1-4"), ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(parse_frames("0-10x4"), ElementsAre(0, 4, 8));
  EXPECT_THAT(parse_frames("1,3,7-9"), ElementsAre(1, 3, 7, 8, 9));
  EXPECT_THAT(parse_frames("5-9x2,6,5-7"), ElementsAre(5, 7, 9, 6));  // Each once.
  for (const char* bad :
       {",",  "1,",  ",1",    "1,,2", "1;2",   "1, 2",  "1,2-", "0-999999,1000000", "0-599999,0-599999", "", "-", "1-",
        "-3", "4-1", "1-4x0", "1-4x", "1-4y2", "1 - 4", "1.5",  "99999999999",      "0-1000000000"})
    EXPECT_THROW(parse_frames(bad), std::invalid_argument) << bad;
}

TEST(Frames, NumbersTakeThePlaceOfNumberSigns) {
  EXPECT_EQ(numbered("flow.####.vdb", 7), "flow.0007.vdb");
  EXPECT_EQ(numbered("#/a##", 123), "123/a123");
  EXPECT_EQ(numbered("none", 1), "none");
  struct Case {
    const char *name, *with_7, *with_12345;
  };
  for (const Case& each : {Case{"a.%04d.png", "a.0007.png", "a.12345.png"}, Case{"a.%d.png", "a.7.png", "a.12345.png"},
                           Case{"a.$F4.png", "a.0007.png", "a.12345.png"}, Case{"a.$F.png", "a.7.png", "a.12345.png"},
                           Case{"$F", "7", "12345"}, Case{"%03d#$F2", "007707", "123451234512345"}}) {
    EXPECT_EQ(numbered(each.name, 7), each.with_7);
    EXPECT_EQ(numbered(each.name, 12345), each.with_12345);
    EXPECT_TRUE(has_number_sign(each.name));
    EXPECT_TRUE(has_foreign_number_sign(each.name));
  }
  for (const char* name : {"100%.png", "%s", "%4d", "%0x4d", "$FOO", "$F_a", "$", "%", "%0", "$F123", "%0123d", ""}) {
    EXPECT_EQ(numbered(name, 7), name);
    EXPECT_FALSE(has_number_sign(name)) << name;
  }
  EXPECT_TRUE(has_number_sign("a.#.png"));
  EXPECT_FALSE(has_foreign_number_sign("a.#.png"));
  EXPECT_EQ(at(R"({"field": {"file": "flow.##.vdb"}, "list": ["#"]})", 3)["field"]["file"], "flow.03.vdb");
}

TEST(Frames, KeyframesAreInterpolated) {
  const char* scene = R"({"a": {"keys": [[10, 1], [20, 3], [40, 3]]},
                          "light": {"direction": {"keys": [[10, [0, 0, -1]], [20, [0, 2, -1]]], "ease": "smooth"}}})";
  EXPECT_EQ(at(scene, 1)["a"], 1);
  EXPECT_EQ(at(scene, 15)["a"], 2.0);
  EXPECT_EQ(at(scene, 20)["a"], 3);
  EXPECT_TRUE(at(scene, 30)["a"].is_number_integer());  // It does not change.
  EXPECT_EQ(at(scene, 99)["a"], 3);
  EXPECT_EQ(at(scene, 15)["light"]["direction"], Json({0.0, 1.0, -1}));
  EXPECT_DOUBLE_EQ(at(scene, 12)["light"]["direction"][1].get<double>(), 2 * 0.04 * (3 - 0.4));
  Json without = parse_value(R"({"a": 1, "b": ["x", {"c": 2}]})"), copy = without;
  set_frame(copy, 5, source);
  EXPECT_EQ(copy, without);
  refuse_keyframes(without, source);
}

TEST(Frames, BadKeyframesAreRefusedWithTheirPlace) {
  const auto error = [](const std::string& keyframes) {
    return message([&] { at(("{\"light\": {\"a\": " + keyframes + "}}").c_str(), 1); });
  };
  EXPECT_THAT(error(R"({"keys": []})"), HasSubstr("scene.json: `/light/a`: `keys` must be a list"));
  EXPECT_THAT(error(R"({"keys": 3})"), HasSubstr("must be a list"));
  EXPECT_THAT(error(R"({"keys": [[1]]})"), HasSubstr("key 1 must be [frame, value]"));
  EXPECT_THAT(error(R"({"keys": [[1, 2], [2, "x"]]})"), HasSubstr("key 2 must be"));
  EXPECT_THAT(error(R"({"keys": [[1, 2], [1, 3]]})"), HasSubstr("must increase"));
  EXPECT_THAT(error(R"({"keys": [[1, 2], [2, [3]]]})"), HasSubstr("the same number"));
  EXPECT_THAT(error(R"({"keys": [[1, 2]], "ease": "bounce"})"), HasSubstr("linear or smooth"));
  EXPECT_THAT(error(R"({"keys": [[1, 2]], "loop": true})"), HasSubstr("unknown key `loop`"));
  const Json scene = parse_value(R"({"light": {"a": {"keys": [[1, 2]]}}})");
  EXPECT_THAT(message([&] { refuse_keyframes(scene, source); }), HasSubstr("`/light/a` has keyframes: give --frames"));
}

}  // namespace
}  // namespace tensorray
