#!/usr/bin/env bash
# Pillow reverses the bytes of compressed big-endian TIFF images of 32 bits, and cuts colors of 16 bits to 8.
#
# Version:   python3-pil 9.4.0-1.1+deb12u1 (Debian 12); the files are written by python3-tifffile 20230203-1.
# Input:     a big-endian image of float32 compressed by zlib, the same without compression and the same in little-endian
#            order, and an RGB image of uint16. All have the value 1000 in their first sample.
# Expected:  1000 in each of them, or an error.
# Observed:  4.4e-41 for the compressed big-endian image, and 1000 for the others; the RGB image has the mode RGB of 8 bits,
#            in which 1000 is 3. There is no warning.
# Matters:   scans of microscopes and of old workstations are big-endian, and a tool that falls back on Pillow gets noise or
#            a coarser image without a word. Check the mode and the byte order, or read by tifffile or GDAL.
. "$(dirname "$0")/lib/packages.sh"
debian python3-pil=9.4.0-1.1+deb12u1 python3-tifffile=20230203-1
cat >"$work/system/tmp/reversed.py" <<'P'
import numpy
import tifffile
from PIL import Image

values = numpy.full((5, 6), 1000, 'float32')
for order, compression in ('>', 'zlib'), ('>', None), ('<', 'zlib'):
    tifffile.imwrite('/tmp/a.tif', values, byteorder=order, compression=compression)
    print('\nseen %.3g' % numpy.asarray(Image.open('/tmp/a.tif'))[0, 0])
tifffile.imwrite('/tmp/a.tif', numpy.full((5, 6, 3), 1000, 'uint16'), photometric='rgb')
image = Image.open('/tmp/a.tif')
print('\nseen', image.mode, numpy.asarray(image)[0, 0, 0])
P
mapfile -t seen < <(within python3 /tmp/reversed.py 2>"$work/error" | sed -n 's/^seen //p')
observe 'float32, big-endian, zlib' "${seen[0]}" 4.39e-41
observe 'float32, big-endian' "${seen[1]}" 1e+03
observe 'float32, little-endian, zlib' "${seen[2]}" 1e+03
observe 'RGB of uint16' "${seen[3]}" 'RGB 3'
observe 'messages' "$(wc -c <"$work/error")" 0
exit $differs
