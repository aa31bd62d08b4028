# A field of a model with missing values: from xarray to a small file with a relative bound, and back to xarray.
#
#     python3 weather_scientist.py cloud.vdb
#
# The field is made of a volume, so that the example needs no file of a model; with one, the second cell begins with
# xarray.open_dataset("model.nc")["qc"].isel(time=0). It needs xarray (Debian and Ubuntu: python3-xarray). The cells (# %%) run
# one after the other in Jupyter, Spyder or VS Code. Without an argument, the volume is cloud.vdb.

# %% Cloud water on levels, latitudes and longitudes. Below the ground there is none: NaN.
import sys

import numpy as np
import xarray

import esvr

cloud = esvr.Volume.from_vdb(sys.argv[1] if len(sys.argv) > 1 else "cloud.vdb").to_xarray(masked=False)
size = cloud.sizes
field = xarray.DataArray(
    cloud.values.transpose(2, 1, 0), dims=("height", "latitude", "longitude"), name="qc", attrs={"units": "g kg-1"},
    coords={"height": ("height", 50.0 * np.arange(size["z"]), {"units": "m"}),
            "latitude": ("latitude", 60.0 - 0.02 * np.arange(size["y"]), {"units": "degrees_north"}),
            "longitude": ("longitude", 5.0 + 0.02 * np.arange(size["x"]), {"units": "degrees_east"})})
field = field.where(field.height > 100)
print(field.sizes, f"{float(field.isnull().mean()):.1%} missing")

# %% A volume: coordinates become the transform, the axis that falls is turned round, and missing values are inactive voxels.
# Their background is a value that no element has, so that a lossy file tells them from zeros.
volume = esvr.Volume.from_xarray(field, background=-1.0)
print(volume, volume.metadata, sep="\n")
assert volume.active_voxels == int(field.notnull().sum())

# %% Values within 1 % of each value, and within 0.01 % of the largest one where values are small. The file needs no xarray.
floor = 0.01 * float(field.max())
stored = esvr.fit(volume, max_relative_error=0.01, relative_floor=floor, measure="values", effort=2)
print(stored, f"{4 * field.size / stored.bytes:.1f} times smaller than float32")

# %% Back in xarray, by the same coordinates.
back = stored.to_volume().to_xarray()
again = back.transpose("z", "y", "x").values[:, ::-1]  # latitudes that fall, as in the field
there = field.sel(height=slice(150, None)).values
bound = 0.01 * np.maximum(np.abs(there), floor)
assert back.attrs["units"] == "g kg-1" and back.z.values[0] == 150.0
assert np.all(np.abs(again - there) <= bound * (1 + 1e-5))
print(back.sizes, back.attrs)

# %% The total over the column, which is what many statistics need.
column = (field.fillna(0).sum("height"), back.fillna(0).sum("z"))
print(f"total: {float(column[0].sum()):.6g} before, {float(column[1].sum()):.6g} after")
assert abs(float(column[1].sum() / column[0].sum()) - 1) < 0.01
