"""Makes a wheel of the package esvr, for `pip install .` (PEP 517). It needs CMake and the packages of `./setup packages build`.

The module is built in build/wheel, which is kept, so that the next wheel takes less time. CMAKE_ARGS has further options of CMake
("-DESVR_CUDA=OFF"), and CMAKE_BUILD_PARALLEL_LEVEL the number of jobs. The same build gives the same bytes.
"""
import base64
import gzip
import hashlib
import io
import os
import pathlib
import re
import shlex
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = ROOT / "build/wheel"
NAME = "esvr"
SUMMARY = "Sparse VDB volumes as lists of ellipsoids, and back"
PROGRAMS = ("image2vdb", "vdb2image")
FIRST_DATE = (1980, 1, 1, 0, 0, 0)  # of the ZIP format


class UnsupportedOperation(Exception):
    """What PEP 517 wants where something cannot be made."""


def version():
    return re.search(r"^project\(\s*esvr\s+VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text(), re.MULTILINE)[1]


def metadata():
    return (f"Metadata-Version: 2.1\nName: {NAME}\nVersion: {version()}\nSummary: {SUMMARY}\nLicense: Apache-2.0\n"
            "Requires-Python: >=3.9\nRequires-Dist: numpy\nDescription-Content-Type: text/markdown\n\n"
            f"{(ROOT / 'README.md').read_text(encoding='utf-8')}")


def tag():
    """The interpreter and the machine that the module is built for."""
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    return f"{python}-{python}-{re.sub('[-.]', '_', sysconfig.get_platform())}"


def run(*command):
    if subprocess.run(list(map(str, command))).returncode:
        raise RuntimeError(f"{shlex.join(map(str, command))} failed; ./setup packages build installs what a build needs")


def information():
    """The files that say what is in the wheel, by their names in it."""
    info = f"{NAME}-{version()}.dist-info"
    scripts = "".join(f"{name} = {NAME}.images.{name}:main\n" for name in PROGRAMS)
    return {f"{info}/LICENSE": (ROOT / "LICENSE").read_bytes(), f"{info}/METADATA": metadata().encode(),
            f"{info}/WHEEL": f"Wheel-Version: 1.0\nGenerator: {NAME}\nRoot-Is-Purelib: false\nTag: {tag()}\n".encode(),
            f"{info}/entry_points.txt": f"[console_scripts]\n{scripts}".encode()}


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    """Writes what pip wants to know before the wheel is built."""
    for name, data in information().items():
        path = pathlib.Path(metadata_directory) / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(data)
    return path.parent.name


def built(folder):
    """Builds the module and installs the package into a folder."""
    options = ["-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_UNITY_BUILD=ON", "-DCMAKE_UNITY_BUILD_BATCH_SIZE=10", "-DESVR_PYTHON=ON",
               "-DESVR_BUILD_TESTS=OFF", "-DESVR_MPI=OFF", "-DESVR_PYTHON_DIR=.", f"-DPython_EXECUTABLE={sys.executable}"]
    run("cmake", "-S", ROOT, "-B", BUILD, "-G", "Ninja", *options, *shlex.split(os.environ.get("CMAKE_ARGS", "")))
    run("cmake", "--build", BUILD, "--target", "esvr_python")
    run("cmake", "--install", BUILD, "--component", "python", "--prefix", folder, "--strip")


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    name = f"{NAME}-{version()}-{tag()}.whl"
    record = []
    with tempfile.TemporaryDirectory() as folder, \
            zipfile.ZipFile(pathlib.Path(wheel_directory) / name, "w", zipfile.ZIP_DEFLATED) as wheel:
        built(folder)

        def add(path, data):
            entry = zipfile.ZipInfo(path, FIRST_DATE)
            entry.external_attr = (0o755 if path.endswith(".so") else 0o644) << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            wheel.writestr(entry, data)
        package = {path.relative_to(folder).as_posix(): path.read_bytes()
                   for path in sorted(pathlib.Path(folder).rglob("*")) if path.is_file()}
        for path, data in {**package, **information()}.items():
            add(path, data)
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            record.append(f"{path},sha256={digest},{len(data)}\n")
        listed = f"{NAME}-{version()}.dist-info/RECORD"
        add(listed, ("".join(record) + f"{listed},,\n").encode())
    return name


def build_sdist(sdist_directory, config_settings=None):
    """The files that git has of this folder, and the metadata."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True)
    if listed.returncode:
        raise UnsupportedOperation("an archive of the sources is made of the files that git knows, and this is no checkout")
    base = f"{NAME}-{version()}"
    with open(pathlib.Path(sdist_directory) / f"{base}.tar.gz", "wb") as file, gzip.GzipFile("", "wb", fileobj=file, mtime=0) as packed, \
            tarfile.open(fileobj=packed, mode="w", format=tarfile.PAX_FORMAT) as archive:
        def add(name, data, mode=0o644):
            entry = tarfile.TarInfo(f"{base}/{name}")
            entry.size, entry.mode = len(data), mode
            archive.addfile(entry, io.BytesIO(data))
        add("PKG-INFO", metadata().encode())
        for name in sorted(listed.stdout.decode().split("\0")):
            path = ROOT / name
            if name and path.is_file():
                add(name, path.read_bytes(), 0o755 if os.access(path, os.X_OK) else 0o644)
    return f"{base}.tar.gz"
