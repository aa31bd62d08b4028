"""A ParaView plugin that opens .esvr files as image data.

Tools > Manage Plugins > Load New, or `pvbatch --load-plugin esvr_reader.py`. The Python module esvr must be found
(PYTHONPATH). Only the voxels of the extent that ParaView asks for are decoded.
"""
import numpy as np
from paraview.util.vtkAlgorithm import smdomain, smhint, smproperty, smproxy
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
from vtkmodules.vtkCommonCore import vtkDataArraySelection
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline
from vtkmodules.vtkCommonMath import vtkMatrix3x3

import esvr


EMPTY = (0, -1, 0, -1, 0, -1)  # the extent of VTK without any point
NOWHERE = ((0, 0, 0), (0, 0, 0))  # a box whose grids have hardly any ellipsoids, but all their properties


def extent_of(box):
    """The extent of VTK (x0, x1, y0, y1, z0, z1) of a box."""
    return [side for pair in zip(*box) for side in pair]


def box_of(extent):
    return tuple(extent[0::2]), tuple(extent[1::2])


def placed_alike(a, b):
    """True if two grids have the same transform."""
    if a.transform is None or b.transform is None:
        return a.transform is b.transform
    return np.array_equal(a.transform, b.transform)


def geometry_of(grid):
    """Origin, spacing and directions, so that a point is origin + directions * spacing * (i, j, k).

    A frustum has no such matrix, so it is shown in index coordinates.
    """
    matrix = np.eye(4) if grid.transform is None else grid.transform
    spacing = np.linalg.norm(matrix[:3, :3], axis=0)
    return matrix[:3, 3], spacing, matrix[:3, :3] / spacing


@smproxy.reader(name="ESVRReader", label="ESVR Reader", extensions="esvr", file_description="ESVR volumes")
class ESVRReader(VTKPythonAlgorithmBase):
    """Reads the grids of an .esvr file, or of the frames of a sequence."""

    def __init__(self):
        super().__init__(nInputPorts=0, nOutputPorts=1, outputType="vtkImageData")
        self._path = None
        self._ellipsoids = 0
        self._frames = []
        self._known = None  # (path, names of its grids)
        self._selection = vtkDataArraySelection()
        self._selection.AddObserver("ModifiedEvent", lambda *_: self.Modified())

    @smproperty.stringvector(name="FileName")
    @smdomain.filelist()
    @smhint.filechooser(extensions="esvr", file_description="ESVR volumes")
    def SetFileName(self, path):
        if path != self._path:
            self._path = path
            self.Modified()

    @smproperty.dataarrayselection(name="Grids")
    def GetGrids(self):
        return self._selection

    @smproperty.intvector(name="Ellipsoids", default_values=0)
    @smdomain.intrange(min=0, max=1000000)
    def SetEllipsoids(self, count):
        """The number of ellipsoids that a level of detail has at least; 0 for all of them."""
        if count != self._ellipsoids:
            self._ellipsoids = count
            self.Modified()

    @smproperty.doublevector(name="TimestepValues", information_only="1", si_class="vtkSITimeStepsProperty")
    def GetTimestepValues(self):
        return [float(frame) for frame in self._frames]

    def _frame_at(self, info):
        """The last frame that begins at or before the time that is asked for."""
        if not self._frames:
            return None
        time = info.Get(Pipeline.UPDATE_TIME_STEP()) if info.Has(Pipeline.UPDATE_TIME_STEP()) else self._frames[0]
        return max((frame for frame in self._frames if frame <= time), default=self._frames[0])

    def _read(self, frame, box):
        if frame is not None:
            return esvr.read(self._path, frame=frame)
        return esvr.read(self._path, box=box, ellipsoids=self._ellipsoids or None)

    def _described(self, info):
        """What the frame at the time holds, or the first one with something active: the first frames of a simulation
        may be without grids."""
        at = self._frame_at(info)
        file = self._read(at, NOWHERE)
        for frame in self._frames:
            if any(grid.box for grid in file.grids):
                break
            file = self._read(frame, NOWHERE)
        return file

    def _offer(self, names):
        """Offers the grids of a file; those of a new file are all chosen."""
        if self._known == (self._path, names):
            return
        self._known = (self._path, names)
        self._selection.RemoveAllArrays()
        for name in names:
            self._selection.AddArray(name)

    def _chosen(self, file):
        """The names and the chosen grids that have the transform of the first one.

        The names are those of esvr.File.names, which are unique. A frame of a sequence may have nothing active.
        """
        named = list(zip(file.names, file.grids))
        chosen = [(name, grid) for name, grid in named if self._selection.ArrayIsEnabled(name) and grid.box]
        if not chosen and not self._frames:
            raise RuntimeError(f"{self._path}: no grid with active voxels is chosen")
        for name, grid in chosen:
            if not placed_alike(grid, chosen[0][1]):
                print(f"{self._path}: grid '{name}' has another transform than '{chosen[0][0]}' and is left out")
        return [(name, grid) for name, grid in chosen if placed_alike(grid, chosen[0][1])]

    def RequestInformation(self, request, inputs, outputs):
        if not self._path:
            return 1
        info = outputs.GetInformationObject(0)
        self._frames = esvr.frames(self._path)
        file = self._described(info)
        self._offer(tuple(file.names))
        grids = [grid for _, grid in self._chosen(file)]
        if self._frames:
            info.Set(Pipeline.TIME_STEPS(), [float(f) for f in self._frames], len(self._frames))
            info.Set(Pipeline.TIME_RANGE(), [float(self._frames[0]), float(self._frames[-1])], 2)
        if not grids:
            info.Set(Pipeline.WHOLE_EXTENT(), EMPTY, 6)
            return 1
        boxes = np.array([grid.box for grid in grids])
        info.Set(Pipeline.WHOLE_EXTENT(), extent_of((boxes[:, 0].min(0).tolist(), boxes[:, 1].max(0).tolist())), 6)
        origin, spacing, directions = geometry_of(grids[0])
        info.Set(vtkImageData.ORIGIN(), origin.tolist(), 3)
        info.Set(vtkImageData.SPACING(), spacing.tolist(), 3)
        info.Set(vtkImageData.DIRECTION(), directions.ravel().tolist(), 9)
        info.Set(self.CAN_PRODUCE_SUB_EXTENT(), 1)
        return 1

    def RequestData(self, request, inputs, outputs):
        info = outputs.GetInformationObject(0)
        extent = list(info.Get(Pipeline.UPDATE_EXTENT()))
        box = box_of(extent)
        frame = self._frame_at(info)
        named = self._chosen(self._read(frame, box))
        image = vtkImageData.GetData(outputs)
        image.SetExtent(extent if named else EMPTY)
        if frame is not None:
            image.GetInformation().Set(image.DATA_TIME_STEP(), float(frame))
        if not named:
            return 1
        origin, spacing, directions = geometry_of(named[0][1])
        image.SetOrigin(origin)
        image.SetSpacing(spacing)
        matrix = vtkMatrix3x3()
        matrix.DeepCopy(directions.ravel().tolist())
        image.SetDirectionMatrix(matrix)
        for name, grid in named:
            values = grid.to_volume(box).to_numpy(box)
            array = numpy_to_vtk(values.ravel(order="F"), deep=True)  # x is fastest
            array.SetName(name)
            image.GetPointData().AddArray(array)
        image.GetPointData().SetActiveScalars(named[0][0])
        return 1
