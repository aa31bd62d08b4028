"""Readers of NIfTI, Analyze, MRC, VTI, NumPy's and raw files."""
# mypy: disable-error-code=import
import math
import os
import re

import numpy as np

import esvr

from .image import (CHANNEL, MOST_DEFLATED, RAS, SPACE, TIME, VECTOR, Axis, Image, affine_of, axes_from_letters, by, head_of, in_memory,
                    is_gzip, mapped, need, product, require_bytes, require_shape, unit_named, whole_or_packed)


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
    from nibabel import Nifti1Header, Nifti2Header
    from nibabel.filename_parser import types_filenames
    from nibabel.spm2analyze import Spm2AnalyzeHeader
    header_path = data_path = path
    if path.lower().removesuffix(".gz").endswith((".hdr", ".img")):
        names = types_filenames(path, (("image", ".img"), ("header", ".hdr")), trailing_suffixes=(".gz",))
        header_path, data_path = names["header"], names["image"]
    head = head_of(header_path, 540)
    magic = {head[344:348], head[4:8]}
    kind = Nifti1Header if magic & {b"n+1\0", b"ni1\0"} else Nifti2Header if magic & {b"n+2\0", b"ni2\0"} else Spm2AnalyzeHeader
    header = kind(head[:kind.template_dtype.itemsize], check=True)
    if magic & {b"n+1\0", b"n+2\0"}:
        data_path = header_path
    if not os.path.exists(data_path):
        raise esvr.BadInput(f"{path} has its voxels in another file, {data_path}, which is missing")
    shape, dtype, is_nifti = header.get_data_shape(), header.get_data_dtype(), kind is not Spm2AnalyzeHeader
    axes = [Axis(name, n) for name, n in zip(["x", "y", "z", TIME, CHANNEL, "dim6", "dim7"], shape)][::-1]
    if len(shape) > 4 and shape[4] == 3 and is_nifti and int(header["intent_code"]) in VECTOR_INTENTS:
        axes[-5].kind = VECTOR
    if dtype.names:  # colors
        axes.append(Axis("sample", len(dtype.names), labels=list(dtype.names)))
        dtype = dtype[0]
    matrix, unit, form = nifti_space(header)
    slope, intercept = header.get_slope_inter()  # Analyze has those of SPM
    fetch = whole_or_packed(data_path, dtype, [axis.size for axis in axes], int(header.get_data_offset()))
    return Image("NIfTI" if is_nifti else "Analyze", path, axes, dtype, fetch, matrix, unit,
                 None if slope is None else (float(slope), float(intercept or 0)), notes=[form], metadata={"image_space": RAS})


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


# -- MRC -----------------------------------------------------------------------------------------------------------
IMOD_STAMP = 1146047817  # of files of IMOD, whose flags say whether bytes are signed


def read_mrc(path, options):
    mrcfile = need("mrcfile", "python3-mrcfile", path, "MRC")
    from mrcfile.utils import data_dtype_from_header
    extended = min(int.from_bytes(head_of(path, 96)[92:], order) for order in ("little", "big"))  # mrcfile takes memory for it at once
    if not is_gzip(path):
        require_bytes(path, 1024 + extended, os.path.getsize(path), "its header")
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
    fetch = whole_or_packed(path, dtype, [axis.size for axis in axes], 1024 + max(int(header.nsymbt), 0))
    image = Image("MRC", path, axes, dtype, fetch, *mrc_space(header, order))
    if order != [1, 2, 3]:
        image.notes.append(f"columns, rows and sections are the axes {', '.join(axis.kind for axis in (x, y, z))}")
    return image


def mrc_space(header, order):
    """The matrix of x, y, z of a cell that may be oblique, and its unit: angstroms if there is a cell."""
    lengths = [float(header.cella[axis]) for axis in SPACE]
    is_known = all(length > 0 for length in lengths)
    matrix = np.eye(4)
    matrix[:3, :3] = cell_axes([float(header.cellb[name]) for name in ("alpha", "beta", "gamma")])
    if is_known:
        matrix[:3, :3] *= np.divide(lengths, [max(int(n), 1) for n in (header.mx, header.my, header.mz)])
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
VALID = "vtkValidPointMask"  # of ParaView: 0 where a volume that was resampled has no value


def read_vti(path, options):
    with open(path, "rb") as file:
        head = file.read(1 << 16)
    file_type = re.search(rb'<VTKFile[^>]*\btype\s*=\s*["\'](\w+)', head)
    if file_type and file_type[1] != b"ImageData":
        raise esvr.BadInput(f"{path} is a VTK file of type {file_type[1].decode()}, which is not read; ImageData (.vti) is")
    need("vtkmodules.vtkIOXML", "python3-vtk9", path, "VTI")
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkLogger, vtkOutputWindow, vtkStringOutputWindow
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
    from vtkmodules.vtkIOXML import vtkXMLImageDataReader
    messages, reader = vtkStringOutputWindow(), vtkXMLImageDataReader()
    vtkOutputWindow.SetInstance(messages)
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)

    def refuse_errors(what):
        text = " ".join(messages.GetOutput().split())
        if reader.GetErrorCode() or "ERROR" in text:
            text = re.sub(r"^.*?\): ", "", text)[:300]
            raise esvr.BadInput(f"{path} cannot be read as VTI: {what}: {text or 'error ' + str(reader.GetErrorCode())}")
    reader.SetFileName(path)
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
        raise esvr.BadInput(f"{path}: the array '{name}' has {count} values for {product(size)} {'cells' if is_cells else 'points'}")
    numbers, components = vtk_to_numpy(array).copy(), array.GetNumberOfComponents()
    directions = np.array([[data.GetDirectionMatrix().GetElement(r, c) for c in range(3)] for r in range(3)])
    affine = affine_of(data.GetSpacing(), data.GetOrigin(), directions)
    first = extent[:, 0] + [0.5 if is_cells and n > 1 else 0.0 for n in points]
    affine[:3, 3] = (affine @ [*first, 1.0])[:3]
    axes = axes_from_letters("zyx", size[::-1], path)
    mask = None if is_cells else data.GetPointData().GetAbstractArray(VALID)
    if mask is not None:
        numbers = np.where(np.reshape(vtk_to_numpy(mask) != 0, (-1,) + (1,) * (numbers.ndim - 1)), numbers, np.nan)
    if components > 1:
        labels = [array.GetComponentName(c) or "" for c in range(components)]
        axes.append(Axis(VECTOR if components == 3 and numbers.dtype.kind == "f" else CHANNEL, components, "components", labels))
    unit = data.GetFieldData().GetAbstractArray("length_unit")  # vdb2image writes it
    return Image("VTI", path, axes, numbers.dtype, in_memory(numbers.reshape([axis.size for axis in axes])), affine,
                 unit_named(unit.GetValue(0)) if unit is not None and unit.GetNumberOfValues() else None,
                 missing=np.isnan if mask is not None else None)


def vti_array(path, head, reader, dataset):
    """Whether the array is of cells, and its name. All others, but for the mask of valid points, are switched off."""
    selections = {False: reader.GetPointDataArraySelection(), True: reader.GetCellDataArraySelection()}
    arrays = [(is_cells, selection.GetArrayName(k)) for is_cells, selection in selections.items()
              for k in range(selection.GetNumberOfArrays()) if selection.GetArrayName(k) not in (VALID, "vtkGhostType")]
    if not arrays:
        raise esvr.BadInput(f"{path} has no array")
    wanted = [array for array in arrays if dataset in (None, array[1])]
    active = set(re.findall(rb'<(?:PointData|CellData)[^>]*\bScalars\s*=\s*["\']([^"\']+)', head))
    if len(wanted) > 1 and not dataset and len(active) == 1:
        wanted = [array for array in arrays if array[1].encode() in active] or wanted
    if len(wanted) != 1:
        shown = ", ".join(f"{name} ({'cells' if is_cells else 'points'})" for is_cells, name in arrays)
        raise esvr.UsageError(f"{path} has {'several arrays' if wanted else 'no array of this name'}: {shown}; name one by --dataset")
    for is_cells, selection in selections.items():
        selection.DisableAllArrays()
        if is_cells == wanted[0][0]:
            selection.EnableArray(wanted[0][1])
            selection.EnableArray(VALID)
    return wanted[0]
