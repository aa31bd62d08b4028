"""What pvbatch runs for run.py: the reader's voxels, extents, transform, levels of detail and frames.

The voxels must be those of esvr2vdb, bit for bit.
"""
import os
import pathlib
import subprocess

import numpy as np
import paraview.simple as pv
from paraview import servermanager
from vtkmodules.util.numpy_support import vtk_to_numpy

import esvr

BIN = pathlib.Path(os.environ["ESVR_BIN"])
pv.LoadPlugin(os.environ["ESVR_PLUGIN"], remote=False, ns=vars(pv))


def run(program, *arguments):
    subprocess.run([str(BIN / program), *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)


def fetched(reader):
    image = servermanager.Fetch(reader)
    return image, {image.GetPointData().GetArrayName(a): voxels_of(image, a)
                   for a in range(image.GetPointData().GetNumberOfArrays())}


def voxels_of(image, array):
    return vtk_to_numpy(image.GetPointData().GetArray(array)).reshape(image.GetDimensions(), order="F")


def decoded(path, grid, box):
    """The voxels as esvr2vdb decodes them."""
    run("esvr2vdb/esvr2vdb", path, "back.vdb", "--half", "off", "-f")
    return esvr.Volume.from_vdb("back.vdb", grid).to_numpy(box)


def box_of(image):
    extent = image.GetExtent()
    return tuple(extent[0::2]), tuple(extent[1::2])


def check_voxels():
    run("samples/esvr-sample", "two-grids", "two.vdb", "--resolution", 48)
    run("vdb2esvr/vdb2esvr", "two.vdb", "two.esvr", "--preset", "draft")
    image, arrays = fetched(pv.ESVRReader(FileName="two.esvr"))
    assert "density" in arrays, arrays.keys()
    for name, values in arrays.items():
        assert np.array_equal(values, decoded("two.esvr", name, box_of(image))), name
    transform = esvr.read("two.esvr")["density"].transform
    for corner in np.array(np.meshgrid(*[(-3, 40)] * 3)).reshape(3, -1).T:
        point = [0.0] * 3
        image.TransformContinuousIndexToPhysicalPoint(*map(float, corner), point)
        assert np.allclose(point, (transform @ [*corner, 1])[:3], atol=1e-9), (point, corner)


def check_extents():
    """A slice asks for a part of the extent."""
    reader = pv.ESVRReader(FileName="two.esvr")
    whole, arrays = fetched(reader)
    extent = list(whole.GetExtent())
    middle = (extent[4] + extent[5]) // 2
    part = pv.ExtractSubset(Input=reader, VOI=[*extent[:4], middle, middle])
    _, cut = fetched(part)
    assert np.array_equal(cut["density"][:, :, 0], arrays["density"][:, :, middle - extent[4]])


def check_choice():
    reader = pv.ESVRReader(FileName="two.esvr")
    reader.UpdatePipelineInformation()
    reader.Grids = ["density"]
    assert list(fetched(reader)[1]) == ["density"]


def check_levels_of_detail():
    run("samples/esvr-sample", "tree", "tree.vdb", "--resolution", 96)
    run("vdb2esvr/vdb2esvr", "tree.vdb", "tree.esvr", "--count", 3000, "--representation", "ellipsoids", "--preset",
        "draft")
    coarse = fetched(pv.ESVRReader(FileName="tree.esvr", Ellipsoids=100))[1]["density"]
    fine = fetched(pv.ESVRReader(FileName="tree.esvr"))[1]["density"]
    assert coarse.shape == fine.shape and coarse.any() and not np.array_equal(coarse, fine)


def check_frames():
    run("samples/esvr-sample", "plume", "p.####.vdb", "--resolution", 40, "--frames", 3)
    run("vdb2esvr/vdb2esvr", "p.####.vdb", "plume.esvr", "--preset", "draft")
    reader = pv.ESVRReader(FileName="plume.esvr")
    reader.UpdatePipelineInformation()
    assert list(reader.TimestepValues) == [1.0, 2.0, 3.0], reader.TimestepValues
    for frame in (3, 1):
        reader.UpdatePipeline(float(frame))
        image, arrays = fetched(reader)
        grid = esvr.read("plume.esvr", frame=frame)["density"]
        assert np.array_equal(arrays["density"], grid.to_volume().to_numpy(box_of(image))), frame


def check_picture():
    view = pv.CreateView("RenderView")
    view.ViewSize = [200, 200]
    view.UseColorPaletteForBackground = 0
    view.Background = [0.0, 0.0, 0.0]
    view.OrientationAxesVisibility = 0
    display = pv.Show(pv.ESVRReader(FileName="tree.esvr"), view)
    display.SetRepresentationType("Volume")
    pv.ColorBy(display, ("POINTS", "density"))
    pv.ResetCamera(view)
    pv.SaveScreenshot("tree.png", view, TransparentBackground=0)
    from vtkmodules.vtkIOImage import vtkPNGReader
    picture = vtkPNGReader()
    picture.SetFileName("tree.png")
    picture.Update()
    pixels = vtk_to_numpy(picture.GetOutput().GetPointData().GetScalars())
    assert (pixels.max(axis=1) > 40).sum() > 500, "the picture is empty"


for check in (check_voxels, check_extents, check_choice, check_levels_of_detail, check_frames, check_picture):
    check()
    print(check.__name__, "passed", flush=True)
print("all checks passed")
