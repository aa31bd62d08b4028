"""Files that other tools write are read as these tools, or a second one, read them."""
import json
import os
import pathlib
import shutil
import struct
import subprocess

import numpy as np
import pytest

import esvr
from esvr.images import image2vdb, vdb2image
from esvr.images.image import LPS_TO_RAS

from conversions import convert, convert_all, dicom, geotiff, mrc, ramp, run_here, tiff, tilted, vtk_image


def same(made, values, matrix=None, atol=1e-5):
    assert made.values.shape == values.shape
    assert np.array_equal(made.values, values.astype(made.values.dtype))
    if matrix is not None:
        assert np.allclose(made.matrix, matrix, atol=atol)


# -- NIfTI and Analyze by nibabel --------------------------------------------------------------------------------------
@pytest.mark.parametrize("kind", ["u1", "i1", "i2", "u2", "f4", "f8", "i4"])
@pytest.mark.parametrize("name", ["a.nii", "a.nii.gz", "a.img"])
def test_nifti_by_nibabel(tmp_path, kind, name, nibabel):
    values = ramp(kind if kind not in ("u1", "i1") else "u2") % (100 if kind in ("u1", "i1") else 5000)
    pair = nibabel.Nifti1Pair if name.endswith("img") else nibabel.Nifti1Image
    nibabel.save(pair(values.astype(kind).transpose(2, 1, 0), tilted()), tmp_path / name)
    again = nibabel.load(tmp_path / name)
    made = convert(tmp_path / name)
    same(made, np.asarray(again.dataobj).transpose(2, 1, 0), again.affine)
    assert made.unit == "mm"


def test_nifti2_big_endian_in_microns_by_nibabel(tmp_path, nibabel):
    header = nibabel.Nifti2Header(endianness=">")
    header.set_data_dtype(">i2")
    image = nibabel.Nifti2Image(ramp("i2").transpose(2, 1, 0), tilted(), header=header)
    image.header.set_xyzt_units("micron", "sec")
    image.to_filename(tmp_path / "a.nii")
    same(convert(tmp_path / "a.nii", "--unit", "um"), ramp(), tilted())


@pytest.mark.parametrize("is_left_handed", [False, True])
def test_qform_alone_by_nibabel(tmp_path, is_left_handed, nibabel):
    matrix = tilted() @ (np.diag([-1.0, 1, 1, 1]) if is_left_handed else np.eye(4))
    image = nibabel.Nifti1Image(ramp("i2").transpose(2, 1, 0), None)
    image.header.set_qform(matrix, 1)
    image.header.set_sform(None, 0)
    nibabel.save(image, tmp_path / "a.nii")
    made = convert(tmp_path / "a.nii")
    same(made, ramp(), nibabel.load(tmp_path / "a.nii").affine)
    assert (np.linalg.det(made.matrix) < 0) == is_left_handed


def test_analyze_of_spm_by_nibabel(tmp_path, nibabel):
    """SPM keeps a factor where other programs have nothing."""
    image = nibabel.Spm99AnalyzeImage(ramp("f4").transpose(2, 1, 0) / 7, np.diag([-2, 2, 3, 1.0]))
    image.set_data_dtype("i2")
    image.to_filename(tmp_path / "a.img")
    stored = np.asarray(nibabel.load(tmp_path / "a.img").dataobj).transpose(2, 1, 0)
    same(convert(tmp_path / "a.img"), stored.astype("f4"))
    assert abs(stored - ramp() / 7).max() < 0.01


def test_analyze_by_nibabel(tmp_path, nibabel):
    image = nibabel.AnalyzeImage(ramp("i2").transpose(2, 1, 0), np.diag([0.5, 0.75, 2, 1]))
    nibabel.save(image, tmp_path / "a.img")
    made = convert(tmp_path / "a.hdr")
    same(made, ramp())
    assert np.allclose(made.spacing, [0.5, 0.75, 2])


def test_times_by_nibabel(tmp_path, nibabel):
    values = np.stack([ramp("i2") + 1000 * t for t in range(3)])
    nibabel.save(nibabel.Nifti1Image(values.transpose(3, 2, 1, 0), tilted()), tmp_path / "a.nii.gz")
    same(convert(tmp_path / "a.nii.gz", "--time", 2), values[2], tilted())
    same(convert(tmp_path / "a.nii.gz", "--time", 1), values[1])
    assert [made.values[0, 0, 0] for made in convert_all(tmp_path / "a.nii.gz", "--time", "all")] == [1, 1001, 2001]


# -- NRRD by teem ------------------------------------------------------------------------------------------------------
def unu(*words, **options):
    if not shutil.which("teem-unu"):
        pytest.skip("teem-unu is missing (Debian: teem-apps)")
    subprocess.run(["teem-unu", *map(str, words)], check=True, **options)


def raw_nrrd(tmp_path, kind="u2"):
    ramp(kind).tofile(tmp_path / "a.raw")
    name = {"u2": "ushort", "f4": "float", "i4": "int", "u1": "uchar"}[kind]
    unu("make", "-i", tmp_path / "a.raw", "-t", name, "-s", 6, 5, 4, "-sp", 0.5, 0.75, 2, "-e", "raw", "-en", "little", "-o",
        tmp_path / "made.nrrd")
    return tmp_path / "made.nrrd"


@pytest.mark.parametrize("encoding", ["raw", "gzip", "bzip2", "ascii", "hex"])
@pytest.mark.parametrize("kind", ["u2", "f4", "i4"])
def test_encodings_by_teem(tmp_path, encoding, kind):
    source = raw_nrrd(tmp_path, kind)
    unu("save", "-i", source, "-f", "nrrd", "-e", encoding, "-o", tmp_path / "b.nrrd")
    made = convert(tmp_path / "b.nrrd")
    same(made, ramp())
    assert np.allclose(made.spacing, [0.5, 0.75, 2])


@pytest.mark.parametrize("encoding", ["raw", "gzip", "ascii"])
def test_detached_headers_by_teem(tmp_path, encoding):
    unu("save", "-i", raw_nrrd(tmp_path), "-f", "nrrd", "-e", encoding, "-o", tmp_path / "b.nhdr")
    same(convert(tmp_path / "b.nhdr"), ramp())


def test_slices_in_files_by_teem(tmp_path):
    source = raw_nrrd(tmp_path)
    unu("dice", "-i", source, "-a", 2, "-o", tmp_path / "s", "-ff", "%02d.nrrd")
    for k in range(4):
        unu("save", "-i", tmp_path / f"s{k:02d}.nrrd", "-f", "nrrd", "-e", "raw", "-o", tmp_path / f"s{k}.nhdr")
    (tmp_path / "b.nhdr").write_text("NRRD0004\ntype: ushort\ndimension: 3\nsizes: 6 5 4\nendian: little\nencoding: raw\n"
                                     "data file: s%d.raw 0 3 1\n")
    same(convert(tmp_path / "b.nhdr"), ramp())
    unu("save", "-i", tmp_path / "b.nhdr", "-f", "nrrd", "-e", "raw", "-o", tmp_path / "c.nrrd")
    same(convert(tmp_path / "c.nrrd"), ramp())


def test_axes_in_any_order_by_teem(tmp_path):
    unu("permute", "-i", raw_nrrd(tmp_path), "-p", 2, 0, 1, "-o", tmp_path / "b.nrrd")
    made = convert(tmp_path / "b.nrrd")
    assert np.array_equal(made.values, ramp().transpose(1, 2, 0))
    assert np.allclose(made.spacing, [2, 0.5, 0.75])


def test_mins_by_teem(tmp_path):
    unu("axinfo", "-i", raw_nrrd(tmp_path), "-a", 0, "-mm", -6, -3.5, "-c", "node", "-o", tmp_path / "b.nrrd")
    made = convert(tmp_path / "b.nrrd")
    assert np.allclose(made.matrix[:3, 3], [-6, 0, 0]) and np.allclose(made.spacing, [0.5, 0.75, 2])


# -- MetaImage by ITK --------------------------------------------------------------------------------------------------
def test_metaimage_by_hand_as_itk_reads_it(tmp_path):
    # ITK: the rows of TransformMatrix are the directions of the axes, in LPS.
    matrix = LPS_TO_RAS @ tilted()
    spacing = np.linalg.norm(matrix[:3, :3], axis=0)
    rows = " ".join(f"{n:.17g}" for n in (matrix[:3, :3] / spacing).T.ravel())
    (tmp_path / "a.mhd").write_text(
        f"ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = True\nTransformMatrix = {rows}\n"
        f"Offset = {' '.join(f'{n:.17g}' for n in matrix[:3, 3])}\nElementSpacing = {' '.join(map(str, spacing))}\n"
        "DimSize = 6 5 4\nElementType = MET_USHORT\nElementDataFile = a.raw\n")
    ramp(">u2").tofile(tmp_path / "a.raw")
    same(convert(tmp_path / "a.mhd"), ramp(), tilted())


# -- MRC by mrcfile ----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("kind", ["i1", "i2", "u2", "f4", "f2"])
@pytest.mark.parametrize("compression", [None, "gzip"])
def test_mrc_by_mrcfile(tmp_path, kind, compression):
    values = (ramp() % 100 - 50).astype(kind) if kind == "i1" else ramp(kind)
    mrc(tmp_path / "a.mrc", values, compression=compression, voxel_size=(1.5, 2.5, 4.0), origin=(10, 20, 30))
    made = convert(tmp_path / "a.mrc", "--unit", "angstrom")
    same(made, values, [[1.5, 0, 0, 10], [0, 2.5, 0, 20], [0, 0, 4, 30], [0, 0, 0, 1]])
    assert made.unit == "angstrom"


def test_mrc_axes_and_starts_by_mrcfile(tmp_path):
    mrc(tmp_path / "a.map", ramp("f4"), mapc=3, mapr=2, maps=1, mx=4, my=5, mz=6, cella=(4 * 2.0, 5 * 0.75, 6 * 0.5), nxstart=5,
        nystart=6, nzstart=7)
    made = convert(tmp_path / "a.map", "--unit", "angstrom")
    assert np.array_equal(made.values, ramp().transpose(2, 1, 0))
    assert np.allclose(made.spacing, [2, 0.75, 0.5])
    assert np.allclose(made.matrix[:3, 3], [7 * 2.0, 6 * 0.75, 5 * 0.5])


def test_oblique_cells_by_mrcfile(tmp_path, mrcfile):
    with mrcfile.new(tmp_path / "a.mrc") as file:
        file.set_data(ramp("f4"))
        file.set_extended_header(np.zeros(77, "V16"))
        file.voxel_size = (1, 2, 3)
        file.header.cellb = (80, 95, 110)
    sides = convert(tmp_path / "a.mrc", "--unit", "angstrom").matrix[:3, :3]
    assert np.allclose(sides.T @ sides, np.outer([1, 2, 3], [1, 2, 3]) * np.cos(np.radians([[0, 110, 95], [110, 0, 80], [95, 80, 0]])))
    assert run_here(image2vdb, tmp_path / "a.mrc", tmp_path / "a.vdb") == 0
    assert run_here(vdb2image, tmp_path / "a.vdb", tmp_path / "b.mrc") == 0
    with mrcfile.open(tmp_path / "b.mrc") as file:
        assert np.array_equal(file.data, ramp())
        assert np.allclose([float(file.header.cellb[name]) for name in ("alpha", "beta", "gamma")], [80, 95, 110], atol=1e-3)


# -- TIFF by tifffile, GDAL and Pillow -----------------------------------------------------------------------------------
@pytest.mark.parametrize("kind", ["u1", "i1", "u2", "i2", "u4", "i4", "f2", "f4", "f8"])
@pytest.mark.parametrize("order", ["<", ">"])
def test_types_by_tifffile(tmp_path, kind, order, tifffile):
    values = (ramp() % 100).astype(kind) if kind in ("u1", "i1") else ramp(kind)
    tifffile.imwrite(tmp_path / "a.tif", values, byteorder=order, metadata={"axes": "ZYX"}, photometric="minisblack")
    same(convert(tmp_path / "a.tif"), values)


@pytest.mark.parametrize("options", [dict(tile=(16, 16)), dict(compression="zlib", predictor=True), dict(bigtiff=True),
                                     dict(rowsperstrip=2), dict(compression="zlib", tile=(32, 16))])
def test_layouts_by_tifffile(tmp_path, options, tifffile):
    values = ramp("u2", (40, 35, 3))
    try:
        tifffile.imwrite(tmp_path / "a.tif", values, metadata={"axes": "ZYX"}, photometric="minisblack", **options)
    except ValueError as missing:
        pytest.skip(str(missing))
    same(convert(tmp_path / "a.tif"), values)


def test_imagej_hyperstack_by_tifffile(tmp_path, tifffile):
    values = np.stack([np.stack([ramp() + 1000 * c + 4000 * t for c in range(2)], axis=1) for t in range(3)])
    tifffile.imwrite(tmp_path / "a.tif", values, imagej=True, resolution=(2.0, 4.0),
                     metadata={"axes": "TZCYX", "spacing": 3.0, "unit": "um"})
    made = convert(tmp_path / "a.tif", "--channel", 1, "--time", 2, "--unit", "um")
    same(made, values[2, :, 1])
    assert np.allclose(made.spacing, [0.5, 0.25, 3])


def test_one_page_for_all_slices_by_tifffile(tmp_path, tifffile):
    tifffile.imwrite(tmp_path / "a.tif", ramp(), imagej=True, metadata={"axes": "ZYX"}, contiguous=True)
    with tifffile.TiffFile(tmp_path / "a.tif") as file:
        second = file.pages[0].tags["ImageWidth"].offset - 2 + 2 + 12 * len(file.pages[0].tags)
    data = bytearray((tmp_path / "a.tif").read_bytes())
    data[second:second + 4] = bytes(4)  # ImageJ writes no directory for the other slices of a large file
    (tmp_path / "a.tif").write_bytes(data)
    same(convert(tmp_path / "a.tif"), ramp())


@pytest.mark.parametrize("axes", ["CZYX", "ZCYX", "TCZYX"])
def test_ome_by_tifffile(tmp_path, axes, tifffile):
    planes = {"c": 2, "z": 4, "t": 2}
    shape = [planes[a.lower()] for a in axes[:-2]] + [5, 6]
    values = np.arange(np.prod(shape), dtype="u2").reshape(shape) + 1
    tifffile.imwrite(tmp_path / "a.ome.tif", values, ome=True, photometric="minisblack", metadata={
        "axes": axes, "PhysicalSizeX": 200, "PhysicalSizeXUnit": "nm", "PhysicalSizeY": 0.25, "PhysicalSizeYUnit": "µm",
        "PhysicalSizeZ": 0.001, "PhysicalSizeZUnit": "mm", "Channel": {"Name": ["DAPI", "GFP"]}})
    words = ["--time", 1] if "T" in axes else []
    made = convert(tmp_path / "a.ome.tif", "--channel", 1, "--unit", "um", *words)
    expected = values[1] if "T" in axes else values
    same(made, expected[:, 1] if axes == "ZCYX" else expected[1])
    assert np.allclose(made.spacing, [0.2, 0.25, 1.0])
    grids = convert_all(tmp_path / "a.ome.tif", "--channel", "all", *words)
    assert [made.grid.name for made in grids] == ["DAPI", "GFP"]


def test_volumes_in_tiles_by_tifffile(tmp_path):
    values = ramp("u2", (40, 35, 20))
    tiff(tmp_path / "a.tif", values, tile=(16, 16, 16))
    same(convert(tmp_path / "a.tif"), values)


def test_colors_of_slices_by_tifffile(tmp_path, tifffile):
    colors = np.stack([ramp(), ramp() + 1000, ramp() + 2000], axis=-1)
    tifffile.imwrite(tmp_path / "a.tif", colors, photometric="rgb")
    tifffile.imwrite(tmp_path / "b.tif", np.moveaxis(colors, -1, 1), photometric="rgb", planarconfig="separate")
    same(convert(tmp_path / "a.tif", "--channel", 1), ramp() + 1000)
    same(convert(tmp_path / "b.tif", "--channel", 1), ramp() + 1000)


def test_pyramids_and_images_of_ome_by_tifffile(tmp_path, tifffile):
    values, other = ramp("u2", (64, 64, 4)), ramp("f4", (8, 7, 3))
    with tifffile.TiffWriter(tmp_path / "a.ome.tif", ome=True) as file:
        file.write(values, subifds=1, photometric="minisblack", metadata={"axes": "ZYX", "PhysicalSizeX": 0.5, "PhysicalSizeZ": 2})
        file.write(values[:, ::2, ::2], subfiletype=1, photometric="minisblack")
        file.write(other, photometric="minisblack", metadata={"axes": "ZYX", "PhysicalSizeX": 3, "PhysicalSizeZ": 4})
    with pytest.raises(esvr.UsageError, match="2 images"):
        convert(tmp_path / "a.ome.tif")
    for dataset, expected, spacing in (("0", values, [0.5, 0.5, 2]), ("1", other, [3, 3, 4])):
        made = convert(tmp_path / "a.ome.tif", "--dataset", dataset, "--unit", "um")
        same(made, expected)
        assert np.allclose(made.spacing, spacing)


def test_ome_in_two_files_by_tifffile(tmp_path, tifffile):
    for c in range(2):
        planes = "".join(f'<TiffData IFD="{z}" FirstZ="{z}" FirstC="{k}" PlaneCount="1"><UUID FileName="c{k}.ome.tif">urn:uuid:{k}'
                         "</UUID></TiffData>" for k in range(2) for z in range(4))
        text = (f'<?xml version="1.0" encoding="UTF-8"?><OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06" UUID="urn:uuid:{c}">'
                '<Image ID="Image:0"><Pixels ID="Pixels:0" DimensionOrder="XYZCT" Type="uint16" SizeX="6" SizeY="5" SizeZ="4" SizeC="2" '
                f'SizeT="1">{planes}</Pixels></Image></OME>')
        tifffile.imwrite(tmp_path / f"c{c}.ome.tif", ramp() + 1000 * c, description=text, metadata=None, photometric="minisblack")
    same(convert(tmp_path / "c0.ome.tif", "--channel", 1), ramp() + 1000)
    (tmp_path / "c1.ome.tif").unlink()
    with pytest.raises(esvr.BadInput, match="c0.ome.tif"):
        convert(tmp_path / "c0.ome.tif", "--channel", 1)


@pytest.mark.parametrize("options", [["COMPRESS=LZW"], ["COMPRESS=LZW", "PREDICTOR=2"], ["COMPRESS=DEFLATE", "TILED=YES"],
                                     ["COMPRESS=ZSTD"], ["COMPRESS=LZMA"], ["COMPRESS=PACKBITS"], ["NBITS=12"],
                                     ["NBITS=10", "COMPRESS=LZW"], ["SPARSE_OK=TRUE"], ["ENDIANNESS=BIG", "COMPRESS=LZW"]])
def test_codes_by_gdal(tmp_path, options, gdal):
    pytest.importorskip("tifffile")
    values = ramp("u2")[0:1] % 1000
    geotiff(tmp_path / "a.tif", values, *options)
    same(convert(tmp_path / "a.tif"), gdal.Open(str(tmp_path / "a.tif")).ReadAsArray()[np.newaxis])
    same(convert(tmp_path / "a.tif"), values)


def test_float_predictor_missing_and_scale_by_gdal(tmp_path):
    pytest.importorskip("tifffile")
    values = ramp("f4")[0] / 4
    values[0, 0] = -9999
    data = geotiff(tmp_path / "a.tif", values[np.newaxis], "COMPRESS=LZW", "PREDICTOR=3")
    band = data.GetRasterBand(1)
    band.SetNoDataValue(-9999)
    band.SetScale(2.0)
    band.SetOffset(10.0)
    data = band = None
    made = convert(tmp_path / "a.tif")
    assert made.missing == 1 and not made.active[0, 0, 0] and made.active.sum() == 29
    assert np.array_equal(made.values[0][made.active[0]], (values * 2 + 10)[made.active[0]])


def test_pages_by_pillow(tmp_path):
    pytest.importorskip("tifffile")
    pil = pytest.importorskip("PIL.Image")
    pages = [pil.fromarray(page) for page in ramp("u2")]
    pages[0].save(tmp_path / "a.tif", save_all=True, append_images=pages[1:], compression="tiff_lzw")
    pytest.importorskip("osgeo.gdal")
    same(convert(tmp_path / "a.tif"), ramp())


# -- VTI by VTK ----------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("mode", ["ascii", "binary", "appended"])
@pytest.mark.parametrize("compressor", ["none", "zlib", "lz4", "lzma"])
def test_vti_by_vtk(tmp_path, mode, compressor):
    xml = pytest.importorskip("vtkmodules.vtkIOXML")
    image, array = vtk_image(ramp("f4"))
    image.GetPointData().AddArray(array)  # no array is named as active
    writer = xml.vtkXMLImageDataWriter()
    writer.SetFileName(str(tmp_path / "a.vti"))
    writer.SetInputData(image)
    getattr(writer, {"ascii": "SetDataModeToAscii", "binary": "SetDataModeToBinary", "appended": "SetDataModeToAppended"}[mode])()
    writer.SetCompressorType({"none": 0, "zlib": 1, "lz4": 2, "lzma": 3}[compressor])
    writer.Write()
    same(convert(tmp_path / "a.vti"), ramp(), tilted())


def test_pieces_of_vti_by_vtk(tmp_path):
    xml = pytest.importorskip("vtkmodules.vtkIOXML")
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkImageData
    image = vtkImageData()
    image.SetExtent(3, 8, 0, 4, -2, 1)
    image.SetSpacing(0.5, 0.75, 2)
    image.SetOrigin(1, 2, 3)
    array = numpy_to_vtk((ramp() % 100).astype("i1").ravel(), deep=True)
    array.SetName("s")
    image.GetPointData().AddArray(array)
    writer = xml.vtkXMLImageDataWriter()
    writer.SetFileName(str(tmp_path / "a.vti"))
    writer.SetInputData(image)
    writer.SetNumberOfPieces(3)
    writer.Write()
    made = convert(tmp_path / "a.vti")
    same(made, ramp() % 100)
    assert np.allclose(made.matrix[:3, 3], [2.5, 2, -1])


@pytest.mark.parametrize("is_packed", [False, True])
def test_metaimage_by_vtk(tmp_path, monkeypatch, is_packed):
    io = pytest.importorskip("vtkmodules.vtkIOImage")
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkImageData
    monkeypatch.chdir(tmp_path)
    image = vtkImageData()
    image.SetDimensions(6, 5, 4)
    image.SetSpacing(0.5, 0.75, 2)
    image.SetOrigin(1, 2, 3)
    array = numpy_to_vtk(ramp("i2").ravel(), deep=True)
    image.GetPointData().SetScalars(array)
    writer = io.vtkMetaImageWriter()
    writer.SetInputData(image)
    writer.SetFileName("a.mhd")
    writer.SetCompression(is_packed)
    writer.Write()
    same(convert(tmp_path / "a.mhd"), ramp(), LPS_TO_RAS @ [[0.5, 0, 0, 1], [0, 0.75, 0, 2], [0, 0, 2, 3], [0, 0, 0, 1]])


# -- HDF5 and netCDF -----------------------------------------------------------------------------------------------------
def test_hdf5_by_h5py(tmp_path, h5py):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        chunked = file.create_dataset("volumes/raw", data=ramp(">u2"), chunks=(2, 3, 3), compression="gzip", shuffle=True)
        chunked.attrs["element_size_um"] = [2.0, 0.75, 0.5]
    made = convert(tmp_path / "a.h5", "--unit", "um")
    same(made, ramp(), np.diag([0.5, 0.75, 2, 1]))


def test_hdf5_whose_numbers_are_elsewhere_by_h5py(tmp_path, monkeypatch, h5py):
    """HDF5 takes what is not there for the fill value."""
    monkeypatch.chdir(tmp_path)
    layout = h5py.VirtualLayout((4, 5, 6), "u2")
    layout[:] = h5py.VirtualSource("source.h5", "d", (4, 5, 6))
    with h5py.File("source.h5", "w") as file, h5py.File("a.h5", "w") as virtual, h5py.File("b.h5", "w") as external, \
            h5py.File("c.h5", "w") as part:
        file["d"] = ramp()
        virtual.create_virtual_dataset("d", layout)
        external.create_dataset("d", (4, 5, 6), "u2", external=[("b.raw", 0, 240)])
        part.create_dataset("d", (8, 5, 6), "u2", chunks=(2, 5, 6))[:4] = ramp()
    (tmp_path / "b.raw").write_bytes(ramp().tobytes())
    same(convert(tmp_path / "a.h5"), ramp())
    same(convert(tmp_path / "b.h5"), ramp())
    assert convert(tmp_path / "c.h5").warnings == ["2 of 4 chunks are not stored, and have the fill value 0"]
    (tmp_path / "source.h5").unlink()
    (tmp_path / "b.raw").write_bytes(ramp().tobytes()[:100])
    for name, what in (("a.h5", "source.h5, which is missing"), ("b.h5", "cut short")):
        with pytest.raises(esvr.BadInput, match=what):
            convert(tmp_path / name)


@pytest.mark.parametrize("kind", ["f2", "f4", "f8", "i8", "u8", "bool"])
def test_hdf5_types_by_h5py(tmp_path, kind, h5py):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["a"] = (ramp() > 200) if kind == "bool" else ramp(kind)
    made = convert(tmp_path / "a.h5")
    assert made.grid.value_type == {"bool": "bool", "i8": "int64", "u8": "int64"}.get(kind, "float")
    same(made, (ramp() > 200) if kind == "bool" else ramp(kind))


def test_hdf5_scales_by_h5py(tmp_path, h5py):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["t"] = np.stack([ramp(), ramp() + 1000])
        for k, (name, size, step) in enumerate([("time", 2, 1.0), ("z", 4, 2.0), ("y", 5, 0.75), ("x", 6, 0.5)]):
            file[name] = 10 + step * np.arange(size)
            file[name].make_scale(name)
            if name != "time":
                file[name].attrs["units"] = "mm"
            file["t"].dims[k].attach_scale(file[name])
    made = convert(tmp_path / "a.h5", "--time", 1)
    same(made, ramp() + 1000, [[0.5, 0, 0, 10], [0, 0.75, 0, 10], [0, 0, 2, 10], [0, 0, 0, 1]])


@pytest.mark.parametrize("form", ["NETCDF4", "NETCDF4_CLASSIC", "NETCDF3_CLASSIC", "NETCDF3_64BIT_OFFSET", "NETCDF3_64BIT_DATA"])
def test_netcdf_by_netcdf4(tmp_path, form, netcdf):
    with netcdf.Dataset(tmp_path / "a.nc", "w", format=form) as file:
        for name, size in (("level", 4), ("lat", 5), ("lon", 6)):
            file.createDimension(name, None if name == "level" else size)
            file.createVariable(name, "f4", (name,))[:] = np.arange(size) * 0.25 + 3
        t = file.createVariable("t", "i2", ("level", "lat", "lon"), fill_value=-32767)
        t.scale_factor, t.add_offset, t.units = 0.01, 273.15, "K"
        t[:] = np.ma.MaskedArray(250 + ramp() / 10.0, ramp() == 1)
    made = convert(tmp_path / "a.nc")
    with netcdf.Dataset(tmp_path / "a.nc") as file:
        again = file["t"][:]
    assert made.missing == 1 and np.array_equal(~made.active, np.ma.getmaskarray(again))
    assert np.allclose(made.values[made.active], again.compressed(), rtol=1e-6)
    assert made.grid.metadata["value_unit"] == "K"


def test_netcdf_by_xarray(tmp_path, xarray):
    data = xarray.Dataset({"t": (("time", "z", "y", "x"), np.stack([ramp("f4"), ramp("f4") + 1000]))}, coords={
        "time": np.array(["2020-01-01", "2020-01-02"], "M8[ns]"), "z": ("z", np.arange(4) * 100.0, {"units": "m"}),
        "y": ("y", 5000.0 - np.arange(5) * 1000, {"units": "m"}), "x": ("x", np.arange(6.0) * 2, {"units": "km"})})
    data["t"][0, 0, 0, 0] = np.nan
    data.to_netcdf(tmp_path / "a.nc", engine="netcdf4", encoding={"t": {"_FillValue": np.float32(np.nan)}})
    made = convert(tmp_path / "a.nc", "--time", 0, "--unit", "m")
    assert made.missing == 1
    assert np.array_equal(made.values[made.active], ramp()[made.active])
    assert np.allclose(made.matrix, [[2000, 0, 0, 0], [0, -1000, 0, 5000], [0, 0, 100, 0], [0, 0, 0, 1]])


# -- Zarr ----------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("separator", [".", "/"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_zarr_by_zarr(tmp_path, separator, order, zarr):
    array = zarr.open(str(tmp_path / "a.zarr"), mode="w", shape=(4, 5, 6), chunks=(3, 2, 4), dtype=">u2", order=order,
                      dimension_separator=separator)
    array[:] = ramp()
    same(convert(tmp_path / "a.zarr"), ramp())


def test_zarr_by_xarray(tmp_path, xarray):
    pytest.importorskip("zarr")
    data = xarray.Dataset({"t": (("z", "y", "x"), ramp("f4"))}, coords={"x": ("x", np.arange(6) * 0.5, {"units": "mm"}), "y": (
        "y", np.arange(5) * 0.75, {"units": "mm"}), "z": ("z", np.arange(4) * 2.0, {"units": "mm"})})
    data.to_zarr(tmp_path / "a.zarr")
    same(convert(tmp_path / "a.zarr"), ramp(), np.diag([0.5, 0.75, 2, 1]))


def test_packed_zarr_by_xarray(tmp_path, xarray):
    pytest.importorskip("zarr")
    values = 250 + ramp("f8") / 10
    values[:, 0] = np.nan
    xarray.Dataset({"t": (("z", "y", "x"), values)}).to_zarr(tmp_path / "a.zarr", encoding={
        "t": {"dtype": "i2", "scale_factor": 0.1, "add_offset": 250.0, "_FillValue": -32767}})
    made = convert(tmp_path / "a.zarr")
    again = xarray.open_zarr(tmp_path / "a.zarr")["t"].values
    assert made.missing == 24 and np.array_equal(made.active, ~np.isnan(again))
    assert np.allclose(made.values[made.active], again[made.active])


def test_zarr_zip_by_zarr(tmp_path, zarr):
    with zarr.ZipStore(str(tmp_path / "a.zarr.zip"), mode="w") as store:
        zarr.create(shape=(4, 5, 6), chunks=(2, 5, 6), dtype="u2", store=store)[:] = ramp()
    same(convert(tmp_path / "a.zarr.zip"), ramp())


# -- DICOM by pydicom and dcmtk --------------------------------------------------------------------------------------------
@pytest.mark.parametrize("tool", [None, ("dcmcrle",), ("dcmcjpls",), ("dcmcjpeg", "+e1"), ("dcmconv", "+tb"), ("dcmconv", "+td"),
                                  ("dcmconv", "+ti")])
@pytest.mark.parametrize("kind", ["u2", "i2"])
def test_dicom_by_pydicom_and_dcmtk(tmp_path, tool, kind):
    folder = dicom(tmp_path / "s", ramp(kind) - (300 if kind == "i2" else 0), tool=tool)
    made = convert(folder)
    same(made, ramp("i4") - (300 if kind == "i2" else 0), tilted(), atol=1e-4)


# -- ITK and ImageJ ------------------------------------------------------------------------------------------------------
def itk(*words):
    """ITK as WebAssembly: npm install @itk-wasm/image-io@1.6.1; ESVR_ITK_WASM is then the folder node_modules."""
    folder = os.environ.get("ESVR_ITK_WASM", "")
    if not folder or not shutil.which("node"):
        pytest.skip("ESVR_ITK_WASM is not set (npm install @itk-wasm/image-io)")
    script = pathlib.Path(__file__).with_name("itk.mjs")
    return json.loads(subprocess.run(["node", str(script), folder, *map(str, words)], check=True, capture_output=True).stdout)


def test_itk_writes_and_reads(tmp_path):
    files = [tmp_path / f"a.{ending}" for ending in ("mha", "nii.gz", "nrrd")]
    itk("write", *files)
    matrix = np.eye(4)
    matrix[:3, :3] = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]]) * [0.5, 0.75, 2]
    matrix[:3, 3] = 6, -100, 7
    backs = []
    for file in files:
        same(convert(file), ramp(), LPS_TO_RAS @ matrix)
        backs.append(tmp_path / f"back.{file.name.partition('.')[2]}")
        assert run_here(image2vdb, file, tmp_path / "a.vdb", "-f") == 0 and run_here(vdb2image, tmp_path / "a.vdb", backs[-1]) == 0
    for seen in itk("read", *backs):
        assert seen["type"] == "int16" and seen["size"] == [6, 5, 4] and np.array_equal(seen["data"], ramp().ravel())
        assert np.allclose(np.array(seen["direction"]).reshape(3, 3) * seen["spacing"], matrix[:3, :3], atol=1e-5)
        assert np.allclose(seen["origin"], matrix[:3, 3], atol=1e-4)


def imagej(tmp_path, macro, screen=()):
    jar = pathlib.Path("/usr/share/java/ij.jar")
    if not jar.exists() or not shutil.which("java"):
        pytest.skip("ImageJ is missing (Debian: imagej)")
    (tmp_path / "m.ijm").write_text(macro)
    headless = [] if screen else ["-Djava.awt.headless=true"]
    subprocess.run([*screen, "java", *headless, "-cp", str(jar), "ij.ImageJ", "-batch", str(tmp_path / "m.ijm")],
                   capture_output=True, check=True, timeout=60)


def test_imagej_writes_and_reads(tmp_path):
    pytest.importorskip("tifffile")
    # Voxel (x, y) of slice n (from 1 on) of the hyperstack of 2 channels and 4 slices.
    imagej(tmp_path, f"""
newImage("a", "16-bit black", 6, 5, 8);
for (n = 1; n <= 8; n++) {{ setSlice(n); for (y = 0; y < 5; y++) for (x = 0; x < 6; x++) setPixel(x, y, 1000 * n + 10 * y + x); }}
setVoxelSize(0.5, 0.25, 2, "micron");
Stack.setDimensions(2, 4, 1);
saveAs("Tiff", "{tmp_path}/hyper.tif");
newImage("b", "32-bit ramp", 6, 5, 4);
saveAs("Tiff", "{tmp_path}/float.tif");
""")
    made = convert(tmp_path / "hyper.tif", "--channel", 1, "--unit", "um")
    z, y, x = np.mgrid[0:4, 0:5, 0:6]
    assert np.array_equal(made.values, 1000 * (2 * z + 2) + 10 * y + x) and np.allclose(made.spacing, [0.5, 0.25, 2])
    assert np.allclose(convert(tmp_path / "float.tif").values, x / 6, atol=1e-6)
    assert run_here(image2vdb, tmp_path / "hyper.tif", tmp_path / "a.vdb", "--channel", 1) == 0
    assert run_here(vdb2image, tmp_path / "a.vdb", tmp_path / "back.tif") == 0
    if not shutil.which("xvfb-run"):
        pytest.skip("ImageJ opens files on a screen only (Debian: xvfb)")
    imagej(tmp_path, f"""
open("{tmp_path}/back.tif");
getVoxelSize(w, h, d, unit); getDimensions(x, y, c, z, t); setSlice(3);
File.saveString("" + w + " " + h + " " + d + " " + unit + " " + x + " " + y + " " + c + " " + z + " " + t + " " + getPixel(4, 2),
                "{tmp_path}/said.txt");
""", ["xvfb-run", "-a"])
    said = (tmp_path / "said.txt").read_text().split()
    assert np.allclose([float(n) for n in said[:3]], [0.5, 0.25, 2]) and said[3:] == ["microns", "6", "5", "1", "4", "1", "6024"]


# -- raw numbers ---------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("endian", ["little", "big"])
def test_raw_by_struct(tmp_path, endian):
    header = b"header"
    (tmp_path / "a.raw").write_bytes(header + struct.pack(f"{'<' if endian == 'little' else '>'}120H", *ramp().ravel()))
    same(convert(tmp_path / "a.raw", "--dims", "6,5,4", "--type", "uint16", "--endian", endian, "--skip", len(header)), ramp())


@pytest.mark.parametrize("is_fortran", [False, True])
def test_npy_by_numpy(tmp_path, is_fortran):
    np.save(tmp_path / "a.npy", np.asfortranarray(ramp()) if is_fortran else ramp())
    same(convert(tmp_path / "a.npy"), ramp())


def test_tomograms_of_nuclear_medicine_by_pydicom(tmp_path, pydicom):
    """Frames have their place in the description of the detector."""

    def change(_, data):
        detector = pydicom.Dataset()
        detector.ImageOrientationPatient, detector.ImagePositionPatient = data.ImageOrientationPatient, data.ImagePositionPatient
        del data.ImageOrientationPatient, data.ImagePositionPatient
        data.Modality, data.NumberOfFrames, data.SpacingBetweenSlices = "NM", 4, 2.0
        data.ImageType, data.PixelData = ["ORIGINAL", "PRIMARY", "RECON TOMO", "EMISSION"], ramp().tobytes()
        data.DetectorInformationSequence = pydicom.Sequence([detector])
    same(convert(dicom(tmp_path / "a", ramp()[:1], change=change)), ramp(), tilted())


def test_palettes_of_dicom_by_pydicom(tmp_path):
    folder = dicom(tmp_path / "a", ramp("u1")[:1], change=lambda _, data: setattr(data, "PhotometricInterpretation", "PALETTE COLOR"))
    with pytest.raises(esvr.BadInput, match="PALETTE COLOR.*--stored"):
        convert(folder)
    same(convert(folder, "--stored"), ramp("u1")[:1])


def test_masks_of_tiff_by_gdal(tmp_path, gdal):
    gdal.UseExceptions()
    gdal.SetConfigOption("GDAL_TIFF_INTERNAL_MASK", "YES")
    geotiff(tmp_path / "a.tif", ramp()[:1]).CreateMaskBand(gdal.GMF_PER_DATASET)
    gdal.SetConfigOption("GDAL_TIFF_INTERNAL_MASK", None)
    made = convert(tmp_path / "a.tif")
    same(made, ramp()[:1])
    assert made.warnings == ["the mask of valid pixels is not read"]


def test_ome_whose_description_is_elsewhere(tmp_path):
    text = '<?xml version="1.0"?><OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06"><BinaryOnly MetadataFile="a.ome" UUID="u"/></OME>'
    tiff(tmp_path / "a.ome.tif", ramp(), description=text)
    with pytest.raises(esvr.BadInput, match="OME-XML in another file"):
        convert(tmp_path / "a.ome.tif")


@pytest.mark.parametrize("planar", ["contig", "separate"])
def test_colors_from_below_by_tifffile(tmp_path, planar, tifffile):
    colors = np.stack([ramp()[0] + 1000 * k for k in range(3)], axis=-1 if planar == "contig" else 0)
    tifffile.imwrite(tmp_path / "a.tif", colors, photometric="rgb", planarconfig=planar, metadata=None, extratags=[(274, 3, 1, 4, True)])
    same(convert(tmp_path / "a.tif", "--channel", 2), ramp()[:1, ::-1] + 2000)


def test_as_many_rows_as_colors_by_gdal(tmp_path):
    geotiff(tmp_path / "a.tif", ramp()[:3, :3], "COMPRESS=LZW", "INTERLEAVE=PIXEL")
    same(convert(tmp_path / "a.tif", "--channel", 1), ramp()[1:2, :3])
