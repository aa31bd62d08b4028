"""Readers of HDF5, netCDF and Zarr, which hold many arrays, and describe their axes by names and coordinates."""
import json
import os
import re
import struct

import numpy as np

import esvr

from .image import CHANNEL, SPACE, TIME, VECTOR, Axis, Image, affine_of, affine_of_steps, axes_from_letters, kind_named, \
    missing_if_any, need, product, reading, require_bytes
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


def text_of(name, shape, dtype):
    return f"{name} ({' x '.join(map(str, shape))} {dtype})"


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
                  "altitude": "z", "height": "z", "depth": "z", "time": TIME, "grid_longitude": "x", "grid_latitude": "y"}


def kind_of_dimension(attributes, name):
    """The meaning of a dimension by the attributes of its coordinates, or else by its name; "" if it is not known."""
    axis = str(attributes.get("axis", "")).lower()
    if axis in ("x", "y", "z", "t"):
        return TIME if axis == "t" else axis
    if attributes.get("standard_name") in STANDARD_NAMES:
        return STANDARD_NAMES[attributes["standard_name"]]
    units = str(attributes.get("units", ""))
    if " since " in units:
        return TIME
    if units.startswith("degree") and units.endswith(("east", "E")):
        return "x"
    if units.startswith("degree") and units.endswith(("north", "N")):
        return "y"
    if "positive" in attributes:
        return "z"
    kind = kind_named(name)
    return kind if kind in SPACE or kind in (TIME, CHANNEL, VECTOR) else ""


def complete(kinds):
    """Dimensions that are not known are those of space that are left, the last ones first, and names of their own."""
    kinds = list(kinds)
    free = [kind for kind in SPACE if kind not in kinds]
    for at in range(len(kinds) - 1, -1, -1):
        if not kinds[at]:
            kinds[at] = free.pop(0) if free else f"axis{at}"
    return kinds


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


def described_image(format_name, path, axes, coordinates, dtype, fetch, attributes, block=1):
    """An image whose axes have coordinates (numbers and attributes, or None), and whose numbers are packed and missing as
    the CF conventions say."""
    warnings = []
    steps = [step_of(*coordinate, axis.name, warnings) if coordinate is not None and axis.kind in SPACE else (1.0, 0.0, None)
             for axis, coordinate in zip(axes, coordinates)]
    affine, unit = affine_of_steps(axes, steps)
    kept = dtype
    if str(attributes.get("_Unsigned", "")).lower() == "true" and dtype.kind == "i":
        dtype = np.dtype(f"{dtype.byteorder}u{dtype.itemsize}")
    slope, intercept = number_of(attributes, "scale_factor", 1.0), number_of(attributes, "add_offset", 0.0)

    def stored(index):
        return np.asarray(fetch(index)).astype(kept, copy=False).view(dtype)
    image = Image(format_name, path, axes, dtype, stored if dtype != kept else fetch, affine, unit, warnings=warnings,
                  missing=missing_by_attributes(attributes, kept, dtype, slope, intercept), block=block,
                  scale=None if (slope, intercept) == (1.0, 0.0) else (slope, intercept))
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
    def stored(name):
        numbers = np.ravel(attributes[name])
        if numbers.dtype.kind == "i" and dtype != kept:
            numbers = numbers.astype(kept).view(dtype)
        return numbers

    def limits(name):  # of packed numbers, or of values where the type is that of values
        numbers = stored(name)
        return (numbers - intercept) / slope if numbers.dtype.kind == "f" and dtype.kind != "f" else numbers

    values = [number.item() for name in ("_FillValue", "missing_value") if name in attributes and
              np.ravel(attributes[name]).dtype.kind in "iuf" for number in stored(name)]
    if dtype.kind == "f" and "_FillValue" not in attributes:
        values.append(9.969209968386869e36)  # of voxels that were never written
    low, high = limits("valid_range") if "valid_range" in attributes else (
        limits(name)[0] if name in attributes else None for name in ("valid_min", "valid_max"))
    if slope < 0 and dtype.kind != "f" and "valid_range" in attributes and np.ravel(attributes["valid_range"]).dtype.kind == "f":
        low, high = high, low
    by_value = missing_if_any(values)

    def missing(numbers):
        found = [by_value(numbers) if by_value else None, numbers < low if low is not None else None,
                 numbers > high if high is not None else None]
        found = [mask for mask in found if mask is not None]
        return np.logical_or.reduce(found) if found else None
    return missing if values or low is not None or high is not None else None


def named_axes(path, names, attributes, shape, options):
    """The axes of dimensions by --axes, or by their names and the attributes of their coordinates."""
    if options.axes:
        return [Axis(axis.kind, axis.size, name) for axis, name in zip(axes_from_letters(options.axes, shape, path), names)]
    kinds = complete([kind_of_dimension(these, name) for these, name in zip(attributes, names)])
    return [Axis(kind, n, name) for kind, n, name in zip(kinds, shape, names)]


# -- HDF5 ----------------------------------------------------------------------------------------------------------
def read_hdf5(path, options):
    h5py = need("h5py", "python3-h5py", path, "HDF5")
    with reading(path, "HDF5"):
        file = h5py.File(path, "r")
        found = {}

        def visit(name, item):
            if isinstance(item, h5py.Dataset) and is_real(item.dtype) and item.ndim >= 3 and item.size:
                found[f"/{name}"] = text_of(f"/{name}", item.shape, item.dtype.name)
        file.visititems(visit)
        if options.dataset and isinstance(file.get(options.dataset), h5py.Dataset):
            found.setdefault("/" + options.dataset.strip("/"), "")
        name = choose(path, found, options.dataset, "dataset")
        dataset = file[name]
        if not is_real(dataset.dtype):
            raise esvr.BadInput(f"{path}: the dataset {name} holds {dataset.dtype}, and images hold real numbers")
        if dataset.chunks is None and dataset.id.get_offset() is not None:
            require_bytes(path, product(dataset.shape) * dataset.dtype.itemsize, os.path.getsize(path) - dataset.id.get_offset(),
                          f"the dataset {name}")
        names, coordinates = hdf5_dimensions(dataset)
        attributes = plain(dataset.attrs)
        if "axistags" in attributes and not all(names):  # of vigra and ilastik
            names = [tag["key"] for tag in json.loads(attributes["axistags"])["axes"]]
        if options.axes or not all(names):
            axes = unnamed_axes(path, dataset.shape, options)
        else:
            axes = named_axes(path, names, [c[1] if c else {} for c in coordinates], dataset.shape, options)
        image = described_image("HDF5", path, axes, coordinates, dataset.dtype, dataset.__getitem__, attributes,
                                dataset.chunks[0] if dataset.chunks else 1)
        sizes = attributes.get("element_size_um")
        if sizes is not None and np.size(sizes) == 3:
            image.affine, image.unit = affine_of([abs(float(s)) or 1.0 for s in np.ravel(sizes)[::-1]]), "um"
    return image


def hdf5_dimensions(dataset):
    """The names of the axes by dimension scales or labels ("" where the file does not say), and the coordinates that the scales
    have."""
    names, coordinates = [], []
    for dim in dataset.dims:
        scale = dim[0] if len(dim) else None
        names.append(dim.label or (scale.name.rpartition("/")[2] if scale is not None else ""))
        attributes = plain(scale.attrs) if scale is not None else {}
        is_empty = str(attributes.get("NAME", "")).startswith("This is a netCDF dimension but not a netCDF variable")
        if scale is None or is_empty or scale.ndim != 1 or scale.dtype.kind not in "iuf":
            coordinates.append(None)
        else:
            coordinates.append((scale[...], attributes))
    return names, coordinates


# -- netCDF --------------------------------------------------------------------------------------------------------
def read_netcdf(path, options):
    netcdf = need("netCDF4", "python3-netcdf4", path, "netCDF")
    with reading(path, "netCDF"):
        file = netcdf.Dataset(path)
        file.set_auto_maskandscale(False)
        variables, known = {}, set()
        for prefix, group in netcdf_groups(file, "/"):
            known |= {prefix + name for name in group.variables}
            described = {other for v in group.variables.values() for name in ("bounds", "coordinates", "grid_mapping")
                         if name in v.ncattrs() for other in str(v.getncattr(name)).split()}
            variables.update({prefix + name: v for name, v in group.variables.items() if is_real(v.dtype) and
                              name not in v.dimensions and name not in described and v.ndim >= 2})
        deepest = max([v.ndim for v in variables.values()], default=0)
        found = {name: text_of(name, v.shape, v.dtype) for name, v in variables.items() if v.ndim >= min(deepest, 3)}
        if options.dataset:
            found.update({name: name for name in variables if name == "/" + options.dataset.strip("/")})
        left_out = netcdf_left_out(path, known)
        name = choose(path, {**found, **left_out}, options.dataset, "variable")
        if name in left_out:
            file.close()
            options.dataset = name
            return read_hdf5(path, options)
        variable = file[name]
        classic_length(path)
        dtype = np.dtype(variable.dtype)
        coordinates = []
        for dim in variable.get_dims():
            coordinate = dim.group().variables.get(dim.name)
            fits = coordinate is not None and coordinate.ndim == 1 and is_real(coordinate.dtype) and coordinate is not variable
            coordinates.append((coordinate[:], plain(coordinate.__dict__)) if fits else None)
        axes = named_axes(path, variable.dimensions, [c[1] if c else {} for c in coordinates], variable.shape, options)
        chunks = variable.chunking()
        return described_image("netCDF", path, axes, coordinates, dtype, variable.__getitem__, plain(variable.__dict__),
                               chunks[0] if isinstance(chunks, list) else 1)


def netcdf_groups(group, prefix):
    """The groups of a file with their names."""
    yield prefix, group
    for name, child in group.groups.items():
        yield from netcdf_groups(child, f"{prefix}{name}/")


def netcdf_left_out(path, known):
    """Arrays that the netCDF library does not show, because netCDF has no such type: truth values."""
    with open(path, "rb") as file:
        if file.read(4) != b"\x89HDF":
            return {}
    try:
        import h5py
    except ImportError:
        return {}
    found = {}
    with h5py.File(path, "r") as file:
        file.visititems(lambda name, item: found.update({f"/{name}": text_of(f"/{name}", item.shape, item.dtype.name)})
                        if isinstance(item, h5py.Dataset) and item.ndim >= 3 and f"/{name}" not in known else None)
    return found


CLASSIC_SIZES = {1: 1, 2: 1, 3: 2, 4: 4, 5: 4, 6: 8, 7: 1, 8: 2, 9: 4, 10: 8, 11: 8}


def classic_length(path):
    """Checks the length of a file of the classic format, because the library takes what is missing for zeros."""
    with open(path, "rb") as file:
        magic = file.read(4)
        if magic[:3] != b"CDF" or magic[3] not in (1, 2, 5):
            return

        def whole(long=magic[3] == 5):
            data = file.read(8 if long else 4)
            return struct.unpack(">Q" if long else ">I", data)[0]

        def text():
            length = whole()
            file.seek(-(-length // 4) * 4, 1)

        def attributes():
            whole(False)
            for _ in range(whole()):
                text()
                size = CLASSIC_SIZES[whole(False)]
                file.seek(-(-whole() * size // 4) * 4, 1)

        records, dimensions, variables = whole(), [], []
        whole(False)
        for _ in range(whole()):
            text()
            dimensions.append(whole())
        attributes()
        whole(False)
        for _ in range(whole()):
            text()
            shape = [dimensions[whole()] for _ in range(whole())]
            attributes()
            size = CLASSIC_SIZES[whole(False)]
            whole()
            begin = whole(magic[3] != 1)
            variables.append((shape, size, begin))
        of_records = [product(shape[1:]) * size for shape, size, _ in variables if shape and shape[0] == 0]
        stride = sum(-(-n // 4) * 4 for n in of_records) if len(of_records) > 1 else sum(of_records)
        end = file.tell()
        for shape, size, begin in variables:
            if shape and shape[0] == 0:
                if records not in (0, 2 ** 32 - 1, 2 ** 64 - 1):
                    end = max(end, begin + (records - 1) * stride + product(shape[1:]) * size)
            else:
                end = max(end, begin + product(shape) * size)
    require_bytes(path, end, os.path.getsize(path), "the file")


# -- Zarr ----------------------------------------------------------------------------------------------------------
def is_zarr(folder):
    names = set(os.listdir(folder))
    return bool(names & {".zgroup", ".zarray", "zarr.json"}) or str(folder).rstrip("/").endswith(".zarr")


def read_zarr(path, options):
    zarr = need("zarr", "python3-zarr", path, "Zarr")
    with reading(path, "Zarr"):
        if os.path.isdir(path):
            refuse_other_zarr(path)
            store = zarr.DirectoryStore(path)
        else:
            store = zarr.ZipStore(path, mode="r")
        root = zarr.open(store, mode="r")
        images = {"/": root} if isinstance(root, zarr.Array) else zarr_images(zarr, root)
        found = {name: zarr_text(zarr, name, item) for name, item in images.items()}
        wanted = options.dataset
        if wanted is None and "/" in images:
            wanted = "/"  # beside an image of OME there may be its labels
        level = None
        if wanted is not None and wanted.strip("/") and not any(name.strip("/") == wanted.strip("/") for name in images):
            parent, _, level = wanted.strip("/").rpartition("/")  # a level of an image of OME
            if any(name.strip("/") == parent and "multiscales" in item.attrs for name, item in images.items()) and \
                    isinstance(root.get(wanted.strip("/")), zarr.Array):
                wanted = "/" + parent
        name = choose(path, found, wanted, "array")
        item = images[name]
        image = ome_zarr(zarr, path, item, level, options) if "multiscales" in item.attrs else plain_zarr(path, item, options)
        if len(found) > 1 and options.dataset is None:
            image.notes.append(f"the file has also: {', '.join(text for other, text in found.items() if other != name)}")
    return image


def refuse_other_zarr(path):
    """Zarr 2.13 does not know Zarr 3, and takes its folders for empty ones."""
    for folder, folders, files in os.walk(path):
        if "zarr.json" in files:
            raise esvr.BadInput(f"{path} is a Zarr folder of version 3, which is not read; save it as version 2 (OME-Zarr 0.4)")
        if ".zarray" in files:
            folders.clear()
        folders[:] = [name for name in folders if not name.isdigit() or os.path.exists(os.path.join(folder, name, ".zgroup"))
                      or os.path.exists(os.path.join(folder, name, ".zarray")) or
                      os.path.exists(os.path.join(folder, name, "zarr.json"))]
    if not {".zgroup", ".zarray"} & set(os.listdir(path)):
        raise esvr.BadInput(f"{path} is no Zarr folder: it has no .zgroup and no .zarray")


def zarr_images(zarr, group, prefix="/"):
    """Images of OME and, outside of them, arrays."""
    found = {}
    if "multiscales" in group.attrs:
        found[prefix] = group
    levels = {d.get("path") for m in group.attrs.get("multiscales", []) for d in m.get("datasets", [])}
    for name in group:
        if name in levels:
            continue
        item = group[name]
        if isinstance(item, zarr.Array):
            if item.ndim >= 3 and is_real(item.dtype):
                found[f"{prefix.rstrip('/')}/{name}"] = item
        else:
            found.update(zarr_images(zarr, item, f"{prefix.rstrip('/')}/{name}"))
    return found


def zarr_text(zarr, name, item):
    return text_of(name, item.shape, item.dtype) if isinstance(item, zarr.Array) else f"{name} (OME-Zarr)"


def plain_zarr(path, array, options):
    """An array; xarray names its dimensions, whose coordinates are arrays of their names."""
    names = array.attrs.get("_ARRAY_DIMENSIONS")
    warnings = check_chunks(path, array)
    if not names or len(names) != array.ndim:
        axes, coordinates = unnamed_axes(path, array.shape, options), [None] * array.ndim
    else:
        coordinates = []
        for name in names:
            scale = zarr_sibling(array, name)
            coordinates.append((scale[...], plain(scale.attrs.asdict())) if scale is not None else None)
        axes = named_axes(path, names, [c[1] if c else {} for c in coordinates], array.shape, options)
    image = described_image("Zarr", path, axes, coordinates, array.dtype, array.__getitem__, plain(array.attrs.asdict()),
                            array.chunks[0])
    image.warnings += warnings
    return image


def zarr_sibling(array, name):
    import zarr
    parent = array.path.rpartition("/")[0]
    try:
        scale = zarr.open_array(array.store, path=f"{parent}/{name}".strip("/"), mode="r")
    except Exception:  # dimensions need no coordinates
        return None
    return scale if scale.ndim == 1 and scale.dtype.kind in "iuf" and scale.path != array.path else None


def ome_zarr(zarr, path, group, level, options):
    """A level of an image of OME (versions 0.1 to 0.4), by default the finest one."""
    scales = group.attrs["multiscales"]
    if len(scales) > 1:
        raise esvr.BadInput(f"{path} has {len(scales)} images of several levels in one group, which is not read")
    datasets = {d["path"]: d for d in scales[0]["datasets"]}
    dataset = datasets[level] if level in datasets else next(iter(datasets.values()))
    array = group[dataset["path"]]
    described = scales[0].get("axes") or list("tczyx"[-array.ndim:])
    described = [d if isinstance(d, dict) else {"name": d} for d in described]
    if len(described) != array.ndim:
        raise esvr.BadInput(f"{path} names {len(described)} axes for an array of {array.ndim}")
    warnings = check_chunks(path, array)
    steps, firsts = np.ones(array.ndim), np.zeros(array.ndim)
    for transform in dataset.get("coordinateTransformations", []) + scales[0].get("coordinateTransformations", []):
        kind = transform.get("type")
        if kind not in ("identity", "scale", "translation") or kind not in transform and kind != "identity":
            raise esvr.BadInput(f"{path} has a coordinate transformation of type {kind} that is not read")
        numbers = np.array(transform.get(kind, np.zeros(array.ndim)), float)
        if kind == "scale":
            steps, firsts = steps * numbers, firsts * numbers
        elif kind == "translation":
            firsts = firsts + numbers
    if options.axes:
        axes = axes_from_letters(options.axes, array.shape, path)
    else:
        kinds = [{"time": TIME, "channel": CHANNEL}.get(d.get("type"), kind_named(d["name"])) for d in described]
        axes = [Axis(kind, n, d["name"]) for kind, n, d in zip(kinds, array.shape, described)]
    affine, unit = affine_of_steps(axes, [(s, f, d.get("unit")) for s, f, d in zip(steps, firsts, described)])
    block = next((n for n, axis in zip(array.chunks, axes) if axis.kind in SPACE), 1)
    image = Image("OME-Zarr", path, axes, array.dtype, array.__getitem__, affine, unit, block=block, warnings=warnings)
    labels = [str(c.get("label") or "") for c in group.attrs.get("omero", {}).get("channels", [])]
    if image.axis(CHANNEL) and len(labels) == image.axis(CHANNEL).size and any(labels):
        image.axis(CHANNEL).labels = labels
    return image


def check_chunks(path, array):
    """A chunk that is not where it is looked for counts as fill value, so all of them must be there in one layout."""
    separator = array._dimension_separator or "."
    if os.path.isdir(path) and array.ndim > 1:
        names = os.listdir(os.path.join(path, array.path))
        others = [n for n in names if re.fullmatch(r"\d+(\.\d+)+", n)] if separator == "/" else [
            n for n in names if n.isdigit() and os.path.isdir(os.path.join(path, array.path, n))]
        if others:
            there, said = ("0.0.0", "0/0/0") if separator == "/" else ("0/0/0", "0.0.0")
            raise esvr.BadInput(f"{path}: the chunks are stored as {there}, and .zarray says that they are {said}; correct its "
                                f"dimension_separator to '{'.' if separator == '/' else '/'}'")
    if os.path.isdir(path) and getattr(array.compressor, "codec_id", "") == "blosc":
        check_blosc(path, array)
    stored = array.nchunks_initialized
    if stored < array.nchunks and array.fill_value is None:
        raise esvr.BadInput(f"{path}: {array.nchunks - stored} of {array.nchunks} chunks are missing, and no fill value is named")
    missing = array.nchunks - stored
    return [f"{missing} of {array.nchunks} chunks are not stored, and have the fill value {array.fill_value}"] if missing else []


def check_blosc(path, array):
    """Blosc reads beyond the end of a chunk that is cut short; the length is in its header."""
    for folder, _, names in os.walk(os.path.join(path, array.path)):
        for name in names:
            if name.startswith("."):
                continue
            with open(os.path.join(folder, name), "rb") as file:
                head = file.read(16)
                there = os.fstat(file.fileno()).st_size
            if len(head) < 16 or int.from_bytes(head[12:16], "little") != there:
                raise esvr.BadInput(f"{path}: the chunk {os.path.relpath(os.path.join(folder, name), path)} is cut short or damaged")
