"""Readers of NRRD and MetaImage, whose headers are lines of text, and whose numbers may lie in other files."""
import functools
import math
import os
import re

import numpy as np

import esvr

from .image import (CHANNEL, LPS, LPS_TO_RAS, RAS, SPACE, TIME, VECTOR, Axis, Image, affine_of_steps, axes_from_letters, in_memory,
                    mapped, planes, product, require_bytes, require_shape, unit_named, unpacked)

NUMBERS = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "longlong": "i8", "ulonglong": "u8",
           "float": "f4", "double": "f8"}


# -- what both formats have ------------------------------------------------------------------------------------------
def text_header(path, separator, source, needed):
    """The fields of lines as "name: text" by their names in lower case without spaces, and where the numbers begin. The field
    `source` names the files of the numbers; those of a list are the field "files"."""
    fields = {}
    with open(path, "rb") as file:
        if separator == ":":
            file.readline()  # the name of the format
        while line := file.readline(1 << 20):
            line = line.decode("utf-8", "replace").strip()
            if not line and separator == ":":
                break
            if not line or line.startswith("#"):
                continue
            name, found, text = line.partition(separator)
            if not found:
                raise esvr.BadInput(f"{path}: the header has a line that is no field: {line[:60]!r}")
            name = name if text.startswith("=") else name.lower().replace(" ", "")  # key:=value is not a field of NRRD
            fields[name] = text.strip()
            if name == source and (separator == "=" or text.strip().upper().startswith("LIST")):
                break
        for name in needed:
            if name not in fields:
                raise esvr.BadInput(f"{path}: the header has no field {name}")
        begin = file.tell()
        if fields.get(source, "").upper().startswith("LIST"):
            fields["files"] = [line.strip() for line in file.read().decode("utf-8", "replace").splitlines() if line.strip()]
    return fields, begin


def in_files(path, source, listed, shape, read, components=0):
    """The function for Image.fetch of numbers in other files: in one, or in those of a list or a pattern, which divide the slowest
    axes among them. read(name, shape) returns the function of one of them. The numbers of axes in a header do not count so many
    axes of components."""
    words = source.split()
    pattern = re.fullmatch(r"(.*%0?\d{0,2}[diu].*?)\s+(-?\d+)\s+(-?\d+)\s+(-?\d+)\s*(\d*)", source)
    if words[0].upper() == "LIST":
        numbers, name_of, axes = range(len(listed)), listed.__getitem__, words[1] if len(words) > 1 else ""
    elif pattern:
        first, last, step = (int(pattern[k]) for k in (2, 3, 4))
        numbers, name_of, axes = range(first, last + (1 if step > 0 else -1), step), pattern[1].__mod__, pattern[5]
    else:
        numbers, name_of, axes = range(1), lambda _: source, ""
    leading = max(len(shape) - (int(axes) + components if axes else len(shape) - 1), 1)
    count = product(shape[:leading])
    if not numbers or count % len(numbers):
        raise esvr.BadInput(f"{path} names {len(numbers)} files of data for {count} slices")

    def file(k):
        return os.path.join(os.path.dirname(path), name_of(numbers[k]))
    for k in range(len(numbers)):
        if not os.path.exists(file(k)):
            raise esvr.BadInput(f"{path}: its file of data {file(k)} is missing")
    if len(numbers) == 1:
        return read(file(0), shape)
    each = count // len(numbers)
    part = functools.lru_cache(1)(lambda k: read(file(k), [each, *shape[leading:]]))
    part(0)
    return planes(shape[:leading], lambda k, index: part(k // each)((k % each, *index)))


def encoded(path, offset, encoding, skip, dtype, shape, lines=0):
    """The function for Image.fetch of the numbers that follow a place, so many lines, and then so many bytes. A skip of -1 means
    that they are the last ones of the file."""
    with open(path, "rb") as file:
        file.seek(offset)
        for _ in range(lines):
            file.readline()
        begin, size = file.tell(), product(shape) * dtype.itemsize
        if encoding == "raw":
            return mapped(path, dtype, shape, max(os.path.getsize(path) - size, begin) if skip == -1 else begin + skip)
        if encoding in ("gz", "gzip", "bz2", "bzip2") and skip >= 0:
            return unpacked(path, dtype, shape, begin, skip, "deflate" if encoding[0] == "g" else "bzip2")
        if encoding not in ("ascii", "text", "txt", "hex"):
            raise esvr.BadInput(f"{path} has the encoding '{encoding}' with a byte skip of {skip}, which is not read; raw, gzip, "
                                "bzip2, ascii and hex are")
        text = file.read()[skip:].decode("ascii")
    require_bytes(path, 2 * size if encoding == "hex" else 2 * product(shape) - 1, len(text), "the data as text")
    if encoding == "hex":
        return in_memory(np.frombuffer(bytes.fromhex("".join(text.split())), dtype, product(shape)).reshape(shape))
    words = text.replace(",", " ").split()[:product(shape)]
    return in_memory(np.array([(float if dtype.kind == "f" else int)(word) for word in words], dtype).reshape(shape))


def fill_columns(matrix, known):
    """Gives the axes that a file does not have directions of length 1 that are perpendicular to the others."""
    for column in range(known, 3):
        other = matrix[:3, 1] if column == 2 else np.eye(3)[np.argmin(np.abs(matrix[:3, 0]))]
        normal = np.cross(matrix[:3, 0], other)
        length = np.linalg.norm(normal)
        matrix[:3, column] = normal / length if length and column else np.eye(3)[column]
    return matrix


# -- NRRD ----------------------------------------------------------------------------------------------------------
VECTOR_KINDS = {"vector", "covariant-vector", "normal", "3-vector", "3-gradient", "3-normal"}
DOMAIN_KINDS = {"domain", "space", "???", "none", ""}


def read_nrrd(path, options):
    fields, begin = text_header(path, ":", "datafile", ("type", "dimension", "sizes", "encoding"))
    shape = [int(n) for n in fields["sizes"].split()]
    if len(shape) != int(fields["dimension"]):
        raise esvr.BadInput(f"{path} has {len(shape)} sizes for {fields['dimension']} axes")
    require_shape(path, shape)
    dtype, encoding = nrrd_type(path, fields), fields["encoding"].lower()
    lines, skip = int(fields.get("lineskip", 0)), int(fields.get("byteskip", 0))
    if "datafile" in fields:
        fetch = in_files(path, fields["datafile"], fields.get("files"), shape[::-1],
                         lambda name, part: encoded(name, 0, encoding, skip, dtype, part, lines))
    else:
        fetch = encoded(path, begin, encoding, skip, dtype, shape[::-1], lines)
    axes, spatial, directions = nrrd_axes(path, fields, shape, options)
    space = fields.get("space", "").strip('"').lower()
    initials = space if "-" not in space else "".join(word[0] for word in space.split("-"))
    is_patient = bool(re.fullmatch("[rl][ap]st?", initials))
    sign = np.diag([1.0 if not is_patient or letter in "ras" else -1.0 for letter in initials[:3].ljust(3)] + [1.0])
    if directions:
        matrix, unit = nrrd_directed(fields, [directions[k] for k in spatial])
        unit = unit or ("mm" if is_patient else None)
    else:
        matrix, unit = affine_of_steps(axes, nrrd_steps(fields, shape))
    image = Image("NRRD", path, axes[::-1], dtype, fetch, sign @ matrix, unit)
    if is_patient:
        image.metadata["image_space"] = LPS if initials.startswith("lp") else RAS
    if image.axis(VECTOR):
        frame = np.column_stack(nrrd_vectors(fields["measurementframe"])) if "measurementframe" in fields else np.eye(3)
        image.turn = sign[:3, :3] @ (frame if frame.shape == (3, 3) else np.eye(3))
        image.notes.append("vectors are turned as the space and the measurement frame say")
    if fields.get("sampleunits"):
        image.metadata["value_unit"] = fields["sampleunits"].strip('"')
    segments = sorted(int(key[7:-5]) for key in fields if re.fullmatch(r"Segment\d+_Name", key))
    if segments:
        image.metadata["image_segments"] = "; ".join(
            f"{fields.get(f'Segment{k}_LabelValue', '=?')[1:]}: {fields[f'Segment{k}_Name'][1:]}" for k in segments)
    return image


def nrrd_type(path, fields):
    """The type of the numbers, which has many names: "unsigned short int" is "ushort" and "uint16_t"."""
    name = fields["type"].lower().replace("unsigned ", "u").replace("signed ", "").removesuffix(" int").removesuffix("_t")
    code = NUMBERS.get(name.replace(" ", "")) or (name if re.fullmatch("u?int(8|16|32|64)", name) else None)
    if code is None:
        raise esvr.BadInput(f"{path} has values of type '{fields['type']}', which is not read")
    dtype = np.dtype(code)
    if dtype.itemsize == 1 or fields["encoding"].lower() in ("ascii", "text", "txt"):
        return dtype
    if fields.get("endian", "").lower() not in ("little", "big"):
        raise esvr.BadInput(f"{path}: the header does not say whether its numbers are little or big endian")
    return dtype.newbyteorder(fields["endian"].lower())


def nrrd_list(fields, name, count, default=""):
    """A value for each axis; names in quotes may have spaces."""
    values = [quoted or plain for quoted, plain in re.findall(r'"([^"]*)"|(\S+)', fields.get(name, ""))]
    return values + [default] * (count - len(values))


def nrrd_vectors(text):
    """The vectors of a field; None for "none"."""
    return [None if none else np.array([float(n) for n in numbers.split(",")])[:3]
            for numbers, none in re.findall(r"\(([^)]*)\)|(none)", text)]


def nrrd_axes(path, fields, shape, options):
    """The axes, the fastest first, the numbers of those of space, and the directions of all."""
    count = len(shape)
    kinds, labels = [kind.lower() for kind in nrrd_list(fields, "kinds", count)], nrrd_list(fields, "labels", count)
    directions = nrrd_vectors(fields.get("spacedirections", ""))
    if directions and len(directions) != count:
        raise esvr.BadInput(f"{path} has {len(directions)} space directions for {count} axes")
    if options.axes:
        names = [axis.kind for axis in axes_from_letters(options.axes, shape[::-1], path)][::-1]
        spatial = [names.index(kind) for kind in SPACE if kind in names]
    else:
        names = [VECTOR if kind in VECTOR_KINDS and n == 3 else TIME if kind == "time" else CHANNEL for kind, n in zip(kinds, shape)]
        spatial = [k for k in range(count) if (directions[k] is not None and np.any(directions[k]) if directions else
                                               kinds[k] in DOMAIN_KINDS)]
    if len(spatial) > 3:
        raise esvr.UsageError(f"{path} has {count} axes ({' x '.join(map(str, shape))}, the fastest first), of which {len(spatial)} "
                              f"may be of space; name them, the slowest first, by --axes, as in --axes {'ctzyx'[-count:]}")
    for kind, k in zip(SPACE, spatial):
        names[k] = kind
    return [Axis(name, n, label or kind) for name, n, label, kind in zip(names, shape, labels, kinds)], spatial, directions


def nrrd_directed(fields, directions):
    """The matrix of space directions and its unit (None if the file does not say)."""
    matrix = np.eye(4)
    for column, direction in enumerate(directions):
        matrix[:len(direction), column] = direction
    origin = nrrd_vectors(fields["spaceorigin"])[0] if "spaceorigin" in fields else np.zeros(3)
    matrix[:len(origin), 3] = np.where(np.isfinite(origin), origin, 0.0)
    units = {unit_named(unit) for unit in nrrd_list(fields, "spaceunits", 3)[:3] if unit}
    return fill_columns(matrix, len(directions)), units.pop() if len(units) == 1 else None


def nrrd_steps(fields, shape):
    """The step, the first place and the unit of each axis, by spacings, or by the places where an axis begins and ends."""
    count = len(shape)
    spacings, lows, highs = ([float(n) for n in nrrd_list(fields, name, count, "nan")] for name in ("spacings", "axismins", "axismaxs"))
    centers = nrrd_list(fields, "centers" if "centers" in fields else "centerings", count)
    for n, step, low, high, center, unit in zip(shape, spacings, lows, highs, centers, nrrd_list(fields, "units", count)):
        is_node = center == "node"
        step = step if math.isfinite(step) else (high - low) / max(n - is_node, 1)
        step = step if math.isfinite(step) and step else 1.0
        first = (low if math.isfinite(low) else high - step * (n - is_node)) + (0.0 if is_node else step / 2)
        yield step, first if math.isfinite(first) else 0.0, unit


# -- MetaImage -----------------------------------------------------------------------------------------------------
def read_metaimage(path, options):
    fields, begin = text_header(path, "=", "elementdatafile", ("ndims", "dimsize", "elementtype", "elementdatafile"))

    def is_true(*names):
        return next((fields[name] for name in names if name in fields), "false").lower() in ("true", "t", "1")
    count, channels = int(fields["ndims"]), int(fields.get("elementnumberofchannels", 1))
    shape, kind = [int(n) for n in fields["dimsize"].split()], fields["elementtype"].lower().removeprefix("met_").replace("_", "")
    code = {**NUMBERS, "long": "i4", "ulong": "u4"}.get(kind)
    for name, expected, is_read in (("objecttype", "an image", fields.get("objecttype", "Image").lower() == "image"),
                                    ("elementtype", "a type of numbers", code),
                                    ("dimsize", "two to four axes", len(shape) == count and 2 <= count <= 4)):
        if not is_read:
            raise esvr.BadInput(f"{path} has {name} = {fields[name]}, which is not read; {expected} is needed")
    dtype = np.dtype(code).newbyteorder(">" if is_true("elementbyteordermsb", "binarydatabyteordermsb") else "<")
    axes = [Axis(name, n) for name, n in zip(["x", "y", "z", TIME], shape)][::-1]
    if channels > 1:
        axes.append(Axis(VECTOR if channels == 3 and dtype.kind == "f" else CHANNEL, channels))
    encoding = "gzip" if is_true("compresseddata") else "raw" if fields.get("binarydata") is None or is_true("binarydata") else "ascii"
    skip, sizes = int(fields.get("headersize", 0)), [axis.size for axis in axes]
    if fields["elementdatafile"].upper() == "LOCAL":
        fetch = encoded(path, begin, encoding, 0, dtype, sizes)
    else:
        fetch = in_files(path, fields["elementdatafile"], fields.get("files"), sizes,
                         lambda name, part: encoded(name, 0, encoding, skip, dtype, part), int(channels > 1))
    slope, intercept = (float(fields.get(f"elementtointensityfunction{name}", n)) for name, n in (("slope", 1), ("offset", 0)))
    image = Image("MetaImage", path, axes, dtype, fetch, LPS_TO_RAS @ meta_matrix(fields, count), "mm",
                  (slope, intercept) if slope else None, metadata={"image_space": LPS})
    if image.axis(VECTOR):
        image.turn = LPS_TO_RAS[:3, :3]
        image.notes.append("vectors are turned from LPS to RAS")
    return image


def meta_matrix(fields, count):
    def numbers(*names, default):
        return [float(n) for n in next((fields[name].split() for name in names if name in fields), default)]
    side, matrix = min(count, 3), np.eye(4)
    # Each row of the field is the direction of an axis.
    rows = np.reshape(numbers("transformmatrix", "rotation", "orientation", default=np.eye(count).ravel()), (count, count))
    spacing = [abs(n) or 1.0 for n in numbers("elementspacing", "elementsize", default=[1] * count)]
    matrix[:side, :side] = rows[:side, :side].T * spacing[:side]
    matrix[:side, 3] = numbers("offset", "origin", "position", default=[0] * count)[:side]
    return fill_columns(matrix, side)
