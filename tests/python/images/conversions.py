"""What the tests of image2vdb and vdb2image share: a small image, conversions in this process, and runs of the programs."""
import contextlib
import dataclasses
import os
import pathlib
import shutil
import subprocess
import sys
from unittest import mock

import numpy as np
import pytest

import esvr
from esvr.images import image2vdb, program
from esvr.images.image import LPS_TO_RAS


def ramp(dtype="u2", size=(6, 5, 4)):
    """An image with the axes z, y, x, in which every voxel has a value of its own above 0: 100 z + 10 y + x + 1."""
    z, y, x = np.mgrid[0:size[2], 0:size[1], 0:size[0]]
    return (100 * z + 10 * y + x + 1).astype(dtype)


def tilted(spacing=(0.5, 0.75, 2.0), origin=(-6.0, 100.0, 7.0)):
    """A matrix from voxels to RAS that turns around two axes."""
    a, b = np.deg2rad(30), np.deg2rad(20)
    turn = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]]) @ \
        np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn * spacing, origin
    return matrix


def vtk_image(values):
    """An image of VTK with the matrix tilted(), and its values as an array "T" that it does not hold yet."""
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkImageData
    matrix = tilted()
    spacing = np.linalg.norm(matrix[:3, :3], axis=0)
    image = vtkImageData()
    image.SetDimensions(*reversed(values.shape))
    image.SetSpacing(spacing)
    image.SetOrigin(matrix[:3, 3])
    image.SetDirectionMatrix(*(matrix[:3, :3] / spacing).ravel())
    array = numpy_to_vtk(values.ravel(), deep=True)
    array.SetName("T")
    return image, array


@dataclasses.dataclass
class Converted:
    """A grid: values with the axes z, y, x over the box of the image, active voxels, matrix, and the texts that were printed."""
    grid: object
    warnings: list
    notes: list
    missing: int

    @property
    def box(self):
        size = self.grid.metadata["image_size"]
        return (0, 0, 0), tuple(int(n) - 1 for n in size)

    @property
    def values(self):
        values = self.grid.to_numpy(self.box)
        return values.transpose(2, 1, 0) if values.ndim == 3 else values.transpose(2, 1, 0, 3)

    @property
    def active(self):
        return self.grid.active(self.box).transpose(2, 1, 0)

    @property
    def matrix(self):
        return np.array(self.grid.transform)

    @property
    def spacing(self):
        return np.linalg.norm(self.matrix[:3, :3], axis=0)

    @property
    def unit(self):
        return self.grid.metadata.get("length_unit")


class Quiet:
    def progress(self, *_):
        pass


def convert_all(*words):
    """All grids of an image, time after time."""
    arguments = image2vdb.PARSER.parse([str(word) for word in words] + ["out.vdb"])
    image = image2vdb.open_image(arguments.files[:-1], arguments)
    made = []
    for _, parts in image2vdb.chosen_parts(image, arguments):
        for name, part in parts:
            grid, conversion = image2vdb.convert(name, part, arguments, Quiet())
            made.append(Converted(grid, image.warnings, image.notes, conversion.missing))
    return made


def convert(*words):
    made = convert_all(*words)
    assert len(made) == 1
    return made[0]


def run(program, *words, **options):
    """Runs a program of this folder as a user does."""
    module = {"image2vdb": "esvr.images.image2vdb", "vdb2image": "esvr.images.vdb2image"}[program]
    path = os.pathsep.join([str(pathlib.Path(esvr.__file__).parent.parent)] + sys.path)
    return subprocess.run([sys.executable, "-m", module, *map(str, words)], capture_output=True, text=True, timeout=60,
                          env={**os.environ, "PYTHONPATH": path}, **options)


# -- writers of small files, by another tool where there is one ---------------------------------------------------------
def nrrd(path, fields, data):
    names = {"uint16": "ushort", "float32": "float", "int32": "int", "uint8": "uchar"}
    text = f"NRRD0004\ntype: {names[data.dtype.name]}\nencoding: raw\nendian: little\n" + "".join(f"{k}: {v}\n" for k, v in fields)
    path.write_bytes(text.encode() + b"\n" + np.ascontiguousarray(data).tobytes())
    return path


def nifti(path, data, change=None, matrix=None):
    nibabel = pytest.importorskip("nibabel")
    nibabel.save(nibabel.Nifti1Image(data.transpose(*range(data.ndim)[::-1]), tilted() if matrix is None else matrix), path)
    if change:
        header = bytearray(path.read_bytes())
        change(header)
        path.write_bytes(header)
    return path


def tiff(path, data, **options):
    tifffile = pytest.importorskip("tifffile")
    options.setdefault("metadata", None)
    options.setdefault("photometric", "minisblack")
    tifffile.imwrite(path, data, **options)
    return path


def geotiff(path, bands, *options):
    """A file that GDAL writes when the result goes out of scope."""
    gdal, arrays = pytest.importorskip("osgeo.gdal"), pytest.importorskip("osgeo.gdal_array")
    return gdal.GetDriverByName("GTiff").CreateCopy(str(path), arrays.OpenArray(np.ascontiguousarray(bands)), options=list(options))


def mrc(path, data, order="<", compression=None, **fields):
    with pytest.importorskip("mrcfile").new(path, compression=compression, overwrite=True) as file:
        file.set_data(data)
        file.voxel_size = fields.pop("voxel_size", 1.0)
        for name, value in fields.items():
            file.header[name] = value
    if order == ">":
        raw = path.read_bytes()
        words = bytearray(np.frombuffer(raw[:1024], "<u4").astype(">u4").tobytes())
        words[208:212], words[212:216] = b"MAP ", b"\x11\x11\0\0"
        path.write_bytes(bytes(words) + data.astype(data.dtype.newbyteorder(">")).tobytes())
    return path


def metaimage(path, fields, data, local=True):
    lines = [f"{k} = {v}" for k, v in fields.items()] + ["ElementDataFile = LOCAL"] * local
    path.write_bytes("\n".join(lines + [""]).encode() + data)
    return path


@contextlib.contextmanager
def netcdf_file(path, dims="zyx", form="NETCDF4"):
    """A new file whose dimensions have the lengths of ramp()."""
    with pytest.importorskip("netCDF4").Dataset(path, "w", format=form) as file:
        for dim, size in zip(dims, (4, 5, 6)):
            file.createDimension(dim, size)
        yield file


def dicom(folder, values, *, matrix=None, tool=None, change=None, names=None):
    """Writes a series by pydicom, a file for each slice, and turns it by a program of dcmtk."""
    pydicom = pytest.importorskip("pydicom")
    from pydicom.dataset import Dataset, FileMetaDataset
    matrix = LPS_TO_RAS @ (tilted() if matrix is None else matrix)
    spacing = np.linalg.norm(matrix[:3, :3], axis=0)
    series = pydicom.uid.generate_uid()
    folder.mkdir(exist_ok=True)
    for k, page in enumerate(values):
        data = Dataset()
        data.file_meta = FileMetaDataset()
        data.file_meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
        data.SOPClassUID, data.SOPInstanceUID = pydicom.uid.CTImageStorage, pydicom.uid.generate_uid()
        data.file_meta.MediaStorageSOPClassUID, data.file_meta.MediaStorageSOPInstanceUID = data.SOPClassUID, data.SOPInstanceUID
        data.SeriesInstanceUID, data.SeriesNumber, data.InstanceNumber, data.Modality = series, 3, k + 1, "CT"
        data.PatientName, data.PatientID, data.StudyInstanceUID = "Test", "1", series
        data.Rows, data.Columns = page.shape[:2]
        data.SamplesPerPixel, data.PhotometricInterpretation = 1, "MONOCHROME2"
        data.BitsAllocated = data.BitsStored = page.itemsize * 8
        data.HighBit, data.PixelRepresentation = data.BitsStored - 1, int(page.dtype.kind == "i")
        data.ImageOrientationPatient = [f"{n:.9f}" for n in [*(matrix[:3, 0] / spacing[0]), *(matrix[:3, 1] / spacing[1])]]
        data.ImagePositionPatient = [f"{n:.8f}" for n in (matrix @ [0, 0, k, 1])[:3]]
        data.PixelSpacing = [f"{spacing[1]:.6f}", f"{spacing[0]:.6f}"]
        data.RescaleSlope, data.RescaleIntercept = 1, 0
        data.PixelData = page.tobytes()
        data.is_little_endian, data.is_implicit_VR = True, False
        if change:
            change(k, data)
        name = folder / (names[k] if names else f"s{k}.dcm")
        pydicom.dcmwrite(name, data, write_like_original=False)
        if tool:
            if not shutil.which(tool[0]):
                pytest.skip(f"{tool[0]} is missing (Debian: dcmtk)")
            subprocess.run([*tool, str(name), str(name) + ".new"], check=True, capture_output=True)
            (folder / (name.name + ".new")).replace(name)
    return folder


def run_here(module, *words):
    """Runs a program in this process, and its work, too, for which it would start a child process. Returns the exit code."""
    with mock.patch.object(program, "run_in_child", lambda name, inputs, outputs, work, verbose: program.run_here(name, work, verbose)), \
            mock.patch.object(sys, "argv", ["program", *map(str, words)]):
        return module.main()
