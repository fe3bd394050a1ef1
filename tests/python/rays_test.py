"""Rays: ends, ways, Jacobians, landings."""

import unittest

import numpy as np

import tensorray as tr


def rotation(rate=1.0):
    return tr.make("rotation", resolution=9, axis=(0, 0, 1), rate=rate)


class RaysTest(unittest.TestCase):
    def test_a_ray_in_a_rotation_is_a_circle(self):
        # V turns about z at the rate s: from (-1, 0, 0) along +x the ray is on a circle of radius 1/s.
        s = 0.8
        ray = tr.trace(rotation(), [-1, 0, 0], [1, 0, 0], s, step=0.02, ways=True)
        way = ray.ways[0]
        radii = np.linalg.norm(way - [-1, 1 / s, 0], axis=1)
        np.testing.assert_allclose(radii, 1 / s, rtol=1e-5)
        turned = s * ray.lengths[0]
        np.testing.assert_allclose(ray.directions[0], [np.cos(turned), np.sin(turned), 0], atol=1e-5)
        self.assertEqual(tr.RAY_ENDS[ray.ends[0]], "missed")

    def test_shapes(self):
        field = rotation()
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

    def test_jacobians_are_derivatives(self):
        field = tr.make("helix", resolution=40)
        plate = tr.Plate((0, 0, -2), size=(9, 9))
        start, along = np.array([0.31, 0.22, 1.5]), np.array([[1, 0], [0, 1], [0, 0.0]])
        heading = np.array([0.05, 0.02, -1]) / np.linalg.norm([0.05, 0.02, -1])
        options = dict(scale=2, plate=plate, step=0.25)
        ray = tr.trace(field, start, heading, 0.4, along=along, **options)
        step = 1e-5
        for column in range(2):
            ends = [tr.trace(field, start + sign * step * along[:, column], heading, 0.4, method="dopri5", **options)
                    for sign in (-1, 1)]
            slope = (ends[1].positions - ends[0].positions)[0] / (2 * step)
            np.testing.assert_allclose(ray.position_jacobians[0, :, column], slope, atol=0.05)
        self.assertGreater(np.abs(ray.position_jacobians[0] - along).max(), 0.2)

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

    def test_smoothing(self):
        # A rotation stays the same, constant as it is; the value of one voxel is spread over its neighbours.
        tensors = np.zeros((9, 9, 9, 3, 3))
        tensors[4, 4, 4] = [[0, 1, 0], [-1, 0, 0], [0, 0, 0]]
        field = tr.Field(tensors)
        start, heading = [2, 2, 2.5], [0, 1, 0]
        turned = [tr.trace(field, start, heading, 1, smooth=smooth).directions[0, 0] for smooth in (0, 1.5, 0)]
        self.assertLess(abs(turned[0]), 1e-6)
        self.assertGreater(turned[1], 1e-4)
        self.assertEqual(turned[2], turned[0])
        ends = [tr.trace(rotation(), [-1, 0, 0], [1, 0, 0], 0.8, smooth=smooth).positions for smooth in (0, 2)]
        np.testing.assert_array_equal(ends[0], ends[1])

    def test_errors(self):
        field = rotation()
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
