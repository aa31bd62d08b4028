"""The compact tables of docs/comparison.md: a volume in each row, a rate in each column.

A rate of 1/N allows the bytes of the half-float Blosc VDB divided by N. A rival is another row of
`esvr-compare table`, or an external compressor (external_points.md), that takes no more bytes.
"""
import csv
import json
import pathlib

from volumes import PARTS

HERE = pathlib.Path(__file__).parent


def psnr(row, key='psnr_box'):
    """The PSNR of a row. A report has null if there is no error at all, and no key without figures."""
    if key not in row:
        return None
    return float('inf') if row[key] is None else row[key]


def text(value, digits=2):
    if value is None:
        return '-'
    return 'exact' if value == float('inf') else f'{value:.{digits}f}'


def family(method):
    return method.split('-')[0]


def external_rows(points, size, peak):
    """The point of each external compressor with the highest PSNR that takes at most `size` bytes."""
    best = {}
    for point in points:
        if int(point['bytes']) > size:
            continue
        row = {'name': point['method'], 'bytes': int(point['bytes']), 'external': True,
               'psnr_box': float(point['psnr_box_db']),
               'psnr_active': float(point['psnr_nonzero_db']),
               'max_error': float(point['max_error_rel']) * peak,
               'encode_s': float(point['enc_s']), 'decode_s': float(point['dec_s']),
               'setting': point['parameter']}
        old = best.get(family(row['name']))
        if old is None or row['psnr_box'] > old['psnr_box']:
            best[family(row['name'])] = row
    return list(best.values())


class Rate:
    """ESVR and its rivals within one size of one volume."""

    def __init__(self, volume, part, size):
        self.volume, self.part, self.size = volume.name, part, size
        report = json.loads(volume.report(part).read_text())
        self.bytes, self.ours, self.ellipsoids = None, None, None  # if the size is too small
        if report['error'] is None:
            grid = report['grids'][0]
            self.bytes, self.ellipsoids = report['output']['bytes'], grid['ellipsoids']
            self.ours = psnr(grid['metrics'])
        rows = [row for row in volume.rivals['rows']
                if row['group'] == f'at {size} bytes' and 'psnr_box' in row]
        rows += external_rows(volume.points(), size, 1.0)
        self.best = max(rows, key=lambda row: (psnr(row), -row['bytes']), default=None)

    def is_lost(self):
        """A rival is as good or better. If both are exact, the smaller one is better."""
        if not self.best or self.ours is None:
            return self.best is not None
        if psnr(self.best) < self.ours:
            return False
        return psnr(self.best) > self.ours or self.best['bytes'] < self.bytes

    def cell(self):
        ours = text(self.ours) + (' v' if self.ellipsoids == 0 else '')
        rival = f"{text(psnr(self.best))} {family(self.best['name'])}" if self.best else '-'
        return f'**{ours} / {rival}**' if self.is_lost() else f'{ours} / {rival}'

    def comparison(self):
        ours = f'ESVR has {text(self.ours)} in {self.bytes} bytes' if self.bytes else 'ESVR has no file'
        return f"{ours}, {self.best['name']} {text(psnr(self.best))} in {self.best['bytes']}"


def exceptions(lost):
    """A line for each comparison that is lost, with all rates at which it is the same, and its cause."""
    known, parts = causes(), {}
    for rate in lost:
        parts.setdefault((rate.volume, rate.comparison()), []).append(str(rate.part))
    lines = []
    for (volume, comparison), at in parts.items():
        cause = known.get((volume, at[0]), 'not known')
        lines.append(f"- {volume} at {', '.join('1/' + part for part in at)}: {comparison}. Cause: {cause}.")
    return lines or ['- none']


def causes():
    with open(HERE / 'comparison_causes.csv', newline='') as stream:
        return {(row['volume'], row['part']): row['cause'] for row in csv.DictReader(stream)}


def table(volumes):
    """The table of these volumes and the list of exceptions."""
    lines = ['| volume | ' + ' | '.join(f'1/{part}' for part in PARTS) + ' |',
             '|---|' + '---|' * len(PARTS)]
    rates = []
    for volume in volumes:
        now = {part: Rate(volume, part, size) for part, size in volume.sizes.items()}
        cells = [now[part].cell() if part in now else '' for part in PARTS]
        lines.append(f"| {volume.name} | {' | '.join(cells)} |")
        rates += now.values()
    lost = [rate for rate in rates if rate.is_lost()]
    compared = [rate for rate in rates if rate.best]
    lines += ['', f'ESVR is better than every rival in {len(compared) - len(lost)} of the '
              f'{len(compared)} cases that have a rival. The exceptions are:', '']
    return lines + exceptions(lost) + ['']
