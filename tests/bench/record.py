"""The record: one table of what this version of the programs does, to compare with the version before.

    bench.py record measure --bin FOLDER --data FOLDER --out record.json [--jobs N] [--resume]
    bench.py record page record.json [--before OLD.json] [--page docs/figures/record.md]
    bench.py record compare OLD.json NEW.json

`measure` converts ten volumes with six goals and writes the figures of each case to the JSON file as soon as they are
known. With --resume it measures only what that file does not have. FOLDER of --bin is a build folder, or one that holds
the programs side by side; FOLDER of --data is searched for the volumes with its subfolders. One case is converted on two
cores (user seconds, memory, bytes, errors, decoding), with --jobs N cases at once, each bound to two cores of its own.
Where there is a GPU, each case is converted on it, too, one after the other and bound to four other cores, and volumes
that are usually looked at are drawn, as they are in the file and by NanoVDB. A machine for --jobs N and a GPU has 2 N + 4
cores. --seconds S ends the run after S seconds without what is not finished then.

`page` writes the table, with the differences to an earlier record in parentheses. `compare` prints the cases that got
worse and exits with 4 if there are some. Worse are: more bytes by 0.5 %, a PSNR that is lower by 0.05 dB, more seconds
or fewer pictures a second by 5 %, and a failure where there was none.
"""
import json
import math
import os
import pathlib
import platform
import queue
import shutil
import subprocess
import sys
import tempfile
import threading
import time

import bench

VOLUMES = ["wdas_cloud_sixteenth", "neuron_m207", "neuron_rp140212", "plume_256", "smoke1", "cube_levelset",
           "hydrogen_atom", "aneurism", "gas_0004", "dragon_with_xform"]
GOALS = {"default": [], "ratio": ["--ratio", "50"], "psnr": ["--psnr", "50"], "max-error": ["--max-error", "1%"],
         "lossless": ["--lossless"], "count": ["--count", "12000"]}
LONGEST_FIRST = ["count", "psnr", "default", "ratio", "max-error", "lossless"]
# A frame of a simulation has 24 grids, and a count is one of each grid. One of them shows what a fit takes.
ONE_GRID = {("gas_0004", "count"): ["--grid", "density"]}
DRAWN_VOLUMES = ["aneurism", "smoke1", "wdas_cloud_sixteenth", "neuron_rp140212", "neuron_m207", "hydrogen_atom"]
DRAWN_GOALS = ["default", "count"]
RUNS = 3             # times of short processes are the smallest of this many runs
SHORT = 8.0          # seconds; processes that take longer run once
GPU_CORES = 4        # cores of the processes that use the GPU
MISSED = 4           # exit code of the programs for a goal that was missed; the file is written then
BYTES, DB, TIME = 0.005, 0.05, 0.05  # what counts as worse
NOISE = 0.1          # seconds; smaller differences are those of starting a process


class OutOfTime(Exception):
    """The time of --seconds is over."""


class Failed(Exception):
    """A program failed, which is a figure, too."""


class Programs:
    """Runs the programs and measures their processes."""

    def __init__(self, arguments):
        self.folder = arguments.bin.resolve()
        self.deadline = time.monotonic() + arguments.seconds if arguments.seconds else math.inf
        self.limit = arguments.limit

    def once(self, name, words, allowed):
        """Seconds, user seconds, bytes of memory and exit code of one run."""
        left = self.deadline - time.monotonic()
        if left <= 0:
            raise OutOfTime
        with tempfile.TemporaryFile() as errors:
            begin = time.monotonic()
            process = subprocess.Popen([str(bench.program_in(self.folder, name)), *map(str, words)], stdin=subprocess.DEVNULL,
                                       stdout=subprocess.DEVNULL, stderr=errors)
            timer = threading.Timer(min(left, self.limit), process.kill)
            timer.start()
            _, status, usage = os.wait4(process.pid, 0)
            timer.cancel()
            process.returncode = code = os.waitstatus_to_exitcode(status)
            seconds = time.monotonic() - begin
            errors.seek(0)
            text = errors.read().decode(errors="replace").strip()
        if code == -9 and seconds >= left - 1:
            raise OutOfTime
        if code == -9 and seconds >= self.limit - 1:
            raise Failed(f"not done after {self.limit:g} s")
        if code not in allowed:
            said = [line for line in text.splitlines() if not line.startswith("Try ")]
            raise Failed(f"{name}: exit code {code}: {said[-1] if said else 'no message'}")
        return {"seconds": seconds, "user_seconds": usage.ru_utime, "memory": usage.ru_maxrss * 1024, "code": code}

    def run(self, name, words, allowed=(0,), runs=RUNS):
        """The figures of several runs: the smallest times, the largest memory."""
        done = [self.once(name, words, allowed)]
        while len(done) < runs and done[0]["seconds"] < SHORT:
            done.append(self.once(name, words, allowed))
        return {"seconds": min(d["seconds"] for d in done), "user_seconds": min(d["user_seconds"] for d in done),
                "memory": max(d["memory"] for d in done), "code": done[0]["code"]}


class Record:
    """The figures of all cases in a JSON file, which is whole at any time."""

    def __init__(self, path, resume):
        self.path, self.lock = path, threading.Lock()
        if path.exists() and not resume:
            raise SystemExit(f"{path} exists; continue it with --resume, or remove it")
        self.content = json.loads(path.read_text()) if path.exists() else {
            "schema": "esvr-record", "machine": machine(), "cases": {}}

    def has(self, volume, goal, part):
        return part in self.content["cases"].get(volume, {}).get(goal, {})

    def put(self, volume, goal, part, figures):
        with self.lock:
            self.content["cases"].setdefault(volume, {}).setdefault(goal, {})[part] = figures
            self.write()

    def write(self):
        new = self.path.with_name(self.path.name + ".new")
        new.write_text(json.dumps(self.content, indent=1, sort_keys=True) + "\n")
        os.replace(new, self.path)


def gpu_name():
    if not shutil.which("nvidia-smi"):
        return None
    done = subprocess.run(["nvidia-smi", "--query-gpu=name", "--format=csv,noheader"], capture_output=True, text=True,
                          check=False)
    return done.stdout.splitlines()[0].strip() if done.returncode == 0 and done.stdout.strip() else None


def machine():
    models = {line.split(":", 1)[1].strip() for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines()
              if line.startswith("model name")}
    return {"cpu": ", ".join(sorted(models)) or platform.machine(), "cores": len(os.sched_getaffinity(0)),
            "gpu": gpu_name(), "date": time.strftime("%Y-%m-%d", time.gmtime())}


def volume_files(arguments, programs, folder):
    """The path of each volume. Samples are generated."""
    files = {}
    for name in arguments.volumes:
        if name in bench.SAMPLES:
            files[name] = folder / f"{name}.vdb"
            programs.run("esvr-sample", [bench.SAMPLES[name][0], files[name], *bench.SAMPLES[name][1:], "--quiet"], runs=1)
        else:
            files[name] = bench.find_volume(arguments.data.resolve(), name)
    return files


class Case:
    """One volume with one goal."""

    def __init__(self, programs, record, files, folder, volume, goal, arguments):
        self.programs, self.record, self.volume, self.goal = programs, record, volume, goal
        self.source, self.folder, self.views = files[volume], folder, arguments.views
        self.stem = f"{volume}_{goal}"
        self.options = [*GOALS[goal], *ONE_GRID.get((volume, goal), [])]

    def file(self, part):
        return self.folder / f"{self.stem}_{part}.esvr"

    def convert(self, part, options, runs=RUNS):
        """The figures of making the file of a part, "cpu" or "gpu"."""
        file = self.file(part)
        figures = self.programs.run("vdb2esvr", [self.source, file, *self.options, *options, "--force", "--quiet"],
                                    (0, MISSED), runs)
        figures.update(bytes=file.stat().st_size, missed=figures.pop("code") == MISSED)
        return figures

    def check(self, file):
        """The errors of each grid, measured by another program than the one that wrote the file."""
        report = file.with_suffix(".check.json")
        self.programs.run("esvr-compare", ["check", self.source, file, *ONE_GRID.get((self.volume, self.goal), []),
                                           "--report", report, "--force", "--quiet"], runs=1)
        grids = json.loads(report.read_text())["grids"]
        # JSON has no infinity; a grid that is exact has null.
        # A grid that is not looked through has no transmittance.
        kept = ["psnr_box", "psnr_active", "psnr_t50", "max_error", "iou"]
        return {g["name"]: {name: g[name] for name in kept if name in g} for g in grids}

    def on_cpu(self):
        file, back = self.file("cpu"), self.folder / f"{self.stem}.vdb"
        figures = self.convert("cpu", ["--device", "cpu", "--threads", "2"])
        figures["grids"] = self.check(file)
        decode = self.programs.run("esvr2vdb", [file, back, "--threads", "2", "--force", "--quiet"])
        figures.update(decode_seconds=decode["seconds"], decode_memory=decode["memory"])
        back.unlink()
        file.unlink()
        return figures

    def on_gpu(self, device):
        figures = self.convert("gpu", ["--device", device])
        figures["grids"] = self.check(self.file("gpu"))
        return figures

    def turn(self, device, *options):
        report = self.folder / f"{self.stem}_bench.json"
        self.programs.run("esvr-render", [self.file("gpu"), "--bench", "--ref", self.source, "--turntable", self.views,
                                          "--device", device, *options, "--report", report, "--force", "--quiet"], runs=1)
        return json.loads(report.read_text())

    def drawn(self, device):
        """Pictures a second of the file and of the source in NanoVDB, and how the pictures differ."""
        if not self.file("gpu").exists():
            self.convert("gpu", ["--device", device], runs=1)
        report = self.turn(device)
        figures = {"fps": report["drawn"]["fps_median"], "nanovdb_fps": report["reference"]["fps_median"],
                   "picture_psnr": report["image"]["psnr"]["mean"], "device_bytes": report["drawn"]["device_bytes"],
                   "nanovdb_device_bytes": report["reference"]["device_bytes"]}
        if self.goal == "count":
            try:
                report = self.turn(device, "--between", "sum")
                figures.update(sum_fps=report["drawn"]["fps_median"], sum_picture_psnr=report["image"]["psnr"]["mean"])
            except Failed:
                pass  # the file has voxels, because they took no more bytes than the ellipsoids
        return figures

    def measure(self, part, work, *words):
        if self.record.has(self.volume, self.goal, part):
            return
        begin = time.monotonic()
        try:
            figures = work(*words)
        except Failed as failed:
            figures = {"failure": str(failed)}
        self.record.put(self.volume, self.goal, part, figures)
        print(f"{self.volume}, {self.goal}, {part}: {figures.get('failure', 'done')}, "
              f"{time.monotonic() - begin:.0f} s", flush=True)


def cores_for(jobs, with_gpu):
    """Two cores for each job, and the cores of the GPU's processes."""
    cores = sorted(os.sched_getaffinity(0))
    needed = 2 * jobs + (GPU_CORES if with_gpu else 0)
    if needed > len(cores):
        print(f"{jobs} jobs {'and a GPU ' if with_gpu else ''}need {needed} cores, and there are {len(cores)}; "
              "the times are not comparable with those of other machines", file=sys.stderr)
    pairs = [{cores[2 * j % len(cores)], cores[(2 * j + 1) % len(cores)]} for j in range(jobs)]
    return pairs, set(cores[-GPU_CORES:])


def work_off(tasks, cores, problems):
    """Does the tasks of a queue on the given cores. The processes that a thread starts have its cores."""
    os.sched_setaffinity(0, cores)
    while True:
        try:
            tasks.get_nowait()()
        except (queue.Empty, OutOfTime):
            return
        except BaseException as problem:  # noqa: the main thread raises it again
            problems.append(problem)
            return


def measure(arguments):
    programs, record = Programs(arguments), Record(arguments.out, arguments.resume)
    device = {"auto": "cuda" if gpu_name() else None, "off": None}.get(arguments.gpu, arguments.gpu)
    problems, threads = [], []
    with tempfile.TemporaryDirectory(dir=arguments.scratch) as folder:
        folder = pathlib.Path(folder)
        files = volume_files(arguments, programs, folder)
        on_cpu, on_gpu = queue.Queue(), queue.Queue()

        def gpu_task(case):
            case.measure("gpu", case.on_gpu, device)
            if case.volume in DRAWN_VOLUMES and case.goal in DRAWN_GOALS:
                case.measure("drawn", case.drawn, device)
            case.file("gpu").unlink(missing_ok=True)

        for goal in sorted(arguments.goals, key=LONGEST_FIRST.index):
            for volume in arguments.volumes:
                case = Case(programs, record, files, folder, volume, goal, arguments)
                on_cpu.put(lambda case=case: case.measure("cpu", case.on_cpu))
                on_gpu.put(lambda case=case: gpu_task(case))
        pairs, gpu_cores = cores_for(arguments.jobs, device is not None)
        if "cpu" in arguments.parts:
            threads += [threading.Thread(target=work_off, args=(on_cpu, pair, problems)) for pair in pairs]
        if "gpu" in arguments.parts and device:
            threads.append(threading.Thread(target=work_off, args=(on_gpu, gpu_cores, problems)))
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    if problems:
        raise problems[0]
    wanted = [(v, g, p) for v in arguments.volumes for g in arguments.goals for p in arguments.parts
              if p == "cpu" or device]
    wanted += [(v, g, "drawn") for v, g, p in wanted if p == "gpu" and v in DRAWN_VOLUMES and g in DRAWN_GOALS]
    left = [case for case in wanted if not record.has(*case)]
    print(f"{arguments.out}: {len(left)} measurements are left" + ("; continue with --resume" if left else ""))
    return 0


def main_grid(figures):
    """The grid whose errors stand for the file: the density, or the only one."""
    grids = figures.get("grids") or {}
    return grids.get("density") or next(iter(grids.values()), {})


# The columns: heading, part of the case, figure, how it is shown, and which change is worse (a share, or dB).
COLUMNS = [
    ("bytes", "cpu", "bytes", lambda v: f"{v:,.0f}", ("more", BYTES)),
    ("PSNR box", "cpu", "psnr_box", lambda v: f"{v:.2f}", ("dB", DB)),
    ("PSNR active", "cpu", "psnr_active", lambda v: f"{v:.2f}", ("dB", DB)),
    ("T 0.5", "cpu", "psnr_t50", lambda v: f"{v:.2f}", ("dB", DB)),
    ("CPU s", "cpu", "user_seconds", lambda v: f"{v:.2f}", ("time", TIME)),
    ("memory MB", "cpu", "memory", lambda v: f"{v / 1e6:.0f}", None),
    ("decoding s", "cpu", "decode_seconds", lambda v: f"{v:.2f}", ("time", TIME)),
    ("GPU s", "gpu", "seconds", lambda v: f"{v:.2f}", ("time", TIME)),
    ("GPU bytes", "gpu", "bytes", lambda v: f"{v:,.0f}", ("more", BYTES)),
    ("GPU PSNR box", "gpu", "psnr_box", lambda v: f"{v:.2f}", ("dB", DB)),
]
DRAWN_COLUMNS = [
    ("NanoVDB fps", "drawn", "nanovdb_fps", lambda v: f"{v:.0f}", None),
    ("ESVR fps", "drawn", "fps", lambda v: f"{v:.0f}", ("fewer", TIME)),
    ("picture PSNR", "drawn", "picture_psnr", lambda v: f"{v:.2f}", ("dB", DB)),
    ("sum fps", "drawn", "sum_fps", lambda v: f"{v:.0f}", ("fewer", TIME)),
    ("sum picture PSNR", "drawn", "sum_picture_psnr", lambda v: f"{v:.2f}", ("dB", DB)),
    ("NanoVDB MB", "drawn", "nanovdb_device_bytes", lambda v: f"{v / 1e6:.1f}", None),
    ("ESVR MB", "drawn", "device_bytes", lambda v: f"{v / 1e6:.1f}", None),
]


def figure(case, part, name):
    """A figure of a case. None: not measured. Infinity: a PSNR without an error."""
    figures = case.get(part)
    if not figures or "failure" in figures:
        return None
    if name.startswith("psnr"):
        grid = main_grid(figures)
        return math.inf if name in grid and grid[name] is None else grid.get(name)
    if name.endswith("picture_psnr") and name in figures:
        return math.inf if figures[name] is None else figures[name]  # pictures of the same voxels
    return figures.get(name)


def change(old, new, rule):
    """The text of a change, and whether it is worse."""
    if old is None or new is None or old == new:
        return "", False
    kind, limit = rule or ("share", math.inf)
    if kind == "dB":
        if math.inf in (old, new):
            return ("exact before" if old == math.inf else f"{old:.2f} before"), new < old
        difference = new - old
        return (f"{difference:+.2f}" if abs(difference) >= 0.005 else ""), difference < -limit
    share = (new - old) / old if old else math.inf
    text = f"{100 * share:+.1f} %" if abs(share) >= 0.0005 else ""
    worse = {"more": share > limit, "fewer": share < -limit, "share": False,
             "time": share > limit and new - old > NOISE}[kind]
    return text, worse


def cell(column, case, before):
    """What the table shows, and whether it got worse."""
    _, part, name, show, rule = column
    value = figure(case, part, name)
    if value is None:
        failed = "failure" in case.get(part, {})
        return ("failed", "failure" not in before.get(part, {"failure": ""})) if failed else ("-", False)
    shown = "exact" if value == math.inf else show(value)
    text, worse = change(figure(before, part, name), value, rule)
    return (f"{shown} ({text})" if text else shown) + (" **worse**" if worse else ""), worse


def cases_of(record):
    for volume in VOLUMES:
        for goal in GOALS:
            if goal in record["cases"].get(volume, {}):
                yield volume, goal, record["cases"][volume][goal]


def table(columns, record, before):
    """A Markdown table; nothing if no case has such figures."""
    lines = []
    for volume, goal, case in cases_of(record):
        if not any(c[1] in case for c in columns):
            continue
        cells = [cell(c, case, before["cases"].get(volume, {}).get(goal, {}))[0] for c in columns]
        name = f"`{' '.join(GOALS[goal])}`" if GOALS[goal] else goal
        missed = " (missed)" if case.get("cpu", {}).get("missed") else ""
        lines.append([volume, name + missed, *cells])
    return bench.table(["volume", "goal", *(c[0] for c in columns)], lines, numbers_from=2).strip() if lines else ""


def failures(record):
    return [f"- {volume}, {goal}, {part}: {figures['failure']}" for volume, goal, case in cases_of(record)
            for part, figures in sorted(case.items()) if "failure" in figures]


def page(arguments):
    record = json.loads(arguments.record.read_text())
    before = json.loads(arguments.before.read_text()) if arguments.before else {"cases": {}}
    where = record["machine"]
    failed = failures(record)
    drawn = table(DRAWN_COLUMNS, record, before)
    compared = ("" if not arguments.before else
                "In parentheses is the change from the record before, which was measured on "
                f"{before['machine']['date']} ({before['machine']['cpu']}, {before['machine']['gpu'] or 'no GPU'}). "
                "**worse** marks more bytes by 0.5 %, a PSNR that is lower by 0.05 dB, and more seconds or fewer pictures a "
                "second by 5 %.\n\n")
    text = (f"Measured on {where['date']}, on two cores ({where['cpu']}) for each conversion, and on "
            f"{where['gpu'] or 'no GPU'}.\n\n{compared}{table(COLUMNS, record, before)}\n")
    if failed:
        text += "\nWhat failed:\n\n" + "\n".join(failed) + "\n"
    if drawn:
        text += f"\n## Drawing\n\n{drawn}\n"
    bench.write_page(arguments.page, text)
    return 0


def compare(arguments):
    old, new = (json.loads(path.read_text()) for path in (arguments.old, arguments.new))
    worse, compared = [], 0
    for volume, goal, case in cases_of(new):
        before = old["cases"].get(volume, {}).get(goal, {})
        compared += bool(before)
        for column in COLUMNS + DRAWN_COLUMNS:
            text, is_worse = cell(column, case, before)
            if is_worse:
                worse.append(f"{volume}, {goal}: {column[0]} {text.replace(' **worse**', '')}")
    for volume, goal, _ in cases_of(old):
        if goal not in new["cases"].get(volume, {}):
            print(f"{volume}, {goal}: only in {arguments.old}")
    print("\n".join([*worse, f"{compared} cases compared, {len(worse)} figures got worse"]))
    return MISSED if worse else 0


def add_commands(parser):
    """Adds `measure`, `page` and `compare` to the driver."""
    commands = parser.add_subparsers(dest="what", required=True)
    job = commands.add_parser("measure", help="measure the cases")
    job.add_argument("--bin", type=pathlib.Path, required=True, help="folder of the programs")
    job.add_argument("--data", type=pathlib.Path, required=True, help="folder with the volumes")
    job.add_argument("--out", type=pathlib.Path, required=True, help="JSON file of the figures")
    job.add_argument("--jobs", type=int, default=1, metavar="N", help="conversions at once, each on two cores (1)")
    job.add_argument("--volumes", nargs="+", choices=VOLUMES, default=VOLUMES, metavar="NAME", help=", ".join(VOLUMES))
    job.add_argument("--goals", nargs="+", choices=list(GOALS), default=list(GOALS), metavar="GOAL",
                     help=", ".join(GOALS))
    job.add_argument("--parts", nargs="+", choices=["cpu", "gpu"], default=["cpu", "gpu"], help="what to measure (both)")
    job.add_argument("--resume", action="store_true", help="measure only what the JSON file does not have")
    job.add_argument("--seconds", type=float, metavar="S", help="end after this time; what is not finished is left out")
    job.add_argument("--limit", type=float, default=1800, metavar="S", help="longest time of one process (1800)")
    job.add_argument("--gpu", default="auto", help="auto, off, or the device of the programs' --device")
    job.add_argument("--views", type=int, default=360, help="pictures of a turn (360)")
    job.add_argument("--scratch", type=pathlib.Path, help="folder for the files (default: that of the system)")
    job.set_defaults(do=measure)
    job = commands.add_parser("page", help="write the table")
    job.add_argument("record", type=pathlib.Path)
    job.add_argument("--before", type=pathlib.Path, help="an earlier record")
    job.add_argument("--page", type=pathlib.Path, default=pathlib.Path("docs/figures/record.md"))
    job.set_defaults(do=page)
    job = commands.add_parser("compare", help="exit with 4 if figures got worse")
    job.add_argument("old", type=pathlib.Path)
    job.add_argument("new", type=pathlib.Path)
    job.set_defaults(do=compare)
