"""The model of an image: its axes, units, orientation and missing values, and how a part of it is read.

A reader makes an Image, whose axes have the order of the file. image2vdb chooses among channels and times and reads slabs,
whose axes are x, y, z (and the components of vectors). World coordinates are RAS (x to the right, y to the front, z up in
a patient) in every format that has a patient, and those of the file in all others.
"""
import bz2
import contextlib
import dataclasses
import importlib
import math
import os
import re
import tempfile
import zlib
from typing import Callable, Optional

import numpy as np

import esvr

SPACE = "xyz"
CHANNEL, TIME, VECTOR = "channel", "time", "vector"
BRICK = 8  # slabs begin at multiples of the side of a brick

# -- units ---------------------------------------------------------------------------------------------------------
PREFIXES = {"Y": 24, "Z": 21, "E": 18, "P": 15, "T": 12, "G": 9, "M": 6, "k": 3, "h": 2, "da": 1, "": 0, "d": -1, "c": -2,
            "m": -3, "u": -6, "n": -9, "p": -12, "f": -15, "a": -18}
METRES = {f"{prefix}m": 10.0 ** power for prefix, power in PREFIXES.items()}
METRES.update({"angstrom": 1e-10, "in": 0.0254, "ft": 0.3048, "yd": 0.9144, "thou": 0.0254e-3, "li": 0.0254 / 12, "mi": 1609.344,
               "pt": 0.0254 / 72})
LONG_PREFIXES = {"kilo": "k", "centi": "c", "deci": "d", "milli": "m", "micro": "u", "nano": "n", "pico": "p", "": ""}
SYNONYMS = {"micron": "um", "microns": "um", "a": "angstrom", "å": "angstrom", "ångström": "angstrom", "ångstrom": "angstrom",
            "angstroms": "angstrom", "inch": "in", "inches": "in", "feet": "ft", "foot": "ft", "pixel": None, "": None}


def unit_named(text):
    """The unit of length of this name in any of its spellings ("µm", "micron", "micrometre"); None for others."""
    text = (text or "").strip().strip('"').replace("\\u00B5", "u").replace("\u00b5", "u").replace("\u03bc", "u")
    if text in METRES:
        return text
    lower = text.lower()
    if lower in SYNONYMS:
        return SYNONYMS[lower]
    match = re.fullmatch(r"(kilo|centi|deci|milli|micro|nano|pico|)-?met(?:er|re)s?", lower)
    if match:
        return LONG_PREFIXES[match[1]] + "m"
    return lower if lower in METRES else None


def factor(unit, to):
    """By what a length in one unit is multiplied to be in another."""
    return METRES[unit] / METRES[to]


# -- axes ----------------------------------------------------------------------------------------------------------
@dataclasses.dataclass
class Axis:
    """An axis of an image: one of space ("x", "y", "z"), "channel", "time", "vector" for the components of vectors, or
    the name of another quantity."""
    kind: str
    size: int
    name: str = ""
    labels: list = dataclasses.field(default_factory=list)

    def text(self):
        shown = self.name or self.kind
        labels = f" ({', '.join(self.labels[:8])})" if self.labels else ""
        return f"{shown}: {self.size}{labels}"


NAMES = {"x": "x", "y": "y", "z": "z", "c": CHANNEL, "s": "sample", "t": TIME, "v": VECTOR, "component": VECTOR,
         "depth": "z", "height": "y", "width": "x", "row": "y", "col": "x", "column": "x", "plane": "z",
         "channel": CHANNEL, "channels": CHANNEL, "time": TIME, "frame": TIME, "level": "z", "lev": "z", "altitude": "z",
         "lat": "y", "latitude": "y", "lon": "x", "longitude": "x",
         **{name: CHANNEL for name in ("band", "bands", "member", "number", "ensemble", "realization")}}


def kind_named(name):
    """What an axis of this name means; the name itself if it is not known."""
    return NAMES.get(name.lower(), name.lower())


def axes_from_letters(letters, shape, path):
    """The axes that --axes names, the slowest first."""
    known = "".join(sorted("xyzctv"))
    if len(letters) != len(shape) or len(set(letters)) != len(letters) or not set(letters.lower()) <= set(known):
        raise esvr.UsageError(f"{path} has {len(shape)} axes ({' x '.join(map(str, shape))}); --axes must name each of them "
                              f"once by a letter of {known}, as in {'ctzyx'[-len(shape):]}, and not '{letters}'")
    return [Axis(kind_named(letter), size) for letter, size in zip(letters.lower(), shape)]


# -- orientation ---------------------------------------------------------------------------------------------------
LPS, RAS = "left-posterior-superior", "right-anterior-superior"
LPS_TO_RAS = np.diag([-1.0, -1.0, 1.0, 1.0])


def affine_of(spacing, origin=(0.0, 0.0, 0.0), directions=None):
    """A matrix from indices to world coordinates. directions has the unit vectors of the axes as its columns."""
    matrix = np.eye(4)
    matrix[:3, :3] = (np.eye(3) if directions is None else np.asarray(directions, float)) * np.asarray(spacing, float)
    matrix[:3, 3] = origin
    return matrix


def affine_of_steps(axes, steps):
    """The matrix and unit of axes of which each has a step, a first place and the text of a unit (None if the file does not
    say). Where an axis has no unit of length, as degrees, the lengths have none."""
    spacing, origin, units = np.ones(3), np.zeros(3), {}
    for axis, (step, first, unit) in zip(axes, steps):
        if axis.kind in SPACE:
            column = SPACE.index(axis.kind)
            spacing[column], origin[column], units[column] = step, first, unit_named(unit)
    if not units or None in units.values():
        return affine_of(spacing, origin), None
    to = units[min(units)]
    for column, unit in units.items():
        spacing[column] *= factor(unit, to)
        origin[column] *= factor(unit, to)
    return affine_of(spacing, origin), to


# -- errors of readers ---------------------------------------------------------------------------------------------
def need(module, package, path, format_name):
    """Imports a reader. The message names the package of Debian and Ubuntu."""
    try:
        return importlib.import_module(module)
    except ImportError as missing:
        raise esvr.Error(f"{path}: {format_name} needs the Python module {module.partition('.')[0]}, which cannot be loaded "
                         f"({missing}); install the package {package}") from missing


@contextlib.contextmanager
def reading(path, format_name):
    """Turns every error of a reader into one that names the file."""
    try:
        yield
    except (esvr.Error, MemoryError):
        raise
    except OSError as error:
        reason = error.strerror or str(error)
        raise esvr.BadInput(f"{path} cannot be read as {format_name}: {reason}") from error
    except Exception as error:
        reason = " ".join(str(error).split())[:300] or "the data are damaged"
        raise esvr.BadInput(f"{path} cannot be read as {format_name}: {type(error).__name__}: {reason}") from error


def require_bytes(path, needed, there, what):
    """Checks what a header promises against what the file has, before memory is taken for it."""
    if needed > there:
        raise esvr.BadInput(f"{path} is cut short or damaged: {what} needs {needed} bytes, and the file has {there} for it")


def natural(name):
    """A key that sorts numbers in names by their values."""
    return [(0, int(word), "") if word.isdigit() else (1, 0, word) for word in re.findall(r"\d+|\D+", name)]


def product(numbers):
    return math.prod(int(n) for n in numbers)


def by(shape):
    """A size as text, the fastest axis first."""
    return " x ".join(str(n) for n in shape[::-1])


def require_shape(path, shape):
    """Refuses impossible sizes."""
    if not shape or any(int(n) < 1 for n in shape):
        raise esvr.BadInput(f"{path} has no voxels: its size is {' x '.join(map(str, shape)) or 'nothing'}")
    if any(int(n) > 2 ** 31 - 1 for n in shape):
        raise esvr.BadInput(f"{path} is too large or damaged: its size is {' x '.join(map(str, shape))}")


# -- numbers in files ----------------------------------------------------------------------------------------------
# Functions for Image.fetch: of an index with an integer or a slice for each axis, the slowest axis first, they return the part.
MOST_DEFLATED = 1032  # by what zlib makes bytes fewer at most
CHUNK = 1 << 20


def mapped(path, dtype, shape, offset=0, file=None):
    """Numbers that lie one after the other in a file. A part is mapped only while it is copied, so that neither the memory nor
    the number of open files grows."""
    dtype, shape = np.dtype(dtype), tuple(int(n) for n in shape)
    require_shape(path, shape)
    there = os.fstat(file.fileno()).st_size if file else os.path.getsize(path)
    require_bytes(path, product(shape) * dtype.itemsize, there - offset, f"an array of {by(shape)} {dtype.name}")
    return lambda index: np.array(np.memmap(file or path, dtype, "r", offset, shape)[index], dtype.newbyteorder("="))


def unpacked(path, dtype, shape, offset=0, skip=0, method="deflate"):
    """As mapped(), of numbers that zlib, gzip or bzip2 has made smaller: they are unpacked into a temporary file. skip is a
    number of bytes after unpacking."""
    needed = product(shape) * np.dtype(dtype).itemsize + skip
    with open(path, "rb") as source:
        source.seek(offset)
        if method == "deflate":
            require_bytes(path, needed / MOST_DEFLATED, os.path.getsize(path) - offset, "the compressed array, at the least,")
        unzipped = bz2.BZ2File(source) if method == "bzip2" else None
        with writing_temporary(path):
            file = tempfile.TemporaryFile()
        for piece in iter(lambda: unzipped.read(CHUNK), b"") if unzipped else inflated(source):
            with writing_temporary(path):  # pieces behind the array are read for the checksum at the end
                file.write(piece[:needed - file.tell()])
                file.flush()
    return mapped(path, dtype, shape, skip, file)


@contextlib.contextmanager
def writing_temporary(path):
    """Tells errors of the temporary file from those of the input."""
    try:
        yield
    except OSError as error:
        raise esvr.Error(f"{path} is unpacked into a temporary file, which cannot be written: {error.strerror or error} "
                         "(TMPDIR names another folder)") from error


def inflated(file):
    """The pieces of a stream of zlib or gzip, also of one of several members."""
    inflater, data = zlib.decompressobj(wbits=47), file.read(CHUNK)
    while data:
        yield inflater.decompress(data, CHUNK)
        data = inflater.unconsumed_tail or inflater.unused_data or file.read(CHUNK)
        if inflater.eof and data.strip(b"\0"):
            inflater = zlib.decompressobj(wbits=47)
        elif inflater.eof:
            return
    raise EOFError("the compressed data end early")


def is_gzip(path):
    with open(path, "rb") as file:
        return file.read(2) == b"\x1f\x8b"


def head_of(path, count):
    """The first bytes of a file, or of what gzip has packed into it; none if that is damaged."""
    with open(path, "rb") as file, contextlib.suppress(zlib.error, EOFError):
        return next(inflated(file), b"")[:count] if is_gzip(path) else file.read(count)
    return b""


def whole_or_packed(path, dtype, shape, offset):
    return unpacked(path, dtype, shape, 0, offset) if is_gzip(path) else mapped(path, dtype, shape, offset)


def planes(leading, read):
    """An array whose leading axes are those of planes: read(number, index) returns a part of one."""
    def fetch(index, axes=tuple(leading), first=0):
        if not axes:
            return read(first, tuple(index))
        below = product(axes[1:])
        if isinstance(index[0], slice):
            return np.stack([fetch(index[1:], axes[1:], first + k * below) for k in range(*index[0].indices(axes[0]))])
        return fetch(index[1:], axes[1:], first + int(index[0]) * below)
    return fetch


def in_memory(array):
    return lambda index: array[index]


# -- images --------------------------------------------------------------------------------------------------------
@dataclasses.dataclass
class Image:
    """An image of a file.

    fetch(index) returns the stored numbers of a part, with an integer or a slice for each axis. missing(numbers) says which
    of them are missing (None: none). A calibrated value is scale[0] * number + scale[1]. affine is the matrix of the axes
    x, y, z, in `unit`; without a unit, the file does not say what its lengths are.
    """
    format: str
    path: object
    axes: list
    dtype: np.dtype
    fetch: Callable
    affine: np.ndarray
    unit: Optional[str] = None
    scale: Optional[tuple] = None
    missing: Optional[Callable] = None
    block: int = 1  # along the slowest axis of space, so many slices are read at once
    notes: list = dataclasses.field(default_factory=list)
    warnings: list = dataclasses.field(default_factory=list)
    metadata: dict = dataclasses.field(default_factory=dict)
    turn: Optional[np.ndarray] = None  # 3 x 3, applied to vectors

    def __post_init__(self):
        self.dtype = np.dtype(self.dtype)
        if self.scale is not None and tuple(self.scale) == (1.0, 0.0):
            self.scale = None
        if self.dtype.kind not in "iufb":
            raise esvr.BadInput(f"{self.path} holds values of type {self.dtype.name}, which is not read; real numbers are")
        require_shape(self.path, [axis.size for axis in self.axes])
        kinds = [axis.kind for axis in self.axes]
        for kind in set(kinds):
            if kinds.count(kind) > 1:
                raise esvr.BadInput(f"{self.path}: two axes of the image are {kind} ({', '.join(a.text() for a in self.axes)})")

    def name_channels(self, labels):
        if self.axis(CHANNEL) and len(labels) == self.axis(CHANNEL).size and any(labels):
            self.axis(CHANNEL).labels = labels

    def axis(self, kind):
        return next((axis for axis in self.axes if axis.kind == kind), None)

    @property
    def size(self):
        """The numbers of voxels along x, y and z."""
        return tuple(self.axis(kind).size if self.axis(kind) else 1 for kind in SPACE)

    @property
    def components(self):
        axis = self.axis(VECTOR)
        return axis.size if axis else 1

    def choices(self):
        """The axes of which one place must be chosen."""
        return [axis for axis in self.axes if axis.kind not in SPACE and axis.kind != VECTOR]


class Part:
    """The voxels of an image at one channel and time; chosen has the places of the axes that are not of space."""

    def __init__(self, image, chosen):
        self.image, self.chosen = image, chosen
        self.kept = [axis.kind for axis in image.axes if axis.kind in SPACE or axis.kind == VECTOR and axis.kind not in chosen]
        self.is_vector = VECTOR in self.kept
        self.slab_kind = next((kind for kind in self.kept if kind in SPACE), "z")
        self.slab_axis = SPACE.index(self.slab_kind)
        self.slices = image.size[self.slab_axis]

    def values(self, first, last, stored=False):
        """The values of slices along the slab axis, with the axes x, y, z (and components) and, where voxels are missing, a mask
        of them (else None)."""
        index = [self.chosen.get(axis.kind, slice(first, last) if axis.kind == self.slab_kind else slice(0, axis.size))
                 for axis in self.image.axes]
        order = [self.kept.index(kind) for kind in [*SPACE, VECTOR] if kind in self.kept]
        numbers = self.image.fetch(tuple(index)).transpose(order)
        numbers = np.expand_dims(numbers, [k for k, kind in enumerate(SPACE) if kind not in self.kept])
        if stored:
            return numbers, None
        gone = self.image.missing(numbers) if self.image.missing else None
        if gone is not None and self.is_vector:
            gone = gone.any(axis=3)
        return apply_scale(numbers, self.image.scale), gone


def apply_scale(numbers, scale):
    """Calibrated values: integers of 64 bits where slope and intercept of integers are whole, else float64."""
    if scale is None:
        return numbers
    slope, intercept = scale
    if numbers.dtype.kind in "iu" and numbers.dtype.itemsize <= 4 and all(
            float(number).is_integer() and abs(number) < 2 ** 31 for number in scale):
        return numbers.astype(np.int64) * int(slope) + int(intercept)
    return numbers.astype(np.float64) * slope + intercept


def missing_if_any(values):
    """A function for Image.missing: the voxels that have one of these values."""
    def missing(numbers):
        return np.logical_or.reduce([np.isnan(numbers) if value != value else numbers == value for value in values])
    return missing if values else None
