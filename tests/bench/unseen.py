#!/usr/bin/env python3
"""Measures volumes with which ESVR was not tuned, for the section "Unseen volumes" of docs/comparison.md.

    unseen.py --bin BUILD --data DATA --out OUT --section SECTION.md --sperr 0.8.5=PROGRAM --sz3 3.3.2=PROGRAM

Makes the volumes of unseen_volumes.py, fits them to the sizes of comparison.py, measures the other rows of
esvr-compare and the external compressors at these sizes, and writes the section. OUT keeps all results; nothing
that it holds is made again.
"""
import argparse
import json
import pathlib

import external_compressors as external
import rates
import unseen_volumes
from volumes import Volume, kept

INTRODUCTION = """\
## Unseen volumes

ESVR was not tuned with these volumes before they were measured; `tests/bench/unseen_volumes.py` makes them. They
showed faults of the searches for voxels (`blobs`, `scan`, `torus`), which were mended. All were fitted on two CPU cores
(`--device cpu`). Sizes below 600 bytes are left out. TTHRESH was not measured. `-` stands for no file: the size is too
small for the grid. A version without masks of active voxels and without the promise that closed level sets keep their
signs had files for more sizes, and was better in 43 of the 47 cases; the present one stores more than values.

| volume | what it is | active voxels | half-float Blosc VDB, bytes |
|---|---|--:|--:|
"""


class Unseen(Volume):
    def __init__(self, name, options):
        super().__init__(name, options, options.out / f'{name}.vdb')
        unseen_volumes.make(options, name, self.path)

    def measure(self, compressors):
        print(self.name, self.sizes, flush=True)
        for part in self.sizes:
            self.fit(part)
        kept(self.points_file, lambda path: path.write_text(json.dumps(external.all_points(
            compressors, external.dense(self.path), list(self.sizes.values())), indent=1)))
        return self.rivals

    @property
    def points_file(self):
        return self.options.out / f'{self.name}.external.json'

    def points(self):
        return json.loads(self.points_file.read_text())

    def row(self):
        return (f"| {self.name} | {unseen_volumes.VOLUMES[self.name][0]} | "
                f"{self.rivals['active_voxels']} | {self.half_blosc} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--bin', type=pathlib.Path, required=True, help='the build folder')
    parser.add_argument('--data', type=pathlib.Path, required=True)
    parser.add_argument('--out', type=pathlib.Path, required=True)
    parser.add_argument('--section', type=pathlib.Path, required=True)
    parser.add_argument('--device', default='cpu')
    parser.add_argument('--only', nargs='+', default=list(unseen_volumes.VOLUMES))
    external.add_programs(parser)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    compressors = external.compressors(options)
    volumes = [Unseen(name, options) for name in options.only]
    for volume in volumes:
        volume.measure(compressors)
    lines = [INTRODUCTION + '\n'.join(volume.row() for volume in volumes), '']
    options.section.write_text('\n'.join(lines + rates.table(volumes)))


if __name__ == '__main__':
    main()
