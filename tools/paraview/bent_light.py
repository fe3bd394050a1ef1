"""ParaView plugin: the filter "Bent Light".

A data set with tensors in; out come the rays that it bends, as polylines, and the plate behind it with its caustic.
Load it with Tools > Manage Plugins > Load New, or `pvpython`'s LoadPlugin. It needs the Python package `tensorray` in
the Python that ParaView uses: an installed python3-tensorray, or PYTHONPATH=build/release/python.
"""

import numpy as np
from paraview.util.vtkAlgorithm import VTKPythonAlgorithmBase, smdomain, smproperty, smproxy
from vtkmodules.util import numpy_support
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkDataObject, vtkPolyData, vtkStructuredGrid
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline

import tensorray as tr

#: Columns of a full tensor in the six components of VTK's symmetric ones: xx yy zz xy yz xz.
SYMMETRIC = [0, 3, 5, 3, 1, 4, 5, 4, 2]


def blocks_of(data):
    """The data set, or those of composite data, as readers of ExodusII, CGNS and OpenFOAM make them."""
    if data.IsA("vtkDataSet"):
        return [data]
    blocks, iterator = [], data.NewIterator()
    while not iterator.IsDoneWithTraversal():
        block = iterator.GetCurrentDataObject()
        if block.IsA("vtkDataSet") and block.GetNumberOfCells() > 0:
            blocks.append(block)
        iterator.GoToNextItem()
    return blocks


def first_tensor(blocks):
    """Name of the first array with 9 or 6 components."""
    for block in blocks:
        for attributes in (block.GetPointData(), block.GetCellData()):
            for i in range(attributes.GetNumberOfArrays()):
                if attributes.GetArray(i) and attributes.GetArray(i).GetNumberOfComponents() in (6, 9):
                    return attributes.GetArrayName(i)
    raise ValueError("the data have no array with 9 or 6 components")


def one_data_set(blocks, array):
    """The blocks that have the array, as one data set."""
    blocks = [block for block in blocks if block.GetPointData().HasArray(array) or block.GetCellData().HasArray(array)]
    if not blocks:
        raise ValueError(f"the data have no array {array}")
    if len(blocks) == 1:
        return blocks[0]
    from vtkmodules.vtkFiltersCore import vtkAppendDataSets
    append = vtkAppendDataSets()
    for block in blocks:
        append.AddInputData(block)
    append.Update()
    return append.GetOutput()


def image_of(data, array, resolution):
    """The data as an image whose points have the array: itself, or resampled."""
    if data.IsA("vtkImageData") and data.GetPointData().HasArray(array):
        return data
    from vtkmodules.vtkFiltersCore import vtkCellDataToPointData, vtkResampleToImage
    points = vtkCellDataToPointData()
    points.PassCellDataOn()
    points.SetInputData(data)
    resample = vtkResampleToImage()
    resample.SetInputConnection(points.GetOutputPort())
    bounds = np.reshape(data.GetBounds(), (3, 2))
    size = bounds[:, 1] - bounds[:, 0]
    resample.SetSamplingDimensions(*(int(n) for n in np.maximum(2, np.rint(resolution * size / size.max()))))
    resample.Update()
    return resample.GetOutput()


def surface_of(data):
    """The outer surface of cells, as points and triangles; None: of an image, or not closed (flat cells)."""
    if data.IsA("vtkImageData"):
        return None
    from vtkmodules.vtkFiltersCore import vtkCleanPolyData, vtkFeatureEdges, vtkTriangleFilter
    from vtkmodules.vtkFiltersGeometry import vtkDataSetSurfaceFilter
    skin, triangles, joined, open_edges = (make() for make in (vtkDataSetSurfaceFilter, vtkTriangleFilter,
                                                               vtkCleanPolyData, vtkFeatureEdges))
    skin.SetInputData(data)
    triangles.SetInputConnection(skin.GetOutputPort())
    triangles.PassVertsOff()
    triangles.PassLinesOff()
    joined.SetInputConnection(triangles.GetOutputPort())
    joined.SetTolerance(1e-9)
    open_edges.SetInputConnection(joined.GetOutputPort())
    open_edges.FeatureEdgesOff()
    open_edges.ManifoldEdgesOff()
    open_edges.Update()
    surface = joined.GetOutput()
    if surface.GetNumberOfPolys() == 0 or open_edges.GetOutput().GetNumberOfCells() > 0:
        return None
    return (numpy_support.vtk_to_numpy(surface.GetPoints().GetData()).astype(float),
            numpy_support.vtk_to_numpy(surface.GetPolys().GetConnectivityArray()).reshape(-1, 3))


def field_of(image, array, surface=None):
    """The tensors at the points of an image, without a copy if they have nine components."""
    values = numpy_support.vtk_to_numpy(image.GetPointData().GetArray(array))
    if values.ndim != 2 or values.shape[1] not in (6, 9):
        raise ValueError(f"array {array}: a tensor has 9 or 6 components")
    if values.shape[1] == 6:
        values = values[:, SYMMETRIC]
    mask = image.GetPointData().GetArray("vtkValidPointMask")
    if mask is not None:  # Points outside a mesh have no tensor.
        values = np.where(numpy_support.vtk_to_numpy(mask)[:, None] > 0, values, np.nan)
    nx, ny, nz = image.GetDimensions()
    axes = image.GetDirectionMatrix()
    to_world = np.eye(4)
    to_world[:3, :3] = [[axes.GetElement(i, j) * image.GetSpacing()[j] for j in range(3)] for i in range(3)]
    first = np.array(image.GetExtent()[::2], float)
    to_world[:3, 3] = np.array(image.GetOrigin()) + to_world[:3, :3] @ first
    return tr.Field(values.reshape(nz, ny, nx, 3, 3), to_world=to_world, name=array, surface=surface)


def vtk_points(positions):
    points = vtkPoints()
    points.SetData(numpy_support.numpy_to_vtk(np.ascontiguousarray(positions, float), deep=True))
    return points


def add_arrays(attributes, arrays):
    for name, values in arrays.items():
        array = numpy_support.numpy_to_vtk(np.ascontiguousarray(values), deep=True)
        array.SetName(name)
        attributes.AddArray(array)


def lines_of(output, rays, wavelengths, flexibilities):
    """The ways of rays as polylines."""
    kept = [i for i, way in enumerate(rays.ways) if len(way) > 1]
    ways = [rays.ways[i] for i in kept]
    cells = vtkCellArray()
    offsets = np.concatenate([[0], np.cumsum([len(way) for way in ways])]).astype(np.int64)
    cells.SetData(numpy_support.numpy_to_vtkIdTypeArray(offsets, deep=True),
                  numpy_support.numpy_to_vtkIdTypeArray(np.arange(offsets[-1], dtype=np.int64), deep=True))
    output.SetPoints(vtk_points(np.concatenate(ways) if ways else np.zeros((0, 3))))
    output.SetLines(cells)
    steps = [np.linalg.norm(np.diff(way, axis=0, prepend=way[:1]), axis=1) for way in ways]
    add_arrays(output.GetPointData(), {"length": np.concatenate([np.cumsum(step) for step in steps] or [[]])})
    add_arrays(output.GetCellData(), {"wavelength": wavelengths[kept], "flexibility": flexibilities[kept],
                                      "end": rays.ends[kept]})


def plate_of(output, place, picture):
    """The plate with a cell a pixel: its colour on a screen, and its scene-linear light."""
    height, width = picture.linear.shape[:2]
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, width + 1), np.linspace(0.5, -0.5, height + 1))
    positions = (place.center + x[..., None] * place.size[0] * place.right + y[..., None] * place.size[1] * place.up)
    output.SetDimensions(width + 1, height + 1, 1)
    output.SetPoints(vtk_points(positions.reshape(-1, 3)))
    colors = np.rint(255 * picture.display[..., :3]).astype(np.uint8)
    add_arrays(output.GetCellData(), {"color": colors.reshape(-1, 3), "light": picture.linear.reshape(-1, 3)})
    output.GetCellData().SetActiveScalars("color")
    coordinates = numpy_support.numpy_to_vtk(np.stack([x + 0.5, y + 0.5], axis=-1).reshape(-1, 2), deep=True)
    coordinates.SetName("texture coordinates")
    output.GetPointData().SetTCoords(coordinates)


@smproxy.filter(label="Bent Light")
@smproperty.input(name="Input")
@smdomain.datatype(dataTypes=["vtkDataSet", "vtkCompositeDataSet"], composite_data_supported=True)
class BentLight(VTKPythonAlgorithmBase):
    """Light that a tensor field bends: rays (output 0), and a plate with its caustic (output 1)."""

    def __init__(self):
        super().__init__(nInputPorts=1, nOutputPorts=2)
        self._array, self._direction, self._scale = "", [0.0, 0.0, -1.0], 0.0
        self._rays, self._pixels, self._resolution = 12, 256, 64

    def FillInputPortInformation(self, port, info):
        info.Set(self.INPUT_REQUIRED_DATA_TYPE(), "vtkDataSet")
        info.Append(self.INPUT_REQUIRED_DATA_TYPE(), "vtkCompositeDataSet")
        return 1

    def FillOutputPortInformation(self, port, info):
        info.Set(vtkDataObject.DATA_TYPE_NAME(), "vtkPolyData" if port == 0 else "vtkStructuredGrid")
        return 1

    def RequestDataObject(self, request, inputs, outputs):
        for port, kind in enumerate((vtkPolyData, vtkStructuredGrid)):
            outputs.GetInformationObject(port).Set(vtkDataObject.DATA_OBJECT(), kind())
        return 1

    @smproperty.stringvector(name="Array", default_values="")
    def SetArray(self, name):
        """Name of the tensors; empty: the first array with 9 or 6 components."""
        self._set("_array", name)

    @smproperty.doublevector(name="Direction", default_values=[0.0, 0.0, -1.0])
    def SetDirection(self, x, y, z):
        """Where light travels to."""
        self._set("_direction", [x, y, z])

    @smproperty.doublevector(name="Scale", default_values=0.0)
    def SetScale(self, scale):
        """Factor on the flexibility of light; 0: chosen so that the light shows the field."""
        self._set("_scale", scale)

    @smproperty.intvector(name="Rays", default_values=12)
    def SetRays(self, count):
        """Rays along each side of the beam, of three wavelengths each."""
        self._set("_rays", count)

    @smproperty.intvector(name="Pixels", default_values=256)
    def SetPixels(self, count):
        """Pixels along the sides of the plate."""
        self._set("_pixels", count)

    @smproperty.intvector(name="SamplingResolution", default_values=64)
    def SetSamplingResolution(self, count):
        """Voxels along the longest side, for data that are not an image."""
        self._set("_resolution", count)

    def RequestInformation(self, request, inputs, outputs):
        """Says how large the plate is: without it, VTK takes the extent of an image that comes in for the plate's."""
        whole = vtkStreamingDemandDrivenPipeline.WHOLE_EXTENT()
        outputs.GetInformationObject(1).Set(whole, 0, self._pixels, 0, self._pixels, 0, 0)
        return 1

    def RequestUpdateExtent(self, request, inputs, outputs):
        """Asks for all of an image, whatever part of the plate is asked for."""
        whole = vtkStreamingDemandDrivenPipeline.WHOLE_EXTENT()
        data = inputs[0].GetInformationObject(0)
        if data.Has(whole):
            extent = [data.Get(whole, i) for i in range(6)]
            data.Set(vtkStreamingDemandDrivenPipeline.UPDATE_EXTENT(), *extent)
        return 1

    def RequestData(self, request, inputs, outputs):
        blocks = blocks_of(vtkDataObject.GetData(inputs[0]))
        array = self._array or first_tensor(blocks)
        data = one_data_set(blocks, array)
        field = field_of(image_of(data, array, self._resolution), array, surface_of(data))
        scene = {"field": {"scale": self._scale} if self._scale else {},
                 "light": {"direction": self._direction}, "receiver": {"resolution": self._pixels},
                 "integrator": {"type": "photon_distribution"}}
        picture = tr.render(scene, field=field, progress=False)
        place = tr.landings(scene, field, s=0.2, changes={"field.scale": picture.scale}, progress=False)
        starts, wavelengths = self._starts(place)
        flexibilities = 0.75 - 0.001 * wavelengths
        rays = tr.trace(field, starts, self._direction, flexibilities, scale=picture.scale, ways=True, progress=False,
                        plate=tr.Plate(place.center, np.cross(place.right, place.up), place.size, place.up))
        lines_of(vtkPolyData.GetData(outputs, 0), rays, wavelengths, flexibilities)
        plate_of(vtkStructuredGrid.GetData(outputs, 1), place, picture)
        return 1

    def _set(self, name, value):
        if getattr(self, name) != value:
            setattr(self, name, value)
            self.Modified()

    def _starts(self, place):
        """Starts on a lattice over the beam, and wavelengths, nm."""
        first = place.starts[0]
        x, y = ((place.starts - first) @ axis for axis in (place.right, place.up))
        sides = [np.linspace(side.min(), side.max(), self._rays + 2)[1:-1] for side in (x, y)]
        across = np.array([first + i * place.right + j * place.up for j in sides[1] for i in sides[0]])
        wavelengths = np.array([450.0, 550.0, 650.0])
        return np.repeat(across, 3, axis=0), np.tile(wavelengths, len(across))
