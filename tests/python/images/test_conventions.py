"""Valid files that popular readers take for something else without a word, and what they mean.

Most of these cases are those in which one of VTK, ITK, GDAL, Pillow, xarray or zarr is wrong.
"""
import gzip
import json
import struct
import zlib

import numpy as np
import pytest

import esvr

from conversions import (convert, convert_all, dicom, geotiff, metaimage, mrc, netcdf_file, nifti, nrrd, ramp, run, tiff,
                         tilted)


def refused(error, match, *words):
    with pytest.raises(error, match=match):
        convert_all(*words)


# -- the small files of earlier faults ---------------------------------------------------------------------------------
EDGE = [("ome_z_in_dm.ome.tif", [], (0.299, 0.299, 1.0), "um"), ("imagej_crlf.tif", [], (0.5, 0.5, 2), "um"),
        ("imagej_negative_spacing.tif", [], (0.5, 0.5, 2), "um"), ("ome_planes_reversed.ome.tif", [], (0.5, 0.5, 2), "um"),
        ("ome_prefix_two_channels.ome.tif", ["--channel", 0], (0.5, 0.5, 2), "um"), ("nrrd_axis_mins.nrrd", [], (0.5, 0.5, 2), None),
        ("tifffile_shape.tif", ["--channel", 0], (1, 1, 1), None)]


@pytest.mark.parametrize("name, words, spacing, unit", EDGE)
def test_small_files_RealFile(edge, name, words, spacing, unit):
    made = convert(edge / name, *words, *(["--unit", unit] if unit else []))
    assert np.array_equal(made.values, ramp()) and np.allclose(made.spacing, spacing)
    if name.startswith(("ome_prefix", "tifffile")):
        assert np.array_equal(convert(edge / name, "--channel", 1).values, ramp() + 1000)
        refused(esvr.UsageError, "channel: 2; choose by --channel", edge / name)
    if name.startswith("nrrd_axis"):
        assert np.allclose(made.matrix[:3, 3], [-6, 100, 7])


def test_small_files_of_values_RealFile(edge):
    made = convert(edge / "imagej_ct_signed.tif")
    assert np.array_equal(made.values, ramp("i4") - 1000) and (made.values.min(), made.values.max()) == (-999, -654)
    assert convert(edge / "imagej_ct_signed.tif", "--stored").values.min() == 31769
    made = convert(edge / "packed_weather.nc")
    rows = np.zeros((4, 5, 6), bool)
    rows[:, 0] = True
    assert made.missing == 24 and np.array_equal(made.active, ~rows)
    assert np.allclose(made.values[~rows], (250 + ramp() / 10.0)[~rows], atol=0.006)
    made = convert(edge / "nrrd_vector_first.nrrd")
    assert np.array_equal(made.values, np.stack([ramp("f4"), 2 * ramp("f4"), -ramp("f4")], axis=-1))
    assert np.array_equal(convert(edge / "flat_cells.vti").values, ramp("f4")[:1])


# -- NRRD --------------------------------------------------------------------------------------------------------------
def test_directions_of_nrrd(tmp_path):
    matrix = tilted()
    vectors = " ".join(f"({','.join(repr(n) for n in matrix[:3, k])})" for k in range(3))
    fields = [("dimension", "3"), ("sizes", "6 5 4"), ("space directions", vectors), ("space origin", "(-6,100,7)")]
    made = convert(nrrd(tmp_path / "a.nrrd", fields + [("space", "RAS")], ramp()))
    assert np.array_equal(made.values, ramp()) and np.allclose(made.matrix, matrix) and made.unit == "mm"
    made = convert(nrrd(tmp_path / "b.nrrd", fields + [("space", "left-posterior-superior")], ramp()))
    assert np.allclose(made.matrix, np.diag([-1, -1, 1, 1]) @ matrix)
    made = convert(nrrd(tmp_path / "c.nrrd", fields + [("space dimension", "3"), ("space units", '"um" "um" "um"')], ramp()))
    assert np.allclose(made.matrix[:3], matrix[:3] * 1e-3) and made.unit == "mm"


def test_swapped_and_reversed_directions_of_nrrd(tmp_path):
    made = convert(nrrd(tmp_path / "a.nrrd", [("dimension", "3"), ("sizes", "6 5 4"), ("space", "RAS"),
                                              ("space directions", "(0,0,2) (-0.5,0,0) (0,0.75,0)")], ramp()))
    assert np.array_equal(made.values, ramp())
    assert np.allclose(made.matrix[:3, :3], [[0, -0.5, 0], [0, 0, 0.75], [2, 0, 0]])


@pytest.mark.parametrize("kinds, place, option", [("domain domain domain list", "last", "--channel"),
                                                  ("list domain domain domain", "first", "--channel"),
                                                  ("domain domain domain time", "last", "--time")])
def test_fourth_axes_of_nrrd(tmp_path, kinds, place, option):
    data = np.stack([ramp(), ramp() + 1000], axis=0 if place == "last" else -1)
    sizes = "6 5 4 2" if place == "last" else "2 6 5 4"
    path = nrrd(tmp_path / "a.nrrd", [("dimension", "4"), ("sizes", sizes), ("kinds", kinds)], data)
    refused(esvr.UsageError, "has several images", path)
    assert np.array_equal(convert(path, option, 1).values, ramp() + 1000)


def test_mins_and_maxs_of_nrrd(tmp_path):
    fields = [("dimension", "3"), ("sizes", "6 5 4"), ("axis mins", "-3 0 10"), ("axis maxs", "0 2.5 18")]
    made = convert(nrrd(tmp_path / "a.nrrd", fields + [("centers", "cell cell cell")], ramp()))
    assert np.allclose(made.spacing, [0.5, 0.5, 2]) and np.allclose(made.matrix[:3, 3], [-2.75, 0.25, 11])
    made = convert(nrrd(tmp_path / "b.nrrd", [("dimension", "3"), ("sizes", "6 5 4"), ("axis mins", "0 0 0"), ("axis maxs", "5 2 6"),
                                              ("centers", "node node node")], ramp()))
    assert np.allclose(made.spacing, [1, 0.5, 2]) and np.allclose(made.matrix[:3, 3], 0)


def test_skips_of_nrrd(tmp_path):
    (tmp_path / "a.raw").write_bytes(b"one line\nanother\nxyz" + ramp().tobytes())
    head = "NRRD0004\ntype: ushort\ndimension: 3\nsizes: 6 5 4\nendian: little\nencoding: raw\n"
    (tmp_path / "a.nhdr").write_text(head + "line skip: 2\nbyte skip: 3\ndata file: a.raw\n")
    assert np.array_equal(convert(tmp_path / "a.nhdr").values, ramp())
    (tmp_path / "b.nhdr").write_text(head + "byte skip: -1\ndata file: a.raw\n")
    assert np.array_equal(convert(tmp_path / "b.nhdr").values, ramp())


def test_lists_of_files_of_nrrd(tmp_path):
    volumes = np.stack([ramp(), ramp() + 1000])
    for t, volume in enumerate(volumes):
        (tmp_path / f"v{t}.gz").write_bytes(gzip.compress(volume.tobytes()))
        for z, page in enumerate(volume):
            (tmp_path / f"s{t}{z}").write_bytes(page.tobytes())
    head = "NRRD0004\ntype: ushort\nendian: little\ndimension: 4\nsizes: 6 5 4 2\nkinds: domain domain domain time\nencoding: "
    (tmp_path / "a.nhdr").write_text(head + "gzip\ndata file: LIST 3\nv0.gz\nv1.gz\n")
    (tmp_path / "b.nhdr").write_text(head + "raw\ndata file: LIST 2\n" + "".join(f"s{t}{z}\n" for t in range(2) for z in range(4)))
    for name in "a.nhdr", "b.nhdr":
        assert np.array_equal(convert(tmp_path / name, "--time", 1).values, volumes[1])
    # Each file may have several of the slices.
    (tmp_path / "c.nhdr").write_text("NRRD0004\ntype: ushort\nendian: little\ndimension: 3\nsizes: 6 5 8\nencoding: gzip\n"
                                     "data file: LIST 3\nv0.gz\nv1.gz\n")
    assert np.array_equal(convert(tmp_path / "c.nhdr").values, volumes.reshape(8, 5, 6))


def test_segments_of_nrrd(tmp_path):
    path = nrrd(tmp_path / "a.seg.nrrd", [("dimension", "3"), ("sizes", "6 5 4"), ("space", "LPS"), ("space directions",
                "(1,0,0) (0,1,0) (0,0,1)")], ramp())
    path.write_bytes(path.read_bytes().replace(b"\n\n", b"\nSegment0_Name:=liver\nSegment0_LabelValue:=1\n\n", 1))
    assert convert(path).grid.metadata["image_segments"] == "1: liver"


# -- NIfTI -------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("slope, intercept, first", [(0.5, 10.0, 10.5), (0.0, 5.0, 1.0), (float("nan"), 5.0, 1.0), (-2.0, 0.0, -2.0)])
def test_slopes_of_nifti(tmp_path, slope, intercept, first):
    path = nifti(tmp_path / "a.nii", ramp("i2"), lambda h: struct.pack_into("<ff", h, 112, slope, intercept))
    assert convert(path).values[0, 0, 0] == first
    assert convert(path, "--stored").values[0, 0, 0] == 1


def test_forms_of_nifti(tmp_path):
    both = nifti(tmp_path / "both.nii", ramp("i2"), lambda h: struct.pack_into("<hh", h, 252, 1, 2))
    made = convert(both)
    assert np.allclose(made.matrix, tilted()) and any("sform" in note for note in made.notes)
    neither = nifti(tmp_path / "none.nii", ramp("i2"), lambda h: struct.pack_into("<hh", h, 252, 0, 0))
    assert np.allclose(convert(neither).matrix, np.diag([0.5, 0.75, 2, 1]))
    sheared = tilted()
    sheared[:3, 2] += sheared[:3, 0]
    assert np.allclose(convert(nifti(tmp_path / "sheared.nii", ramp("i2"), matrix=sheared)).matrix, sheared, atol=1e-5)


@pytest.mark.parametrize("code, by", [(1, 1000.0), (2, 1.0), (3, 0.001), (0, 1.0)])
def test_units_of_nifti(tmp_path, code, by):
    path = nifti(tmp_path / "a.nii", ramp("i2"), lambda h: struct.pack_into("<B", h, 123, code))
    made = convert(path)
    assert np.allclose(made.spacing, np.array([0.5, 0.75, 2]) * by) and made.unit == "mm"


def test_axes_of_nifti(tmp_path):
    path = nifti(tmp_path / "a.nii", ramp("i2"), lambda h: struct.pack_into("<8h", h, 40, 3, 6, 5, 4, 5, 1, 1, 1))
    assert np.array_equal(convert(path).values, ramp())
    times = nifti(tmp_path / "t.nii", np.stack([ramp("i2"), ramp("i2") + 1000]))
    refused(esvr.UsageError, "time: 2; choose by --time", times)


def test_names_members_and_zeros_behind(tmp_path):
    values = np.random.default_rng(1).integers(0, 9999, (40, 50, 60)).astype("i2")
    data = nifti(tmp_path / "a.nii", values).read_bytes()
    packed = b"".join(gzip.compress(data[at:at + 60000], 1) for at in range(0, len(data), 60000)) + bytes(512)
    for name in "b.nii.gz", "b.nii", "scan":  # bgzip makes several members, tapes have zeros behind
        (tmp_path / name).write_bytes(packed)
        assert np.array_equal(convert(tmp_path / name).values, values)


# -- TIFF --------------------------------------------------------------------------------------------------------------
def test_pages_of_several_calls(tmp_path, tifffile):
    with tifffile.TiffWriter(tmp_path / "a.tif") as file:
        for page in ramp():
            file.write(page, contiguous=False)
    assert np.array_equal(convert(tmp_path / "a.tif").values, ramp())


@pytest.mark.parametrize("unit, mm", [("CENTIMETER", 10.0), ("INCH", 25.4)])
def test_resolutions(tmp_path, unit, mm):
    made = convert(tiff(tmp_path / "a.tif", ramp(), resolution=(20, 40), resolutionunit=unit))
    assert np.allclose(made.spacing, [mm / 20, mm / 40, mm / 20]) and made.unit == "mm"
    assert any("distance of slices" in text for text in made.warnings)
    made = convert(tiff(tmp_path / "b.tif", ramp(), resolution=(20, 40), resolutionunit="NONE"))
    assert np.allclose(made.spacing, [1, 0.5, 1]) and made.unit is None


@pytest.mark.parametrize("orientation, turned", [(1, np.s_[:, :]), (2, np.s_[:, ::-1]), (3, np.s_[::-1, ::-1]), (4, np.s_[::-1, :])])
def test_orientations(tmp_path, orientation, turned):
    path = tiff(tmp_path / "a.tif", ramp()[0], extratags=[(274, "H", 1, orientation, True)])
    assert np.array_equal(convert(path).values[0], ramp()[0][turned])


def test_orientation_with_rows_as_columns_is_refused(tmp_path):
    path = tiff(tmp_path / "a.tif", ramp()[0], extratags=[(274, "H", 1, 6, True)])
    refused(esvr.BadInput, "orientation 6", path)


def test_white_is_least_and_colors(tmp_path):
    assert np.array_equal(convert(tiff(tmp_path / "w.tif", ramp(), photometric="miniswhite")).values, ramp())
    colors = np.stack([ramp()[0] + 1000 * k for k in range(3)], axis=-1)
    path = tiff(tmp_path / "c.tif", colors, photometric="rgb")
    refused(esvr.UsageError, "sample: 3", path)
    assert np.array_equal(convert(path, "--channel", 2).values[0], ramp()[0] + 2000)


def test_big_endian_floats_with_a_predictor_are_refused(tmp_path):
    geotiff(tmp_path / "a.tif", ramp("f4")[:1], "COMPRESS=LZW", "PREDICTOR=3", "ENDIANNESS=BIG")
    refused(esvr.BadInput, "big-endian order with predictor 3", tmp_path / "a.tif")


def test_units_and_origins_of_imagej(tmp_path):
    path = tiff(tmp_path / "a.tif", ramp(), imagej=True, resolution=(2, 4), metadata={
        "axes": "ZYX", "spacing": 3, "unit": "mm", "zunit": "cm", "xorigin": 10, "zorigin": -1})
    made = convert(path)
    assert np.allclose(made.matrix, [[0.5, 0, 0, -5], [0, 0.25, 0, 0], [0, 0, 30, 30], [0, 0, 0, 1]])


@pytest.mark.parametrize("order", ["XYCZT", "XYZCT"])
@pytest.mark.parametrize("prefix", ["", "ome:"])
def test_ome_without_tiffdata(tmp_path, order, prefix):
    xmlns = f"xmlns{':ome' if prefix else ''}=\"http://www.openmicroscopy.org/Schemas/OME/2016-06\""
    text = (f'<?xml version="1.0" encoding="UTF-8"?><{prefix}OME {xmlns}><{prefix}Image ID="Image:0"><{prefix}Pixels ID="Pixels:0" '
            f'DimensionOrder="{order}" Type="uint16" SizeX="6" SizeY="5" SizeZ="4" SizeC="2" SizeT="1" PhysicalSizeX="0.5" '
            f'PhysicalSizeZ="2"></{prefix}Pixels></{prefix}Image></{prefix}OME>')
    data = np.stack([ramp(), ramp() + 1000], axis=1 if order == "XYCZT" else 0).reshape(8, 5, 6)
    made = convert(tiff(tmp_path / "a.ome.tif", data, description=text), "--channel", 1, "--unit", "um")
    assert np.array_equal(made.values, ramp() + 1000) and np.allclose(made.spacing, [0.5, 0.5, 2])


def test_axes_of_scifio(tmp_path):
    text = "SCIFIO=0.46.0\naxes=X,Y,Z,Channel\nlengths=6,5,4,2\nscales=0.5,0.25,2.0,1.0\nunits=um,um,um,null\nbitsPerPixel=16\n"
    data = np.concatenate([ramp(), ramp() + 1000])
    path = tiff(tmp_path / "a.tif", data, description=text)
    made = convert(path, "--channel", 1, "--unit", "um")
    assert np.array_equal(made.values, ramp() + 1000) and np.allclose(made.spacing, [0.5, 0.25, 2])


@pytest.fixture
def slices(tmp_path):
    for k, page in enumerate(np.concatenate([ramp(), ramp() + 400, ramp() + 800]), 1):
        tiff(tmp_path / f"ct_{k}.tif", page)
    return tmp_path


def test_every_slice_counts(slices):
    made = convert(slices)
    assert np.array_equal(made.values[:, 0, 0], [1, 101, 201, 301, 401, 501, 601, 701, 801, 901, 1001, 1101])
    assert np.array_equal(convert(slices / "ct_%d.tif").values, made.values)
    refused(esvr.BadInput, "matches 3 files, but 9 more", slices / "ct_##.tif")
    given = convert(*[slices / f"ct_{k}.tif" for k in (2, 1, 3)])
    assert np.array_equal(given.values[:, 0, 0], [101, 1, 201]) and any("order given" in text for text in given.warnings)
    (slices / "ct_5.tif").unlink()
    refused(esvr.BadInput, "slice 5 is missing", slices / "ct_%d.tif")


def test_slices_of_different_size_are_named(slices):
    tiff(slices / "ct_7.tif", ramp()[0][:, :5])
    refused(esvr.BadInput, r"ct_7.tif has 5 x 5 pixels .*ct_1.tif has 6 x 5", slices)


# -- MRC ---------------------------------------------------------------------------------------------------------------
def test_bytes_of_mrc(tmp_path):
    data = (ramp() % 256).astype("u1").view("i1")
    assert np.array_equal(convert(mrc(tmp_path / "a.mrc", data)).values, data)
    path = mrc(tmp_path / "b.mrc", data)
    raw = bytearray(path.read_bytes())
    struct.pack_into("<II", raw, 152, 1146047817, 0)  # IMOD's stamp without the flag of signed bytes
    path.write_bytes(raw)
    assert np.array_equal(convert(path).values, data.view("u1"))


def test_big_endian_and_stacks_of_mrc(tmp_path, mrcfile):
    assert np.array_equal(convert(mrc(tmp_path / "a.mrc", ramp("i2"), ">")).values, ramp())
    with mrcfile.new(tmp_path / "s.mrcs") as file:
        file.set_data(np.stack([ramp("f4"), ramp("f4") + 1000]))
    assert np.array_equal(convert(tmp_path / "s.mrcs", "--channel", 1).values, ramp() + 1000)


def test_no_cell_of_mrc(tmp_path):
    made = convert(mrc(tmp_path / "a.mrc", ramp("i2"), voxel_size=0.0))
    assert np.allclose(made.spacing, 1) and made.unit is None


# -- MetaImage -----------------------------------------------------------------------------------------------------------
BASE = {"ObjectType": "Image", "NDims": 3, "DimSize": "6 5 4", "ElementType": "MET_USHORT", "ElementSpacing": "0.5 0.75 2"}


def test_values_of_metaimage(tmp_path):
    fields = {**BASE, "ElementToIntensityFunctionSlope": 2, "ElementToIntensityFunctionOffset": -1000}
    assert convert(metaimage(tmp_path / "a.mha", fields, ramp().tobytes())).values[0, 0, 0] == -998
    packed = zlib.compress(ramp(">u2").tobytes())
    fields = {**BASE, "CompressedData": True, "CompressedDataSize": len(packed), "BinaryDataByteOrderMSB": True}
    assert np.array_equal(convert(metaimage(tmp_path / "b.mha", fields, packed)).values, ramp())


def test_metaimage_as_text(tmp_path):
    text = " ".join(map(str, ramp("i2").ravel() - 200)).encode()
    made = convert(metaimage(tmp_path / "a.mha", {**BASE, "ElementType": "MET_SHORT", "BinaryData": False}, text))
    assert np.array_equal(made.values, ramp("i2") - 200)


def test_lists_and_channels_of_metaimage(tmp_path):
    for k, page in enumerate(ramp()):
        (tmp_path / f"s{k}.raw").write_bytes(page.tobytes())
    (tmp_path / "a.mhd").write_text("\n".join(f"{k} = {v}" for k, v in BASE.items()) + "\nElementDataFile = LIST\n" +
                                    "\n".join(f"s{k}.raw" for k in range(4)) + "\n")
    assert np.array_equal(convert(tmp_path / "a.mhd").values, ramp())
    (tmp_path / "b.mhd").write_text("\n".join(f"{k} = {v}" for k, v in BASE.items()) + "\nElementDataFile = s%d.raw 0 3 1\n")
    assert np.array_equal(convert(tmp_path / "b.mhd").values, ramp())
    two = np.stack([ramp(), ramp() + 1000], axis=-1)
    path = metaimage(tmp_path / "c.mha", {**BASE, "ElementNumberOfChannels": 2}, two.tobytes())
    assert np.array_equal(convert(path, "--channel", 1).values, ramp() + 1000)
    for k, page in enumerate(two):
        (tmp_path / f"t{k}.raw").write_bytes(page.tobytes())
    (tmp_path / "d.mhd").write_text("\n".join(f"{k} = {v}" for k, v in {**BASE, "ElementNumberOfChannels": 2}.items()) +
                                    "\nElementDataFile = LIST 2\n" + "".join(f"t{k}.raw\n" for k in range(4)))
    assert np.array_equal(convert(tmp_path / "d.mhd", "--channel", 1).values, ramp() + 1000)


@pytest.mark.parametrize("change", [{"ElementType": "MET_ASCII_CHAR"}, {"NDims": 5, "DimSize": "6 5 4 1 1"}, {"BinaryData": False},
                                    {"ObjectType": "Mesh"}, {"ElementType": "MET_UCHAR_ARRAY"}])
def test_other_kinds_of_metaimage_are_refused(tmp_path, change):
    refused(esvr.BadInput, "a.mha", metaimage(tmp_path / "a.mha", {**BASE, **change}, ramp().tobytes()))


# -- VTI -----------------------------------------------------------------------------------------------------------------
def vti(path, arrays, extent="0 5 0 4 0 3", group="PointData", active="", **attributes):
    pytest.importorskip("vtkmodules.vtkIOXML")
    said = {"Origin": "0 0 0", "Spacing": "0.5 0.75 2", **attributes}
    texts = "".join(f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{data.shape[3] if data.ndim == 4 else 1}" '
                    f'format="ascii">{" ".join(map(str, data.ravel()))}</DataArray>' for name, kind, data in arrays)
    path.write_text(f'<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian"><ImageData WholeExtent="{extent}" '
                    + " ".join(f'{k}="{v}"' for k, v in said.items()) + f'><Piece Extent="{extent}"><{group}{active}>{texts}</{group}>'
                    "</Piece></ImageData></VTKFile>")
    return path


def test_arrays_of_vti(tmp_path):
    path = vti(tmp_path / "a.vti", [("a", "UInt16", ramp()), ("b", "Int64", ramp("i8") + 2 ** 40)])
    refused(esvr.UsageError, r"several arrays: a \(points\), b \(points\)", path)
    made = convert(path, "--dataset", "b")
    assert made.grid.value_type == "int64" and np.array_equal(made.values, ramp("i8") + 2 ** 40)
    active = vti(tmp_path / "b.vti", [("a", "UInt16", ramp()), ("b", "UInt16", ramp() + 1)], active=' Scalars="b"')
    assert convert(active).values[0, 0, 0] == 2


def test_points_without_a_value_of_vti(tmp_path):
    """As ParaView writes a mesh that is resampled."""
    valid = np.ones((4, 5, 6), "i1")
    valid[0, 0, :2] = 0
    for kind, data in (("Int16", ramp("i2")), ("Float32", np.stack([ramp("f4")] * 3, axis=-1))):
        made = convert(vti(tmp_path / "a.vti", [("a", kind, data), ("vtkValidPointMask", "Int8", valid), (
            "vtkGhostType", "UInt8", 2 - 2 * valid)]))
        assert made.missing == 2 and np.array_equal(made.active, valid == 1) and np.array_equal(made.values[3], data[3])


def test_cells_and_extents_of_vti(tmp_path):
    direction = "0 -1 0 1 0 0 0 0 1"
    made = convert(vti(tmp_path / "a.vti", [("a", "UInt16", ramp())], "2 8 0 5 0 4", "CellData", Direction=direction, Origin="1 2 3"))
    assert np.array_equal(made.values, ramp())
    first = np.array([[0, -0.75, 0], [0.5, 0, 0], [0, 0, 2]]) @ [2.5, 0.5, 0.5] + [1, 2, 3]
    assert np.allclose(made.matrix[:3, 3], first)


# -- HDF5 and netCDF -------------------------------------------------------------------------------------------------------
@pytest.fixture
def weather(tmp_path):
    numbers = iter(range(100))  # the library locks files that are open

    def write(kind="i2", data=None, name="t", group=None, fill=None, form="NETCDF4", coordinates=None, **attributes):
        path = tmp_path / f"{next(numbers)}.nc"
        with netcdf_file(path, form=form) as file:
            where = file.createGroup(group) if group else file
            for dim, (places, unit) in (coordinates or {}).items():
                variable = file.createVariable(dim, "f8", (dim,))
                variable[:], variable.units = places, unit
            variable = where.createVariable(name, kind, ("z", "y", "x"), fill_value=fill)
            variable.set_auto_maskandscale(False)
            for key, value in attributes.items():
                variable.setncattr(key, value)
            if data is not False:
                variable[:] = ramp(kind) if data is None else data
        return path
    return write


def inactive(made):
    return sorted(ramp()[~made.active].tolist())


@pytest.mark.parametrize("form", ["NETCDF4", "NETCDF3_CLASSIC"])
def test_missing_values_of_netcdf(weather, form):
    assert inactive(convert(weather(fill=np.int16(1), form=form))) == [1]
    assert inactive(convert(weather(fill=np.int16(1), form=form, missing_value=np.int16(2)))) == [1, 2]
    assert inactive(convert(weather(form=form, valid_range=np.array([3, 344], "i2")))) == [1, 2, 345, 346]
    assert inactive(convert(weather(form=form, valid_max=np.int16(344)))) == [345, 346]
    assert inactive(convert(weather(form=form, scale_factor=0.5, add_offset=1.0, valid_range=np.array([2.5, 172.5])))) == [
        1, 2, 344, 345, 346]
    assert inactive(convert(weather(form=form, scale_factor=-0.1, add_offset=1.0, valid_min=-33.4))) == [345, 346]
    made = convert(weather(fill=np.int16(1), form=form), "--stored")
    assert made.active.all() and made.values[0, 0, 0] == 1


def test_unsigned_bytes_of_netcdf(weather):
    data = (ramp() % 256).astype("u1")
    for form in "NETCDF4", "NETCDF3_CLASSIC":
        made = convert(weather("i1", data.view("i1"), form=form, fill=np.int8(-1), _Unsigned="true"))
        assert made.missing == (data == 255).sum()
        assert np.array_equal(made.values[made.active], data[made.active])


def test_numbers_that_were_written_are_not_missing(weather):
    data = ramp("i2")
    data[0, 0, 0] = -32767
    made = convert(weather(data=data))
    assert made.missing == 0 and made.values[0, 0, 0] == -32767
    made = convert(weather("f4", False))
    assert made.missing == 120 and not made.active.any()


def test_labels_times_and_groups_of_netcdf(weather):
    labels = ramp("i8") + 2 ** 60
    made = convert(weather("i8", labels, fill=np.int64(labels[0, 0, 0])))
    assert made.grid.value_type == "int64" and made.missing == 1 and np.array_equal(made.values[made.active], labels[made.active])
    assert convert(weather("f4", units="days since 0000-01-01")).values[0, 0, 0] == 1
    assert convert(weather("f4", units="seconds", calendar="none")).values[0, 0, 0] == 1
    assert convert(weather("f4", group="model/run")).values[3, 4, 5] == 346


def test_truth_and_complex_values_that_netcdf_leaves_out(tmp_path, h5py):
    pytest.importorskip("netCDF4")
    with h5py.File(tmp_path / "a.nc", "w") as file:
        file["mask"] = ramp() > 200
    made = convert(tmp_path / "a.nc")
    assert made.grid.value_type == "bool" and np.array_equal(made.values, ramp() > 200)
    with h5py.File(tmp_path / "b.nc", "w") as file:
        file["c"] = ramp("c8")
    refused(esvr.BadInput, "b.nc", tmp_path / "b.nc")
    with h5py.File(tmp_path / "c.h5", "w") as file:
        file["c"] = ramp("c8")
    refused(esvr.BadInput, "c.h5", tmp_path / "c.h5", "--dataset", "c")


def test_coordinates_of_two_dimensions(tmp_path):
    with netcdf_file(tmp_path / "a.nc") as file:
        file.createVariable("x", "f4", ("y", "x"))[:] = ramp()[0]
        file.createVariable("t", "f4", ("z", "y", "x"))[:] = ramp()
    assert np.array_equal(convert(tmp_path / "a.nc").values, ramp())


def test_places_of_netcdf(weather):
    where = {"z": (np.arange(4) * 2.0, "m"), "y": (np.arange(5) * 0.75, "degrees_north"), "x": (np.arange(6) * 0.5, "degrees_east")}
    made = convert(weather("f4", coordinates=where))
    assert made.unit is None and np.allclose(made.spacing, [0.5, 0.75, 2])
    assert any("degrees_east, degrees_north, m" in text for text in made.warnings)
    where["z"] = (np.array([1000.0, 850, 500, 100]), "hPa")
    assert any("steps of the axis z differ" in text for text in convert(weather("f4", coordinates=where)).warnings)


def test_several_variables_are_listed(tmp_path):
    with netcdf_file(tmp_path / "a.nc") as file:
        for name in "uv":
            file.createVariable(name, "f4", ("z", "y", "x"))[:] = ramp() + (1000 if name == "v" else 0)
    refused(esvr.UsageError, r"several images: /u \(4 x 5 x 6 float32\), /v", tmp_path / "a.nc")
    assert convert(tmp_path / "a.nc", "--dataset", "v").values[0, 0, 0] == 1001


def test_members_and_bands_are_channels(tmp_path):
    """As ERA5 and rioxarray write them; a dimension that nobody knows is taken for the one of space that is left, with a warning."""
    for name in ("number", "band", "run"):
        with netcdf_file(tmp_path / f"{name}.nc", (name, "latitude", "longitude")) as file:
            file.createVariable("t", "f4", (name, "latitude", "longitude"))[:] = ramp()
    for name in ("number", "band"):
        refused(esvr.UsageError, f"{name}: 4; choose by --channel", tmp_path / f"{name}.nc")
        assert np.array_equal(convert(tmp_path / f"{name}.nc", "--channel", 2).values, ramp()[2:3])
    assert convert(tmp_path / "run.nc").warnings == ["the axis run is taken for z (--axes names the axes)"]


def test_what_matlab_keeps_for_itself(tmp_path):
    with pytest.importorskip("h5py").File(tmp_path / "a.mat", "w", userblock_size=512) as file:
        file["volume"], file["#refs#/a"] = ramp(), ramp() + 1
    assert np.array_equal(convert(tmp_path / "a.mat").values, ramp())


def test_dimensions_in_any_order(tmp_path):
    with netcdf_file(tmp_path / "a.nc", ("lev", "lat", "lon")) as file:
        file.createVariable("t", "f4", ("lon", "lat", "lev"))[:] = ramp().transpose(2, 1, 0)
    assert np.array_equal(convert(tmp_path / "a.nc").values, ramp())
    with pytest.importorskip("h5py").File(tmp_path / "a.h5", "w") as file:
        data = file.create_dataset("d", data=np.stack([ramp(), ramp() + 1000], axis=-1))
        for k, label in enumerate("zyxc"):
            data.dims[k].label = label
    assert np.array_equal(convert(tmp_path / "a.h5", "--channel", 1).values, ramp() + 1000)


@pytest.mark.parametrize("array, program", [("minc-2.0/image/0/image", "MINC"), ("ITKImage/0/VoxelData", "ITK"), (
    "DataSet/ResolutionLevel 0/TimePoint 0/Channel 0/Data", "Imaris")])
def test_formats_within_hdf5_are_refused(tmp_path, array, program):
    with pytest.importorskip("h5py").File(tmp_path / "a.h5", "w") as file:
        file[array] = ramp()
        file.require_group("DataSetInfo" if program == "Imaris" else "x")
    refused(esvr.BadInput, f"HDF5 file of {program}", tmp_path / "a.h5")


def test_axes_without_names_of_hdf5(tmp_path, h5py):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["a"] = np.stack([ramp(), ramp() + 1000])
        file["a"].attrs["axistags"] = json.dumps({"axes": [{"key": key} for key in "czyx"]})
        file["b"] = np.stack([ramp(), ramp() + 1000])
    refused(esvr.UsageError, "by --axes", tmp_path / "a.h5", "--dataset", "b")
    assert np.array_equal(convert(tmp_path / "a.h5", "--dataset", "b", "--axes", "tzyx", "--time", 1).values, ramp() + 1000)
    assert np.array_equal(convert(tmp_path / "a.h5", "--dataset", "a", "--channel", 1).values, ramp() + 1000)


# -- Zarr ------------------------------------------------------------------------------------------------------------------
def test_zarr_3_is_named_and_not_written_into(tmp_path):
    pytest.importorskip("zarr")
    folder = tmp_path / "a.zarr"
    folder.mkdir()
    (folder / "zarr.json").write_text(json.dumps({"zarr_format": 3, "node_type": "group", "attributes": {}}))
    refused(esvr.BadInput, "Zarr folder of version 3", folder)
    assert [path.name for path in folder.iterdir()] == ["zarr.json"]


@pytest.mark.parametrize("separator", [".", "/"])
def test_chunks_elsewhere_are_refused(tmp_path, separator, zarr):
    zarr.open(str(tmp_path / "a.zarr"), mode="w", shape=(4, 5, 6), chunks=(2, 5, 6), dtype="u2", dimension_separator=separator)[:] = ramp()
    header = tmp_path / "a.zarr/.zarray"
    said = json.loads(header.read_text())
    said["dimension_separator"] = "." if separator == "/" else "/"
    header.write_text(json.dumps(said))
    refused(esvr.BadInput, "chunks are stored as", tmp_path / "a.zarr")


def test_missing_chunks(tmp_path, zarr):
    for fill in 7, None:
        folder = tmp_path / f"{fill}.zarr"
        zarr.open(str(folder), mode="w", shape=(4, 5, 6), chunks=(2, 5, 6), dtype="u2", fill_value=fill)[:] = ramp()
        (folder / "1.0.0").unlink()
        if fill is None:
            refused(esvr.BadInput, "1 of 2 chunks are missing", folder)
        else:
            made = convert(folder)
            assert np.all(made.values[2:] == 7) and np.array_equal(made.values[:2], ramp()[:2])
            assert any("1 of 2 chunks are not stored" in text for text in made.warnings)


def ome_zarr(folder, data, axes, transforms=(), dataset_transforms=()):
    zarr = pytest.importorskip("zarr")
    root = zarr.open_group(str(folder), mode="w")
    root.create_dataset("0", data=data, chunks=data.shape, dimension_separator="/")
    root.create_dataset("1", data=data[..., ::2, ::2], chunks=data.shape, dimension_separator="/")
    half = [{"type": "scale", "scale": [1.0] * (data.ndim - 2) + [2.0, 2.0]}]
    root.attrs["multiscales"] = [{"version": "0.4", "axes": axes, "coordinateTransformations": list(transforms), "datasets": [
        {"path": "0", "coordinateTransformations": list(dataset_transforms)}, {"path": "1", "coordinateTransformations": half}]}]
    return root


SPACE_AXES = [{"name": "z", "type": "space", "unit": "micrometer"}, {"name": "y", "type": "space", "unit": "nanometer"},
              {"name": "x", "type": "space", "unit": "nanometer"}]


def test_transformations_of_ome_zarr(tmp_path):
    ome_zarr(tmp_path / "a.zarr", ramp(), SPACE_AXES, [{"type": "scale", "scale": [2, 2, 2]}, {"type": "translation", "translation": [
        1, 0, 0]}], [{"type": "scale", "scale": [1, 250, 200]}, {"type": "translation", "translation": [0, 0, 50]}])
    made = convert(tmp_path / "a.zarr", "--unit", "um")
    assert np.array_equal(made.values, ramp())
    assert np.allclose(made.matrix, [[0.4, 0, 0, 0.1], [0, 0.5, 0, 0], [0, 0, 2, 1], [0, 0, 0, 1]])
    assert convert(tmp_path / "a.zarr", "--dataset", "1").grid.metadata["image_size"] == (3, 3, 4)


def test_channels_and_labels_of_ome_zarr(tmp_path):
    root = ome_zarr(tmp_path / "a.zarr", np.stack([ramp(), ramp() + 1000]), [{"name": "c", "type": "channel"}] + SPACE_AXES)
    root.attrs["omero"] = {"channels": [{"label": "DAPI"}, {"label": "GFP"}]}
    made = convert_all(tmp_path / "a.zarr", "--channel", "all")
    assert [m.grid.name for m in made] == ["DAPI", "GFP"] and np.array_equal(made[1].values, ramp() + 1000)
    refused(esvr.UsageError, r"channel: 2 \(DAPI, GFP\)|c: 2 \(DAPI, GFP\)", tmp_path / "a.zarr")


def test_arrays_of_zarr_are_listed(tmp_path, zarr):
    root = zarr.open_group(str(tmp_path / "a.zarr"), mode="w")
    for name in "ab":
        root.create_dataset(name, data=ramp())
    refused(esvr.UsageError, r"several images: /a \(4 x 5 x 6 uint16\), /b", tmp_path / "a.zarr")
    assert np.array_equal(convert(tmp_path / "a.zarr", "--dataset", "b").values, ramp())


# -- DICOM -----------------------------------------------------------------------------------------------------------------
def test_slices_are_sorted_by_position(tmp_path):
    names = ["z.dcm", "a.dcm", "m.dcm", "b.dcm"]

    def change(k, data):
        data.InstanceNumber = 10 - k
    made = convert(dicom(tmp_path / "s", ramp(), names=names, change=change))
    assert np.array_equal(made.values, ramp()) and np.allclose(made.matrix, tilted(), atol=1e-4)


def test_slopes_of_slices(tmp_path):
    def change(k, data):
        data.RescaleSlope, data.RescaleIntercept = k + 1, -1000
    made = convert(dicom(tmp_path / "s", ramp(), change=change))
    assert np.array_equal(made.values, ramp("i4") * np.arange(1, 5)[:, None, None] - 1000)


def test_gaps_are_named(tmp_path):
    folder = dicom(tmp_path / "s", np.concatenate([ramp(), ramp()]))
    (folder / "s3.dcm").unlink()
    refused(esvr.BadInput, r"s2.dcm and .*s4.dcm are 4 mm apart, and most others 2 mm", folder)
    assert np.allclose(convert(folder, "--voxel-size", 1).spacing, 1)


def test_series_are_named(tmp_path):
    def change(k, data):
        data.SeriesNumber, data.SeriesDescription = 7, "bone"
    (tmp_path / "s").mkdir()
    dicom(tmp_path / "s/1", ramp())
    dicom(tmp_path / "s/2", ramp() + 1000, change=change)
    refused(esvr.UsageError, r"2 series: 3 \(no description, 4 files\); 7 \(bone, 4 files\)", tmp_path / "s")
    assert np.array_equal(convert(tmp_path / "s", "--dataset", 7).values, ramp() + 1000)


def test_padding_and_unused_bits(tmp_path):
    def padded(k, data):
        data.add_new(0x00280120, "US", 1)
    made = convert(dicom(tmp_path / "p", ramp(), change=padded))
    assert made.missing == 1 and not made.active[0, 0, 0]

    def narrow(k, data):  # the four bits above hold an overlay
        data.BitsStored, data.HighBit = 12, 11
    assert np.array_equal(convert(dicom(tmp_path / "o", ramp() | 0x8000, change=narrow)).values, ramp())


def test_times_of_dicom(tmp_path):
    def change(k, data):
        data.InstanceNumber, data.TemporalPositionIdentifier = k + 101, 2
    folder = dicom(tmp_path / "s", ramp())
    first = next(folder.iterdir())
    uid = pytest.importorskip("pydicom").dcmread(first).SeriesInstanceUID

    def second(k, data):
        change(k, data)
        data.SeriesInstanceUID = uid
    dicom(folder, ramp() + 1000, change=second, names=[f"t{k}.dcm" for k in range(4)])
    refused(esvr.UsageError, "time: 2", folder)
    assert np.array_equal(convert(folder, "--time", 1).values, ramp() + 1000)


def test_sagittal_slices(tmp_path):
    matrix = np.array([[0, 0, 2.0, 3], [0.5, 0, 0, 4], [0, -0.75, 0, 5], [0, 0, 0, 1]])
    made = convert(dicom(tmp_path / "s", ramp(), matrix=matrix))
    assert np.array_equal(made.values, ramp()[::-1])  # the normal leads to the other side
    assert np.allclose(made.matrix, matrix @ [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, 3], [0, 0, 0, 1]], atol=1e-5)


def test_a_tilted_gantry_shears(tmp_path):
    matrix = np.diag([0.5, 0.75, 2.0, 1.0])
    matrix[1, 2] = 0.5
    made = convert(dicom(tmp_path / "s", ramp(), matrix=matrix))
    assert np.allclose(made.matrix, matrix, atol=1e-5)


def test_frames_of_one_file(tmp_path, pydicom):
    from pydicom.dataset import Dataset

    def change(k, data):
        data.NumberOfFrames, data.PixelData = 4, ramp()[::-1].tobytes()
        shared, data.PerFrameFunctionalGroupsSequence = Dataset(), pydicom.Sequence()
        measures, orientation, scale = Dataset(), Dataset(), Dataset()
        measures.PixelSpacing, orientation.ImageOrientationPatient = [0.75, 0.5], [1, 0, 0, 0, 1, 0]
        scale.RescaleSlope, scale.RescaleIntercept = 2, 1
        shared.PixelMeasuresSequence, shared.PlaneOrientationSequence = pydicom.Sequence([measures]), pydicom.Sequence([orientation])
        shared.PixelValueTransformationSequence = pydicom.Sequence([scale])
        data.SharedFunctionalGroupsSequence = pydicom.Sequence([shared])
        for k in range(4):
            position, frame = Dataset(), Dataset()
            position.ImagePositionPatient = [1, 2, 30 - 2.5 * k]
            frame.PlanePositionSequence = pydicom.Sequence([position])
            data.PerFrameFunctionalGroupsSequence.append(frame)
        del data.ImagePositionPatient, data.ImageOrientationPatient, data.PixelSpacing, data.RescaleSlope, data.RescaleIntercept
    made = convert(dicom(tmp_path / "s", ramp()[:1], change=change) / "s0.dcm")
    assert np.array_equal(made.values, ramp() * 2 + 1)
    assert np.allclose(made.matrix, [[-0.5, 0, 0, -1], [0, -0.75, 0, -2], [0, 0, 2.5, 22.5], [0, 0, 0, 1]])


def test_files_without_a_preamble(tmp_path, pydicom):
    folder = dicom(tmp_path / "s", ramp())
    for path in folder.iterdir():
        data = pydicom.dcmread(path)
        data.is_implicit_VR, data.preamble = True, None
        del data.file_meta
        pydicom.dcmwrite(path, data)
    made = convert(folder)
    assert np.array_equal(made.values, ramp()) and np.allclose(made.matrix, tilted(), atol=1e-4)


def test_films_and_doses(tmp_path):
    def film(k, data):
        data.NumberOfFrames, data.PixelData = 4, ramp().tobytes()
        del data.ImagePositionPatient, data.ImageOrientationPatient, data.PixelSpacing
    path = dicom(tmp_path / "film", ramp()[:1], change=film) / "s0.dcm"
    refused(esvr.UsageError, "time: 4", path)
    assert np.array_equal(convert(path, "--time", 2).values[0], ramp()[2])

    def dose(k, data):
        data.NumberOfFrames, data.PixelData, data.Modality = 4, ramp().tobytes(), "RTDOSE"
        data.GridFrameOffsetVector, data.DoseGridScaling = [0, 2.5, 5, 7.5], "0.5"
        data.ImagePositionPatient, data.ImageOrientationPatient = [1, 2, 3], [1, 0, 0, 0, 1, 0]
    made = convert(dicom(tmp_path / "dose", ramp()[:1], change=dose) / "s0.dcm")
    assert np.array_equal(made.values, ramp() * 0.5)
    assert np.allclose(made.matrix, [[-0.5, 0, 0, -1], [0, -0.75, 0, -2], [0, 0, 2.5, 3], [0, 0, 0, 1]])


def test_slices_without_positions(tmp_path):
    def change(k, data):
        del data.ImagePositionPatient
    made = convert(dicom(tmp_path / "s", ramp(), change=change, names=["z.dcm", "a.dcm", "b.dcm", "c.dcm"]))
    assert np.array_equal(made.values, ramp()) and any("instance numbers" in text for text in made.warnings)


# -- integers and masks ------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("kind, offset, expected", [("i4", 2 ** 24, "int32"), ("u4", 2 ** 31, "int64"), ("i8", 2 ** 60, "int64"),
                                                    ("u8", 2 ** 62, "int64"), ("i4", 0, "float"), ("u2", 0, "float")])
def test_integers_stay_what_they_are(tmp_path, kind, offset, expected):
    values = ramp(kind) + np.array(offset, kind)
    np.save(tmp_path / "a.npy", values)
    made = convert(tmp_path / "a.npy")
    assert made.grid.value_type == expected and np.array_equal(made.values.astype(kind), values)


def test_integers_that_no_grid_holds_are_refused(tmp_path):
    np.save(tmp_path / "a.npy", ramp("u8") + np.uint64(2 ** 63))
    refused(esvr.BadInput, "beyond 2\\^63", tmp_path / "a.npy")
    np.save(tmp_path / "b.npy", ramp("i4") + 2 ** 24)
    refused(esvr.BadInput, "beyond 2\\^24", tmp_path / "b.npy", "--as", "float")


def test_doubles_hold_larger_integers_and_fill_values_do_not_count(tmp_path):
    np.save(tmp_path / "a.npy", ramp("i8") + 2 ** 40)
    made = convert(tmp_path / "a.npy", "--as", "double")
    assert made.grid.value_type == "double" and np.array_equal(made.values, ramp("i8") + 2 ** 40)
    with netcdf_file(tmp_path / "a.nc") as file:
        file.createVariable("ids", "u8", ("z", "y", "x"), fill_value=2 ** 64 - 1)[:] = np.ma.MaskedArray(ramp("u8"), ramp() == 1)
    made = convert(tmp_path / "a.nc")
    assert made.grid.value_type == "int64" and made.missing == 1 and made.values[0, 0, 1] == 2


def test_masks_and_empty_masks(tmp_path):
    np.save(tmp_path / "a.npy", ramp() > 200)
    assert convert(tmp_path / "a.npy").grid.value_type == "bool"
    np.save(tmp_path / "b.npy", np.zeros((4, 5, 6), bool))
    assert convert(tmp_path / "b.npy").grid.active_voxels == 0
    np.save(tmp_path / "c.npy", np.zeros((4, 5, 6), "u1"))
    assert convert(tmp_path / "c.npy").grid.active_voxels == 0
    np.save(tmp_path / "d.npy", ramp())
    assert convert(tmp_path / "d.npy", "--as", "mask", "--threshold", 300).grid.active_voxels == 30


def test_voxels_that_are_not_finite(tmp_path):
    values = ramp("f4")
    values[1, 2, 3] = np.nan
    np.save(tmp_path / "a.npy", values)
    refused(esvr.BadInput, r"voxel \(3, 2, 1\) is not finite", tmp_path / "a.npy")
    assert convert(tmp_path / "a.npy", "--nonfinite", "zero").grid.active_voxels == 119
    made = convert(tmp_path / "a.npy", "--nonfinite", "missing")
    assert made.missing == 1 and not made.active[1, 2, 3] and made.grid.metadata["image_missing"]


# -- lengths -----------------------------------------------------------------------------------------------------------------
def test_units_are_millimetres_or_what_is_asked(tmp_path):
    path = nifti(tmp_path / "a.nii", ramp("i2"))
    assert np.allclose(convert(path, "--unit", "cm").spacing, [0.05, 0.075, 0.2])
    refused(esvr.UsageError, "no unit of length", path, "--unit", "parsec")
    small = mrc(tmp_path / "a.mrc", ramp("i2"), voxel_size=1.5)
    made = convert(small)
    assert made.unit == "um" and np.allclose(made.spacing, 1.5e-4)


def test_the_program_writes_frames_and_channels(tmp_path):
    nifti(tmp_path / "t.nii", np.stack([ramp("i2"), ramp("i2") + 1000]))
    done = run("image2vdb", tmp_path / "t.nii", tmp_path / "o.##.vdb", "--time", "all")
    assert done.returncode == 0, done.stderr
    assert sorted(path.name for path in tmp_path.glob("o.*")) == ["o.00.vdb", "o.01.vdb"]
    done = run("image2vdb", tmp_path / "t.nii", tmp_path / "o.vdb", "--time", "all")
    assert done.returncode == 2 and "OUT.####.vdb" in done.stderr
