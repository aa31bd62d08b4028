"""Readers of HDF5, netCDF and Zarr, which hold many arrays, and describe their axes by names and coordinates."""
import json
import os
import re
import struct

import numpy as np

import esvr

from .image import (CHANNEL, SPACE, TIME, VECTOR, Axis, Image, affine_of, affine_of_steps, axes_from_letters, kind_named,
                    missing_if_any, need, product, require_bytes)
from .read_volumes import unnamed_axes


def choose(path, found, dataset, what):
    """One of the arrays of a file; found has their texts by their names."""
    if dataset is not None:
        name = next((n for n in found if n.strip("/") == dataset.strip("/")), None)
        if name is None:
            raise esvr.UsageError(f"{path} has no {what} {dataset}; there are: {', '.join(found.values()) or 'none'}")
        return name
    if not found:
        raise esvr.BadInput(f"{path} has no {what} of numbers with three axes")
    if len(found) > 1:
        raise esvr.UsageError(f"{path} has several images: {', '.join(found.values())}; name one by --dataset")
    return next(iter(found))


def text_of(name, array):
    return f"{name} ({' x '.join(map(str, array.shape))} {getattr(array.dtype, 'name', array.dtype)})"


def is_real(dtype):
    return isinstance(dtype, np.dtype) and dtype.kind in "iufb"


# -- attributes of the CF conventions --------------------------------------------------------------------------------
def plain(attributes):
    """Attributes as text and numbers, whatever the library makes of them."""
    def value(item):
        if isinstance(item, np.ndarray) and item.size == 1 and item.dtype.kind in "SUO":
            item = item.reshape(-1)[0]
        return item.decode("utf-8", "replace") if isinstance(item, bytes) else item
    return {name: value(item) for name, item in attributes.items()}


def number_of(attributes, name, default):
    return float(np.ravel(attributes[name])[0]) if name in attributes else default


STANDARD_NAMES = {"projection_x_coordinate": "x", "projection_y_coordinate": "y", "longitude": "x", "latitude": "y",
                  "altitude": "z", "height": "z", "depth": "z", "time": TIME, "forecast_period": TIME, "realization": CHANNEL,
                  "grid_longitude": "x", "grid_latitude": "y"}


def kind_of_dimension(attributes, name):
    """The meaning of a dimension by the attributes of its coordinates, or else by its name; "" if it is not known."""
    axis, units = str(attributes.get("axis", "")).lower(), str(attributes.get("units", ""))
    if axis in ("x", "y", "z", "t"):
        return TIME if axis == "t" else axis
    if attributes.get("standard_name") in STANDARD_NAMES:
        return STANDARD_NAMES[attributes["standard_name"]]
    if " since " in units:
        return TIME
    if units.startswith("degree") and units.endswith(("east", "E", "north", "N")):
        return "x" if units.endswith(("east", "E")) else "y"
    kind = "z" if "positive" in attributes else kind_named(name)
    return kind if kind in (*SPACE, TIME, CHANNEL, VECTOR) else ""


def named_axes(path, names, attributes, shape, options, warnings):
    """The axes of dimensions by --axes, or by their names and the attributes of their coordinates. Dimensions that are not known
    are those of space that are left, the last ones first, with a warning if others are known."""
    if options.axes:
        return [Axis(axis.kind, axis.size, name) for axis, name in zip(axes_from_letters(options.axes, shape, path), names)]
    kinds = [kind_of_dimension(these, name) for these, name in zip(attributes, names)]
    free, is_known = [kind for kind in SPACE if kind not in kinds], bool(set(SPACE) & set(kinds))
    for at in reversed(range(len(kinds))):
        if not kinds[at]:
            kinds[at] = free.pop(0) if free else f"axis{at}"
            if is_known and kinds[at] in SPACE and shape[at] > 1:
                warnings.append(f"the axis {names[at]} is taken for {kinds[at]} (--axes names the axes)")
    return [Axis(kind, n, name) for kind, n, name in zip(kinds, shape, names)]


def step_of(numbers, attributes, name, warnings):
    """The step, the first place and the unit of coordinates; 1, 0 and no unit where their steps differ."""
    places = np.asarray(numbers, np.float64)
    places = places * number_of(attributes, "scale_factor", 1.0) + number_of(attributes, "add_offset", 0.0)
    steps = np.diff(places)
    step = float(places[-1] - places[0]) / len(steps) if len(steps) else 1.0
    # float32 coordinates have steps that differ by their rounding
    even = np.all(np.abs(steps - step) <= 1e-3 * abs(step) + 4e-7 * np.abs(places).max())
    if not np.all(np.isfinite(places)) or not even or step == 0:
        warnings.append(f"the steps of the axis {name} differ, so that it counts its voxels")
        return 1.0, 0.0, None
    return step, float(places[0]), str(attributes.get("units", ""))


def candidates(arrays, attributes, coordinates, dataset):
    """The texts of the arrays of which one may be the image, by their names: those of real numbers that are no coordinates (a set of
    names) and do not describe others, with three axes, or with two if none has three. --dataset may name any array."""
    texts = {name: text_of(name, array) for name, array in arrays.items()}
    if dataset is not None:
        return texts
    # Names with a # are what MATLAB keeps for itself.
    described = {word for these in attributes.values() for name in ("bounds", "coordinates", "grid_mapping")
                 for word in str(these.get(name, "")).split()}
    found = {name: array.ndim for name, array in arrays.items() if is_real(array.dtype) and array.ndim >= 2 and array.size and
             name not in coordinates and not name.startswith("/#") and name.rpartition("/")[2] not in described}
    return {name: texts[name] for name, count in found.items() if count >= min(3, max(found.values()))}


def described_image(format_name, path, names, coordinates, array, attributes, options, block=1):
    """The image of an array whose axes have names ("" where the file does not say) and coordinates (numbers and attributes, or
    None), and whose numbers are packed and missing as the CF conventions say."""
    if not is_real(array.dtype):
        raise esvr.BadInput(f"{path}: the array holds {array.dtype}, and images hold real numbers")
    dtype, warnings = np.dtype(array.dtype), []
    axes = named_axes(path, names, [c[1] if c else {} for c in coordinates], array.shape, options, warnings) if all(names) else \
        unnamed_axes(path, array.shape, options)
    steps = [step_of(*coordinate, axis.name, warnings) if coordinate is not None and axis.kind in SPACE else (1.0, 0.0, None)
             for axis, coordinate in zip(axes, coordinates)]
    affine, unit = affine_of_steps(axes, steps)
    kept, fetch = dtype, array.__getitem__
    if str(attributes.get("_Unsigned", "")).lower() == "true" and dtype.kind == "i":
        dtype = np.dtype(f"{dtype.byteorder}u{dtype.itemsize}")

        def fetch(index):
            return np.asarray(array[index]).astype(kept, copy=False).view(dtype)
    slope, intercept = number_of(attributes, "scale_factor", 1.0), number_of(attributes, "add_offset", 0.0)
    image = Image(format_name, path, axes, dtype, fetch, affine, unit, (slope, intercept),
                  missing_by_attributes(attributes, kept, dtype, slope, intercept), block, warnings=warnings)
    if "units" in attributes:
        image.metadata["value_unit"] = str(attributes["units"])
    units = [next((step[2] for axis, step in zip(axes, steps) if axis.kind == kind), None) for kind in SPACE]
    if unit is None and any(units):
        image.metadata["image_axis_units"] = ", ".join(text or "1" for text in units)
        warnings.append(f"the axes x, y, z are in {image.metadata['image_axis_units']}, so that the voxels have no unit of length")
    return image


def missing_by_attributes(attributes, kept, dtype, slope, intercept):
    """Which stored numbers are missing: fill values, and those outside the valid range. kept is the type of the file, and dtype
    the one that _Unsigned makes of it."""
    def numbers_of(name):
        numbers = np.ravel(attributes.get(name, []))
        return numbers.astype(kept).view(dtype) if numbers.dtype.kind == "i" and dtype != kept else numbers

    gone = [number.item() for name in ("_FillValue", "missing_value") for number in numbers_of(name) if number.dtype.kind in "iuf"]
    if dtype.kind == "f" and "_FillValue" not in attributes:
        gone.append(9.969209968386869e36)  # of voxels that were never written
    limits = [numbers_of("valid_range")[k] if "valid_range" in attributes else next(iter(numbers_of(name)), None)
              for k, name in enumerate(("valid_min", "valid_max"))]
    if dtype.kind != "f" and any(isinstance(limit, np.floating) for limit in limits):  # of values, and not of packed numbers
        limits = [None if limit is None else round((limit - intercept) / slope, 6) for limit in limits][::1 if slope > 0 else -1]
    low, high = limits
    tests = [missing_if_any(gone), low is not None and (lambda numbers: numbers < low),
             high is not None and (lambda numbers: numbers > high)]
    tests = [test for test in tests if test]
    return (lambda numbers: np.logical_or.reduce([test(numbers) for test in tests])) if tests else None


def coordinates_of(scale):
    """The numbers and attributes of the coordinates of an axis; None if they are none."""
    if scale is None or scale.ndim != 1 or scale.dtype.kind not in "iuf":
        return None
    attributes = plain(dict(scale.attrs))
    is_size = str(attributes.get("NAME", "")).startswith("This is a netCDF dimension but not a netCDF variable")
    return None if is_size else (scale[...], attributes)


# -- HDF5 ----------------------------------------------------------------------------------------------------------
# Formats within HDF5 whose numbers are not values, or whose arrays are larger than the image, by one of their groups.
HDF5_OTHERS = {"minc-2.0": "MINC", "DataSetInfo": "Imaris", "__DATA_TYPES__": "BigDataViewer", "ITKImage": "ITK"}


def read_hdf5(path, options, format_name="HDF5"):
    h5py = need("h5py", "python3-h5py", path, format_name)
    file, arrays = h5py.File(path, "r"), {}
    for name, program in HDF5_OTHERS.items():
        if name in file:
            raise esvr.BadInput(f"{path} is an HDF5 file of {program}, whose description is not read; save it as NIfTI or OME-TIFF")
    file.visititems(lambda name, item: arrays.update({f"/{name}": item} if isinstance(item, h5py.Dataset) else {}))
    scales = {name for name, item in arrays.items() if h5py.h5ds.is_scale(item.id)}
    found = candidates(arrays, {name: plain(item.attrs) for name, item in arrays.items()}, scales, options.dataset)
    name = choose(path, found, options.dataset, "dataset")
    dataset = arrays[name]
    warnings = check_storage(path, name, dataset)
    scales = [dim[0] if len(dim) else None for dim in dataset.dims]
    names = [dim.label or (scale.name.rpartition("/")[2] if scale is not None else "") for dim, scale in zip(dataset.dims, scales)]
    attributes = plain(dataset.attrs)
    if "axistags" in attributes and not all(names):  # of vigra and ilastik
        names = [tag["key"] for tag in json.loads(attributes["axistags"])["axes"]]
    image = described_image(format_name, path, names, [coordinates_of(scale) for scale in scales], dataset, attributes, options,
                            dataset.chunks[0] if dataset.chunks else 1)
    sizes = attributes.get("element_size_um")
    if np.size(sizes) == 3:
        image.affine, image.unit = affine_of([abs(float(s)) or 1.0 for s in np.ravel(sizes)[::-1]]), "um"
    image.warnings += warnings
    return image


def check_storage(path, name, dataset):
    """Checks that the numbers are there, since HDF5 takes those that are not for the fill value. Returns warnings."""
    count = product(dataset.shape) * dataset.dtype.itemsize
    if dataset.is_virtual:
        for source in {source.file_name.replace("%b", "0") for source in dataset.virtual_sources() if source.file_name != "."}:
            if not os.path.exists(os.path.join(os.path.dirname(path), source)):
                raise esvr.BadInput(f"{path}: the dataset {name} has numbers in another file, {source}, which is missing")
    elif dataset.external:
        for other, offset, size in dataset.external:
            other = os.path.join(os.path.dirname(path), os.fsdecode(other))
            require_bytes(path, min(size, count), os.path.getsize(other) - offset, f"the dataset {name} in {other}")
    elif dataset.chunks is None and dataset.id.get_offset() is not None:
        require_bytes(path, count, os.path.getsize(path) - dataset.id.get_offset(), f"the dataset {name}")
    elif dataset.chunks is not None:
        chunks = product(-(-n // chunk) for n, chunk in zip(dataset.shape, dataset.chunks))
        return missing_chunks(chunks - dataset.id.get_num_chunks(), chunks, dataset.fillvalue)
    return []


def missing_chunks(missing, count, fill):
    return [f"{missing} of {count} chunks are not stored, and have the fill value {fill}"] if missing > 0 else []


# -- netCDF --------------------------------------------------------------------------------------------------------
def read_netcdf(path, options):
    """The classic format; netCDF 4 is HDF5, of which the netCDF library leaves out what its model does not have."""
    with open(path, "rb") as file:
        if file.read(3) != b"CDF":
            return read_hdf5(path, options, "netCDF")
    netcdf = need("netCDF4", "python3-netcdf4", path, "netCDF")
    file = netcdf.Dataset(path)
    file.set_auto_maskandscale(False)
    check_classic(path)
    arrays = {f"/{name}": variable for name, variable in file.variables.items()}
    found = candidates(arrays, {name: variable.__dict__ for name, variable in arrays.items()},
                       {name for name, variable in arrays.items() if name[1:] in variable.dimensions}, options.dataset)
    variable = arrays[choose(path, found, options.dataset, "variable")]
    scales = [file.variables.get(name) if name != variable.name else None for name in variable.dimensions]
    coordinates = [(scale[:], plain(scale.__dict__)) if scale is not None and scale.ndim == 1 and is_real(scale.dtype) else None
                   for scale in scales]
    return described_image("netCDF", path, variable.dimensions, coordinates, variable, plain(variable.__dict__), options)


CLASSIC_SIZES = {1: 1, 2: 1, 3: 2, 4: 4, 5: 4, 6: 8, 7: 1, 8: 2, 9: 4, 10: 8, 11: 8}


def check_classic(path):
    """Checks the length of a file of the classic format, because the library takes what is missing for zeros."""
    with open(path, "rb") as file:
        version = file.read(4)[3]
        long = version == 5

        def whole(is_long=long):
            return struct.unpack(">Q" if is_long else ">I", file.read(8 if is_long else 4))[0]

        def skip(count):
            file.seek(-(-count // 4) * 4, 1)

        def items(read):  # a list: its tag, its length, and named items
            whole(False)
            return [(skip(whole()), read())[1] for _ in range(whole())]

        def attribute():
            size = CLASSIC_SIZES[whole(False)]
            skip(whole() * size)

        def variable():
            shape = [dimensions[whole()] for _ in range(whole())]
            items(attribute)
            size = CLASSIC_SIZES[whole(False)]
            whole()
            return shape, size, whole(version != 1)
        records, dimensions = whole(), items(whole)
        items(attribute)
        variables = items(variable)
        end = file.tell()
    of_records = [product(shape[1:]) * size for shape, size, _ in variables if shape and shape[0] == 0]
    stride = sum(-(-n // 4) * 4 for n in of_records) if len(of_records) > 1 else sum(of_records)
    for shape, size, begin in variables:
        if not shape or shape[0]:
            end = max(end, begin + product(shape) * size)
        elif records not in (0, 2 ** 32 - 1, 2 ** 64 - 1):
            end = max(end, begin + (records - 1) * stride + product(shape[1:]) * size)
    require_bytes(path, end, os.path.getsize(path), "the file")


# -- Zarr ----------------------------------------------------------------------------------------------------------
def is_zarr(folder):
    return bool({".zgroup", ".zarray", "zarr.json"} & set(os.listdir(folder))) or str(folder).rstrip("/").endswith(".zarr")


def read_zarr(path, options):
    zarr = need("zarr", "python3-zarr", path, "Zarr")
    if os.path.isdir(path):
        refuse_other_zarr(path)
    root = zarr.open(zarr.DirectoryStore(path) if os.path.isdir(path) else zarr.ZipStore(path, mode="r"), mode="r")
    images = {"/": root} if isinstance(root, zarr.Array) else zarr_images(zarr, root)
    found = {name: text_of(name, item) if isinstance(item, zarr.Array) else f"{name} (OME-Zarr)"
             for name, item in images.items()}
    wanted, level = options.dataset, None
    if wanted is None and "/" in images:
        wanted = "/"  # beside an image of OME there may be its labels
    if wanted is not None and wanted.strip("/") and not any(name.strip("/") == wanted.strip("/") for name in images):
        parent, _, last = wanted.strip("/").rpartition("/")
        if "multiscales" in getattr(images.get("/" + parent), "attrs", ()):  # a level of an image of OME
            wanted, level = "/" + parent, last
    name = choose(path, found, wanted, "array")
    image = ome_zarr(path, images[name], level, options) if "multiscales" in images[name].attrs else \
        plain_zarr(zarr, path, images[name], options)
    if len(found) > 1 and options.dataset is None:
        image.notes.append(f"the file has also: {', '.join(text for other, text in found.items() if other != name)}")
    return image


def refuse_other_zarr(path):
    """Zarr 2.13 does not know Zarr 3, and takes its folders for empty ones."""
    for folder, folders, files in os.walk(path):
        if "zarr.json" in files:
            raise esvr.BadInput(f"{path} is a Zarr folder of version 3, which is not read; save it as version 2 (OME-Zarr 0.4)")
        if ".zarray" in files:
            folders.clear()  # of chunks
    if not {".zgroup", ".zarray"} & set(os.listdir(path)):
        raise esvr.BadInput(f"{path} is no Zarr folder: it has no .zgroup and no .zarray")


def zarr_images(zarr, group, prefix="/"):
    """Images of OME and, outside of them, arrays."""
    found = {prefix: group} if "multiscales" in group.attrs else {}
    levels = {d.get("path") for m in group.attrs.get("multiscales", []) for d in m.get("datasets", [])}
    for name in set(group) - levels:
        item, name = group[name], f"{prefix.rstrip('/')}/{name}"
        if not isinstance(item, zarr.Array):
            found.update(zarr_images(zarr, item, name))
        elif item.ndim >= 3 and is_real(item.dtype):
            found[name] = item
    return dict(sorted(found.items()))


def plain_zarr(zarr, path, array, options):
    """An array; xarray names its dimensions, whose coordinates are arrays of their names."""
    names, warnings, attributes = array.attrs.get("_ARRAY_DIMENSIONS") or [], check_chunks(path, array), plain(array.attrs.asdict())
    if len(names) != array.ndim:
        names = [""] * array.ndim
    elif array.fill_value is not None:  # which xarray writes for _FillValue
        attributes.setdefault("_FillValue", array.fill_value)
    coordinates, parent = [], array.path.rpartition("/")[0]
    for name in names:
        beside = f"{parent}/{name}".strip("/")
        is_there = name and beside != array.path and zarr.storage.contains_array(array.store, beside)
        coordinates.append(coordinates_of(zarr.open_array(array.store, path=beside, mode="r")) if is_there else None)
    image = described_image("Zarr", path, names, coordinates, array, attributes, options, array.chunks[0])
    image.warnings += warnings
    return image


def ome_zarr(path, group, level, options):
    """A level of an image of OME (versions 0.1 to 0.4), by default the finest one."""
    scales = group.attrs["multiscales"]
    if len(scales) > 1:
        raise esvr.BadInput(f"{path} has {len(scales)} images of several levels in one group, which is not read")
    datasets = {d["path"]: d for d in scales[0]["datasets"]}
    if level is not None and level not in datasets:
        raise esvr.UsageError(f"{path} has no level {level}; there are: {', '.join(datasets)}")
    dataset = datasets[level] if level else next(iter(datasets.values()))
    array = group[dataset["path"]]
    described = [d if isinstance(d, dict) else {"name": d} for d in scales[0].get("axes") or "tczyx"[-array.ndim:]]
    if len(described) != array.ndim:
        raise esvr.BadInput(f"{path} names {len(described)} axes for an array of {array.ndim}")
    steps, firsts = np.ones(array.ndim), np.zeros(array.ndim)
    for transform in dataset.get("coordinateTransformations", []) + scales[0].get("coordinateTransformations", []):
        kind = transform.get("type")
        if kind != "identity" and (kind not in ("scale", "translation") or kind not in transform):
            raise esvr.BadInput(f"{path} has a coordinate transformation of type {kind} that is not read")
        if kind == "scale":
            steps, firsts = steps * np.array(transform[kind], float), firsts * np.array(transform[kind], float)
        elif kind == "translation":
            firsts = firsts + np.array(transform[kind], float)
    axes = axes_from_letters(options.axes, array.shape, path) if options.axes else [
        Axis({"time": TIME, "channel": CHANNEL}.get(d.get("type"), kind_named(d["name"])), n, d["name"])
        for n, d in zip(array.shape, described)]
    affine, unit = affine_of_steps(axes, [(s, f, d.get("unit")) for s, f, d in zip(steps, firsts, described)])
    block = next((n for n, axis in zip(array.chunks, axes) if axis.kind in SPACE), 1)
    image = Image("OME-Zarr", path, axes, array.dtype, array.__getitem__, affine, unit, block=block,
                  warnings=check_chunks(path, array))
    image.name_channels([str(c.get("label") or "") for c in group.attrs.get("omero", {}).get("channels", [])])
    return image


def check_chunks(path, array):
    """Checks that the chunks are where they are looked for, since others count as fill value. Returns warnings."""
    folder, stored = os.path.join(path, array.path), array.nchunks_initialized
    if os.path.isdir(folder) and array.ndim > 1:
        names = os.listdir(folder)
        is_nested = (array._dimension_separator or ".") == "/"
        if any(re.fullmatch(r"\d+(\.\d+)+", n) if is_nested else n.isdigit() and os.path.isdir(os.path.join(folder, n))
               for n in names):
            there, said, right = ("0.0.0", "0/0/0", ".") if is_nested else ("0/0/0", "0.0.0", "/")
            raise esvr.BadInput(f"{path}: the chunks are stored as {there}, and .zarray says that they are {said}; correct its "
                                f"dimension_separator to '{right}'")
    if os.path.isdir(folder) and getattr(array.compressor, "codec_id", "") == "blosc":
        check_blosc(path, folder)
    missing = array.nchunks - stored
    if missing and array.fill_value is None:
        raise esvr.BadInput(f"{path}: {missing} of {array.nchunks} chunks are missing, and no fill value is named")
    return missing_chunks(missing, array.nchunks, array.fill_value)


def check_blosc(path, folder):
    """Blosc reads beyond the end of a chunk that is cut short; the length is in its header."""
    for parent, _, names in os.walk(folder):
        for name in names:
            if not name.startswith("."):
                chunk = os.path.join(parent, name)
                with open(chunk, "rb") as file:
                    head = file.read(16)
                if len(head) < 16 or int.from_bytes(head[12:16], "little") != os.path.getsize(chunk):
                    raise esvr.BadInput(f"{path}: the chunk {os.path.relpath(chunk, path)} is cut short or damaged")
