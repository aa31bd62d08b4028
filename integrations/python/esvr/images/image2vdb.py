"""Images as grids: `python3 -m esvr.images.image2vdb IN... OUT.vdb`."""
import argparse
import os
import sys

import numpy as np

import esvr

from . import program, read_dicom, read_nrrd, read_science, read_tiff, read_volumes
from .image import BRICK, TIME, VECTOR, Part, affine_of, factor, head_of, natural, reading
from .program import Parser, byte_size, count, length_unit, number, option

EXACT = {"float": 24, "vec3s": 24, "double": 53, "int64": 63}  # up to 2 to this power, grids of these types hold every whole number
SMALLEST_VOLUME = 1e-14  # of a voxel; OpenVDB takes a matrix with a determinant of 3e-15 for singular
UNITS = ["mm", "um", "nm", "angstrom"]
SLAB_BYTES = 64 << 20


def three(kind, counts):
    def numbers(text):
        values = [kind(word) for word in text.split(",")]
        if len(values) not in counts or any(not value > 0 for value in values):
            raise argparse.ArgumentTypeError(f"'{text}' is not {' or '.join(map(str, counts))} numbers above 0")
        return values * 3 if len(values) == 1 else values
    return numbers


def place(text):
    return text if text == "all" else count()(text)


PARSER = Parser(
    "image2vdb", "Converts an image of voxels to sparse VDB grids.",
    "  image2vdb IN... OUT.vdb [options]     IN: an image, slices in order, a folder or 'ct_####.tif'",
    [option("name", "NAME", "name of the grid (density)", default="density"),
     option("threshold", "T", "smallest value of active voxels", number),
     option("background", "B", "value of inactive voxels (0); without --threshold, other values are active", number, default=0.0),
     option("channel", "K|all", "which of several channels, colors or components, from 0 on; all: a grid for each", place),
     option("time", "K|all", "which of several times, from 0 on; all: a file for each, as OUT.####.vdb", place),
     option("dataset", "NAME", "HDF5, netCDF, Zarr, VTI: the array; DICOM: the series; OME-TIFF: the image"),
     option("axes", "LETTERS", "what the axes are, the slowest first: tczyx; v for components of vectors"),
     option("stored", "", "the stored numbers, not the calibrated values"),
     option("as", "TYPE", "auto, float, double, integer or mask (auto)", ("auto", "float", "double", "integer", "mask"),
            default="auto"),
     option("unit", "UNIT", "unit of lengths (mm; where voxels are too small for OpenVDB, a smaller one)", length_unit),
     option("voxel-size", "S|X,Y,Z", "edges of a voxel, instead of the transform of the image", three(float, (1, 3))),
     option("nonfinite", "WORD", "NaN and infinite voxels: refuse, zero or missing (refuse)",
            ("refuse", "zero", "missing"), default="refuse"),
     option("normalise", "", "divide by the type's largest value, or by the largest of a float image"),
     option("dims", "X,Y,Z", "RAW: number of voxels along each axis", three(int, (3,))),
     option("type", "TYPE", "RAW: uint8, int16, float32, ..."),
     option("endian", "little|big", "RAW: byte order (little)", ("little", "big"), default="little"),
     option("skip", "BYTES", "RAW: length of a header (0)", count(), default=0),
     option("max-memory", "SIZE", "limit on the memory of the image and of the grid (4G)", byte_size, default=4 * 10 ** 9),
     option("force", "", "replace OUT.vdb if it exists", short="f")],
    "TIFF, NIfTI, DICOM, NRRD, MetaImage, MRC, VTI, HDF5, netCDF, Zarr, NPY and RAW are read. Values are calibrated, missing "
    "voxels are inactive, lengths are millimetres, and patients are RAS. vdb2image is the way back.",
    "  image2vdb cells.ome.tif cells.vdb --unit um --channel 0\n  image2vdb brain.nii.gz brain.vdb --threshold 40\n"
    "  image2vdb weather.nc t.vdb --dataset t --time 0")


# -- formats -------------------------------------------------------------------------------------------------------
def read_one_dicom(path, options):
    return read_dicom.read_dicom([path], options)


# The name of a format, its reader, how names of its files end, and by what its files begin at some place.
FORMATS = [
    ("TIFF", read_tiff.read_tiff, (".tif", ".tiff"), 0, (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")),
    ("NRRD", read_nrrd.read_nrrd, (".nrrd", ".nhdr"), 0, b"NRRD"),
    ("NIfTI", read_volumes.read_nifti, (".nii", ".hdr", ".img"), 344, (b"n+1\0", b"ni1\0")),
    ("NIfTI", read_volumes.read_nifti, (), 4, (b"n+2\0", b"ni2\0")),
    ("MetaImage", read_nrrd.read_metaimage, (".mha", ".mhd"), 0, ()),
    ("MRC", read_volumes.read_mrc, (".mrc", ".map", ".ccp4", ".rec", ".st", ".mrcs"), 208, b"MAP "),
    ("VTI", read_volumes.read_vti, (".vti",), 0, ()),
    ("netCDF", read_science.read_netcdf, (".nc", ".nc4", ".cdf"), 0, b"CDF"),
    *[("HDF5", read_science.read_hdf5, (".h5", ".hdf5", ".hdf"), at, b"\x89HDF\r\n\x1a\n") for at in (0, 512, 1024, 2048)],
    ("NPY", read_volumes.read_npy, (".npy",), 0, b"\x93NUMPY"),
    ("DICOM", read_one_dicom, (".dcm",), 128, b"DICM"),
    ("Zarr", read_science.read_zarr, (".zarr", ".zarr.zip", ".ozx"), 0, ())]
TIFF, VTI, NETCDF, DICOM = (next(f for f in FORMATS if f[0] == name) for name in ("TIFF", "VTI", "netCDF", "DICOM"))


def format_of(path):
    """The format of a file, by its content or else by its name."""
    head = head_of(path, 4096)
    if read_dicom.is_dicom(path):
        return DICOM
    name = path.lower().removesuffix(".gz")
    by_name = next((f for f in FORMATS if f[2] and name.endswith(f[2])), ("RAW", read_volumes.read_raw))
    if b"<VTKFile" in head:
        return VTI
    found = next((f for f in FORMATS if f[4] and head[f[3]:].startswith(f[4])), by_name)
    return NETCDF if found[0] == "HDF5" and by_name is NETCDF else found


def open_image(paths, options):
    """The image of a file, of slices, or of a folder."""
    paths = [os.fspath(path) for path in paths]
    if len(paths) == 1 and not os.path.exists(paths[0]):
        paths = read_tiff.files_of_pattern(paths[0]) or paths
    if len(paths) == 1 and os.path.isdir(paths[0]):
        return open_folder(paths[0], options)
    for path in paths:
        if not os.path.isfile(path):
            raise esvr.BadInput(f"{path} cannot be read: No such file")
    with reading(paths[0], "an image"):
        name, read = format_of(paths[0])[:2]
    if name not in ("TIFF", "DICOM") and len(paths) > 1:
        raise esvr.UsageError(f"several files make one image only if they are TIFF or DICOM, and {paths[0]} is not")
    if (options.dims or options.type) and name != "RAW":
        raise esvr.UsageError(f"--dims and --type are for RAW images only, and {paths[0]} has a format of its own")
    with reading(paths[0], name):
        return read(paths[0], options) if len(paths) == 1 else \
            read_tiff.read_stack(paths, options) if name == "TIFF" else read_dicom.read_dicom(paths, options)


def open_folder(folder, options):
    """A folder is a Zarr image, a stack of TIFF files, or series of DICOM files that may lie in folders of their own."""
    is_zarr = read_science.is_zarr(folder)
    with reading(folder, "Zarr" if is_zarr else "an image"):
        if is_zarr:
            return read_science.read_zarr(folder, options)
        slices = [os.path.join(folder, name) for name in sorted(os.listdir(folder), key=natural)
                  if name.lower().endswith((".tif", ".tiff"))]
        if slices:
            return read_tiff.read_stack(slices, options)
        paths = [os.path.join(parent, name) for parent, _, names in sorted(os.walk(folder)) for name in sorted(names, key=natural)]
        paths = [path for path in paths if os.path.isfile(path) and read_dicom.is_dicom(path)]
        if not paths:
            raise esvr.BadInput(f"{folder} has no TIFF and no DICOM file, and is no Zarr image")
        return read_dicom.read_dicom(paths, options, folder)


# -- choices -------------------------------------------------------------------------------------------------------
def chosen_parts(image, options):
    """For each time that is asked for, its number and the parts of the channels with the names of their grids."""
    others = [axis for axis in image.choices() if axis.kind != TIME and axis.size > 1]
    if len(others) > 1:
        raise esvr.UsageError(f"{image.path} has several axes besides those of space and time: "
                              f"{'; '.join(axis.text() for axis in others)}; this is not read")
    channels, times = others[0] if others else image.axis(VECTOR), image.axis(TIME)
    places, unsaid = {axis.kind: [0] for axis in image.choices()}, []
    for axis, asked, flag in ((channels, options.channel, "--channel"), (times, options.time, "--time")):
        size = axis.size if axis else 1
        if asked is None:
            if size > 1 and axis.kind != VECTOR:
                unsaid.append((axis, flag))
        elif asked != "all" and asked >= size:
            raise esvr.UsageError(f"{flag} must be 0 to {size - 1}: {image.path} has {axis.text() if axis else 'only one'}")
        elif axis:
            places[axis.kind] = range(size) if asked == "all" else [asked]
    if unsaid:
        raise esvr.UsageError(f"{image.path} has several images: {'; '.join(axis.text() for axis, _ in unsaid)}; choose by "
                              + " and ".join(f"{flag} K or {flag} all" for _, flag in unsaid))
    if image.components not in (1, 3) and VECTOR not in places:
        raise esvr.UsageError(f"{image.path} has vectors of {image.components} components; choose by --channel")
    selected = places.pop(channels.kind, [None]) if channels else [None]
    names = channel_names(channels, selected, options.name)
    fixed = {kind: numbers[0] for kind, numbers in places.items()}
    for time in places.get(TIME, [0]):
        here = {**fixed, **({TIME: time} if times else {})}
        yield time, [(name, Part(image, here if k is None else {**here, channels.kind: k})) for name, k in zip(names, selected)]


def channel_names(axis, selected, name):
    """The names of grids: that of the option for one, and else the labels of the channels, or numbers."""
    if len(selected) == 1:
        return [name]
    labels = [axis.labels[k] if k < len(axis.labels) else "" for k in selected]
    return labels if all(labels) and len(set(labels)) == len(labels) else [f"{name}_{k}" for k in selected]


# -- lengths -------------------------------------------------------------------------------------------------------
def transform_of(image, options):
    """The matrix, and the unit of its lengths (None if nothing says it)."""
    if options.voxel_size:
        return affine_of(options.voxel_size), options.unit
    matrix, unit = np.array(image.affine, float), options.unit
    if not np.all(np.isfinite(matrix)):
        raise esvr.BadInput(f"{image.path}: the transform of the image is not finite (--voxel-size gives another)")
    volume = abs(np.linalg.det(matrix[:3, :3]))
    if volume == 0 or volume < 1e-12 * np.prod(np.linalg.norm(matrix[:3, :3], axis=0)):
        raise esvr.BadInput(f"{image.path}: the axes of the image are linearly dependent (--voxel-size gives others)")
    if image.unit:
        unit = unit or next((u for u in UNITS if volume * factor(image.unit, u) ** 3 >= SMALLEST_VOLUME), UNITS[-1])
        matrix[:3] *= factor(image.unit, unit)
    if abs(np.linalg.det(matrix[:3, :3])) < SMALLEST_VOLUME:
        raise esvr.BadInput(f"{image.path}: voxels of {', '.join(f'{n:.3g}' for n in np.linalg.norm(matrix[:3, :3], axis=0))} "
                            f"{unit or '(no unit)'} are too small for OpenVDB; --unit or --voxel-size gives other edges")
    return matrix, unit


# -- voxels --------------------------------------------------------------------------------------------------------
class Beyond(Exception):
    """A whole number that the grid does not hold."""


class Missing(Exception):
    """The first missing voxel, from which on exactly those are inactive."""


class Conversion:
    """How a part of an image becomes a grid, and what was found in it: `missing` voxels, `nonfinite` ones that are now 0, and
    whether values of float64 are rounded."""

    def __init__(self, name, part, options, log):
        self.name, self.part, self.image, self.options, self.log = name, part, part.image, options, log
        self.kind, self.has_missing, self.is_rounded = self._type(), False, False
        self.normal = self._largest() if options.normalise else None

    def _type(self):
        """The type of the grid. It is first tried whether floats hold all values."""
        dtype, asked = self.image.dtype, getattr(self.options, "as")
        is_whole = dtype.kind in "iub" and (self.options.stored or self.image.scale is None)
        if self.part.is_vector:
            if asked not in ("auto", "float"):
                raise esvr.UsageError("vectors become a grid of floats")
            return "vec3s"
        if asked == "double" and self.options.normalise:
            raise esvr.UsageError("--normalise makes floats")
        if asked == "integer" and not is_whole:
            raise esvr.UsageError(f"{self.image.path} has values of type {dtype.name}, which are no integers")
        if asked == "integer":
            return "int32" if dtype.itemsize < 4 or dtype == np.int32 else "int64"
        if asked == "mask" or asked == "auto" and dtype.kind == "b":
            return "bool"
        return "double" if asked == "double" else "int64" if asked == "auto" and is_whole and dtype.itemsize == 8 else "float"

    def _slabs(self):
        """The values slab by slab: the first slice, values, and missing voxels. A slab has a multiple of 8 slices, and keeps to the
        memory."""
        image, part, most = self.image, self.part, self.options.max_memory
        brick_bytes = BRICK * np.prod(image.size, dtype=float) / part.slices * max(image.dtype.itemsize, 4) * 3
        brick_bytes *= image.components if part.is_vector else 1
        if brick_bytes > most:
            raise esvr.MemoryExceeded(f"{image.path}: {BRICK} slices of the image ask for {brick_bytes:.3g} bytes of memory, and "
                                      f"{most} are allowed")
        fitting = int(min(SLAB_BYTES, most / 4) / brick_bytes)
        step = BRICK * max(1, min(fitting, -(-image.block // BRICK) if image.block > 1 else 4))
        for first in range(0, part.slices, step):
            with reading(image.path, image.format):
                values, gone = part.values(first, min(first + step, part.slices), self.options.stored)
            yield first, values, gone
            self.log.progress("reading", min(1.0, (first + step) / part.slices))

    def _largest(self):
        """By what --normalise divides: the largest value of a type of integers, or else that of the image."""
        if self.image.dtype.kind in "iu" and self.image.scale is None:
            return float(np.iinfo(self.image.dtype).max)
        most = 0.0
        for _, values, gone in self._slabs():
            kept = np.isfinite(values) if gone is None else np.isfinite(values) & ~gone
            most = max(most, float(np.abs(values[kept].astype(np.float64)).max(initial=0.0)))
        if most == 0.0:
            raise esvr.BadInput(f"{self.image.path}: every voxel is 0, so the image cannot be normalised")
        return most

    def grid(self):
        image, kind, normal, options = self.image, self.kind, self.normal, self.options
        self.missing = self.nonfinite = 0
        matrix, unit = transform_of(image, options)
        metadata = {"image_format": image.format, "image_size": tuple(image.size), "image_type": image.dtype.name, **image.metadata}
        metadata.update({name: text for name, text in (("length_unit", unit), ("image_unit", image.unit)) if text})
        threshold, by_builder = options.threshold, kind not in ("bool", "vec3s")
        if self.has_missing and threshold is None and kind != "bool":
            metadata["image_missing"] = True  # all inactive voxels are missing

        def as_value(number):  # with the same rounding as voxels
            return float(np.float32(number / normal)) if normal else number
        builder = esvr.GridBuilder(kind, name=self.name, background=as_value(options.background) if by_builder else 0,
                                   threshold=as_value(threshold) if threshold is not None and by_builder else None,
                                   grid_class="fog volume" if kind == "float" else "unknown", transform=matrix, metadata=metadata,
                                   max_bytes=options.max_memory)
        for first, values, gone in self._slabs():
            values, gone = self._converted(values, first, gone)
            if gone is not None and gone.any():
                if not self.has_missing:
                    raise Missing
                self.missing += int(gone.sum())
            active = None
            if self.has_missing or threshold is not None and not by_builder:
                active = np.ones(values.shape[:3], bool) if gone is None else ~gone
                if kind == "bool":
                    active &= values
                elif threshold is not None:
                    active &= values >= threshold if values.ndim == 3 else np.linalg.norm(values, axis=3) >= threshold
            if normal:
                values = (values.astype(np.float64) / normal).astype(np.float32)
            origin = [0, 0, 0]
            origin[self.part.slab_axis] = first
            builder.add(values, tuple(origin), active)
        return builder.finish()

    def _converted(self, values, first, gone):
        """The values in a type that the builder takes, and which are missing (None if none is)."""
        kind = self.kind
        if values.dtype.kind == "f":
            values, gone = self._finite(values, first, gone)
        if kind == "bool":
            return (values != 0 if self.options.threshold is None else values >= self.options.threshold), gone
        is_integer = kind in ("int32", "int64")
        if values.dtype == np.uint64 or values.dtype.kind in "iu" and values.dtype.itemsize > 2 and not is_integer:
            inside = values if gone is None else values[~gone]
            most = max((int(inside.min()), int(inside.max())), key=abs) if inside.size else 0
            if abs(most) > 2 ** EXACT[kind] - is_integer:
                raise Beyond(most)
        if is_integer:
            return values.astype(kind), gone
        if kind == "vec3s" or values.dtype.kind == "b" or values.dtype.itemsize > 2:
            values = values.astype(np.float64 if kind == "double" else np.float32, copy=False)
        if kind == "vec3s" and self.image.turn is not None and not self.options.stored:
            values = np.einsum("rc,xyzc->xyzr", self.image.turn, values.astype(np.float64)).astype(np.float32)
        if not values.flags.aligned or not values.dtype.isnative:
            values = values.astype(values.dtype.newbyteorder("="))
        return values, gone

    def _finite(self, exact, first, gone):
        """Floats of the type of the grid, without NaN and infinity, and which are missing."""
        values = exact.astype(np.float64 if self.kind == "double" else np.float32, copy=False)
        if self.image.scale is None and values.dtype.itemsize < exact.dtype.itemsize:
            self.is_rounded = self.is_rounded or bool(np.any((values != exact) & np.isfinite(exact)))
        good = np.isfinite(values)
        if good.all():
            return values, gone
        bad = ~good if values.ndim == 3 else ~good.all(axis=3)
        bad = bad if gone is None else bad & ~gone
        if self.options.nonfinite == "refuse" and bad.any():
            at = [int(n) for n in np.argwhere(bad)[0]]
            at[self.part.slab_axis] += first
            raise esvr.BadInput(f"{self.image.path}: the voxel {tuple(at)} is not finite (--nonfinite zero replaces such voxels by 0)")
        if self.options.nonfinite == "missing":
            gone = bad if gone is None else gone | bad
        else:
            self.nonfinite += int(bad.sum())
        return np.where(good, values, values.dtype.type(0)), gone


def convert(name, part, options, log):
    """Makes the grid. Returns it with its conversion.

    Two things change the grid from the beginning, and are rare, so that the image is then read again: whole numbers that floats do
    not hold, and missing voxels, which make voxels of the background active.
    """
    conversion = Conversion(name, part, options, log)
    while True:
        try:
            return conversion.grid(), conversion
        except Missing:
            conversion.has_missing = True
        except Beyond as beyond:
            kind = conversion.kind
            if getattr(options, "as") != "auto" or conversion.normal or kind in ("vec3s", "int64"):
                raise esvr.BadInput(f"{part.image.path}: the value {beyond} is beyond 2^{EXACT[kind]}, up to which a grid of "
                                    f"type {kind} holds whole numbers{'' if kind == 'int64' else '; --as integer keeps it'}") from beyond
            conversion.kind = "int32" if part.image.dtype == np.int32 and part.image.scale is None else "int64"


# -- the program ---------------------------------------------------------------------------------------------------
def summary(out, grid, conversion):
    where = f"from {tuple(grid.box[0])} to {tuple(grid.box[1])}" if grid.box else "(the grid is empty)"
    lengths = ", ".join(f"{length:.6g}" for length in np.linalg.norm(grid.transform[:3, :3], axis=0))
    text = f"{out}: {grid.name}, {conversion.kind}, {grid.active_voxels} active voxels {where}, voxels of {lengths} " + (
        grid.metadata.get("length_unit") or "(no unit)")
    return text + (f"; {conversion.missing} voxels are missing" if conversion.missing else "") + (
        "; values of float64 are rounded to float32 (--as double keeps them)" if conversion.is_rounded else "")


def work(arguments):
    if len(arguments.files) < 2:
        raise esvr.UsageError("missing argument OUT.vdb" if arguments.files else "missing arguments IN and OUT.vdb")
    *inputs, out = arguments.files
    is_sequence = arguments.time == "all"
    if is_sequence and program.frame_path(out, 0) == out:
        raise esvr.UsageError("--time all writes a file for each time, whose name must have a place for its number, as "
                              f"OUT.####.vdb, and {out} has none")
    program.check_output(program.frame_path(out, 0) if is_sequence else out, (".vdb", ".nvdb"), arguments.force, inputs)
    log = program.Log(PARSER.prog, arguments)

    def make():
        image = open_image(inputs, arguments)
        for text in image.warnings:
            log.warning(f"{image.path}: {text}")
        for text in image.notes:
            log.detail(f"{image.path}: {text}")
        for time, parts in chosen_parts(image, arguments):
            path = program.frame_path(out, time) if is_sequence else out
            program.check_output(path, (".vdb", ".nvdb"), arguments.force, inputs)
            made = [convert(name, part, arguments, log) for name, part in parts]
            nonfinite = sum(conversion.nonfinite for _, conversion in made)
            if nonfinite:
                log.warning(f"{nonfinite} voxels were not finite and are now 0")
            esvr.write_vdb(path, [grid for grid, _ in made], metadata={"creator": PARSER.prog}, overwrite=arguments.force)
            for grid, conversion in made:
                log.info(summary(path, grid, conversion))

    return program.run_in_child(PARSER.prog, inputs, [out], make, arguments.verbose)


def main():
    return program.main(PARSER, work)


if __name__ == "__main__":
    sys.exit(main())
