#!/usr/bin/env python3
"""Measures esvr-view as its page sees it, for the section "The viewer" of docs/benchmarks.md.

    view_benchmarks.py start   --bin BUILD FILE   from the start of the program to the first picture
    view_benchmarks.py drag    --bin BUILD FILE   from a changed transfer function to the new picture
    view_benchmarks.py clients --bin BUILD FILE   several clients at the same time, for a while

Each prints the rows of a Markdown table. Pictures have 1024 x 1024 pixels. `start` and `drag` give the least of
several runs, because other programs on the machine only make them longer, and the median of the runs. `clients`
fails if a picture is missing, is not that of its client's camera or comes after a newer one, or if the memory of the
server grows in the second half of the time.
"""
import argparse
import contextlib
import hashlib
import math
import pathlib
import statistics
import subprocess
import sys
import threading
import time

from view_client import Client

SIZE = {"width": 1024, "height": 1024}
SMALL = {"width": 256, "height": 256}
GROWTH = 0.05  # of the memory, in the second half


@contextlib.contextmanager
def server(arguments):
    words = [arguments.bin / "render/view/esvr-view", arguments.file, "--device", arguments.device, "--quiet"]
    process = subprocess.Popen([str(word) for word in words], stdout=subprocess.PIPE, text=True)
    try:
        yield process, process.stdout.readline().strip()
    finally:
        process.terminate()
        if process.wait() != 0:
            raise SystemExit(f"esvr-view ended with exit code {process.returncode}")


def ask(client, **message):
    head, data = client.ask(**message)
    if head["type"] == "failed":
        raise SystemExit(head["text"])
    return head, data


def usual_scene(client, size):
    description = ask(client, type="describe")[0]
    look = description["files"][0]["grids"][0]["defaultLook"]
    camera = ask(client, type="fit", file=0, grid=0, **size)[0]["camera"]
    transfer = {key: look[key] for key in ("space", "colors", "opacity")}
    return {"file": 0, "grid": 0, "camera": camera, "transfer": transfer}


def pictures(client, size, number, scene, **more):
    """Yields the heads and the bytes of the pictures that answer a request."""
    client.send(type="draw", id=number, scene=scene, **size, **more)
    while True:
        head, data = client.receive()
        if head["type"] == "failed":
            raise SystemExit(head["text"])
        yield head, data
        if head["last"]:
            return


def row(name, runs):
    print(f"| {name} | {min(runs):.0f} | {statistics.median(runs):.0f} |", flush=True)


def start(arguments):
    first, complete = [], []
    for _ in range(arguments.runs):
        begin = time.monotonic()
        with server(arguments) as (_, url), Client(url) as client:
            times = [time.monotonic() for _ in pictures(client, SIZE, 1, usual_scene(client, SIZE))]
            first.append(1e3 * (times[0] - begin))
            complete.append(1e3 * (times[-1] - begin))
    row("start to the first picture", first)
    row("start to the complete picture", complete)


def with_opacity(scene, share):
    """The scene with its last point of opacity moved."""
    points = [list(point) for point in scene["transfer"]["opacity"]]
    points[-1][1] = share
    return {**scene, "transfer": {**scene["transfer"], "opacity": points}}


def drag_once(client, scene, moves):
    """Milliseconds from each change to its picture: the progressive one while the point moves."""
    times = []
    for number in range(moves):
        share = 0.55 + 0.4 * math.sin(number / 5)
        begin = time.monotonic()
        for _ in pictures(client, SIZE, number, with_opacity(scene, share), moving=True):
            times.append(1e3 * (time.monotonic() - begin))
    return times


def rest_once(client, scene, number):
    begin = time.monotonic()
    list(pictures(client, SIZE, number, with_opacity(scene, 0.5 + number / 1000)))
    return 1e3 * (time.monotonic() - begin)


def drag(arguments):
    with server(arguments) as (_, url), Client(url) as client:
        scene = usual_scene(client, SIZE)
        list(pictures(client, SIZE, 0, scene))  # decodes what is shown
        runs = [drag_once(client, scene, arguments.moves) for _ in range(arguments.runs)]
        row(f"drag to the new picture, median of {arguments.moves}", [statistics.median(run) for run in runs])
        row(f"drag to the new picture, p95 of {arguments.moves}",
            [statistics.quantiles(run, n=20)[-1] for run in runs])
        row("rest to the complete picture", [rest_once(client, scene, i) for i in range(arguments.runs)])


def memory_of(process):
    """Megabytes that a process holds."""
    for line in pathlib.Path(f"/proc/{process.pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1e3
    raise SystemExit("esvr-view has ended")


class Watcher(threading.Thread):
    """A client that drags and rests in turn. Its camera is its own, so that its complete picture is known."""

    def __init__(self, url, scene, number, until):
        super().__init__()
        self.url, self.until, self.shown, self.wrong = url, until, 0, None
        eye, center = scene["camera"]["eye"], scene["camera"]["center"]
        nearer = 1 - 0.05 * number
        eye = [c + nearer * (e - c) for e, c in zip(eye, center)]
        self.scene = {**scene, "camera": {**scene["camera"], "eye": eye}}

    def complete(self, client, number):
        head, data = list(self.show(client, number))[-1]
        return hashlib.sha256(data).hexdigest() if head["id"] == number else None

    def show(self, client, number, **more):
        for head, data in pictures(client, SMALL, number, self.scene, **more):
            self.shown += 1
            if head["id"] != number:
                self.wrong = f"picture {head['id']} came in place of {number}"
            yield head, data

    def expect(self, client):
        self.expected = self.complete(client, 0)

    def run(self):
        try:
            self.watch()
        except (OSError, SystemExit) as error:
            self.wrong = f"the connection was lost: {error}"

    def watch(self):
        number = 0
        with Client(self.url) as client:
            while time.monotonic() < self.until and not self.wrong:
                for _ in range(5):
                    number += 1
                    list(self.show(client, number, moving=True))
                number += 1
                if self.complete(client, number) != self.expected:
                    self.wrong = f"picture {number} is not that of the client's camera"


def clients(arguments):
    with server(arguments) as (process, url), Client(url) as client:
        scene = usual_scene(client, SMALL)
        begin = time.monotonic()
        watchers = [Watcher(url, scene, i, begin + arguments.seconds) for i in range(arguments.clients)]
        for watcher in watchers:
            watcher.expect(client)
        if len({watcher.expected for watcher in watchers}) < len(watchers):
            raise SystemExit("two cameras have the same picture")
        for watcher in watchers:
            watcher.start()
        memory = []
        while any(watcher.is_alive() for watcher in watchers):
            memory.append(memory_of(process))
            time.sleep(arguments.seconds / 100)
    report(arguments, watchers, memory)


def report(arguments, watchers, memory):
    half = memory[len(memory) // 2]
    print(f"| {arguments.clients} | {arguments.seconds:g} | {sum(w.shown for w in watchers):,} | "
          f"{min(w.shown for w in watchers):,} to {max(w.shown for w in watchers):,} | "
          f"{memory[len(memory) // 10]:.0f} | {half:.0f} | {max(memory):.0f} |")
    wrong = [w.wrong for w in watchers if w.wrong]
    if max(memory[len(memory) // 2:]) > (1 + GROWTH) * half:
        wrong.append("the memory grows")
    if wrong:
        sys.exit("\n".join(wrong))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["start", "drag", "clients"])
    parser.add_argument("file", type=pathlib.Path, help="the file that is shown")
    parser.add_argument("--bin", type=pathlib.Path, required=True, help="build folder")
    parser.add_argument("--device", default="auto")
    parser.add_argument("--runs", type=int, default=5, help="runs of start and drag")
    parser.add_argument("--moves", type=int, default=200, help="changes in a run of drag")
    parser.add_argument("--clients", type=int, default=8)
    parser.add_argument("--seconds", type=float, default=600, help="time of clients")
    arguments = parser.parse_args()
    {"start": start, "drag": drag, "clients": clients}[arguments.what](arguments)


if __name__ == "__main__":
    main()
