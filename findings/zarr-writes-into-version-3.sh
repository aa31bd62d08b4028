#!/usr/bin/env bash
# zarr 2 shows a Zarr 3 folder as an empty group, and writes a file into it.
#
# Version:   python3-zarr 2.13.6+ds-1 (Debian 12).
# Input:     a valid Zarr 3 folder (a zarr.json of a group and one of an array with its chunk), opened by zarr.open(folder).
# Expected:  an error that says that the format is version 3, and a folder as it was.
# Observed:  an empty group, no message, and a new file .zgroup in the folder. The default mode is "a", which creates a
#            group where none is found. With mode="r" there is an error, "nothing found at path ''".
# Matters:   the image seems to be empty, and the folder then is of both versions, so that later programs of version 2 agree
#            that it is empty. Open with mode="r", and look for zarr.json first.
. "$(dirname "$0")/lib/packages.sh"
debian python3-zarr=2.13.6+ds-1
cat >"$work/system/tmp/three.py" <<'P'
import json
import os
import zarr

os.makedirs('/tmp/image/0/c')
json.dump({'zarr_format': 3, 'node_type': 'group', 'attributes': {}}, open('/tmp/image/zarr.json', 'w'))
json.dump({'zarr_format': 3, 'node_type': 'array', 'shape': [4], 'data_type': 'uint8', 'chunk_grid': {'name': 'regular',
           'configuration': {'chunk_shape': [4]}}, 'chunk_key_encoding': {'name': 'default', 'configuration': {'separator': '/'}},
           'fill_value': 0, 'codecs': [{'name': 'bytes'}], 'attributes': {}}, open('/tmp/image/0/zarr.json', 'w'))
open('/tmp/image/0/c/0', 'wb').write(b'1234')
try:
    zarr.open('/tmp/image', mode='r')
    print('\nseen opened')
except Exception as error:
    print('\nseen', type(error).__name__)
print('\nseen', sorted(os.listdir('/tmp/image')))
print('\nseen', list(zarr.open('/tmp/image')))
print('\nseen', sorted(os.listdir('/tmp/image')))
P
mapfile -t seen < <(within python3 /tmp/three.py 2>"$work/error" | sed -n 's/^seen //p')
observe 'mode "r"' "${seen[0]}" PathNotFoundError
observe 'files after it' "${seen[1]}" "['0', 'zarr.json']"
observe 'arrays with the default mode' "${seen[2]}" '[]'
observe 'files after it' "${seen[3]}" "['.zgroup', '0', 'zarr.json']"
exit $differs
