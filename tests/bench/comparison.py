#!/usr/bin/env python3
"""Makes docs/comparison.md, which compares ESVR with other formats at five sizes.

    comparison.py sizes  --bin BUILD --data DATA
    comparison.py fit    --bin BUILD --data DATA --out OUT [--device cuda]
    comparison.py tables --bin BUILD --data DATA --out OUT [--device cuda]
    comparison.py rivals --bin BUILD --data DATA --out OUT
    comparison.py page   --bin BUILD --data DATA --out OUT --page docs/comparison.md [--unseen SECTION.md]

`sizes` prints the sizes of every volume: the size of its half-float Blosc VDB divided by 200, 50, 25, 10 and
4. `fit` makes the .esvr files and their reports. `tables` measures the rows of the full tables, with pictures, and
`rivals` the other rows at all sizes. `page` writes the page; SECTION.md comes from unseen.py. No job repeats what
OUT already holds.

Rows of compressors that esvr-compare does not run come from external_points.csv (external_points.md).
"""
import argparse
import pathlib

import rates
from rates import external_rows, psnr, text
from volumes import FILES, HIGH, LOW, Volume


class Size:
    """The rows of one volume within one budget of bytes."""

    def __init__(self, volume, table, part):
        self.part = part
        self.ours = next(r for r in table['rows'] if r['name'] == volume.esvr(part).name)
        self.budget = volume.sizes[part]
        matched = [r for r in table['rows'] if r['group'] == f"at {self.ours['bytes']} bytes"]
        self.rows = [r for r in matched if 'psnr_box' in r]
        self.missing = [r for r in matched if 'psnr_box' not in r]
        self.externals = external_rows(volume.points(), self.budget, table['peak'])
        self.time = volume.time_of(part)

    def all_others(self):
        return self.rows + self.externals

    def built_in(self):
        """The rows of OpenVDB, of NanoVDB as it lies in memory, and of ZFP."""
        return [r for r in self.rows if r['name'].startswith(('OpenVDB', 'ZFP')) or
                r['name'].endswith(' raw')]

    def better(self, key, rows, ours=None):
        """Rows that are as good or better. If the figures are equal, the larger file is worse."""
        ours = ours or self.ours
        mine = (psnr(ours, key), -ours['bytes'])
        return [r for r in rows if psnr(r, key) is not None and (psnr(r, key), -r['bytes']) >= mine]

    def less_flip(self):
        return [r for r in self.rows if 'flip' in r and r['flip'] <= self.ours['flip']]

    def better_pictures(self):
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
            lines.append(f"- {title}, {name}: ESVR has {text(size.ours['flip'], 4)}; as "
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
             won(sizes, f'PSNR of pictures at {at}', lambda s: s.rows, Size.better_pictures)]
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
        lines += losses(f'PSNR of pictures at {at}', 'image_psnr',
                        lost(sizes, Size.better_pictures), lambda n: sizes[n].ours)
        lines += flip_losses(f'FLIP of pictures at {at}', sizes)
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
    rows = [ours] + size.rows + size.externals
    rows.sort(key=lambda r: -psnr(r))
    lines = [f'### 1/{size.part}: {size.budget} bytes', '', HEADER]
    lines += [line(row, row is ours) for row in rows]
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

    tests/bench/comparison.py fit    --bin BUILD --data DATA --out OUT --device cuda
    tests/bench/comparison.py tables --bin BUILD --data DATA --out OUT --device cuda
    tests/bench/comparison.py rivals --bin BUILD --data DATA --out OUT
    tests/bench/unseen.py            --bin BUILD --data DATA --out UNSEEN --section UNSEEN/section.md PROGRAMS
    tests/bench/comparison.py page   --bin BUILD --data DATA --out OUT --page docs/comparison.md \\
                                     --unseen UNSEEN/section.md
    PROGRAMS: --sperr 0.8.5=sperr3d --sz3 3.3.2=sz3

[compare.md](compare.md) has the rules that every row follows. The sizes of a volume are the size of its pruned
grid as a half-float Blosc VDB file, divided by 200, 50, 25, 10 and 4. Every row is the best file of its form that
is not larger. The external compressors are SPERR, SZ3, TTHRESH, quantise+xz, xz-lossless and zstd-lossless. They
were measured separately ([external_points.md](../tests/bench/external_points.md)), and not on `neuron_m207`, whose
box has 810 million voxels.
"""

RATES = """\
## Five rates

Each cell has the PSNR over the box of ESVR and of the best rival, which is named. `v` marks files for which
`vdb2esvr --size` chose voxels; the others hold ellipsoids. A rival is any other row of `esvr-compare table`
(`--rows matched,zfp`) and any external compressor. Cells where a rival is better, or where both are exact and the
rival is smaller, are bold. ESVR, OpenVDB and NanoVDB also store which voxels are active, for which compressors of arrays
have no bytes: in `smoke1` at 1/25 the mask takes 16 % of our file, and `--topology threshold` leaves it out and reaches
54.18 dB on two CPU cores.
"""

FULL_TABLES = """\
## Full tables at 1/50 and 1/10

- *encode s* of an ESVR row is the run time of the whole command `vdb2esvr --size` on the device that the row
  names. The other forms are encoded, and all forms are decoded, on the CPU of the same machine; these times are
  medians of three runs. ESVR files were made before the search for voxels was shortened
  ([lab-notes.md](lab-notes.md#when-voxels-of-a-size-are-worth-coding)), which changed those with voxels by up to 0.05 dB in six cases.
- *image PSNR* and *FLIP* compare pictures of four views with pictures of the source. Pictures have 400 x 400
  pixels, the map viridis, linear opacity, and one voxel between samples. *FPS* is the number of pictures per
  second. *VRAM* is the device memory that drawing held. Voxels are drawn from NanoVDB grids; the rows of quantised
  NanoVDB files are drawn from grids of their quantised type.
- An ESVR file is drawn from voxels, which are decoded where rays need them.
- Rows of `esvr-compare` are the best files that are not larger than the ESVR file; external compressors may use the
  whole size.
- The times of external compressors were measured on another machine and cannot be compared with the others. Their
  pictures were not measured.
"""


def version_lines(versions):
    lines = [f"esvr-compare {versions['esvr']}", f".esvr format {versions['format']}",
             versions['vdb'], versions['cuda']]
    return lines + ([versions['zfp']] if versions['zfp'] else [])


def reference_cost(table):
    pictures = table['pictures']
    held_bytes = pictures['reference_device_bytes']
    held = f' with {held_bytes / 1e6:.1f} MB of device memory' if held_bytes else ''
    return (f"The source is drawn at {pictures['reference_fps']:.0f} pictures per second{held} "
            f"({pictures['device']}).")


def full_tables(volumes):
    """The tables with pictures."""
    tables = {name: volume.table() for name, volume in volumes.items()}
    sizes = {part: {name: Size(volumes[name], tables[name], part) for name in volumes}
             for part in (LOW, HIGH)}
    table = next(iter(tables.values()))
    lines = [FULL_TABLES, '    ' + '\n    '.join(version_lines(table['versions'])), '']
    lines += verdict(sizes[LOW], sizes[HIGH])
    for name in volumes:
        lines += [f'## {name}', '', f"{tables[name]['active_voxels']} active voxels; half-float "
                  f"Blosc VDB {tables[name]['half_blosc_bytes']} bytes. "
                  + reference_cost(tables[name]), '']
        for part in (LOW, HIGH):
            lines += section(sizes[part][name])
    return lines


def page(options):
    volumes = {name: Volume(name, options) for name in options.only}
    lines = [INTRODUCTION, RATES] + rates.table(volumes.values())
    if options.unseen:
        lines += [options.unseen.read_text()]
    lines += full_tables(volumes)
    options.page.write_text('\n'.join(lines).rstrip() + '\n')


def job_of_volume(options, volume):
    if options.job in ('rivals', 'tables'):
        measured = volume.rivals if options.job == 'rivals' else volume.table()
        print(volume.name, len(measured['rows']), 'rows', flush=True)
        return
    for part, size in volume.sizes.items():
        print(volume.name, part, size, flush=True)
        if options.job == 'fit':
            volume.fit(part)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('job', choices=('sizes', 'fit', 'tables', 'rivals', 'page'))
    parser.add_argument('--bin', type=pathlib.Path, required=True, help='the build folder')
    parser.add_argument('--data', type=pathlib.Path, required=True)
    parser.add_argument('--out', type=pathlib.Path)
    parser.add_argument('--page', type=pathlib.Path)
    parser.add_argument('--unseen', type=pathlib.Path, metavar='SECTION.md')
    parser.add_argument('--device', default='auto')
    parser.add_argument('--only', nargs='+', default=list(FILES), choices=list(FILES))
    options = parser.parse_args()
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
    if options.job == 'page':
        return page(options)
    for name in options.only:
        job_of_volume(options, Volume(name, options))
    return None


if __name__ == '__main__':
    main()
