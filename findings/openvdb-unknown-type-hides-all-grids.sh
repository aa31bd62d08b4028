#!/usr/bin/env bash
# A grid of a type that OpenVDB does not know makes all other grids of its file unreadable.
#
# Version:   OpenVDB 10.0.1-2 (Debian 12), through python3-openvdb.
# Input:     a file of a float grid "density" and a grid "mask" of the type Tree_half_5_4_3. OpenVDB 13 writes grids of this
#            type (HalfGrid); here the name of the type of a bool grid, which has the same length, is replaced in the file.
# Expected:  "density" can be read, and the metadata of all grids: a file has the position of each grid, so that others
#            can be left out.
# Observed:  each call ends with a LookupError that names the type and no grid, also one that asks for "density".
# Matters:   one such grid in a cache makes all of it unreadable for programs with this version of OpenVDB. Write fields
#            that they need to a file of their own, or as float grids that are saved as half.
. "$(dirname "$0")/lib/packages.sh"
debian python3-openvdb=10.0.1-2
cat >"$work/system/tmp/types.py" <<'P'
import pyopenvdb as vdb

density = vdb.FloatGrid()
density.name = 'density'
density.fill((0, 0, 0), (1, 1, 1), 0.5)
mask = vdb.BoolGrid()
mask.name = 'mask'
vdb.write('/tmp/known.vdb', [density, mask])
with open('/tmp/known.vdb', 'rb') as file:
    content = file.read()
with open('/tmp/unknown.vdb', 'wb') as file:
    file.write(content.replace(b'Tree_bool_5_4_3', b'Tree_half_5_4_3'))
calls = (vdb.read, lambda grid: grid.activeVoxelCount()), (vdb.readGridMetadata, lambda grid: grid.name)
for path in '/tmp/known.vdb', '/tmp/unknown.vdb':
    for read, shown in calls:
        try:
            print(shown(read(path, 'density')))
        except LookupError as error:
            print(error)
P
mapfile -t seen < <(within python3 /tmp/types.py 2>/dev/null)
observe 'active voxels of "density" beside a bool grid' "${seen[0]}" '8'
observe 'the name in its metadata' "${seen[1]}" 'density'
unknown='Cannot read grid. Grid type Tree_half_5_4_3 is not registered.'
observe 'active voxels of "density" beside a half grid' "${seen[2]}" "$unknown"
observe 'the name in its metadata' "${seen[3]}" "$unknown"
exit $differs
