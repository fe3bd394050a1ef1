"""Fills Blender's window for tools/blender/screenshot, which says how.

    blender --factory-startup --python tools/blender/window.py -- scenes/hemisphere_paths.json READY

The file READY appears when the window shows what it is to show.
"""

import os
import pathlib
import sys
import traceback

import bpy
from mathutils import Vector

ADD_ON = pathlib.Path(__file__).with_name("tensorray_blender.py")
#: The middle of the view, and the direction that it looks along: the scene's.
MIDDLE, ALONG = Vector((2.5, 0, 0.3)), Vector((0.8, 1, -0.8))


def enable_add_on():
    bpy.ops.preferences.addon_install(filepath=str(ADD_ON), overwrite=True)
    bpy.ops.preferences.addon_enable(module=ADD_ON.stem)


def load(path):
    """What the menus do: File > Import > tensorray, then Render > tensorray."""
    scene = bpy.context.scene
    for added in list(scene.objects):
        bpy.data.objects.remove(added)
    bpy.data.collections.remove(scene.collection.children[0])
    bpy.ops.import_scene.tensorray(filepath=os.path.abspath(path))
    for added in scene.objects:
        added.select_set(False)
    bpy.context.view_layer.objects.active = scene.objects["tubes"]
    bpy.ops.render.tensorray()  # From the scene's camera, as there is none in Blender.


def of_kind(window, kind):
    return next(area for area in window.screen.areas if area.type == kind)


def arrange(window):
    """The view of the volume, and an area for the picture beside it."""
    with bpy.context.temp_override(window=window, area=of_kind(window, "DOPESHEET_EDITOR")):
        bpy.ops.screen.area_close()
    with bpy.context.temp_override(window=window, area=of_kind(window, "VIEW_3D")):
        bpy.ops.screen.area_split(direction="VERTICAL", factor=0.55)


def show_volume(area):
    space = area.spaces.active
    space.shading.type = "MATERIAL"
    space.overlay.show_extras = False
    space.overlay.show_cursor = False
    view = space.region_3d
    view.view_perspective = "PERSP"
    view.view_location = MIDDLE
    view.view_rotation = ALONG.to_track_quat("-Z", "Y")
    view.view_distance = 14


def show_picture(window):
    area = max((area for area in window.screen.areas if area.type == "VIEW_3D"), key=lambda area: area.x)
    area.type = "IMAGE_EDITOR"
    area.spaces.active.image = bpy.data.images["tensorray"]


def fit_picture(window, area):
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.image.view_all(fit_view=True)


def show_properties(area):
    """The material of the tubes, whose colour is an attribute."""
    area.spaces.active.context = "MATERIAL"


def point(window, x, y, *values):
    """Moves the mouse, in pixels from the upper left corner, and presses its button if `values` say so."""
    for kind, value in (("MOUSEMOVE", "NOTHING"), *(("LEFTMOUSE", value) for value in values)):
        window.event_simulate(kind, value, x=x, y=window.height - y)


def in_turn(*steps):
    """Takes a step each second, so that Blender draws between them."""
    left = list(steps)

    def step():
        try:
            left.pop(0)()
        except Exception:
            traceback.print_exc()
            os._exit(1)  # Blender would go on without this step.
        return 1 if left else None
    bpy.app.timers.register(step, first_interval=1)


def main():
    path, ready = sys.argv[sys.argv.index("--") + 1:]
    preferences = bpy.context.preferences
    preferences.view.show_splash = False
    preferences.view.ui_scale = 1.2
    enable_add_on()
    load(path)
    window = bpy.context.window_manager.windows[0]
    in_turn(lambda: arrange(window),
            lambda: show_picture(window),
            lambda: fit_picture(window, of_kind(window, "IMAGE_EDITOR")),
            lambda: show_volume(of_kind(window, "VIEW_3D")),
            lambda: show_properties(of_kind(window, "PROPERTIES")),
            lambda: point(window, 150, 17, "PRESS", "RELEASE"),
            lambda: point(window, 190, 228),
            pathlib.Path(ready).touch)


main()
