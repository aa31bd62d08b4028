#!/usr/bin/env python3
"""Makes the tables of docs/resolution.md: files of one skeleton at rising resolutions, at 25 dB.

    resolution_series.py fit  --bin BUILD --swc FILE.swc --out OUT [--device cuda] [--resolutions 256 512 ...]
    resolution_series.py page --bin BUILD --swc FILE.swc --out OUT [--resolutions 256 512 ...]

`fit` rasterises the skeleton and fits .esvr files with different numbers of ellipsoids until the PSNR over
the active voxels of one reaches 25 dB by at most 0.3 dB. It keeps the smallest file that reaches 25 dB. `page`
prints Markdown tables of these files, of the smallest NanoVDB and ZFP files among SETTINGS that reach 25 dB,
and of the exponents by which files grow with the resolution.
"""
import argparse
import json
import math
import pathlib
import sys

from run_program import run

TARGET = 25.0  # dB over the active voxels
NEAR = 0.3     # a fit that exceeds TARGET by no more ends the search, dB
FIRST = 1500   # first number of ellipsoids at a resolution of 256
STEP = 1.7
MAX_FITS = 8

SETTINGS = ['nvdb-fp4-zip', *(f'nvdb-fpn-zip,tolerance={t}' for t in (0.4, 0.2, 0.15, 0.1, 0.07)),
            *(f'zfp,accuracy={2.0 ** -k}' for k in range(-2, 4))]


class Resolution:
    def __init__(self, options, resolution):
        self.options, self.resolution = options, resolution
        self.volume = options.out / f'tree-{resolution}.vdb'
        self.best = options.out / f'tree-{resolution}.esvr'
        self.report = self.best.with_suffix('.report.json')

    def make_volume(self):
        if not self.volume.exists():
            run([self.options.bin / 'samples/swc2vdb', self.options.swc, self.volume,
                 '--resolution', self.resolution])

    def fit(self, count):
        """Fits and returns the PSNR over the active voxels. The smallest file that reaches TARGET is kept."""
        path = self.options.out / 'attempt.esvr'
        report = run([self.options.bin / 'vdb2esvr/vdb2esvr', self.volume, path, '--count', count,
                    '--representation', 'ellipsoids',
                    '--device', self.options.device, '--report', '-', '-f'])
        psnr = json.loads(report)['grids'][0]['metrics']['psnr_active']
        print(self.resolution, count, psnr, file=sys.stderr, flush=True)
        if psnr >= TARGET and (not self.best.exists() or path.stat().st_size < self.best.stat().st_size):
            path.replace(self.best)
            self.report.write_text(report)
        return psnr

    def search(self):
        """Multiplies or divides the count until 25 dB lies between two fits; then interpolates log(count)."""
        self.make_volume()
        if self.report.exists():
            return
        points = []
        count = self.first_count()
        for _ in range(MAX_FITS):
            points.append((math.log(count), self.fit(count)))
            if TARGET <= points[-1][1] <= TARGET + NEAR:
                return
            count = self.next_count(points)

    def first_count(self):
        """1.5 times the number of ellipsoids at half the resolution, if that was fitted."""
        coarser = Resolution(self.options, self.resolution // 2).report
        if not coarser.exists():
            return FIRST * self.resolution // 256
        return json.loads(coarser.read_text())['grids'][0]['ellipsoids'] * 3 // 2

    @staticmethod
    def next_count(points):
        below = max((p for p in points if p[1] < TARGET), key=lambda p: p[1], default=None)
        above = min((p for p in points if p[1] >= TARGET), key=lambda p: p[1], default=None)
        if not above:
            return int(math.exp(below[0]) * STEP)
        if not below:
            return int(math.exp(above[0]) / STEP)
        share = (TARGET + NEAR / 2 - below[1]) / (above[1] - below[1])
        return int(math.exp(below[0] + share * (above[0] - below[0])))

    def rows(self):
        """The row of ESVR, and the smallest row of each other form that reaches 25 dB."""
        self.make_volume()
        kept = self.options.out / f'tree-{self.resolution}.table.json'
        if not kept.exists():
            settings = [word for setting in SETTINGS for word in ('--row', setting)]
            run([self.options.bin / 'compare/esvr-compare', 'table', self.volume, self.best,
                 *settings, '--runs', '1', '--max-dense', '1GB', '--report', kept, '-q'])
        table = json.loads(kept.read_text())
        ours = next(r for r in table['rows'] if r['group'] == 'ESVR')
        best = {}
        for row in table['rows']:
            if row['group'] == 'ESVR' or reached(row) < TARGET:
                continue
            if row['name'] not in best or row['bytes'] < best[row['name']]['bytes']:
                best[row['name']] = row
        return table, [dict(ours, name='ESVR')] + list(best.values())


def reached(row):
    """The PSNR that a row reaches. A report has null if there is no error, and no key without figures."""
    if 'psnr_active' not in row:
        return -math.inf
    return math.inf if row['psnr_active'] is None else row['psnr_active']


def exponent(points):
    """The slope of log(bytes) over log(resolution) by least squares."""
    if len(points) < 2:
        return float('nan')
    xs, ys = [math.log(p[0]) for p in points], [math.log(p[1]) for p in points]
    mx, my = sum(xs) / len(xs), sum(ys) / len(ys)
    return sum((x - mx) * (y - my) for x, y in zip(xs, ys)) / sum((x - mx) ** 2 for x in xs)


def figure(row, key, form):
    return form.format(row[key]) if row.get(key) is not None else '-'


def print_fits(options):
    print('| resolution | active voxels | ellipsoids | bytes | PSNR active | PSNR box | seconds |')
    print('|--:|--:|--:|--:|--:|--:|--:|')
    for resolution in options.resolutions:
        report = json.loads(Resolution(options, resolution).report.read_text())
        grid = report['grids'][0]
        print(f"| {resolution} | {grid['source']['active_voxels']} | {grid['ellipsoids']} | "
              f"{report['output']['bytes']} | {grid['metrics']['psnr_active']:.2f} | "
              f"{grid['metrics']['psnr_box']:.2f} | {report['seconds']['total']:.1f} |")


def page(options):
    print_fits(options)
    print('\n| resolution | row | bytes | times ESVR | PSNR active | PSNR box | decode s |')
    print('|--:|---|--:|--:|--:|--:|--:|')
    sizes = {}
    for resolution in options.resolutions:
        _, rows = Resolution(options, resolution).rows()
        ours = rows[0]['bytes']
        for row in rows:
            print(f"| {resolution} | {row['name']} | {row['bytes']} | {row['bytes'] / ours:.1f} | "
                  f"{figure(row, 'psnr_active', '{:.2f}')} | {figure(row, 'psnr_box', '{:.2f}')} | "
                  f"{figure(row, 'decode_s', '{:.4f}')} |")
            sizes.setdefault(row['name'], []).append((resolution, row['bytes']))
    print('\n| form | growth of the file, as a power of the resolution | resolutions |')
    print('|---|--:|---|')
    for name, points in sizes.items():
        print(f'| {name} | {exponent(points):.2f} | {points[0][0]} to {points[-1][0]} |')


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('job', choices=('fit', 'page'))
    parser.add_argument('--bin', type=pathlib.Path, required=True, help='the build folder')
    parser.add_argument('--swc', type=pathlib.Path, required=True)
    parser.add_argument('--out', type=pathlib.Path, required=True)
    parser.add_argument('--device', default='auto')
    parser.add_argument('--resolutions', type=int, nargs='+', default=[256, 512, 1024, 2048, 4096])
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    if options.job == 'page':
        return page(options)
    for resolution in options.resolutions:
        Resolution(options, resolution).search()
    return None


if __name__ == '__main__':
    main()
