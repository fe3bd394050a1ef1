#include "renderer/color/color.h"

namespace tensorray {

const char* const builtin_color_config = R"(ocio_profile_version: 2

environment: {}
strictparsing: true
luma: [0.2126, 0.7152, 0.0722]
name: tensorray
description: Linear Rec.709 working space; sRGB and Rec.1886 displays, un-tone-mapped, with soft highlights, or through ACES 1.0 for SDR video.

roles:
  aces_interchange: ACES2065-1
  cie_xyz_d65_interchange: CIE-XYZ-D65
  data: Raw
  default: lin_rec709
  scene_linear: lin_rec709

file_rules:
  - !<Rule> {name: Default, colorspace: default}

shared_views:
  - !<View> {name: Un-tone-mapped, view_transform: Un-tone-mapped, display_colorspace: <USE_DISPLAY_NAME>}
  - !<View> {name: Soft highlights, view_transform: Soft highlights, display_colorspace: <USE_DISPLAY_NAME>}
  - !<View> {name: ACES SDR, view_transform: ACES SDR, display_colorspace: <USE_DISPLAY_NAME>}
  - !<View> {name: Raw, colorspace: Raw}

displays:
  sRGB:
    - !<Views> [Un-tone-mapped, Soft highlights, ACES SDR, Raw]
  Rec.1886:
    - !<Views> [Un-tone-mapped, Soft highlights, ACES SDR, Raw]

default_view_transform: Un-tone-mapped

view_transforms:
  - !<ViewTransform>
    name: Un-tone-mapped
    description: Shows 0 to 1 as they are, and clips above; white stays white.
    from_scene_reference: !<BuiltinTransform> {style: UTILITY - ACES-AP0_to_CIE-XYZ-D65_BFD}

  - !<ViewTransform>
    name: Soft highlights
    description: Shows 1 - exp(-x) of linear Rec.709, so that dark light is shown as it is, and bright light stays below white.
    from_scene_reference: !<GroupTransform>
      children:
        - !<BuiltinTransform> {style: ACEScg_to_ACES2065-1, direction: inverse}
        - !<BuiltinTransform> {style: UTILITY - ACES-AP1_to_LINEAR-REC709_BFD}
        - !<RangeTransform> {min_in_value: 0, min_out_value: 0}
        - !<MatrixTransform> {matrix: [-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1]}
        - !<LogTransform> {base: 2.718281828459045, direction: inverse}
        - !<MatrixTransform> {matrix: [-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1], offset: [1, 1, 1, 0]}
        - !<BuiltinTransform> {style: UTILITY - ACES-AP1_to_LINEAR-REC709_BFD, direction: inverse}
        - !<BuiltinTransform> {style: ACEScg_to_ACES2065-1}
        - !<BuiltinTransform> {style: UTILITY - ACES-AP0_to_CIE-XYZ-D65_BFD}

  - !<ViewTransform>
    name: ACES SDR
    description: The ACES 1.0 output transform for video of 100 nit, which compresses highlights.
    from_scene_reference: !<BuiltinTransform> {style: ACES-OUTPUT - ACES2065-1_to_CIE-XYZ-D65 - SDR-VIDEO_1.0}

display_colorspaces:
  - !<ColorSpace> {name: CIE-XYZ-D65, description: CIE XYZ relative to D65; the display-referred reference.}
  - !<ColorSpace>
    name: sRGB
    description: IEC 61966-2-1.
    from_display_reference: !<BuiltinTransform> {style: DISPLAY - CIE-XYZ-D65_to_sRGB}
  - !<ColorSpace>
    name: Rec.1886
    description: Rec.709 primaries with the Rec.1886 curve (gamma 2.4).
    from_display_reference: !<BuiltinTransform> {style: DISPLAY - CIE-XYZ-D65_to_REC.1886-REC.709}

colorspaces:
  - !<ColorSpace> {name: ACES2065-1, description: Linear AP0 primaries; the scene-referred reference.}
  - !<ColorSpace>
    name: ACEScg
    description: Linear AP1 primaries.
    to_scene_reference: !<BuiltinTransform> {style: ACEScg_to_ACES2065-1}
  - !<ColorSpace>
    name: lin_rec709
    description: Linear Rec.709 primaries, white D65.
    from_scene_reference: !<GroupTransform>
      children:
        - !<BuiltinTransform> {style: ACEScg_to_ACES2065-1, direction: inverse}
        - !<BuiltinTransform> {style: UTILITY - ACES-AP1_to_LINEAR-REC709_BFD}
  - !<ColorSpace>
    name: srgb_texture
    description: Pictures as most files hold them, Rec.709 primaries under the curve of IEC 61966-2-1.
    to_scene_reference: !<GroupTransform>
      children:
        - !<ExponentWithLinearTransform> {gamma: 2.4, offset: 0.055}
        - !<BuiltinTransform> {style: UTILITY - ACES-AP1_to_LINEAR-REC709_BFD, direction: inverse}
        - !<BuiltinTransform> {style: ACEScg_to_ACES2065-1}
  - !<ColorSpace> {name: Raw, description: Data that is not colour., isdata: true}
)";

}  // namespace tensorray
