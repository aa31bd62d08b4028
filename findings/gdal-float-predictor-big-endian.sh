#!/usr/bin/env bash
# GDAL writes big-endian TIFF images of floats with predictor 3 that it cannot read back: all values are lost without a word.
#
# Version:   python3-gdal 3.6.2+dfsg-1+b2 and libtiff6 4.5.0-6+deb12u4 (Debian 12).
# Input:     an image of float32 with the value 1000, written by the driver GTiff with COMPRESS=DEFLATE, PREDICTOR=3 and
#            ENDIANNESS=BIG, which are documented options; and the same with two of them only.
# Expected:  1000 after reading, or an error of either call.
# Observed:  4.4e-41 with all three options, and 1000 without any one of them. No exception, and no message. The file itself
#            is wrong: its stream, decoded by hand as the predictor is defined (a plane for each byte of the numbers, the
#            highest first), has the bytes of each number in reverse order, so that no reader gets the values without a guess.
# Matters:   the original is often deleted after such a conversion. Write floats in big-endian order without a predictor;
#            a reader that meets predictor 3 in a big-endian file does not know which of the two it has, and must refuse it.
. "$(dirname "$0")/lib/packages.sh"
debian python3-gdal=3.6.2+dfsg-1+b2 libtiff6=4.5.0-6+deb12u4
cat >"$work/system/tmp/predictor.py" <<'P'
import struct
import zlib

import numpy
from osgeo import gdal

gdal.UseExceptions()
values = numpy.full((4, 6), 1000, 'float32')
all_options = ['COMPRESS=DEFLATE', 'PREDICTOR=3', 'ENDIANNESS=BIG']
for options in all_options, all_options[:2], all_options[::2], all_options[1:]:
    file = gdal.GetDriverByName('GTiff').Create('/tmp/%d.tif' % len(options), 6, 4, 1, gdal.GDT_Float32, options)
    file.GetRasterBand(1).WriteArray(values)
    file = None
    print('\nseen %.3g' % gdal.Open('/tmp/%d.tif' % len(options)).ReadAsArray()[0, 0])

data = open('/tmp/3.tif', 'rb').read()
(place,) = struct.unpack('>I', data[4:8])
tags = {}
for at in range(place + 2, place + 2 + 12 * struct.unpack('>H', data[place:place + 2])[0], 12):
    tag, kind = struct.unpack('>HH', data[at:at + 4])
    tags[tag] = struct.unpack('>H' if kind == 3 else '>I', data[at + 8:at + (10 if kind == 3 else 12)])[0]
row = numpy.frombuffer(zlib.decompress(data[tags[273]:tags[273] + tags[279]]), 'u1')[:24]
planes = numpy.cumsum(row, dtype='u1').reshape(4, 6)  # of the highest to the lowest bytes
print('\nseen', tags[317], planes[:, 0].tolist(), list(struct.pack('>f', 1000)))
P
mapfile -t seen < <(within python3 /tmp/predictor.py 2>"$work/error" | sed -n 's/^seen //p')
observe 'deflate, predictor 3, big-endian' "${seen[0]}" 4.39e-41
observe 'deflate, predictor 3' "${seen[1]}" 1e+03
observe 'deflate, big-endian' "${seen[2]}" 1e+03
observe 'big-endian without compression' "${seen[3]}" 1e+03
observe 'predictor, bytes of 1000 from the highest on in the file, and as they are' "${seen[4]}" '3 [0, 0, 122, 68] [68, 122, 0, 0]'
observe 'messages' "$(wc -c <"$work/error")" 0
exit $differs
