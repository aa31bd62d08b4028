#!/usr/bin/env python3
"""Makes docs/comparison.md, which compares ESVR with other formats on eight volumes at two sizes.

    comparison.py sizes --bin BUILD --data DATA
    comparison.py fit   --bin BUILD --data DATA --out OUT [--device cuda]
    comparison.py page  --bin BUILD --data DATA --out OUT --page docs/comparison.md [--device cuda]

`sizes` prints the two sizes of every volume: the size of its half-float Blosc VDB divided by 50 and by
10. `fit` makes the .esvr files and their reports. `page` measures every row with esvr-compare and writes
the page; it does not repeat measurements that OUT already holds.

Rows of compressors that esvr-compare does not run come from external_points.csv (external_points.md).
"""
import argparse
import csv
import json
import pathlib

from run_program import run

BOXES = {'aneurism': '0,0,0,255,255,255', 'hydrogen_atom': '0,0,0,127,127,127'}
FILES = {'aneurism': 'aneurism', 'smoke1': 'smoke1', 'wdas': 'wdas_cloud_sixteenth',
         'hydrogen_atom': 'hydrogen_atom', 'dragon': 'dragon_with_xform',
         'cube_levelset': 'cube_levelset', 'neuron_rp140212': 'neuron_rp140212',
         'neuron_m207': 'neuron_m207'}
PARTS = (50, 10)
LOW, HIGH = PARTS
IMAGES = ['--images', '4', '--image-size', '400']
MEASURE = ['--rows', 'matched,zfp', '--runs', '3', '--max-dense', '1GB']
HERE = pathlib.Path(__file__).parent


class Volume:
    def __init__(self, name, options):
        self.name, self.options = name, options
        self.path = options.data / f'{FILES[name]}.vdb'
        self.box = ['--box', BOXES[name]] if name in BOXES else []
        self.compare = options.bin / 'compare/esvr-compare'

    def half_blosc(self):
        text = run([self.compare, 'table', self.path, *self.box, '--rows', 'none', '--runs', 1,
                    '--report', '-'])
        return json.loads(text)['half_blosc_bytes']

    def esvr(self, part):
        return self.options.out / f'{self.name}-{part}.esvr'

    def report(self, part):
        return self.esvr(part).with_suffix('.report.json')

    def fit(self, part, size):
        run([self.options.bin / 'vdb2esvr/vdb2esvr', self.path, self.esvr(part), *self.box,
             '--size', size, '--device', self.options.device, '--report', self.report(part), '-f'])

    def time_of(self, part):
        """The seconds and the device of the fit."""
        report = json.loads(self.report(part).read_text())
        grid = report['grids'][0]
        return {'seconds': report['seconds']['total'], 'device': grid['fit']['device'],
                'ellipsoids': grid['ellipsoids']}

    def table(self):
        """All rows of the volume. They are kept in OUT and read from there the next time."""
        kept = self.options.out / f'{self.name}.table.json'
        if not kept.exists():
            words = [self.compare, 'table', self.path, *[self.esvr(p) for p in PARTS], *self.box,
                     *MEASURE, *IMAGES, '--device', self.options.device, '--report', kept, '-q']
            run(words)
        return json.loads(kept.read_text())


def psnr(row, key='psnr_box'):
    """The PSNR of a row. A report has null if there is no error at all, and no key without figures."""
    if key not in row:
        return None
    return float('inf') if row[key] is None else row[key]


def text(value, digits=2):
    if value is None:
        return '-'
    return 'exact' if value == float('inf') else f'{value:.{digits}f}'


def external_points(name, budget, peak):
    """The row of each external compressor with the highest PSNR that takes at most `budget` bytes."""
    best = {}
    with open(HERE / 'external_points.csv', newline='') as stream:
        for row in csv.DictReader(stream):
            if row['dataset'] != FILES[name] or int(row['bytes']) > budget:
                continue
            family = row['method'].split('-')[0]
            point = {'name': row['method'], 'bytes': int(row['bytes']), 'external': True,
                     'psnr_box': float(row['psnr_box_db']),
                     'psnr_active': float(row['psnr_nonzero_db']),
                     'max_error': float(row['max_error_rel']) * peak,
                     'encode_s': float(row['enc_s']),
                     'decode_s': float(row['dec_s']), 'setting': row['parameter']}
            if family not in best or point['psnr_box'] > best[family]['psnr_box']:
                best[family] = point
    return list(best.values())


class Size:
    """The rows of one volume within one budget of bytes."""

    def __init__(self, volume, table, part):
        self.part = part
        self.ours = next(r for r in table['rows'] if r['name'] == volume.esvr(part).name)
        self.bricks = next(r for r in table['rows']
                           if r['name'] == volume.esvr(part).name + ', bricks')
        self.budget = self.ours['bytes']
        matched = [r for r in table['rows'] if r['group'] == f'at {self.budget} bytes']
        self.rows = [r for r in matched if 'psnr_box' in r]
        self.missing = [r for r in matched if 'psnr_box' not in r]
        self.externals = external_points(volume.name, self.budget, table['peak'])
        self.time = volume.time_of(part)

    def all_others(self):
        return self.rows + self.externals

    def built_in(self):
        """The rows of OpenVDB, of NanoVDB as it lies in memory, and of ZFP."""
        return [r for r in self.rows if r['name'].startswith(('OpenVDB', 'ZFP')) or
                r['name'].endswith(' raw')]

    def better(self, key, rows, ours=None):
        mine = psnr(ours or self.ours, key)
        return [r for r in rows if psnr(r, key) is not None and psnr(r, key) >= mine]

    def less_flip(self):
        return [r for r in self.rows if 'flip' in r and r['flip'] <= self.bricks['flip']]

    def better_pictures(self):
        return self.better('image_psnr', self.rows, self.bricks)

    def better_than_ellipsoids(self):
        return self.better('image_psnr', self.rows)


def names(rows, key):
    return ', '.join(f"{r['name']} ({text(psnr(r, key))})" for r in
                     sorted(rows, key=lambda r: -psnr(r, key)))


def losses(title, key, lost, ours):
    return [f'- {title}, {name}: ESVR has {text(psnr(ours(name), key))}; as good or better: '
            f'{names(rows, key)}' for name, rows in lost.items()]


def flip_losses(title, sizes):
    lines = []
    for name, size in sizes.items():
        rows = sorted(size.less_flip(), key=lambda r: r['flip'])
        if rows:
            less = ', '.join(f"{r['name']} ({text(r['flip'], 4)})" for r in rows)
            lines.append(f"- {title}, {name}: ESVR has {text(size.bricks['flip'], 4)}; as "
                         f"low or lower: {less}")
    return lines


def won(sizes, title, others_of, better_of):
    """A line that counts the volumes where no other row is as good or better. Only volumes that have
    another row count: a volume that nothing else can store in this size is no win."""
    there = {name: size for name, size in sizes.items() if others_of(size)}
    best = [name for name, size in there.items() if not better_of(size)]
    return f'- {title}: {len(best)} of {len(there)} ({", ".join(best) or "none"})'


def won_psnr(sizes, title, others_of):
    return won(sizes, title, others_of, lambda s: s.better('psnr_box', others_of(s)))


def lost(sizes, of_size):
    return {name: of_size(size) for name, size in sizes.items() if of_size(size)}


def wins(part, sizes):
    at = f'1/{part}'
    alone = [name for name, size in sizes.items() if not size.all_others()]
    lines = [won_psnr(sizes, f'PSNR over the box at {at}, against all other rows', Size.all_others),
             won_psnr(sizes, f'PSNR over the box at {at}, against the external compressors',
                      lambda s: s.externals),
             won_psnr(sizes, f'PSNR over the box at {at}, against OpenVDB, NanoVDB in memory and ZFP',
                      Size.built_in),
             won(sizes, f'PSNR of pictures at {at}, drawn from decoded voxels', lambda s: s.rows,
                 Size.better_pictures),
             won(sizes, f'PSNR of pictures at {at}, drawn as ellipsoids', lambda s: s.rows,
                 Size.better_than_ellipsoids)]
    if alone:
        lines.append(f'- Not counted at {at}, since no other row exists at that size: {", ".join(alone)}')
    return lines


def verdict(low, high):
    lines = ['## Where another format is as good or better', '']
    for part, sizes in ((LOW, low), (HIGH, high)):
        at = f'1/{part}'
        lines += losses(f'PSNR over the box at {at}', 'psnr_box',
                        lost(sizes, lambda s: s.better('psnr_box', s.all_others())),
                        lambda n: sizes[n].ours)
        lines += losses(f'PSNR of pictures at {at}, drawn from decoded voxels', 'image_psnr',
                        lost(sizes, Size.better_pictures), lambda n: sizes[n].bricks)
        lines += losses(f'PSNR of pictures at {at}, drawn as ellipsoids', 'image_psnr',
                        lost(sizes, Size.better_than_ellipsoids), lambda n: sizes[n].ours)
        lines += flip_losses(f'FLIP of pictures at {at}, drawn from decoded voxels', sizes)
    lines += ['', '## Where ESVR is better than every other row', '',
              'Each line counts volumes, and only those for which another row exists.', '']
    return lines + wins(LOW, low) + wins(HIGH, high) + ['']


COLUMNS = [('bytes', 0), ('psnr_box', 2), ('psnr_active', 2), ('max_error', 4), ('ssim', 4),
           ('iou', 4), ('mass_error', 4), ('image_psnr', 2), ('flip', 4), ('encode_s', 3),
           ('decode_s', 4), ('fps', 0), ('device_mb', 1)]
HEADER = ('| row | bytes | PSNR box | active | max error | SSIM | IoU | mass error | image PSNR | '
          'FLIP | encode s | decode s | FPS | device MB | setting |\n'
          '|---|' + '--:|' * len(COLUMNS) + '---|')


def figure(row, key, digits):
    if key == 'device_mb':
        return text(row['device_bytes'] / 1e6, digits) if row.get('device_bytes') else '-'
    value = psnr(row, key) if 'psnr' in key else row.get(key)
    return text(value, digits)


def line(row, bold):
    cells = [figure(row, key, digits) for key, digits in COLUMNS]
    name = f"**{row['name']}**" if bold else row['name']
    return f"| {name} | {' | '.join(cells)} | {row.get('setting', '')} |"


def stored(ellipsoids):
    return f'{ellipsoids} ellipsoids' if ellipsoids else 'voxels'


def section(size):
    ours = dict(size.ours, encode_s=size.time['seconds'], name='ESVR',
                setting=f"{stored(size.time['ellipsoids'])}, {size.time['device']}")
    bricks = dict(size.bricks, encode_s=size.time['seconds'], name='ESVR, drawn from voxels')
    rows = [ours, bricks] + size.rows + size.externals
    rows.sort(key=lambda r: -psnr(r))
    lines = [f'### 1/{size.part}: {size.budget} bytes', '', HEADER]
    lines += [line(row, row is ours or row is bricks) for row in rows]
    if size.missing:
        lines += ['', 'Out of reach at this size: ' + ', '.join(
            f"{r['name']} ({r['note']})" if r['note'] != 'out of reach' else r['name']
            for r in size.missing) + '.']
    if not size.externals:
        lines += ['', 'No external compressor was measured at or below this size.']
    return lines + ['']


INTRODUCTION = """\
# Comparison with other formats

`tests/bench/comparison.py` makes this page from real volumes:

    tests/bench/comparison.py fit  --bin BUILD --data DATA --out OUT --device cuda
    tests/bench/comparison.py page --bin BUILD --data DATA --out OUT --device cuda --page docs/comparison.md

[compare.md](compare.md) has the rules that every row follows. The two sizes of a volume are the size of its
pruned grid as a half-float Blosc VDB file, divided by 50 and by 10. Every row is the best file of its form that
is not larger.

- *encode s* of an ESVR row is the run time of the whole command `vdb2esvr --size` on the device that the row
  names. The other forms are encoded, and all forms are decoded, on the CPU of the same machine; these times are
  medians of three runs.
- *image PSNR* and *FLIP* compare pictures of four views with pictures of the source. Pictures have 400 x 400
  pixels, the map viridis, linear opacity, and one voxel between samples. *FPS* is the number of pictures per
  second. *VRAM* is the device memory that drawing held. Voxels are drawn from NanoVDB grids; the rows of quantised
  NanoVDB files are drawn from grids of their quantised type.
- Each ESVR file has two rows: one is drawn from the ellipsoids, the other from the decoded voxels
  (`esvr-render --method bricks`). Files for which `vdb2esvr` chose voxels are drawn from voxels in both.
- SZ3, TTHRESH, quantise+xz, xz-lossless and zstd-lossless are *external compressors*. They were measured
  separately, on another machine, and for four of the volumes only
  ([external_points.md](../tests/bench/external_points.md)). Their times cannot be compared with the others, and
  their pictures were not measured.
"""


def version_lines(versions):
    lines = [f"esvr-compare {versions['esvr']}", f".esvr format {versions['format']}",
             versions['vdb'], versions['cuda']]
    return lines + ([versions['zfp']] if versions['zfp'] else [])


def introduction(tables):
    table = next(iter(tables.values()))
    return [INTRODUCTION, '    ' + '\n    '.join(version_lines(table['versions'])), '']


def reference_cost(table):
    pictures = table['pictures']
    held_bytes = pictures['reference_device_bytes']
    held = f' with {held_bytes / 1e6:.1f} MB of device memory' if held_bytes else ''
    return (f"The source is drawn at {pictures['reference_fps']:.0f} pictures per second{held} "
            f"({pictures['device']}).")


def page(options):
    volumes = {name: Volume(name, options) for name in options.only}
    tables = {name: volume.table() for name, volume in volumes.items()}
    sizes = {part: {name: Size(volumes[name], tables[name], part) for name in volumes}
             for part in PARTS}
    lines = introduction(tables) + verdict(sizes[LOW], sizes[HIGH])
    for name in volumes:
        lines += [f'## {name}', '', f"{tables[name]['active_voxels']} active voxels; half-float "
                  f"Blosc VDB {tables[name]['half_blosc_bytes']} bytes. "
                  + reference_cost(tables[name]), '']
        for part in PARTS:
            lines += section(sizes[part][name])
    options.page.write_text('\n'.join(lines).rstrip() + '\n')


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('job', choices=('sizes', 'fit', 'page'))
    parser.add_argument('--bin', type=pathlib.Path, required=True, help='the build folder')
    parser.add_argument('--data', type=pathlib.Path, required=True)
    parser.add_argument('--out', type=pathlib.Path)
    parser.add_argument('--page', type=pathlib.Path)
    parser.add_argument('--device', default='auto')
    parser.add_argument('--only', nargs='+', default=list(FILES), choices=list(FILES))
    options = parser.parse_args()
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
    if options.job == 'page':
        return page(options)
    for name in options.only:
        volume = Volume(name, options)
        half = volume.half_blosc()
        for part in PARTS:
            print(name, part, half // part, flush=True)
            if options.job == 'fit' and not volume.esvr(part).exists():
                volume.fit(part, half // part)
    return None


if __name__ == '__main__':
    main()
