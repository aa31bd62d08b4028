"""Readers of TIFF: OME-TIFF, ImageJ, tifffile's own and plain stacks, in one file or a file for each slice."""
import os
import re

import numpy as np

import esvr

from .flat import Joined
from .image import CHANNEL, TIME, Axis, Image, affine_of, factor, missing_if_any, need, product, reading, \
    require_bytes, unit_named

TIFF_AXES = {"X": "x", "Y": "y", "Z": "z", "C": CHANNEL, "S": "sample", "T": TIME, "Q": "page", "I": "page"}
RESOLUTION_UNITS = {2: "in", 3: "cm"}


def natural(name):
    """A key that sorts numbers in names by their values."""
    return [(0, int(word), "") if word.isdigit() else (1, 0, word) for word in re.findall(r"\d+|\D+", name)]


def files_of_pattern(text):
    """The files of a pattern like 'ct_####.tif', in the order of their numbers; None if it is no pattern."""
    folder, name = os.path.split(text)
    match = re.search(r"#+|@+|%0?\d*d|\$F\d*", name)
    if not match:
        return None
    mark = match[0]
    digits = 4 if mark == "#" else len(mark) if mark[0] in "#@" else int(re.sub(r"\D", "", mark) or 1)
    before, after = re.escape(name[:match.start()]), re.escape(name[match.end():])
    found = {}
    for entry in os.listdir(folder or "."):
        number = re.fullmatch(before + r"(\d+)" + after, entry)
        if number:
            found[entry] = number[1]
    if not found:
        raise esvr.BadInput(f"no file matches {text}")
    fitting = {n: int(d) for n, d in found.items() if len(d) == digits or len(d) > digits and d[0] != "0"}
    others = sorted(set(found) - set(fitting), key=natural)
    if others:
        raise esvr.BadInput(f"{text} stands for {digits} digits and matches {len(fitting)} files, but {len(others)} more have "
                            f"another number of digits, such as {others[0]}; name the folder, or the files in their order")
    numbers = sorted(fitting.values())
    steps = np.diff(numbers)
    if len(steps) and steps.min() != steps.max():
        gap = numbers[int(np.argmax(steps > steps.min()))] + int(steps.min())
        raise esvr.BadInput(f"{text}: slice {gap} is missing")
    return [os.path.join(folder, name) for name in sorted(fitting, key=fitting.get)]


def read_folder(folder, options):
    names = sorted(os.listdir(folder), key=natural)
    if {".zgroup", ".zarray", "zarr.json"} & set(names):
        raise esvr.BadInput(f"{folder} is a Zarr folder, which is not read yet; save the image as TIFF or HDF5")
    paths = [os.path.join(folder, name) for name in names if name.lower().endswith((".tif", ".tiff"))]
    if not paths:
        raise esvr.BadInput(f"{folder} has no TIFF file")
    return read_stack(paths, options)


def read_stack(paths, options):
    """A file for each slice. A file of several slices among them makes one longer stack."""
    images = [read_tiff(path, options) for path in paths]
    first = images[0]
    if len(images) == 1:
        return first
    for image in images[1:]:
        if image.size[:2] != first.size[:2] or image.dtype != first.dtype:
            raise esvr.BadInput(f"{image.path} has {image.size[0]} x {image.size[1]} pixels of {image.dtype.name}, and "
                                f"{first.path} has {first.size[0]} x {first.size[1]} of {first.dtype.name}; slices of one image "
                                "have one size and type")
        if [a.kind for a in image.axes] != [a.kind for a in first.axes]:
            raise esvr.BadInput(f"{image.path} has other axes than {first.path}")
    axes = [axis for axis in first.axes if axis.kind != "z"]
    parts = [Slices(image) for image in images]
    depth = sum(part.shape[0] for part in parts)
    stack = Image("TIFF", first.path, [Axis("z", depth)] + axes, first.dtype, Joined(parts), first.affine, first.unit,
                  first.scale, first.missing)
    if [os.fspath(p) for p in paths] != sorted(map(os.fspath, paths), key=natural):
        stack.warnings.append("the slices are in the order given, which is not that of the numbers in their names")
    return stack


class Slices:
    """The fetch of an image with z as its first axis."""

    def __init__(self, image):
        self.image, self.kinds = image, [axis.kind for axis in image.axes]
        self.at = self.kinds.index("z") if "z" in self.kinds else None
        self.shape = (image.size[2],) + tuple(axis.size for axis in image.axes if axis.kind != "z")

    def __call__(self, index):
        if self.at is None:
            part = self.image.fetch(tuple(index[1:]))
            return part[np.newaxis] if isinstance(index[0], slice) else part
        rest = list(index[1:])
        rest.insert(self.at, index[0])
        part = self.image.fetch(tuple(rest))
        if isinstance(index[0], slice):
            before = sum(isinstance(i, slice) for i in rest[:self.at])
            part = np.moveaxis(part, before, 0)
        return part


# -- one file ------------------------------------------------------------------------------------------------------
def read_tiff(path, options):
    tifffile = need("tifffile", "python3-tifffile", path, "TIFF")
    import logging
    logging.getLogger("tifffile").setLevel(logging.CRITICAL)
    with reading(path, "TIFF"):
        file = tifffile.TiffFile(path)
        page = file.pages.first
        series = series_of(path, file)
        shape, letters = series.shape, series.axes
        dtype = page.dtype
        if dtype is None:
            raise esvr.BadInput(f"{path} has {page.bitspersample} bits a sample, in a form that is not read")
        spacing, unit, scale = lengths_of(file, page)
        if file.is_imagej:
            letters = imagej_axes(file, letters)
        elif set(letters) & {"Q", "I"} and "Z" not in letters:
            letters = letters.replace("Q", "Z", 1) if "Q" in letters else letters.replace("I", "Z", 1)
    if options.axes:
        letters = options.axes.upper()
        if len(letters) != len(shape):
            raise esvr.UsageError(f"{path} has {len(shape)} axes ({' x '.join(map(str, shape))}); --axes must name each of them")
    axes = [Axis(TIFF_AXES.get(letter, letter.lower()), n) for letter, n in zip(letters, shape)]
    nodata = page.tags.get("GDAL_NODATA")
    missing = missing_if_any([float(str(nodata.value).strip("\0 "))]) if nodata else None
    image = Image("TIFF", path, axes, dtype, Pages(path, file, series), affine_of(spacing), unit, scale, missing)
    label_channels(file, image)
    return image


def series_of(path, file):
    """The series of the image. Pages that were written one by one are joined; other images are named."""
    series = [s for s in file.series if s.kind not in ("thumbnail", "label", "macro")]
    first = series[0]
    if file.is_ome and first.kind != "ome":
        return ome_series(path, file)
    if len(series) == 1:
        return first
    if all(s.shape == first.shape and s.dtype == first.dtype for s in series) and not file.is_ome:
        return JoinedSeries(series)
    raise esvr.BadInput(f"{path} has {len(series)} images of different sizes or positions "
                        f"({', '.join(' x '.join(map(str, s.shape)) for s in series[:4])}); save the one that is meant in a file "
                        "of its own")


class OmeSeries:
    """Pages in the order of OME's planes."""

    def __init__(self, pages, shape, axes):
        self.pages, self.shape, self.axes = pages, shape, axes


def ome_series(path, file):
    """The planes of OME-XML whose elements have a namespace prefix, which tifffile takes for a plain stack."""
    import xml.etree.ElementTree as tree
    local = lambda element: element.tag.rpartition("}")[2]
    pixels = next(e for e in tree.fromstring(file.ome_metadata).iter() if local(e) == "Pixels")
    fast_first = pixels.get("DimensionOrder", "XYCZT")[2:]
    sizes = {letter: int(pixels.get(f"Size{letter}", 1)) for letter in "CZT"}
    pages = list(file.pages)
    if product(sizes.values()) != len(pages):
        raise esvr.BadInput(f"{path} has {len(pages)} pages, and its OME-XML names {sizes['C']} channels of {sizes['Z']} slices at "
                            f"{sizes['T']} times")
    ordered = [None] * len(pages)
    step = {fast_first[0]: 1, fast_first[1]: sizes[fast_first[0]], fast_first[2]: sizes[fast_first[0]] * sizes[fast_first[1]]}
    for data in (e for e in pixels if local(e) == "TiffData" and e.get("IFD") is not None):
        first = sum(int(data.get(f"First{letter}", 0)) * step[letter] for letter in "CZT")
        for k in range(int(data.get("PlaneCount", 1))):
            ordered[first + k] = pages[int(data.get("IFD")) + k]
    if not any(ordered):
        ordered = pages
    if None in ordered:
        raise esvr.BadInput(f"{path}: the OME-XML names no page for some of its planes")
    slow_first = fast_first[::-1]
    return OmeSeries(ordered, tuple(sizes[letter] for letter in slow_first) + file.pages.first.shape, slow_first + "YX")


class JoinedSeries:
    """Series of the same size as slices of one image."""

    def __init__(self, series):
        self.series = series
        self.shape, self.axes = (len(series),) + series[0].shape, "Z" + series[0].axes
        self.pages = [page for s in series for page in s.pages]
        self.keyframe = series[0].keyframe
        if "Z" in series[0].axes:
            self.axes = "Q" + series[0].axes


class Pages:
    """A function for Image.fetch: the pages of a file, each read when it is needed."""

    def __init__(self, path, file, series):
        self.path, self.file, self.series = path, file, series
        page = file.pages.first
        self.page_shape, self.page = page.shape, page
        self.contiguous = None
        count = product(series.shape) // max(product(page.shape), 1)
        have = sum(1 for p in series.pages if p is not None)
        if have < count:  # ImageJ keeps the voxels of a large file behind its only page
            offset = page.dataoffsets[0]
            from .flat import Flat
            self.contiguous = Flat(path, page.dtype.newbyteorder(file.byteorder), series.shape, offset)
        else:
            there = os.path.getsize(path)
            for p in series.pages:
                for at, size in zip(p.dataoffsets, p.databytecounts):
                    if at + size > there:
                        raise esvr.BadInput(f"{path} is cut short: a part of the image ends at byte {at + size} of {there}")
                if page.compression == 1:  # frames do not know what all pages share
                    require_bytes(path, product(page.shape) * (page.bitspersample or 8) // 8, sum(p.databytecounts), "a page")
        self.leading = series.shape[:len(series.shape) - len(self._squeezed(page.shape, series.shape))]

    @staticmethod
    def _squeezed(page_shape, series_shape):
        """The axes of a page as they are in the series, where axes of one place may be left out."""
        shape = list(page_shape)
        while shape and tuple(shape) != tuple(series_shape[len(series_shape) - len(shape):]) and 1 in shape:
            shape.remove(1)
        return shape

    def _array(self, number):
        page = self.series.pages[number]
        try:
            array = page.asarray()
        except (ValueError, KeyError, NotImplementedError) as error:
            if "imagecodecs" not in str(error) and "decompress" not in str(error) and "compression" not in str(error):
                raise
            array = self._by_gdal(page, number)
        if self.page.tags.get(274) is not None:
            array = oriented(array, int(self.page.tags[274].value), self.path)
        return array.reshape(self.series.shape[len(self.leading):])

    def _by_gdal(self, page, number):
        """Pages in a code that tifffile cannot decode alone."""
        need("osgeo.gdal", "python3-gdal", self.path, f"TIFF with the compression {page.compression!s}")
        from osgeo import gdal
        gdal.UseExceptions()
        if page.predictor == 3 and self.file.byteorder == ">":
            raise esvr.BadInput(f"{self.path} has floats in big-endian order with predictor 3, which GDAL decodes wrongly")
        data = gdal.Open(f"GTIFF_DIR:{page.index + 1}:{self.path}")
        array = data.ReadAsArray()
        return np.moveaxis(array, 0, -1) if array.ndim == 3 and array.shape[0] != page.shape[0] else array

    def __call__(self, index):
        if self.contiguous:
            return self.contiguous(index)
        return self._fetch(index, 0, self.leading)

    def _fetch(self, index, at, leading):
        if not leading:
            return self._array(at)[tuple(index)]
        below = product(leading[1:])
        if isinstance(index[0], (int, np.integer)):
            return self._fetch(index[1:], at + int(index[0]) * below, leading[1:])
        return np.stack([self._fetch(index[1:], at + i * below, leading[1:]) for i in range(*index[0].indices(leading[0]))])


def oriented(array, orientation, path):
    """The rows from above and the columns from the left, as TIFF's Orientation says they are seen."""
    if orientation in (3, 4):
        array = array[::-1]
    if orientation in (2, 3):
        array = array[:, ::-1]
    if orientation > 4:
        raise esvr.BadInput(f"{path} has the orientation {orientation}, whose rows are columns; this is not read")
    return array


def imagej_axes(file, letters):
    """ImageJ may call slices times or nothing."""
    described = file.imagej_metadata or {}
    if "I" in letters or "Q" in letters:
        letters = letters.replace("I", "Z").replace("Q", "Z")
    if "Z" not in letters and letters.count("T") == 1 and "frames" not in described:
        letters = letters.replace("T", "Z")
    return letters


def lengths_of(file, page):
    """The edges of a voxel, their unit, and slope and intercept of the values."""
    if file.is_ome:
        return (*ome_lengths(file.ome_metadata), None)
    spacing, unit = [1.0, 1.0, 1.0], None
    for axis, tag in enumerate(("XResolution", "YResolution")):
        value = page.tags.get(tag)
        if value and value.value[0] and value.value[1]:
            spacing[axis] = value.value[1] / value.value[0]
    code = page.tags.get("ResolutionUnit")
    if not file.is_imagej:
        unit = RESOLUTION_UNITS.get(int(code.value)) if code else None
        # Without a unit of length, the resolutions say the ratio of the edges only, and nothing of the slices.
        return (spacing, unit, None) if unit and spacing[0] != 1.0 else ([1.0, spacing[1] / spacing[0], 1.0], None, None)
    described = {}
    for line in page.description.replace("\r\n", "\n").splitlines():
        key, separator, value = line.partition("=")
        if separator:
            described[key.strip()] = value.strip()
    unit = unit_named(described.get("unit", ""))
    spacing[2] = abs(float(described.get("spacing", 1.0))) or 1.0
    scale = None
    if described.get("cf") == "0" and "c0" in described and "c1" in described:
        scale = (float(described["c1"]), float(described["c0"]))
    elif described.get("cf") not in (None, "0", "20", "21", "22"):
        raise esvr.BadInput(f"the values have a calibration of ImageJ that is no line (cf={described['cf']}), which is not read; "
                            "--stored takes the stored numbers") if described["cf"].isdigit() else ValueError("calibration")
    return spacing, unit, scale


def ome_lengths(text):
    import xml.etree.ElementTree as tree
    pixels = next((e for e in tree.fromstring(text).iter() if e.tag.rpartition("}")[2] == "Pixels"), None)
    lengths = []
    for axis in "XYZ":
        size = pixels.get(f"PhysicalSize{axis}") if pixels is not None else None
        unit = unit_named(pixels.get(f"PhysicalSize{axis}Unit", "um")) if pixels is not None else None
        lengths.append((abs(float(size)), unit) if size and float(size) else (None, None))
    units = [unit for length, unit in lengths if length and unit]
    if not units or any(length and not unit for length, unit in lengths):
        return [length or 1.0 for length, _ in lengths], None
    to = "um"
    known = [length * factor(unit, to) for length, unit in lengths if length]
    return [length * factor(unit, to) if length else known[0] for length, unit in lengths], to


def label_channels(file, image):
    axis = image.axis(CHANNEL)
    if axis is None or not file.is_ome:
        return
    import xml.etree.ElementTree as tree
    names = [e.get("Name") or "" for e in tree.fromstring(file.ome_metadata).iter() if e.tag.rpartition("}")[2] == "Channel"]
    if len(names) == axis.size and any(names):
        axis.labels = names
