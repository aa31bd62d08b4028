"""Grids as images: `python3 -m esvr.images.vdb2image IN.vdb|IN.esvr OUT.nii.gz`."""
import os
import sys

import numpy as np

import esvr

from . import program
from .image import factor, product, unit_named
from .program import Parser, byte_size, length_unit, option
from .writers import FORMATS, INTEGERS, TYPES, WITHOUT_VECTORS

SLAB_BYTES = 64 << 20
ENDINGS = [ending for endings in FORMATS for ending in endings]

PARSER = Parser(
    "vdb2image", "Converts a grid to an image of voxels, with the type, lengths and orientation of the image that it came from.",
    "  vdb2image IN OUT [options]     IN: .vdb, .nvdb or .esvr\n                                 OUT: " + " ".join(ENDINGS),
    [option("grid", "NAME", "which of several grids", short="g"),
     option("frame", "N", "which frame of a sequence in one .esvr file", int),
     option("type", "TYPE", "type of the values: uint8, int16, float32, ... (as the image had it, where it holds all values)",
            ("bool", *INTEGERS, "float16", "float32", "float64")),
     option("unit", "UNIT", "unit of lengths (that of the image that the grid came from)", length_unit),
     option("max-memory", "SIZE", "limit on the memory of the grid and of the image (4G)", byte_size, default=4 * 10 ** 9),
     option("force", "", "replace OUT if it exists", short="f")],
    "The box of the image is that of the image that the grid came from, or else that of the active voxels. Voxels that were missing "
    "become NaN (netCDF: _FillValue). A type that does not hold all values is refused. What a format cannot hold is refused "
    "(MRC, netCDF: oblique axes) or named in a warning (TIFF, NPY).",
    "  vdb2image brain.esvr brain.nii.gz\n  vdb2image cells.vdb cells.ome.tif -g DAPI")


class Volume:
    """The box of a grid that becomes an image.

    dtype is that of the file, size the number of voxels along x, y and z, components 1 or 3, missing the number that stands for a
    missing voxel (None if none is), and unit that of the lengths (None if it is not known).
    """

    def __init__(self, grid, out, format_name, options, log):
        self.grid, self.out, self.log, self.name, self.metadata = grid, str(out), log, grid.name, grid.metadata
        self.components = 3 if grid.value_type == "vec3s" else 1
        if self.components == 3 and format_name in WITHOUT_VECTORS:
            raise esvr.UsageError(f"vectors are not written as {format_name}; choose another format")
        self.begin, self.size = self._box(options)
        self._space(options)
        self.has_holes = bool(self.metadata.get("image_missing"))
        self.dtype = self._type(format_name, options)

    def warn(self, text):
        self.log.warning(text)

    def _box(self, options):
        box, size = self.grid.box, self.metadata.get("image_size")
        if isinstance(size, tuple) and all(n > 0 for n in size) and (
                box is None or all(low >= 0 for low in box[0]) and all(high < n for high, n in zip(box[1], size))):
            begin, size = (0, 0, 0), tuple(int(n) for n in size)
        elif box is None:
            raise esvr.BadInput(f"the grid {self.name} has no active voxels and does not say the size of its image")
        else:
            begin, size = tuple(box[0]), tuple(high - low + 1 for low, high in zip(*box))
        slice_bytes = product(size[:2]) * 8 * self.components
        self.step = max(1, min(size[2], int(min(SLAB_BYTES, options.max_memory / 4) // slice_bytes)))
        if self.step * slice_bytes * 2 > options.max_memory:
            raise esvr.MemoryExceeded(f"a slice of {size[0]} x {size[1]} voxels asks for more than {options.max_memory} bytes of memory")
        return begin, size

    def _space(self, options):
        """The unit of the image, and the matrix of its voxels in it."""
        if self.grid.transform is None:
            raise esvr.BadInput(f"the grid {self.name} has the transform of a frustum, which no image has")
        matrix = np.array(self.grid.transform, float)
        matrix[:3, 3] = (matrix @ [*self.begin, 1.0])[:3]
        unit = unit_named(str(self.metadata.get("length_unit", "")))
        self.unit = options.unit or unit_named(str(self.metadata.get("image_unit", ""))) or unit
        if unit:  # else numbers without a unit get one
            matrix[:3] *= factor(unit, self.unit)
        self.matrix = matrix

    def matrix_in(self, unit):
        """The matrix from voxels to lengths in a unit. Fifteen digits undo the rounding of units that went and came back."""
        matrix = self.matrix.copy()
        if unit and self.unit:
            matrix[:3] *= factor(self.unit, unit)
        elif unit:
            self.warn(f"the grid does not say the unit of its lengths, which are taken for {unit}")
        return np.vectorize(lambda number: float(f"{number:.15g}"))(matrix)

    def _parts(self):
        """The values of slabs of slices with the axes z, y, x, and which of them are missing."""
        x, y, z = self.begin
        for at in range(0, self.size[2], self.step):
            last = min(at + self.step, self.size[2])
            box = ((x, y, z + at), (x + self.size[0] - 1, y + self.size[1] - 1, z + last - 1))
            values = self.grid.to_numpy(box, order="F")
            values = values.transpose(2, 1, 0) if self.components == 1 else values.transpose(2, 1, 0, 3)
            yield last, values, ~self.grid.active(box, order="F").transpose(2, 1, 0) if self.has_holes else None

    def _holds(self, dtype, for_netcdf):
        """Whether a type holds all values and a number for those that are missing. The extreme values are then `low` and `high`."""
        self.low, self.high, self.missing, holes = None, None, None, False
        for last, values, gone in self._parts():
            if gone is not None:
                holes, values = holes or bool(gone.any()), values[~gone]
            with np.errstate(over="ignore", invalid="ignore"):
                if not np.array_equal(values, values.astype(dtype).astype(values.dtype), equal_nan=values.dtype.kind == "f"):
                    return False
            if values.size:
                low, high = values.min(), values.max()
                self.low, self.high = (low, high) if self.low is None else (min(low, self.low), max(high, self.high))
            self.log.progress("reading", last / self.size[2])
        if holes and dtype.kind == "f":
            self.missing = dtype.type(np.nan)
        elif holes and for_netcdf and dtype.kind in "iu":
            limits = np.iinfo(dtype)
            free = [n for n in (limits.min, limits.max) if self.low is None or not self.low <= n <= self.high]
            self.missing = dtype.type(free[0]) if free else None
        return not holes or self.missing is not None

    def _type(self, format_name, options):
        possible, grid_type = TYPES[format_name], np.dtype({"vec3s": "float32", "float": "float32", "double": "float64"}.get(
            self.grid.value_type, self.grid.value_type))
        came = self.metadata.get("image_type", grid_type.name)
        if options.type and options.type not in possible:
            raise esvr.UsageError(f"{format_name} has no values of type {options.type}; it has {', '.join(possible)}")
        is_whole = came in INTEGERS or came == "bool"
        wanted = [options.type] if options.type else [came, *["uint8"] * (came == "bool"), *(INTEGERS[2:] if is_whole else []),
                                                      "float32", "float64"]
        for name in wanted:
            if name in possible and self._holds(np.dtype(name), format_name == "netCDF"):
                return np.dtype(name)
        raise esvr.UsageError(f"the values of the grid {self.name} cannot be written exactly "
                              f"{'as ' + options.type if options.type else 'in any type of ' + format_name}"
                              f"{', with a number for those that are missing' if self.has_holes else ''}; choose another "
                              f"{'type' if options.type else 'format, or --type of image2vdb'}")

    def slabs(self, component=None, turn=None):
        """The slices in the type of the file, contiguous; of vectors all components, or one of them. A matrix of 3 x 3 turns
        vectors."""
        for last, values, gone in self._parts():
            if self.components == 3 and turn is not None:
                values = values @ np.asarray(turn.T, values.dtype)
            if component is not None:
                values = values[..., component]
            values = values.astype(self.dtype, order="C")
            if gone is not None and self.missing is not None:
                values[gone] = self.missing
            self.log.progress("writing", last / self.size[2])
            yield np.ascontiguousarray(values)

    def fill(self, array):
        """Writes the slices into an array of a file."""
        at = 0
        for slab in self.slabs():
            array[at:at + len(slab)] = slab
            at += len(slab)

    def save(self, path, header, tail=b"", turn=None):
        """Writes a file of a header, the slices and an end."""
        with open(path, "wb") as file:
            file.write(header)
            for slab in self.slabs(turn=turn):
                file.write(slab.data)
            file.write(tail)


def work(arguments):
    if len(arguments.files) != 2:
        raise esvr.UsageError("there must be two files, IN and OUT")
    source, out = arguments.files
    program.check_output(out, ENDINGS, arguments.force, [source])
    log = program.Log(PARSER.prog, arguments)
    format_name, write = next(found for endings, found in FORMATS.items() if out.lower().endswith(endings))

    def make():
        grid = esvr.PackedGrid.from_file(source, arguments.grid, frame=arguments.frame, max_memory=arguments.max_memory)
        volume = Volume(grid, out, format_name, arguments, log)
        part = program.part_of(out)
        try:
            write(part, volume)
            os.replace(part, out)
        except (OSError, RuntimeError) as error:
            if isinstance(error, esvr.Error):
                raise
            raise esvr.Error(f"cannot write {out}: {getattr(error, 'strerror', None) or error}") from error
        finally:
            if os.path.exists(part):
                os.unlink(part)
        spacing = ", ".join(f"{n:.6g}" for n in np.linalg.norm(volume.matrix[:3, :3], axis=0))
        log.info(f"{out}: {format_name}, {' x '.join(map(str, volume.size))} voxels of {volume.dtype.name}"
                 f"{' with 3 components' if volume.components == 3 else ''}, edges of {spacing} {volume.unit or '(no unit)'}")

    return program.run_in_child(PARSER.prog, [source], [out], make, arguments.verbose)


def main():
    return program.main(PARSER, work)


if __name__ == "__main__":
    sys.exit(main())
