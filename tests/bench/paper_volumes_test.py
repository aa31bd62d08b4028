#!/usr/bin/env python3
"""Plan: small stand-ins have the shares that the paper states and are the same in each run; their values are multiples of
1/255 up to 1; the grey values follow the field; shares count zeros and values above a tenth; a PNG decodes to its
pixels for every filter."""
import pathlib
import struct
import sys
import tempfile
import unittest
import zlib

try:
    import numpy as np
except ImportError as missing:
    print(f'skipped: {missing} (Debian: python3-numpy)')
    sys.exit(77)

import paper_volumes
from paper_volumes import Dense, graded, pixels, shares, tubes

DENSE = {name: volume for name, volume in paper_volumes.VOLUMES.items() if isinstance(volume, Dense)}
SCALE = 1 / 8
RELATIVE, POINTS = 0.03, 0.2  # how far a share may lie from the paper's: of the share, or in percentage points


class Shares(unittest.TestCase):
    def test_count_zeros_and_values_above_a_tenth_of_the_maximum(self):
        self.assertEqual(shares(np.array([0, 0, 0, 0.1, 0.2, 0.3, 0.5, 1])), (62.5, 50.0))
        self.assertEqual(shares(np.array([0, 0.25, 2, 2])), (75.0, 75.0))


class StandIns(unittest.TestCase):
    def test_have_the_shares_of_the_paper_and_values_of_8_bits(self):
        for name, volume in DENSE.items():
            with self.subTest(name):
                values = volume.array(SCALE)
                for share, wanted in zip(shares(values), (volume.original.nonzero, volume.original.above)):
                    self.assertLessEqual(abs(share - wanted), max(POINTS, RELATIVE * wanted))
                self.assertEqual(values.dtype, np.float32)
                self.assertTrue(np.array_equal(values, (np.rint(values * 255) / np.float32(255)).astype(np.float32)))
                self.assertEqual((values.min(), values.max()), (0 if volume.original.nonzero < 100 else values.min(), 1))

    def test_are_the_same_in_each_run(self):
        volume = DENSE['neuron']
        self.assertTrue(np.array_equal(volume.array(SCALE), volume.array(SCALE)))

    def test_stay_below_40_million_voxels(self):
        for name, volume in DENSE.items():
            self.assertLess(np.prod(volume.resolution), 40e6, name)


class Grey(unittest.TestCase):
    def test_follows_the_field(self):
        field = np.random.default_rng(1).permutation(8000).astype(np.float32).reshape(20, 20, 20)
        values = graded(field, 0.5, 0.2)
        self.assertTrue(np.all(np.diff(values.ravel()[np.argsort(field.ravel())]) >= 0))
        self.assertEqual((np.count_nonzero(values), np.count_nonzero(values > 0.1)), (4000, 1600))

    def test_is_zero_outside(self):
        field, inside = np.random.default_rng(2).random((2, 10, 10, 10), np.float32)
        self.assertTrue(np.array_equal(graded(field, 0.3, 0.3, inside) > 0, inside >= np.sort(inside.ravel())[-300]))


class Tubes(unittest.TestCase):
    def test_have_their_radius(self):
        field = tubes((21, 21, 21), [(10, 10, 10, 4.0)], width=1.0)
        self.assertEqual([field[10 + d, 10, 10] for d in (0, 3, 4, 5)], [1, 1, 0.5, 0])
        self.assertEqual(np.count_nonzero(tubes((5, 5, 5), [(30, 2, 2, 4.0)])), 0)


class Skeletons(unittest.TestCase):
    def test_are_turned_and_linked_as_the_first_one(self):
        nodes = np.array([[1, 0, 0, 0, 0, 1, -1], [2, 0, 8, 0, 0, 1, 1], [4, 0, 8, 2, 6, 1, 2]], float)
        found = paper_volumes.turned(nodes, np.random.default_rng(4), 3)
        self.assertTrue(np.array_equal(found[:3], nodes))
        self.assertEqual(len(np.unique(found[:, 0])), 9)
        for copy in (found[3:6], found[6:]):
            self.assertEqual(copy[:, 6].tolist(), [-1, copy[0, 0], copy[1, 0]])
            self.assertAlmostEqual(np.linalg.norm(copy[2, 2:5] - copy[0, 2:5]), np.linalg.norm([8, 2, 6]))
            self.assertFalse(np.allclose(copy[:, 2:5], nodes[:, 2:5], atol=0.1))
            edges = np.array([copy[1, 2:5] - copy[0, 2:5], copy[2, 2:5] - copy[1, 2:5], [0, 0, 0]])
            edges[2] = np.cross(edges[0], edges[1])
            self.assertAlmostEqual(np.linalg.det(edges), 16 ** 2 + 48 ** 2)  # not mirrored


def filtered(picture, kind):
    """The lines of a PNG, each with one filter, by its definition for single bytes."""
    height, width, channels = picture.shape
    padded = np.zeros((height + 1, width + 1, channels), int)
    padded[1:, 1:] = picture
    lines = b''
    for y in range(height):
        lines += bytes([kind])
        for x in range(width):
            for c in range(channels):
                left, above, corner = padded[y + 1, x, c], padded[y, x + 1, c], padded[y, x, c]
                p = left + above - corner
                nearest = min((left, above, corner), key=lambda v, p=p: abs(p - v))
                guess = (0, left, above, (left + above) // 2, nearest)[kind]
                lines += bytes([(padded[y + 1, x + 1, c] - guess) % 256])
    return lines


def png(picture, kind):
    def chunk(name, content):
        return struct.pack('>I', len(content)) + name + content + struct.pack('>I', zlib.crc32(name + content))
    height, width, channels = picture.shape
    header = struct.pack('>IIBBBBB', width, height, 8, {3: 2, 4: 6}[channels], 0, 0, 0)
    return (b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', header) + chunk(b'IDAT', zlib.compress(filtered(picture, kind)))
            + chunk(b'IEND', b''))


class Pictures(unittest.TestCase):
    def test_decode_for_every_filter(self):
        rng = np.random.default_rng(3)
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / 'picture.png'
            for channels in (3, 4):
                picture = rng.integers(0, 256, (7, 9, channels), np.uint8)
                for kind in range(5):
                    file.write_bytes(png(picture, kind))
                    self.assertTrue(np.array_equal(pixels(file), picture), (channels, kind))


if __name__ == '__main__':
    unittest.main()
