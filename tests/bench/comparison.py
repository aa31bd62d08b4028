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
IMAGES = ['--images', '2', '--image-size', '300']
MEASURE = ['--runs', '3', '--max-dense', '1GB']
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
                'primitives': grid['primitives']}

    def table(self):
        """All rows; kept in OUT."""
        kept = self.options.out / f'{self.name}.table.json'
        if not kept.exists():
            words = [self.compare, 'table', self.path, *[self.esvr(p) for p in PARTS], *self.box,
                     *MEASURE, *IMAGES, '--report', kept, '-q']
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
        self.budget = self.ours['bytes']
        matched = [r for r in table['rows'] if r['group'] == f'at {self.budget} bytes']
        plain = [r for r in table['rows'] if r['group'] in ('lossless', 'quantised')
                 and r.get('bytes', self.budget + 1) <= self.budget]
        self.rows = [r for r in matched + plain if 'psnr_box' in r]
        self.missing = [r for r in matched if 'psnr_box' not in r]
        self.externals = external_points(volume.name, self.budget, table['peak'])
        self.time = volume.time_of(part)

    def better(self, key, rows):
        mine = psnr(self.ours, key)
        return [r for r in rows if psnr(r, key) is not None and psnr(r, key) >= mine]

    def less_flip(self):
        return [r for r in self.rows if 'flip' in r and r['flip'] <= self.ours['flip']]


def claim(sizes, of_size):
    won = [name for name, size in sizes.items() if not of_size(size)]
    lost = {name: of_size(size) for name, size in sizes.items() if of_size(size)}
    return won, lost


def names(rows, key):
    return ', '.join(f"{r['name']} ({text(psnr(r, key))})" for r in
                     sorted(rows, key=lambda r: -psnr(r, key)))


def losses(title, key, lost, sizes):
    return [f'- {title}, {name}: {text(psnr(sizes[name].ours, key))} dB, below {names(rows, key)}'
            for name, rows in lost.items()]


def flip_losses(title, sizes):
    lines = []
    for name, size in sizes.items():
        rows = sorted(size.less_flip(), key=lambda r: r['flip'])
        if rows:
            less = ', '.join(f"{r['name']} ({text(r['flip'], 4)})" for r in rows)
            lines.append(f"- {title}, {name}: {text(size.ours['flip'], 4)}, above {less}")
    return lines


def built_in(size):
    """OpenVDB, NanoVDB in memory and ZFP: what the claim at a tenth is about."""
    return [r for r in size.rows if r['name'].startswith(('OpenVDB', 'ZFP')) or
            r['name'].endswith(' raw')]


def verdict(low, high):
    box = claim(low, lambda s: s.better('psnr_box', s.rows + s.externals))
    image = claim(low, lambda s: s.better('image_psnr', s.rows))
    tenth = claim(high, lambda s: s.better('psnr_box', built_in(s)))
    tenth_all = claim(high, lambda s: s.better('psnr_box', s.rows + s.externals))
    image_tenth = claim(high, lambda s: s.better('image_psnr', s.rows))
    n = len(low)
    lines = ['## Where something else is better', '']
    lines += losses(f'1/{LOW}, PSNR over the box', 'psnr_box', box[1], low)
    lines += losses(f'1/{LOW}, PSNR of pictures', 'image_psnr', image[1], low)
    lines += losses(f'1/{HIGH}, PSNR over the box', 'psnr_box', tenth_all[1], high)
    lines += losses(f'1/{HIGH}, PSNR of pictures', 'image_psnr', image_tenth[1], high)
    lines += flip_losses(f'1/{LOW}, FLIP', low) + flip_losses(f'1/{HIGH}, FLIP', high)
    lines += ['', '## Where ESVR is', '', f'Of {n} volumes:', '',
              f'- at 1/{LOW} above every other row in PSNR over the box: {len(box[0])} '
              f'({", ".join(box[0]) or "none"})',
              f'- at 1/{LOW} above every row that was drawn in PSNR of pictures: {len(image[0])} '
              f'({", ".join(image[0]) or "none"})',
              f'- at 1/{HIGH} above every OpenVDB, NanoVDB-memory and ZFP row: {len(tenth[0])} '
              f'({", ".join(tenth[0]) or "none"})',
              f'- at 1/{HIGH} above every other row: {len(tenth_all[0])} '
              f'({", ".join(tenth_all[0]) or "none"})',
              f'- at 1/{HIGH} above every row that was drawn in PSNR of pictures: '
              f'{len(image_tenth[0])} ({", ".join(image_tenth[0]) or "none"})', '']
    return lines


COLUMNS = [('bytes', 0), ('psnr_box', 2), ('psnr_active', 2), ('max_error', 4), ('ssim', 4),
           ('iou', 4), ('mass_error', 4), ('image_psnr', 2), ('flip', 4), ('encode_s', 3),
           ('decode_s', 4), ('fps', 1)]
HEADER = ('| row | bytes | PSNR box | active | max error | SSIM | IoU | mass error | image PSNR | '
          'FLIP | encode s | decode s | FPS | setting |\n'
          '|---|' + '--:|' * len(COLUMNS) + '---|')


def figure(row, key, digits):
    value = psnr(row, key) if 'psnr' in key else row.get(key)
    return text(value, digits)


def line(row, bold):
    cells = [figure(row, key, digits) for key, digits in COLUMNS]
    name = f"**{row['name']}**" if bold else row['name']
    return f"| {name} | {' | '.join(cells)} | {row.get('setting', '')} |"


def section(size):
    ours = dict(size.ours, encode_s=size.time['seconds'], name='ESVR',
                setting=f"{size.time['primitives']} ellipsoids, {size.time['device']}")
    rows = [ours] + size.rows + size.externals
    rows.sort(key=lambda r: -psnr(r))
    lines = [f'### 1/{size.part}: {size.budget} bytes', '', HEADER]
    lines += [line(row, row is ours) for row in rows]
    if size.missing:
        lines += ['', 'Out of reach at this size: ' + ', '.join(
            f"{r['name']} ({r['note']})" if r['note'] != 'out of reach' else r['name']
            for r in size.missing) + '.']
    return lines + ['']


def introduction(tables):
    table = next(iter(tables.values()))
    return ['# Comparison', '',
            'Made by `tests/bench/comparison.py`; the rules of the rows are in [compare.md](compare.md).',
            'Sizes are the half-float Blosc VDB of the grid over 50 and over 10, pruned first. Encode seconds of',
            'ESVR are those of the whole `vdb2esvr --size` on the device that the row names; all other times are',
            'of two CPU cores, medians of three runs, for externals as measured elsewhere. Pictures: two views,',
            'viridis with linear opacity, 300 x 300, one voxel between samples; ellipsoids are drawn as ellipsoids (the',
            'level set from its voxels), voxels are marched, both on the CPU. Rows without picture figures are of systems whose voxels were',
            'not at hand.', '', '    ' + '\n    '.join(table['versions']), '']


def page(options):
    volumes = {name: Volume(name, options) for name in options.only}
    tables = {name: volume.table() for name, volume in volumes.items()}
    sizes = {part: {name: Size(volumes[name], tables[name], part) for name in volumes}
             for part in PARTS}
    lines = introduction(tables) + verdict(sizes[LOW], sizes[HIGH])
    for name in volumes:
        lines += [f'## {name}', '', f"{tables[name]['active_voxels']} active voxels; half-float "
                  f"Blosc VDB {tables[name]['half_blosc_bytes']} bytes.", '']
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
