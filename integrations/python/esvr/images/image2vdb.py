"""Images as grids: `python3 -m esvr.images.image2vdb IN... OUT.vdb`."""
import argparse
import os
import sys

import numpy as np

import esvr

from . import program, read_science, read_tiff, read_volumes
from .image import BRICK, TIME, affine_of, factor, reading, unit_named
from .program import Option, Program, byte_size, number

EXACT = 2 ** 24  # up to here, floats hold every whole number
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


def word_of(*words):
    def parse(text):
        if text not in words:
            raise argparse.ArgumentTypeError(f"it is one of {', '.join(words)}, not '{text}'")
        return text
    parse.__name__ = "word"
    return parse


PROGRAM = Program(
    "image2vdb", "Converts an image of voxels to a sparse VDB grid.",
    "  image2vdb IN... OUT.vdb [options]     IN: an image, slices in order, a folder or 'ct_####.tif'",
    [Option("name", "NAME", "name of the grid (density)", default="density"),
     Option("threshold", "T", "smallest value of active voxels", number),
     Option("background", "B", "value of inactive voxels (0); without --threshold, other values are active", number, default=0.0),
     Option("channel", "K", "which of several channels, colors or components, from 0 on", count),
     Option("time", "K", "which of several times, from 0 on", count),
     Option("dataset", "PATH", "HDF5, netCDF: the array; VTI: its name"),
     Option("axes", "LETTERS", "what the axes are, the slowest first: tczyx; v for components of vectors"),
     Option("stored", "", "the stored numbers, not the calibrated values"),
     Option("as", "TYPE", "auto, float, integer or mask (auto)", word_of("auto", "float", "integer", "mask"), default="auto"),
     Option("unit", "UNIT", "unit of lengths (mm; where voxels are too small for OpenVDB, a smaller one)"),
     Option("voxel-size", "S|X,Y,Z", "edges of a voxel, instead of the transform of the image", three(float)),
     Option("nonfinite", "refuse|zero", "what becomes of NaN and infinite voxels (refuse)", word_of("refuse", "zero"),
            default="refuse"),
     Option("normalise", "", "divide by the type's largest value, or by the largest of a float image"),
     Option("dims", "X,Y,Z", "RAW: number of voxels along each axis", three(int)),
     Option("type", "TYPE", "RAW: uint8, int16, float32, ..."),
     Option("endian", "little|big", "RAW: byte order (little)", word_of("little", "big"), default="little"),
     Option("skip", "BYTES", "RAW: length of a header (0)", count, default=0),
     Option("max-memory", "SIZE", "limit on the memory of the image and of the grid (4G)", byte_size, default=4 * 10 ** 9),
     Option("force", "", "replace OUT.vdb if it exists", short="f")],
    "TIFF, NIfTI, NRRD, MetaImage, MRC, VTI, HDF5, netCDF, NPY and RAW are read. Values are calibrated, missing voxels are inactive, lengths are millimetres, and patients are RAS.",
    "  image2vdb cells.tif cells.vdb --unit um\n  image2vdb brain.nii.gz brain.vdb --threshold 40\n"
    "  image2vdb weather.nc t.vdb --dataset t --time 0")


# -- formats -------------------------------------------------------------------------------------------------------
def format_of(path):
    """The reader of a file, by its content or else by its name."""
    with reading(path, "an image"):
        with open(path, "rb") as file:
            head = file.read(4096)
            if head[:2] == b"\x1f\x8b":
                file.seek(0)
                from .flat import Inflated
                try:
                    head = Inflated(file).read(4096)
                except Exception:  # the reader says what is wrong
                    head = b""
    name = os.fspath(path).lower()
    name = name.removesuffix(".gz")
    if head[:4] in (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"):
        return read_tiff.read_tiff
    if head[:4] == b"NRRD":
        return read_volumes.read_nrrd
    if head[:6] == b"\x93NUMPY":
        return read_volumes.read_npy
    if head[344:348] in (b"n+1\0", b"ni1\0") or head[4:8] in (b"n+2\0", b"ni2\0"):
        return read_volumes.read_nifti
    if head[208:212] == b"MAP ":
        return read_volumes.read_mrc
    if head[:3] == b"CDF":
        return read_science.read_netcdf
    if any(head[at:at + 8] == b"\x89HDF\r\n\x1a\n" for at in (0, 512, 1024, 2048)):
        return read_science.read_netcdf if name.endswith((".nc", ".nc4", ".cdf")) else read_science.read_hdf5
    if b"<VTKFile" in head:
        return read_volumes.read_vti
    by_name = {(".tif", ".tiff"): read_tiff.read_tiff, (".nrrd", ".nhdr"): read_volumes.read_nrrd,
               (".nii", ".hdr", ".img"): read_volumes.read_nifti, (".mha", ".mhd"): read_volumes.read_metaimage,
               (".mrc", ".map", ".ccp4", ".rec", ".st", ".mrcs"): read_volumes.read_mrc, (".vti",): read_volumes.read_vti,
               (".h5", ".hdf5", ".hdf"): read_science.read_hdf5, (".nc", ".nc4", ".cdf"): read_science.read_netcdf,
               (".npy",): read_volumes.read_npy}
    for endings, reader in by_name.items():
        if name.endswith(endings):
            return reader
    if name.endswith((".zarr", ".zarr.zip")):
        raise esvr.BadInput(f"{path} is no folder, and Zarr images are read from folders")
    return read_volumes.read_raw


def open_image(paths, options):
    """The image of a file, of slices, or of a folder."""
    paths = [os.fspath(path) for path in paths]
    if len(paths) == 1 and not os.path.exists(paths[0]):
        pattern = read_tiff.files_of_pattern(paths[0])
        if pattern is None:
            raise esvr.BadInput(f"{paths[0]} cannot be read: No such file or directory")
        return read_tiff.read_stack(pattern, options)
    if len(paths) == 1 and os.path.isdir(paths[0]):
        return read_tiff.read_folder(paths[0], options)
    for path in paths:
        if not os.path.isfile(path):
            raise esvr.BadInput(f"{path} cannot be read: No such file")
    reader = format_of(paths[0])
    if len(paths) > 1:
        if reader is not read_tiff.read_tiff:
            raise esvr.UsageError(f"several files make one image only if they are TIFF, and {paths[0]} is not")
        return read_tiff.read_stack(paths, options)
    if options.dims or options.type:
        if reader is not read_volumes.read_raw:
            raise esvr.UsageError(f"--dims and --type are for RAW images only, and {paths[0]} has a format of its own")
    return reader(paths[0], options)


# -- choices -------------------------------------------------------------------------------------------------------
def chosen_part(image, options):
    """The channel and the time that the options name. Axes of one place need no choice."""
    chosen, open_axes = {}, []
    others = [axis for axis in image.choices() if axis.kind != TIME]
    given = {TIME: options.time}
    if options.channel is not None:
        free = [axis for axis in others if axis.size > 1] or others
        if not free and image.components > 1:
            chosen["vector"] = options.channel
            if options.channel >= image.components:
                raise esvr.UsageError(f"--channel must be 0 to {image.components - 1}: {image.path} has vectors")
        elif not free and options.channel > 0:
            raise esvr.UsageError(f"--channel must be 0, because {image.path} has one channel")
        elif len(free) > 1:
            raise esvr.UsageError(f"{image.path} has several axes besides those of space: "
                                  f"{'; '.join(axis.text() for axis in free)}; only one can be chosen by --channel")
        elif free:
            given[free[0].kind] = options.channel
    if options.time is not None and image.axis(TIME) is None and options.time > 0:
        raise esvr.UsageError(f"--time must be 0, because {image.path} has one time")
    for axis in image.choices():
        place = given.get(axis.kind)
        if place is None:
            if axis.size > 1:
                open_axes.append(axis)
            place = 0
        if place >= axis.size:
            option = "--time" if axis.kind == TIME else "--channel"
            raise esvr.UsageError(f"{option} must be 0 to {axis.size - 1}: {image.path} has {axis.text()}")
        chosen[axis.kind] = place
    if open_axes:
        raise esvr.UsageError(f"{image.path} has several images: {'; '.join(axis.text() for axis in open_axes)}; choose one by "
                              + " and ".join(sorted({"--time K" if a.kind == TIME else "--channel K" for a in open_axes})))
    if image.components > 1 and "vector" not in chosen and image.components != 3:
        raise esvr.UsageError(f"{image.path} has vectors of {image.components} components; choose one by --channel")
    return image.select(chosen)


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


def grid_type(part, options):
    """The type of the grid, and whether it is tried first whether floats hold all values."""
    dtype = part.image.dtype
    if part.is_vector:
        if getattr(options, "as") in ("integer", "mask"):
            raise esvr.UsageError("vectors become a grid of floats")
        return "vec3s"
    asked = getattr(options, "as")
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
    slice_bytes = np.prod(image.size, dtype=float) / part.slices * max(image.dtype.itemsize, 4) * 3
    slice_bytes *= image.components if part.is_vector else 1
    if slice_bytes * BRICK > options.max_memory:
        raise esvr.MemoryExceeded(f"{image.path}: {BRICK} slices of the image ask for {slice_bytes * BRICK:.3g} bytes of memory, "
                                  f"and {options.max_memory} are allowed")
    fitting = int(min(SLAB_BYTES, options.max_memory / 4) / slice_bytes)
    wanted = -(-max(image.block, 1) // BRICK) * BRICK
    return max(BRICK, min(max(fitting // BRICK * BRICK, BRICK), max(wanted, BRICK) if image.block > 1 else BRICK * 4))


def slabs(part, options, log):
    """The values of an image, slab by slab: the first slice, values, and missing voxels."""
    step = slab_slices(part, options)
    for first in range(0, part.slices, step):
        with reading(part.image.path, part.image.format):
            values, gone = part.values(first, min(first + step, part.slices), options.stored)
        yield first, values, gone
        log.progress("reading", min(1.0, (first + step) / part.slices))


def largest(part, options, log):
    most = 0.0
    for _, values, gone in slabs(part, options, log):
        kept = values[np.isfinite(values)] if gone is None else values[np.isfinite(values) & ~gone]
        most = max(most, float(np.abs(kept.astype(np.float64)).max(initial=0.0)))
    return most


def normal_of(part, options, log):
    if not options.normalise:
        return None
    dtype = part.image.dtype
    most = float(np.iinfo(dtype).max) if dtype.kind in "iu" and part.image.scale is None else largest(part, options, log)
    if most == 0.0:
        raise esvr.BadInput(f"{part.image.path}: every voxel is 0, so the image cannot be normalised")
    return most


class Tally:
    missing = nonfinite = 0
    first = None


def convert(part, options, log):
    """Makes the grid. Returns it with its tally and type."""
    kind = grid_type(part, options)
    normal = normal_of(part, options, log)
    try:
        return pack(part, options, log, kind, normal)
    except Beyond as beyond:
        if getattr(options, "as") != "auto" or normal:
            raise esvr.BadInput(f"{part.image.path}: the value {beyond} is beyond 2^24, up to which a float holds whole numbers; "
                                "--as integer keeps it") from beyond
        return pack(part, options, log, "int32" if part.image.dtype == np.int32 and part.image.scale is None else "int64", None)


def pack(part, options, log, kind, normal):
    image, tally = part.image, Tally()
    matrix, unit = transform_of(image, options)
    metadata = {"image_format": image.format, "image_size": tuple(image.size), "image_type": image.dtype.name, **image.metadata}
    if unit:
        metadata["length_unit"] = unit
    if image.unit:
        metadata["image_unit"] = image.unit
    if image.may_miss:
        metadata["image_missing"] = True  # inactive voxels are missing
    scale = 1.0 / normal if normal else 1.0
    threshold = options.threshold
    builder = esvr.GridBuilder(kind, name=options.name, background=options.background * scale,
                               threshold=None if threshold is None or kind in ("bool", "vec3s") else threshold * scale,
                               grid_class="fog volume" if kind == "float" else "unknown", transform=matrix, metadata=metadata,
                               max_bytes=options.max_memory)
    for first, values, gone in slabs(part, options, log):
        values = converted(values, kind, part, tally, first, gone, options)
        active = None
        if gone is not None or image.may_miss:
            active = np.ones(values.shape[:3], bool) if gone is None else ~gone
            tally.missing += 0 if gone is None else int(gone.sum())
            if threshold is not None and kind != "bool":
                active &= values >= threshold if values.ndim == 3 else np.linalg.norm(values, axis=3) >= threshold
            if kind == "bool":
                active &= values
        elif kind == "vec3s" and threshold is not None:
            active = np.linalg.norm(values, axis=3) >= threshold
        if normal:
            values = (values.astype(np.float64) / normal).astype(np.float32)
        origin = [0, 0, 0]
        origin[part.slab_axis] = first
        builder.add(values, tuple(origin), active)
    return builder.finish(), tally, kind


def converted(values, kind, part, tally, first, gone, options):
    """The values in a type that the builder takes."""
    if kind == "bool":
        return values != 0
    if kind in ("int32", "int64"):
        if values.dtype.kind == "u" and values.dtype.itemsize == 8 and values.size and values.max() > 2 ** 63 - 1:
            raise esvr.BadInput(f"{part.image.path}: the value {values.max()} is beyond 2^63 - 1, the largest that an Int64 grid holds")
        return values.astype(np.int64)
    if values.dtype.kind in "iu":
        if values.dtype.itemsize > 2:
            kept = values if gone is None else values[~gone]
            if kept.size and max(abs(int(kept.min())), abs(int(kept.max()))) > EXACT:
                raise Beyond(int(kept.max()) if abs(int(kept.max())) > EXACT else int(kept.min()))
            values = values.astype(np.float32)
    elif values.dtype.kind == "b":
        values = values.astype(np.uint8)
    else:
        with np.errstate(over="ignore"):
            values = values.astype(np.float32, copy=False)
        bad = ~np.isfinite(values)
        if gone is not None:
            bad &= ~(gone if values.ndim == 3 else gone[..., np.newaxis])
        if bad.any():
            refuse_nonfinite(part, tally, first, bad, options)
        if gone is not None or bad.any():
            values = np.where(np.isfinite(values), values, np.float32(0))
    if kind == "vec3s":
        values = values.astype(np.float32, copy=False)
        if part.image.turn is not None and not options.stored:
            values = np.einsum("rc,xyzc->xyzr", part.image.turn, values.astype(np.float64)).astype(np.float32)
    if not values.flags.aligned or not values.dtype.isnative:
        values = values.astype(values.dtype.newbyteorder("="))
    return values


def refuse_nonfinite(part, tally, first, bad, options):
    tally.nonfinite += int(bad.sum())
    if tally.first is None:
        at = [int(n) for n in np.argwhere(bad)[0][:3]]
        at[part.slab_axis] += first
        tally.first = tuple(at)
    if options.nonfinite == "refuse":
        raise esvr.BadInput(f"{part.image.path}: the voxel {tally.first} is not finite (--nonfinite zero replaces such voxels by 0)")


# -- the program ---------------------------------------------------------------------------------------------------
def summary(out, grid, kind, tally, image):
    box = grid.box
    where = f"from {tuple(box[0])} to {tuple(box[1])}" if box else "(the grid is empty)"
    lengths = ", ".join(f"{length:.6g}" for length in np.linalg.norm(grid.transform[:3, :3], axis=0))
    unit = grid.metadata.get("length_unit")
    text = f"{out}: {grid.name}, {kind}, {grid.active_voxels} active voxels {where}, voxels of {lengths} {unit or '(no unit)'}"
    return text + (f"; {tally.missing} voxels are missing" if tally.missing else "")


def work(arguments):
    if len(arguments.files) < 2:
        raise esvr.UsageError("missing argument OUT.vdb" if arguments.files else "missing arguments IN and OUT.vdb")
    *inputs, out = arguments.files
    program.check_output(out, (".vdb", ".nvdb"), arguments.force)
    log = program.Log(PROGRAM.name, arguments)

    def make():
        import warnings
        warnings.simplefilter("ignore")  # readers say in words of their own what the program says
        image = open_image(inputs, arguments)
        part = chosen_part(image, arguments)
        for text in image.warnings:
            log.warning(text)
        for text in image.notes:
            log.detail(f"{image.path}: {text}")
        grid, tally, kind = convert(part, arguments, log)
        if tally.nonfinite:
            log.warning(f"{tally.nonfinite} voxels were not finite and are now 0")
        esvr.write_vdb(out, [grid], metadata={"creator": PROGRAM.name}, overwrite=arguments.force)
        log.info(summary(out, grid, kind, tally, image))

    return program.run_in_child(PROGRAM.name, inputs, [out], make, arguments.verbose)


def main():
    return program.main(PROGRAM, work)


if __name__ == "__main__":
    sys.exit(main())
