"""Exchange with xarray.DataArray and with masked arrays of NumPy.

NumPy, xarray, and the modules of images with their rules for axes, are imported where they are needed, so that esvr starts
without them.
"""
import warnings

from ._core import UsageError, Volume

SPACE = "xyz"


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
        shown = ", ".join(f"{name} ({kind or 'not known'})" for name, kind in zip(names, kinds))
        raise UsageError(f"the dimensions {shown} are not the three axes of space; select one place of the others, or rename "
                         "them to x, y and z (array.rename)")
    return kinds


def with_rising_coordinates(array):
    """The array with steps above 0, and the step, the first place and the unit of each axis."""
    from .images.read_science import step_of
    steps, notes = [], []
    for name in array.dims:
        if name not in array.coords:
            steps.append((1.0, 0.0, None))
            continue
        coordinate = array.coords[name]
        if coordinate.dtype.kind not in "iuf":
            raise UsageError(f"the coordinates of the dimension {name} are of type {coordinate.dtype}, and no numbers")
        unit = {"units": coordinate.attrs["units"]} if "units" in coordinate.attrs else {}
        step, first, unit = step_of(coordinate.values, unit, name, notes)
        if step < 0:
            array = array.isel({name: slice(None, None, -1)})
            first, step = first + step * (array.sizes[name] - 1), -step
        steps.append((step, first, unit))
    for note in notes:
        warnings.warn(note, stacklevel=4)
    return array, steps


def volume_of(array, *, background=0.0, threshold=None, name=None, grid_class="fog volume"):
    """Makes a volume of an xarray.DataArray of three dimensions of space, in any order.

    Coordinates become the transform, which scales and shifts; where they fall, the array is turned round, and where their steps
    differ, voxels are counted (with a warning). Elements that are NaN are missing: they become inactive voxels, which have the
    background. All other elements are active, or, with a threshold, those that differ from the background by more than that. Units
    are kept in the metadata: value_unit, length_unit, and image_axis_units where the axes have no common unit of length.
    """
    import numpy as np
    from .images.image import Axis, affine_of_steps
    kinds = axes_of(array)
    array = array.transpose(*(array.dims[kinds.index(axis)] for axis in SPACE))
    array, steps = with_rising_coordinates(array)
    matrix, unit = affine_of_steps([Axis(axis, size) for axis, size in zip(SPACE, array.shape)], steps)
    values = np.asarray(array.values)
    missing = np.isnan(values) if values.dtype.kind == "f" else np.zeros(values.shape, bool)
    metadata = {"value_unit": str(array.attrs["units"])} if "units" in array.attrs else {}
    if unit:
        metadata["length_unit"] = unit
    elif any(step[2] for step in steps):
        metadata["image_axis_units"] = ", ".join(step[2] or "1" for step in steps)
    return Volume.from_numpy(np.ma.array(values, mask=missing), background=background, threshold=threshold or 0.0,
                             active=~missing if threshold is None else None, transform=matrix,
                             name=str(name or array.name or "density"), grid_class=grid_class, metadata=metadata)


def masked_of(self, box=None):
    """The voxels of a box as a masked array of NumPy, of shape (nx, ny, nz): inactive voxels are masked. Volume.from_numpy takes
    such an array; with active=~array.mask, voxels that have the value of the background stay active."""
    import numpy as np
    return np.ma.MaskedArray(self.to_numpy(box), mask=~self.active(box), fill_value=self.background)


def array_of(self, box=None, *, masked=True):
    """An xarray.DataArray with the dimensions x, y and z (Debian and Ubuntu: python3-xarray).

    Inactive voxels are NaN, or have the background if masked is false. Coordinates are those of the world if the transform scales
    and shifts only, else indices of voxels, and the attribute transform has the 4 x 4 matrix, row by row.
    """
    import numpy as np
    import xarray
    first, last = box or self.box or ((0, 0, 0), (0, 0, 0))
    box = (tuple(first), tuple(last))
    values = self.to_numpy(box)
    if masked:
        values = np.where(self.active(box), values, np.float32(np.nan))
    matrix, metadata, attributes = self.transform, self.metadata, {}
    places = [np.arange(low, high + 1, dtype=np.float64) for low, high in zip(*box)]
    is_plain = matrix is not None and np.array_equal(matrix[:3, :3], np.diag(np.diag(matrix[:3, :3])))
    unit = {}
    if is_plain:
        places = [matrix[axis, axis] * place + matrix[axis, 3] for axis, place in enumerate(places)]
        unit = {"units": metadata["length_unit"]} if "length_unit" in metadata else {}
    elif matrix is not None:
        attributes["transform"] = matrix.ravel().tolist()
    if "value_unit" in metadata:
        attributes["units"] = metadata["value_unit"]
    return xarray.DataArray(values, dims=tuple(SPACE), name=self.name, attrs=attributes, coords={
        axis: (axis, place, unit) for axis, place in zip(SPACE, places)})
