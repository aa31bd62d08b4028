#!/usr/bin/env python3
"""Measures the files of skeletons at rising resolutions, and writes docs/resolution.md.

    resolution_series.py fit    --bin BUILD --swc FILE.swc... --out OUT [--device cuda]
    resolution_series.py rivals --bin BUILD --swc FILE.swc... --out OUT [--sz3 PROGRAM]
    resolution_series.py page   --swc FILE.swc... --out OUT [--page docs/resolution.md]

`fit` rasterises the skeletons and fits .esvr files with different numbers of ellipsoids until the PSNR over the
active voxels of one exceeds a target by at most 0.3 dB. The smallest file that reaches the target is kept. `rivals`
searches the smallest files of the other forms that reach the targets (`esvr-compare table --psnr-active`), and `page`
writes the page. `fit` and `rivals` go on where they were interrupted; remove OUT to begin anew. `--resolutions` and
`--targets` choose a part of the work. Without --sz3 (the program of https://github.com/szcompressor/SZ3), there are no
rows of SZ3.
"""
import argparse
import json
import math
import pathlib
import sys

from run_program import run

NEAR = 0.3            # a fit that exceeds its target by no more ends the search, dB
FIRST = 1500          # first number of ellipsoids of a skeleton, at any resolution
FAR = 3               # dB beyond which interpolation between two fits is not trusted
DB_PER_DOUBLING = 4   # expected gain of twice the ellipsoids, for numbers outside of those that were tried
MAX_STEP = 6          # largest factor between two numbers of ellipsoids
MAX_FITS = 9
MAX_DENSE = '1GB'     # largest array for compressors of arrays
OURS = 'ESVR'
FORMS = (OURS, 'SZ3', 'ZFP accuracy of bricks', 'NanoVDB FpN Zip', 'NanoVDB Fp4 Zip', 'ZFP accuracy')
HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]


class Volume:
    """A skeleton at a resolution, with its files in the folder OUT."""

    def __init__(self, options, swc, resolution):
        self.options, self.swc, self.resolution = options, swc, resolution
        self.stem = options.out / f'{swc.stem}-{resolution}'
        self.path = self.stem.with_name(self.stem.name + '.vdb')

    def file(self, ending):
        return self.stem.with_name(self.stem.name + ending)

    def make(self):
        if not self.path.exists():
            run([self.options.bin / 'samples/swc2vdb', self.swc, self.path, '--resolution', self.resolution])

    def ours(self, target):
        """The report of the smallest .esvr file that reaches a target, and the path of the file."""
        report, path = self.file(f'-{target:g}dB.json'), self.file(f'-{target:g}dB.esvr')
        return (json.loads(report.read_text()) if report.exists() else None), path

    def search_rivals(self):
        if self.file('.table.json').exists():
            return
        self.make()
        words = [word for t in self.options.targets for word in ('--psnr-active', t)]
        if self.options.sz3:
            words += ['--external-command', f"SZ3='{ROOT / 'samples/compressors/sz3'}' '{self.options.sz3}'"]
        print(self.path.name, file=sys.stderr, flush=True)
        run([self.options.bin / 'compare/esvr-compare', 'table', self.path, '--rows', 'matched,zfp', *words,
             '--runs', '1', '--max-dense', MAX_DENSE, '--report', self.file('.table.json'), '-q'])

    def rivals(self):
        """The rows of the other forms, for all targets."""
        kept = self.file('.table.json')
        if not kept.exists():
            sys.exit(f'{kept} is missing; run `resolution_series.py rivals` first')
        return json.loads(kept.read_text())['rows']


class Search:
    """The fits of one volume. Each fit counts for all targets."""

    def __init__(self, volume):
        self.volume, self.options, self.psnr = volume, volume.options, {}

    def run(self):
        self.volume.make()
        for target in self.options.targets:
            for _ in range(MAX_FITS):
                count = self.next_count(target)
                if self.is_near(target) or count in self.psnr:
                    break
                self.fit(count)

    def is_near(self, target):
        report, _ = self.volume.ours(target)
        return report is not None and psnr_of(report) <= target + NEAR

    def fit(self, count):
        path = self.options.out / 'attempt.esvr'
        report = run([self.options.bin / 'vdb2esvr/vdb2esvr', self.volume.path, path, '--count', count,
                      '--representation', 'ellipsoids', '--device', self.options.device, '--report', '-', '-f'])
        psnr = psnr_of(json.loads(report))
        print(self.volume.path.name, count, psnr, file=sys.stderr, flush=True)
        self.psnr[count] = psnr
        for target in self.options.targets:
            kept, esvr = self.volume.ours(target)
            if psnr >= target and (not kept or path.stat().st_size < kept['output']['bytes']):
                esvr.write_bytes(path.read_bytes())
                self.volume.file(f'-{target:g}dB.json').write_text(report)

    def next_count(self, target):
        """Interpolates the logarithm of the number between two fits, or goes on beyond all of them.

        It is at least a quarter of the way from either fit if they are far from the target.
        """
        if not self.psnr:
            return FIRST
        aim = target + NEAR / 2
        below = max(((p, n) for n, p in self.psnr.items() if p < target), default=None)
        above = min(((p, n) for n, p in self.psnr.items() if p >= target), default=None)
        if below and above:
            share = (aim - below[0]) / (above[0] - below[0])
            if above[0] - target > FAR or target - below[0] > FAR:
                share = min(max(share, 0.25), 0.75)
            return max(1, round(below[1] * (above[1] / below[1]) ** share))
        psnr, count = below or above
        return max(1, round(count * min(max(2 ** ((aim - psnr) / DB_PER_DOUBLING), 1 / MAX_STEP), MAX_STEP)))


def psnr_of(report):
    return report['grids'][0]['metrics']['psnr_active']


def number(value, form):
    return '-' if value is None else format(value, form)


def row_of_ours(report, path):
    grid = report['grids'][0]
    return {'bytes': path.stat().st_size, 'psnr_active': psnr_of(report),
            'psnr_box': grid['metrics']['psnr_box'], 'ellipsoids': grid['ellipsoids'],
            'seconds': report['seconds']['total'], 'active': grid['source']['active_voxels']}


def rows_of(volume, target):
    """The rows of all forms that reach the target, by name."""
    report, path = volume.ours(target)
    if not report:
        sys.exit(f'{volume.path.name} has no file of {target:g} dB; run `resolution_series.py fit` first')
    rows = {OURS: row_of_ours(report, path)}
    for row in volume.rivals():
        if row['group'].startswith(f'at {target:.2f} dB') and row.get('bytes'):
            rows[row['name']] = row
    return rows


def exponent(points):
    """The slope of log(bytes) over log(resolution) by least squares."""
    xs, ys = [math.log(p[0]) for p in points], [math.log(p[1]) for p in points]
    mx, my = sum(xs) / len(xs), sum(ys) / len(ys)
    return sum((x - mx) * (y - my) for x, y in zip(xs, ys)) / sum((x - mx) ** 2 for x in xs)


def exponent_table(options, measured, target):
    """The exponent of each form and skeleton, with the last resolution where a dense array ends the series."""
    lines = [f'| form | {" | ".join(swc.stem for swc in options.swc)} |', '|---|' + '--:|' * len(options.swc)]
    last = options.resolutions[-1]
    for form in FORMS:
        cells = []
        for swc in options.swc:
            points = [(r, measured[swc, r, target][form]['bytes']) for r in options.resolutions
                      if form in measured[swc, r, target]]
            if len(points) < 2:
                cells.append('-')
                continue
            end = '' if points[-1][0] == last else f' (to {points[-1][0]})'
            cells.append(f'{exponent(points):.2f}{end}')
        if any(cell != '-' for cell in cells):
            lines.append(f'| {form} | ' + ' | '.join(cells) + ' |')
    return '\n'.join(lines)


def files_table(options, measured, swc, target):
    lines = ['| resolution | form | bytes | times ESVR | PSNR active | PSNR box | setting |', '|--:|---|--:|--:|--:|--:|---|']
    for resolution in options.resolutions:
        rows = measured[swc, resolution, target]
        ours = rows[OURS]['bytes']
        for form in FORMS:
            if form not in rows:
                continue
            row = rows[form]
            setting = row.get('setting') or f"{row['ellipsoids']} ellipsoids"
            lines.append(f"| {resolution} | {form} | {row['bytes']:,} | {row['bytes'] / ours:.1f} | "
                         f"{number(row['psnr_active'], '.2f')} | {number(row['psnr_box'], '.2f')} | {setting} |")
    return '\n'.join(lines)


def fits_table(options, measured):
    lines = ['| skeleton | resolution | active voxels | ' +
             ' | '.join(f'{t:g} dB: ellipsoids | seconds' for t in options.targets) + ' |',
             '|---|--:|--:|' + '--:|--:|' * len(options.targets)]
    for swc in options.swc:
        for resolution in options.resolutions:
            rows = [measured[swc, resolution, t][OURS] for t in options.targets]
            cells = ' | '.join(f"{row['ellipsoids']:,} | {row['seconds']:.1f}" for row in rows)
            lines.append(f"| {swc.stem} | {resolution} | {rows[0]['active']:,} | {cells} |")
    return '\n'.join(lines)


def least_ratios(options, measured, target):
    """The smallest ratio of another form's bytes to ours, at the first and the last resolution."""
    def least(resolution):
        return min(rows[form]['bytes'] / rows[OURS]['bytes'] for swc in options.swc
                   for rows in [measured[swc, resolution, target]] for form in rows if form != OURS)
    return least(options.resolutions[0]), least(options.resolutions[-1])


def finding(options, measured):
    lines = []
    for target in options.targets:
        first, last = least_ratios(options, measured, target)
        lines.append(f'- At {target:g} dB, the smallest file of any other form has at least {first:.1f} times the bytes of '
                     f'ESVR at a resolution of {options.resolutions[0]}, and at least {last:.1f} times at '
                     f'{options.resolutions[-1]}.')
    return '\n'.join(lines)


def devices(options):
    reports = [Volume(options, swc, r).ours(t)[0] for swc in options.swc for r in options.resolutions
               for t in options.targets]
    return ' and '.join(sorted({report['grids'][0]['fit']['device'] for report in reports}))


def page(options):
    measured = {(swc, r, t): rows_of(Volume(options, swc, r), t)
                for swc in options.swc for r in options.resolutions for t in options.targets}
    text = (HERE / 'resolution_page.md').read_text()
    parts = {'FINDING': finding(options, measured), 'FITS': fits_table(options, measured), 'NEAR': f'{NEAR:g}', 'DEVICES': devices(options),
             'MAX_DENSE': MAX_DENSE.replace('GB', ' GB'),
             'EXPONENTS': '\n\n'.join(f'At {t:g} dB:\n\n{exponent_table(options, measured, t)}' for t in options.targets),
             'FILES': '\n\n'.join(f'### {swc.stem}, {t:g} dB\n\n{files_table(options, measured, swc, t)}'
                                  for swc in options.swc for t in options.targets)}
    for name, part in parts.items():
        text = text.replace('{' + name + '}', part)
    options.page.write_text(text)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('job', choices=('fit', 'rivals', 'page'))
    parser.add_argument('--bin', type=pathlib.Path, help='the build folder')
    parser.add_argument('--swc', type=pathlib.Path, nargs='+', required=True)
    parser.add_argument('--out', type=pathlib.Path, required=True)
    parser.add_argument('--device', default='auto')
    parser.add_argument('--page', type=pathlib.Path, default=ROOT / 'docs/resolution.md')
    parser.add_argument('--sz3', type=pathlib.Path, help='the program sz3')
    parser.add_argument('--resolutions', type=int, nargs='+', default=[256, 512, 1024, 2048, 4096])
    parser.add_argument('--targets', type=float, nargs='+', default=[25.0, 35.0], help='PSNR over the active voxels, dB')
    options = parser.parse_args()
    if options.job == 'page':
        page(options)
        return
    if not options.bin:
        parser.error(f'{options.job} needs --bin')
    options.out.mkdir(parents=True, exist_ok=True)
    for swc in options.swc:
        for resolution in options.resolutions:
            volume = Volume(options, swc, resolution)
            volume.search_rivals() if options.job == 'rivals' else Search(volume).run()


if __name__ == '__main__':
    main()
