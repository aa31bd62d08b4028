"""Exchange with xarray.DataArray and with masked arrays of NumPy.

NumPy, xarray, and the modules of images with their rules for axes, are imported where they are needed, so that esvr starts
without them.
"""
import sys
import warnings

from ._core import UsageError, Volume

SPACE = "xyz"
# The attribute long_name of coordinates that are no places in the world.
INDEX = "index of the voxel"
# The attribute of coordinates in the world that has the size of voxels along them, with a sign, so that they belong to a matrix.
VOXEL = "voxel_size"


def axes_of(array):
    """The axis of space of each dimension, by the attributes of its coordinates (CF conventions) or its name. Dimensions that
    are not known are the axes that are left, the last dimension first."""
    from .images.read_science import kind_of_dimension
    names = [str(name) for name in array.dims]
    if array.ndim != 3:
        raise UsageError(f"the array has the dimensions {', '.join(names)}, and a volume has three axes of space; select one "
                         "place of the others (array.isel, array.sel)")
    kinds = [kind_of_dimension(array.coords[name].attrs if name in array.coords else {}, str(name)) for name in array.dims]
    if kinds.count("y") > 1:  # the height of an image is its axis y, but beside latitudes it is z
        kinds = ["z" if name.lower() == "height" else kind for name, kind in zip(names, kinds)]
    for at in reversed(range(3)):
        kinds[at] = kinds[at] or next((axis for axis in SPACE if axis not in kinds), "")
    if sorted(kinds) != list(SPACE):
        wrong = [f"{name} means {kind}" for name, kind in zip(names, kinds) if kind not in SPACE]
        for axis in SPACE:
            same = [name for name, kind in zip(names, kinds) if kind == axis]
            wrong += [f"{' and '.join(same)} both mean {axis}"] * (len(same) > 1)
        raise UsageError(f"the dimensions {', '.join(names)} are not the three axes of space: {', '.join(wrong)} (by the names or by "
                         "attributes of the coordinates); select one place of the others (array.isel, array.sel), or rename them to "
                         "x, y and z (array.rename)")
    return kinds


def require_array(array):
    """Refuses what is no DataArray, and one without elements."""
    xarray = sys.modules.get("xarray")  # whoever has a DataArray has loaded it
    if xarray is None or not isinstance(array, xarray.DataArray):
        found = f"{type(array).__module__}.{type(array).__qualname__}"
        way = ": take one of its arrays by its name" if hasattr(array, "data_vars") else \
            "; Volume.from_numpy takes arrays without names of dimensions" if hasattr(array, "__array__") else ""
        raise TypeError(f"Volume.from_xarray needs an xarray.DataArray, not {found}{way}")
    if array.size == 0:
        shape = ", ".join(f"{name}: {size}" for name, size in array.sizes.items())
        raise UsageError(f"the array has no elements ({shape})")


def step_along(array, name, notes):
    """The step, the first place and the unit of the coordinates of a dimension; voxels are counted where there are none, and with a
    note where their steps differ."""
    from .images.read_science import step_of
    if name not in array.coords:
        return 1.0, 0.0, None
    coordinate = array.coords[name]
    if coordinate.dtype.kind not in "iuf":
        raise UsageError(f"the coordinates of the dimension {name} are of type {coordinate.dtype}, and no numbers")
    unit = {"units": coordinate.attrs["units"]} if "units" in coordinate.attrs else {}
    return step_of(coordinate.values, unit, name, notes)


def turned_round(array, name, step, first):
    """The array with the elements of a dimension in the opposite order, with the step and the first place that it has then."""
    return array.isel({name: slice(None, None, -1)}), -step, first + step * (array.sizes[name] - 1)


def placed_by_coordinates(array):
    """The array with rising coordinates, the matrix that they mean, and metadata with their units."""
    from .images.image import Axis, affine_of_steps
    steps, notes = [], []
    for name in array.dims:
        if name in array.coords and array.coords[name].attrs.get("long_name") == INDEX:
            raise UsageError(
                f"the coordinates of the dimension {name} are indices of voxels, and the attribute transform, which says where these "
                "are in the world, is missing: operations of xarray drop attributes unless xarray.set_options(keep_attrs=True); give "
                "the array the attribute again, or drop the coordinates to count voxels (array.drop_vars)")
        step, first, unit = step_along(array, name, notes)
        if name in array.coords and array.sizes[name] == 1 and isinstance(array.coords[name].attrs.get(VOXEL), float):
            step = array.coords[name].attrs[VOXEL]  # one place has no step
        if step < 0:
            array, step, first = turned_round(array, name, step, first)
        steps.append((step, first, unit))
    for note in notes:
        warnings.warn(note, stacklevel=4)
    matrix, unit = affine_of_steps([Axis(axis, size) for axis, size in zip(SPACE, array.shape)], steps)
    if unit:
        return array, matrix, {"length_unit": unit}
    units = [step[2] for step in steps]
    return array, matrix, {"image_axis_units": ", ".join(unit or "1" for unit in units)} if any(units) else {}


def contradiction(name, why):
    return UsageError(f"the coordinates of the dimension {name} contradict the attribute transform of the array: {why}; where the "
                      "coordinates are right, remove the attribute (del array.attrs['transform'])")


def matrix_in(array):
    """The 4 x 4 matrix of the attribute transform."""
    import numpy as np
    try:
        numbers = np.asarray(array.attrs["transform"], np.float64)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.size != 16 or not np.all(np.isfinite(numbers)):
        raise UsageError("the attribute transform of the array must have 16 numbers, the 4 x 4 matrix from index to world "
                         "coordinates row by row; without the attribute (del array.attrs['transform']), the coordinates say where "
                         "the voxels are")
    return numbers.reshape(4, 4)


def is_plain(matrix):
    """True if the matrix only scales and shifts, so that coordinates along the axes are those of the world."""
    import numpy as np
    return np.array_equal(matrix[:3, :3], np.diag(np.diag(matrix[:3, :3]))) and np.all(np.diag(matrix))


def indices_along(array, name, scale, shift, is_ours):
    """The step and the first of the indices of voxels along a dimension, whose places are index * scale + shift. Every n-th element
    (array[::2]) and averages of n elements (array.coarsen) have steps of n, which only coordinates of to_xarray may have, because
    others can be those of another matrix."""
    notes = []
    step, first, _ = step_along(array, name, notes)
    if notes:
        raise contradiction(name, notes[0])
    if array.sizes[name] == 1:
        step = scale
    count, index = step / scale, (first - shift) / scale
    precision = 1e-3 + 4e-7 * abs(first / scale)  # coordinates of float32 are as precise as this
    whole = round(count)
    if whole == 0 or abs(count - whole) > 1e-3 * abs(count) or not (is_ours or abs(whole) == 1):
        raise contradiction(name, f"their step is {step:.6g}, and that of voxels {scale:.6g}")
    between = (abs(whole) - 1) / 2  # the middle of the elements of an average
    nearest = min((round(index), round(index - between) + between), key=lambda place: abs(index - place))
    if abs(index - nearest) > precision or abs(nearest) >= 2**31:
        raise contradiction(name, f"they begin at {first:.6g}, where no voxel is")
    return whole, nearest


def placed_by_attribute(array):
    """The array, the matrix of its attribute transform, the index of its first voxel, and metadata with the unit. The coordinates
    are places in the world, or, where the matrix turns or shears, indices of voxels."""
    import numpy as np
    from .images.image import unit_named
    matrix = matrix_in(array)
    counts, origin, units = np.ones(4), [], {array.attrs.get("length_unit")}
    for axis, name in enumerate(array.dims):
        attributes = array.coords[name].attrs if name in array.coords else {"long_name": INDEX}
        is_index = not is_plain(matrix) or attributes.get("long_name") == INDEX
        if is_index and "units" in attributes:
            raise contradiction(name, f"they are in {attributes['units']}, and must be indices of voxels")
        scale, shift = (1.0, 0.0) if is_index else (matrix[axis, axis], matrix[axis, 3])
        is_ours = attributes.get("long_name") == INDEX or attributes.get(VOXEL) == scale
        count, first = indices_along(array, name, scale, shift, is_ours)
        if count < 0:
            array, count, first = turned_round(array, name, count, first)
        counts[axis] = count
        origin.append(first)
        units.add(attributes.get("units"))
    units.discard(None)
    if len(units) > 1:
        raise UsageError(f"the coordinates have several units ({', '.join(sorted(units))}), and the attribute transform has one; "
                         "remove the attribute (del array.attrs['transform']) to take the coordinates")
    if np.any(counts != 1):  # the voxels of the array are not those of the matrix
        larger = np.diag(counts)
        larger[:3, 3] = origin
        matrix, origin = matrix @ larger, (0, 0, 0)
    unit = unit_named(units.pop()) if units else None
    return array, matrix, tuple(int(index) for index in origin), {"length_unit": unit} if unit else {}


def volume_of(array, *, background=0.0, threshold=None, name=None, grid_class="fog volume", nonfinite="refuse"):
    """Makes a volume of an xarray.DataArray of three dimensions of space, in any order.

    Coordinates become the transform, which scales and shifts; where they fall, the array is turned round, and where their steps
    differ, voxels are counted (with a warning). The attribute transform that to_xarray writes is the transform instead; an array
    whose coordinates contradict it is refused. Elements that are NaN are missing: they become inactive voxels, which have the
    background; nonfinite='keep' keeps infinities. All other elements are active, or, with a threshold, those that differ from the
    background by more than that. Units are kept in the metadata: value_unit, length_unit, and image_axis_units where the axes have
    no common unit of length.
    """
    import numpy as np
    require_array(array)
    kinds = axes_of(array)
    array = array.transpose(*(array.dims[kinds.index(axis)] for axis in SPACE))
    origin = (0, 0, 0)
    if "transform" in array.attrs:
        array, matrix, origin, units = placed_by_attribute(array)
    else:
        array, matrix, units = placed_by_coordinates(array)
    values = np.asarray(array.values)
    missing = np.isnan(values) if values.dtype.kind == "f" else np.zeros(values.shape, bool)
    metadata = {"value_unit": str(array.attrs["units"])} if "units" in array.attrs else {}
    return Volume.from_numpy(np.ma.array(values, mask=missing), background=background, threshold=threshold or 0.0,
                             active=~missing if threshold is None else None, transform=matrix, origin=origin,
                             name=str(name or array.name or "density"), grid_class=grid_class, metadata={**metadata, **units},
                             nonfinite=nonfinite)


def masked_of(self, box=None):
    """The voxels of a box as a masked array of NumPy, of shape (nx, ny, nz): inactive voxels are masked. Volume.from_numpy takes
    such an array; with active=~array.mask, voxels that have the value of the background stay active."""
    import numpy as np
    return np.ma.MaskedArray(self.to_numpy(box), mask=~self.active(box), fill_value=self.background)


def array_of(self, box=None, *, masked=True):
    """An xarray.DataArray with the dimensions x, y and z (Debian and Ubuntu: python3-xarray).

    Inactive voxels are NaN, or have the background if masked is false. Coordinates are those of the world if the transform scales
    and shifts only, else indices of voxels, and the attribute transform has the 4 x 4 matrix, row by row. Volume.from_xarray
    takes both. A frustum has no matrix and is left out, with a warning.
    """
    import numpy as np
    import xarray
    box = box or self.box or ((0, 0, 0), (0, 0, 0))
    values = self.to_numpy(box)
    if masked:
        values = np.where(self.active(box), values, np.float32(np.nan))
    matrix, metadata = self.transform, self.metadata
    unit = {"units": metadata["length_unit"]} if "length_unit" in metadata else {}
    attributes = {"units": metadata["value_unit"]} if "value_unit" in metadata else {}
    places = [np.arange(low, high + 1, dtype=np.float64) for low, high in zip(*box)]
    if matrix is None:
        warnings.warn(f"the transform of '{self.name}' is a frustum, which an array of xarray does not hold: its coordinates are "
                      "indices of voxels", stacklevel=3)
    else:
        attributes["transform"] = matrix.ravel().tolist()
    if matrix is not None and is_plain(matrix):
        places = [matrix[axis, axis] * place + matrix[axis, 3] for axis, place in enumerate(places)]
        abouts = [{**unit, VOXEL: float(matrix[axis, axis])} for axis in range(3)]
    else:
        abouts = [{"long_name": INDEX}] * 3
        attributes.update({"length_unit": text for text in unit.values()})
    return xarray.DataArray(values, dims=tuple(SPACE), name=self.name, attrs=attributes, coords={
        axis: (axis, place, about) for axis, place, about in zip(SPACE, places, abouts)})
