#!/usr/bin/env python3
"""Makes docs/comparison.md: an .esvr against everything else, on eight volumes, at two sizes each.

    comparison.py sizes --bin BUILD --data DATA
    comparison.py fit   --bin BUILD --data DATA --out OUT [--device cuda]
    comparison.py page  --bin BUILD --data DATA --out OUT --page docs/comparison.md

`sizes` prints what is asked for: the half-float Blosc VDB over 50 and over 10. `fit` makes the .esvr
files, on whatever device, and their reports beside them. `page` measures every row with esvr-compare
and writes the page; rows that OUT holds already are not measured again.

Rows of systems that esvr-compare does not have come from external_points.csv: bytes, PSNR and times as
measured with their own programs on the same volumes (SZ3 3.1.8 and 3.3.2, TTHRESH, and the dense volume
rounded to L steps, then `xz -9e`), on two CPU cores.
"""
import argparse
import csv
import json
import pathlib
import subprocess

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


def run(words):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f'{" ".join(map(str, words))}\n{done.stderr}')
    return done.stdout


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
        """Seconds of the whole run and on which device."""
        report = json.loads(self.report(part).read_text())
        grid = report['grids'][0]
        return {'seconds': report['seconds']['total'], 'device': grid['fit']['device'],
                'ellipsoids': grid['ellipsoids']}

    def table(self):
        """All rows; kept in OUT."""
        kept = self.options.out / f'{self.name}.table.json'
        if not kept.exists():
            words = [self.compare, 'table', self.path, *[self.esvr(p) for p in PARTS], *self.box,
                     *MEASURE, *IMAGES, '--device', self.options.device, '--report', kept, '-q']
            run(words)
        return json.loads(kept.read_text())


def psnr(row, key='psnr_box'):
    """null in a report means no error at all; a row without figures has no key."""
    if key not in row:
        return None
    return float('inf') if row[key] is None else row[key]


def text(value, digits=2):
    if value is None:
        return '-'
    return 'exact' if value == float('inf') else f'{value:.{digits}f}'


def external_points(name, budget, peak):
    """The best point of each system at or under a budget."""
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
    """All that a volume can be stored in within one budget."""

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
    return [f'- {title}, {name}: {text(psnr(ours(name), key))} dB, below {names(rows, key)}'
            for name, rows in lost.items()]


def flip_losses(title, sizes):
    lines = []
    for name, size in sizes.items():
        rows = sorted(size.less_flip(), key=lambda r: r['flip'])
        if rows:
            less = ', '.join(f"{r['name']} ({text(r['flip'], 4)})" for r in rows)
            lines.append(f"- {title}, {name}: {text(size.bricks['flip'], 4)}, above {less}")
    return lines


def built_in(size):
    """OpenVDB, NanoVDB in memory and ZFP: what the claim at a tenth is about."""
    return [r for r in size.rows if r['name'].startswith(('OpenVDB', 'ZFP')) or
            r['name'].endswith(' raw')]


def won(sizes, title, of_size):
    """A line that counts the volumes where no row is better."""
    names_won = [name for name, size in sizes.items() if not of_size(size)]
    return f'- {title}: {len(names_won)} ({", ".join(names_won) or "none"})'


def lost(sizes, of_size):
    return {name: of_size(size) for name, size in sizes.items() if of_size(size)}


def verdict(low, high):
    lines = ['## Where something else is better', '']
    for part, sizes in ((LOW, low), (HIGH, high)):
        at = f'1/{part}'
        lines += losses(f'{at}, PSNR over the box', 'psnr_box',
                        lost(sizes, lambda s: s.better('psnr_box', s.rows + s.externals)),
                        lambda n: sizes[n].ours)
        lines += losses(f'{at}, PSNR of pictures drawn from voxels', 'image_psnr',
                        lost(sizes, Size.better_pictures), lambda n: sizes[n].bricks)
        lines += losses(f'{at}, PSNR of pictures drawn as ellipsoids', 'image_psnr',
                        lost(sizes, Size.better_than_ellipsoids), lambda n: sizes[n].ours)
        lines += flip_losses(f'{at}, FLIP of pictures drawn from voxels', sizes)
    lines += ['', '## Where ESVR is', '', f'Of {len(low)} volumes, above', '',
              won(low, f'every other row in PSNR over the box, at 1/{LOW}',
                  lambda s: s.better('psnr_box', s.rows + s.externals)),
              won(low, f'every row that was drawn in PSNR of pictures, at 1/{LOW}, drawn from voxels',
                  Size.better_pictures),
              won(low, 'the same, drawn as ellipsoids', Size.better_than_ellipsoids),
              won(high, f'every OpenVDB, NanoVDB-memory and ZFP row in PSNR over the box, at 1/{HIGH}',
                  lambda s: s.better('psnr_box', built_in(s))),
              won(high, f'every other row in PSNR over the box, at 1/{HIGH}',
                  lambda s: s.better('psnr_box', s.rows + s.externals)),
              won(high, f'every row that was drawn in PSNR of pictures, at 1/{HIGH}, drawn from voxels',
                  Size.better_pictures), '']
    return lines


COLUMNS = [('bytes', 0), ('psnr_box', 2), ('psnr_active', 2), ('max_error', 4), ('ssim', 4),
           ('iou', 4), ('mass_error', 4), ('image_psnr', 2), ('flip', 4), ('encode_s', 3),
           ('decode_s', 4), ('fps', 0), ('vram_mb', 1)]
HEADER = ('| row | bytes | PSNR box | active | max error | SSIM | IoU | mass error | image PSNR | '
          'FLIP | encode s | decode s | FPS | VRAM MB | setting |\n'
          '|---|' + '--:|' * len(COLUMNS) + '---|')


def figure(row, key, digits):
    if key == 'vram_mb':
        return text(row['vram_bytes'] / 1e6, digits) if row.get('vram_bytes') else '-'
    value = psnr(row, key) if 'psnr' in key else row.get(key)
    return text(value, digits)


def line(row, bold):
    cells = [figure(row, key, digits) for key, digits in COLUMNS]
    name = f"**{row['name']}**" if bold else row['name']
    return f"| {name} | {' | '.join(cells)} | {row.get('setting', '')} |"


def section(size):
    ours = dict(size.ours, encode_s=size.time['seconds'], name='ESVR',
                setting=f"{size.time['ellipsoids']} ellipsoids, {size.time['device']}")
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
        lines += ['', 'There is no external point at or under this size.']
    return lines + ['']


def introduction(tables):
    table = next(iter(tables.values()))
    return ['# Comparison', '',
            'Made by `tests/bench/comparison.py`; the rules of the rows are in [compare.md](compare.md).',
            'Sizes are the half-float Blosc VDB of the grid over 50 and over 10, pruned first. Encode seconds of',
            'ESVR are those of the whole `vdb2esvr --size` on the device that the row names; all other times are',
            'of the CPU beside it, medians of three runs; those of externals as measured elsewhere. Pictures: four',
            'views, viridis with linear opacity, 400 x 400, one voxel between samples, drawn on the device that each',
            'volume names; FPS are pictures a second, VRAM is what drawing held on the device: NanoVDB grids for voxels,',
            'quantised ones for quantised rows. Rows without picture figures are externals, whose voxels were not at hand;',
            'there are points of four volumes, and not at every size, so that a table without them is no win over them.',
            'ESVR is drawn from its ellipsoids, and in a second row from the voxels that the file decodes to',
            '(`esvr-render --method bricks`).', '',
            '    ' + '\n    '.join(table['versions']), '']


def reference_cost(table):
    pictures = table['pictures']
    vram = pictures['reference_vram_bytes']
    held = f', {vram / 1e6:.1f} MB' if vram else ''
    return (f"The reference is drawn at {pictures['reference_fps']:.0f} pictures a second{held} "
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
