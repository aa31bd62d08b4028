# A scan of vessels: is what is measured still the same after compression with a bound on the error of every voxel?
#
#     python3 radiologist.py vessels.vdb
#
# image2vdb turns DICOM, NIfTI and others into .vdb files with their orientation: `image2vdb scan/ vessels.vdb`. The cells (# %%)
# run one after the other in Jupyter, Spyder or VS Code. Without an argument, the scan is vessels.vdb.

# %% The scan, and the size of its voxels in the units of the world.
import sys

import numpy as np

import esvr

scan = esvr.Volume.from_vdb(sys.argv[1] if len(sys.argv) > 1 else "vessels.vdb")
voxel_volume = abs(np.linalg.det(scan.transform[:3, :3]))
low, high = scan.value_range
print(scan, scan.metadata, sep="\n")

# %% Every voxel keeps its value within 1 % of the range. This is checked before a file is written.
stored = esvr.fit(scan, max_error=0.01 * (high - low), effort=3)
quality = esvr.compare(scan, stored)
print(stored, quality, sep="\n")
assert quality.max_error <= 0.01 * (high - low)

# %% The volume of what is brighter than a threshold, before and after. Masked arrays leave out what is not in the scan.
threshold = low + 0.5 * (high - low)
before, after = scan.to_masked(), stored.to_volume().to_masked(scan.box)
volumes = [float((array > threshold).sum()) * voxel_volume for array in (before, after)]
print(f"volume above {threshold:.4g}: {volumes[0]:.6g} before, {volumes[1]:.6g} after")
assert abs(volumes[1] - volumes[0]) <= 0.05 * volumes[0]

# %% A maximum intensity projection, which shows vessels without any transfer function.
projection = before.filled().max(axis=2)
assert np.abs(projection - after.filled().max(axis=2)).max() <= 0.0101 * (high - low)
print(f"projection of {projection.shape[0]} x {projection.shape[1]} pixels")

# %% A part of the scan alone: only what reaches the box is read and decoded.
esvr.write("scan.esvr", [stored], overwrite=True)
first = np.array(scan.box[0])
box = (tuple(first.tolist()), tuple((first + 15).tolist()))
part = esvr.read("scan.esvr", box=box).grids[0].to_volume(box)
assert np.array_equal(part.to_numpy(box), stored.to_volume().to_numpy(box))
print(part)
