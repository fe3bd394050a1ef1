"""Fills ParaView's window for tools/paraview/screenshot, which says how.

    FOLDER=FOLDER paraview --script=tools/paraview/window.py

The file `ready` appears in FOLDER when the window shows what it is to show, and `failed` when it cannot.
"""

import os
import pathlib
import traceback

import numpy as np
from paraview.simple import *
from vtkmodules.util import numpy_support
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkIOLegacy import vtkStructuredPointsWriter

import tensorray as tr

PLUGIN = os.environ["PLUGIN"]
FOLDER = pathlib.Path(os.environ["FOLDER"])
#: Wavelengths of the filter's rays, nm, and colours for them.
COLORS = {"450": [0.25, 0.5, 1], "550": [0.35, 0.9, 0.35], "650": [1, 0.25, 0.15]}


def write_point_load(path):
    """The stress under a load on a point, as a file of VTK."""
    field = tr.make("point_load", 49)
    stress = numpy_support.numpy_to_vtk(np.reshape(field.tensors, (-1, 9)), deep=True)
    stress.SetName("stress")
    image = vtkImageData()
    image.SetDimensions(*field.tensors.shape[2::-1])
    image.SetOrigin(*field.to_world[:3, 3])
    image.SetSpacing(*np.diag(field.to_world)[:3])
    image.GetPointData().AddArray(stress)
    writer = vtkStructuredPointsWriter()
    writer.SetFileTypeToBinary()
    writer.SetFileName(str(path))
    writer.SetInputData(image)
    writer.Write()


def show_rays(tubes, view):
    colors = GetColorTransferFunction("wavelength")
    colors.InterpretValuesAsCategories = 1
    colors.Annotations = [text for name in COLORS for text in (name, name + " nm")]
    colors.IndexedColors = sum(COLORS.values(), [])
    display = Show(tubes, view)
    ColorBy(display, ("CELLS", "wavelength"))
    display.SetScalarBarVisibility(view, True)
    legend = GetScalarBar(colors, view)
    legend.Title = "wavelength"
    legend.ComponentTitle = ""
    legend.TitleFontSize = legend.LabelFontSize = 18
    legend.WindowLocation = "Any Location"
    legend.Position = [0.86, 0.66]
    legend.ScalarBarLength = 0.25


def show_plate(plate, view):
    display = Show(plate, view)
    display.SetRepresentationType("Surface")
    ColorBy(display, ("CELLS", "color"))
    display.MapScalars = 0
    display.Ambient, display.Diffuse = 1, 0


def main():
    write_point_load(FOLDER / "point_load.vtk")
    view = GetActiveViewOrCreate("RenderView")
    LoadPlugin(PLUGIN, remote=False, ns=globals())
    field = OpenDataFile(str(FOLDER / "point_load.vtk"))
    RenameSource("point_load.vtk", field)
    light = BentLight(registrationName="Bent Light", Input=field)
    light.Array = "stress"
    light.Rays = 8
    tubes = Tube(registrationName="Rays as tubes", Input=OutputPort(light, 0))
    tubes.Radius = 0.012
    tubes.NumberofSides = 12
    Show(field, view).SetRepresentationType("Outline")
    show_rays(tubes, view)
    show_plate(OutputPort(light, 1), view)
    view.CameraPosition, view.CameraFocalPoint, view.CameraViewUp = [-2, -6, 2.5], [0, 0, -1], [0, 0, 1]
    ResetCamera(view)
    SetActiveSource(light)
    Render(view)


try:
    main()
    (FOLDER / "ready").touch()
except Exception:
    (FOLDER / "failed").write_text(traceback.format_exc())
