"""What pvbatch runs for run.py: the reader's voxels, extents, transform, levels of detail, frames and picture.

The voxels must be those of esvr2vdb, bit for bit.
"""
import json
import os
import pathlib
import subprocess

import numpy as np
import paraview.simple as pv
from paraview import servermanager
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOImage import vtkPNGReader

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


SIDE = 200  # of a picture, pixels
FIELD_OF_VIEW = 30  # degrees
SAME_PICTURE = 30  # dB


def pixels_of(path):
    """A PNG in front of black, from 0 to 1."""
    picture = vtkPNGReader()
    picture.SetFileName(path)
    picture.Update()
    pixels = vtk_to_numpy(picture.GetOutput().GetPointData().GetScalars()) / 255
    return pixels[:, :3] * pixels[:, 3:] if pixels.shape[1] == 4 else pixels


def camera_of(low, high):
    """Center and eye in index coordinates. A sphere around the box fills the picture."""
    center = (np.add(low, high) / 2).tolist()
    distance = np.linalg.norm(np.subtract(high, low)) / 2 / np.sin(np.radians(FIELD_OF_VIEW / 2))
    return center, [center[0] + 0.6 * distance, center[1], center[2] + 0.8 * distance]


def draw_with_esvr(center, eye):
    def vector(numbers):
        return ",".join(map(str, numbers))
    camera = ["--eye=" + vector(eye), "--center=" + vector(center), "--up=0,1,0", "--fov", FIELD_OF_VIEW]
    run("render/esvr-render", "tree.esvr", "first.png", "-q", "--device", "cpu", "--range", "0,1", "--colors", "viridis",
        "--opacity", "linear", "--tf-save", "preset.json")
    run("render/esvr-render", "tree.esvr", "esvr.png", "-q", "--device", "cpu", "--tf", "preset.json", "--lod", "off",
        "--resolution", f"{SIDE}x{SIDE}", *camera)


def draw_with_paraview(reader, transform, center, eye):
    view = pv.CreateView("RenderView")
    view.ViewSize = [SIDE, SIDE]
    view.UseColorPaletteForBackground = 0
    view.Background = [0.0, 0.0, 0.0]
    view.OrientationAxesVisibility = 0
    display = pv.Show(reader, view)
    display.SetRepresentationType("Volume")
    pv.ColorBy(display, ("POINTS", "density"))
    display.SetScalarBarVisibility(view, False)
    display.VolumeRenderingMode = "Ray Cast Only"
    display.ScalarOpacityUnitDistance = transform[0, 0]  # a voxel, as in esvr-render
    display.Shade = 0
    preset = json.loads(pathlib.Path("preset.json").read_text())[0]
    colors = pv.GetColorTransferFunction("density")
    colors.ColorSpace = preset["ColorSpace"]
    colors.RGBPoints = preset["RGBPoints"]
    pv.GetOpacityTransferFunction("density").Points = preset["Points"]
    view.CameraPosition = (transform @ [*eye, 1])[:3].tolist()
    view.CameraFocalPoint = (transform @ [*center, 1])[:3].tolist()
    view.CameraViewUp = [0.0, 1.0, 0.0]
    view.CameraViewAngle = FIELD_OF_VIEW
    pv.SaveScreenshot("paraview.png", view, ImageResolution=view.ViewSize, TransparentBackground=0)


def check_picture():
    """The same preset and camera give the same picture as esvr-render."""
    reader = pv.ESVRReader(FileName="tree.esvr")
    center, eye = camera_of(*box_of(fetched(reader)[0]))
    draw_with_esvr(center, eye)
    draw_with_paraview(reader, esvr.read("tree.esvr")["density"].transform, center, eye)
    ours, theirs = pixels_of("esvr.png"), pixels_of("paraview.png")
    assert ((theirs.max(axis=1) > 0.15).sum() > 500), "the picture is empty"
    psnr = -10 * np.log10(np.mean((ours - theirs) ** 2))
    print(f"ParaView's picture has {psnr:.2f} dB against that of esvr-render")
    assert psnr > SAME_PICTURE, psnr


for check in (check_voxels, check_extents, check_choice, check_levels_of_detail, check_frames, check_picture):
    check()
    print(check.__name__, "passed", flush=True)
print("all checks passed")
