#!/usr/bin/env python3
"""Prints the figures that compare_volumes_test.cpp and the SSIM values that ssim_test.cpp compare with, by scikit-image and numpy.

Needs numpy and scikit-image (Debian: python3-skimage; the values in the tests are of 0.19.3).

The volumes are a 12^3 block of hashed values in the middle of a 32^3 box of background. So the
windows of the outermost 5 voxels see background only, and how an implementation treats the border
of an array does not matter: scikit-image's mean over the interior (22^3 windows) and the closed
form for the shell around it make up the mean over the box. For the figures, active are the block's voxels above a
third, of the candidate those above 0.35.
"""
import numpy as np
from skimage.metrics import mean_squared_error, peak_signal_noise_ratio, structural_similarity

SIDE, FIRST, LAST = 32, 10, 22
PAD = 5


def hashed(index):
    """A multiple of 2^-24 in [0, 1), which is exact in float32 and the same in C++."""
    return ((index * 2654435761) % 2**32 >> 8) / 2**24


def volumes(background_a, background_b):
    a = np.full((SIDE,) * 3, background_a, dtype=np.float64)
    b = np.full((SIDE,) * 3, background_b, dtype=np.float64)
    for x in range(FIRST, LAST):
        for y in range(FIRST, LAST):
            for z in range(FIRST, LAST):
                i = (x * SIDE + y) * SIDE + z
                a[x, y, z] = hashed(i)
                b[x, y, z] = 0.75 * hashed(i) + 0.25 * hashed(i + 1000003)
    return a, b.astype(np.float32).astype(np.float64)


def box_mean(background_a, background_b, peak):
    a, b = volumes(background_a, background_b)
    interior = structural_similarity(a, b, data_range=peak, gaussian_weights=True, sigma=1.5,
                                     use_sample_covariance=False)
    c1 = (0.01 * peak) ** 2
    shell = (2 * background_a * background_b + c1) / (background_a**2 + background_b**2 + c1)
    inside = (SIDE - 2 * PAD) ** 3
    return (interior * inside + shell * (SIDE**3 - inside)) / SIDE**3


def figures(background):
    a, b = volumes(background, background)
    block = np.zeros(a.shape, bool)
    block[FIRST:LAST, FIRST:LAST, FIRST:LAST] = True
    active_a, active_b = block & (a > 1 / 3), block & (b > 0.35)
    peak = a[active_a].max()
    errors = np.abs(a - b)
    union = active_a | active_b
    return {
        'peak': peak,
        'psnr_box': peak_signal_noise_ratio(a, b, data_range=peak),
        'psnr_active': 10 * np.log10(peak**2 / mean_squared_error(a[active_a], b[active_a])),
        'max_error': errors.max(),
        'p999': np.percentile(errors[union], 99.9, method='inverted_cdf'),
        'iou': (active_a & active_b).sum() / union.sum(),
        'mass_a': (a - background).sum(),
        'mass_b': (b - background).sum(),
    }


if __name__ == '__main__':
    for background in (0.0, 0.25):
        print('figures', background, {k: float(v) for k, v in figures(background).items()})
    for backgrounds in ((0.0, 0.0), (0.25, 0.25), (0.0, 0.125)):
        for peak in (1.0, 4.0):
            print('SSIM', *backgrounds, peak, repr(box_mean(*backgrounds, peak)))
