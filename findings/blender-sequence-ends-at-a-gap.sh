#!/usr/bin/env bash
# Blender's import of a VDB sequence drops the selected files after the first missing number.
#
# Version:   Blender 3.4.1+dfsg-2+b1 (Debian 12) with OpenVDB 10.0.1-2.
# Input:     the files f_0001.vdb, f_0002.vdb, f_0004.vdb and f_0005.vdb, all four of them given to the import, with
#            the detection of sequences that is its default.
# Expected:  a sequence of five frames whose third one is empty, or a message.
# Observed:  one volume of two frames. Nothing is shown at frames 4 and 5, and there is no message; the other two files
#            do not appear as volumes of their own either.
# Matters:   a simulation that left out one frame loses all that follow. Fill gaps before the import, for example with
#            copies or links of the frame before.
. "$(dirname "$0")/lib/packages.sh"
debian blender=3.4.1+dfsg-2+b1 python3-openvdb=10.0.1-2
cat >"$work/system/tmp/sequence.py" <<'P'
import bpy
import pyopenvdb as vdb

files = []
for frame in 1, 2, 4, 5:
    grid = vdb.FloatGrid()
    grid.name, grid.gridClass = 'density', vdb.GridClass.FOG_VOLUME
    grid.fill((0, 0, 0), (7, 7, 7), float(frame))
    files.append({'name': 'f_%04d.vdb' % frame})
    vdb.write('/tmp/' + files[-1]['name'], [grid])
bpy.ops.object.volume_import(filepath='/tmp/f_0001.vdb', directory='/tmp/', files=files)
volumes = [item for item in bpy.data.objects if item.type == 'VOLUME']
print('\nseen', len(volumes))
print('\nseen', volumes[0].data.frame_duration)
shown = []
for frame in 1, 2, 3, 4, 5:
    bpy.context.scene.frame_set(frame)
    data = volumes[0].evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    data.grids.load()
    if len(data.grids):
        shown.append(frame)
print('\nseen', shown)
P
mapfile -t seen < <(within blender --background --factory-startup --python /tmp/sequence.py 2>/dev/null |
  sed -n 's/^seen //p')
observe 'volumes' "${seen[0]}" 1
observe 'frames of the volume' "${seen[1]}" 2
observe 'frames with a grid' "${seen[2]}" '[1, 2]'
exit $differs
