#!/usr/bin/env bash
# OpenVDB finds grids by names that need not be unique, and lists them in the order of names.
#
# Version:   OpenVDB 10.0.1-2 (Debian 12), through python3-openvdb.
# Input:     two files of three grids, written in this order: "a", "a", "a[1]", and "a[0]", "a", "a". Names are free
#            text, and "a[1]" is also how OpenVDB itself names the second grid "a" of a file.
# Expected:  every grid can be read by some name, and readAll gives the grids in the order of the file.
# Observed:  a grid of the very name "a[1]" hides the second "a", which no name reads then, and "a[0]" hides the first
#            one; there is a warning about two grids "a", and none about this. readAll sorts by name: the grid that was
#            written first comes last.
# Matters:   a program that lists the grids of a file and then reads them one by one gets one grid twice and another
#            one never, with values that look right. Read grids by their place in the file.
. "$(dirname "$0")/lib/packages.sh"
debian python3-openvdb=10.0.1-2
cat >"$work/system/tmp/names.py" <<'P'
import pyopenvdb as vdb


def voxel(name, value):
    grid = vdb.FloatGrid()
    grid.name = name
    grid.fill((0, 0, 0), (0, 0, 0), value)
    return grid


def value(grid):
    return '%g' % grid.getConstAccessor().getValue((0, 0, 0))


def show(path, grids, names):
    vdb.write(path, grids)
    print(' '.join('%s=%s' % (name, value(vdb.read(path, name))) for name in names))
    print(' '.join('%s=%s' % (grid.name, value(grid)) for grid in vdb.readAll(path)[0]))


show('/tmp/1.vdb', [voxel('a', 1), voxel('a', 2), voxel('a[1]', 3)], ['a', 'a[0]', 'a[1]'])
show('/tmp/2.vdb', [voxel('a[0]', 3), voxel('a', 1), voxel('a', 2)], ['a', 'a[0]', 'a[1]'])
P
# Warnings come on standard output, so they are left out here (see openvdb-warnings-on-stdout.sh).
mapfile -t seen < <(within python3 /tmp/names.py 2>/dev/null | sed "s/\x1b\[[0-9;]*m//g" | grep -v WARN)
observe 'a=1, a=2, a[1]=3, read by name' "${seen[0]}" 'a=1 a[0]=1 a[1]=3'
observe 'a[0]=3, a=1, a=2, read by name' "${seen[2]}" 'a=1 a[0]=3 a[1]=2'
observe 'a[0]=3, a=1, a=2, all grids in their order' "${seen[3]}" 'a=1 a=2 a[0]=3'
exit $differs
