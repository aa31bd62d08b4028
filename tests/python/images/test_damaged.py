"""Damaged files of each kind end with exit code 3, the file's name, no output and no traceback, and nothing is left behind."""
import bz2
import contextlib
import errno
import faulthandler
import importlib
import io
import json
import os
import shutil
import signal
import subprocess
import sys
import time
import types
import zlib
from unittest import mock

import numpy as np
import pytest

import esvr
from esvr.images import image, image2vdb, program

from conversions import dicom, metaimage, mrc, netcdf_file, nifti, nrrd, ramp, run_here, tiff


# Loaded before processes are forked, so that not each of them loads them.
for module in ("nibabel", "mrcfile", "tifffile", "h5py", "netCDF4", "pydicom", "zarr", "vtkmodules.vtkIOXML",
               "vtkmodules.util.numpy_support"):
    with contextlib.suppress(ImportError):
        importlib.import_module(module)


def gzip_nrrd(path):
    path.write_bytes(b"NRRD0004\ntype: ushort\ndimension: 3\nsizes: 6 5 4\nendian: little\nencoding: gzip\n\n" + zlib.compress(
        np.random.default_rng(1).integers(0, 60000, 120).astype("u2").tobytes()))


def hdf5(path):
    with pytest.importorskip("h5py").File(path, "w") as file:
        file.create_dataset("a", data=ramp(), chunks=(2, 5, 6), compression="gzip")


def netcdf(path, form="NETCDF4"):
    with netcdf_file(path, form=form) as file:
        file.createVariable("t", "f4", ("z", "y", "x"))[:] = ramp()


def vti(path):
    pytest.importorskip("vtkmodules.vtkIOXML")
    path.write_bytes(b'<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian" header_type="UInt32"><ImageData '
                     b'WholeExtent="0 5 0 4 0 3" Origin="0 0 0" Spacing="1 1 1"><Piece Extent="0 5 0 4 0 3"><PointData><DataArray '
                     b'type="UInt16" Name="a" format="appended" offset="0"/></PointData></Piece></ImageData><AppendedData '
                     b'encoding="raw">_' + (240).to_bytes(4, "little") + ramp().tobytes() + b"</AppendedData></VTKFile>")


FILES = {"a.nii": lambda path: nifti(path, ramp("i2")), "a.nii.gz": lambda path: nifti(path, ramp("i2")),
         "a.nrrd": lambda path: nrrd(path, [("dimension", 3), ("sizes", "6 5 4")], ramp()), "b.nrrd": gzip_nrrd,
         "a.mha": lambda path: metaimage(path, {"NDims": 3, "DimSize": "6 5 4", "ElementType": "MET_USHORT"}, ramp().tobytes()),
         "a.mrc": lambda path: mrc(path, ramp("i2")), "a.tif": lambda path: tiff(path, ramp(), metadata={"axes": "ZYX"}),
         "a.ome.tif": lambda path: tiff(path, ramp(), ome=True, compression="zlib", metadata={"axes": "ZYX"}), "a.h5": hdf5,
         "a.nc": netcdf, "b.nc": lambda path: netcdf(path, "NETCDF3_CLASSIC"), "a.vti": vti, "a.npy": lambda path: np.save(path, ramp()),
         "a.dcm": lambda path: shutil.copy(dicom(path.parent / "series", ramp()[:1]) / "s0.dcm", path)}


def checked(path, out, code, said):
    """The exit code, after a check of what is left behind and printed."""
    assert "Traceback" not in said
    assert code in (0, 2, 3, 5), said
    if code:
        assert path.name in said and os.listdir(out.parent) == []
    else:
        out.unlink()
    return code


def attempts(path, variants, capfd, *words):
    """Converts a file with each of these contents, and returns the exit codes. One child process does so for all of them; a
    content that crashes a library there has a process of its own, as in the program."""
    out = path.parent / "out/o.vdb"
    out.parent.mkdir(exist_ok=True)

    def convert_all():
        for data in variants:
            path.unlink()  # HDF5 knows files that it has open
            path.write_bytes(data)
            with contextlib.redirect_stderr(io.StringIO()) as said:
                code = run_here(image2vdb, path, out, "-f", *words)
            checked(path, out, code, said.getvalue())
            codes_path.open("a").write(f"{code}\n")
    codes_path = path.parent / "codes"
    codes_path.write_text("")
    assert program.run_in_child("test", [], [], convert_all, True) != 1, capfd.readouterr().err
    codes = [int(code) for code in codes_path.read_text().split()]
    for left in out.parent.iterdir():  # by a crash
        left.unlink()
    for data in variants[len(codes):]:
        path.write_bytes(data)
        codes.append(attempt(path, capfd, *words))
    return codes


def attempt(path, capfd, *words):
    """Converts a file as the program does, in a child process."""
    out = path.parent / "out/o.vdb"
    out.parent.mkdir(exist_ok=True)
    with mock.patch.object(sys, "argv", ["image2vdb", str(path), str(out), "-f", *words]):
        code = image2vdb.main()
    return checked(path, out, code, capfd.readouterr().err)


@pytest.mark.parametrize("name", FILES)
def test_cut_files(tmp_path, capfd, name):
    path = tmp_path / name
    FILES[name](path)
    whole = path.read_bytes()
    found = attempts(path, [whole] + [whole[:int(len(whole) * share)] for share in (0.97, 0.5, 0.02)], capfd)
    # The last bytes of HDF5 and XML need not be those of the array.
    assert found == [0, 3, 3, 3] or found == [0, 0, 3, 3] and name in ("a.vti", "a.dcm", "a.ome.tif")


@pytest.mark.parametrize("name", FILES)
def test_changed_bytes(tmp_path, capfd, name):
    path = tmp_path / name
    FILES[name](path)
    rng, whole, variants = np.random.default_rng(7), path.read_bytes(), []
    for _ in range(6):
        data = bytearray(whole)
        for at in rng.integers(0, min(len(data), 700), 3):
            data[at] = rng.integers(0, 256)
        variants.append(data)
    attempts(path, variants, capfd)


@pytest.mark.parametrize("name, magic", [("a.tif", b"II*\0\x08\0\0\0"), ("a.h5", b"\x89HDF\r\n\x1a\n"), ("a.nc", b"CDF\1"),
                                         ("a.nrrd", b"NRRD0004\n"), ("a.npy", b"\x93NUMPY"), ("a.vti", b"<VTKFile"), ("a.nii.gz",
                                         b"\x1f\x8b\x08\0"), ("a.dcm", bytes(128) + b"DICM"), ("a.mha", b"NDims = 3\n")])
def test_noise_after_the_first_bytes(tmp_path, capfd, name, magic):
    (tmp_path / name).write_bytes(magic + np.random.default_rng(3).bytes(5000))
    assert attempt(tmp_path / name, capfd) == 3


def test_damaged_zarr(tmp_path, capfd, zarr):
    zarr.open(str(tmp_path / "a.zarr"), mode="w", shape=(4, 5, 6), chunks=(2, 5, 6), dtype="u2")[:] = ramp()
    assert attempt(tmp_path / "a.zarr", capfd) == 0
    chunk = (tmp_path / "a.zarr/1.0.0").read_bytes()
    (tmp_path / "a.zarr/1.0.0").write_bytes(chunk[:-4])
    assert attempt(tmp_path / "a.zarr", capfd) == 3
    (tmp_path / "a.zarr/1.0.0").write_bytes(chunk)
    (tmp_path / "a.zarr/.zarray").write_text("{")
    assert attempt(tmp_path / "a.zarr", capfd) == 3


def test_cut_edge_chunks_of_zarr(tmp_path, capfd, zarr):
    zarr.open(str(tmp_path / "a.zarr"), mode="w", shape=(3, 5, 6), chunks=(2, 5, 6), dtype="u2", compressor=None)[:] = ramp()[:3]
    (tmp_path / "a.zarr/1.0.0").write_bytes(ramp()[2].tobytes())
    assert attempt(tmp_path / "a.zarr", capfd) == 3


@pytest.mark.parametrize("name", ["a.nii", "a.nrrd", "a.mha", "a.npy", "a.mrc", "b.mrc", "a.vti", "a.raw", "a.dcm"])
def test_promises_are_checked_before_memory_is_taken(tmp_path, capfd, name):
    path = tmp_path / name
    if name == "a.nii":
        FILES[name](path)
        data = bytearray(path.read_bytes())
        data[42:48] = np.array([2000, 2000, 2000], "<i2").tobytes()
        path.write_bytes(data)
    elif name == "a.npy":
        np.save(path, ramp())
        path.write_bytes(path.read_bytes().replace(b"(4, 5, 6), }        ", b"(4000, 5000, 6000), }"[:20].ljust(20)))
    elif name.endswith(".mrc"):
        mrc(path, ramp("i2"))
        data = bytearray(path.read_bytes())
        at = 0 if name == "a.mrc" else 92  # the sizes, or the length of a second header
        data[at:at + 12] = np.array([2000, 2000, 2000] if name == "a.mrc" else [2 ** 31 - 1, 0, 0], "<i4").tobytes()
        path.write_bytes(data)
    elif name == "a.dcm":
        shutil.copy(dicom(tmp_path / "s", ramp()[:1], change=lambda _, data: setattr(data, "NumberOfFrames", 10 ** 9)) / "s0.dcm", path)
    elif name == "a.raw":
        path.write_bytes(bytes(416))
    else:
        FILES[name](path)
        path.write_bytes(path.read_bytes().replace(b"6 5 4", b"2000 2000 2000").replace(b"0 5 0 4 0 3", b"0 1999 0 1999 0 1999"))
    words = ["--dims", "2000,2000,2000", "--type", "uint8"] if name == "a.raw" else []
    assert attempt(path, capfd, *words) == 3


@pytest.mark.parametrize("name, content", [
    ("bz.nrrd", b"NRRD0004\ntype: ushort\ndimension: 3\nsizes: 60000 50000 40000\nendian: little\nencoding: bzip2\n\n" + bz2.compress(
        bytes(240))),
    ("z.mha", b"NDims = 3\nDimSize = 6 5 4\nElementType = MET_USHORT\nCompressedData = True\nElementDataFile = LOCAL\n" +
     zlib.compress(np.random.default_rng(0).bytes(240))[:-9]),
    ("a.mhd", b"NDims = 3\nDimSize = 6 5 4\nElementType = MET_USHORT\nElementDataFile = none.raw\n"),
    ("a.nhdr", b"NRRD0004\ntype: ushort\ndimension: 3\nsizes: 6 5 4\nendian: little\nencoding: raw\ndata file: LIST\nnone\n")])
def test_packed_and_detached_data(tmp_path, capfd, name, content):
    (tmp_path / name).write_bytes(content)
    assert attempt(tmp_path / name, capfd) == 3


def test_no_place_for_temporary_files(tmp_path, capfd, monkeypatch):
    def full():
        raise OSError(errno.ENOSPC, "No space left on device")
    gzip_nrrd(tmp_path / "a.nrrd")
    monkeypatch.setattr(image, "tempfile", types.SimpleNamespace(TemporaryFile=full))
    assert run_here(image2vdb, tmp_path / "a.nrrd", tmp_path / "o.vdb") == 1  # the image is not damaged
    assert "TMPDIR names another folder" in capfd.readouterr().err


def test_damaged_descriptions_and_slices(tmp_path, capfd):
    text = '<?xml version="1.0"?><OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06"><Image'
    tiff(tmp_path / "a.ome.tif", ramp(), description=text)
    assert attempt(tmp_path / "a.ome.tif", capfd) == 3
    folder = dicom(tmp_path / "series", ramp(), tool=("dcmcrle",))
    cut = folder / "s2.dcm"
    cut.write_bytes(cut.read_bytes()[:-30])
    assert attempt(folder, capfd) == 3


def test_unknown_files(tmp_path, capfd):
    (tmp_path / "a.jpg").write_bytes(b"\xff\xd8\xff\xe0" + bytes(100))
    assert attempt(tmp_path / "a.jpg", capfd) == 2  # it may be a RAW image, whose sizes are then asked for
    (tmp_path / "b.tif").write_bytes(b"")
    assert attempt(tmp_path / "b.tif", capfd) == 3
    assert attempt(tmp_path / "none.tif", capfd) == 3


# -- the child process ---------------------------------------------------------------------------------------------------
def test_a_crash_of_a_library_is_reported(tmp_path, capfd):
    out = tmp_path / "o.vdb"

    def crash():
        (tmp_path / os.path.basename(program.part_of(out))).write_text("half a file")
        faulthandler.disable()
        os.kill(os.getpid(), signal.SIGSEGV)
    assert program.run_in_child("image2vdb", ["a.h5"], [out], crash, False) == 3
    assert "a.h5: the library that reads it crashed (SIGSEGV)" in capfd.readouterr().err
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("is_stuck", [False, True])
def test_interruptions_end_within_two_seconds(tmp_path, is_stuck):
    """is_stuck stands for a C library that does not return to Python."""
    code = f"""
import os, signal, sys, time
from esvr.images import program
def work():
    open(program.part_of({str(tmp_path / 'o.vdb')!r}), "w").write("half a file")
    if {is_stuck}:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    print("ready", flush=True)
    time.sleep(60)
sys.exit(program.run_in_child("image2vdb", ["a.h5"], [{str(tmp_path / 'o.vdb')!r}], work, False))
"""
    path = os.path.dirname(os.path.dirname(esvr.__file__))
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          env={**os.environ, "PYTHONPATH": path}) as process:
        assert process.stdout.readline() == "ready\n"
        begin = time.monotonic()
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=10)
    assert time.monotonic() - begin < 2 and process.returncode == 130
    assert said == "image2vdb: interrupted\n" and os.listdir(tmp_path) == []


# -- the manners of the programs -------------------------------------------------------------------------------------------
def test_outputs_are_replaced_only_by_force(tmp_path, capfd):
    np.save(tmp_path / "a.npy", ramp())
    words = [tmp_path / "a.npy", tmp_path / "o.vdb"]
    assert run_here(image2vdb, *words) == 0
    assert run_here(image2vdb, *words) == 1 and "--force replaces it" in capfd.readouterr().err
    assert run_here(image2vdb, *words, "-f") == 0
    (tmp_path / "same.vdb").write_bytes((tmp_path / "a.npy").read_bytes())
    assert run_here(image2vdb, tmp_path / "same.vdb", tmp_path / "same.vdb", "-f") == 2
    assert (tmp_path / "same.vdb").read_bytes() == (tmp_path / "a.npy").read_bytes()


def test_a_missing_reader_is_named(tmp_path, capfd, monkeypatch):
    mrc(tmp_path / "a.mrc", ramp("i2"))
    monkeypatch.setitem(sys.modules, "mrcfile", None)
    assert run_here(image2vdb, tmp_path / "a.mrc", tmp_path / "o.vdb") == 1
    assert "install the package python3-mrcfile" in capfd.readouterr().err


def test_help_fits_on_a_screen(capfd):
    from esvr.images import vdb2image
    for module in image2vdb, vdb2image:
        assert run_here(module, "--help") == 0
        lines = capfd.readouterr().out.splitlines()
        assert len(lines) <= 50 and max(map(len, lines)) <= 100
        assert run_here(module, "--help", "options") == 0
        assert "--force" in capfd.readouterr().out


def test_memory_is_limited(tmp_path, capfd):
    values = np.zeros((64, 300, 300), "u2")
    values[50:60] = 7
    np.save(tmp_path / "b.npy", values)  # larger than the limit, and read in slabs
    assert run_here(image2vdb, tmp_path / "b.npy", tmp_path / "b.vdb", "--max-memory", "10MB") == 0
    assert "900000 active voxels" in capfd.readouterr().err
    (tmp_path / "b.npy").unlink()
    (tmp_path / "b.vdb").unlink()
    np.save(tmp_path / "a.npy", np.zeros((16, 400, 400), "f4"))
    assert run_here(image2vdb, tmp_path / "a.npy", tmp_path / "o.vdb", "--max-memory", "1M") == 5
    assert "--max-memory" in capfd.readouterr().err
    assert json.dumps(os.listdir(tmp_path)) == '["a.npy"]'
