"""Renders: the bytes of the command line, arrays, errors."""

import gc
import json
import os
import subprocess
import tempfile
import unittest

import numpy as np

import tensorray as tr

FIELD = {"generate": {"kind": "point_load", "resolution": 17}}
PHOTONS = {"field": FIELD, "light": {"photons": 2000, "wavelengths": {"count": 4}},
           "receiver": {"resolution": [40, 32]}, "integrator": {"type": "photon_distribution"}}
OTHERS = {
    "lens": {"field": FIELD, "receiver": {"resolution": [24, 24]}, "integrator": {"type": "lens"}},
    "path_tracing": {"field": FIELD, "camera": {"resolution": [24, 24]},
                     "integrator": {"type": "path_tracing", "max_samples": 4}},
    "stretch": {"field": FIELD, "integrator": {"type": "stretch", "stretch": {"pixels": 48}}},
    "polariscope": {"field": FIELD, "receiver": {"resolution": [24, 24]}, "integrator": {"type": "polariscope"}},
}


def command_line(folder, *arguments):
    return subprocess.run([os.environ["TENSORRAY_BINARY"], *arguments], cwd=folder, capture_output=True, text=True)


def bytes_of(folder, name):
    with open(os.path.join(folder, name), "rb") as file:
        return file.read()


class RendersTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = temporary.name

    def path(self, name):
        return os.path.join(self.folder, name)

    def same_files(self, scene, endings, field=None, scene_for_python=None):
        """Whether both ways to render a scene write the same files."""
        with open(self.path("scene.json"), "w") as file:
            json.dump(scene, file)
        options = [option for ending in endings for option in ("-o", "program" + ending)]
        ended = command_line(self.folder, "render", "scene.json", "-q", *options)
        self.assertEqual(ended.returncode, 0, ended.stderr)
        tr.render(scene_for_python or scene, field=field, outputs=[self.path("python" + ending) for ending in endings])
        for ending in endings:
            written = [bytes_of(self.folder, name + ending) for name in ("python", "program")]
            self.assertEqual(written[0], written[1], ending)

    def test_a_polariscope_measures_a_stress(self):
        """A plate 0.01 thick, pulled by 1e6: C σ h = 780 nm. Stokes' parameters of one ray are those of polarised light."""
        T = np.zeros((1, 5, 5, 3, 3))
        T[..., 0, 0] = 1e6
        plate = tr.Field(T, voxel_size=(1, 1, 0.01))
        scene = {"receiver": {"size": [2, 2], "resolution": 4}, "output": {"stokes": True},
                 "integrator": {"type": "polariscope", "stress_optic": 78e-12, "samples": 1}}
        picture = tr.render(scene, field=plate, keep=["spectral"])
        np.testing.assert_allclose(picture.aovs["integral"], 780, rtol=1e-5)
        np.testing.assert_allclose(picture.aovs["length"], 0.01, rtol=1e-5)
        S = picture.stokes
        self.assertEqual(S.shape, (4, 4, len(picture.wavelengths), 4))
        np.testing.assert_allclose((S[..., 1:] ** 2).sum(axis=-1), S[..., 0] ** 2, rtol=1e-4)
        self.assertEqual(picture.spectral.shape, S.shape[:3])

    def test_the_bytes_are_those_of_the_command_line(self):
        self.same_files(PHOTONS, [".png", ".exr", ".spectral.exr", ".fluence.vdb", ".vdb"])
        for scene in OTHERS.values():
            self.same_files(scene, [".png", ".exr"])

    def test_a_field_object_gives_the_bytes_of_its_file(self):
        self.assertEqual(command_line(self.folder, "make", "vortex", "-o", "f.vdb", "--resolution", "16").returncode, 0)
        file = self.path("f.vdb")
        field = tr.read_vdb(file)
        for up in ("z", "y"):
            scene = {**PHOTONS, "world": {"up": up}, "field": {"file": file, "eigenvalues": "raw"}}
            self.same_files(scene, [".exr", ".png"], field, {**scene, "field": {"eigenvalues": "raw"}})
        without = {key: value for key, value in PHOTONS.items() if key != "field"}
        self.same_files({"field": FIELD, **without}, [".exr"], field=tr.make(**FIELD["generate"]),
                        scene_for_python=without)

    def test_scene_files_and_changes(self):
        with open(self.path("scene.json"), "w") as file:
            file.write("// a comment\n" + json.dumps(PHOTONS))
        a = tr.render(self.path("scene.json"), changes={"light.photons": 500, "receiver.resolution": [8, 4]}, seed=3)
        self.assertEqual(a.linear.shape, (4, 8, 3))
        self.assertEqual(a.scene["light"]["photons"], 500)
        self.assertEqual(a.scene["seed"], 3)
        self.assertEqual(os.listdir(self.folder), ["scene.json"])  # Nothing is written unless asked for.

    def test_frames_of_keyframes(self):
        turning = {**PHOTONS, "light": {**PHOTONS["light"], "direction": {"keys": [[1, [0, 0, -1]], [3, [0, 2, -1]]]}}}
        with open(self.path("scene.json"), "w") as file:
            json.dump(turning, file)
        ended = command_line(self.folder, "render", "scene.json", "-q", "--frames", "2", "--set", "field.scale=2",
                             "-o", "program.##.exr")
        self.assertEqual(ended.returncode, 0, ended.stderr)
        changes = {"field.scale": 2}
        picture = tr.render(turning, frame=2, changes=changes, outputs=self.path("python.##.exr"))
        self.assertEqual(bytes_of(self.folder, "python.02.exr"), bytes_of(self.folder, "program.02.exr"))
        picture.write(self.path("later.##.exr"))
        self.assertEqual(bytes_of(self.folder, "later.02.exr"), bytes_of(self.folder, "program.02.exr"))
        for up in ("z", "y"):
            map_ = tr.landings(turning, s=0.2, frame=3, changes={**changes, "world.up": up})
            np.testing.assert_allclose(np.cross(map_.right, map_.up) @ [0, 2, -1], -np.sqrt(5), rtol=1e-9)
        with self.assertRaisesRegex(tr.SceneError, "frame=1"):
            tr.render(turning)

    def test_numpy_values_and_relative_paths(self):
        tr.make("vortex", resolution=8).write(self.path("f.vdb"))
        scene = {**PHOTONS, "field": {"file": "f.vdb"},
                 "light": {"direction": np.array([0, 0, -1.0]), "photons": np.int64(500)}}
        self.assertEqual(tr.render(scene, folder=self.folder).linear.shape[2], 3)
        with self.assertRaisesRegex(RuntimeError, "f.vdb"):
            tr.render(scene)

    def test_no_output_takes_the_place_of_the_field_in_any_folder(self):
        tr.make("vortex", resolution=8).write(self.path("f.vdb"))
        before, here = bytes_of(self.folder, "f.vdb"), os.getcwd()
        os.mkdir(self.path("sub"))
        os.chdir(self.folder)
        try:
            field = tr.read_vdb("f.vdb")
            os.chdir("sub")
            for folder, output in [(None, "../f.vdb"), (self.path("sub"), "../f.vdb"), (self.folder, "f.vdb")]:
                with self.assertRaisesRegex(tr.SceneError, "f.vdb"):
                    tr.render(PHOTONS, field=field, outputs=[os.path.join(folder or "", output)], folder=folder)
        finally:
            os.chdir(here)
        self.assertEqual(bytes_of(self.folder, "f.vdb"), before)

    def test_arrays(self):
        picture = tr.render(PHOTONS, keep=["spectral", "photons"])
        self.assertEqual(picture.linear.shape, (32, 40, 3))
        self.assertEqual(picture.display.shape, (32, 40, 3))
        self.assertLessEqual(picture.display.max(), 1)
        self.assertEqual(picture.spectral.shape, (32, 40, 4))
        np.testing.assert_allclose(picture.wavelengths, 380 + 350 / 4 * (np.arange(4) + 0.5))
        self.assertIn("folds", picture.aovs)
        photons = picture.photons
        self.assertGreater(len(photons), 1000)
        np.testing.assert_allclose(np.linalg.norm(photons["direction"], axis=1), 1, rtol=1e-5)
        self.assertEqual(set(photons["wavelength"]), set(picture.wavelengths.astype("f4")))
        power = picture.statistics["power"]
        # The plate is 2 x 2, the beam wider by an eighth, and its irradiance 1.
        self.assertAlmostEqual(power["emitted"] / 2.25**2, 1, places=6)
        self.assertEqual(picture._repr_png_()[:8], b"\x89PNG\r\n\x1a\n")
        for array in (picture.linear, photons, picture.spectral):
            with self.assertRaises(ValueError):
                array[0] = 0

    def test_arrays_outlive_their_render(self):
        picture = tr.render(PHOTONS, keep="photons")
        linear, copy = picture.linear, picture.linear.copy()
        position, other = picture.photons["position"], picture.photons["position"].copy()
        del picture
        gc.collect()
        trash = [np.ones(linear.nbytes // 8) for _ in range(20)]  # What would take over freed memory.
        np.testing.assert_array_equal(linear, copy)
        np.testing.assert_array_equal(position, other)
        del trash

    def test_paths(self):
        picture = tr.render(OTHERS["path_tracing"])
        self.assertEqual(picture.alpha.shape, (24, 24))
        path = max(picture.paths, key=lambda path: len(path["length"]))
        points = len(path["length"])
        self.assertEqual((path["position"].shape, path["tensor"].shape), ((points, 3), (points, 3, 3)))
        np.testing.assert_allclose(np.linalg.norm(path["direction"], axis=1), 1, rtol=1e-9)
        self.assertTrue((np.diff(path["length"]) >= 0).all())
        middle = points // 2
        tensor, V = path["tensor"][middle], path["direction"][middle]
        scale = path["flexibility"] * picture.scale
        np.testing.assert_allclose(path["change"][middle], scale * (tensor @ V - (V @ tensor @ V) * V), rtol=1e-5)

    def test_writes_later_what_was_kept(self):
        picture = tr.render(PHOTONS, keep="spectral", outputs=self.path("a.exr"))
        picture.write(self.path("b.exr"), self.path("b.spectral.exr"))
        self.assertEqual(bytes_of(self.folder, "a.exr"), bytes_of(self.folder, "b.exr"))
        with self.assertRaisesRegex(ValueError, "keep="):
            picture.write(self.path("b.png"), self.path("photons.vdb"))
        self.assertNotIn("b.png", os.listdir(self.folder))

    def test_errors_are_the_lines_of_the_command_line(self):
        bad = [{**PHOTONS, "lihgt": {}}, {**PHOTONS, "light": {"photons": -1}},
               {**PHOTONS, "integrator": {"type": "lnes"}},
               {**PHOTONS, "field": {"file": "nowhere.vdb"}}, {"integrator": {"type": "lens"}},
               {**PHOTONS, "receiver": {"size": [1e9, 1]}}]
        for scene in bad:
            file = self.path("scene.json")
            with open(file, "w") as stream:
                json.dump(scene, stream)
            ended = command_line(self.folder, "render", file, "-q")
            with self.assertRaises((tr.SceneError, RuntimeError)) as caught:
                tr.render(file)
            self.assertEqual("tensorray: " + str(caught.exception) + "\n", ended.stderr)
            self.assertEqual(ended.returncode, 2 if isinstance(caught.exception, ValueError) else 1)

    def test_wrong_arguments(self):
        for text, arguments in [("scene", {}), ("keep: unknown output `x`", {"scene": PHOTONS, "keep": "x"}),
                                ("unknown ending", {"scene": PHOTONS, "outputs": "a.bmp"}),
                                ("folder", {"scene": "nowhere.json", "folder": "."})]:
            with self.assertRaisesRegex(ValueError, text):
                tr.render(**arguments)
        with self.assertRaises(ValueError):
            tr.render({**PHOTONS, "seed": float("nan")})
        for call in (lambda: tr.render(PHOTONS, field=np.zeros((2, 2, 2, 3, 3))), lambda: tr.invariant(PHOTONS, "norm"),
                     lambda: tr.trace(None, [0, 0, 0], [0, 0, 1], 1)):
            with self.assertRaisesRegex(TypeError, "must be a tensorray.Field"):
                call()
        with self.assertRaisesRegex(TypeError, "object"):
            tr.render({**PHOTONS, "seed": object()})


if __name__ == "__main__":
    unittest.main()
