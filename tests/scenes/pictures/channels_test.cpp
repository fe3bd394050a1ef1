#include <regex>

#include "scenes/outputs/channel_table.h"
#include "tests/data_folder.h"
#include "tests/scenes/pictures/pictures.h"

namespace tensorray {
namespace {

/// The names in the tables of channels of the documents' section about a method: "| `texture.s`, `.t` | ... |".
Settings documented_channels(const std::string& method) {
  std::ifstream file(source_folder() / "docs" / "scenes.md");
  const std::regex quoted("`([^`]+)`");
  Settings names;
  bool is_in_section = false, is_in_table = false;
  for (std::string line, layer; std::getline(file, line);) {
    if (line.rfind("## ", 0) == 0 || line.rfind("### ", 0) == 0) is_in_section = line == "### " + method;
    if (line.rfind('|', 0) != 0) is_in_table = false;
    const std::string cell = line.substr(0, line.find(" | "));
    for (std::sregex_iterator name(cell.begin(), cell.end(), quoted), end; is_in_table && name != end; ++name) {
      const std::string text = (*name)[1];
      if (text[0] != '.') layer = text.substr(0, text.rfind('.'));
      names.push_back(text[0] == '.' ? layer + text : text);
    }
    if (is_in_section && line == "| channel | meaning |") is_in_table = true;
  }
  return names;
}

class Channels : public Pictures {
 protected:
  Channels() {
    write("scene.json", R"({
      "field": {"generate": {"kind": "helix", "resolution": 9}, "scale": 0.6},
      "light": {"photons": 500, "wavelengths": {"count": 4}},
      "receiver": {"resolution": [8, 8]}, "camera": {"resolution": [8, 8]},
      "lights": [{"kind": "constant", "group": "GROUP"}, {"kind": "directional"}],
      "integrator": {"type": "scene", "bands": 8, "max_samples": 1, "min_samples": 1, "seeds": {"count": 4},
                     "stretch": {"pixels": 8}, "caustic": {"resolution": 16, "rays": 100, "passes": 1}}})");
  }
};

TEST_F(Channels, DocumentsListThoseOfEachMethod) {
  for (const auto& method : default_scene().integrator.methods) {
    const std::string name = method->name();
    Settings expected = documented_channels(name);
    EXPECT_FALSE(expected.empty()) << name;
    // Those of a plate's light are beside its colours, those of "scene" beside those of all pictures of surfaces.
    if (name == "photon_distribution") expected = joined(expected, {"R", "G", "B"});
    if (name == "scene") expected = joined(expected, documented_channels("path_tracing"));
    EXPECT_THAT(render({"integrator.type=" + name}).channels, testing::UnorderedElementsAreArray(expected)) << name;
  }
}

TEST_F(Channels, OfLayersThatAreChosen) {
  const auto made = [&](const Settings& changes) {
    const Image whole = render_all(changes, {"a.exr"}).linear, file = read_image(in_folder("a.exr"));
    for (const std::string& name : file.channels) {
      const bool is_half = changes.size() > 1 && name != "Z" && name != "A";
      const std::vector<float> exact = channel(whole, name), found = channel(file, name);
      EXPECT_EQ(exact != found, is_half) << name;
      for (std::size_t i = 0; i < exact.size(); ++i) EXPECT_NEAR(found[i], exact[i], 5e-4 * std::abs(exact[i]) + 1e-7);
    }
    return file.channels;
  };
  EXPECT_THAT(made({"output.exr_layers=[]"}), testing::UnorderedElementsAre("R", "G", "B", "A"));
  EXPECT_THAT(made({R"(output.exr_layers=["Z","GROUP"])", "output.exr_type=half", "integrator.background=transparent"}),
              testing::UnorderedElementsAre("R", "G", "B", "A", "Z", "GROUP.R", "GROUP.G", "GROUP.B"));
  expect_error(2, "scene makes no layer \"normals\"; it makes Z, normal, albedo, .*, straight, GROUP",
               {R"(output.exr_layers=["normals"])"});
}

}  // namespace
}  // namespace tensorray
