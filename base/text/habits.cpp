#include "base/text/habits.h"

#include <algorithm>
#include <cctype>

#include "base/text/text.h"

namespace tensorray {
namespace {

struct Habit {
  const char* words;  ///< Letters and digits, between blanks.
  const char* here;
};

constexpr Habit habits[] = {
    {" fov fovy vfov fieldofview viewangle focallength ", "camera.angle, degrees from the lower to the upper edge"},
    {" eye origin location translate ", "camera.position"},
    {" lookat at aim interest ", "camera.target, the point that the camera looks at"},
    {" fstop fnumber apertureradius bokeh ", "camera.lens_radius, world units"},
    {" focaldistance focusdist focus ", "camera.focus_distance"},
    {" width height res imagesize xres yres ", "camera.resolution, or receiver.resolution: [width, height]"},
    {" spp samples samplesperpixel pixelsamples ", "integrator.max_samples, for each pixel"},
    {" noisethreshold noiselevel ", "integrator.noise, the error at which a pixel is done"},
    {" bounces maxbounces raydepth depth ", "integrator.max_depth"},
    {" transparent alpha ", "integrator.background: \"transparent\""},
    {" intensity power multiplier radiance energy ", "strength, of an item of lights; light.irradiance of the plate's"},
    {" sunangle sunsize angulardiameter ", "angle, degrees, of an item of lights of kind \"directional\""},
    {" envmap hdri skydome domelight environmentmap ", "file, of an item of lights of kind \"environment\""},
    {" basecolor albedo diffuse diffusecolor reflectance ", "material.color, linear Rec. 709"},
    {" ior eta refractiveindex ", "material.index, of glass"},
    {" metalness ", "material.metallic"},
    {" diffusemap basecolormap albedomap map ", "texture, of an item of objects"},
    {" normalmap bump bumpmap ", "normal_texture, of an item of objects"},
    {" roughnessmap ", "roughness_texture, of an item of objects"},
    {" filename path mesh geometry ", "file"},
    {" upaxis yup zup ", "world.up: \"y\" or \"z\""},
    {" tonemap tonemapping look ", "output.view, of the OpenColorIO config"}};

}  // namespace

std::string name_here(const std::string& word) {
  std::string plain = lower_case(word);
  const auto is_other = [](unsigned char c) { return !std::isalnum(c); };
  plain.erase(std::remove_if(plain.begin(), plain.end(), is_other), plain.end());
  for (const Habit& habit : habits)
    if (std::string(habit.words).find(' ' + plain + ' ') != std::string::npos) return habit.here;
  return "";
}

}  // namespace tensorray
