#!/usr/bin/env python3
"""Draws a VDB file with ParaView and compares its pictures with those of esvr-render.

    paraview_row.py --bin BUILD IN.vdb [--box X0,Y0,Z0,X1,Y1,Z1] [--views 8] [--size 400] [--mode MODE]

Both draw the array of the box from the same cameras, on a full turn about the y axis, with viridis and linear opacity
over the range of the values, over one voxel, and without shading. esvr-render draws the voxels of the file. The script
prints a row: pictures per second of ParaView, and the PSNR of ParaView's pictures against those of
esvr-render, in front of black, over all pixels and views.

Needs ParaView's pvbatch, and xvfb-run where there is no display, and the Python modules numpy, pyopenvdb and PIL (Debian:
paraview, xvfb, python3-numpy, python3-openvdb, python3-pil). MODE is a volume rendering mode of ParaView; the default, "Ray Cast
Only", runs on the CPU.
"""
import argparse
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
FOV = 30.0  # degrees


def cameras(low, high, views):
    """The eyes on a circle about the center of the box, from which a sphere around the box fills the picture."""
    center = [(l + h) / 2 for l, h in zip(low, high)]
    radius = math.dist(low, high) / 2
    distance = radius / math.sin(math.radians(FOV / 2))
    turns = [2 * math.pi * i / views for i in range(views)]
    return [{'center': center, 'eye': [center[0] + distance * math.sin(t), center[1],
                                       center[2] + distance * math.cos(t)]} for t in turns]


def draw_with_paraview(job):
    """The part that pvbatch runs. It writes the pictures and the seconds of each."""
    import numpy
    import paraview.simple as pv
    from paraview import vtk
    from vtkmodules.util.numpy_support import numpy_to_vtk

    values = numpy.fromfile(job['raw'], numpy.float32)
    image = vtk.vtkImageData()
    image.SetDimensions(*job['sides'])
    image.SetOrigin(*job['low'])
    scalars = numpy_to_vtk(values, deep=True)
    scalars.SetName('density')
    image.GetPointData().SetScalars(scalars)
    source = pv.TrivialProducer()
    source.GetClientSideObject().SetOutput(image)

    preset = json.loads(pathlib.Path(job['preset']).read_text())[0]
    view = pv.CreateView('RenderView')
    view.ViewSize = [job['size'], job['size']]
    view.UseColorPaletteForBackground = 0
    view.Background = [0.0, 0.0, 0.0]
    view.OrientationAxesVisibility = 0
    shown = pv.Show(source, view, 'UniformGridRepresentation')
    shown.SetRepresentationType('Volume')
    pv.ColorBy(shown, ('POINTS', 'density'))
    shown.SetScalarBarVisibility(view, False)
    shown.VolumeRenderingMode = job['mode']
    shown.ScalarOpacityUnitDistance = 1.0
    shown.Shade = 0
    colors = pv.GetColorTransferFunction('density')
    colors.ColorSpace = preset.get('ColorSpace', 'RGB')
    colors.RGBPoints = preset['RGBPoints']
    pv.GetOpacityTransferFunction('density').Points = preset['Points']
    seconds = []
    for i, camera in enumerate([job['cameras'][0]] + job['cameras']):  # the first one warms up
        view.CameraPosition, view.CameraFocalPoint = camera['eye'], camera['center']
        view.CameraViewUp, view.CameraViewAngle = [0.0, 1.0, 0.0], FOV
        start = time.perf_counter()
        pv.Render(view)
        seconds.append(time.perf_counter() - start)
        pv.SaveScreenshot(f"{job['out']}/{i - 1}.png", view, ImageResolution=view.ViewSize)
    pathlib.Path(job['out'], 'seconds.json').write_text(json.dumps(seconds[1:]))
    os._exit(0)  # the driver's clean-up fails on a virtual display, after all results are written


def pixels(path):
    """A PNG in front of black, as an array of height x width x 3 from 0 to 1."""
    import numpy
    from PIL import Image
    data = numpy.asarray(Image.open(path).convert('RGBA'), float) / 255
    return data[:, :, :3] * data[:, :, 3:]


def run(words):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f'{" ".join(map(str, words))}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}')
    return done.stdout


def draw_with_esvr(options, camera, range_, path, tf_save=()):
    vector = lambda numbers: ','.join(f'{number:.9g}' for number in numbers)
    words = [options.bin / 'render/esvr-render', options.volume, path, '-f', '-q', '--device', 'cpu',
             '--resolution', f'{options.size}x{options.size}', '--range', vector(range_), '--lod', 'off',
             '--colors', 'viridis', '--opacity', 'linear', f"--eye={vector(camera['eye'])}",
             f"--center={vector(camera['center'])}", '--up=0,1,0', '--fov', FOV, *tf_save]
    run(words)


def measured(options, folder):
    import numpy
    from external_compressors import dense, opened, sides
    _, low, high = opened(options.volume, options.box)
    values = dense(options.volume, options.box).astype(numpy.float32)
    values.ravel(order='F').tofile(folder / 'in.raw')
    range_ = (min(0.0, float(values.min())), float(values.max()))
    turn = cameras(low, high, options.views)
    for i, camera in enumerate(turn):
        save = ['--tf-save', folder / 'preset.json'] if i == 0 else []
        draw_with_esvr(options, camera, range_, folder / f'esvr{i}.png', save)
    job = {'raw': str(folder / 'in.raw'), 'sides': sides(low, high), 'low': [float(x) for x in low], 'out': str(folder),
           'preset': str(folder / 'preset.json'), 'size': options.size, 'mode': options.mode, 'cameras': turn}
    (folder / 'job.json').write_text(json.dumps(job))
    display = [] if os.environ.get('DISPLAY') else ['xvfb-run', '-a']
    run([*display, 'pvbatch', __file__, folder / 'job.json'])
    seconds = json.loads((folder / 'seconds.json').read_text())
    error = [numpy.mean((pixels(folder / f'{i}.png') - pixels(folder / f'esvr{i}.png')) ** 2)
             for i in range(options.views)]
    return len(seconds) / sum(seconds), 10 * math.log10(1 / max(numpy.mean(error), 1e-30))


def main():
    if len(sys.argv) == 2 and sys.argv[1].endswith('job.json'):
        return draw_with_paraview(json.loads(pathlib.Path(sys.argv[1]).read_text()))
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('volume', type=pathlib.Path)
    parser.add_argument('--bin', type=pathlib.Path, required=True)
    parser.add_argument('--box')
    parser.add_argument('--views', type=int, default=8)
    parser.add_argument('--size', type=int, default=400)
    parser.add_argument('--mode', default='Ray Cast Only')
    parser.add_argument('--keep', type=pathlib.Path, help='a folder that keeps the pictures')
    options = parser.parse_args()
    sys.path.insert(0, str(HERE))
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.keep or pathlib.Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        fps, psnr = measured(options, folder.resolve())
        print(f'| {options.volume.stem} | {fps:.2f} | {psnr:.2f} |')
    return 0


if __name__ == '__main__':
    sys.exit(main())
