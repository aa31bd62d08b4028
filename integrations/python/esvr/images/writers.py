"""Writers of the formats of vdb2image.

Each takes the path of a temporary file and a Volume (vdb2image.py), whose slabs have the axes z, y, x (and the components of
vectors), so that no writer needs the whole array. TYPES has the types of each format; a type that is not among them is not
written in it.
"""
# mypy: disable-error-code=import
import gzip
import io
import math
import struct

import numpy as np

import esvr

from .image import LPS, LPS_TO_RAS, need, product

INTEGERS = ["int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64"]
WIDE = INTEGERS + ["float32", "float64"]
TYPES = {"NIfTI": WIDE, "NRRD": WIDE, "MetaImage": WIDE, "netCDF": WIDE, "VTI": WIDE, "NPY": ["bool", "float16"] + WIDE,
         "MRC": ["int8", "int16", "uint16", "float16", "float32"],
         "TIFF": ["int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64"]}
WITHOUT_VECTORS = {"MRC", "TIFF"}


def numbers_text(values):
    return " ".join(repr(float(value)) for value in values)


def is_diagonal(matrix):
    return np.allclose(matrix[:3, :3], np.diag(np.diag(matrix[:3, :3])), rtol=0, atol=1e-9 * np.abs(matrix[:3, :3]).max())


def refuse_matrix(format_name):
    raise esvr.UsageError(f"{format_name} cannot hold the orientation of this grid; .nii.gz, .nrrd, .mha and .vti can")


# -- formats with any orientation --------------------------------------------------------------------------------------
def write_nifti(path, volume):
    need("nibabel", "python3-nibabel", volume.out, "NIfTI")
    from nibabel import Nifti1Header, Nifti2Header
    header = (Nifti1Header if max(volume.size) < 2 ** 15 else Nifti2Header)()
    header.set_data_dtype(volume.dtype)
    header.set_data_shape(volume.size + ((1, 3) if volume.components == 3 else ()))
    if volume.components == 3:
        header.set_intent("vector")
    matrix = volume.matrix_in({"m": "m", "um": "um"}.get(volume.unit, "mm"))
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    header.set_zooms(tuple(lengths) + (1.0,) * (2 if volume.components == 3 else 0))
    header.set_sform(matrix, 1)
    directions = matrix[:3, :3] / lengths
    if np.allclose(directions.T @ directions, np.eye(3), atol=1e-6):
        header.set_qform(matrix, 1)
    header.set_xyzt_units({"m": "meter", "um": "micron", None: None}.get(volume.unit, "mm"))
    offset = header.single_vox_offset
    header["vox_offset"] = offset
    packed = volume.out.lower().endswith(".gz")
    with open(path, "wb") as plain, gzip.GzipFile("", "wb", 3, plain, mtime=0) if packed else plain as file:
        file.write(header.binaryblock)
        file.write(bytes(offset - len(header.binaryblock)))
        for component in range(3) if volume.components == 3 else [None]:
            for slab in volume.slabs(component):
                file.write(slab.data)


NRRD_NAMES = {"int8": "int8", "uint8": "uint8", "float32": "float", "float64": "double"}


def write_nrrd(path, volume):
    space = volume.metadata.get("image_space")
    matrix = volume.matrix_in(volume.unit)
    if space == LPS:
        matrix = LPS_TO_RAS @ matrix
    is_vector = volume.components == 3
    directions = " ".join(f"({','.join(repr(float(n)) for n in matrix[:3, column])})" for column in range(3))
    lines = ["NRRD0004", f"type: {NRRD_NAMES.get(volume.dtype.name, volume.dtype.name)}", f"dimension: {3 + is_vector}",
             f"space: {space}" if space else "space dimension: 3",
             f"sizes: {'3 ' if is_vector else ''}{' '.join(map(str, volume.size))}",
             f"space directions: {'none ' if is_vector else ''}{directions}",
             f"kinds: {'vector ' if is_vector else ''}domain domain domain", "endian: little", "encoding: raw",
             f"space origin: ({','.join(repr(float(n)) for n in matrix[:3, 3])})"]
    if volume.unit:
        lines.append("space units: " + " ".join([f'"{volume.unit}"'] * 3))
    if "value_unit" in volume.metadata:
        lines.append(f"sample units: {volume.metadata['value_unit']}")
    turn = LPS_TO_RAS[:3, :3] if space == LPS else None
    volume.save(path, ("\n".join(lines) + "\n\n").encode(), turn=turn)


META_NAMES = {"int8": "CHAR", "uint8": "UCHAR", "int16": "SHORT", "uint16": "USHORT", "int32": "INT", "uint32": "UINT",
              "int64": "LONG_LONG", "uint64": "ULONG_LONG", "float32": "FLOAT", "float64": "DOUBLE"}


def write_metaimage(path, volume):
    matrix = LPS_TO_RAS @ volume.matrix_in("mm")
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    lines = ["ObjectType = Image", "NDims = 3", "BinaryData = True", "BinaryDataByteOrderMSB = False", "CompressedData = False",
             f"TransformMatrix = {numbers_text((matrix[:3, :3] / lengths).T.ravel())}", f"Offset = {numbers_text(matrix[:3, 3])}",
             "CenterOfRotation = 0 0 0", f"ElementSpacing = {numbers_text(lengths)}", f"DimSize = {' '.join(map(str, volume.size))}",
             *(["ElementNumberOfChannels = 3"] if volume.components == 3 else []),
             f"ElementType = MET_{META_NAMES[volume.dtype.name]}", "ElementDataFile = LOCAL"]
    volume.save(path, ("\n".join(lines) + "\n").encode(), turn=LPS_TO_RAS[:3, :3])


def write_vti(path, volume):
    matrix = volume.matrix_in(volume.unit)
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    escaped = volume.name.replace("&", "&amp;").replace("<", "&lt;").replace('"', "&quot;")
    extent = " ".join(f"0 {n - 1}" for n in volume.size)
    unit = " ".join(str(code) for code in (volume.unit or "").encode() + b"\0")
    count = product(volume.size) * volume.components * volume.dtype.itemsize
    header = f"""<?xml version="1.0"?>
<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<ImageData WholeExtent="{extent}" Origin="{numbers_text(matrix[:3, 3])}" Spacing="{numbers_text(lengths)}" \
Direction="{numbers_text((matrix[:3, :3] / lengths).ravel())}">
<FieldData><DataArray type="String" Name="length_unit" NumberOfTuples="1" format="ascii">{unit}</DataArray></FieldData>
<Piece Extent="{extent}"><PointData {'Vectors' if volume.components == 3 else 'Scalars'}="{escaped}">
<DataArray type="{volume.dtype.name.capitalize().replace('Uint', 'UInt')}" \
Name="{escaped}" NumberOfComponents="{volume.components}" format="appended" offset="0"/>
</PointData></Piece></ImageData>
<AppendedData encoding="raw">
_"""
    volume.save(path, header.encode() + struct.pack("<Q", count), b"\n</AppendedData>\n</VTKFile>\n")


# -- formats with axes along those of the world ------------------------------------------------------------------------
def write_mrc(path, volume):
    mrcfile = need("mrcfile", "python3-mrcfile", volume.out, "MRC")
    matrix = volume.matrix_in("angstrom")
    spacing = np.linalg.norm(matrix[:3, :3], axis=0)
    angles = [math.degrees(math.acos(np.clip(np.dot(matrix[:3, a], matrix[:3, b]) / (spacing[a] * spacing[b]), -1, 1)))
              for a, b in ((1, 2), (0, 2), (0, 1))]
    upper = np.allclose(np.tril(matrix[:3, :3], -1), 0, atol=1e-9 * spacing.max()) and np.all(np.diag(matrix)[:3] > 0)
    if not upper:  # a lies along x, and b in the plane of x and y
        refuse_matrix("MRC")
    modes = {"int8": 0, "int16": 1, "float32": 2, "uint16": 6, "float16": 12}
    with mrcfile.new_mmap(path, volume.size[::-1], modes[volume.dtype.name], overwrite=True) as file:
        volume.fill(file.data)
        file.voxel_size = tuple(spacing)
        header = file.header
        header.cellb.alpha, header.cellb.beta, header.cellb.gamma = angles
        header.origin.x, header.origin.y, header.origin.z = matrix[:3, 3]
        header.dmin, header.dmax = (volume.low, volume.high) if volume.low is not None else (0, 0)
        header.dmean, header.rms = header.dmin - 1, -1  # which means that they are not known


def write_netcdf(path, volume):
    netcdf = need("netCDF4", "python3-netcdf4", volume.out, "netCDF")
    matrix = volume.matrix_in(volume.unit)
    if not is_diagonal(matrix):
        refuse_matrix("netCDF")
    units = volume.metadata.get("image_axis_units", "").split(", ") if not volume.unit else [volume.unit] * 3
    with netcdf.Dataset(path, "w") as file:
        for column, name in enumerate("xyz"):
            file.createDimension(name, volume.size[column])
            axis = file.createVariable(name, "f8", (name,))
            axis.axis = name.upper()
            if len(units) == 3 and units[column] not in ("", "1"):
                axis.units = units[column]
            axis[:] = matrix[column, 3] + matrix[column, column] * np.arange(volume.size[column])
        dimensions = ("z", "y", "x")
        if volume.components == 3:
            file.createDimension("component", 3)
            dimensions += ("component",)
        name = "".join(c if c.isalnum() or c in "_-" else "_" for c in volume.name) or "density"
        variable = file.createVariable(name if name not in "xyz" else name + "_", volume.dtype, dimensions, zlib=True, complevel=1,
                                       fill_value=volume.missing if volume.missing is not None else False)
        variable.set_auto_maskandscale(False)
        if "value_unit" in volume.metadata:
            variable.units = volume.metadata["value_unit"]
        volume.fill(variable)


# -- formats without orientation ---------------------------------------------------------------------------------------
IMAGEJ_UNITS = {"um": "micron", "angstrom": "A"}


def write_tiff(path, volume):
    tifffile = need("tifffile", "python3-tifffile", volume.out, "TIFF")
    matrix = volume.matrix_in(volume.unit)
    spacing = np.linalg.norm(matrix[:3, :3], axis=0)
    size = product(volume.size) * volume.dtype.itemsize
    is_imagej = volume.dtype.name in ("uint8", "uint16", "float32") and size < 2 ** 32 - 2 ** 25 and \
        not volume.out.lower().endswith((".ome.tif", ".ome.tiff"))
    lost = not is_diagonal(matrix) or np.any(np.diag(matrix)[:3] < 0)
    pages = (page for slab in volume.slabs() for page in slab)
    shape = volume.size[::-1]
    if is_imagej:
        metadata = {"axes": "ZYX", "spacing": float(spacing[2]), "loop": False}
        if volume.unit:
            metadata["unit"] = IMAGEJ_UNITS.get(volume.unit, volume.unit)
        for axis, at, step in zip("xyz", matrix[:3, 3], spacing):
            if at and not lost:
                metadata[f"{axis}origin"] = repr(float(-at / step))
        with tifffile.TiffWriter(path, imagej=True) as file:
            file.write(pages, shape=shape, dtype=volume.dtype, resolution=(1 / spacing[0], 1 / spacing[1]), metadata=metadata)
    else:
        lost = lost or np.any(matrix[:3, 3])
        metadata = {"axes": "ZYX", **{f"PhysicalSize{axis}": float(n) for axis, n in zip("XYZ", spacing)}}
        unit = {"um": "µm", "angstrom": "Å", "u": "µm"}.get(volume.unit, volume.unit or "pixel")
        metadata.update({f"PhysicalSize{axis}Unit": unit for axis in "XYZ"})
        with tifffile.TiffWriter(path, ome=True, bigtiff=size > 2 ** 32 - 2 ** 25) as file:
            file.write(pages, shape=shape, dtype=volume.dtype, metadata=metadata, photometric="minisblack")
    if lost:
        volume.warn("TIFF has no place for the origin and the orientation of the grid, which are left out")


def write_npy(path, volume):
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {
        "descr": np.lib.format.dtype_to_descr(volume.dtype), "fortran_order": False,
        "shape": volume.size[::-1] + ((3,) if volume.components == 3 else ())})
    volume.save(path, header.getvalue())
    if volume.unit or not np.allclose(volume.matrix_in(volume.unit), np.eye(4)):
        volume.warn("NPY has no place for lengths, the origin and the orientation of the grid, which are left out")


FORMATS = {(".nii", ".nii.gz"): ("NIfTI", write_nifti), (".mha",): ("MetaImage", write_metaimage), (".mrc", ".map"): ("MRC", write_mrc),
           (".tif", ".tiff"): ("TIFF", write_tiff), (".nrrd",): ("NRRD", write_nrrd), (".nc",): ("netCDF", write_netcdf),
           (".vti",): ("VTI", write_vti), (".npy",): ("NPY", write_npy)}
