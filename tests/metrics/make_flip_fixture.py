#!/usr/bin/env python3
"""FLIP from the paper's equations. As a program, it prints the values that image_metrics_test.cpp compares with.

Needs numpy. The equations are those of Andersson et al., "FLIP: A Difference Evaluator for
Alternating Images", 2020. Every filter is the two-dimensional kernel of the paper; the library uses
products of one-dimensional ones instead. Colors are converted by numpy's matrix inverse.
tests/bench/calibration.py compares pictures of Cycles with it.
"""
import numpy as np

WIDTH, HEIGHT, BLOCK = 40, 28, 4
XYZ = np.array([[10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
                [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
                [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382]])
WHITE = XYZ @ np.ones(3)


def hashed(index):
    """A multiple of 2^-24 in [0, 1), which is exact in float32 and the same in C++."""
    return ((index * 2654435761) % 2**32 >> 8) / 2**24


def pictures():
    """A picture of blocks of one color, and the same picture with a quarter of noise."""
    a = np.zeros((HEIGHT, WIDTH, 3))
    b = np.zeros((HEIGHT, WIDTH, 3))
    for y in range(HEIGHT):
        for x in range(WIDTH):
            for c in range(3):
                a[y, x, c] = hashed(((y // BLOCK) * 100 + x // BLOCK) * 3 + c)
                noise = hashed(1000003 + (y * WIDTH + x) * 3 + c)
                b[y, x, c] = np.float32(0.75 * a[y, x, c] + 0.25 * noise)
    return a, b


def opponent(v):
    return np.stack((116 * v[..., 1] - 16, 500 * (v[..., 0] - v[..., 1]),
                     200 * (v[..., 1] - v[..., 2])), -1)


def ycxcz(srgb):
    linear = np.where(srgb > 0.04045, ((srgb + 0.055) / 1.055) ** 2.4, srgb / 12.92)
    return opponent(linear @ XYZ.T / WHITE)


def linear_rgb(c):
    y = (c[..., 0] + 16) / 116
    v = np.stack((y + c[..., 1] / 500, y, y - c[..., 2] / 200), -1)
    return v * WHITE @ np.linalg.inv(XYZ).T


def hunt_lab(linear):
    v = linear @ XYZ.T / WHITE
    d = 6 / 29
    lab = opponent(np.where(v > d**3, np.cbrt(v), v / (3 * d * d) + 4 / 29))
    return lab * np.stack((np.ones_like(lab[..., 0]), lab[..., 0] / 100, lab[..., 0] / 100), -1)


def hyab(a, b):
    d = a - b
    return np.abs(d[..., 0]) + np.hypot(d[..., 1], d[..., 2])


def eye_kernel(ppd, terms):
    radius = int(np.ceil(3 * np.sqrt(0.04 / (2 * np.pi**2)) * ppd))
    x, y = np.meshgrid(np.arange(-radius, radius + 1), np.arange(-radius, radius + 1))
    z = (x / ppd) ** 2 + (y / ppd) ** 2
    kernel = sum(a * np.sqrt(np.pi / b) * np.exp(-np.pi**2 * z / b) for a, b in terms)
    return kernel / kernel.sum()


def feature_kernel(ppd, point):
    deviation = 0.5 * 0.082 * ppd
    radius = int(np.ceil(3 * deviation))
    x, y = np.meshgrid(np.arange(-radius, radius + 1), np.arange(-radius, radius + 1))
    g = np.exp(-(x**2 + y**2) / (2 * deviation**2))
    k = (x**2 / deviation**2 - 1) * g if point else -x * g
    return np.where(k < 0, k / -k[k < 0].sum(), k / k[k > 0].sum())


def correlate(plane, kernel):
    """The sum over a kernel around each pixel. The picture goes on as at its border."""
    sides = [(n // 2, n // 2) for n in kernel.shape]
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(plane, sides, mode='edge'), kernel.shape)
    return np.einsum('yxij,ij->yx', windows, kernel)


def seen(picture, ppd):
    terms = ([(1, 0.0047)], [(1, 0.0053)], [(34.1, 0.04), (13.5, 0.025)])
    planes = [correlate(picture[..., c], eye_kernel(ppd, terms[c])) for c in range(3)]
    return hunt_lab(np.clip(linear_rgb(np.stack(planes, -1)), 0, 1))


def features(picture, ppd, point):
    kernel = feature_kernel(ppd, point)
    y = (picture[..., 0] + 16) / 116
    return np.hypot(correlate(y, kernel), correlate(y, kernel.T))


def flip(a, b, ppd):
    """The difference of each pixel of two sRGB pictures, 0 to 1, with `ppd` pixels per degree."""
    a, b = ycxcz(a), ycxcz(b)
    largest = hyab(hunt_lab(np.array([0., 1, 0])), hunt_lab(np.array([0., 0, 1]))) ** 0.7
    d = hyab(seen(a, ppd), seen(b, ppd)) ** 0.7
    knee = 0.4 * largest
    color = np.where(d < knee, 0.95 / knee * d, 0.95 + (d - knee) / (largest - knee) * 0.05)
    feature = np.maximum(*(np.abs(features(a, ppd, p) - features(b, ppd, p)) for p in (0, 1)))
    return color ** (1 - np.sqrt(feature / np.sqrt(2)))


if __name__ == '__main__':
    for ppd in (0.7 * 3840 / 0.7 * np.pi / 180, 20.0):
        error = flip(*pictures(), ppd)
        print(ppd, repr(error.mean()), repr(error.max()), repr(error[0, 0]), repr(error[13, 21]))
