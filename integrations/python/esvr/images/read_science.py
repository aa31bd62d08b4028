"""Readers of HDF5 and netCDF."""
import os

import numpy as np

import esvr

from .image import CHANNEL, SPACE, TIME, Axis, Image, affine_of, axes_from_letters, factor, kind_named, missing_if_any, need, \
    product, reading, require_bytes, unit_named, values_equal
from .read_volumes import unnamed_axes


def choose(path, found, dataset, what):
    """One of the arrays of a file; found has their texts by their names."""
    if dataset:
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


# -- HDF5 ----------------------------------------------------------------------------------------------------------
def hdf5_names(dataset):
    """The names of the axes by dimension scales or labels; empty ones where the file does not say."""
    names = []
    for dim in dataset.dims:
        name = dim.label
        if not name and len(dim):
            name = dim[0].name.rpartition("/")[2]
        names.append(name or "")
    return names


def read_hdf5(path, options):
    h5py = need("h5py", "python3-h5py", path, "HDF5")
    with reading(path, "HDF5"):
        file = h5py.File(path, "r")
        found = {}

        def visit(name, item):
            if isinstance(item, h5py.Dataset) and item.dtype.kind in "iufb" and item.ndim >= 3 and item.size:
                found[f"/{name}"] = text_of(f"/{name}", item.shape, item.dtype.name)
        file.visititems(visit)
        if options.dataset and isinstance(file.get(options.dataset), h5py.Dataset):
            found.setdefault("/" + options.dataset.strip("/"), "")
        name = choose(path, found, options.dataset, "dataset")
        dataset = file[name]
        if dataset.dtype.kind not in "iufb":
            raise esvr.BadInput(f"{path}: the dataset {name} holds {dataset.dtype}, and images hold real numbers")
        if dataset.chunks is None and dataset.id.get_offset() is not None:
            require_bytes(path, product(dataset.shape) * dataset.dtype.itemsize, os.path.getsize(path) - dataset.id.get_offset(),
                          f"the dataset {name}")
        names = hdf5_names(dataset)
        if options.axes or not all(names):
            axes = unnamed_axes(path, dataset.shape, options)
        else:
            axes = [Axis(kind_named(label), n, label) for label, n in zip(names, dataset.shape)]
        sizes = dataset.attrs.get("element_size_um")
        spacing, unit = [1.0, 1.0, 1.0], None
        if sizes is not None and np.size(sizes) == 3:
            spacing, unit = [abs(float(s)) or 1.0 for s in np.ravel(sizes)[::-1]], "um"
        block = dataset.chunks[0] if dataset.chunks else 1
    return Image("HDF5", path, axes, dataset.dtype, dataset.__getitem__, affine_of(spacing), unit, block=block)


# -- netCDF --------------------------------------------------------------------------------------------------------
LENGTH_NAMES = {"projection_x_coordinate": "x", "projection_y_coordinate": "y", "longitude": "x", "latitude": "y",
                "altitude": "z", "height": "z", "depth": "z", "time": TIME, "grid_longitude": "x", "grid_latitude": "y"}


def read_netcdf(path, options):
    xarray = need("xarray", "python3-xarray", path, "netCDF")
    need("netCDF4", "python3-netcdf4", path, "netCDF")
    with reading(path, "netCDF"):
        group, _, wanted = (options.dataset or "").strip("/").rpartition("/")
        data = xarray.open_dataset(path, engine="netcdf4", mask_and_scale=False, decode_times=False, decode_timedelta=False,
                                   decode_coords=False, group=group or None)
        every = {**data.data_vars, **data.coords}
        found = {n: text_of(n, v.shape, v.dtype) for n, v in every.items()
                 if v.dtype.kind in "iuf" and v.ndim >= (1 if n == wanted else 2) and (n not in data.dims)
                 and (v.ndim >= 3 or n == wanted)}
        if not found and os.path.getsize(path) > 8:
            found = {n: text_of(n, v.shape, v.dtype) for n, v in data.data_vars.items() if v.ndim == 2 and v.dtype.kind in "iuf"}
    left_out = netcdf_left_out(path)
    if left_out and not found:
        raise esvr.UsageError(f"{path} has no image that netCDF reads in this group, but also: {', '.join(left_out)}; "
                              "name one by --dataset")
    name = choose(path, found, wanted, "variable")
    with reading(path, "netCDF"):
        variable = every[name]
        names = [str(dim) for dim in variable.dims]
        kinds = [netcdf_kind(every.get(dim), dim) for dim in names]
        if options.axes:
            axes = axes_from_letters(options.axes, variable.shape, path)
        else:
            axes = [Axis(kind, n, dim) for kind, n, dim in zip(complete(kinds), variable.shape, names)]
        affine, unit, notes = netcdf_space(every, axes, names)
        attributes = variable.attrs
        dtype = variable.dtype
        if str(attributes.get("_Unsigned", "")).lower() == "true" and dtype.kind == "i":
            dtype = np.dtype(f"u{dtype.itemsize}").newbyteorder(dtype.byteorder)

        def fetch(index):
            numbers = np.asarray(variable[index].values)
            return numbers.view(dtype) if dtype != numbers.dtype and dtype.itemsize == numbers.dtype.itemsize else numbers
        missing = netcdf_missing(attributes, dtype)
        slope, intercept = float(attributes.get("scale_factor", 1.0)), float(attributes.get("add_offset", 0.0))
    image = Image("netCDF", path, axes, dtype, fetch, affine, unit, missing=missing, notes=notes,
                  scale=None if (slope, intercept) == (1.0, 0.0) else (slope, intercept))
    image.may_miss = any(key in attributes for key in ("_FillValue", "missing_value", "valid_range", "valid_min", "valid_max"))
    if "units" in attributes:
        image.metadata["value_unit"] = str(attributes["units"])
    return image


def netcdf_left_out(path):
    """Arrays that netCDF does not show: those of groups, and of types that it does not have."""
    try:
        import h5py
        with h5py.File(path, "r") as file:
            names = []
            file.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) and item.ndim >= 3 and (
                "/" in name or item.dtype.kind in "bc") else None)
            return names
    except (ImportError, OSError):
        return []


def netcdf_kind(coordinate, name):
    """The meaning of a dimension by its coordinate variable, or else by its name; "" if it is not known."""
    attributes = coordinate.attrs if coordinate is not None else {}
    axis = str(attributes.get("axis", "")).lower()
    if axis in ("x", "y", "z", "t"):
        return TIME if axis == "t" else axis
    if attributes.get("standard_name") in LENGTH_NAMES:
        return LENGTH_NAMES[attributes["standard_name"]]
    units = str(attributes.get("units", ""))
    if " since " in units:
        return TIME
    if units.startswith("degree"):
        return "x" if units.endswith(("east", "E")) else "y" if units.endswith(("north", "N")) else ""
    if "positive" in attributes:
        return "z"
    kind = kind_named(name)
    return kind if kind in SPACE or kind in (TIME, CHANNEL) else ""


def complete(kinds):
    """Dimensions that are not known are those of space that are left, the last ones first, and names of their own."""
    kinds = list(kinds)
    free = [kind for kind in SPACE if kind not in kinds]
    for at in range(len(kinds) - 1, -1, -1):
        if not kinds[at]:
            kinds[at] = free.pop(0) if free else f"axis{at}"
    return kinds


def netcdf_space(every, axes, names):
    """The matrix of the coordinates; an axis whose steps differ counts its voxels."""
    spacing, origin, units, notes = np.ones(3), np.zeros(3), [None] * 3, []
    for axis, dim in zip(axes, names):
        if axis.kind not in SPACE:
            continue
        column = SPACE.index(axis.kind)
        coordinate = every.get(dim)
        if coordinate is None or coordinate.ndim != 1 or coordinate.dtype.kind not in "iuf":
            continue
        places = coordinate.values.astype(np.float64)
        places = places * float(coordinate.attrs.get("scale_factor", 1)) + float(coordinate.attrs.get("add_offset", 0))
        steps = np.diff(places)
        # float32 coordinates have steps that differ by their rounding
        even = len(steps) == 0 or np.all(np.abs(steps - steps.mean()) <= 1e-3 * abs(steps.mean()) + 4e-7 * np.abs(places).max())
        if not np.all(np.isfinite(places)) or not even or len(steps) and steps.mean() == 0:
            notes.append(f"the steps of the axis {dim} differ, so that it counts its voxels")
            continue
        units[column] = str(coordinate.attrs.get("units", ""))
        origin[column] = places[0]
        spacing[column] = steps.mean() if len(steps) else 1.0
    lengths = [unit_named(unit) if unit else None for unit in units]
    present = [SPACE.index(axis.kind) for axis in axes if axis.kind in SPACE]
    if present and all(lengths[column] for column in present):
        to = lengths[present[0]]
        for column in present:
            spacing[column] *= factor(lengths[column], to)
            origin[column] *= factor(lengths[column], to)
        return affine_of(spacing, origin), to, notes
    return affine_of(spacing, origin), None, notes


def netcdf_missing(attributes, dtype):
    """Which stored numbers are missing: fill values, and those outside the valid range."""
    values = [v for key in ("_FillValue", "missing_value") if key in attributes for v in np.ravel(attributes[key])]
    if dtype.kind == "f" and "_FillValue" not in attributes:
        values.append(dtype.type(9.969209968386869e36))  # of voxels that were never written
    by_value = missing_if_any([v.item() if hasattr(v, "item") else v for v in values])
    low, high = np.ravel(attributes["valid_range"]) if "valid_range" in attributes else (
        attributes.get("valid_min"), attributes.get("valid_max"))

    def missing(numbers):
        gone = by_value(numbers) if by_value else None
        for beyond in ([numbers < low] if low is not None else []) + ([numbers > high] if high is not None else []):
            gone = beyond if gone is None else gone | beyond
        return gone
    return missing if values or low is not None or high is not None else None
