"""Grids as images: `python3 -m esvr.images.vdb2image IN.vdb|IN.esvr OUT.nii.gz`."""
import os
import sys

import numpy as np

import esvr

from . import program
from .image import factor, product, unit_named
from .program import Option, Program, byte_size
from .writers import FORMATS, INTEGERS, TYPES

SLAB_BYTES = 64 << 20
ENDINGS = [ending for endings in FORMATS for ending in endings]

PROGRAM = Program(
    "vdb2image", "Converts a grid to an image of voxels, with the type, lengths and orientation of the image that it came from.",
    "  vdb2image IN OUT [options]     IN: .vdb, .nvdb or .esvr\n                                 OUT: " + " ".join(ENDINGS),
    [Option("grid", "NAME", "which of several grids", short="g"),
     Option("frame", "N", "which frame of a sequence in one .esvr file", int),
     Option("type", "TYPE", "type of the values: uint8, int16, float32, ... (as the image had it, where it holds all values)",
            ("bool", *INTEGERS, "float16", "float32", "float64")),
     Option("unit", "UNIT", "unit of lengths (that of the image that the grid came from)"),
     Option("max-memory", "SIZE", "limit on the memory of the grid and of the image (4G)", byte_size, default=4 * 10 ** 9),
     Option("force", "", "replace OUT if it exists", short="f")],
    "The box of the image is that of the image that the grid came from, or else that of the active voxels. Voxels that were missing "
    "become NaN (netCDF: _FillValue). A type that does not hold all values is refused. What a format cannot hold is refused "
    "(MRC, netCDF: oblique axes) or named in a warning (TIFF, NPY).",
    "  vdb2image brain.esvr brain.nii.gz\n  vdb2image cells.vdb cells.ome.tif -g DAPI")


class Facts:
    """What is known of the values after one pass."""

    def __init__(self):
        self.low, self.high, self.whole, self.half, self.single, self.holes = None, None, True, True, True, False
        self.count, self.sum, self.squares = 0, 0.0, 0.0

    def add(self, values, gone):
        if gone is not None:
            self.holes = self.holes or bool(gone.any())
            values = values[~gone]
        if not values.size:
            return
        if values.dtype.kind == "f" and not np.isfinite(values).all():
            self.whole = False
        low, high = values.min(), values.max()
        self.low = low if self.low is None else min(self.low, low)
        self.high = high if self.high is None else max(self.high, high)
        with np.errstate(over="ignore", invalid="ignore"):
            if values.dtype.kind == "f":
                self.whole = self.whole and bool(np.all(values == np.floor(values)))
                self.single = self.single and (values.dtype == np.float32 or bool(np.all(values == values.astype(np.float32))))
            elif values.dtype.itemsize > 2:
                self.single = self.single and max(abs(int(low)), abs(int(high))) <= 2 ** 24
            self.half = self.half and bool(np.all(values == values.astype(np.float16)))
        self.count += values.size
        self.sum += float(values.sum(dtype=np.float64))
        self.squares += float(np.square(values, dtype=np.float64).sum())

    @property
    def mean(self):
        return self.sum / self.count if self.count else 0.0

    @property
    def deviation(self):
        return max(self.squares / self.count - self.mean ** 2, 0.0) ** 0.5 if self.count else 0.0

    def fit(self, dtype):
        """Whether a type holds all values."""
        if self.low is None:
            return True
        if dtype.kind == "b":
            return self.whole and self.low >= 0 and self.high <= 1
        if dtype.kind in "iu":
            limits = np.iinfo(dtype)
            return self.whole and limits.min <= int(self.low) and int(self.high) <= limits.max
        if dtype.itemsize < 8:
            return self.half if dtype.itemsize == 2 else self.single
        return isinstance(self.low, np.floating) or max(abs(int(self.low)), abs(int(self.high))) <= 2 ** 53


class Volume:
    """The box of a grid that becomes an image.

    dtype is that of the file, size the number of voxels along x, y and z, components 1 or 3, missing the number of voxels that are
    missing (None if none is), and unit that of the lengths (None if it is not known).
    """

    def __init__(self, grid, out, format_name, options, log):
        self.grid, self.out, self.log, self.name, self.metadata = grid, str(out), log, grid.name, grid.metadata
        self.components = 3 if grid.value_type == "vec3s" else 1
        self.begin, self.size = self._box(options)
        self._space(options)
        self.has_holes = bool(self.metadata.get("image_missing"))
        self.facts = self._scan()
        self.dtype, self.missing = self._type(format_name, options)

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
        wanted = unit_named(options.unit) if options.unit else unit_named(str(self.metadata.get("image_unit", ""))) or unit
        if options.unit and wanted is None:
            raise esvr.UsageError(f"--unit: '{options.unit}' is no unit of length; mm, um, nm, angstrom, m, ... are")
        self.unit = wanted if unit else unit
        self.matrix = matrix
        if unit:
            self.matrix[:3] *= factor(unit, wanted)
        elif wanted:
            self.unit = wanted  # numbers without a unit get one

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

    def _scan(self):
        facts = Facts()
        for last, values, gone in self._parts():
            facts.add(values, gone)
            self.log.progress("reading", last / self.size[2])
        return facts

    def _type(self, format_name, options):
        possible, grid_type = TYPES[format_name], np.dtype({"vec3s": "float32", "float": "float32", "double": "float64"}.get(
            self.grid.value_type, self.grid.value_type))
        came = self.metadata.get("image_type", grid_type.name)
        if options.type:
            wanted = [options.type]
            if options.type not in possible:
                raise esvr.UsageError(f"{format_name} has no values of type {options.type}; it has {', '.join(possible)}")
        elif came in INTEGERS or came == "bool":
            wanted = [came] + ["uint8"] * (came == "bool") + INTEGERS[2:] + ["float32", "float64"]
        else:
            wanted = [came, "float32", "float64"]
        for name in wanted:
            dtype = np.dtype(name)
            if name not in possible or not self.facts.fit(dtype):
                continue
            if not self.facts.holes:
                return dtype, None
            if dtype.kind == "f":
                return dtype, dtype.type(np.nan)
            if format_name == "netCDF" and dtype.kind in "iu":
                limits = np.iinfo(dtype)
                free = [n for n in (limits.min, limits.max) if self.facts.low is None or not self.facts.low <= n <= self.facts.high]
                if free:
                    return dtype, dtype.type(free[0])
        reason = "with missing voxels " if self.facts.holes else ""
        raise esvr.UsageError(f"the values {self.facts.low} to {self.facts.high} of the grid {self.name} {reason}cannot be written "
                              f"exactly {'as ' + options.type if options.type else 'in any type of ' + format_name}; "
                              + ("choose another type" if options.type else "choose another format, or --type of image2vdb"))

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
    log = program.Log(PROGRAM.name, arguments)
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

    return program.run_in_child(PROGRAM.name, [source], [out], make, arguments.verbose)


def main():
    return program.main(PROGRAM, work)


if __name__ == "__main__":
    sys.exit(main())
