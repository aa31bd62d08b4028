"""Numbers that lie one after the other in files, compressed or not, and are read slab by slab."""
import bz2
import os
import tempfile
import zlib

import numpy as np

import esvr

from .image import product, require_bytes

MOST_DEFLATED = 1032  # by what zlib makes bytes fewer at most
CHUNK = 1 << 20


class Inflated:
    """A stream of zlib or gzip (also of several members) that is read forwards."""

    def __init__(self, file):
        self.file, self.inflater, self.rest, self.ended = file, zlib.decompressobj(wbits=47), b"", False

    def read(self, count):
        parts, have = [self.rest[:count]], min(len(self.rest), count)
        self.rest = self.rest[have:]
        while have < count and not self.ended:
            data = self.inflater.unconsumed_tail or self.inflater.unused_data or self.file.read(CHUNK)
            if self.inflater.eof:
                if not data.strip(b"\0"):
                    break
                self.inflater = zlib.decompressobj(wbits=47)
            if not data:
                raise EOFError("the compressed data end early")
            part = self.inflater.decompress(data, max(CHUNK, count - have))
            parts.append(part[:count - have])
            self.rest = part[count - have:]
            have += len(parts[-1])
        return b"".join(parts)


class Spool:
    """A stream that is read forwards, from any place: after a step back, a temporary file has its bytes."""

    def __init__(self, open_stream):
        self.open_stream, self.stream, self.at, self.file = open_stream, open_stream(), 0, None

    def read(self, at, count):
        if self.file is None and at < self.at:
            self.file = tempfile.TemporaryFile()
            stream = self.open_stream()
            while data := stream.read(CHUNK):
                self.file.write(data)
        if self.file is not None:
            self.file.seek(at)
            return self.file.read(count)
        while self.at < at:
            skipped = self.stream.read(min(CHUNK, at - self.at))
            if not skipped:
                raise EOFError("the data end early")
            self.at += len(skipped)
        data = self.stream.read(count)
        self.at += len(data)
        return data


class Flat:
    """A function for Image.fetch: an array of a shape, the slowest axis first, from a place in a file.

    compression is None, "deflate" (zlib or gzip) or "bzip2". skip is a number of bytes of the data after decompression.
    """

    def __init__(self, path, dtype, shape, offset=0, compression=None, skip=0):
        self.path, self.dtype, self.shape = path, np.dtype(dtype), tuple(int(n) for n in shape)
        self.offset, self.skip, self.spool = offset, skip, None
        self.needed = product(self.shape) * self.dtype.itemsize
        self.file = open(path, "rb")
        there = os.fstat(self.file.fileno()).st_size - offset
        if compression is None:
            require_bytes(path, self.needed + skip, there, f"an array of {' x '.join(map(str, self.shape[::-1]))} "
                          f"{self.dtype.name}")
        else:
            if compression == "deflate":
                require_bytes(path, self.needed / MOST_DEFLATED, there, "the compressed array, at the least,")
            self.spool = Spool(lambda: self._stream(compression))

    def _stream(self, compression):
        file = open(self.path, "rb")
        file.seek(self.offset)
        return bz2.BZ2File(file) if compression == "bzip2" else Inflated(file)

    def _read(self, at, count):
        """Numbers, of which the first is the at-th one."""
        begin, size = at * self.dtype.itemsize + self.skip, count * self.dtype.itemsize
        if self.spool:
            data = self.spool.read(begin, size)
            if begin + size == self.skip + self.needed:
                self.spool.read(begin + size, 1)  # the end of the stream, where its checksum is
        else:
            self.file.seek(self.offset + begin)
            data = self.file.read(size)
        if len(data) != size:
            raise esvr.BadInput(f"{self.path} is cut short: the array ends at byte {begin + len(data)} of {self.needed}")
        return np.frombuffer(data, self.dtype)

    def __call__(self, index):
        return self._fetch(index, 0, self.shape).astype(self.dtype.newbyteorder("="), copy=False)

    def _fetch(self, index, at, shape):
        """The part of a block of this shape, whose first number is the at-th one of the file."""
        if not index:
            return self._read(at, 1)[0]
        below = product(shape[1:])
        if isinstance(index[0], (int, np.integer)):
            return self._fetch(index[1:], at + int(index[0]) * below, shape[1:])
        first, last, _ = index[0].indices(shape[0])
        if all(isinstance(i, slice) and i == slice(0, n) for i, n in zip(index[1:], shape[1:])):
            return self._read(at + first * below, (last - first) * below).reshape((last - first,) + tuple(shape[1:]))
        # A part of each block along the axis: the parts are read one by one if the block is large.
        if below * self.dtype.itemsize >= CHUNK:
            return np.stack([self._fetch(index[1:], at + i * below, shape[1:]) for i in range(first, last)])
        block = self._read(at + first * below, (last - first) * below).reshape((last - first,) + tuple(shape[1:]))
        return block[(slice(None),) + tuple(index[1:])]


class Joined:
    """A function for Image.fetch: arrays of several files, one after the other along the slowest axis."""

    def __init__(self, parts):
        self.parts, self.sizes = parts, [part.shape[0] for part in parts]
        self.shape = (sum(self.sizes),) + parts[0].shape[1:]

    def __call__(self, index):
        if isinstance(index[0], (int, np.integer)):
            at = int(index[0])
            for part, size in zip(self.parts, self.sizes):
                if at < size:
                    return part((at,) + tuple(index[1:]))
                at -= size
            raise IndexError(index[0])
        first, last, _ = index[0].indices(self.shape[0])
        found, at = [], 0
        for part, size in zip(self.parts, self.sizes):
            low, high = max(first - at, 0), min(last - at, size)
            if low < high:
                found.append(part((slice(low, high),) + tuple(index[1:])))
            at += size
        return np.concatenate(found)


class Loaded:
    """A function for Image.fetch: an array in memory."""

    def __init__(self, array):
        self.array, self.shape = array, array.shape

    def __call__(self, index):
        return self.array[index]
