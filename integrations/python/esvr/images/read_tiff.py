"""Readers of TIFF: OME-TIFF, ImageJ, tifffile's own and plain stacks, in one file or a file for each slice."""
import os
import re
import xml.etree.ElementTree as tree

import numpy as np

import esvr

from .flat import Flat, Joined
from .image import CHANNEL, TIME, Axis, Image, affine_of, affine_of_steps, axes_from_letters, factor, kind_named, missing_if_any, \
    natural, need, product, reading, require_bytes, unit_named

TIFF_AXES = {"X": "x", "Y": "y", "Z": "z", "C": CHANNEL, "S": "sample", "T": TIME, "Q": "page", "I": "page"}
RESOLUTION_UNITS = {2: "in", 3: "cm"}


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


def read_stack(paths, options):
    """A file for each slice. A file of several slices among them makes one longer stack."""
    images = []
    for path in paths:
        images.append(read_tiff(path, options))
        images[-1].fetch.file.filehandle.close()  # a process may open some 1,000 files
    first = images[0]
    if len(images) == 1:
        return first
    for image in images[1:]:
        if image.size[:2] != first.size[:2] or image.dtype != first.dtype:
            raise esvr.BadInput(f"{image.path} has {image.size[0]} x {image.size[1]} pixels of {image.dtype.name}, and "
                                f"{first.path} has {first.size[0]} x {first.size[1]} of {first.dtype.name}; slices of one image "
                                "have one size and type")
        if [(a.kind, a.size) for a in image.axes if a.kind != "z"] != [(a.kind, a.size) for a in first.axes if a.kind != "z"]:
            raise esvr.BadInput(f"{image.path} has other axes than {first.path}")
        if image.scale != first.scale or not np.allclose(image.affine, first.affine) or image.unit != first.unit:
            raise esvr.BadInput(f"{image.path} has another pixel size or calibration than {first.path}")
    axes = [axis for axis in first.axes if axis.kind != "z"]
    parts = [Slices(image) for image in images]
    stack = Image("TIFF", first.path, [Axis("z", sum(part.shape[0] for part in parts))] + axes, first.dtype, Joined(parts),
                  first.affine, first.unit, first.scale, first.missing, warnings=list(first.warnings))
    if first.unit and not any("distance" in text for text in stack.warnings) and first.axis("z") is None:
        stack.warnings.append("the distance of slices is not in the files, and is taken to be the edge of a pixel or 1")
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
    with reading(path, "TIFF"):
        file = tifffile.TiffFile(path)
        page = file.pages.first
        series = series_of(path, file, options.dataset)
        shape, letters = series.shape, series.axes
        if page.dtype is None:
            raise esvr.BadInput(f"{path} has {page.bitspersample} bits a sample, in a form that is not read")
        if file.is_imagej and not is_scifio(file):
            letters = imagej_axes(file, letters)
        elif set(letters) & {"Q", "I"} and "Z" not in letters:
            letters = letters.replace("Q", "Z", 1) if "Q" in letters else letters.replace("I", "Z", 1)
        if options.axes:
            axes = axes_from_letters(options.axes, shape, path)
        else:
            axes = [Axis(TIFF_AXES.get(letter, letter.lower()), n) for letter, n in zip(letters, shape)]
        space = Space()
        describe(path, file, page, space, options)
        nodata = page.tags.get("GDAL_NODATA")
        missing = missing_if_any([float(str(nodata.value).strip("\0 "))]) if nodata else None
        if space.spacing[2] is None:
            space.spacing[2] = space.spacing[0]
            if next((axis.size for axis in axes if axis.kind == "z"), 1) > 1:
                space.warnings.append("the distance of slices is not in the file, and is taken to be the edge of a pixel")
        image = Image("TIFF", path, axes, page.dtype, Pages(path, file, series), affine_of(space.spacing, space.origin), space.unit,
                      space.scale, missing, warnings=space.warnings)
    if image.axis(CHANNEL) and len(space.labels) == image.axis(CHANNEL).size and any(space.labels):
        image.axis(CHANNEL).labels = space.labels
    return image


def series_of(path, file, dataset):
    """The series of the image. Pages that were written one by one are joined; of other images, --dataset names one."""
    if is_scifio(file):
        return scifio_series(path, file)
    series = [s for s in file.series if s.kind not in ("thumbnail", "label", "macro")]
    first = series[0]
    if file.is_ome and first.kind != "ome":
        return ome_series(path, file)
    if dataset is not None:
        if not dataset.isdigit() or int(dataset) >= len(series):
            raise esvr.UsageError(f"{path} has {len(series)} images, and --dataset is the number of one from 0 on, not '{dataset}'")
        return series[int(dataset)]
    if len(series) == 1:
        return first
    if all(s.shape == first.shape and s.dtype == first.dtype for s in series) and not file.is_ome:
        return JoinedSeries(series)
    raise esvr.UsageError(f"{path} has {len(series)} images: " + ", ".join(
        f"{k} ({s.name + ', ' if s.name else ''}{' x '.join(map(str, s.shape))})" for k, s in enumerate(series[:8]))
        + "; name one by --dataset and its number")


class NamedPages:
    """Pages in the order of the planes that a description names."""

    def __init__(self, pages, shape, axes):
        self.pages, self.shape, self.axes = pages, shape, axes


def ome_series(path, file):
    """The planes of OME-XML that has no TiffData, which tifffile takes for a plain stack: they lie in the order of the dimensions."""
    pixels = next(e for e in tree.fromstring(file.ome_metadata).iter() if local_name(e) == "Pixels")
    slow_first = pixels.get("DimensionOrder", "XYCZT")[:1:-1]
    sizes = {letter: int(pixels.get(f"Size{letter}", 1)) for letter in "CZT"}
    pages = list(file.pages)
    if product(sizes.values()) != len(pages) or any(local_name(e) == "TiffData" for e in pixels):
        raise esvr.BadInput(f"{path} has {len(pages)} pages, which do not fit its OME-XML of {sizes['C']} channels of {sizes['Z']} "
                            f"slices at {sizes['T']} times")
    return NamedPages(pages, tuple(sizes[letter] for letter in slow_first) + file.pages.first.shape, slow_first + "YX")


def is_scifio(file):
    """Whether the file has SCIFIO's axes, which tifffile takes for ImageJ's."""
    return {"SCIFIO", "axes", "lengths"} <= set(lines_of(file.pages.first.description or ""))


def scifio_series(path, file):
    said = lines_of(file.pages.first.description)
    names = [name.strip().lower() for name in said["axes"].split(",")]
    lengths = [int(length) for length in said["lengths"].split(",")]
    pages, rows = list(file.pages), file.pages.first.shape
    if names[:2] != ["x", "y"] or len(names) != len(lengths) or tuple(lengths[1::-1]) != rows[:2] or \
            product(lengths[2:]) != len(pages):
        raise esvr.BadInput(f"{path} has {len(pages)} pages of {rows[1]} x {rows[0]} pixels, and SCIFIO's axes {said['axes']} of the "
                            f"lengths {said['lengths']}")
    letters = "".join({"z": "Z", "channel": "C", "time": "T"}.get(name, "Q") for name in names[:1:-1])
    return NamedPages(pages, tuple(lengths[:1:-1]) + rows, letters + "YXS"[:len(rows)])


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
        self.page, self.contiguous = page, None
        count = product(series.shape) // max(product(page.shape), 1)
        if len(series.pages) == 1 and count > 1:  # the voxels of all slices lie behind the only page, as ImageJ keeps large files
            self.contiguous = Flat(path, page.dtype.newbyteorder(file.byteorder), series.shape, page.dataoffsets[0])
            if page.compression != 1:
                raise esvr.BadInput(f"{path} has one page for {count} slices, and it is compressed")
        elif None in series.pages or len(series.pages) < count:
            raise esvr.BadInput(f"{path}: the pages of some of its {count} planes are missing; they may be in other files of the "
                                "same image")
        else:
            for p in series.pages:
                there = p.parent.filehandle.size
                for at, size in zip(p.dataoffsets, p.databytecounts):
                    if at + size > there:
                        raise esvr.BadInput(f"{path} is cut short: a part of the image ends at byte {at + size} of {there}")
                if page.compression == 1 and all(p.databytecounts):  # a part of no bytes is one of GDAL's voxels without data
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
        handle = page.parent.filehandle
        was_closed = handle.closed
        if was_closed:
            handle.open()
        try:
            return self._decoded(page, number)
        finally:
            if was_closed:
                handle.close()

    def _decoded(self, page, number):
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
        data = gdal.Open(f"GTIFF_DIR:{page.index + 1}:{page.parent.filehandle.path}")
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


class Space:
    """What descriptions say of lengths and values. A distance of slices that is not known is None."""

    def __init__(self):
        self.spacing, self.origin, self.unit, self.scale = [1.0, 1.0, 1.0], [0.0, 0.0, 0.0], None, None
        self.labels, self.warnings = [], []


def describe(path, file, page, space, options):
    if file.is_ome:
        describe_ome(file.ome_metadata, space)
    elif is_scifio(file):
        describe_scifio(page.description, space)
    elif file.is_imagej:
        describe_resolution(page, space)
        describe_imagej(path, page.description, space, options)
    elif file.is_lsm:
        space.spacing = [abs(float(file.lsm_metadata[f"VoxelSize{axis}"])) or 1.0 for axis in "XYZ"]
        space.unit = "m"
    else:
        describe_resolution(page, space)
        code = page.tags.get("ResolutionUnit")
        unit = RESOLUTION_UNITS.get(int(code.value)) if code else None
        if unit and page.tags.get("XResolution"):
            space.unit, space.spacing[2] = unit, None
        else:  # without a unit, resolutions say the ratio of the edges only
            space.spacing = [1.0, space.spacing[1] / space.spacing[0], 1.0]
        if page.tags.get("ModelPixelScaleTag"):
            space.warnings.append("the place on the earth is not read")
        if page.tags.get("GDAL_METADATA"):
            describe_gdal(path, str(page.tags["GDAL_METADATA"].value), space)


def describe_resolution(page, space):
    for axis, tag in enumerate(("XResolution", "YResolution")):
        value = page.tags.get(tag)
        if value and value.value[0] and value.value[1]:
            space.spacing[axis] = value.value[1] / value.value[0]


def lines_of(description):
    """The lines "key=value" of ImageJ and SCIFIO."""
    pairs = (line.partition("=") for line in description.replace("\r\n", "\n").splitlines())
    return {key.strip(): value.strip() for key, separator, value in pairs if separator}


def describe_imagej(path, description, space, options):
    said = lines_of(description)
    space.unit = unit_named(said.get("unit", ""))
    space.spacing[2] = abs(float(said.get("spacing", 1.0))) or 1.0
    for column, name in ((1, "yunit"), (2, "zunit")):  # only where they are not that of x
        if name in said and unit_named(said[name]) != space.unit:
            if not space.unit or not unit_named(said[name]):
                raise esvr.BadInput(f"{path} has edges in '{said.get('unit', '')}' and '{said[name]}', of which one is no unit of length")
            space.spacing[column] *= factor(unit_named(said[name]), space.unit)
    # The origin of ImageJ is the place of the zero point, counted in voxels.
    space.origin = [-float(said.get(f"{axis}origin", 0.0)) * step for axis, step in zip("xyz", space.spacing)]
    calibration = said.get("cf", "20")
    if calibration == "0" and "c0" in said and "c1" in said:
        space.scale = (float(said["c1"]), float(said["c0"]))
    elif calibration not in ("0", "20") and not options.stored:
        raise esvr.BadInput(f"{path}: the values have a calibration of ImageJ that is no line (cf={calibration}), which is not read; "
                            "--stored takes the stored numbers")


def describe_scifio(description, space):
    said = lines_of(description)
    names = [name.strip().lower() for name in said["axes"].split(",")]
    scales, units = said.get("scales", "").split(","), said.get("units", "").split(",")
    if len(scales) != len(names):
        return
    axes = [Axis(kind_named(name), 1) for name in names]
    numbers = [abs(float(scale)) or 1.0 if scale.strip() not in ("", "null") else 1.0 for scale in scales]
    units = units if len(units) == len(names) else [None] * len(names)
    matrix, space.unit = affine_of_steps(axes, [(step, 0.0, unit) for step, unit in zip(numbers, units)])
    space.spacing = list(np.diag(matrix)[:3])


def describe_gdal(path, text, space):
    """The calibration of GDAL, which must be the same in all bands."""
    found = {}
    for item in tree.fromstring(text.strip("\0 ")).iter("Item"):
        if item.get("role") in ("scale", "offset"):
            found.setdefault(item.get("role"), set()).add(float(item.text))
    if any(len(numbers) > 1 for numbers in found.values()):
        raise esvr.BadInput(f"{path} has bands of different calibrations, which are not read")
    if found:
        space.scale = (*found.get("scale", {1.0}), *found.get("offset", {0.0}))


def local_name(element):
    return element.tag.rpartition("}")[2]


def describe_ome(text, space):
    root = tree.fromstring(text)
    pixels = next(e for e in root.iter() if local_name(e) == "Pixels")
    space.labels = [e.get("Name") or "" for e in pixels if local_name(e) == "Channel"]
    sizes = [abs(float(pixels.get(f"PhysicalSize{axis}") or 0.0)) for axis in "XYZ"]
    units = [unit_named(pixels.get(f"PhysicalSize{axis}Unit", "um")) for axis in "XYZ"]
    if not any(sizes):
        return
    if all(unit for size, unit in zip(sizes, units) if size):
        space.unit = "um"
        sizes = [size * factor(unit, "um") if size else 0.0 for size, unit in zip(sizes, units)]
    known = next(size for size in sizes if size)
    space.spacing = [size or known for size in sizes[:2]] + [sizes[2] or None]
