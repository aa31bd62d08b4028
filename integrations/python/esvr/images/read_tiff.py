"""Readers of TIFF: OME-TIFF, ImageJ, SCIFIO, tifffile's own and plain stacks, in one file or a file for each slice."""
import os
import re
import types
import xml.etree.ElementTree as tree

import numpy as np

import esvr

from .image import (CHANNEL, SPACE, TIME, Axis, Image, affine_of_steps, axes_from_letters, by, kind_named, mapped, missing_if_any,
                    natural, need, planes, product, reading, require_bytes, unit_named)
from .program import number_mark

TIFF_AXES = {"X": "x", "Y": "y", "Z": "z", "C": CHANNEL, "S": "sample", "T": TIME, "Q": "page", "I": "page"}
RESOLUTION_UNITS = {2: "in", 3: "cm"}


# -- a file for each slice -----------------------------------------------------------------------------------------
def files_of_pattern(text):
    """The files of a pattern like 'ct_####.tif', in the order of their numbers; None if it is no pattern."""
    folder, name = os.path.split(text)
    match, digits = number_mark(name)
    if not match:
        return None
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
        with reading(path, "TIFF"):
            images.append(read_tiff(path, options))
    first = images[0]
    if len(images) == 1:
        return first

    def pixels(image):
        return f"{image.size[0]} x {image.size[1]} pixels of {image.dtype.name}"

    def others(image):
        return [(a.kind, a.size) for a in image.axes if a.kind != "z"], [f"{n:.6g}" for n in image.affine.flat], image.unit, image.scale
    for image in images[1:]:
        if pixels(image) != pixels(first):
            raise esvr.BadInput(f"{image.path} has {pixels(image)}, and {first.path} has {pixels(first)}; slices of one image have one "
                                "size and type")
        if others(image) != others(first):
            raise esvr.BadInput(f"{image.path} has other axes, another pixel size or another calibration than {first.path}")
    slices = [(image, z) for image in images for z in range(image.size[2])]

    def read(number, index):
        image, z = slices[number]
        kinds, index = [axis.kind for axis in image.axes], list(index)
        if "z" in kinds:
            index.insert(kinds.index("z"), z)
        return image.fetch(tuple(index))
    stack = Image("TIFF", first.path, [Axis("z", len(slices)), *(axis for axis in first.axes if axis.kind != "z")], first.dtype,
                  planes([len(slices)], read), first.affine, first.unit, first.scale, first.missing, warnings=first.warnings)
    if first.unit and not any("distance" in text for text in stack.warnings) and first.axis("z") is None:
        stack.warnings.append("the distance of slices is not in the files, and is taken to be the edge of a pixel or 1")
    if paths != sorted(paths, key=natural):
        stack.warnings.append("the slices are in the order given, which is not that of the numbers in their names")
    return stack


# -- one file ------------------------------------------------------------------------------------------------------
def read_tiff(path, options):
    tifffile = need("tifffile", "python3-tifffile", path, "TIFF")
    file = tifffile.TiffFile(path)
    if "openmicroscopy.org" in (file.pages.first.description or "") and not file.is_ome:
        raise esvr.BadInput(f"{path}: its OME-XML is damaged")
    series, number = series_of(path, file, options.dataset)
    page = next((page.keyframe for page in series.pages if page is not None), file.pages.first)
    if page.dtype is None:
        raise esvr.BadInput(f"{path} has {page.bitspersample} bits a sample, in a form that is not read")
    letters = series.axes
    if file.is_imagej and not is_scifio(file):
        letters = imagej_axes(file, letters)
    elif set(letters) & {"Q", "I"} and "Z" not in letters:
        letters = letters.replace("Q" if "Q" in letters else "I", "Z", 1)
    axes = axes_from_letters(options.axes, series.shape, path) if options.axes else [
        Axis(TIFF_AXES.get(letter, letter.lower()), n) for letter, n in zip(letters, series.shape)]
    # What descriptions say of lengths (the step, the first place and the unit of x, y, z) and values. A step that is not known is None.
    said = types.SimpleNamespace(steps=[[1.0, 0.0, None] for _ in SPACE], scale=None, labels=[], warnings=[])
    describe(path, file, file.pages.first, said, number, options)
    if said.steps[2][0] is None:
        said.steps[2] = [said.steps[0][0], 0.0, said.steps[0][2]]
        if any(axis.kind == "z" and axis.size > 1 for axis in axes):
            said.warnings.append("the distance of slices is not in the file, and is taken to be the edge of a pixel")
    affine, unit = affine_of_steps([Axis(kind, 1) for kind in SPACE], said.steps)
    nodata = page.tags.get("GDAL_NODATA")
    image = Image("TIFF", path, axes, page.dtype, pages_of(path, file, series, page), affine, unit, said.scale,
                  missing_if_any([number_in(nodata.value)]) if nodata else None, warnings=said.warnings)
    image.name_channels(said.labels)
    file.filehandle.close()  # a process may open some 1,000 files, and a stack may have more
    return image


def number_in(text):
    text = str(text).strip("\0 ")
    return int(text) if text.lstrip("-").isdigit() else float(text)


def series_of(path, file, dataset):
    """The series of the image, and its number. Pages that were written one by one are joined; of other images, --dataset names
    one."""
    if is_scifio(file):
        return scifio_series(path, file), 0
    series = [s for s in file.series if s.kind not in ("thumbnail", "label", "macro") and not is_mask(s.keyframe)]
    first = series[0]
    if file.is_ome and first.kind != "ome":
        return ome_series(path, file), 0
    if dataset is not None:
        if not dataset.isdigit() or int(dataset) >= len(series):
            raise esvr.UsageError(f"{path} has {len(series)} images, and --dataset is the number of one from 0 on, not '{dataset}'")
        return series[int(dataset)], int(dataset)
    if len(series) == 1:
        return first, 0
    if all(s.shape == first.shape and s.dtype == first.dtype for s in series) and not file.is_ome:
        return types.SimpleNamespace(pages=[page for s in series for page in s.pages], shape=(len(series), *first.shape),
                                     axes=("Q" if "Z" in first.axes else "Z") + first.axes), 0
    raise esvr.UsageError(f"{path} has {len(series)} images: " + ", ".join(
        f"{k} ({s.name + ', ' if s.name else ''}{' x '.join(map(str, s.shape))})" for k, s in enumerate(series[:8]))
        + "; name one by --dataset and its number")


def is_mask(page):
    """Whether the pixels of a page say which pixels of another one are valid."""
    return page is not None and bool(page.subfiletype & 4)


def ome_series(path, file):
    """The planes of OME-XML that has no TiffData, which tifffile takes for a plain stack: they lie in the order of the
    dimensions."""
    if not ome_pixels(file):
        raise esvr.BadInput(f"{path} has its OME-XML in another file, which is not read; save it as OME-TIFF with a description of its own")
    pixels = ome_pixels(file)[0]
    slow_first = pixels.get("DimensionOrder", "XYCZT")[:1:-1]
    sizes = {letter: int(pixels.get(f"Size{letter}", 1)) for letter in "CZT"}
    pages = list(file.pages)
    if product(sizes.values()) != len(pages) or any(local_name(e) == "TiffData" for e in pixels):
        raise esvr.BadInput(f"{path} has {len(pages)} pages, which do not fit its OME-XML of {sizes['C']} channels of {sizes['Z']} "
                            f"slices at {sizes['T']} times")
    return types.SimpleNamespace(pages=pages, shape=tuple(sizes[letter] for letter in slow_first) + pages[0].shape,
                                 axes=slow_first + "YX")


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
        raise esvr.BadInput(f"{path} has {len(pages)} pages of {by(rows)} pixels, and SCIFIO's axes {said['axes']} of the lengths "
                            f"{said['lengths']}")
    letters = "".join({"z": "Z", "channel": "C", "time": "T"}.get(name, "Q") for name in names[:1:-1])
    return types.SimpleNamespace(pages=pages, shape=tuple(lengths[:1:-1]) + rows, axes=letters + "YXS"[:len(rows)])


def pages_of(path, file, series, page):
    """The function for Image.fetch of pages, each of which is read when it is needed. page is the first of them."""
    own = list(page.shape)  # the axes of a page as they are in the series, where axes of one place may be left out
    while own and tuple(own) != tuple(series.shape[len(series.shape) - len(own):]) and 1 in own:
        own.remove(1)
    leading, inner = series.shape[:len(series.shape) - len(own)], series.shape[len(series.shape) - len(own):]
    count = product(leading)
    if len(series.pages) == 1 and count > 1:  # the voxels of all slices lie behind the only page, as ImageJ keeps large files
        if page.compression != 1:
            raise esvr.BadInput(f"{path} has one page for {count} slices, and it is compressed")
        return mapped(path, page.dtype.newbyteorder(file.byteorder), series.shape, page.dataoffsets[0])
    if None in series.pages or len(series.pages) < count:
        raise esvr.BadInput(f"{path}: the pages of some of its {count} planes are missing; they may be in other files of the "
                            "same image")
    for p in series.pages:
        there, ends = p.parent.filehandle.size, [at + size for at, size in zip(p.dataoffsets, p.databytecounts)]
        if max(ends, default=0) > there:
            raise esvr.BadInput(f"{path} is cut short: a part of the image ends at byte {max(ends)} of {there}")
        if page.compression == 1 and all(p.databytecounts):  # a part of no bytes is one of GDAL's voxels without data
            require_bytes(path, product(page.shape) * (page.bitspersample or 8) // 8, sum(p.databytecounts), "a page")

    def read(number, index):
        file.filehandle.open()
        page = series.pages[number]
        handle = page.parent.filehandle
        handle.open()
        try:
            return page_array(path, file, page).reshape(inner)[index]
        finally:
            handle.close()
            file.filehandle.close()
    return planes(leading, read)


def page_array(path, file, page):
    """The pixels of a page as they are seen, which GDAL decodes where tifffile cannot do so alone."""
    try:
        array = page.asarray()
    except (ValueError, KeyError, NotImplementedError) as error:
        if not any(word in str(error) for word in ("imagecodecs", "decompress", "compression")):
            raise
        gdal = need("osgeo.gdal", "python3-gdal", path, f"TIFF with the compression {page.compression!s}")
        gdal.UseExceptions()
        if page.predictor == 3 and file.byteorder == ">":
            raise esvr.BadInput(f"{path} has floats in big-endian order with predictor 3, which GDAL decodes wrongly")
        data = gdal.Open(f"GTIFF_DIR:{page.index + 1}:{page.parent.filehandle.path}")
        array = data.ReadAsArray()
        if array.ndim == 3 and page.keyframe.axes.endswith("S"):
            array = np.moveaxis(array, 0, -1)
    said = page.keyframe.tags.get("Orientation")
    orientation = int(said.value) if said else 1
    if orientation > 4:
        raise esvr.BadInput(f"{path} has the orientation {orientation}, whose rows are columns; this is not read")
    turned = [letter for letter, those in (("Y", (3, 4)), ("X", (2, 3))) if orientation in those]
    return np.flip(array, [page.keyframe.axes.index(letter) for letter in turned])


# -- descriptions --------------------------------------------------------------------------------------------------
def imagej_axes(file, letters):
    """ImageJ may call slices times or nothing."""
    letters = letters.replace("I", "Z").replace("Q", "Z")
    is_time = "Z" in letters or letters.count("T") != 1 or "frames" in (file.imagej_metadata or {})
    return letters if is_time else letters.replace("T", "Z")


def describe(path, file, page, said, number, options):
    if file.is_ome:
        return describe_ome(ome_pixels(file), number, said)
    if is_scifio(file):
        return describe_scifio(page.description, said)
    if file.is_lsm:
        said.steps = [[abs(float(file.lsm_metadata[f"VoxelSize{axis}"])) or 1.0, 0.0, "m"] for axis in "XYZ"]
        return None
    for step, tag in zip(said.steps, ("XResolution", "YResolution")):
        value = page.tags.get(tag)
        if value and value.value[0] and value.value[1]:
            step[0] = value.value[1] / value.value[0]
    if file.is_imagej:
        return describe_imagej(path, page.description, said, options)
    code = page.tags.get("ResolutionUnit")
    unit = RESOLUTION_UNITS.get(int(code.value)) if code else None
    if unit and page.tags.get("XResolution"):
        said.steps = [[said.steps[0][0], 0.0, unit], [said.steps[1][0], 0.0, unit], [None, 0.0, unit]]
    else:  # without a unit, resolutions say the ratio of the edges only
        said.steps[0][0], said.steps[1][0] = 1.0, said.steps[1][0] / said.steps[0][0]
    if any(is_mask(series.keyframe) for series in file.series):
        said.warnings.append("the mask of valid pixels is not read")
    if page.tags.get("ModelPixelScaleTag"):
        said.warnings.append("the place on the earth is not read")
    if page.tags.get("GDAL_METADATA"):
        describe_gdal(path, str(page.tags["GDAL_METADATA"].value), said)
    return None


def lines_of(description):
    """The lines "key=value" of ImageJ and SCIFIO."""
    pairs = (line.partition("=") for line in description.replace("\r\n", "\n").splitlines())
    return {key.strip(): value.strip() for key, separator, value in pairs if separator}


def describe_imagej(path, description, said, options):
    lines = lines_of(description)
    said.steps[2][0] = abs(float(lines.get("spacing", 1.0))) or 1.0
    for step, axis in zip(said.steps, SPACE):
        # The origin of ImageJ is the place of the zero point, counted in voxels; units of y and z are there if they are not that of x.
        step[1:] = -float(lines.get(f"{axis}origin", 0.0)) * step[0], lines.get(f"{axis}unit", lines.get("unit", ""))
    units = [unit_named(unit) for _, _, unit in said.steps]
    if None in units and any(units):
        raise esvr.BadInput(f"{path} has edges in '{', '.join(unit for _, _, unit in said.steps)}', of which one is no unit of length")
    calibration = lines.get("cf", "20")
    if calibration == "0" and "c0" in lines and "c1" in lines:
        said.scale = (float(lines["c1"]), float(lines["c0"]))
    elif calibration not in ("0", "20") and not options.stored:
        raise esvr.BadInput(f"{path}: the values have a calibration of ImageJ that is no line (cf={calibration}), which is not read; "
                            "--stored takes the stored numbers")


def describe_scifio(description, said):
    lines = lines_of(description)
    names, scales, units = ([text.strip() for text in lines.get(key, "").split(",")] for key in ("axes", "scales", "units"))
    if len(scales) == len(names):
        units = units if len(units) == len(names) else [None] * len(names)
        steps = {kind_named(name): [abs(float(scale)) or 1.0 if scale not in ("", "null") else 1.0, 0.0, unit]
                 for name, scale, unit in zip(names, scales, units)}
        said.steps = [steps.get(kind, [1.0, 0.0, units[0]]) for kind in SPACE]


def describe_gdal(path, text, said):
    """The calibration of GDAL, which must be the same in all bands."""
    found = {}
    for item in tree.fromstring(text.strip("\0 ")).iter("Item"):
        if item.get("role") in ("scale", "offset"):
            found.setdefault(item.get("role"), set()).add(float(item.text))
    if any(len(numbers) > 1 for numbers in found.values()):
        raise esvr.BadInput(f"{path} has bands of different calibrations, which are not read")
    if found:
        said.scale = (*found.get("scale", {1.0}), *found.get("offset", {0.0}))


def local_name(element):
    return element.tag.rpartition("}")[2]


def ome_pixels(file):
    """The elements Pixels of all images."""
    return [e for e in tree.fromstring(file.ome_metadata).iter() if local_name(e) == "Pixels"]


def describe_ome(images, number, said):
    pixels = images[min(number, len(images) - 1)]
    said.labels = [e.get("Name") or "" for e in pixels if local_name(e) == "Channel"]
    steps = [[abs(float(pixels.get(f"PhysicalSize{axis}") or 0.0)), 0.0, pixels.get(f"PhysicalSize{axis}Unit", "um")] for axis in "XYZ"]
    known = next((step for step in steps if step[0]), None)
    if known:
        said.steps = [step if step[0] else list(known) for step in steps[:2]] + [steps[2] if steps[2][0] else [None, 0.0, None]]
