"""Readers of NIfTI, Analyze, NRRD, MetaImage, MRC, VTI, NumPy's and raw files."""
import functools
import math
import os
import re

import numpy as np

import esvr

from .image import (CHANNEL, LPS_TO_RAS, MOST_DEFLATED, SPACE, TIME, VECTOR, Axis, Image, affine_of, axes_from_letters, by, factor,
                    head_of, in_memory, mapped, need, planes, product, reading, require_bytes, require_shape, unit_named, unpacked,
                    whole_or_packed)

LPS, RAS = "left-posterior-superior", "right-anterior-superior"


# -- numbers without a description -----------------------------------------------------------------------------------
RAW_TYPES = ["uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64", "float16", "float32", "float64"]


def read_raw(path, options):
    if not options.dims or not options.type:
        raise esvr.UsageError(f"{path} has no header that is known; if it is a RAW image, give --dims X,Y,Z and --type")
    if options.type not in RAW_TYPES:
        raise esvr.UsageError(f"--type is one of {', '.join(RAW_TYPES)}, not '{options.type}'")
    dtype, shape = np.dtype(options.type).newbyteorder(">" if options.endian == "big" else "<"), options.dims[::-1]
    needed, there = product(shape) * dtype.itemsize + options.skip, os.path.getsize(path)
    if needed != there:
        raise esvr.BadInput(f"{path} has {there} bytes, and --dims, --type and --skip need {needed}")
    return Image("RAW", path, axes_from_letters("zyx", shape, path), dtype, mapped(path, dtype, shape, options.skip), np.eye(4))


def read_npy(path, options):
    with reading(path, "NPY"):
        array = np.load(path, mmap_mode="r", allow_pickle=False)
    axes, shape = unnamed_axes(path, array.shape, options), array.shape
    if array.flags.f_contiguous and not array.flags.c_contiguous:
        axes, shape = axes[::-1], shape[::-1]
    return Image("NPY", path, axes, array.dtype, mapped(path, array.dtype, shape, array.offset), np.eye(4))


def unnamed_axes(path, shape, options):
    """The axes of a file that does not name them: z, y, x, or those of --axes."""
    require_shape(path, shape)
    if options.axes or len(shape) in (2, 3):
        return axes_from_letters(options.axes or "zyx"[-len(shape):], shape, path)
    raise esvr.UsageError(f"{path} has {len(shape)} axes ({' x '.join(map(str, shape))}) and does not name them; name them, the "
                          "slowest first, by --axes, as in --axes ctzyx")


# -- NIfTI and Analyze ---------------------------------------------------------------------------------------------
NIFTI_UNITS = {0: "mm", 1: "m", 2: "mm", 3: "um"}
VECTOR_INTENTS = {1006, 1007}  # displacements, vectors


def read_nifti(path, options):
    need("nibabel", "python3-nibabel", path, "NIfTI")
    from nibabel import AnalyzeHeader, Nifti1Header, Nifti2Header
    from nibabel.filename_parser import types_filenames
    header_path = data_path = os.fspath(path)
    if header_path.lower().removesuffix(".gz").endswith((".hdr", ".img")):
        names = types_filenames(header_path, (("image", ".img"), ("header", ".hdr")), trailing_suffixes=(".gz",))
        header_path, data_path = names["header"], names["image"]
    with reading(header_path, "NIfTI"):
        head = head_of(header_path, 540)
        magic = {head[344:348], head[4:8]}
        kind = Nifti1Header if magic & {b"n+1\0", b"ni1\0"} else Nifti2Header if magic & {b"n+2\0", b"ni2\0"} else AnalyzeHeader
        header = kind(head[:kind.template_dtype.itemsize], check=True)
    if magic & {b"n+1\0", b"n+2\0"}:
        data_path = header_path
    if not os.path.exists(data_path):
        raise esvr.BadInput(f"{path} has its voxels in another file, {data_path}, which is missing")
    with reading(path, "NIfTI"):
        shape, dtype = header.get_data_shape(), header.get_data_dtype()
        axes = [Axis(name, n) for name, n in zip(["x", "y", "z", TIME, CHANNEL, "dim6", "dim7"], shape)][::-1]
        if len(shape) > 4 and shape[4] == 3 and kind is not AnalyzeHeader and int(header["intent_code"]) in VECTOR_INTENTS:
            axes[-5].kind = VECTOR
        if dtype.names:  # colors
            axes.append(Axis("sample", len(dtype.names), labels=list(dtype.names)))
            dtype = dtype[0]
        matrix, unit, form = nifti_space(header)
        slope, intercept = header.get_slope_inter() if kind is not AnalyzeHeader else (None, None)
        fetch = whole_or_packed(data_path, dtype, [axis.size for axis in axes], int(header.get_data_offset()))
    return Image("NIfTI" if kind is not AnalyzeHeader else "Analyze", path, axes, dtype, fetch, matrix, unit,
                 None if slope is None else (float(slope), float(intercept)), notes=[form], metadata={"image_space": RAS})


def nifti_space(header):
    """The matrix, its unit and a text that says which form of the header it is of."""
    zooms = [abs(float(zoom)) or 1.0 for zoom in header["pixdim"][1:4]]
    if "sform_code" not in header.keys():
        return affine_of(zooms), "mm", "Analyze has no orientation: the spacings alone"
    code = int(header["xyzt_units"]) & 7
    if code not in NIFTI_UNITS:
        raise ValueError(f"its unit of lengths has the code {code}, which NIfTI does not define")
    said = "" if code else "; its lengths have no unit, and are taken as mm"
    if int(header["sform_code"]) > 0:
        return header.get_sform(), NIFTI_UNITS[code], f"the sform gives the transform{said}"
    if int(header["qform_code"]) > 0:
        return header.get_qform(), NIFTI_UNITS[code], f"the qform gives the transform{said}"
    return affine_of(zooms), NIFTI_UNITS[code], f"there is no qform and no sform: the spacings alone give the transform{said}"


# -- files of a detached header ------------------------------------------------------------------------------------
def parts_of_files(path, names, leading, shape, open_part):
    """An array whose leading axes are in files one after the other, each of which has as many planes of this shape.
    open_part(name, shape) gives the array of a file."""
    count = product(leading)
    for name in names:
        if not os.path.exists(name):
            raise esvr.BadInput(f"{path}: its file of data {name} is missing")
    if not names or count % len(names):
        raise esvr.BadInput(f"{path} names {len(names)} files of data for {count} slices")
    if len(names) == 1:
        return open_part(names[0], [*leading, *shape])
    each = count // len(names)
    part = functools.lru_cache(1)(lambda k: open_part(names[k], [each, *shape]))
    part(0)
    return planes(leading, lambda k, index: part(k // each)((k % each, *index)))


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
SPACES = {"ras": (1, 1, 1), RAS: (1, 1, 1), "las": (-1, 1, 1), "left-anterior-superior": (-1, 1, 1), "lps": (-1, -1, 1),
          LPS: (-1, -1, 1)}
NRRD_PLAIN = {"data file": "datafile", "byte skip": "byteskip", "line skip": "lineskip", "centerings": "centers"}


def nrrd_header(path):
    """The fields by their names in lower case, the key/value pairs, and where the data begin."""
    fields, pairs = {}, {}
    with open(path, "rb") as file:
        first = file.readline(100).rstrip()
        if not re.fullmatch(rb"NRRD000[1-5]", first):
            raise esvr.BadInput(f"{path} is no NRRD file of a version from 1 to 5: it begins with {first[:20]!r}")
        while text := file.readline(1 << 20).decode("utf-8", "replace").rstrip("\r\n"):
            key, separator, value = text.partition(":")
            if text.startswith("#"):
                continue
            if not separator:
                raise esvr.BadInput(f"{path}: the header has a line that is no field: {text[:60]!r}")
            if value.startswith("="):
                pairs[key] = value[1:]
                continue
            key = NRRD_PLAIN.get(key.strip().lower(), key.strip().lower())
            fields[key] = value.strip()
            if key == "datafile" and value.strip().upper().startswith("LIST"):
                fields["files"] = [line.strip() for line in file.read().decode("utf-8", "replace").splitlines() if line.strip()]
                break
        for name in ("type", "dimension", "sizes", "encoding"):
            if name not in fields:
                raise esvr.BadInput(f"{path}: the header has no field '{name}'")
        return fields, pairs, file.tell()


def nrrd_vectors(text):
    """The vectors of a field; None for "none"."""
    found = re.findall(r"\(([^)]*)\)|(none)", text)
    return [None if none else np.array([float(n) for n in numbers.split(",")])[:3] for numbers, none in found]


def nrrd_list(fields, name, count, default=""):
    """A value for each axis; names in quotes may have spaces."""
    values = [quoted or plain for quoted, plain in re.findall(r'"([^"]*)"|(\S+)', fields.get(name, ""))]
    return values + [default] * (count - len(values))


def nrrd_fetch(path, fields, offset, dtype, shape):
    """The function for Image.fetch; shape has the slowest axis first."""
    if "datafile" not in fields:
        return nrrd_part(path, fields, offset, dtype, shape)
    words, axes = fields["datafile"].split(), len(shape)
    names = [fields["datafile"]]
    if words[0].upper() == "LIST":
        names, axes = fields["files"], int(words[1]) if len(words) > 1 else axes - 1
    elif "%" in fields["datafile"] and len(words) >= 4:
        numbers = [int(word) for word in words[(-3 if len(words) == 4 else -4):]]
        pattern, (first, last, step) = " ".join(words[:-len(numbers)]), numbers[:3]
        names, axes = [pattern % k for k in range(first, last + (1 if step > 0 else -1), step)], (numbers + [axes - 1])[3]
    leading = max(len(shape) - axes, 1)  # so many axes are those of files
    return parts_of_files(path, [os.path.join(os.path.dirname(path), name) for name in names], shape[:leading], shape[leading:],
                          lambda name, part: nrrd_part(name, fields, 0, dtype, part))


def nrrd_part(path, fields, offset, dtype, shape):
    """The numbers of a file from a place on."""
    encoding, skip = fields["encoding"].lower(), int(fields.get("byteskip", 0))
    with open(path, "rb") as file:
        file.seek(offset)
        for _ in range(int(fields.get("lineskip", 0))):
            file.readline()
        begin = file.tell()
        if encoding in ("ascii", "text", "txt", "hex"):
            return in_memory(nrrd_text(path, file.read()[skip:], encoding, dtype, shape))
    if encoding == "raw":  # a skip of -1: the numbers are the last ones of the file
        at_end = os.path.getsize(path) - product(shape) * dtype.itemsize
        return mapped(path, dtype, shape, max(at_end, begin) if skip == -1 else begin + skip)
    if encoding in ("gz", "gzip", "bz2", "bzip2") and skip >= 0:
        return unpacked(path, dtype, shape, begin, skip, "deflate" if encoding[0] == "g" else "bzip2")
    raise esvr.BadInput(f"{path} has the encoding '{encoding}' with a byte skip of {skip}, which is not read; raw, gzip, bzip2, ascii "
                        "and hex are")


def nrrd_text(path, text, encoding, dtype, shape):
    count = product(shape)
    require_bytes(path, 2 * count * dtype.itemsize if encoding == "hex" else 2 * count - 1, len(text), "the data as text")
    if encoding == "hex":
        return np.frombuffer(bytes.fromhex("".join(text.decode("ascii").split())), dtype)[:count].reshape(shape)
    words = text.decode("ascii").replace(",", " ").split()[:count]
    return np.array([float(word) if dtype.kind == "f" else int(word) for word in words], dtype).reshape(shape)


def read_nrrd(path, options):
    path = os.fspath(path)
    with reading(path, "NRRD"):
        fields, pairs, offset = nrrd_header(path)
        if fields["type"].lower() not in NRRD_TYPES:
            raise esvr.BadInput(f"{path} has values of type '{fields['type']}', which is not read")
        shape, dtype = [int(n) for n in fields["sizes"].split()][::-1], NRRD_TYPES[fields["type"].lower()]
        if len(shape) != int(fields["dimension"]):
            raise esvr.BadInput(f"{path} has {len(shape)} sizes for {fields['dimension']} axes")
        require_shape(path, shape)
        if dtype.itemsize > 1 and fields["encoding"].lower() not in ("ascii", "text", "txt"):
            if fields.get("endian") not in ("little", "big"):
                raise esvr.BadInput(f"{path}: the header does not say whether its numbers are little or big endian")
            dtype = dtype.newbyteorder("<" if fields["endian"] == "little" else ">")
        image = nrrd_image(path, fields, shape[::-1], options)
        image.dtype, image.fetch = dtype, nrrd_fetch(path, fields, offset, dtype, shape)
    if fields.get("sample units"):
        image.metadata["value_unit"] = fields["sample units"].strip('"')
    segments = sorted({int(key[7:-5]) for key in pairs if re.fullmatch(r"Segment\d+_Name", key)})
    if segments:
        image.metadata["image_segments"] = "; ".join(
            f"{pairs.get(f'Segment{k}_LabelValue', '?')}: {pairs[f'Segment{k}_Name']}" for k in segments)
    return image


def nrrd_image(path, fields, shape, options):
    """The image without its numbers; shape has the fastest axis first, as the header."""
    count = len(shape)
    kinds, labels = [kind.lower() for kind in nrrd_list(fields, "kinds", count)], nrrd_list(fields, "labels", count)
    directions = nrrd_vectors(fields.get("space directions", ""))
    if directions and len(directions) != count:
        raise esvr.BadInput(f"{path} has {len(directions)} space directions for {count} axes")
    names = [VECTOR if kind in VECTOR_KINDS and n == 3 else TIME if kind == "time" else CHANNEL for kind, n in zip(kinds, shape)]
    spatial = [k for k in range(count) if (directions[k] is not None and np.any(directions[k]) if directions else
                                           kinds[k] in DOMAIN_KINDS)]
    if options.axes:
        names = [axis.kind for axis in axes_from_letters(options.axes, shape[::-1], path)][::-1]
        spatial = [names.index(kind) for kind in SPACE if kind in names]
    if len(spatial) > 3:
        raise esvr.UsageError(f"{path} has {count} axes ({' x '.join(map(str, shape))}, the fastest first), of which {len(spatial)} may "
                              f"be of space; name them, the slowest first, by --axes, as in --axes {'ctzyx'[-count:]}")
    for kind, k in zip(SPACE, spatial):
        names[k] = kind
    space = fields.get("space", "").strip('"').lower().removesuffix("-time").removesuffix("t")
    sign = np.diag([*SPACES.get(space, (1, 1, 1)), 1.0])
    matrix, unit = (nrrd_directed if directions else nrrd_spaced)(fields, shape, spatial, directions)
    image = Image("NRRD", path, [Axis(kind, n, labels[k] or kinds[k]) for k, (kind, n) in enumerate(zip(names, shape))][::-1], "u1",
                  None, sign @ matrix, unit or ("mm" if directions and space in SPACES else None))
    if space in SPACES:
        image.metadata["image_space"] = LPS if SPACES[space] == (-1, -1, 1) else RAS
    if VECTOR in names:
        frame = np.column_stack(nrrd_vectors(fields["measurement frame"])) if "measurement frame" in fields else np.eye(3)
        image.turn = sign[:3, :3] @ (frame if frame.shape == (3, 3) else np.eye(3))
        image.notes.append("vectors are turned as the space and the measurement frame say")
    return image


def nrrd_directed(fields, shape, spatial, directions):
    """The matrix of space directions and its unit (None if the file does not say)."""
    matrix = np.eye(4)
    for column, k in enumerate(spatial):
        matrix[:len(directions[k]), column] = directions[k]
    fill_columns(matrix, len(spatial))
    origin = nrrd_vectors(fields["space origin"])[0] if "space origin" in fields else np.zeros(3)
    matrix[:len(origin), 3] = np.where(np.isfinite(origin), origin, 0.0)
    found = {unit_named(unit) for unit in nrrd_list(fields, "space units", 3)[:3] if unit}
    return matrix, found.pop() if len(found) == 1 else None


def nrrd_spaced(fields, shape, spatial, directions):
    """The matrix of spacings, or of axis mins and maxs, and its unit (None if the file does not say)."""
    matrix, count = np.eye(4), len(shape)
    spacings, lows, highs = ([float(n) for n in nrrd_list(fields, name, count, "nan")] for name in
                             ("spacings", "axis mins", "axis maxs"))
    centers, units = nrrd_list(fields, "centers", count), nrrd_list(fields, "units", count)
    found = [unit_named(units[k]) for k in spatial]
    unit = found[0] if found and None not in found else None
    for column, k in enumerate(spatial):
        is_node, spacing, low, high = centers[k] == "node", spacings[k], lows[k], highs[k]
        if not math.isfinite(spacing) and math.isfinite(high - low):
            spacing = (high - low) / max(shape[k] - is_node, 1)
        spacing = spacing if math.isfinite(spacing) and spacing else 1.0
        low = low if math.isfinite(low) else high - spacing * (shape[k] - is_node)
        scale = factor(found[column], unit) if unit else 1.0
        matrix[column, column] = spacing * scale
        if math.isfinite(low):
            matrix[column, 3] = (low + (0.0 if is_node else spacing / 2)) * scale
    return matrix, unit


def fill_columns(matrix, known):
    """Gives the axes that a file does not have directions of length 1 that are perpendicular to the others."""
    for column in range(known, 3):
        other = matrix[:3, 1] if column == 2 else np.eye(3)[np.argmin(np.abs(matrix[:3, 0]))]
        normal = np.cross(matrix[:3, 0], other)
        length = np.linalg.norm(normal)
        matrix[:3, column] = normal / length if length and column else np.eye(3)[column]


# -- MetaImage -----------------------------------------------------------------------------------------------------
META_TYPES = {"CHAR": "i1", "UCHAR": "u1", "SHORT": "i2", "USHORT": "u2", "INT": "i4", "UINT": "u4", "LONG": "i4", "ULONG": "u4",
              "LONG_LONG": "i8", "ULONG_LONG": "u8", "FLOAT": "f4", "DOUBLE": "f8"}


def meta_header(path):
    """The fields by their names in lower case, with "files" for those of a list, and where local data begin."""
    fields = {}
    with open(path, "rb") as file:
        while "elementdatafile" not in fields and (line := file.readline(1 << 16)):
            key, separator, value = line.decode("utf-8", "replace").partition("=")
            if separator:
                fields[key.strip().lower()] = value.strip()
            elif line.strip():
                raise esvr.BadInput(f"{path}: the header has a line that is no field: {line[:60]!r}")
        for name in ("ndims", "dimsize", "elementtype", "elementdatafile"):
            if name not in fields:
                raise esvr.BadInput(f"{path}: the header has no field {name}")
        offset = file.tell()
        if fields["elementdatafile"].upper().startswith("LIST"):
            fields["files"] = [line.strip() for line in file.read().decode("utf-8", "replace").splitlines() if line.strip()]
    return fields, offset


def read_metaimage(path, options):
    path = os.fspath(path)
    with reading(path, "MetaImage"):
        fields, offset = meta_header(path)
        count, channels = int(fields["ndims"]), int(fields.get("elementnumberofchannels", 1))
        shape, kind = [int(n) for n in fields["dimsize"].split()], fields["elementtype"].upper().removeprefix("MET_")
        for name, expected, is_read in (
                ("objecttype", "an image", fields.get("objecttype", "Image").lower() == "image"),
                ("elementtype", "a type of numbers", kind in META_TYPES),
                ("binarydata", "numbers that are no text", fields.get("binarydata", "True").lower() in ("true", "t", "1")),
                ("dimsize", "two to four axes", len(shape) == count and 2 <= count <= 4)):
            if not is_read:
                raise esvr.BadInput(f"{path} has {name} = {fields[name]}, which is not read; {expected} is needed")
        is_big = (fields.get("elementbyteordermsb") or fields.get("binarydatabyteordermsb", "False")).lower() in ("true", "t", "1")
        dtype = np.dtype(META_TYPES[kind]).newbyteorder(">" if is_big else "<")
        axes = [Axis(name, n) for name, n in zip(["x", "y", "z", TIME], shape)][::-1]
        if channels > 1:
            axes.append(Axis(VECTOR if channels == 3 and dtype.kind == "f" else CHANNEL, channels))
        fetch = meta_fetch(path, fields, offset, dtype, [axis.size for axis in axes])
        scale = tuple(float(fields.get(f"elementtointensityfunction{name}", n)) for name, n in (("slope", 1), ("offset", 0)))
        image = Image("MetaImage", path, axes, dtype, fetch, LPS_TO_RAS @ meta_matrix(fields, count), "mm",
                      scale if scale[0] else None, metadata={"image_space": LPS})
    if image.axis(VECTOR):
        image.turn = LPS_TO_RAS[:3, :3]
        image.notes.append("vectors are turned from LPS to RAS")
    return image


def meta_fetch(path, fields, offset, dtype, shape):
    source, skip = fields["elementdatafile"], int(fields.get("headersize", 0))
    is_packed = fields.get("compresseddata", "False").lower() in ("true", "t", "1")
    if source.upper() == "LOCAL":
        return (unpacked if is_packed else mapped)(path, dtype, shape, offset)
    names, words = fields.get("files", [source]), source.split()
    if "%" in source and len(words) == 4:
        names = [words[0] % k for k in range(int(words[1]), int(words[2]) + 1, int(words[3]))]

    def open_part(name, part):  # a size of -1: the numbers are the last ones of the file
        begin = max(os.path.getsize(name) - product(part) * dtype.itemsize, 0) if skip == -1 else skip
        return (unpacked if is_packed else mapped)(name, dtype, part, begin)
    return parts_of_files(path, [os.path.join(os.path.dirname(path), name) for name in names], shape[:1], shape[1:], open_part)


def meta_matrix(fields, count):
    def numbers(*keys, default):
        return [float(n) for n in next((fields[key].split() for key in keys if key in fields), default)]
    side, matrix = min(count, 3), np.eye(4)
    # Each row of the field is the direction of an axis.
    rows = np.reshape(numbers("transformmatrix", "rotation", "orientation", default=np.eye(count).ravel()), (count, count))
    spacing = [abs(n) or 1.0 for n in numbers("elementspacing", "elementsize", default=[1] * count)]
    matrix[:side, :side] = rows[:side, :side].T * spacing[:side]
    matrix[:side, 3] = numbers("offset", "origin", "position", default=[0] * count)[:side]
    fill_columns(matrix, side)
    return matrix


# -- MRC -----------------------------------------------------------------------------------------------------------
IMOD_STAMP = 1146047817  # of files of IMOD, whose flags say whether bytes are signed


def read_mrc(path, options):
    mrcfile = need("mrcfile", "python3-mrcfile", path, "MRC")
    from mrcfile.utils import data_dtype_from_header
    with reading(path, "MRC"):
        with mrcfile.open(path, permissive=False, header_only=True) as file:
            header = file.header.copy()
        dtype = data_dtype_from_header(header)
        order = [int(header.mapc), int(header.mapr), int(header.maps)]
        order = order if any(order) else [1, 2, 3]
        if sorted(order) != [1, 2, 3]:
            raise esvr.BadInput(f"{path}: its map axes are {order}, and each of 1, 2 and 3 must be there once")
        imod, flags = header.tobytes()[152:156], header.tobytes()[156:160]
        little = "big" if dtype.byteorder == ">" else "little"
        if dtype.itemsize == 1 and int.from_bytes(imod, little) == IMOD_STAMP and not int.from_bytes(flags, little) & 1:
            dtype = np.dtype("u1")
        x, y, z = (Axis(SPACE[number - 1], int(n)) for number, n in zip(order, (header.nx, header.ny, header.nz)))
        axes, depth = [z, y, x], int(header.mz)
        if int(header.ispg) >= 401 and 0 < depth < z.size and z.size % depth == 0:  # a stack of volumes
            axes, z.size = [Axis("volume", z.size // depth), *axes], depth
        affine, unit = mrc_matrix(header, order)
        fetch = whole_or_packed(path, dtype, [axis.size for axis in axes], 1024 + max(int(header.nsymbt), 0))
    image = Image("MRC", path, axes, dtype, fetch, affine, unit)
    if order != [1, 2, 3]:
        image.notes.append(f"columns, rows and sections are the axes {', '.join(axis.kind for axis in (x, y, z))}")
    return image


def mrc_matrix(header, order):
    """The matrix of x, y, z in angstroms, of a cell that may be oblique."""
    counts = [max(int(n), 1) for n in (header.mx, header.my, header.mz)]
    lengths = [float(header.cella[axis]) for axis in SPACE]
    is_known = all(length > 0 for length in lengths)
    matrix = np.eye(4)
    matrix[:3, :3] = cell_axes([float(header.cellb[name]) for name in ("alpha", "beta", "gamma")])
    if is_known:
        matrix[:3, :3] *= np.divide(lengths, counts)
    starts = dict(zip(order, (int(header.nxstart), int(header.nystart), int(header.nzstart))))
    origin = [float(header.origin[axis]) for axis in SPACE]
    matrix[:3, 3] = origin if any(origin) else matrix[:3, :3] @ [starts[1], starts[2], starts[3]]
    return matrix, "angstrom" if is_known else None


def cell_axes(angles):
    """The directions of a, b and c, of which a is along x, and b in the plane of x and y."""
    if not all(0 < angle < 180 for angle in angles) or all(abs(angle - 90) < 1e-4 for angle in angles):
        return np.eye(3)
    ca, cb, cc = np.cos(np.radians(angles))
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
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
    from vtkmodules.vtkIOXML import vtkXMLImageDataReader
    messages, reader = vtkStringOutputWindow(), vtkXMLImageDataReader()
    vtkOutputWindow.SetInstance(messages)

    def refuse_errors(what):
        text = " ".join(messages.GetOutput().split())
        if reader.GetErrorCode() or "ERROR" in text:
            text = re.sub(r"^.*?\): ", "", text)[:300]
            raise esvr.BadInput(f"{path} cannot be read as VTI: {what}: {text or 'error ' + str(reader.GetErrorCode())}")
    with reading(path, "VTI"):
        reader.SetFileName(os.fspath(path))
        reader.UpdateInformation()
        refuse_errors("its header is damaged")
        is_cells, name = vti_array(path, head, reader, options.dataset)
        extent = np.reshape(reader.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.WHOLE_EXTENT()), (3, 2))
        points = [int(n) for n in extent[:, 1] - extent[:, 0] + 1]
        require_shape(path, points)
        size = [max(n - 1, 1) for n in points] if is_cells else points
        most = 10000 if b"LZMA" in head else MOST_DEFLATED if b"compressor" in head else 1
        require_bytes(path, product(size) / most, os.path.getsize(path), f"an array of {by(size[::-1])} voxels")
        if product(size) * 4 > options.max_memory:
            raise esvr.MemoryExceeded(f"{path}: VTK reads an array of {by(size[::-1])} voxels as a whole, which asks for more than "
                                      f"{options.max_memory} bytes of memory")
        reader.Update()
        refuse_errors("its data are damaged")
        data = reader.GetOutput()
        array = (data.GetCellData() if is_cells else data.GetPointData()).GetAbstractArray(name)
        count = array.GetNumberOfTuples() if array else 0
        if count != product(size):
            raise esvr.BadInput(f"{path}: the array '{name}' has {count} values for {product(size)} "
                                f"{'cells' if is_cells else 'points'}")
        numbers, components = vtk_to_numpy(array).copy(), array.GetNumberOfComponents()
        directions = np.array([[data.GetDirectionMatrix().GetElement(r, c) for c in range(3)] for r in range(3)])
        affine = affine_of(data.GetSpacing(), data.GetOrigin(), directions)
        first = extent[:, 0] + [0.5 if is_cells and n > 1 else 0.0 for n in points]
        affine[:3, 3] = (affine @ [*first, 1.0])[:3]
    axes = axes_from_letters("zyx", size[::-1], path)
    if components > 1:
        labels = [array.GetComponentName(c) or "" for c in range(components)]
        axes.append(Axis(VECTOR if components == 3 and numbers.dtype.kind == "f" else CHANNEL, components, "components",
                         labels if any(labels) else []))
    unit = data.GetFieldData().GetAbstractArray("length_unit")  # vdb2image writes it
    return Image("VTI", path, axes, numbers.dtype, in_memory(numbers.reshape([axis.size for axis in axes])), affine,
                 unit_named(unit.GetValue(0)) if unit is not None and unit.GetNumberOfValues() else None)


def vti_array(path, head, reader, dataset):
    """Whether the array is of cells, and its name. All other arrays are switched off."""
    selections = {False: reader.GetPointDataArraySelection(), True: reader.GetCellDataArraySelection()}
    arrays = [(is_cells, selection.GetArrayName(k)) for is_cells, selection in selections.items()
              for k in range(selection.GetNumberOfArrays())]
    shown = ", ".join(f"{name} ({'cells' if is_cells else 'points'})" for is_cells, name in arrays) or "none"
    active = set(re.findall(rb'<(?:PointData|CellData)[^>]*\bScalars\s*=\s*["\']([^"\']+)', head))
    wanted = [array for array in arrays if array[1] == dataset] if dataset else arrays
    if len(wanted) > 1 and not dataset and len(active) == 1:
        wanted = [array for array in arrays if array[1].encode() in active] or wanted
    if not arrays:
        raise esvr.BadInput(f"{path} has no array")
    if len(wanted) != 1:
        raise esvr.UsageError(f"{path} has {'several arrays' if wanted else 'no array of this name'}: {shown}; name one by --dataset")
    for is_cells, selection in selections.items():
        selection.DisableAllArrays()
        if is_cells == wanted[0][0]:
            selection.EnableArray(wanted[0][1])
    return wanted[0]
