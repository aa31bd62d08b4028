"""Images as grids: `python3 -m esvr.images.image2vdb IN... OUT.vdb`."""
import argparse
import os
import sys

import numpy as np

import esvr

from . import program, read_dicom, read_nrrd, read_science, read_tiff, read_volumes
from .image import BRICK, TIME, VECTOR, Part, affine_of, factor, head_of, natural, reading, unit_named
from .program import Option, Program, byte_size, number

EXACT = {"float": 2 ** 24, "vec3s": 2 ** 24, "double": 2 ** 53}  # up to here, grids of these types hold every whole number
SMALLEST_VOLUME = 1e-14  # of a voxel; OpenVDB takes a matrix with a determinant of 3e-15 for singular
UNITS = ["mm", "um", "nm", "angstrom"]
SLAB_BYTES = 64 << 20


def three(kind):
    def parse(text):
        words = text.split(",")
        values = [kind(word) for word in words]
        if len(values) not in ((1, 3) if kind is float else (3,)) or any(not value > 0 for value in values):
            raise argparse.ArgumentTypeError(f"'{text}' is not {'one or ' if kind is float else ''}three numbers above 0")
        return values * 3 if len(values) == 1 else values
    parse.__name__ = "list"
    return parse


def count(text):
    value = int(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"'{text}' is below 0")
    return value


def place(text):
    return text if text == "all" else count(text)


PROGRAM = Program(
    "image2vdb", "Converts an image of voxels to sparse VDB grids.",
    "  image2vdb IN... OUT.vdb [options]     IN: an image, slices in order, a folder or 'ct_####.tif'",
    [Option("name", "NAME", "name of the grid (density)", default="density"),
     Option("threshold", "T", "smallest value of active voxels", number),
     Option("background", "B", "value of inactive voxels (0); without --threshold, other values are active", number, default=0.0),
     Option("channel", "K|all", "which of several channels, colors or components, from 0 on; all: a grid for each", place),
     Option("time", "K|all", "which of several times, from 0 on; all: a file for each, as OUT.####.vdb", place),
     Option("dataset", "NAME", "HDF5, netCDF, Zarr, VTI: the array; DICOM: the series; OME-TIFF: the image"),
     Option("axes", "LETTERS", "what the axes are, the slowest first: tczyx; v for components of vectors"),
     Option("stored", "", "the stored numbers, not the calibrated values"),
     Option("as", "TYPE", "auto, float, double, integer or mask (auto)", ("auto", "float", "double", "integer", "mask"),
            default="auto"),
     Option("unit", "UNIT", "unit of lengths (mm; where voxels are too small for OpenVDB, a smaller one)"),
     Option("voxel-size", "S|X,Y,Z", "edges of a voxel, instead of the transform of the image", three(float)),
     Option("nonfinite", "WORD", "NaN and infinite voxels: refuse, zero or missing (refuse)",
            ("refuse", "zero", "missing"), default="refuse"),
     Option("normalise", "", "divide by the type's largest value, or by the largest of a float image"),
     Option("dims", "X,Y,Z", "RAW: number of voxels along each axis", three(int)),
     Option("type", "TYPE", "RAW: uint8, int16, float32, ..."),
     Option("endian", "little|big", "RAW: byte order (little)", ("little", "big"), default="little"),
     Option("skip", "BYTES", "RAW: length of a header (0)", count, default=0),
     Option("max-memory", "SIZE", "limit on the memory of the image and of the grid (4G)", byte_size, default=4 * 10 ** 9),
     Option("force", "", "replace OUT.vdb if it exists", short="f")],
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
    with reading(folder, "an image"):
        if read_science.is_zarr(folder):
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
    for axis, asked, option in ((channels, options.channel, "--channel"), (times, options.time, "--time")):
        size = axis.size if axis else 1
        if asked is None:
            if size > 1 and axis.kind != VECTOR:
                unsaid.append((axis, option))
        elif asked != "all" and asked >= size:
            raise esvr.UsageError(f"{option} must be 0 to {size - 1}: {image.path} has {axis.text() if axis else 'only one'}")
        elif axis:
            places[axis.kind] = range(size) if asked == "all" else [asked]
    if unsaid:
        raise esvr.UsageError(f"{image.path} has several images: {'; '.join(axis.text() for axis, _ in unsaid)}; choose by "
                              + " and ".join(f"{option} K or {option} all" for _, option in unsaid))
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
    matrix, unit = np.array(image.affine, float), image.unit
    wanted = None
    if options.unit:
        wanted = unit_named(options.unit)
        if wanted is None:
            raise esvr.UsageError(f"--unit: '{options.unit}' is no unit of length; mm, um, nm, angstrom, m, ... are")
    if options.voxel_size:
        return affine_of(options.voxel_size), wanted
    if not np.all(np.isfinite(matrix)):
        raise esvr.BadInput(f"{image.path}: the transform of the image is not finite (--voxel-size gives another)")
    volume = abs(np.linalg.det(matrix[:3, :3]))
    if volume == 0 or volume < 1e-12 * np.prod(np.linalg.norm(matrix[:3, :3], axis=0)):
        raise esvr.BadInput(f"{image.path}: the axes of the image are linearly dependent (--voxel-size gives others)")
    if unit:
        if wanted is None:
            wanted = next((u for u in UNITS if volume * factor(unit, u) ** 3 >= SMALLEST_VOLUME), None)
        if wanted is None:
            raise esvr.BadInput(f"{image.path}: voxels are too small for OpenVDB (--voxel-size gives others)")
        matrix[:3] *= factor(unit, wanted)
        volume *= factor(unit, wanted) ** 3
    if volume < SMALLEST_VOLUME:
        raise esvr.BadInput(f"{image.path}: voxels of a volume of {volume:.3g} are too small for OpenVDB; --unit or "
                            "--voxel-size gives other edges")
    return matrix, wanted or unit


# -- voxels --------------------------------------------------------------------------------------------------------
class Beyond(Exception):
    """A whole number that a float does not hold."""


class Missing(Exception):
    """The first missing voxel, from which on exactly those are inactive."""


def grid_type(part, options):
    """The type of the grid, and whether it is tried first whether floats hold all values."""
    dtype = part.image.dtype
    if part.is_vector:
        if getattr(options, "as") not in ("auto", "float"):
            raise esvr.UsageError("vectors become a grid of floats")
        return "vec3s"
    asked = getattr(options, "as")
    if asked == "double":
        if options.normalise:
            raise esvr.UsageError("--normalise makes floats")
        return "double"
    if asked == "mask" or asked == "auto" and dtype.kind == "b":
        return "bool"
    whole = dtype.kind in "iub" and (options.stored or part.image.scale is None)
    if asked == "integer":
        if not whole:
            raise esvr.UsageError(f"{part.image.path} has values of type {dtype.name}, which are no integers")
        return "int32" if dtype.itemsize < 4 or dtype == np.int32 else "int64"
    return "int64" if asked == "auto" and whole and dtype.kind in "iu" and dtype.itemsize == 8 else "float"


def slab_slices(part, options):
    """How many slices are read at once: a multiple of 8 that keeps to the memory."""
    image = part.image
    brick_bytes = BRICK * np.prod(image.size, dtype=float) / part.slices * max(image.dtype.itemsize, 4) * 3
    brick_bytes *= image.components if part.is_vector else 1
    if brick_bytes > options.max_memory:
        raise esvr.MemoryExceeded(f"{image.path}: {BRICK} slices of the image ask for {brick_bytes:.3g} bytes of memory, and "
                                  f"{options.max_memory} are allowed")
    fitting = int(min(SLAB_BYTES, options.max_memory / 4) / brick_bytes)
    return BRICK * max(1, min(fitting, -(-image.block // BRICK) if image.block > 1 else 4))


def slabs(part, options, log):
    """The values of an image, slab by slab: the first slice, values, and missing voxels."""
    step = slab_slices(part, options)
    for first in range(0, part.slices, step):
        with reading(part.image.path, part.image.format):
            values, gone = part.values(first, min(first + step, part.slices), options.stored)
        yield first, values, gone
        log.progress("reading", min(1.0, (first + step) / part.slices))


def normal_of(part, options, log):
    """By what --normalise divides: the largest value of a type of integers, or else that of the image."""
    dtype, most = part.image.dtype, 0.0
    if not options.normalise:
        return None
    if dtype.kind in "iu" and part.image.scale is None:
        return float(np.iinfo(dtype).max)
    for _, values, gone in slabs(part, options, log):
        kept = np.isfinite(values) if gone is None else np.isfinite(values) & ~gone
        most = max(most, float(np.abs(values[kept].astype(np.float64)).max(initial=0.0)))
    if most == 0.0:
        raise esvr.BadInput(f"{part.image.path}: every voxel is 0, so the image cannot be normalised")
    return most


class Tally:
    missing = nonfinite = 0
    is_rounded = False


def convert(name, part, options, log):
    """Makes the grid. Returns it with its tally and type.

    Two things change the grid from the beginning, and are rare, so that the image is then read again: whole numbers that floats do
    not hold, and missing voxels, which make voxels of the background active.
    """
    kind, normal, has_missing = grid_type(part, options), normal_of(part, options, log), False
    while True:
        try:
            return pack(name, part, options, log, kind, normal, has_missing)
        except Missing:
            has_missing = True
        except Beyond as beyond:
            if getattr(options, "as") != "auto" or normal or part.is_vector:
                raise esvr.BadInput(f"{part.image.path}: the value {beyond} is beyond 2^{EXACT[kind].bit_length() - 1}, up to "
                                    f"which a grid of type {kind} holds whole numbers; --as integer keeps it") from beyond
            kind = "int32" if part.image.dtype == np.int32 and part.image.scale is None else "int64"


def pack(name, part, options, log, kind, normal, has_missing):
    image, tally = part.image, Tally()
    matrix, unit = transform_of(image, options)
    metadata = {"image_format": image.format, "image_size": tuple(image.size), "image_type": image.dtype.name, **image.metadata}
    if unit:
        metadata["length_unit"] = unit
    if image.unit:
        metadata["image_unit"] = image.unit
    threshold = options.threshold

    def as_value(number):  # with the same rounding as voxels
        return float(np.float32(number / normal)) if normal else number
    if has_missing and threshold is None and kind != "bool":
        metadata["image_missing"] = True  # all inactive voxels are missing
    by_builder = kind in ("float", "double", "int32", "int64")
    builder = esvr.GridBuilder(kind, name=name, background=as_value(options.background) if by_builder else 0,
                               threshold=as_value(threshold) if threshold is not None and by_builder else None,
                               grid_class="fog volume" if kind == "float" else "unknown", transform=matrix, metadata=metadata,
                               max_bytes=options.max_memory)
    for first, values, gone in slabs(part, options, log):
        values, gone = converted(values, kind, part, tally, first, gone, options)
        if gone is not None and gone.any():
            if not has_missing:
                raise Missing
            tally.missing += int(gone.sum())
        active = None
        if has_missing or threshold is not None and not by_builder:
            active = np.ones(values.shape[:3], bool) if gone is None else ~gone
            if threshold is not None and kind != "bool":
                active &= values >= threshold if values.ndim == 3 else np.linalg.norm(values, axis=3) >= threshold
            if kind == "bool":
                active &= values
        if normal:
            values = (values.astype(np.float64) / normal).astype(np.float32)
        origin = [0, 0, 0]
        origin[part.slab_axis] = first
        builder.add(values, tuple(origin), active)
    return builder.finish(), tally, kind


def converted(values, kind, part, tally, first, gone, options):
    """The values in a type that the builder takes, and which are missing (None if none is)."""
    if values.dtype.kind == "f":
        values, gone = finite(values, kind, part, tally, first, gone, options)
    if kind == "bool":
        return (values != 0 if options.threshold is None else values >= options.threshold), gone
    if kind in ("int32", "int64"):
        inside = values if gone is None else values[~gone]
        if values.dtype == np.uint64 and inside.size and int(inside.max()) > 2 ** 63 - 1:
            raise esvr.BadInput(f"{part.image.path}: the value {inside.max()} is beyond 2^63 - 1, the largest that an Int64 grid "
                                "holds")
        return values.astype(kind), gone
    if values.dtype.kind in "iu" and values.dtype.itemsize > 2:
        inside = values if gone is None else values[~gone]
        most = max((int(inside.min()), int(inside.max())), key=abs) if inside.size else 0
        if abs(most) > EXACT[kind]:
            raise Beyond(most)
    if kind == "vec3s" or values.dtype.kind == "b" or values.dtype.itemsize > 2:
        values = values.astype(np.float64 if kind == "double" else np.float32, copy=False)
    if kind == "vec3s" and part.image.turn is not None and not options.stored:
        values = np.einsum("rc,xyzc->xyzr", part.image.turn, values.astype(np.float64)).astype(np.float32)
    if not values.flags.aligned or not values.dtype.isnative:
        values = values.astype(values.dtype.newbyteorder("="))
    return values, gone


def finite(values, kind, part, tally, first, gone, options):
    """Floats of the type of the grid, without NaN and infinity, and which are missing."""
    exact, values = values, values.astype(np.float64 if kind == "double" else np.float32, copy=False)
    if part.image.scale is None and values.dtype.itemsize < exact.dtype.itemsize:
        tally.is_rounded = tally.is_rounded or bool(np.any((values != exact) & np.isfinite(exact)))
    good = np.isfinite(values)
    if good.all():
        return values, gone
    bad = ~good if gone is None else ~(good | (gone if values.ndim == 3 else gone[..., np.newaxis]))
    bad = bad.any(axis=3) if values.ndim == 4 else bad
    if options.nonfinite == "refuse" and bad.any():
        at = [int(n) for n in np.argwhere(bad)[0]]
        at[part.slab_axis] += first
        raise esvr.BadInput(f"{part.image.path}: the voxel {tuple(at)} is not finite (--nonfinite zero replaces such voxels by 0)")
    if options.nonfinite == "missing":
        gone = bad if gone is None else gone | bad
    else:
        tally.nonfinite += int(bad.sum())
    return np.where(good, values, values.dtype.type(0)), gone


# -- the program ---------------------------------------------------------------------------------------------------
def summary(out, grid, kind, tally):
    box = grid.box
    where = f"from {tuple(box[0])} to {tuple(box[1])}" if box else "(the grid is empty)"
    lengths = ", ".join(f"{length:.6g}" for length in np.linalg.norm(grid.transform[:3, :3], axis=0))
    unit = grid.metadata.get("length_unit")
    text = f"{out}: {grid.name}, {kind}, {grid.active_voxels} active voxels {where}, voxels of {lengths} {unit or '(no unit)'}"
    return text + (f"; {tally.missing} voxels are missing" if tally.missing else "") + (
        "; values of float64 are rounded to float32 (--as double keeps them)" if tally.is_rounded else "")


def work(arguments):
    if len(arguments.files) < 2:
        raise esvr.UsageError("missing argument OUT.vdb" if arguments.files else "missing arguments IN and OUT.vdb")
    *inputs, out = arguments.files
    is_sequence = arguments.time == "all"
    if is_sequence and program.frame_path(out, 0) == out:
        raise esvr.UsageError("--time all writes a file for each time, whose name must have a place for its number, as "
                              f"OUT.####.vdb, and {out} has none")
    program.check_output(program.frame_path(out, 0) if is_sequence else out, (".vdb", ".nvdb"), arguments.force, inputs)
    log = program.Log(PROGRAM.name, arguments)

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
            nonfinite = sum(tally.nonfinite for _, tally, _ in made)
            if nonfinite:
                log.warning(f"{nonfinite} voxels were not finite and are now 0")
            esvr.write_vdb(path, [grid for grid, _, _ in made], metadata={"creator": PROGRAM.name}, overwrite=arguments.force)
            for grid, tally, kind in made:
                log.info(summary(path, grid, kind, tally))

    return program.run_in_child(PROGRAM.name, inputs, [out], make, arguments.verbose)


def main():
    return program.main(PROGRAM, work)


if __name__ == "__main__":
    sys.exit(main())
