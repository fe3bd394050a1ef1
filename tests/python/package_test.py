"""The package: its version, the examples of its page, and imports of other programs' files."""

import os
import subprocess
import tempfile
import unittest

import numpy as np

import tensorray as tr


class PackageTest(unittest.TestCase):
    def test_the_version_is_that_of_the_program(self):
        ended = subprocess.run([os.environ["TENSORRAY_BINARY"], "--version"], capture_output=True, text=True)
        self.assertEqual(ended.stdout, f"tensorray {tr.__version__}\n")

    def test_the_examples_of_the_documentation_run(self):
        page = os.path.join(os.path.dirname(__file__), "..", "..", "docs", "python.md")
        with open(page) as file:
            lines = [line[4:] for line in file if line.startswith("    ") and "tools/python" not in line]
        # Fewer voxels and photons than on the page.
        examples = "".join(lines).replace("64", "16").replace("63", "15").replace("1e5", "2e3")
        before = os.getcwd()
        with tempfile.TemporaryDirectory() as folder:
            try:
                os.chdir(folder)
                names = {}
                exec(compile(examples, page, "exec"), names)
                self.assertEqual(sorted(os.listdir(folder)), ["mine.exr", "mine.png"])
            finally:
                os.chdir(before)
        self.assertTrue(names["rays"].landed.any())

    def test_imports(self):
        def stop(*_):
            raise LookupError("enough")

        tensors = np.random.default_rng(1).normal(size=(4, 5, 6, 3, 3)).astype("f4")
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "t.npy")
            np.save(file, tensors.reshape(4, 5, 6, 9))
            field = tr.import_file(file)
            changes = {"receiver.resolution": 16, "light.direction": [0, 0, -1], "light.photons": 100}
            arrived = tr.render(file, imports={"voxel_size": 1}, changes=changes)
            np.testing.assert_array_equal(arrived.linear, tr.render(field, changes=changes).linear)
            with self.assertRaisesRegex(ValueError, "imports: only files that have to be imported"):
                tr.render(field, imports={"voxel_size": 1})
            with self.assertRaisesRegex(RuntimeError, "nothing.vtu"):
                tr.import_file(os.path.join(folder, "nothing.vtu"))
            for arguments, options in [((file,), {"order": "wrong"}), ((file,), {"step": "late"}), ((), {})]:
                with self.assertRaises((ValueError, RuntimeError)) as caught:
                    tr.import_file(*arguments, **options)
                self.assertNotIn("\n", str(caught.exception))
            seen = []
            tr.import_file(file, progress=lambda *report: seen.append(report))
            self.assertIn(("reading", 0, 1), seen)
            with self.assertRaisesRegex(LookupError, "enough"):
                tr.import_file(file, progress=stop)
        self.assertEqual(sorted(field.tensors.shape), sorted(tensors.shape))
        self.assertAlmostEqual(float(np.linalg.norm(field.tensors)), float(np.linalg.norm(tensors)), places=3)


if __name__ == "__main__":
    unittest.main()
