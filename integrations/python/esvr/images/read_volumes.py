"""Readers of NIfTI, Analyze, NRRD, MetaImage, MRC, VTI, NumPy's and raw files."""
import math
import os
import re

import numpy as np

import esvr

from .flat import Flat, Joined, Loaded, MOST_DEFLATED
from .image import (CHANNEL, LPS_TO_RAS, SPACE, TIME, VECTOR, Axis, Image, affine_of, axes_from_letters, factor, need, product,
                    reading, require_bytes, require_shape, unit_named)


LPS = "left-posterior-superior"


# -- raw numbers ---------------------------------------------------------------------------------------------------
RAW_TYPES = ["uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64", "float16", "float32", "float64"]


def read_raw(path, options):
    if not options.dims or not options.type:
        raise esvr.UsageError(f"{path} has no header that is known; if it is a RAW image, give --dims X,Y,Z and --type")
    if options.type not in RAW_TYPES:
        raise esvr.UsageError(f"--type is one of {', '.join(RAW_TYPES)}, not '{options.type}'")
    dtype = np.dtype(options.type).newbyteorder(">" if options.endian == "big" else "<")
    x, y, z = options.dims
    needed, there = x * y * z * dtype.itemsize + options.skip, os.path.getsize(path)
    if needed != there:
        raise esvr.BadInput(f"{path} has {there} bytes, and --dims, --type and --skip need {needed}")
    fetch = Flat(path, dtype, (z, y, x), options.skip)
    return Image("RAW", path, [Axis("z", z), Axis("y", y), Axis("x", x)], dtype, fetch, np.eye(4))


def read_npy(path, options):
    with reading(path, "NPY"), open(path, "rb") as file:
        version = np.lib.format.read_magic(file)
        header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, is_fortran, dtype = header(file)
        offset = file.tell()
    if dtype.hasobject or dtype.names:
        raise esvr.BadInput(f"{path} holds Python objects or records, not numbers")
    axes = unnamed_axes(path, shape, options)
    if not is_fortran:
        return Image("NPY", path, axes, dtype, Flat(path, dtype, shape, offset), np.eye(4))
    return Image("NPY", path, axes[::-1], dtype, Flat(path, dtype, shape[::-1], offset), np.eye(4))


def unnamed_axes(path, shape, options):
    """The axes of a file that does not name them: z, y, x, or those of --axes."""
    require_shape(path, shape)
    if options.axes:
        return axes_from_letters(options.axes, shape, path)
    if len(shape) in (2, 3):
        return axes_from_letters("zyx"[-len(shape):], shape, path)
    raise esvr.UsageError(f"{path} has {len(shape)} axes ({' x '.join(map(str, shape))}) and does not name them; name them, the "
                          "slowest first, by --axes, as in --axes ctzyx")


# -- NIfTI and Analyze ---------------------------------------------------------------------------------------------
NIFTI_UNITS = {1: "m", 2: "mm", 3: "um"}
VECTOR_INTENTS = {1006, 1007}  # displacements, vectors


def nifti_files(path):
    """The names of the header and of the voxels, which are one file or two."""
    stem, ending = os.path.splitext(path)
    packed = ending if ending in (".gz", ".GZ") else ""
    stem, ending = os.path.splitext(stem) if packed else (stem, ending)
    lower = ending.lower()
    if lower not in (".hdr", ".img"):
        return path, path
    other = (".img" if lower == ".hdr" else ".hdr") if ending.islower() else (".IMG" if lower == ".hdr" else ".HDR")
    partner = next((name for name in (stem + other + packed, stem + other, stem + other + ".gz") if os.path.exists(name)), None)
    return (path, partner or stem + other) if lower == ".hdr" else (partner or stem + other, path)


def is_gzip(path):
    with open(path, "rb") as file:
        return file.read(2) == b"\x1f\x8b"


def read_nifti(path, options):
    need("nibabel", "python3-nibabel", path, "NIfTI")
    from nibabel import AnalyzeHeader, Nifti1Header, Nifti1Pair, Nifti2Header
    header_path, data_path = nifti_files(os.fspath(path))
    with reading(header_path, "NIfTI"):
        with open(header_path, "rb") as file:
            from .flat import Inflated
            head = (Inflated(file) if is_gzip(header_path) else file).read(540)
        magic1, magic2 = head[344:348], head[4:8]
        kind = Nifti1Header if magic1 in (b"n+1\0", b"ni1\0") else Nifti2Header if magic2 in (b"n+2\0", b"ni2\0") else AnalyzeHeader
        size = 540 if kind is Nifti2Header else 348
        if len(head) < size:
            raise esvr.BadInput(f"{header_path} is cut short: the header of {kind.__name__[:-6]} has {size} bytes")
        header = kind(head[:size], check=True)
    single = magic1 == b"n+1\0" or magic2 == b"n+2\0"
    if single:
        data_path = header_path
    elif not os.path.exists(data_path):
        raise esvr.BadInput(f"{path} has its voxels in another file, {data_path}, which is missing")
    with reading(path, "NIfTI"):
        shape, dtype = header.get_data_shape(), header.get_data_dtype()
        offset = int(header.get_data_offset())
        names = [Axis(kind, n) for kind, n in zip(["x", "y", "z", TIME, "dim5", "dim6", "dim7"], shape)]
        scale = header.get_slope_inter() if kind is not AnalyzeHeader else (None, None)
        matrix, unit, form = nifti_space(header, kind)
    if kind is AnalyzeHeader:
        form = "Analyze has no orientation: the spacings alone"
    if len(names) > 4:
        is_vector = kind is not AnalyzeHeader and int(header["intent_code"]) in VECTOR_INTENTS and shape[4] == 3
        names[4].kind = VECTOR if is_vector else CHANNEL
    require_shape(path, shape)
    fields = []
    if dtype.names:  # colors
        fields = [Axis("sample", len(dtype.names), labels=list(dtype.names))]
        dtype = dtype[0]
    if dtype.kind not in "iufb":
        raise esvr.BadInput(f"{path} holds numbers of type {dtype.name}, which is not read; real numbers are")
    axes = names[::-1] + fields
    fetch = Flat(data_path, dtype, [axis.size for axis in axes], *((0, "deflate", offset) if is_gzip(data_path) else (offset,)))
    image = Image("NIfTI" if kind is not AnalyzeHeader else "Analyze", path, axes, dtype, fetch, matrix, unit,
                  notes=[form])
    image.scale = None if scale[0] is None or tuple(scale) == (1, 0) else (float(scale[0]), float(scale[1]))
    image.metadata["image_space"] = "right-anterior-superior"
    return image


def nifti_space(header, kind):
    """The matrix, its unit and a text that says which form of the header it is of."""
    from nibabel import AnalyzeHeader
    zooms = np.array([abs(float(z)) or 1.0 for z in header["pixdim"][1:4]])
    if kind is AnalyzeHeader:
        return affine_of(zooms), "mm", ""
    code = int(header["xyzt_units"]) & 7
    if code not in (0, *NIFTI_UNITS):
        raise ValueError(f"its unit of lengths has the code {code}, which NIfTI does not define")
    unit = NIFTI_UNITS.get(code, "mm")
    said = "" if code else "; its lengths have no unit, and are taken as mm"
    if int(header["sform_code"]) > 0:
        return header.get_sform(), unit, f"the sform gives the transform{said}"
    if int(header["qform_code"]) > 0:
        return header.get_qform(), unit, f"the qform gives the transform{said}"
    return affine_of(zooms), unit, f"there is no qform and no sform: the spacings alone give the transform{said}"


# -- NRRD ----------------------------------------------------------------------------------------------------------
NRRD_TYPES = {name: np.dtype(code) for names, code in [
    ("signed char,int8,int8_t", "i1"), ("uchar,unsigned char,uint8,uint8_t", "u1"),
    ("short,short int,signed short,signed short int,int16,int16_t", "i2"),
    ("ushort,unsigned short,unsigned short int,uint16,uint16_t", "u2"), ("int,signed int,int32,int32_t", "i4"),
    ("uint,unsigned int,uint32,uint32_t", "u4"),
    ("longlong,long long,long long int,signed long long,signed long long int,int64,int64_t", "i8"),
    ("ulonglong,unsigned long long,unsigned long long int,uint64,uint64_t", "u8"), ("float", "f4"), ("double", "f8")]
    for name in names.split(",")}
VECTOR_KINDS = {"vector", "covariant-vector", "normal", "3-vector", "3-gradient", "3-normal"}
DOMAIN_KINDS = {"domain", "space", "???", "none", ""}
SPACES = {"ras": (1, 1, 1), "right-anterior-superior": (1, 1, 1), "las": (-1, 1, 1), "left-anterior-superior": (-1, 1, 1),
          "lps": (-1, -1, 1), "left-posterior-superior": (-1, -1, 1)}


def nrrd_space_name(fields):
    """The name of the space without its time."""
    return fields.get("space", "").strip('"').lower().removesuffix("-time").removesuffix("t")


def nrrd_header(path):
    """The fields by their names in lower case, the key/value pairs, and where the data begin."""
    fields, pairs = {}, {}
    with open(path, "rb") as file:
        first = file.readline(100).rstrip()
        if not re.fullmatch(rb"NRRD000[1-5]", first):
            raise esvr.BadInput(f"{path} is no NRRD file of a version from 1 to 5: it begins with {first[:20]!r}")
        while line := file.readline(1 << 20):
            text = line.decode("utf-8", "replace").rstrip("\r\n")
            if not text:
                break
            if text.startswith("#"):
                continue
            key, separator, value = text.partition(":=")
            if separator and ": " not in key:
                pairs[key] = value
                continue
            key, separator, value = text.partition(":")
            if not separator:
                raise esvr.BadInput(f"{path}: the header has a line that is no field: {text[:60]!r}")
            key = key.strip().lower().replace("centerings", "centers").replace("data file", "datafile")
            fields[key.replace("byte skip", "byteskip").replace("line skip", "lineskip")] = value.strip()
            if key == "datafile" and value.strip().upper().startswith("LIST"):
                fields["files"] = [line.decode("utf-8", "replace").strip() for line in file if line.strip()]
                break
        return fields, pairs, file.tell()


def nrrd_vectors(text):
    """The vectors of a field; None for "none"."""
    found = re.findall(r"\(([^)]*)\)|(none)", text)
    return [None if none else np.array([float(n) for n in numbers.split(",")]) for numbers, none in found]


def nrrd_data_files(path, fields):
    """The files of the data, and how many axes each has."""
    text, folder = fields["datafile"], os.path.dirname(os.fspath(path))
    dimension = int(fields["dimension"])
    words = text.split()
    if words[0].upper() == "LIST":
        names, axes = fields.get("files", []), int(words[1]) if len(words) > 1 else dimension - 1
    elif "%" in text and len(words) >= 4:
        count = 4 if len(words) == 4 else 5
        numbers = [int(word) for word in words[-count + 1:]]
        pattern = " ".join(words[:-count + 1])
        first, last, step = numbers[:3]
        names = [pattern % i for i in range(first, last + (1 if step > 0 else -1), step)]
        axes = numbers[3] if len(numbers) > 3 else dimension - 1
    else:
        names, axes = [text], dimension
    if not names:
        raise esvr.BadInput(f"{path} names no file of data")
    return [os.path.join(folder, name) for name in names], axes


def nrrd_fetch(path, fields, offset, dtype, shape):
    """shape has the fastest axis first."""
    encoding = fields.get("encoding", "").lower()
    files, axes = ([path], len(shape)) if "datafile" not in fields else nrrd_data_files(path, fields)
    last = product(shape[axes - 1:]) // len(files) if axes <= len(shape) else 1
    if product(shape[axes - 1:]) % len(files):
        raise esvr.BadInput(f"{path} has {len(files)} files of data, among which its slices cannot be divided")
    part_shape = tuple(shape[:axes - 1]) + (last,)
    lines, skip = int(fields.get("lineskip", 0)), int(fields.get("byteskip", 0))
    parts = []
    for name in files:
        if not os.path.exists(name):
            raise esvr.BadInput(f"{path}: its file of data {name} is missing")
        begin = offset if name is path else 0
        with open(name, "rb") as file:
            file.seek(begin)
            for _ in range(lines):
                file.readline()
            begin = file.tell()
            text = file.read() if encoding in ("ascii", "text", "txt", "hex") else b""
        if encoding == "raw":
            if skip == -1:
                begin, passed = max(os.path.getsize(name) - product(part_shape) * dtype.itemsize, begin), 0
            else:
                begin, passed = begin + skip, 0
            parts.append(Flat(name, dtype, part_shape[::-1], begin))
        elif encoding in ("gz", "gzip", "bz2", "bzip2"):
            if skip < 0:
                raise esvr.BadInput(f"{path}: a byte skip of {skip} with compressed data has no meaning")
            parts.append(Flat(name, dtype, part_shape[::-1], begin, "deflate" if encoding[0] == "g" else "bzip2", skip))
        elif text or encoding in ("ascii", "text", "txt", "hex"):
            parts.append(Loaded(nrrd_text(name, text[skip:], encoding, dtype, part_shape[::-1])))
        else:
            raise esvr.BadInput(f"{path} has the encoding '{encoding}', which is not read; raw, gzip, bzip2, ascii and hex are")
    if len(parts) == 1:
        return parts[0], shape[::-1]
    joined = Joined(parts)
    above = tuple(shape[axes - 1:][::-1])
    if len(above) == 1:
        return joined, shape[::-1]
    # The files divide several axes, of which the outer ones are found by arithmetic.
    outer, inner = above[:-1], above[-1]

    def fetch(index):
        if not all(isinstance(i, (int, np.integer)) for i in index[:len(outer)]):
            first = index[0]
            if isinstance(first, slice):
                return np.stack([fetch((i,) + tuple(index[1:])) for i in range(*first.indices(outer[0]))])
            return np.stack([fetch((first, i) + tuple(index[2:])) for i in range(*index[1].indices(outer[1]))])
        at = 0
        for i, n in zip(index, outer):
            at = at * n + int(i)
        at *= inner
        rest = index[len(outer):]
        if isinstance(rest[0], slice):
            low, high, _ = rest[0].indices(inner)
            return joined((slice(at + low, at + high),) + tuple(rest[1:]))
        return joined((at + int(rest[0]),) + tuple(rest[1:]))
    return fetch, shape[::-1]


def nrrd_text(path, text, encoding, dtype, shape):
    count = product(shape)
    if encoding == "hex":
        require_bytes(path, 2 * count * dtype.itemsize, len(text), "the data in hexadecimal digits")
        return np.frombuffer(bytes.fromhex("".join(text.decode("ascii").split())), dtype)[:count].reshape(shape)
    require_bytes(path, 2 * count - 1, len(text), "the data as text")
    words = text.decode("ascii").replace(",", " ").split()
    if len(words) < count:
        raise esvr.BadInput(f"{path} has {len(words)} numbers, and {count} are needed")
    if dtype.kind == "f":
        return np.array([float(word) for word in words[:count]], dtype).reshape(shape)
    return np.array([int(word) for word in words[:count]], dtype).reshape(shape)


def read_nrrd(path, options):
    with reading(path, "NRRD"):
        fields, pairs, offset = nrrd_header(path)
        for name in ("type", "dimension", "sizes", "encoding"):
            if name not in fields:
                raise esvr.BadInput(f"{path}: the header has no field '{name}'")
        if fields["type"].lower() not in NRRD_TYPES:
            raise esvr.BadInput(f"{path} has values of type '{fields['type']}', which is not read")
        shape = [int(n) for n in fields["sizes"].split()]
        if len(shape) != int(fields["dimension"]):
            raise esvr.BadInput(f"{path} has {len(shape)} sizes for {fields['dimension']} axes")
        require_shape(path, shape)
        dtype = NRRD_TYPES[fields["type"].lower()]
        if dtype.itemsize > 1 and fields["encoding"].lower() not in ("ascii", "text", "txt"):
            if fields.get("endian") not in ("little", "big"):
                raise esvr.BadInput(f"{path}: the header does not say whether its numbers are little or big endian")
            dtype = dtype.newbyteorder("<" if fields["endian"] == "little" else ">")
        axes, affine, unit, turn, notes = nrrd_space(path, fields, shape, options)
        fetch, slow_first = nrrd_fetch(path, fields, offset, dtype, shape)
    image = Image("NRRD", path, axes[::-1], dtype, fetch, affine, unit, turn=turn, notes=notes)
    space = nrrd_space_name(fields)
    if space in SPACES:
        image.metadata["image_space"] = LPS if SPACES[space] == (-1, -1, 1) else "right-anterior-superior"
    if fields.get("sample units"):
        image.metadata["value_unit"] = fields["sample units"].strip('"')
    segments = sorted({key.split("_")[0] for key in pairs if re.fullmatch(r"Segment\d+_Name", key)}, key=lambda s: int(s[7:]))
    if segments:
        image.metadata["image_segments"] = "; ".join(
            f"{pairs.get(s + '_LabelValue', '?')}: {pairs[s + '_Name']}" for s in segments)
    return image


def nrrd_list(fields, name, count, default):
    """A value for each axis; names in quotes may have spaces."""
    words = re.findall(r'"([^"]*)"|(\S+)', fields.get(name, ""))
    values = [quoted or plain for quoted, plain in words]
    return values + [default] * (count - len(values))


def nrrd_space(path, fields, shape, options):
    """The axes (the fastest first), the matrix, its unit, the turn of vectors, and notes."""
    count, notes = len(shape), []
    kinds = [kind.lower() for kind in nrrd_list(fields, "kinds", count, "")]
    labels = nrrd_list(fields, "labels", count, "")
    directions = nrrd_vectors(fields["space directions"]) if "space directions" in fields else []
    if directions and len(directions) != count:
        raise esvr.BadInput(f"{path} has {len(directions)} space directions for {count} axes")
    if options.axes:
        names = [axis.kind for axis in axes_from_letters(options.axes, shape[::-1], path)][::-1]
        spatial = [names.index(kind) for kind in SPACE if kind in names]
    else:
        if directions:
            spatial = [i for i, v in enumerate(directions) if v is not None and np.any(v[:3])]
        else:
            spatial = [i for i, kind in enumerate(kinds) if kind in DOMAIN_KINDS]
        if len(spatial) > 3:
            raise esvr.UsageError(f"{path} has {count} axes ({' x '.join(map(str, shape))}, the fastest first), of which "
                                  f"{len(spatial)} may be of space; name them, the slowest first, by --axes, as in "
                                  f"--axes {'ctzyx'[-count:]}")
        names = [nrrd_kind(kinds[i], shape[i]) for i in range(count)]
        for kind, i in zip(SPACE, spatial):
            names[i] = kind
    axes = [Axis(kind, n, labels[i] or kinds[i]) for i, (kind, n) in enumerate(zip(names, shape))]
    sign = np.ones(3)
    space = nrrd_space_name(fields)
    if space in SPACES:
        sign = np.array(SPACES[space], float)
    matrix, unit = nrrd_matrix(path, fields, shape, spatial, directions, space)
    turn = None
    if VECTOR in names:
        frame = np.column_stack(nrrd_vectors(fields["measurement frame"])) if "measurement frame" in fields else np.eye(3)
        turn = np.diag(sign) @ frame if frame.shape == (3, 3) else np.diag(sign)
        if np.allclose(turn, np.eye(3)):
            turn = None
        else:
            notes.append("vectors are turned as the space and the measurement frame say")
    return axes, np.diag([*sign, 1.0]) @ matrix, unit, turn, notes


def nrrd_kind(kind, size):
    if kind in VECTOR_KINDS and size == 3:
        return VECTOR
    return TIME if kind == "time" else CHANNEL


def nrrd_matrix(path, fields, shape, spatial, directions, space):
    matrix = np.eye(4)
    units = nrrd_list(fields, "space units" if directions else "units", len(shape), "")
    if directions:
        for column, i in enumerate(spatial):
            vector = directions[i][:3]
            matrix[:len(vector), column] = vector
        fill_columns(matrix, len(spatial))
        origin = nrrd_vectors(fields["space origin"])[0][:3] if "space origin" in fields else np.zeros(3)
        matrix[:len(origin), 3] = np.where(np.isfinite(origin), origin, 0.0)
        found = {unit_named(unit) for unit in units[:len(matrix) - 1] if unit}
        unit = found.pop() if len(found) == 1 else None
        return matrix, unit or ("mm" if space in SPACES else None)
    numbers = {name: [float(v) for v in nrrd_list(fields, name, len(shape), "nan")] for name in
               ("spacings", "axis mins", "axis maxs")}
    centers = nrrd_list(fields, "centers", len(shape), "")
    found = [unit_named(units[i]) for i in spatial]
    unit = found[0] if found and found[0] and None not in found else None
    for column, i in enumerate(spatial):
        is_node = centers[i] == "node"
        spacing, low, high = numbers["spacings"][i], numbers["axis mins"][i], numbers["axis maxs"][i]
        if not math.isfinite(spacing) and math.isfinite(low) and math.isfinite(high):
            spacing = (high - low) / max(shape[i] - is_node, 1)
        spacing = spacing if math.isfinite(spacing) and spacing else 1.0
        if not math.isfinite(low) and math.isfinite(high):
            low = high - spacing * (shape[i] - is_node)
        by = factor(found[column], unit) if unit else 1.0
        matrix[column, column] = spacing * by
        if math.isfinite(low):
            matrix[column, 3] = (low + (0.0 if is_node else spacing / 2)) * by
    return matrix, unit


def fill_columns(matrix, known):
    """Gives the axes that a file does not have directions of length 1 that are perpendicular to the others."""
    for column in range(known, 3):
        others = matrix[:3, :column]
        if column == 2:
            normal = np.cross(others[:, 0], others[:, 1])
        else:
            smallest = np.eye(3)[np.argmin(np.abs(others[:, 0]))]
            normal = np.cross(others[:, 0], smallest)
        length = np.linalg.norm(normal)
        matrix[:3, column] = normal / length if length else np.eye(3)[column]


# -- MetaImage -----------------------------------------------------------------------------------------------------
META_TYPES = {"CHAR": "i1", "UCHAR": "u1", "SHORT": "i2", "USHORT": "u2", "INT": "i4", "UINT": "u4", "LONG": "i4", "ULONG": "u4",
              "LONG_LONG": "i8", "ULONG_LONG": "u8", "FLOAT": "f4", "DOUBLE": "f8"}


def read_metaimage(path, options):
    with reading(path, "MetaImage"):
        fields, names, offset = meta_header(path)
        count, channels = int(fields["ndims"]), int(fields.get("elementnumberofchannels", 1))
        shape = [int(n) for n in fields["dimsize"].split()]
        kind = fields["elementtype"].upper().removeprefix("MET_")
        if kind not in META_TYPES:
            raise esvr.BadInput(f"{path} has elements of type {fields['elementtype']}, which is not read")
        if len(shape) != count or not 2 <= count <= 4:
            raise esvr.BadInput(f"{path} has {len(shape)} sizes for {count} axes; images of two to four axes are read")
        require_shape(path, shape)
        if fields.get("objecttype", "Image").lower() != "image":
            raise esvr.BadInput(f"{path} holds an object of type {fields['objecttype']}, not an image")
        big = (fields.get("elementbyteordermsb") or fields.get("binarydatabyteordermsb", "False")).lower() in ("true", "t", "1")
        dtype = np.dtype(META_TYPES[kind]).newbyteorder(">" if big else "<")
        fetch = meta_fetch(path, fields, names, offset, dtype, shape[::-1] + ([channels] if channels > 1 else []))
        affine = meta_matrix(fields, count)
    axes = [Axis(kind, n) for kind, n in zip(["x", "y", "z", TIME], shape)][::-1]
    if channels > 1:
        is_vector = channels == 3 and dtype.kind == "f"
        axes.append(Axis(VECTOR if is_vector else CHANNEL, channels))
    image = Image("MetaImage", path, axes, dtype, fetch, LPS_TO_RAS @ affine, "mm", metadata={"image_space": LPS})
    slope, intercept = (float(fields.get(f"elementtointensityfunction{name}", value)) for name, value in
                        (("slope", 1), ("offset", 0)))
    if slope and (slope, intercept) != (1.0, 0.0):
        image.scale = (slope, intercept)
    if image.axis(VECTOR):
        image.turn = LPS_TO_RAS[:3, :3]
        image.notes.append("vectors are turned from LPS to RAS")
    return image


def meta_header(path):
    """The fields by their names in lower case, the files of a list, and where local data begin."""
    fields = {}
    with open(path, "rb") as file:
        while line := file.readline(1 << 16):
            key, separator, value = line.decode("utf-8", "replace").partition("=")
            if not separator:
                if not line.strip():
                    continue
                raise esvr.BadInput(f"{path}: the header has a line that is no field: {line[:60]!r}")
            fields[key.strip().lower()] = value.strip()
            if key.strip().lower() == "elementdatafile":
                break
        offset = file.tell()
        names = file.read(1 << 24).decode("utf-8", "replace").split("\n") \
            if fields.get("elementdatafile", "").upper().startswith("LIST") else []
    for name in ("ndims", "dimsize", "elementtype", "elementdatafile"):
        if name not in fields:
            raise esvr.BadInput(f"{path}: the header has no field {name}")
    return fields, [name.strip() for name in names if name.strip()], offset


def meta_fetch(path, fields, names, offset, dtype, shape):
    packed = "deflate" if fields.get("compresseddata", "False").lower() in ("true", "t", "1") else None
    if fields.get("binarydata", "True").lower() in ("false", "f", "0"):
        raise esvr.BadInput(f"{path} has its elements as text, which is not read")
    source, folder = fields["elementdatafile"], os.path.dirname(os.fspath(path))
    if source.upper() == "LOCAL":
        return Flat(path, dtype, shape, offset, packed)
    if "%" in source and len(source.split()) == 4:
        pattern, first, last, step = source.split()
        names = [pattern % i for i in range(int(first), int(last) + 1, int(step))]
    names = [os.path.join(folder, name) for name in names or [source]]
    for name in names:
        if not os.path.exists(name):
            raise esvr.BadInput(f"{path}: its file of elements {name} is missing")
    if len(names) > 1 and len(names) != shape[0]:
        raise esvr.BadInput(f"{path} names {len(names)} files for {shape[0]} slices")
    part = shape if len(names) == 1 else [1] + shape[1:]
    skip = int(fields.get("headersize", 0))
    begins = [max(os.path.getsize(name) - product(part) * dtype.itemsize, 0) if skip == -1 else skip for name in names]
    parts = [Flat(name, dtype, part, begin, packed) for name, begin in zip(names, begins)]
    return parts[0] if len(parts) == 1 else Joined(parts)


def meta_matrix(fields, count):
    def first(*keys):
        return next((fields[key].split() for key in keys if key in fields), None)
    side = min(count, 3)
    matrix = np.eye(4)
    spacing = [abs(float(n)) or 1.0 for n in first("elementspacing", "elementsize") or [1] * count]
    cosines = first("transformmatrix", "rotation", "orientation")
    if cosines:  # each row is the direction of an axis
        matrix[:side, :side] = np.array([float(n) for n in cosines]).reshape(count, count)[:side, :side].T
    origin = first("offset", "origin", "position") or [0] * count
    matrix[:side, 3] = [float(n) for n in origin[:side]]
    matrix[:3, :side] *= spacing[:side]
    fill_columns(matrix, side)
    return matrix


# -- MRC -----------------------------------------------------------------------------------------------------------
IMOD_STAMP = 1146047817  # of files of IMOD, whose flags say whether bytes are signed


def read_mrc(path, options):
    mrcfile = need("mrcfile", "python3-mrcfile", path, "MRC")
    from mrcfile.utils import data_dtype_from_header
    packed = is_gzip(path)
    with reading(path, "MRC"):
        with mrcfile.open(path, permissive=False, header_only=True) as file:
            header = file.header.copy()
        dtype = data_dtype_from_header(header)
        columns, rows, sections = int(header.nx), int(header.ny), int(header.nz)
        require_shape(path, (columns, rows, sections))
        order = [int(header.mapc), int(header.mapr), int(header.maps)]
        if order == [0, 0, 0]:
            order = [1, 2, 3]
        if sorted(order) != [1, 2, 3]:
            raise esvr.BadInput(f"{path}: its map axes are {order}, and each of 1, 2 and 3 must be there once")
        offset = 1024 + max(int(header.nsymbt), 0)
        affine, unit = mrc_matrix(header, order)
        imod, flags = (int.from_bytes(header.tobytes()[at:at + 4], "big" if dtype.byteorder == ">" else "little") for at in (152, 156))
        if dtype.itemsize == 1 and imod == IMOD_STAMP and not flags & 1:
            dtype = np.dtype("u1")
    if dtype.kind not in "iuf":
        raise esvr.BadInput(f"{path} has the mode {int(header.mode)}, complex numbers, which is not read")
    kinds = [SPACE[number - 1] for number in order]  # of columns, rows and sections
    volumes, depth = 1, sections
    if int(header.ispg) >= 401 and int(header.mz) > 0 and sections % int(header.mz) == 0:
        depth = int(header.mz)
        volumes = sections // depth
    axes = [Axis("volume", volumes)] * (volumes > 1) + [Axis(kinds[2], depth), Axis(kinds[1], rows), Axis(kinds[0], columns)]
    shape = [axis.size for axis in axes]
    fetch = Flat(path, dtype, shape, *((0, "deflate", offset) if packed else (offset,)))
    image = Image("MRC", path, axes, dtype, fetch, affine, unit)
    if order != [1, 2, 3]:
        image.notes.append(f"columns, rows and sections are the axes {', '.join(kinds)}")
    return image


def mrc_matrix(header, order):
    """The matrix of x, y, z in angstroms, of a cell that may be oblique."""
    counts = [max(int(n), 1) for n in (header.mx, header.my, header.mz)]
    lengths = [float(header.cella.x), float(header.cella.y), float(header.cella.z)]
    known = all(length > 0 for length in lengths)
    spacing = [length / n if known else 1.0 for length, n in zip(lengths, counts)]
    angles = [float(a) for a in (header.cellb.alpha, header.cellb.beta, header.cellb.gamma)]
    matrix = np.eye(4)
    matrix[:3, :3] = cell_axes(angles) * spacing
    starts = dict(zip(order, (int(header.nxstart), int(header.nystart), int(header.nzstart))))
    origin = np.array([float(header.origin.x), float(header.origin.y), float(header.origin.z)])
    if not np.any(origin):
        origin = matrix[:3, :3] @ [starts[1], starts[2], starts[3]]
    matrix[:3, 3] = origin
    return matrix, "angstrom" if known else None


def cell_axes(angles):
    """The directions of a, b and c, of which a is along x, and b in the plane of x and y."""
    if not all(0 < angle < 180 for angle in angles) or all(abs(angle - 90) < 1e-4 for angle in angles):
        return np.eye(3)
    ca, cb, cc = (math.cos(math.radians(angle)) for angle in angles)
    sc = math.sin(math.radians(angles[2]))
    y = (ca - cb * cc) / sc
    return np.array([[1, cc, cb], [0, sc, y], [0, 0, math.sqrt(max(1 - cb * cb - y * y, 0))]])


# -- VTI -----------------------------------------------------------------------------------------------------------
def read_vti(path, options):
    with open(path, "rb") as file:
        head = file.read(1 << 16)
    file_type = re.search(rb'<VTKFile[^>]*\btype\s*=\s*["\'](\w+)', head)
    if file_type and file_type[1] != b"ImageData":
        raise esvr.BadInput(f"{path} is a VTK file of type {file_type[1].decode()}, which is not read; ImageData (.vti) is")
    need("vtkmodules.vtkIOXML", "python3-vtk9", path, "VTI")
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringOutputWindow
    from vtkmodules.vtkIOXML import vtkXMLImageDataReader
    messages = vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(messages)

    def refuse_errors(what):
        text = " ".join(messages.GetOutput().split())
        if reader.GetErrorCode() or "ERROR" in text:
            text = re.sub(r"^.*?\): ", "", text)[:300]
            raise esvr.BadInput(f"{path} cannot be read as VTI: {what}: {text or 'error ' + str(reader.GetErrorCode())}")

    reader = vtkXMLImageDataReader()
    reader.SetFileName(os.fspath(path))
    reader.UpdateInformation()
    refuse_errors("its header is damaged")
    with reading(path, "VTI"):
        is_cells, name = choose_array(path, reader, options.dataset)
        information = reader.GetOutputInformation(0)
        from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as pipeline
        extent = information.Get(pipeline.WHOLE_EXTENT())
        points = [extent[2 * a + 1] - extent[2 * a] + 1 for a in range(3)]
        require_shape(path, points)
        size = [max(n - 1, 1) for n in points] if is_cells else points
        most = 10000 if b"LZMA" in head else MOST_DEFLATED if b"compressor" in head else 1
        require_bytes(path, product(size) / most, os.path.getsize(path), f"an array of {' x '.join(map(str, size))} voxels")
    if product(size) * 4 > options.max_memory:
        raise esvr.MemoryExceeded(f"{path}: VTK reads an array of {' x '.join(map(str, size))} voxels as a whole, which asks for "
                                  f"more than {options.max_memory} bytes of memory")
    reader.Update()
    refuse_errors("its data are damaged")
    with reading(path, "VTI"):
        data = reader.GetOutput()
        group = data.GetCellData() if is_cells else data.GetPointData()
        array = group.GetAbstractArray(name)
        if array is None or array.GetNumberOfTuples() != product(size):
            raise esvr.BadInput(f"{path}: the array '{name}' has {array.GetNumberOfTuples() if array else 0} values for "
                                f"{product(size)} {'cells' if is_cells else 'points'}")
        numbers = vtk_to_numpy(array).copy()
        components = array.GetNumberOfComponents()
        labels = [array.GetComponentName(c) or "" for c in range(components)]
        matrix = data.GetDirectionMatrix()
        directions = np.array([[matrix.GetElement(r, c) for c in range(3)] for r in range(3)])
        affine = affine_of(data.GetSpacing(), data.GetOrigin(), directions)
        first = [extent[0], extent[2], extent[4]]
        shift = [(0.5 if n > 1 else 0.0) if is_cells else 0.0 for n in points]
        affine[:3, 3] = (affine @ [*np.add(first, shift), 1.0])[:3]
    axes = [Axis("z", size[2]), Axis("y", size[1]), Axis("x", size[0])]
    numbers = numbers.reshape(size[2], size[1], size[0], *([components] if components > 1 else []))
    if components > 1:
        is_vector = components == 3 and numbers.dtype.kind == "f"
        axes.append(Axis(VECTOR if is_vector else CHANNEL, components, "components", labels if any(labels) else []))
    image = Image("VTI", path, axes, numbers.dtype, Loaded(numbers), affine)
    unit = data.GetFieldData().GetAbstractArray("length_unit")  # vdb2image writes it
    if unit is not None and unit.GetNumberOfValues():
        image.unit = unit_named(unit.GetValue(0))
    return image


def choose_array(path, reader, dataset):
    """Whether the array is of cells, and its name. All other arrays are switched off."""
    selections = [(False, reader.GetPointDataArraySelection()), (True, reader.GetCellDataArraySelection())]
    arrays = [(is_cells, selection.GetArrayName(i)) for is_cells, selection in selections
              for i in range(selection.GetNumberOfArrays())]
    shown = ", ".join(f"{name} ({'cells' if is_cells else 'points'})" for is_cells, name in arrays)
    if not arrays:
        raise esvr.BadInput(f"{path} has no array")
    wanted = [array for array in arrays if array[1] == dataset] if dataset else arrays
    if dataset and not wanted:
        raise esvr.UsageError(f"{path} has no array '{dataset}'; there are: {shown}")
    if len(wanted) > 1:
        active = None if dataset else active_array(path)
        wanted = [array for array in arrays if array[1] == active] or wanted
    if len(wanted) > 1:
        raise esvr.UsageError(f"{path} has several arrays: {shown}; name one by --dataset")
    for is_cells, selection in selections:
        selection.DisableAllArrays()
        if is_cells == wanted[0][0]:
            selection.EnableArray(wanted[0][1])
    return wanted[0]


def active_array(path):
    """The array that the file names as that of scalars."""
    with open(path, "rb") as file:
        names = re.findall(rb'<(?:PointData|CellData)[^>]*\bScalars\s*=\s*["\']([^"\']+)', file.read(1 << 20))
    return names[0].decode("utf-8", "replace") if len(set(names)) == 1 else None
