"""The Blender add-on, in `blender --background`."""

import importlib.util
import json
import os
import sys
import tempfile
import unittest

import bpy
import numpy as np

import tensorray as tr

ADD_ON = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "tools", "blender",
                      "tensorray_blender.py")
SCENE = """{ // A comment, with "quotes".
  "field": {"generate": {"kind": "point_load", "resolution": 17}, "scale": 3},
  "obstacles": [{"file": "body.ply"}],
  "receiver": {"resolution": [48, 32], "size": [3, 2]},
  "integrator": {"type": "photon_distribution", "density": {"kind": "histogram"}}
}"""
BODY = """ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element face 4
property list uchar int vertex_indices
end_header
1.2 0 -1.2
1.5 0 -1.2
1.2 0.3 -1.2
1.2 0 -1
3 0 2 1
3 0 1 3
3 0 3 2
3 1 2 3
"""


def positions_of(added):
    positions = np.empty(3 * len(added.data.vertices), np.float32)
    added.data.vertices.foreach_get("co", positions)
    return positions.reshape(-1, 3) @ np.array(added.matrix_world)[:3, :3].T + np.array(added.matrix_world)[:3, 3]


def pixels_of(image):
    pixels = np.empty(4 * image.size[0] * image.size[1], np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(image.size[1], image.size[0], 4)[::-1, :, :3]


class AddOnTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        spec = importlib.util.spec_from_file_location("tensorray_blender", ADD_ON)
        cls.add_on = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(cls.add_on)
        cls.add_on.register()

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.path = os.path.join(self.folder.name, "lit.json")
        with open(self.path, "w", encoding="utf-8") as file:
            file.write(SCENE)
        with open(os.path.join(self.folder.name, "body.ply"), "w", encoding="utf-8") as file:
            file.write(BODY)
        self.scene = json.loads(SCENE.replace('// A comment, with "quotes".', ""))

    def tearDown(self):
        self.folder.cleanup()

    def test_loads_tubes_plate_and_body(self):
        self.assertEqual(bpy.ops.import_scene.tensorray(filepath=self.path), {"FINISHED"})
        objects = {added.name: added for added in bpy.data.collections["lit"].objects}
        self.assertEqual(sorted(objects), ["body", "plate", "tubes"])
        np.testing.assert_allclose(np.sort(positions_of(objects["body"]), axis=0)[-1], [1.5, 0.3, -1], atol=1e-6)

        place = tr.landings(self.scene, s=0.2, folder=self.folder.name, progress=False)
        offsets = positions_of(objects["plate"]) - place.center
        np.testing.assert_allclose(offsets @ place.right, [-1.5, 1.5, 1.5, -1.5], atol=1e-6)
        np.testing.assert_allclose(offsets @ place.up, [-1, -1, 1, 1], atol=1e-6)
        picture = tr.render(self.scene, folder=self.folder.name, progress=False)
        np.testing.assert_array_equal(pixels_of(bpy.data.images["caustic"]), picture.linear)

        tubes = positions_of(objects["tubes"])
        drawn = tr.render({**self.scene, "integrator": {"type": "path_tracing", "max_samples": 1, "min_samples": 1,
                                                        "shading": "headlight"}},
                          folder=self.folder.name, keep=["paths"], changes={"camera.resolution": 8}, progress=False)
        points = np.concatenate([path["position"] for path in drawn.paths])
        np.testing.assert_allclose(tubes.min(axis=0), points.min(axis=0), atol=0.1)
        np.testing.assert_allclose(tubes.max(axis=0), points.max(axis=0), atol=0.1)
        colors = np.empty(4 * len(tubes), np.float32)
        objects["tubes"].data.color_attributes["tube color"].data.foreach_get("color_srgb", colors)
        self.assertGreater(np.ptp(colors.reshape(-1, 4)[:, :3], axis=0).min(), 0.3)

    def test_renders_from_its_camera(self):
        with open(self.path, "w", encoding="utf-8") as file:
            json.dump({**self.scene, "camera": {"direction": [1, 1, -1]}}, file)  # Blender's camera takes its place.
        bpy.ops.import_scene.tensorray(filepath=self.path, tubes=False, plate=False, bodies=False)
        camera = bpy.context.scene.camera
        camera.location, camera.rotation_euler = (0, -6, 0), (np.pi / 2, 0, 0)
        bpy.context.scene.render.resolution_x, bpy.context.scene.render.resolution_y = 60, 40
        bpy.context.scene.render.resolution_percentage = 100
        changes = {"integrator": {"type": "path_tracing", "shading": "headlight"}}
        self.assertEqual(bpy.ops.render.tensorray(changes=json.dumps(changes), samples=4), {"FINISHED"})
        angle = np.degrees(2 * np.arctan(np.tan(camera.data.angle / 2) * 40 / 60))
        wanted = tr.render({**self.scene, "integrator": {**changes["integrator"], "max_samples": 4, "min_samples": 4},
                            "camera": {"position": [0, -6, 0], "target": [0, -5, 0], "up": [0, 0, 1], "angle": angle,
                                       "resolution": [60, 40]}}, folder=self.folder.name, progress=False)
        self.assertEqual(pixels_of(bpy.data.images["tensorray"]).shape, (40, 60, 3))
        np.testing.assert_allclose(pixels_of(bpy.data.images["tensorray"]), wanted.linear, atol=0.02)
        self.assertGreater(np.ptp(wanted.linear), 0.1)


if __name__ == "__main__":
    ended = unittest.main(argv=sys.argv[:1] + ["-v"], exit=False)
    sys.exit(not ended.result.wasSuccessful())
