#!/usr/bin/env python3
"""Prints the figures that compare_volumes_test.cpp compares with, by scikit-image and numpy.

Needs numpy and scikit-image (Debian: python3-skimage; the values in the test are of 0.19.3). The
volumes are those of make_ssim_fixture.py: a 12^3 block of hashed values in a 32^3 box of background.
Active are the block's voxels above a third, of the candidate those above 0.35.
"""
import numpy as np
from skimage.metrics import mean_squared_error, peak_signal_noise_ratio

from make_ssim_fixture import FIRST, LAST, volumes


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
        print(background, {k: float(v) for k, v in figures(background).items()})
