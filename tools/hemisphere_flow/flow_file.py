"""Reads, writes and samples the flow: unstructured VTK files with point data."""

import os
import sys

import vtk


def read_flow(path):
    if not os.path.isfile(path):
        sys.exit(f"{path}: no such file; tools/hemisphere_flow/run makes it")
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    if reader.GetOutput().GetNumberOfPoints() == 0:
        sys.exit(f"{path}: no mesh in it; delete it and run tools/hemisphere_flow/run again")
    return reader.GetOutput()


def write_flow(path, flow):
    writer = vtk.vtkXMLUnstructuredGridWriter()
    writer.SetFileName(path)
    writer.SetInputData(flow)
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()
    if not writer.Write():
        sys.exit(f"{path}: cannot be written")


def sample(flow, points):
    """The point data of `flow` at `points`, trilinear within the cells, and whether each lies in the mesh: (data, valid(i))."""
    positions = vtk.vtkPoints()
    positions.SetDataTypeToDouble()
    positions.SetNumberOfPoints(len(points))
    for i, point in enumerate(points):
        positions.SetPoint(i, point)
    cloud = vtk.vtkPolyData()
    cloud.SetPoints(positions)
    probe = vtk.vtkProbeFilter()
    probe.SetInputData(cloud)
    probe.SetSourceData(flow)
    probe.Update()
    data = probe.GetOutput().GetPointData()
    mask = data.GetArray(probe.GetValidPointMaskArrayName())
    return data, lambda i: mask.GetTuple1(i) == 1
