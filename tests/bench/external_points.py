#!/usr/bin/env python3
"""Measures the rows of external_points.csv, with the compressors' own programs.

    external_points.py again  --data DATA --out NEW.csv PROGRAMS
    external_points.py search --data DATA --out NEW.csv PROGRAMS --bin BUILD

Each row of external_points.csv names a volume, a method and its parameter. `again` compresses and decompresses
the dense array of the volume with that parameter, and prints the bytes and the PSNR of the row beside its own.
`search` finds, for each size of a volume (comparison.py), the setting of each method that has the highest PSNR
and fits into the size. Both leave out methods whose program was not given:

    --sz3 3.3.2=PROGRAM  --tthresh PROGRAM  --sperr 0.8.5=PROGRAM

external_points.md explains the columns, and says which figures are the same when they are measured again.
"""
import argparse
import csv
import pathlib
import sys

import numpy as np

import external_compressors as external
from volumes import BOXES, FILES, Volume

HERE = pathlib.Path(__file__).parent
BYTE_SCANS = {'aneurism', 'hydrogen_atom'}  # measured on their 8-bit originals, values v / 255
MOST_VOXELS = 600e6  # of an array that is compressed
COLUMNS = ['dataset', 'method', 'parameter', 'bytes', 'psnr_box_db', 'psnr_nonzero_db', 'max_error_rel',
           'enc_s', 'dec_s']


def dense(data, name):
    values = external.dense(data / f'{name}.vdb', BOXES.get(name))
    return np.rint(values * 255) / 255 if name in BYTE_SCANS else values


def stored_rows():
    return list(csv.DictReader((HERE / 'external_points.csv').read_text().splitlines()))


def again(options, compressors):
    volumes, wanted = {}, [FILES[name] for name in options.volumes]
    for old in stored_rows():
        name, method = old['dataset'], old['method']
        if method not in compressors or name not in wanted:
            continue
        if name not in volumes:
            volumes = {name: dense(options.data, name)}
        row = dict(old, **external.measured(compressors[method], volumes[name], old['parameter']))
        print(f"{name} {method} {old['parameter']}: {old['bytes']} bytes, {old['psnr_box_db']} dB; "
              f"now {row['bytes']} bytes, {row['psnr_box_db']} dB", flush=True)
        yield row


def search(options, compressors):
    for name in options.volumes:
        volume = Volume(name, options)
        if external.box_voxels(volume.path, BOXES.get(name)) > MOST_VOXELS:
            print(f'{name}: the box has more than {MOST_VOXELS / 1e6:.0f} million voxels', flush=True)
            continue
        sizes = list(volume.sizes.values())
        values = dense(options.data, FILES[name])
        for method, compress in compressors.items():
            for point in external.points_for(method, compress, values, sizes):
                print(f"{name} {method} {point['parameter']}: {point['bytes']} bytes, "
                      f"{point['psnr_box_db']} dB", flush=True)
                yield {'dataset': FILES[name], 'method': method, **point}


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('job', choices=('again', 'search'))
    parser.add_argument('--data', type=pathlib.Path, required=True)
    parser.add_argument('--bin', type=pathlib.Path, help='the build folder')
    parser.add_argument('--out', type=pathlib.Path, required=True, help='the CSV file to write')
    parser.add_argument('--only', nargs='+', help='methods')
    parser.add_argument('--volumes', nargs='+', default=list(FILES), choices=list(FILES))
    external.add_programs(parser)
    options = parser.parse_args()
    compressors = external.compressors(options)
    if options.only:
        compressors = {name: compressors[name] for name in options.only}
    job = again if options.job == 'again' else search
    with open(options.out, 'w', newline='') as stream:
        writer = csv.DictWriter(stream, COLUMNS)
        writer.writeheader()
        for row in job(options, compressors):
            writer.writerow(row)
            stream.flush()


if __name__ == '__main__':
    sys.exit(main())
