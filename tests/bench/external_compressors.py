"""Compressors of dense arrays that esvr-compare does not run, and a search for their best setting.

A compressor takes an array of voxels in which x is the first index, and a parameter as
external_points.csv writes it. It returns the bytes, the decoded array and the seconds to compress and to
decompress. external_points.md describes the methods and their parameters.

Needs the Python modules numpy and pyopenvdb (Debian: python3-numpy, python3-openvdb) and zstd.
"""
import lzma
import math
import pathlib
import subprocess
import tempfile
import time

import numpy as np
import pyopenvdb

XZ = [{'id': lzma.FILTER_LZMA2, 'preset': 9 | lzma.PRESET_EXTREME, 'lc': 0, 'lp': 0, 'pb': 0}]
LONGEST = 60.0  # a compressor that takes longer for one setting is not searched any further, seconds


def opened(path, box=None):
    """The first grid of a file, and the lowest and the highest voxel of the box; without a box, of the
    active bounding box."""
    grid = pyopenvdb.read(str(path), pyopenvdb.readAllGridMetadata(str(path))[0].name)
    if box is None:
        return grid, *grid.evalActiveVoxelBoundingBox()
    numbers = tuple(int(number) for number in box.split(','))
    return grid, numbers[:3], numbers[3:]


def sides(low, high):
    return [h - l + 1 for l, h in zip(low, high)]


def box_voxels(path, box=None):
    _, low, high = opened(path, box)
    return math.prod(sides(low, high))


def dense(path, box=None):
    """The voxels of the box of a file's first grid, as float64. In Fortran order, x is fastest."""
    grid, low, high = opened(path, box)
    values = np.zeros(sides(low, high), np.float32)
    grid.copyToArray(values, ijk=low)
    return values.astype(np.float64)


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
    """Rounds values to L steps of the peak and compresses the byte planes of the steps above the lowest
    by xz."""
    levels, peak = int(number_of(parameter)), values.max()
    steps = np.rint(values / peak * levels)
    lowest = steps.min()
    codes = (steps - lowest).astype(np.uint8 if steps.max() - lowest < 256 else np.uint16)
    packed, encode = timed(lambda: Xz.pack(planes(codes)))
    _, decode = timed(lambda: Xz.unpack(packed))
    return len(packed), steps / levels * peak, encode, decode


STORED = {'uint8': lambda values: np.rint(values * 255).astype(np.uint8),
          'float16 byte planes': lambda values: values.astype(np.float16),
          'float32 byte planes': lambda values: values.astype(np.float32)}


def lossless(codec, values, parameter):
    stored = STORED[parameter](values)
    packed, encode = timed(lambda: codec.pack(planes(stored)))
    unpacked, decode = timed(lambda: codec.unpack(packed))
    assert unpacked == planes(stored)
    return len(packed), values, encode, decode


def exact_form(values):
    """The smaller type of STORED that holds these values exactly, of the two for floats."""
    exact = np.array_equal(values, values.astype(np.float16))
    return 'float16 byte planes' if exact else 'float32 byte planes'


def run(words):
    subprocess.run([str(word) for word in words], stdout=subprocess.DEVNULL, check=True,
                   timeout=LONGEST)


def by_program(compress, decompress, values):
    """A compressor of dense float32 arrays that reads and writes files."""
    with tempfile.TemporaryDirectory() as folder:
        raw, packed, back = (pathlib.Path(folder) / n for n in ('in.raw', 'packed', 'out.raw'))
        values.astype(np.float32).ravel(order='F').tofile(raw)
        _, encode = timed(lambda: compress(raw, packed))
        _, decode = timed(lambda: decompress(packed, back))
        decoded = np.fromfile(back, np.float32).reshape(values.shape, order='F')
        return packed.stat().st_size, decoded.astype(np.float64), encode, decode


def sz3(program, values, parameter):
    bound = ['-3', *values.shape, '-M', 'ABS', number_of(parameter)]
    return by_program(lambda raw, packed: run([program, '-f', '-i', raw, '-z', packed, *bound]),
                      lambda packed, back: run([program, '-f', '-z', packed, '-o', back, *bound]),
                      values)


def tthresh(program, values, parameter):
    options = ['-t', 'float', '-s', *values.shape, '-r', number_of(parameter)]
    return by_program(lambda raw, packed: run([program, '-i', raw, *options, '-c', packed]),
                      lambda packed, back: run([program, '-c', packed, '-o', back]), values)


def sperr(program, values, parameter):
    """One chunk at a fixed bit rate. SPERR no longer has a lossless stage of its own; zstd is applied
    to its stream."""
    size = values.shape

    def compress(raw, packed):
        run([program, '-c', raw, '--ftype', 32, '--dims', *size, '--chunks', *size, '--bpp',
             number_of(parameter), '--bitstream', packed])
        packed.write_bytes(Zstd.pack(packed.read_bytes()))

    def decompress(packed, back):
        stream = packed.with_name('stream')
        stream.write_bytes(Zstd.unpack(packed.read_bytes()))
        run([program, '-d', stream, '--decomp_f', back])

    return by_program(compress, decompress, values)


def figures(values, decoded):
    peak, error = values.max(), decoded - values

    def psnr(of):
        mean = np.mean(np.square(of))
        return float('inf') if mean == 0 else 10 * np.log10(peak * peak / mean)

    return {'psnr_box_db': f'{psnr(error):.3f}', 'psnr_nonzero_db': f'{psnr(error[values != 0]):.3f}',
            'max_error_rel': f'{np.abs(error).max() / peak:.6g}'}


def add_programs(parser):
    """Adds the options that name the compressors' programs."""
    parser.add_argument('--sz3', action='append', default=[], metavar='[VERSION=]PROGRAM')
    parser.add_argument('--tthresh', metavar='PROGRAM')
    parser.add_argument('--sperr', metavar='[VERSION=]PROGRAM', help='its program sperr3d')


def named(compressor, word):
    """The name of a compressor, with its version if the word has one, and its program."""
    version, _, program = word.rpartition('=')
    return (f'{compressor}-{version}' if version else compressor), program


def compressors(options):
    """The compressors whose programs the options name, by the names of external_points.csv."""
    found = {'quantise+xz': quantised,
             'xz-lossless': lambda v, p: lossless(Xz, v, p),
             'zstd-lossless': lambda v, p: lossless(Zstd, v, p)}
    for word in options.sz3:
        name, program = named('SZ3', word)
        found[name] = lambda v, p, program=program: sz3(program, v, p)
    if options.tthresh:
        found['TTHRESH'] = lambda v, p: tthresh(options.tthresh, v, p)
    if options.sperr:
        name, program = named('SPERR', options.sperr)
        found[f'{name}+zstd'] = lambda v, p: sperr(program, v, p)
    return found


def number_of(parameter):
    return parameter.split('=')[1]


def measured(compress, values, parameter):
    """The figures of external_points.csv for one setting."""
    size, decoded, encode, decode = compress(values, parameter)
    return {'parameter': parameter, 'bytes': size, **figures(values, decoded),
            'enc_s': f'{encode:.4f}', 'dec_s': f'{decode:.4f}'}


class Knob:
    """The setting of a compressor as a number, of which a larger one makes a larger file."""

    def __init__(self, method, values, sizes):
        peak, bit_rate = math.log(values.max()), math.log(8 / values.size)
        self.word, self.first, self.last = {
            'quantise+xz': ('levels', 0.0, math.log(65535)),
            'SZ3': ('abs', -peak, math.log(1e6) - peak),
            'TTHRESH': ('rmse', -peak, math.log(1e4) - peak),
            'SPERR': ('bpp', bit_rate + math.log(min(sizes) / 2), bit_rate + math.log(max(sizes) * 4)),
        }[method.split('-')[0]]

    def parameter(self, at):
        if self.word == 'levels':
            return f'levels={round(math.exp(at))}'
        return f"{self.word}={math.exp(at if self.word == 'bpp' else -at):.9g}"


class Search:
    """Searches the settings of one compressor and one volume. Every point that it measured may serve
    each of the sizes."""

    STEPS = 12      # most settings that are measured for one size
    NEAR = 0.995    # share of the size at which the search ends

    def __init__(self, method, compress, values, sizes):
        self.compress, self.values = compress, values
        self.knob = Knob(method, values, sizes)
        self.points = {}  # by the number of the knob

    def measure(self, at):
        parameter = self.knob.parameter(at)
        known = [point for point in self.points.values() if point['parameter'] == parameter]
        self.points[at] = known[0] if known else measured(self.compress, self.values, parameter)
        return not known

    def between(self, size):
        """The largest setting that fits into the size and the next larger one that does not."""
        low = max((at for at, point in self.points.items() if point['bytes'] <= size), default=None)
        high = min((at for at, point in self.points.items()
                    if point['bytes'] > size and (low is None or at > low)), default=None)
        return low, high

    def next_setting(self, size):
        """Interpolates the logarithm of the bytes, away from both ends."""
        low, high = self.between(size)
        if low is None or high is None:
            return None
        if self.points[low]['bytes'] >= self.NEAR * size:
            return None
        logs = [math.log(self.points[at]['bytes']) for at in (low, high)]
        share = (math.log(size) - logs[0]) / (logs[1] - logs[0])
        return low + (high - low) * min(max(share, 0.15), 0.85)

    def best(self, size):
        """The point with the highest PSNR of those that fit into the size; None without one."""
        for at in (self.knob.first, self.knob.last):
            if at not in self.points:
                self.measure(at)
        for _ in range(self.STEPS):
            at = self.next_setting(size)
            if at is None or not self.measure(at):
                break
        fitting = [point for point in self.points.values() if point['bytes'] <= size]
        return max(fitting, key=lambda point: float(point['psnr_box_db']), default=None)


def searched(method, compress, values, sizes):
    """The best point of a method for each size that it reaches, without repetitions. A program that
    fails or takes longer than LONGEST ends the search; the sizes before it keep their points."""
    search, best = Search(method, compress, values, sizes), {}
    try:
        for size in sizes:
            point = search.best(size)
            if point:
                best[point['parameter']] = point
    except subprocess.SubprocessError as failure:
        print(f'{method}: {failure}', flush=True)
    return list(best.values())


def points_for(method, compress, values, sizes):
    """The points of a method for these sizes. A lossless method has one point, whatever the sizes."""
    if method.endswith('-lossless'):
        return [measured(compress, values, exact_form(values))]
    return searched(method, compress, values, sizes)


def all_points(compressors, values, sizes):
    """The points of all compressors for these sizes, with the columns of external_points.csv."""
    return [{'method': method, **point} for method, compress in compressors.items()
            for point in points_for(method, compress, values, sizes)]
