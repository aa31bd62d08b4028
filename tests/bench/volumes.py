"""The volumes of docs/comparison.md, and what is measured of each."""
import csv
import functools
import json
import pathlib

from run_program import run

BOXES = {'aneurism': '0,0,0,255,255,255', 'hydrogen_atom': '0,0,0,127,127,127'}
FILES = {'aneurism': 'aneurism', 'smoke1': 'smoke1', 'wdas': 'wdas_cloud_sixteenth',
         'hydrogen_atom': 'hydrogen_atom', 'dragon': 'dragon_with_xform',
         'cube_levelset': 'cube_levelset', 'neuron_rp140212': 'neuron_rp140212',
         'neuron_m207': 'neuron_m207'}
PARTS = (200, 50, 25, 10, 4)
SMALLEST = 600  # bytes; smaller sizes are left out
LOW, HIGH = 50, 10  # the parts that have full tables
IMAGES = ['--images', '4', '--image-size', '400']
ROWS = ['--rows', 'matched,zfp', '--max-dense', '1GB']
HERE = pathlib.Path(__file__).parent


def kept(path, make):
    """The content of a JSON file, which `make` makes if it does not exist."""
    if not path.exists():
        make(path)
    return json.loads(path.read_text())


class Volume:
    def __init__(self, name, options, path=None):
        self.name, self.options = name, options
        self.path = path or options.data / f'{FILES[name]}.vdb'
        self.box = ['--box', BOXES[name]] if name in BOXES else []
        self.compare = options.bin / 'compare/esvr-compare'

    @functools.cached_property
    def half_blosc(self):
        words = run([self.compare, 'table', self.path, *self.box, '--rows', 'none', '--runs', 1,
                     '--report', '-'])
        return json.loads(words)['half_blosc_bytes']

    @functools.cached_property
    def sizes(self):
        """The bytes of each part, without sizes that are too small."""
        sizes = {part: self.half_blosc // part for part in PARTS}
        return {part: size for part, size in sizes.items() if size >= SMALLEST}

    def esvr(self, part):
        return self.options.out / f'{self.name}-{part}.esvr'

    def report(self, part):
        return self.esvr(part).with_suffix('.report.json')

    def fit(self, part):
        """A size may be too small for the grid. The report of vdb2esvr then holds the error."""
        if self.report(part).exists():
            return
        try:
            run([self.options.bin / 'vdb2esvr/vdb2esvr', self.path, self.esvr(part), *self.box,
                 '--size', self.sizes[part], '--device', self.options.device, '--report', self.report(part), '-f'])
        except SystemExit:
            if not self.report(part).exists():
                raise

    def time_of(self, part):
        """The seconds and the device of the fit."""
        report = json.loads(self.report(part).read_text())
        grid = report['grids'][0]
        return {'seconds': report['seconds']['total'], 'device': grid['fit']['device'],
                'ellipsoids': grid['ellipsoids']}

    def table(self):
        """All rows at the sizes of the full tables, with pictures. They are kept in OUT."""
        return kept(self.options.out / f'{self.name}.table.json', lambda path: run(
            [self.compare, 'table', self.path, *[self.esvr(p) for p in (LOW, HIGH)], *self.box, *ROWS,
             '--runs', '3', *IMAGES, '--device', self.options.device, '--report', path, '-q']))

    @functools.cached_property
    def rivals(self):
        """The rows of other formats at all sizes, without pictures. They are kept in OUT."""
        sizes = [word for size in self.sizes.values() for word in ('--size', size)]
        return kept(self.options.out / f'{self.name}.rivals.json', lambda path: run(
            [self.compare, 'table', self.path, *self.box, *sizes, *ROWS, '--runs', '1', '--report', path,
             '-q']))

    def points(self):
        """The rows of external_points.csv for this volume."""
        with open(HERE / 'external_points.csv', newline='') as stream:
            return [row for row in csv.DictReader(stream) if row['dataset'] == FILES[self.name]]
