"""Rays: ends, ways, Jacobians, landings."""

import unittest

import numpy as np

import tensorray as tr


class RaysTest(unittest.TestCase):
    def test_shapes(self):
        field = tr.make("rotation", resolution=9, axis=(0, 0, 1), rate=1)
        starts = np.random.default_rng(1).uniform(-0.5, 0.5, (1500, 3))
        for s in (0.1, np.linspace(0, 1, 1500)):
            rays = tr.trace(field, starts, [0, 1, 2], s, plate=tr.Plate((0, 0, 3), size=(9, 9)), jacobians=True)
            self.assertEqual(rays.positions.shape, (1500, 3))
            self.assertEqual(rays.position_jacobians.shape, (1500, 3, 2))
            self.assertTrue(rays.landed.all())
            np.testing.assert_allclose(rays.positions[:, 2], 3, atol=1e-9)
        one = tr.trace(field, starts[7], [0, 1, 2], s[7], plate=tr.Plate((0, 0, 3), size=(9, 9)), jacobians=True)
        np.testing.assert_array_equal(one.positions[0], rays.positions[7])
        many = tr.trace(field, [0, 0, 0], [0, 0, 1], [0.1, 0.2, 0.3])
        self.assertIsNone(many.ways)
        self.assertIsNone(many.position_jacobians)
        self.assertEqual(many.lengths.shape, (3,))

    def test_turning_starts(self):
        still = np.zeros((3, 2))
        turning = np.array([[1, 0], [0, 1], [0, 0.0]])
        ray = tr.trace(tr.make("constant", resolution=4), [0, 0, 2.0], [0, 0, -1], 0.0, along=still, turning=turning,
                       plate=tr.Plate((0, 0, -2), size=(9, 9)))
        np.testing.assert_allclose(ray.position_jacobians[0], 4 * turning, atol=1e-6)

    def test_landings_are_where_rays_land(self):
        field = tr.make("vortex", resolution=24)
        scene = {"field": {"scale": 1.5}, "light": {"direction": [0, 0, -1], "photons": 4000},
                 "integrator": {"type": "photon_distribution"}}
        map_ = tr.landings(scene, field, s=[0.1, 0.2])
        self.assertEqual(map_.landings.shape, (len(map_.starts), 2, 2))
        self.assertAlmostEqual(map_.areas.sum(), 4, places=6)
        plate = tr.Plate(map_.center, (0, 0, 1), (9, 9))
        for k, s in enumerate((0.1, 0.2)):
            rays = tr.trace(field, map_.starts, [0, 0, -1], s, scale=1.5, plate=plate)
            landed = (map_.ends[:, k] == 0) & rays.landed
            self.assertGreater(landed.mean(), 0.9)
            np.testing.assert_allclose(map_.world()[landed, k], rays.positions[landed], atol=2e-3)
        whole = tr.landings(scene, field)
        self.assertEqual(whole.landings.shape[1], len(whole.flexibilities))
        np.testing.assert_allclose(whole.flexibilities[[0, -1]], [0.37, 0.02])

    def test_errors(self):
        field = tr.make("rotation", resolution=9, axis=(0, 0, 1), rate=1)
        for text, arguments in [("shape", ([0, 0], [0, 0, 1], 1)), ("not be zero", ([0, 0, 0], [0, 0, 0], 1)),
                                ("finite", ([0, 0, np.nan], [0, 0, 1], 1)), ("finite", ([0, 0, 0], [0, 0, 1], np.inf)),
                                ("same number", (np.zeros((2, 3)), [0, 0, 1], [1, 2, 3]))]:
            with self.assertRaisesRegex(ValueError, text):
                tr.trace(field, *arguments)
        for text, options in [("method", {"method": "guess"}), ("eigenvalues", {"eigenvalues": "some"}),
                              ("plate", {"plate": tr.Plate((0, 0, 0), size=(0, 1))}), ("step", {"max_steps": 0}),
                              ("center", {"plate": tr.Plate((0, 0), size=1)}),
                              ("normal", {"plate": tr.Plate((0, 0, 0), 1, size=1)}),
                              ("size", {"plate": tr.Plate((0, 0, 0), size=(1, 1, 1))}),
                              ("up", {"plate": tr.Plate((0, 0, 0), size=1, up=(np.nan, 0, 0))}),
                              ("threads", {"threads": 2**24}), ("smooth", {"smooth": -1})]:
            with self.assertRaisesRegex(ValueError, text):
                tr.trace(field, [0, 0, 0], [0, 0, 1], 1, **options)


if __name__ == "__main__":
    unittest.main()
