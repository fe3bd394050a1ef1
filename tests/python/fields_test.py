"""Fields: arrays without copies, lifetimes, files, invariants."""

import gc
import os
import pickle
import tempfile
import unittest
import weakref

import numpy as np

import tensorray as tr


def random_tensors(shape=(5, 6, 7), dtype=np.float32):
    return np.random.default_rng(1).normal(size=(*shape, 3, 3)).astype(dtype)


class FieldsTest(unittest.TestCase):
    def test_arrays_are_not_copied(self):
        for tensors in (random_tensors(), random_tensors(dtype=np.float64), random_tensors((10, 6, 7))[::-2],
                        np.asfortranarray(random_tensors())):
            field = tr.Field(tensors)
            self.assertTrue(np.shares_memory(field.tensors, tensors))
            self.assertFalse(field.tensors.flags.writeable)
            self.assertTrue(tensors.flags.writeable)

    def test_any_layout_gives_the_same_light(self):
        tensors = random_tensors((8, 8, 8))
        apart = np.zeros((8, 16, 8, 3, 4), np.float32)[:, ::2, :, :, :3]
        apart[...] = tensors
        layouts = [tensors, tensors.astype(np.float64), np.asfortranarray(tensors), apart, tensors.astype(">f4"),
                   tensors[::-1].copy()[::-1]]
        ends = [tr.trace(tr.Field(layout), [3.2, 3.6, 9], [0, 0, -1], 0.5).positions for layout in layouts]
        for end in ends[1:]:
            np.testing.assert_array_equal(end, ends[0])

    def test_a_field_keeps_its_array_alive(self):
        tensors = random_tensors()
        alive = weakref.ref(tensors)
        field = tr.Field(tensors)
        del tensors
        gc.collect()
        self.assertIsNotNone(alive())
        end = tr.trace(field, [3.0, 3.0, 8.0], [0, 0, -1], 0.3).positions
        self.assertTrue(np.isfinite(end).all())
        view = field.tensors
        del field
        gc.collect()
        self.assertIsNotNone(alive())
        del view
        gc.collect()
        self.assertIsNone(alive())

    def test_where_voxels_are(self):
        field = tr.Field(random_tensors(), voxel_size=(0.1, 0.2, 0.3), origin=(1, 2, 3))
        np.testing.assert_allclose(field.to_world @ [1, 2, 3, 1], [1.1, 2.4, 3.9, 1])
        np.testing.assert_allclose(field.bounds, [[1, 2, 3], [1.6, 3, 4.2]])
        turned = np.array([[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
        np.testing.assert_allclose(tr.Field(random_tensors(), to_world=turned).bounds, [[-5, 0, 0], [0, 6, 4]])

    def test_files_hold_what_arrays_hold(self):
        tensors = random_tensors()
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "field.vdb")
            tr.Field(tensors, voxel_size=0.5, origin=(1, 2, 3), name="stress").write(file)
            field = tr.read_vdb(file)
        self.assertEqual(field.name, "stress")
        np.testing.assert_array_equal(field.tensors, tensors)
        np.testing.assert_allclose(field.to_world @ [0, 0, 0, 1], [1, 2, 3, 1])

    def test_the_surface_of_a_body_travels(self):
        points = np.array([[0, 0, 0], [1.3, 0, 0], [0, 1.7, 0], [0, 0, 1.9]]) + 0.05
        triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
        field = tr.Field(np.tile(np.diag([1.0, 2.0, 3.0]), (9, 9, 9, 1, 1)), 0.25, surface=(points, triangles))
        with tempfile.TemporaryDirectory() as folder:
            field.write(os.path.join(folder, "field.vdb"))
            fields = [field, tr.read_vdb(os.path.join(folder, "field.vdb"))]
        fields += [pickle.loads(pickle.dumps(each)) for each in fields]
        for each in fields:
            np.testing.assert_allclose(each.surface[0], points, atol=1e-12)
            np.testing.assert_array_equal(each.surface[1], triangles)
        self.assertIsNone(tr.Field(field.tensors).surface)
        # Light bends within it alone: one ray passes it, and one goes through.
        tracing = {"positions": [[1.6, 1.6, -1], [0.4, 0.5, -1]], "directions": [0.1, 0, 1], "s": 0.5}
        turned = np.abs(tr.trace(field, **tracing).directions - np.array([0.1, 0, 1]) / np.hypot(0.1, 1)).max(axis=1)
        self.assertLess(turned[0], 1e-6)
        self.assertGreater(turned[1], 1e-3)
        self.assertGreater(tr.trace(field, **tracing, bounds="none").lengths[0], 0)
        self.assertGreater(np.abs(tr.trace(field, **tracing, bounds="none").directions[0, 0] - 0.0995), 1e-3)
        with self.assertRaisesRegex(RuntimeError, "open edges"):
            tr.trace(tr.Field(field.tensors, surface=(points, triangles[1:])), [0, 0, 0], [0, 0, 1], 1)

    def test_invariants(self):
        tensors = random_tensors((4, 9, 10))
        tensors[1, 2, 3] = np.nan
        field = tr.Field(tensors)
        curl = np.stack([tensors[..., 2, 1] - tensors[..., 1, 2], tensors[..., 0, 2] - tensors[..., 2, 0],
                         tensors[..., 1, 0] - tensors[..., 0, 1]], axis=-1)
        np.testing.assert_allclose(tr.invariant(field, "vorticity"), np.linalg.norm(curl, axis=-1), rtol=1e-5)
        np.testing.assert_allclose(tr.invariant(field, "trace"), np.trace(tensors, axis1=-2, axis2=-1), atol=1e-6)
        self.assertIn("von_mises", tr.INVARIANTS)

    def test_masked_tensors_bend_no_light(self):
        tensors = random_tensors()
        mask = np.zeros(tensors.shape, bool)
        mask[:, :, : tensors.shape[2] // 2] = True
        masked = tr.Field(np.ma.array(tensors, mask=mask)).tensors
        expected = tr.Field(np.where(mask, np.nan, tensors)).tensors
        np.testing.assert_array_equal(masked, expected)

    def test_errors_are_one_line(self):
        tensors = random_tensors()
        cases = [
            (ValueError, "shape", lambda: tr.Field(tensors[0])),
            (ValueError, "empty", lambda: tr.Field(tensors[:0])),
            (ValueError, "inverted", lambda: tr.Field(tensors, voxel_size=0)),
            (ValueError, r"\(4, 4\)", lambda: tr.Field(tensors, to_world=np.eye(3))),
            (ValueError, "not there", lambda: tr.Field(tensors, surface=(np.eye(3), [[0, 1, 3]]))),
            (ValueError, r"\(n, 3\)", lambda: tr.Field(tensors, surface=(np.eye(2), [[0, 1, 1]]))),
            (ValueError, "kind", lambda: tr.make("whirl")),
            (ValueError, "core", lambda: tr.make("vortex", core=-1)),
            (ValueError, "unknown", lambda: tr.make("vortex", heart=1)),
            (RuntimeError, "nowhere.vdb", lambda: tr.read_vdb("nowhere.vdb")),
            (RuntimeError, "nowhere", lambda: tr.read_vdb("nowhere\udcff.vdb")),  # A name that is not UTF-8.
            (ValueError, "derive", lambda: tr.read_vdb("nowhere.vdb", derive="curl")),
            (ValueError, "vorticity", lambda: tr.invariant(tr.Field(tensors), "curl")),
            (RuntimeError, "finite", lambda: tr.trace(tr.Field(tensors * np.nan), [0, 0, 0], [0, 0, 1], 1)),
            (ValueError, "must end in .vdb", lambda: tr.Field(tensors).write("field.exr")),
        ]
        for kind, text, call in cases:
            with self.assertRaisesRegex(kind, text) as caught:
                call()
            self.assertNotIn("\n", str(caught.exception))


if __name__ == "__main__":
    unittest.main()
