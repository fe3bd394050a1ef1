"""The ParaView plugin, in pvpython."""

import os
import sys
import tempfile
import unittest

import numpy as np
from paraview import simple
from paraview.vtk.util import numpy_support
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkMultiBlockDataSet, vtkPolyData

import tensorray as tr

PLUGIN = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "tools", "paraview", "bent_light.py")


def image_of(field):
    """A field as an image of VTK."""
    nz, ny, nx = field.tensors.shape[:3]
    image = vtkImageData()
    image.SetDimensions(nx, ny, nz)
    image.SetSpacing(*np.diag(field.to_world)[:3])
    image.SetOrigin(*field.to_world[:3, 3])
    tensors = numpy_support.numpy_to_vtk(field.tensors.reshape(-1, 9), deep=True)
    tensors.SetName("stress")
    image.GetPointData().AddArray(tensors)
    return image


class PluginTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        simple.LoadPlugin(PLUGIN, remote=False, ns=vars(simple))
        cls.field = tr.make("point_load", resolution=17)

    def bent(self, source, **options):
        bent = simple.BentLight(Input=source, Rays=5, Pixels=64, **options)
        bent.UpdatePipeline()
        client = bent.GetClientSideObject()
        return client.GetOutputDataObject(0), client.GetOutputDataObject(1)

    def source(self):
        producer = simple.TrivialProducer()
        producer.GetClientSideObject().SetOutput(image_of(self.field))
        return producer

    def test_rays_and_plate(self):
        rays, plate = self.bent(self.source(), Scale=3)
        self.assertEqual(rays.GetNumberOfLines(), 75)
        ends = numpy_support.vtk_to_numpy(rays.GetCellData().GetArray("end"))
        self.assertGreater((ends == 0).mean(), 0.5)
        wavelengths = numpy_support.vtk_to_numpy(rays.GetCellData().GetArray("wavelength"))
        self.assertEqual(sorted(set(wavelengths)), [450, 550, 650])
        # The last point of a ray that lands is on the plate.
        bounds = np.array(plate.GetBounds())
        landed = int(np.flatnonzero(ends == 0)[0])
        line = rays.GetCell(landed).GetPoints()
        self.assertAlmostEqual(line.GetPoint(line.GetNumberOfPoints() - 1)[2], bounds[4], places=5)
        self.assertEqual(plate.GetNumberOfCells(), 64 * 64)
        light = numpy_support.vtk_to_numpy(plate.GetCellData().GetArray("light")).reshape(64, 64, 3)
        scene = {"field": {"scale": 3}, "light": {"direction": [0.0, 0.0, -1.0]}, "receiver": {"resolution": 64},
                 "integrator": {"type": "photon_distribution"}}
        np.testing.assert_array_equal(light, tr.render(scene, field=self.field).linear)

    def test_meshes_are_sampled(self):
        mesh = simple.AppendDatasets(Input=[self.source()])  # An unstructured grid.
        rays, plate = self.bent(mesh, Scale=3, SamplingResolution=17)
        self.assertEqual(rays.GetNumberOfLines(), 75)
        lights = [numpy_support.vtk_to_numpy(each.GetCellData().GetArray("light"))
                  for each in (plate, self.bent(self.source(), Scale=3)[1])]
        self.assertGreater(lights[1].max(), 1.5)
        self.assertLess(np.abs(lights[0] - lights[1]).mean(), 0.02)

    def test_blocks_are_taken_together(self):
        blocks = vtkMultiBlockDataSet()
        blocks.SetBlock(0, vtkPolyData())  # Without the tensor.
        blocks.SetBlock(1, image_of(self.field))
        producer = simple.TrivialProducer()
        producer.GetClientSideObject().SetOutput(blocks)
        lights = [numpy_support.vtk_to_numpy(self.bent(source, Scale=3)[1].GetCellData().GetArray("light"))
                  for source in (producer, self.source())]
        np.testing.assert_array_equal(lights[0], lights[1])

    def test_files_open_with_colours(self):
        with tempfile.TemporaryDirectory() as folder:
            for method, array in (("path_tracing", "force"), ("photon_distribution", "wavelength")):
                file = os.path.join(folder, method + ".vtp")
                scene = {"integrator": {"type": method}, "light": {"photons": 500}, "camera": {"resolution": 4}}
                try:
                    tr.render(scene, field=self.field, outputs=file, progress=False)
                except RuntimeError as error:
                    self.skipTest(str(error))  # Without tensorray-import.
                reader = simple.OpenDataFile(file)
                shown = simple.Show(reader, simple.CreateRenderView())
                self.assertEqual(list(shown.ColorArrayName), ["POINTS", array])
                points = reader.GetClientSideObject().GetOutputDataObject(0).GetPointData()
                self.assertEqual(points.GetVectors().GetName(), "direction")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + ["-v"])
