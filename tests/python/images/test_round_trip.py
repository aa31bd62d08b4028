"""An image becomes a VDB, a lossless ESVR and an image again that is equal in values, type, matrix and units, as other readers
see it."""
import os
import shutil
import subprocess

import numpy as np
import pytest

import esvr
from esvr.images import image2vdb, vdb2image
from esvr.images.image import LPS_TO_RAS

from conversions import convert, dicom, metaimage, mrc, netcdf_file, ramp, run_here, tiff, tilted, vtk_image

BOX = np.diag([0.5, 0.75, 2.0, 1.0])


# Readers that are not ours: each gives the array (axes z, y, x), the matrix in RAS or the world of the file, and the unit.
def by_nibabel(path):
    image = pytest.importorskip("nibabel").load(path)
    return np.asarray(image.dataobj).transpose(2, 1, 0), image.affine, {"micron": "um"}.get(image.header.get_xyzt_units()[0], "mm")


def by_mrcfile(path):
    with pytest.importorskip("mrcfile").open(path) as file:
        size, origin = file.voxel_size, file.header.origin
        matrix = np.diag([float(size.x), float(size.y), float(size.z), 1.0])
        matrix[:3, 3] = float(origin.x), float(origin.y), float(origin.z)
        return file.data.copy(), matrix, "angstrom"


def by_tifffile(path):
    with pytest.importorskip("tifffile").TiffFile(path) as file:
        if file.is_ome:
            import xml.etree.ElementTree as tree
            pixels = next(e for e in tree.fromstring(file.ome_metadata).iter() if e.tag.endswith("Pixels"))
            spacing = [float(pixels.get(f"PhysicalSize{axis}")) for axis in "XYZ"]
            unit = pixels.get("PhysicalSizeXUnit")
        else:
            up = [file.pages[0].tags[name].value for name in ("XResolution", "YResolution")]
            spacing = [up[0][1] / up[0][0], up[1][1] / up[1][0], file.imagej_metadata["spacing"]]
            unit = file.imagej_metadata.get("unit")
        return file.asarray(), np.diag([*spacing, 1.0]), {"µm": "um", "micron": "um"}.get(unit, unit)


def by_teem(path):
    if not shutil.which("teem-unu"):
        pytest.skip("teem-unu is missing (Debian: teem-apps)")
    raw = path.with_suffix(".raw.nhdr")
    subprocess.run(["teem-unu", "save", "-i", str(path), "-f", "nrrd", "-e", "raw", "-o", str(raw)], check=True, capture_output=True)
    fields = dict(line.split(": ", 1) for line in raw.read_text().splitlines() if ": " in line)
    kind = {"unsigned char": "u1", "short": "i2", "unsigned short": "u2", "int": "i4", "long long int": "i8", "float": "f4",
            "double": "f8"}[fields["type"]]
    shape = [int(n) for n in fields["sizes"].split()][::-1]
    matrix = np.eye(4)
    matrix[:3, :3] = np.array([[float(n) for n in vector.strip("()").split(",")] for vector in fields["space directions"].split()]).T
    matrix[:3, 3] = [float(n) for n in fields["space origin"].strip("()").split(",")]
    if fields.get("space") == "left-posterior-superior":
        matrix = LPS_TO_RAS @ matrix
    return np.fromfile(raw.with_name(fields["data file"]), kind).reshape(shape), matrix, fields.get("space units", "").split('"')[1]


def by_netcdf(path):
    with pytest.importorskip("netCDF4").Dataset(path) as file:
        name = next(n for n in file.variables if n not in "xyz")
        matrix = np.eye(4)
        for k, axis in enumerate("xyz"):
            places = file[axis][:]
            matrix[k, k], matrix[k, 3] = places[1] - places[0], places[0]
        return file[name][:], matrix, getattr(file["x"], "units", None)


def by_vtk(path):
    xml = pytest.importorskip("vtkmodules.vtkIOXML")
    from vtkmodules.util.numpy_support import vtk_to_numpy
    reader = xml.vtkXMLImageDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    data = reader.GetOutput()
    array = data.GetPointData().GetArray(0)
    x, y, z = data.GetDimensions()
    matrix = np.eye(4)
    direction = data.GetDirectionMatrix()
    matrix[:3, :3] = np.array([[direction.GetElement(r, c) for c in range(3)] for r in range(3)]) * data.GetSpacing()
    matrix[:3, 3] = data.GetOrigin()
    unit = data.GetFieldData().GetAbstractArray("length_unit").GetValue(0)
    return vtk_to_numpy(array).reshape(z, y, x), matrix, unit


def by_hand(path):
    """MetaImage, as ITK defines it."""
    head, _, data = path.read_bytes().partition(b"ElementDataFile = LOCAL\n")
    fields = dict(line.split(" = ") for line in head.decode().splitlines())
    numbers = {key: np.array(fields[key].split(), float) for key in ("TransformMatrix", "Offset", "ElementSpacing")}
    matrix = np.eye(4)
    matrix[:3, :3] = numbers["TransformMatrix"].reshape(3, 3).T * numbers["ElementSpacing"]
    matrix[:3, 3] = numbers["Offset"]
    kind = {"MET_USHORT": "u2", "MET_SHORT": "i2", "MET_FLOAT": "f4", "MET_LONG_LONG": "i8", "MET_UCHAR": "u1"}[fields["ElementType"]]
    return np.frombuffer(data, kind).reshape([int(n) for n in fields["DimSize"].split()][::-1]), LPS_TO_RAS @ matrix, "mm"


def by_numpy(path):
    return np.load(path), None, None


# Writers that are not ours.
def write_nifti(path, values):
    nibabel = pytest.importorskip("nibabel")
    image = nibabel.Nifti1Image(values.transpose(2, 1, 0), tilted() @ np.diag([-1, 1, 1, 1]), dtype=values.dtype)
    image.header.set_xyzt_units("micron")
    nibabel.save(image, path)


def write_nrrd(path, values):
    matrix = LPS_TO_RAS @ tilted()
    vectors = " ".join(f"({','.join(map(repr, matrix[:3, k]))})" for k in range(3))
    kind = {"uint16": "ushort", "float32": "float", "int64": "longlong", "int16": "short"}[values.dtype.name]
    path.write_bytes((f"NRRD0005\ntype: {kind}\ndimension: 3\nspace: left-posterior-superior\nsizes: 6 5 4\nspace directions: "
                      f"{vectors}\nspace origin: ({','.join(map(repr, matrix[:3, 3]))})\nspace units: \"mm\" \"mm\" \"mm\"\n"
                      "endian: little\nencoding: raw\n\n").encode() + values.tobytes())


def write_meta(path, values):
    matrix = LPS_TO_RAS @ tilted()
    spacing = np.linalg.norm(matrix[:3, :3], axis=0)
    kind = {"uint16": "USHORT", "float32": "FLOAT", "int64": "LONG_LONG", "int16": "SHORT"}[values.dtype.name]
    vectors = {"TransformMatrix": (matrix[:3, :3] / spacing).T.ravel(), "Offset": matrix[:3, 3], "ElementSpacing": spacing}
    metaimage(path, {"NDims": 3, "DimSize": "6 5 4", **{key: " ".join(map(repr, vector)) for key, vector in vectors.items()},
                     "ElementType": f"MET_{kind}"}, values.tobytes())


def write_mrc(path, values):
    mrc(path, values, voxel_size=(1.5, 2.5, 4.0), origin=(10, 20, 30))


def write_imagej(path, values):
    pytest.importorskip("tifffile").imwrite(path, values, imagej=True, resolution=(2, 4), metadata={
        "axes": "ZYX", "spacing": 3.0, "unit": "micron"})


def write_ome(path, values):
    pytest.importorskip("tifffile").imwrite(path, values, ome=True, photometric="minisblack", metadata={
        "axes": "ZYX", "PhysicalSizeX": 0.299, "PhysicalSizeY": 0.299, "PhysicalSizeZ": 1.0,
        **{f"PhysicalSize{axis}Unit": "µm" for axis in "XYZ"}})


def write_netcdf(path, values):
    with netcdf_file(path) as file:
        for dim, size, step in zip("zyx", (4, 5, 6), (2.0, -0.75, 0.5)):
            axis = file.createVariable(dim, "f8", (dim,))
            axis.units = "km"
            axis[:] = 7 + step * np.arange(size)
        file.createVariable("t", values.dtype, ("z", "y", "x"))[:] = values


def write_vti(path, values):
    xml = pytest.importorskip("vtkmodules.vtkIOXML")
    from vtkmodules.vtkCommonCore import vtkStringArray
    image, array = vtk_image(values)
    image.GetPointData().SetScalars(array)
    unit = vtkStringArray()
    unit.SetName("length_unit")
    unit.InsertNextValue("um")
    image.GetFieldData().AddArray(unit)
    writer = xml.vtkXMLImageDataWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(image)
    writer.Write()


def write_npy(path, values):
    np.save(path, values)


FORMATS = {"nii.gz": (write_nifti, by_nibabel, ["int16", "uint16", "float32", "int64"]),
           "nrrd": (write_nrrd, by_teem, ["int16", "uint16", "float32", "int64"]),
           "mha": (write_meta, by_hand, ["int16", "uint16", "float32", "int64"]), "mrc": (write_mrc, by_mrcfile, ["int16", "float32"]),
           "tif": (write_imagej, by_tifffile, ["uint16", "float32"]), "ome.tif": (write_ome, by_tifffile, ["int16", "uint16", "int32"]),
           "nc": (write_netcdf, by_netcdf, ["int16", "float32", "int64"]), "vti": (write_vti, by_vtk, ["int16", "float32", "int64"]),
           "npy": (write_npy, by_numpy, ["uint8", "bool", "float16", "float32", "int64"])}
CASES = [(ending, kind, "vdb") for ending, (_, _, kinds) in FORMATS.items() for kind in kinds] + [
    (ending, kind, "esvr") for ending, (_, _, kinds) in FORMATS.items() for kind in (kinds[0], kinds[-1])]


def values_of(kind):
    if kind == "bool":
        return ramp() > 200
    if kind == "int64":
        return ramp("i8") + 2 ** 60
    return (ramp() % 200).astype(kind) if kind == "uint8" else ramp(kind)


@pytest.mark.parametrize("ending, kind, way", CASES)
def test_images_come_back(tmp_path, ending, kind, way, run):
    write, read, _ = FORMATS[ending]
    source, back, vdb, stored = (tmp_path / name for name in (f"a.{ending}", f"back.{ending}", "a.vdb", "a.esvr"))
    write(source, values_of(kind))
    assert run_here(image2vdb, source, vdb) == 0
    if way == "esvr":
        run("vdb2esvr", vdb, stored, "--lossless", "--device", "cpu", "-q")
    assert run_here(vdb2image, vdb if way == "vdb" else stored, back) == 0
    (values, matrix, unit), (values_before, matrix_before, unit_before) = read(back), read(source)
    assert values.dtype == values_before.dtype and np.array_equal(values, values_before)
    assert unit == unit_before
    if matrix is not None:
        assert np.allclose(matrix, matrix_before, rtol=1e-6, atol=1e-6)
    first, second = convert(source), convert(back)
    assert np.allclose(first.matrix, second.matrix, rtol=1e-6, atol=1e-9) and first.unit == second.unit


@pytest.mark.parametrize("ending", ["nii", "nrrd", "mha", "vti", "npy", "nc"])
def test_vectors_come_back(tmp_path, ending):
    values = np.stack([ramp("f4"), -2 * ramp("f4"), ramp("f4") / 2], axis=-1)
    source = tmp_path / "a.nrrd"
    directions = "(0.5,0,0) (0,0.75,0) (0,0,2)"
    source.write_bytes((f"NRRD0005\ntype: float\ndimension: 4\nspace: left-posterior-superior\nsizes: 3 6 5 4\nspace directions: none "
                        f"{directions}\nkinds: vector domain domain domain\nendian: little\nencoding: raw\n\n").encode() +
                       values.tobytes())
    assert run_here(image2vdb, source, tmp_path / "a.vdb") == 0
    assert run_here(vdb2image, tmp_path / "a.vdb", tmp_path / f"back.{ending}") == 0
    turned = values * np.array([-1, -1, 1], "f4")
    assert np.array_equal(convert(source).values, turned)
    words = ["--axes", "zyxv"] if ending == "npy" else []
    made = convert(tmp_path / f"back.{ending}", *words)
    assert np.array_equal(made.values, turned)
    if ending != "npy":
        assert np.allclose(made.matrix, LPS_TO_RAS @ BOX)


@pytest.mark.parametrize("ending", ["nii", "nrrd", "mha", "vti", "npy", "tif", "nc"])
def test_missing_voxels_come_back(tmp_path, ending):
    values = ramp("f4") - 1
    values[0, 0, 1] = np.nan
    np.save(tmp_path / "a.npy", values)
    assert run_here(image2vdb, tmp_path / "a.npy", tmp_path / "a.vdb", "--nonfinite", "missing") == 0
    assert run_here(vdb2image, tmp_path / "a.vdb", tmp_path / f"back.{ending}") == 0
    made = convert(tmp_path / f"back.{ending}", "--nonfinite", "missing")
    assert made.missing == 1 and np.array_equal(made.values[made.active], values[~np.isnan(values)])


def test_integers_with_holes_come_back_as_netcdf(tmp_path, netcdf):
    with netcdf_file(tmp_path / "a.nc") as file:
        file.createVariable("t", "i8", ("z", "y", "x"), fill_value=-1)[:] = np.ma.MaskedArray(ramp("i8") + 2 ** 60, ramp() == 5)
    assert run_here(image2vdb, tmp_path / "a.nc", tmp_path / "a.vdb") == 0
    assert run_here(vdb2image, tmp_path / "a.vdb", tmp_path / "b.nc") == 0
    with netcdf.Dataset(tmp_path / "b.nc") as file:
        again = file["density"][:]
    assert again.dtype == "i8" and np.array_equal(np.ma.getmaskarray(again), ramp() == 5)
    assert np.array_equal(again.compressed(), (ramp("i8") + 2 ** 60)[ramp() != 5])


@pytest.mark.parametrize("ending", ["nii", "nrrd", "mha", "vti", "npy", "nc", "ome.tif", "mrc"])
def test_labels_masks_and_doubles_come_back(tmp_path, ending):
    for values in (ramp("u4") + np.uint32(2 ** 31), ramp("u8") + np.uint64(2 ** 61), ramp("f8") / 3, ramp() > 200, np.zeros((4, 5, 6), "u1")):
        np.save(tmp_path / "a.npy", values)
        words = ["--as", "double"] if values.dtype == "f8" else []
        assert run_here(image2vdb, tmp_path / "a.npy", tmp_path / "a.vdb", "-f", *words) == 0
        code = run_here(vdb2image, tmp_path / "a.vdb", tmp_path / f"b.{ending}", "-f")
        if values.itemsize >= (8 if values.dtype != "f8" and ending == "ome.tif" else 4 if ending == "mrc" else 99):
            assert code == 2  # the format has no such type
            continue
        made = convert(tmp_path / f"b.{ending}", *words)
        assert code == 0 and np.array_equal(made.values.astype(values.dtype), values)


@pytest.mark.parametrize("ending", ["nii.gz", "nrrd", "mha"])
def test_a_scan_comes_back_in_other_formats(tmp_path, ending):
    folder = dicom(tmp_path / "s", ramp("i2") - 500)
    assert run_here(image2vdb, folder, tmp_path / "a.vdb") == 0
    assert run_here(vdb2image, tmp_path / "a.vdb", tmp_path / f"b.{ending}") == 0
    values, matrix, _ = FORMATS[ending][1](tmp_path / f"b.{ending}")
    assert values.dtype == "i2" and np.array_equal(values, ramp("i2") - 500) and np.allclose(matrix, tilted(), atol=1e-4)


# -- choices and refusals ------------------------------------------------------------------------------------------------
def test_what_a_format_cannot_hold(tmp_path, capfd):
    write_nifti(tmp_path / "a.nii", ramp("i2"))
    assert run_here(image2vdb, tmp_path / "a.nii", tmp_path / "a.vdb") == 0
    for ending in "mrc", "nc":
        assert run_here(vdb2image, tmp_path / "a.vdb", tmp_path / f"b.{ending}") == 2
        assert "cannot hold the orientation" in capfd.readouterr().err
    assert run_here(vdb2image, tmp_path / "a.vdb", tmp_path / "b.tif") == 0
    assert "which are left out" in capfd.readouterr().err
    assert run_here(vdb2image, tmp_path / "a.vdb", tmp_path / "b.nrrd", "--type", "uint8") == 2
    assert "cannot be written exactly as uint8" in capfd.readouterr().err
    assert run_here(vdb2image, tmp_path / "a.vdb", tmp_path / "b.jpg") == 2
    assert sorted(os.listdir(tmp_path)) == ["a.nii", "a.vdb", "b.tif"]


def test_grids_are_chosen_and_boxes_follow_voxels(tmp_path, capfd):
    tiff(tmp_path / "a.ome.tif", np.stack([ramp(), ramp() + 1000]), ome=True, metadata={
        "axes": "CZYX", "Channel": {"Name": ["DAPI", "GFP"]}})
    assert run_here(image2vdb, tmp_path / "a.ome.tif", tmp_path / "a.vdb", "--channel", "all") == 0
    assert run_here(vdb2image, tmp_path / "a.vdb", tmp_path / "b.npy") == 2
    assert run_here(vdb2image, tmp_path / "a.vdb", tmp_path / "b.npy", "-g", "GFP", "--type", "float32") == 0
    assert np.array_equal(np.load(tmp_path / "b.npy"), (ramp() + 1000).astype("f4"))
    builder = esvr.GridBuilder("float", transform=np.diag([2.0, 2, 2, 1]))
    values = np.zeros((8, 8, 8), "f4")
    values[2:4, 3:5, 4:7] = 5
    builder.add(values)
    esvr.write_vdb(tmp_path / "box.vdb", [builder.finish()])
    assert run_here(vdb2image, tmp_path / "box.vdb", tmp_path / "box.nrrd") == 0
    made = convert(tmp_path / "box.nrrd")
    assert made.grid.metadata["image_size"] == (2, 2, 3) and np.allclose(made.matrix[:3, 3], [4, 6, 8])
