#!/usr/bin/env python3
"""Measures the rows of external_points.csv again, with the compressors' own programs.

    external_points.py --data DATA [--out NEW.csv] [--only quantise+xz xz-lossless ...]
                       [--sz3 3.1.8=PROGRAM --sz3 3.3.2=PROGRAM] [--tthresh PROGRAM]

Each row of external_points.csv names a volume, a method and its parameter. This script makes the dense array
of the volume, compresses and decompresses it with that parameter, and prints the bytes and the PSNR of the
row beside its own. Rows whose program was not given are skipped. external_points.md explains the columns and
says for which rows the figures are the same.

Needs the Python modules numpy and pyopenvdb (Debian: python3-numpy, python3-openvdb) and zstd.
"""
import argparse
import csv
import lzma
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np
import pyopenvdb

HERE = pathlib.Path(__file__).parent
BOXES = {'aneurism': (256, 256, 256), 'hydrogen_atom': (128, 128, 128)}  # others: the active box
BYTE_SCANS = {'aneurism', 'hydrogen_atom'}  # measured on their 8-bit originals, values v / 255
XZ = [{'id': lzma.FILTER_LZMA2, 'preset': 9 | lzma.PRESET_EXTREME, 'lc': 0, 'lp': 0, 'pb': 0}]
COLUMNS = ['dataset', 'method', 'parameter', 'bytes', 'psnr_box_db', 'psnr_nonzero_db', 'max_error_rel',
           'enc_s', 'dec_s']


def dense(data, name):
    """The voxels of the box as float64. In Fortran order, x is fastest."""
    path = str(data / f'{name}.vdb')
    grid = pyopenvdb.read(path, pyopenvdb.readAllGridMetadata(path)[0].name)
    low, high = grid.evalActiveVoxelBoundingBox()
    if name in BOXES:
        low, high = (0, 0, 0), tuple(n - 1 for n in BOXES[name])
    values = np.zeros([h - l + 1 for l, h in zip(low, high)], np.float32)
    grid.copyToArray(values, ijk=low)
    values = values.astype(np.float64)
    return np.rint(values * 255) / 255 if name in BYTE_SCANS else values


def planes(values):
    """The lowest bytes of all values, then the second bytes, and so on, with x fastest."""
    flat = np.ascontiguousarray(values.ravel(order='F'))
    return np.frombuffer(flat.tobytes(), np.uint8).reshape(-1, flat.itemsize).T.tobytes()


def timed(call):
    start = time.perf_counter()
    result = call()
    return result, time.perf_counter() - start


class Xz:
    @staticmethod
    def pack(content):
        return lzma.compress(content, format=lzma.FORMAT_XZ, filters=XZ)

    unpack = staticmethod(lzma.decompress)


class Zstd:
    @staticmethod
    def run(options, content):
        return subprocess.run(['zstd', *options, '-q', '-c'], input=content, stdout=subprocess.PIPE,
                              check=True).stdout

    @classmethod
    def pack(cls, content):
        return cls.run(['-19', '--no-check'], content)

    @classmethod
    def unpack(cls, content):
        return cls.run(['-d'], content)


def quantised(values, parameter):
    """Rounds values to L steps of the peak and compresses their byte planes by xz."""
    levels, peak = int(parameter.split('=')[1]), values.max()
    codes = np.rint(values / peak * levels).astype(np.uint8 if levels < 256 else np.uint16)
    packed, encode = timed(lambda: Xz.pack(planes(codes)))
    _, decode = timed(lambda: Xz.unpack(packed))
    return len(packed), codes / levels * peak, encode, decode


def lossless(codec, values, parameter):
    stored = {'uint8': lambda: np.rint(values * 255).astype(np.uint8),
              'float16 byte planes': lambda: values.astype(np.float16),
              'float32 byte planes': lambda: values.astype(np.float32)}[parameter]()
    packed, encode = timed(lambda: codec.pack(planes(stored)))
    unpacked, decode = timed(lambda: codec.unpack(packed))
    assert unpacked == planes(stored)
    return len(packed), values, encode, decode


def run(words):
    subprocess.run([str(word) for word in words], stdout=subprocess.DEVNULL, check=True)


def by_program(compress, decompress, values):
    """A compressor of dense float32 arrays that reads and writes files."""
    with tempfile.TemporaryDirectory() as folder:
        raw, packed, back = (pathlib.Path(folder) / n for n in ('in.raw', 'packed', 'out.raw'))
        values.astype(np.float32).ravel(order='F').tofile(raw)
        _, encode = timed(lambda: run(compress(raw, packed)))
        _, decode = timed(lambda: run(decompress(packed, back)))
        decoded = np.fromfile(back, np.float32).reshape(values.shape, order='F')
        return packed.stat().st_size, decoded.astype(np.float64), encode, decode


def sz3(program, values, parameter):
    size, bound = values.shape, parameter.split('=')[1]
    return by_program(
        lambda raw, packed: [program, '-f', '-i', raw, '-z', packed, '-3', *size, '-M', 'ABS', bound],
        lambda packed, back: [program, '-f', '-z', packed, '-o', back, '-3', *size, '-M', 'ABS', bound],
        values)


def tthresh(program, values, parameter):
    size, rmse = values.shape, parameter.split('=')[1]
    return by_program(
        lambda raw, packed: [program, '-i', raw, '-t', 'float', '-s', *size, '-r', rmse, '-c', packed],
        lambda packed, back: [program, '-c', packed, '-o', back], values)


def figures(values, decoded):
    peak, error = values.max(), decoded - values

    def psnr(of):
        mean = np.mean(np.square(of))
        return float('inf') if mean == 0 else 10 * np.log10(peak * peak / mean)

    return {'psnr_box_db': f'{psnr(error):.3f}', 'psnr_nonzero_db': f'{psnr(error[values != 0]):.3f}',
            'max_error_rel': f'{np.abs(error).max() / peak:.6g}'}


def measurer(options, method):
    """The function that measures the rows of a method; None if its program was not given."""
    programs = dict(word.split('=', 1) for word in options.sz3)
    if method == 'quantise+xz':
        return quantised
    if method in ('xz-lossless', 'zstd-lossless'):
        return lambda v, p: lossless(Xz if method[0] == 'x' else Zstd, v, p)
    if method == 'TTHRESH' and options.tthresh:
        return lambda v, p: tthresh(options.tthresh, v, p)
    if method.startswith('SZ3-') and method[4:] in programs:
        return lambda v, p: sz3(programs[method[4:]], v, p)
    return None


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--data', type=pathlib.Path, required=True)
    parser.add_argument('--out', type=pathlib.Path)
    parser.add_argument('--only', nargs='+', help='methods')
    parser.add_argument('--sz3', action='append', default=[], metavar='VERSION=PROGRAM')
    parser.add_argument('--tthresh', metavar='PROGRAM')
    options = parser.parse_args()
    volumes, rows = {}, []
    for old in csv.DictReader((HERE / 'external_points.csv').read_text().splitlines()):
        measure = measurer(options, old['method'])
        if not measure or (options.only and old['method'] not in options.only):
            continue
        name = old['dataset']
        if name not in volumes:
            volumes = {name: dense(options.data, name)}
        size, decoded, encode, decode = measure(volumes[name], old['parameter'])
        row = dict(old, bytes=size, enc_s=f'{encode:.4f}', dec_s=f'{decode:.4f}',
                   **figures(volumes[name], decoded))
        rows.append(row)
        print(f"{name} {old['method']} {old['parameter']}: {old['bytes']} bytes, "
              f"{old['psnr_box_db']} dB; now {size} bytes, {row['psnr_box_db']} dB", flush=True)
    if options.out:
        with open(options.out, 'w', newline='') as stream:
            writer = csv.DictWriter(stream, COLUMNS)
            writer.writeheader()
            writer.writerows(rows)


if __name__ == '__main__':
    sys.exit(main())
