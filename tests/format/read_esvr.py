#!/usr/bin/env python3
"""Reads .esvr files as docs/format.md specifies them. It shares no code with libesvr.

usage: read_esvr.py FOLDER SEQUENCE.esvr

Reads every golden file in the folder and the golden sequence: header, table, checksums and sections,
and compares what is known of them. Exits 1 where the page and a file disagree.
"""

import math
import struct
import sys
from pathlib import Path

MASK = (1 << 64) - 1
PRIMES = (11400714785074694791, 14029467366897019727, 1609587929392839161, 9650029242287828579,
          2870177450012600261)
NONE = 0xFFFFFFFF
KINDS = {1: "file metadata", 2: "grid", 3: "chunks", 4: "bricks", 6: "layer errors",
         7: "curve", 8: "carried grid", 9: "vector grid", 11: "grid records",
         12: "packed sections", 16: "centers", 17: "scales", 18: "rotations", 19: "intensities",
         20: "kappas", 32: "ellipsoids", 34: "layered ellipsoids", 35: "mask", 36: "voxels",
         37: "residual", 38: "carried bytes", 41: "related voxels",
         42: "non-finite voxels", 64: "sequence index"}
PLANES = {"centers": 3, "scales": 3, "rotations": 4, "intensities": 1, "kappas": 1}


def rotate(value, bits):
    return ((value << bits) | (value >> (64 - bits))) & MASK


def mix(lane, word):
    return rotate((lane + word * PRIMES[1]) & MASK, 31) * PRIMES[0] & MASK


def stripes(data):
    """Merges the four lanes of XXH64 after all whole stripes of 32 bytes."""
    lanes = [(PRIMES[0] + PRIMES[1]) & MASK, PRIMES[1], 0, -PRIMES[0] & MASK]
    for at in range(0, len(data) // 32 * 32, 32):
        words = struct.unpack_from("<4Q", data, at)
        lanes = [mix(lane, word) for lane, word in zip(lanes, words)]
    merged = sum(rotate(lane, bits) for lane, bits in zip(lanes, (1, 7, 12, 18))) & MASK
    for lane in lanes:
        merged = ((merged ^ mix(0, lane)) * PRIMES[0] + PRIMES[3]) & MASK
    return merged


def tail(value, data):
    while len(data) >= 8:
        word = struct.unpack_from("<Q", data)[0]
        value = (rotate(value ^ mix(0, word), 27) * PRIMES[0] + PRIMES[3]) & MASK
        data = data[8:]
    if len(data) >= 4:
        word = struct.unpack_from("<I", data)[0]
        value = (rotate(value ^ word * PRIMES[0] & MASK, 23) * PRIMES[1] + PRIMES[2]) & MASK
        data = data[4:]
    for byte in data:
        value = rotate(value ^ byte * PRIMES[4] & MASK, 11) * PRIMES[0] & MASK
    return value


def xxh64(data):
    value = stripes(data) if len(data) >= 32 else PRIMES[4]
    value = tail((value + len(data)) & MASK, data[len(data) // 32 * 32:])
    value = (value ^ value >> 33) * PRIMES[1] & MASK
    value = (value ^ value >> 29) * PRIMES[2] & MASK
    return value ^ value >> 32


class Record:
    """Reads the values of a record one after the other."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def get(self, form):
        values = struct.unpack_from("<" + form, self.data, self.at)
        self.at += struct.calcsize("<" + form)
        return values[0] if len(values) == 1 else values

    def sized(self):
        return self.get(f"{self.get('I')}s")

    def varint(self):
        value, shift = 0, 0
        while True:
            byte = self.get("B")
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return value

    def metadata(self):
        return [(self.sized(), self.sized(), self.sized()) for _ in range(self.get("I"))]

    def chunk(self):
        return {"origin": self.get("3i"), "box": self.get("6i"), "count": self.get("Q")}

    def end(self):
        assert self.at == len(self.data), "bytes left in a record"


def grid(data):
    r = Record(data)
    g = {"name": r.sized(), "class": r.get("B"), "values": r.get("B"), "background": r.get("d"),
         "map type": r.sized(), "map": r.sized()}
    g["affine"] = r.get("16d") if r.get("B") else None
    g["metadata"] = r.metadata()
    for key, form in (("topology", "B"), ("within range", "B"), ("threshold", "f"),
                      ("active box", "6i")):
        g[key] = r.get(form)
    if g["topology"] & 8:
        g["box voxels"] = [tuple(low + r.varint() for low in g["active box"][:3])
                           for _ in range(r.get("B"))]
        assert 1 <= len(g["box voxels"]) <= 6 and sorted(g["box voxels"]) == g["box voxels"]
    if g["topology"] & 16:
        g["tone"] = r.get("f")
        assert 0 < g["tone"] < math.inf and g["within range"] == 1
    g["active voxels"] = r.get("Q")
    if g["topology"] & 32:
        g["not finite"] = [r.varint() for _ in range(3)]
        assert 1 <= sum(g["not finite"]) <= g["active voxels"]
    for key, form in (("range", "2f"), ("field background", "f"),
                      ("kernel", "B"), ("kappa", "f"), ("epsilon", "f"), ("chunk count", "I")):
        g[key] = r.get(form)
    g["chunks"] = [r.chunk()] if g["chunk count"] == 1 else []
    r.end()
    return g


def chunks(data):
    r = Record(data)
    table = [r.chunk() for _ in range(len(data) // 44)]
    r.end()
    return table


def bricks(data):
    n = len(data) // 12
    values = struct.unpack(f"<{3 * n}i", data)
    return [tuple(8 * v for v in values[i::n]) for i in range(n)]


class Decoder:
    """Decodes a stream of the range coder."""

    def __init__(self, data):
        self.data, self.at, self.code, self.range = data, 0, 0, 0xFFFFFFFF
        self.models = {}
        for _ in range(4):
            self.code = self.code << 8 | self.next()

    def next(self):
        self.at += 1
        return self.data[self.at - 1] if self.at <= len(self.data) else 0

    def fill(self):
        while self.range < 1 << 24:
            self.range <<= 8
            self.code = (self.code << 8 | self.next()) & 0xFFFFFFFF

    def decision(self, *model, first=(1 << 21, 0)):
        p, n = self.models.get(model, first)
        bound = self.range * p >> 22
        one = self.code >= bound
        if one:
            self.code -= bound
            self.range -= bound
        else:
            self.range = bound
        self.learn(model, one, p, n)
        self.fill()
        return int(one)

    def learn(self, model, one, p=1 << 21, n=0):
        share = (1 << 17) // (2 * n + 3)
        p += -(p * share >> 16) if one else ((1 << 22) - 1 - p) * share >> 16
        self.models[model] = p, min(n + 1, 99)

    def raw(self, bits):
        value = 0
        while bits > 0:
            now = min(bits, 12)
            bits -= now
            self.range >>= now
            piece = min(self.code // self.range, (1 << now) - 1)
            self.code -= self.range * piece
            value = value << now | piece
            self.fill()
        return value

    def tree(self, bits, *model):
        node = 1
        for _ in range(bits):
            node = node << 1 | self.decision(*model, node)
        return node - (1 << bits)

    def number(self, *model, bits=5):
        width = self.tree(bits, *model, "width")
        if width < 2:
            return width
        value = 1
        for _ in range(min(3, width - 1)):
            value = value << 1 | self.decision(*model, width, value)
        left = max(0, width - 4)
        return value << left | self.raw(left)


def coded_bytes(data, count):
    stream, out, places = Decoder(data), bytearray(), {}
    guess = length = 0
    while len(out) < count:
        right = length and stream.decision("right", min(length, 15), first=(51 << 14, 1))
        if right:
            out.append(out[guess])
        else:
            before, node = out[-1] if out else 0, 1
            for _ in range(8):
                own = "after", before, node
                if own in stream.models:
                    node = node << 1 | stream.decision(*own)
                else:
                    bit = stream.decision("alone", node)
                    stream.learn(own, bit)
                    node = node << 1 | bit
            out.append(node & 255)
        guess, length = guess + 1, length + 1 if right else 0
        if len(out) >= 5:
            key = (int.from_bytes(out[-5:], "big") * 0x9E3779B97F4A7C15 & MASK) >> 48
            if not length and key in places:
                guess, length = places[key], 1
            places[key] = len(out)
    return bytes(out)


def coded_floats(data, count):
    low, high = data[:count // 4 * 3], coded_bytes(data[count // 4 * 3:], count // 4)
    return b"".join(low[3 * i:3 * i + 3] + high[i:i + 1] for i in range(count // 4))


def split(n, rank, stream):
    if n == 1:
        return stream.decision("one", rank)
    if n < 16:
        return stream.tree(4, "few", n)
    width, half = n.bit_length(), n // 2
    above = stream.decision("above", width)
    distance = stream.number("many", width)
    return half + distance if above else half - distance


def keys(n, bits, stream, prefix=0):
    if n == 0 or bits == 0:
        return [prefix] * n
    zeros = split(n, bits, stream)
    assert 0 <= zeros <= n, "a split"
    return (keys(zeros, bits - 1, stream, prefix)
            + keys(n - zeros, bits - 1, stream, prefix | 1 << (bits - 1)))


def clamp(value, low, high):
    return max(low, min(high, value))


def mid(code, bits):
    return (code + 0.5) / 2**bits


def lg(value):
    value = max(value, 1)
    k = value.bit_length() - 1
    return 256 * (k - 1) + (256 * value >> k)


def turn_of(codes, bits):
    """W, X, Y and Z of a rotation."""
    xyz = [2 * (code << (14 - b)) + (1 << (14 - b)) - (1 << 14) for code, b in zip(codes, bits)]
    return (math.isqrt(max((1 << 29) - sum(c * c for c in xyz), 1 << 27)), *xyz)


def rotation_bits(lattice, all_bits, coarse, middle, high):
    """The bits of each component, from its coarse bits."""
    k = min(all_bits, 3)
    if all_bits == k:
        return [k] * 3
    n = lambda r: sum(t <= r for t in lattice["thresholds"])
    a, c = (min(n(middle + high) - n(r), 5) for r in (middle, high))
    w, x, y, z = turn_of(coarse, [k] * 3)
    first = (w * w << 2 * a) + z * z + (y * y << 2 * c)
    last = ((x * z - w * y >> 14)**2 * 4**(5 - a) + (y * z + w * x >> 14)**2 * 4**5
            + (w * w + z * z >> 14)**2 * 4**(5 - c))
    lg_w = lg(w * w) - 256 * 29
    fx, fz = lg(first) - 256 * 29, lg_w - lg(last) + 256 * 40
    fy = lg_w + 512 * (a + c) - fx - fz
    return [clamp(256 * all_bits - (f >> 1) + 128 >> 8, k, 14) for f in (fx, fy, fz)]


def power(t):
    return (256, 304, 362, 431)[(2 * t >> 6) & 3] << (2 * t >> 8)


def position_bits(lattice, e, scales, turn):
    low, middle, high = scales
    slope = lattice["position slope"]
    u = clamp((2 * middle + 1) * slope >> 1, 0, 2560)
    v = clamp(u + ((2 * high + 1) * slope >> 1), u, 2560)
    w, x, y, z = turn
    one = 1 << 29
    row0 = [r >> 17 for r in (one - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y))]
    row2 = [r >> 17 for r in (2 * (x * z - w * y), 2 * (y * z + w * x), one - 2 * (x * x + y * y))]
    first = sum(power(t) * r * r for t, r in zip((v, u, 0), row0))
    last = sum(power(t) * r * r for t, r in zip((0, v - u, v), row2))
    cx, cz = lg(first) - 256 * 32 >> 1, v - (lg(last) - 256 * 32 >> 1)
    ball = 256 * e + lattice["position base"] - slope * low
    return [clamp(ball - c >> 8, 0, 22 - lattice["cell bits"]) for c in (cx, u + v - cx - cz, cz)]


def code_rotation(lattice, e, middle, high, turns):
    """The codes of x, y and z, and their bits."""
    n = sum(t <= middle + high for t in lattice["thresholds"])
    all_bits = clamp(e + lattice["rotation offset"] + n, 0, 14)
    k = min(all_bits, 3)
    coarse = [turns.tree(k, "turn", axis) for axis in range(3)]
    bits = rotation_bits(lattice, all_bits, coarse, middle, high)
    return [c << b - k | turns.raw(b - k) for c, b in zip(coarse, bits)], bits


def block(lattice, n, streams):
    """Decodes the ellipsoids of one block."""
    places, scales, turns, heights = (Decoder(data) for data in streams)
    low = 0
    for key in keys(n, 3 * lattice["cell bits"], places):
        low = scales.number("low", min(7, low))
        middle = scales.number("middle", min(7, low))
        high = scales.number("high", min(7, low + middle))
        sign = lattice["signs"] and heights.decision("sign")
        volume = 3 * low + 2 * middle + high
        height = heights.number("height", min(volume // 2, 23))
        e = heights.tree(4, "precision", height.bit_length())
        bs = clamp(e - lattice["scale offset"], 0, 16)
        bi = clamp((lattice["intensity base"] + lattice["intensity slope"] * volume) >> 8, 0, 24)
        logs, below = [], lattice["lowest scale"]
        for axis, coarse in enumerate((low, middle, high)):
            top = scales.decision("rest", axis, min(7, coarse)) << (bs - 1) if bs else 0
            below += mid(coarse << bs | top | scales.raw(max(0, bs - 1)), bs)
            logs.insert(0, below * lattice["scale step"])
        codes, br = code_rotation(lattice, e, middle, high, turns)
        turn = [(mid(code, b) - 0.5) * 2**0.5 for code, b in zip(codes, br)]
        norm2 = turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]
        w = max(0.0, 1.0 - norm2)**0.5
        norm = (norm2 + w * w)**0.5
        bp = position_bits(lattice, e, (low, middle, high), turn_of(codes, br))
        cell = [sum((key >> (3 * b + a) & 1) << b for b in range(lattice["cell bits"]))
                for a in range(3)]
        center = [(low_ + mid(c << b | places.raw(b), b)) * lattice["cell"]
                  for low_, c, b in zip(lattice["lowest cell"], cell, bp)]
        height = mid(height, bi) * lattice["intensity step"]
        yield center, logs, [c / norm for c in (w, *turn)], -height if sign else height


def lattice_of(r):
    lattice = {key: r.get(form) for key, form in (
        ("cell", "d"), ("lowest cell", "3i"), ("scale step", "d"), ("lowest scale", "i"),
        ("intensity step", "d"), ("position base", "i"), ("position slope", "i"),
        ("scale offset", "i"), ("intensity base", "i"), ("intensity slope", "i"),
        ("rotation offset", "i"), ("cell bits", "B"), ("signs", "B"))}
    lattice["thresholds"] = [r.get("B") for _ in range(r.get("B"))]
    return lattice


def ellipsoids(data):
    r = Record(data)
    count = r.get("Q")
    lattice = lattice_of(r)
    table = [r.get("4I") for _ in range((count + 4095) // 4096)]
    result = []
    for b, sizes in enumerate(table):
        streams = [r.get(f"{size}s") for size in sizes]
        result += block(lattice, min(4096, count - 4096 * b), streams)
    assert not any(data[r.at:]), "padding of ellipsoids"
    return result


def layered(data):
    """A list of (box in 256ths, ellipsoids) for each block, and the ends of the layers."""
    r = Record(data)
    size = r.get("I")
    count = r.get("Q")
    lattice = lattice_of(r)
    ends = [r.get("Q") for _ in range(r.get("B"))]
    assert len(ends) > 1 and ends == sorted(set(ends)) and ends[-1] == count, "layers"
    counts = []
    for first, end in zip([0] + ends, ends):
        n, parts = end - first, (end - first + 2047) // 2048
        counts += [n * (k + 1) // parts - n * k // parts for k in range(parts)]
    entries = [(r.get("6B"), r.get("4I"), r.get("Q")) for _ in counts]
    assert r.at == size - 8 and r.get("Q") == xxh64(data[:size - 8]), "directory"
    blocks = []
    for n, (box, sizes, hashed) in zip(counts, entries):
        whole = data[r.at:r.at + sum(sizes)]
        assert hashed == xxh64(whole), "block checksum"
        blocks.append((box, list(block(lattice, n, [r.get(f"{size}s") for size in sizes]))))
    assert not any(data[r.at:]), "padding of ellipsoids"
    return ends, blocks


def layer_errors(data):
    return [struct.unpack_from("<2f", data, at) for at in range(0, len(data), 8)]


def curve(data):
    """A row for each point: ellipsoids, PSNR of box and active voxels, largest error, iteration."""
    n = len(data) // 28
    r = Record(data)
    columns = [[r.get(form) for _ in range(n)] for form in "QffdI"]
    r.end()
    return list(zip(*columns))


def signed(n):
    """A number modulo 2^32, from -2^31 to 2^31 - 1."""
    return (n + (1 << 31)) % (1 << 32) - (1 << 31)


def third(n):
    return signed(21 * n + 32) >> 6


def half(n):
    return signed(n - (n >> 31)) >> 1


def guesses(a, b, c, ab, ac, bc, abc):
    """The predictions of a voxel by the six rules."""
    corner = signed(a + b - ab - ac - bc + abc)
    return (clamp(signed(c + corner), min(a, b, c), max(a, b, c)),
            signed(c + third(signed(a + b - 2 * c))),
            signed(c + third(signed(2 * (a + b) - ab - ac - bc - c))),
            signed(c + half(signed(a + b - ac - bc))), signed(c + corner), c)


class Symbols:
    """Decodes a stream of the symbol coder."""

    LEAST = (1 << 14) + (1 << 8)
    FREE = (1 << 30) - 16 * LEAST

    def __init__(self, data):
        self.data, self.at, self.state, self.models = data, 0, 0, {}
        self.begin_part()

    def word(self):
        self.at += 4
        return int.from_bytes(self.data[self.at - 4:self.at], "little")

    def begin_part(self):
        self.state = self.word() << 32
        self.state |= self.word()

    def take(self, start, share):
        place = self.state & 0xFFFF
        self.state = (share * (self.state >> 16) + place - start) % (1 << 64)
        if self.state < 1 << 31:
            self.state = self.state << 32 | self.word()

    def decision(self, *model):
        p, n = self.models.get(model, (1 << 21, 0))
        zero = max(p >> 6, 1)
        one = self.state & 0xFFFF >= zero
        self.take(zero if one else 0, (1 << 16) - zero if one else zero)
        share = (1 << 17) // (2 * n + 3)
        p += -(p * share >> 16) if one else ((1 << 22) - 1 - p) * share >> 16
        self.models[model] = p, min(n + 1, 99)
        return int(one)

    def symbol(self, *model, count=16):
        starts, n = self.models.get(model) or (
            [s * self.LEAST + min(s, count) * (self.FREE // count) for s in range(16)], 0)
        place = self.state & 0xFFFF
        s = max(k for k in range(16) if starts[k] >> 14 <= place)
        end = starts[s + 1] >> 14 if s < 15 else 1 << 16
        self.take(starts[s] >> 14, end - (starts[s] >> 14))
        shift = next(k for k, last in enumerate((2, 4, 9, 20, 41, 82, n + 1), 1) if n < last)
        for k in range(16):
            target = k * self.LEAST + (self.FREE if k > s else 0)
            starts[k] += (target - starts[k]) >> shift
        self.models[model] = starts, n + 1
        if s >= count:
            raise ValueError("a symbol that does not occur")
        return s

    def raw(self, bits):
        value = (self.state & 0xFFFF) >> (16 - bits)
        self.take(value << (16 - bits), 1 << (16 - bits))
        return value

    def difference(self, base, *model):
        def bits_of(size):
            return (base + 1 if base else 0) if size == 1 else base + size - 1

        symbol = self.symbol("size", *model)
        negative, size = symbol % 2 == 0, (symbol + 1) // 2
        if symbol == 0:
            return 0
        if symbol == 15:
            size = 8 + self.symbol("large")
            if size == 8 + 15:
                size += self.raw(4)
            negative = self.decision("large negative")
        value, bits = 0 if size == 1 and base else 1, bits_of(size)
        if bits > 0:
            lead = min(bits, 4)
            value = value << lead | self.symbol(
                "lead", min(size, 8), *model, count=1 << min(bits_of(min(size, 8)), 4))
            bits -= lead
        while bits > 0:
            now = min(bits, 16)
            bits -= now
            value = value << now | self.raw(now)
        return -value if negative else value


def header_of_voxels(r):
    head = {key: r.get(form) for key, form in (
        ("form", "B"), ("divisor", "d"), ("origin", "3i"), ("background", "f"))}
    head["palette"] = [r.get("f") for _ in range(r.get("I"))]
    head.update((key, r.get(form)) for key, form in (
        ("bricks", "Q"), ("bits", "B"), ("vacant", "i")))
    return head


class Block:
    """The voxels of a block that have been read so far."""

    LINE = range(-1, 8)

    def __init__(self, head, stream, mirrors, common):
        self.head, self.stream, self.mirrors, self.common = head, stream, mirrors, common
        self.codes, self.active, self.kept, self.copies = {}, set(), set(), set()
        self.source = self.vacancy = self.flat = self.bricks = 0
        self.errors, self.image_error = [0] * 6, 0

    def code(self, p):
        return self.codes.get(p, self.head["vacant"])

    def image(self, p):
        """The image of a voxel: the first one that has been read before."""
        for axis, mirror in enumerate(self.mirrors):
            if mirror >= 0 and mirror - p[axis] < p[axis]:
                return tuple(mirror - c if a == axis else c for a, c in enumerate(p))
        return None

    def brick(self, first):
        x, y, z = first
        voxels_ = [(x + (v >> 6), y + (v >> 3 & 7), z + (v & 7)) for v in range(512)]
        if self.copied(first, voxels_):
            return
        if self.bricks == 256:
            self.stream.begin_part()
            self.bricks = 0
        self.bricks += 1
        self.read_activity(first, voxels_)
        vacant = self.read_vacancy(voxels_)
        self.codes.update((p, self.head["vacant"]) for p in vacant)
        self.kept.update(p for p in voxels_ if p not in vacant)
        if len(vacant) < 512:
            self.read_codes(first, voxels_, vacant)

    def copied(self, first, voxels_):
        """Copies a brick, if it is a copy."""
        before = [tuple(c - 8 * (a == axis) for a, c in enumerate(first)) for axis in range(3)]
        if not self.stream.decision("copy", *(q in self.copies for q in before)):
            return False
        self.copies.add(first)
        self.source = self.stream.symbol("source", self.source, count=4)
        for p in voxels_:
            q = (self.image(p) if self.source == 3 else
                 tuple(c - 8 * (a == self.source) for a, c in enumerate(p)))
            self.codes[p] = self.code(q) if q in self.kept else self.head["vacant"]
            if q in self.kept:
                self.kept.add(p)
            if q in self.active:
                self.active.add(p)
        return True

    def read_activity(self, first, voxels_):
        def is_active(x, y, z):
            return (first[0] + x, first[1] + y, first[2] + z) in self.active

        def line(x, y):
            return [is_active(x, y, z) for z in self.LINE]

        sides = [is_active(*p) for m in range(8) for n in range(8) for p in ((-1, m, n), (m, -1, n))]
        ends = [is_active(m, n, -1) for m in range(8) for n in range(8)]
        state = any(sides) + all(sides) + 3 * (any(ends) + all(ends))
        if self.stream.decision("uniform", state):
            if self.stream.decision("full", state):
                self.active.update(voxels_)
            return
        for x in range(8):
            for y in range(8):
                self.read_line(first, voxels_, x, y, line)

    def read_line(self, first, voxels_, x, y, line):
        around = line(x - 1, y), line(x, y - 1), line(x - 1, y - 1)
        after, own = line(x - 1, min(y + 1, 7)), line(x, y)
        here = voxels_[64 * x + 8 * y:64 * x + 8 * y + 8]
        same = own[0]
        if all(known == same for known in sum(around, [])):
            alike = [same] + [all(known == same for known in other[1:]) for other in (
                after, line(x - 2, y) if x else [same] * 9, line(x, y - 2) if y else [same] * 9)]
            if not self.stream.decision("line", *alike):
                self.active.update(here if same else [])
                return
        for z, p in enumerate(here):
            context = [other[z + k] if z + k < 9 else False
                       for other, count in zip(around, (3, 3, 2)) for k in range(count)]
            context += [here[z - 1] in self.active if z else own[0], after[z + 1]]
            image = self.image(p)
            state = 0 if image is None else 2 if image in self.active else 1
            if self.stream.decision("active", state, *context):
                self.active.add(p)

    def read_vacancy(self, voxels_):
        """The vacant voxels."""
        others = [p for p in voxels_ if p not in self.active]
        if not others:
            return set()
        self.vacancy = self.stream.symbol("vacancy", self.vacancy, count=3)
        if self.vacancy < 2:
            return set(() if self.vacancy else others)
        vacant, last = set(), 0
        for p in others:
            image = self.image(p)
            state = 0
            if image:
                is_vacant = image in vacant or (image not in self.kept and image not in voxels_)
                state = 1 + (image in self.active) + 2 * is_vacant
            last = self.stream.decision("vacant", state, last)
            if last:
                vacant.add(p)
        return vacant

    def read_codes(self, first, voxels_, vacant):
        self.flat = self.stream.decision("flat", self.flat)
        if self.flat:
            x, y, z = first
            code = signed(self.code((x - 1, y, z)) + self.stream.difference(0, "flat"))
            self.codes.update((p, code) for p in voxels_ if p not in vacant)
            return
        for n in range(0, 512, 8):
            here = voxels_[n:n + 8]
            if vacant.issuperset(here):
                continue
            rule, changes = self.errors.index(min(self.errors)), [0] * 6
            for p in here:
                if p in vacant:
                    continue
                rules = self.read_code(p, rule)
                for k, guess in enumerate(rules):
                    distance = abs(signed(self.codes[p] - guess)) & 0x7FFFFFFF
                    changes[k] += min(distance, 1 << 20)
            self.errors = [e + change - (e >> 4) for e, change in zip(self.errors, changes)]

    def read_code(self, p, rule):
        """Reads a code and returns the predictions that count; none if the code is common."""
        x, y, z = p
        a, b, c, ab, ac, bc, abc = codes = [self.code(q) for q in (
            (x - 1, y, z), (x, y - 1, z), (x, y, z - 1), (x - 1, y - 1, z), (x - 1, y, z - 1),
            (x, y - 1, z - 1), (x - 1, y - 1, z - 1))]
        image = self.image(p)
        if self.common:
            classes = [1 + self.common.index(n) if n in self.common else 0
                       for n in ([self.code(image)] if image else codes[:3])]
            known = self.stream.symbol("class", *classes)
            if known:
                self.codes[p] = self.common[known - 1]
                return []
        rules = guesses(*codes)
        if image and self.image_error <= self.errors[rule]:
            guess, width = self.code(image), min((4 * self.image_error).bit_length(), 30)
            base, context = max(width - 9, 0), ("image", width)
        else:
            guess, pairs = rules[rule], ((a, ab), (b, bc), (c, ac), (a, ac), (b, ab), (c, bc))
            spread = sum(abs(signed(m - n)) for m, n in pairs) + (self.errors[rule] >> 7)
            spread %= 1 << 32
            width = spread.bit_length()
            base = max(width - 5, 0)
            context = width, spread >> (width - 2) & 1 if width > 1 else 0
        self.codes[p] = signed(guess + self.stream.difference(base, *context))
        if image:
            distance = min(abs(signed(self.codes[p] - self.code(image))), 1 << 20)
            self.image_error += distance - (self.image_error >> 4)
        return rules


def voxels(data):
    r = Record(data)
    head = header_of_voxels(r)
    mirrors = r.get("3i")
    common = [r.get("i") for _ in range(r.get("B"))]
    blocks = 1 if max(mirrors) >= 0 else max(1, -(-head["bricks"] // 2048))
    sizes = [r.get("I") for _ in range(blocks)]
    starts = [r.at + sum(sizes[:n]) for n in range(blocks + 1)] + [len(data)]
    streams = [data[start:end] for start, end in zip(starts, starts[1:])]
    bricks_ = list(keys(head["bricks"], 3 * head["bits"], Decoder(streams[0])))
    held = {}
    for n in range(blocks):
        block_ = Block(head, Symbols(streams[1 + n]), mirrors, common)
        for key in bricks_[head["bricks"] * n // blocks:head["bricks"] * (n + 1) // blocks]:
            block_.brick(tuple(8 * sum((key >> (3 * b + a) & 1) << b for b in range(head["bits"]))
                               for a in range(3)))
        held.update((tuple(o + c for o, c in zip(head["origin"], p)),
                     (block_.codes[p], p in block_.active)) for p in block_.kept)
    return head, held


def carried(data):
    r = Record(data)
    record = {"name": r.sized(), "tree type": r.sized(), "half": r.get("B"),
              "vdb version": r.get("I"), "place": r.get("I"), "values at": r.get("Q")}
    r.end()
    return record


def vectors(data):
    r = Record(data)
    name = r.sized()
    r.end()
    return name


def grid_records(data):
    r = Record(data)
    records = []
    while r.at < len(data):
        records.append(grid(r.sized()))
    return records


def related(data):
    """The reference and the head of related voxels. Their stream is not decoded here."""
    r = Record(data)
    number = r.varint()
    reference = (number - 1, *r.get("2f")) if number else None
    if r.get("B") == 1:
        assert reference, "a reference"
        return reference, {"divisor": r.get("d")}
    head = {key: r.get(form) for key, form in (
        ("form", "B"), ("divisor", "d"), ("origin", "3i"), ("background", "f"))}
    head["palette"] = [r.get("f") for _ in range(r.get("I"))]
    return reference, head


def packed(data):
    """The rows of packed sections (kind, grid, chunk, flags, codec, stored, raw, bytes)."""
    assert xxh64(data[:-8]) == struct.unpack("<Q", data[-8:])[0], "checksum of packed sections"
    r = Record(data[:-8])
    assert r.get("BB") == (0x46, 0), "packed sections begin like a frame without a predecessor"
    rows = [[r.varint() for _ in range(5)] for _ in range(r.varint())]
    contents = []
    for row in rows:
        assert row[4] <= len(contents), "number of a content"
        if row[4] == len(contents):
            contents.append(None)
    for i in range(len(contents)):
        codec, stored = r.varint(), r.varint()
        contents[i] = codec, stored, r.varint() if codec else stored
    for i, (codec, stored, raw) in enumerate(contents):
        contents[i] = codec, stored, raw, r.get(f"{stored}s")
    r.end()
    return [(kind, g - 1 & NONE, c - 1 & NONE, flags, *contents[n])
            for kind, g, c, flags, n in rows]


def aligned(at):
    return (at + 7) // 8 * 8


def frame_entries(r):
    """The frames of a group: numbers, bytes, checksums and flags."""
    return [r.get("qQQI") for _ in range(r.get("I"))]


def sequence_index(data):
    r = Record(data)
    groups = [frame_entries(r) for _ in range(r.get("I"))]
    r.end()
    return groups


def content(name, data):
    if name in PLANES:
        n = len(data) // 4 // PLANES[name]
        values = struct.unpack(f"<{n * PLANES[name]}f", data)
        return [values[i * n:(i + 1) * n] for i in range(PLANES[name])]
    readers = {"grid": grid, "chunks": chunks, "bricks": bricks, "ellipsoids": ellipsoids,
               "voxels": voxels, "mask": voxels, "residual": voxels, "non-finite voxels": voxels,
               "layered ellipsoids": layered, "layer errors": layer_errors, "curve": curve,
               "carried grid": carried, "vector grid": vectors, "grid records": grid_records,
               "related voxels": related, "packed sections": packed, "sequence index": sequence_index}
    return readers[name](data) if name in readers else data


def read_group(data, entries, at, owned):
    """The frames of a group at an offset, as lists of number and bytes, and the end of the group."""
    r = Record(data)
    r.at = at
    assert frame_entries(r) == entries, "directory of a group"
    assert r.get("Q") == xxh64(data[at:r.at - 8]), "checksum of a directory"
    owned[at:r.at] = b"\1" * (r.at - at)
    frames, at = [], aligned(r.at)
    for number, size, hashed, flags in entries:
        assert flags in ((0, 1) if frames else (0,)), "flags of a frame"
        frame = data[at:at + size]
        assert len(frame) == size and xxh64(frame) == hashed, "checksum of a frame"
        owned[at:at + size] = b"\1" * size
        frames.append((number, frame))
        at = aligned(at + size)
    return frames, at


def read_frames(data, groups, index_at, owned):
    """The frames of a sequence, which belong to the file besides its sections."""
    all_frames, at = [], 48
    for entries in groups:
        frames, at = read_group(data, entries, at, owned)
        all_frames.append(frames)
    assert at == index_at, "the index follows the last group"
    numbers = [number for frames in all_frames for number, _ in frames]
    assert numbers == sorted(set(numbers)), "numbers of frames"
    return all_frames


def add(sections, minor, row):
    """Adds a section and returns the name of its kind; None if it is unknown."""
    kind, g, c, flags, codec, stored, raw, part = row
    name = KINDS.get(kind)
    assert kind != 39, "a kind of frames in the short form, which this reader refuses"
    if name is None:
        assert flags == 0, "an unknown kind is optional here"
        return None
    since = {8: 1, 38: 1, 9: 2, 64: 3, 11: 4, 12: 4, 41: 4, 42: 6}.get(kind, 0)
    assert minor >= since, f"a kind of version 1.{since}"
    optional = name in ("curve", "layer errors", "carried grid", "carried bytes", "vector grid")
    assert flags == (0 if optional else 1), "flags"
    assert codec in (0, 1, 2, 3) and (codec or raw == stored), "codec"
    assert codec == 0 or (codec == 3) == (name == "carried bytes"), "codec of a carried grid"
    assert (name, g, c) not in sections, "a section is there twice"
    decode = {0: lambda data, _: data, 1: coded_bytes, 2: coded_floats}.get(codec)
    sections[name, g, c] = content(name, decode(part, raw)) if decode else None
    return name


def read(data):
    """A dictionary {(kind, grid, chunk): content}; the content is None if Blosc compressed it. That of
    a sequence index is the list of groups of frames."""
    magic, major, minor, count, size, table, table_sum, header_sum = struct.unpack_from(
        "<8sHHIQQQQ", data)
    assert magic == bytes.fromhex("89 45 53 56 52 0D 0A 0A"), "magic"
    assert major == 1 and minor in range(7) and size == len(data), "version or size"
    assert table % 8 == 0 and header_sum == xxh64(data[:40]), "header checksum"
    assert table_sum == xxh64(data[table:table + 56 * count]), "table checksum"

    owned = bytearray(len(data))
    owned[0:48] = b"\1" * 48
    owned[table:table + 56 * count] = b"\1" * 56 * count
    sections, rows = {}, set()
    for i in range(count):
        kind, codec, flags, g, c, frame, layer, at, stored, raw, hashed = struct.unpack_from(
            "<IHHIIIIQQQQ", data, table + 56 * i)
        part = data[at:at + stored]
        row = kind, codec, flags, at, stored, raw, hashed
        assert at % 8 == 0 and len(part) == stored, "place"
        assert row in rows or not any(owned[at:at + stored]), "overlap"
        rows.add(row)
        owned[at:at + stored] = b"\1" * stored
        assert hashed == xxh64(part), "section checksum"
        assert frame == layer == 0, "frame and layer"
        name = add(sections, minor, (kind, g, c, flags, codec, stored, raw, part))
        if name == "packed sections":
            for packed_row in sections.pop((name, g, c)):
                assert add(sections, minor, packed_row) != name, "packed twice"
        if name == "sequence index":
            sections[name, g, c] = read_frames(data, sections[name, g, c], at, owned)
    assert not any(b for b, o in zip(data, owned) if not o), "padding"
    return sections


def check_one_ellipsoid(sections):
    g = sections["grid", 0, NONE]
    assert g["name"] == b"density" and g["background"] == 1.0 and g["kernel"] == 0
    assert g["kappa"] == 2.0 and abs(g["epsilon"] - 0.006) < 1e-9
    assert g["chunks"][0]["origin"] == (10, -20, 30) and g["chunks"][0]["count"] == 1
    low, high = g["chunks"][0]["box"][:3], g["chunks"][0]["box"][3:]
    assert all(a <= b <= c for a, b, c in zip(low, (11.5, -22.25, 1030.0), high))
    assert sections["centers", 0, 0] == [(1.5,), (-2.25,), (1000.0,)]
    assert sections["scales", 0, 0] == [(0.0,), (-1.0,), (2.5,)]
    assert [round(q[0], 6) for q in sections["rotations", 0, 0]] == [0.8, 0.0, -0.6, 0.0]
    assert sections["intensities", 0, 0] == [(0.75,)]
    assert len(sections) == 5


def check_level_set(sections):
    g = sections["grid", 0, NONE]
    assert (g["class"], g["values"], g["topology"], g["within range"]) == (1, 2, 1, 0)
    assert g["background"] == 0.3 and g["map type"] == b"NonlinearFrustumMap"
    assert g["affine"] is None and g["kernel"] == 1 and g["active voxels"] == 4
    assert sections["bricks", 0, NONE] == [(-8, -8, 1 << 20), (-8, 0, 0), (0, -16, 8), (0, 0, -8)]
    assert ("rotations", 0, 0) not in sections


def check_compressed(sections):
    """Expects ellipsoids whose sections are compressed."""
    turns = list(zip(*sections["rotations", 0, 0]))
    assert len(turns) == len(sections["intensities", 0, 0][0]) == 60
    assert all(abs(sum(q * q for q in turn) - 1) < 1e-5 for turn in turns)
    low, high = (sections["grid", 0, NONE]["chunks"][0]["box"][i:i + 3] for i in (0, 3))
    origin = sections["grid", 0, NONE]["chunks"][0]["origin"]
    for center in zip(*sections["centers", 0, 0]):
        assert all(a <= o + c <= b for a, o, c, b in zip(low, origin, center, high))


def check_kappas_and_chunks(sections):
    table = sections["chunks", 0, NONE]
    assert [c["count"] for c in table] == [4, 0, 4]
    assert table[1]["box"] == (2147483647,) * 3 + (-2147483648,) * 3
    assert table[2]["origin"] == (0, -4096, 10_000_000)
    assert not any(chunk == 1 for _, _, chunk in sections)
    assert ("kappas", 0, 0) not in sections and len(sections["kappas", 0, 2][0]) == 4
    for x, y, z, w in zip(*sections["rotations", 0, 2]):
        assert abs(x * x + y * y + z * z + w * w - 1) < 1e-6


# Ellipsoids of quantised.esvr: center, logarithms of scales, rotation, intensity.
QUANTISED = (
    {0: (36.875, 23.625, 0.1875, 2.24971008, 1.77249873,
         1.06804419, 0.901184678, 0.0994368941, 0.298310667, 0.298310667, 0.544600427),
     7: (37.5, 62.875, 4.1875, 2.27243423, 0.545384228,
         -0.272692114, 0.998946607, 0.0441941731, 0.00552427163, 0.0110485433, 0.176346809),
     19: (58.5, 47.5, 52.8125, 2.63602376, 1.81794751,
         -0.63628161, 0.717942834, 0.00552427163, 0.00552427163, 0.696058214, 0.197093487)},
    {0: (25.875, 13.75, 13.90625, 2.28232002, 1.85052979,
         0.843019128, 0.794165671, 0.00552427163, 0.00276213582, -0.60766989, 0.993603051),
     7: (48.25, 47.5, 24.5, 1.15144074, 0.986949205,
         -0.164491534, 0.775604606, -0.0883883461, -0.618718445, -0.0883883461, -0.0285928939),
     19: (60.625, 47.25, 62.875, 2.34400439, 1.72716117,
         1.19256365, 0.727863431, 0.0220970865, 0.0220970865, -0.685009718, 0.436041623)},
)


def check_quantised(sections):
    """Compares the ellipsoids with values that the library's own decoder printed as f32."""
    for chunk, expected in enumerate(QUANTISED):
        decoded = sections["ellipsoids", 0, chunk]
        assert len(decoded) == 20
        for i, numbers in expected.items():
            center, logs, turn, height = decoded[i]
            for a, b in zip((*center, *logs, *turn, height), numbers):
                assert abs(a - b) <= 1e-7 * max(1.0, abs(b)), (chunk, i, a, b)


def check_layered(sections):
    """Expects the ellipsoids of quantised.esvr, because the quantisation lattice is the same."""
    assert sections["layer errors", 0, NONE] == [(20.0, 1.0), (25.0, 0.5), (30.0, struct.unpack(
        "<f", struct.pack("<f", 1 / 3))[0]), (35.0, 0.25)]
    for chunk, expected in enumerate(QUANTISED):
        ends, blocks = sections["layered ellipsoids", 0, chunk]
        assert len(ends) == len(blocks) == 4 and ends[-1] == 20
        decoded = [e for _, block_ in blocks for e in block_]
        for numbers in expected.values():
            near = min(decoded, key=lambda e: sum(abs(a - b) for a, b in zip(e[0], numbers)))
            center, logs, turn, height = near
            for a, b in zip((*center, *logs, *turn, height), numbers):
                assert abs(a - b) <= 1e-7 * max(1.0, abs(b)), (chunk, a, b)
        low, high = (sections["chunks", 0, NONE][chunk]["box"][i:i + 3] for i in (0, 3))
        for box, ellipsoids_ in blocks:
            for axis in range(3):
                side = high[axis] - low[axis] + 1
                first = low[axis] + box[2 * axis] * side // 256
                last = low[axis] - (-(box[2 * axis + 1] + 1) * side // 256) - 1
                origin = sections["chunks", 0, NONE][chunk]["origin"][axis]
                assert all(first <= origin + e[0][axis] <= last for e in ellipsoids_)


def check_mask(sections):
    """Expects the active voxels of voxels.esvr."""
    assert sections["grid", 0, NONE]["topology"] == 2
    head, held = sections["mask", 0, NONE]
    assert head["palette"] == [0.0] and all(held[p] == (0, True) for p in held)
    assert set(held) == {
        (x, y, z) for x in range(-8, 0) for y in range(16, 24) for z in range(16)
        if z > 2 or (x, y, z) == (-5, 18, 1)}


def check_box_voxels(sections):
    record = sections["grid", 0, NONE]
    assert (record["topology"], record["active box"]) == (8, (-100, -24, 0, 300, -9, 2000))
    assert record["box voxels"] == [(-100, -20, 2000), (7, -9, 5), (300, -24, 0)]


def check_tone(sections):
    record = sections["grid", 0, NONE]
    assert (record["topology"], record["within range"], record["background"]) == (24, 1, 0.0)
    assert abs(record["tone"] - 0.0425) < 1e-8


def check_residual(sections):
    head, held = sections["residual", 0, NONE]
    assert (head["form"], head["divisor"], head["origin"]) == (0, 64.0, (8, -24, 1024))
    assert len(held) == 512 and all(active for _, active in held.values())
    assert {p: code for p, (code, _) in held.items() if code} == {
        (8, -24, 1024): 3, (9, -23, 1029): -2, (15, -17, 1031): 1}


def check_mirrored(sections):
    head, held = sections["voxels", 0, NONE]
    assert (head["form"], head["origin"], head["background"]) == (2, (0, -8, 8), 0.0)
    active = 0
    for x in range(16):
        for y in range(-8, 0):
            for z in range(8, 16):
                half = min(x, 15 - x)
                n = (half * 64 + (y + 8) * 8 + z - 8) * 37 % 512
                half_one = z % 3 == 0 or (x, y, z) == (9, -6, 10)
                wanted = 0.5 if half_one else 1.0 + n * n / 65536.0
                code, now = held[x, y, z]
                value = struct.unpack("<f", struct.pack("<i", code))[0]
                assert (value, now) == (wanted, half > 1 or n % 5 != 0), (x, y, z)
                active += now
    assert 512 < active < len(held) == 1024


def check_copied(sections):
    head, held = sections["voxels", 0, NONE]
    assert (head["form"], head["origin"], head["bricks"]) == (2, (0, 16, 0), 8)
    for x in range(32):
        for y in range(16, 24):
            for z in range(16):
                n = min(x, 31 - x) * 64 + (y & 7) * 8 + (z & 7)
                code, now = held.get((x, y, z), (0, False))
                value = struct.unpack("<f", struct.pack("<i", code))[0]
                assert (value, now) == (n * n % 11, n % 5 != 0), (x, y, z)
    assert 3200 < len(held) < 4096


def check_voxels(sections):
    head, held = sections["voxels", 0, NONE]
    assert (head["form"], head["origin"], head["background"]) == (3, (-8, 16, 0), 0.125)
    values = 0
    for x in range(-8, 0):
        for y in range(16, 24):
            for z in range(16):
                wanted = (x + y * z // 4 & 15) * 0.125
                active = z > 2 or (x, y, z) == (-5, 18, 1)
                if (x, y, z) not in held:
                    assert wanted == head["background"] and not active, (x, y, z)
                    continue
                code, now = held[x, y, z]
                assert (head["palette"][code], now) == (wanted, active), (x, y, z)
                values += 1
    assert values == len(held) > 800


def check_non_finite(sections):
    """Expects the few values, whose record counts the voxels of the section."""
    check_voxels(sections)
    record = sections["grid", 0, NONE]
    assert (record["topology"], record["not finite"]) == (32, [4, 0, 1])
    head, held = sections["non-finite voxels", 0, NONE]
    assert (head["form"], head["background"], head["palette"]) == (3, 0.0, [0.0, 1.0, 3.0])
    kinds = {p: head["palette"][code] for p, (code, active) in held.items() if active}
    assert kinds == {**{(-6, 19, z): 1.0 for z in range(4, 8)}, (-1, 23, 15): 3.0}
    assert kinds.keys() == held.keys(), "all others are vacant"


def check_two_grids(sections):
    assert sections["curve", 0, NONE] == [(100, 31.25, 20.5, 0.25, 10), (200, 41.25, 30.5, 0.125, 30)]


def check_twins(sections):
    """Expects the same sections in both grids, apart from the names in the records."""
    check_mask(sections)
    records = [sections["grid", g, NONE] for g in (0, 1)]
    assert [r.pop("name") for r in records] == [b"density", b"color"]
    assert records[0] == records[1]
    kinds = [{(k, c): v for (k, g, c), v in sections.items() if g == own and k != "grid"}
             for own in (0, 1)]
    assert kinds[0].keys() == kinds[1].keys() and ("mask", NONE) in kinds[0]
    assert kinds[0]["centers", 0] == kinds[1]["centers", 0] == [(1.5,), (-2.25,), (1000.0,)]
    assert kinds[0]["mask", NONE][1] == kinds[1]["mask", NONE][1]


def check_carried(sections):
    """Expects that the carried grids have the numbers after those of the one other grid."""
    first, second = sections["carried grid", 1, NONE], sections["carried grid", 2, NONE]
    assert first["name"] == second["name"] == b"velocity"
    assert first["tree type"] == b"Tree_vec3s_5_4_3" and first["half"] == 1
    assert first["vdb version"] == 224 and first["values at"] == 5
    assert (first["place"], second["place"]) == (0, 2)
    assert sections["carried bytes", 1, NONE] == b"vectors"
    assert sections["carried bytes", 2, NONE] == b"more vectors"


def check_vector_grid(sections):
    """Expects that the grids 1, 2 and 3 are the components of a grid of vectors."""
    assert sections["vector grid", 1, NONE] == b"velocity"
    names = [sections["grid", g, NONE]["name"] for g in (1, 2, 3)]
    assert names == [b"velocity.x", b"velocity.y", b"velocity.z"]


def check_related_voxels(sections):
    """Expects that the second grid refers to the first one, and the third one to none."""
    head = sections["voxels", 0, NONE][0]
    reference, own = sections["related voxels", 1, NONE]
    assert reference == (0, 2.0, 0.5) and own["form"] == 3 and own["origin"] == head["origin"]
    assert own["palette"] == [2 * value + 0.5 for value in head["palette"]]
    reference, own = sections["related voxels", 2, NONE]
    assert reference is None and own["palette"] == head["palette"]


def check_packed(sections):
    """Expects two grids whose records are in one section, and whose ellipsoids are the same."""
    records = sections["grid records", NONE, NONE]
    assert [r["name"] for r in records] == [b"density", b"temperature"]
    assert [r["affine"][1] for r in records] == [1 / 5, 1 / 103]
    for g in (0, 1):
        assert sections["centers", g, 0] == [(1.5,), (-2.25,), (1000.0,)]
        assert sections["intensities", g, 0] == [(0.75,)]


def check_sequence(sections):
    """Expects the frames one_ellipsoid and no_grid in a group, and voxels in another one."""
    assert sections.keys() == {("sequence index", NONE, NONE)}
    first, second = sections["sequence index", NONE, NONE]
    assert [number for number, _ in first + second] == [-2, 1, 3]
    check_one_ellipsoid(read(first[0][1]))
    assert read(first[1][1]) == {}
    check_voxels(read(second[0][1]))


CHECKS = {"one_ellipsoid": check_one_ellipsoid, "unknown_section": check_one_ellipsoid,
          "level_set": check_level_set, "quantised": check_quantised, "layered": check_layered,
          "voxels": check_voxels, "mask": check_mask, "box_voxels": check_box_voxels, "tone": check_tone,
          "residual": check_residual, "non_finite": check_non_finite,
          "mirrored_voxels": check_mirrored, "copied_voxels": check_copied,
          "two_grids": check_two_grids, "twins": check_twins, "carried": check_carried,
          "vector_grid": check_vector_grid, "related_voxels": check_related_voxels,
          "packed": check_packed, "compressed": check_compressed,
          "kappas_and_chunks": check_kappas_and_chunks}


def main():
    assert xxh64(b"") == 0xEF46DB3751D8E999 and xxh64(b"abc") == 0x44BC2CF5AD770999
    files = sorted(Path(sys.argv[1]).glob("*.esvr"))
    for path in [*files, Path(sys.argv[2])]:
        try:
            check = check_sequence if path not in files else CHECKS.get(path.stem, lambda _: None)
            check(read(path.read_bytes()))
        except (AssertionError, struct.error) as error:
            sys.exit(f"{path}: {error!r}")
    missing = CHECKS.keys() - {path.stem for path in files}
    if missing:
        sys.exit(f"{sys.argv[1]}: no {', '.join(sorted(missing))}")
    print(f"{len(files) + 1} files read")


if __name__ == "__main__":
    main()
