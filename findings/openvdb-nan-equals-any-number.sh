#!/usr/bin/env bash
# OpenVDB's prune() and copyFromArray() take a NaN to be equal to any number, and change voxels beside it.
#
# Version:   OpenVDB 10.0.1-2 (Debian 12), through python3-openvdb.
# Input:     a grid of one leaf: (a) 512 voxels of 5 and a NaN in the middle, (b) the numbers 1 to 512 with a NaN in place of
#            the first one; and (c) an array of the numbers 1 to 512 with a NaN in place of the last one.
# Expected:  prune() without a tolerance replaces leaves whose voxels are all equal, and changes no value; copyFromArray()
#            copies every value that differs from the background.
# Observed:  (a) becomes a tile of 5 without the NaN, (b) a tile of 257, the median of its 511 different numbers, and the NaN
#            of (c) is an inactive voxel of the background. Values are compared by !(|a - b| > tolerance), which holds
#            for a NaN.
# Matters:   missing values of scans and of weather data are NaN. A tool that prunes before it writes, as many do, loses
#            them or the numbers beside them without a message. Merge leaves by a comparison of your own (==), and set
#            voxels that are NaN after copyFromArray().
. "$(dirname "$0")/lib/packages.sh"
debian python3-openvdb=10.0.1-2 python3-numpy
cat >"$work/system/tmp/nan.py" <<'P'
import numpy as np
import pyopenvdb as vdb

def pruned(values):
    grid = vdb.FloatGrid()
    accessor = grid.getAccessor()
    for at, value in np.ndenumerate(values):
        accessor.setValueOn(at, float(value))
    grid.prune()
    back = np.zeros((8, 8, 8), np.float32)
    grid.copyToArray(back)
    print(grid.leafCount(), np.isnan(back).sum(), back[7, 7, 7])

five = np.full((8, 8, 8), 5.0)
five[4, 4, 4] = np.nan
pruned(five)
numbers = np.arange(1.0, 513.0).reshape(8, 8, 8)
first = numbers.copy()
first[0, 0, 0] = np.nan
pruned(first)
last = numbers.copy()
last[7, 7, 7] = np.nan
grid = vdb.FloatGrid()
grid.copyFromArray(last)
print(grid.activeVoxelCount(), grid.getAccessor().getValue((7, 7, 7)))
P
mapfile -t seen < <(within python3 /tmp/nan.py)
observe 'leaves, NaN and last value after prune(), 511 equal numbers and a NaN' "${seen[0]}" '0 0 5.0'
observe 'the same of a NaN and 511 different numbers' "${seen[1]}" '0 0 257.0'
observe 'active voxels, and the voxel of the NaN, after copyFromArray()' "${seen[2]}" '511 0.0'
exit $differs
