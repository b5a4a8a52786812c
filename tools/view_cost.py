#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The costs of `carom view`: processor time of a run that is shown, memory of an open page, frames drawn per second.

    tools/view_cost.py                  # all three, about five minutes
    tools/view_cost.py --minutes 10     # the page is open for this time
    tools/view_cost.py --drawing        # only the frames drawn per second

Chromium runs without a window and draws by the processor (SwiftShader). Needs the packages in tools/test-packages.txt.
"""

import argparse
import contextlib
import os
import pathlib
import re
import subprocess
import tempfile
import time
import urllib.request

from carom_files import find_carom, one_line
from view_picture import chromium, wait_for

DECK = pathlib.Path(__file__).resolve().parent.parent / "inputs" / "hard-sphere-fluid.toml"
DRAW = """
const [n, distance] = arguments, spheres = panels[0].spheres, edge = Math.cbrt(n / 0.6), pixel = new Uint8Array(4);
const x = new Float32Array(3 * n).map(() => edge * Math.random()), edges = [edge, edge, edge];
Object.assign(panels[0].frame, { edges });
spheres.setRadii(new Float32Array(n).fill(0.5));
spheres.setPositions(x);
spheres.setValues(x.subarray(0, n), [0, edge]);
spheres.setBox(edges, ["periodic", "periodic", "periodic"], false);
camera.fit([0, 0, 0], edges, false, 1);
camera.zoom(distance);
let start, drawn = -2;
for (start = performance.now(); drawn < 10; drawn++) {
  if (drawn === 0) start = performance.now();
  camera.turn(3, 0);
  drawAll(true);
  spheres.gl.readPixels(0, 0, 1, 1, spheres.gl.RGBA, spheres.gl.UNSIGNED_BYTE, pixel);
}
return (performance.now() - start) / drawn;
"""


def command(carom, folder, *more, **settings):
    sets = [part for key, value in settings.items() for part in ("--set", f"{key.replace('__', '.')}={value}")]
    return [str(carom), "run", str(DECK), "-o", str(folder), "--quiet", *more, *sets]


@contextlib.contextmanager
def shown(arguments):
    run = subprocess.Popen([*arguments, "--view", "--no-browser"], stdout=subprocess.PIPE, text=True)
    try:
        yield run, re.search(r"http\S+", run.stdout.readline())[0]
    finally:
        run.terminate()
        run.wait()


def processor_time(process, between=lambda: None):
    """Seconds of the process alone until it ends, without its children; `between` is called ten times per second."""
    ticks = 0
    while process.poll() is None:
        with contextlib.suppress(OSError, IndexError):
            fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
            ticks = max(ticks, int(fields[11]) + int(fields[12]))
            between()
        time.sleep(0.1)
    return ticks / os.sysconf("SC_CLK_TCK")


def cost_of_a_run(carom, folder, n, repeats):
    settings = {"particles__0__count": n, "run__end_time": 4.0, "output__frame_interval": 0.08, "output__thermo_interval": 0.08}
    alone, beside = [], []
    for k in range(repeats):
        alone.append(processor_time(subprocess.Popen(command(carom, folder / f"alone{k}", **settings))))
        asked = 0
        with shown(command(carom, folder / f"shown{k}", **settings)) as (run, address):
            def ask():
                nonlocal asked
                frames = int(re.search(rb'"frames":(\d+)', urllib.request.urlopen(address + "runs").read())[1])
                if frames:
                    urllib.request.urlopen(f"{address}0/frame/{frames - 1}").read()
                    asked += 1
            beside.append(processor_time(run, ask))
    print(f"run of {n} spheres, least of {repeats}: {min(alone):.2f} s of a processor alone, {min(beside):.2f} s with the page "
          f"({100 * (min(beside) / min(alone) - 1):+.1f} %; {asked} frames asked for)", flush=True)


def memory_of_a_page(carom, folder, n, minutes):
    settings = {"particles__0__count": n, "run__end_time": 1e9, "output__frame_interval": 0.5, "output__thermo_interval": 0.1}
    with shown(command(carom, folder / "open", **settings)) as (_, address), chromium() as browser:
        browser.get(address)
        browser.set_script_timeout(600)
        wait_for(browser, "panels.length && panels[0].frame")
        for minute in range(minutes + 1):
            browser.execute_script("window.gc && gc()")
            heap = browser.execute_script("return performance.memory.usedJSHeapSize")
            frames = browser.execute_script("return frames()")
            print(f"page of a run of {n} spheres after {minute} min: {heap / 1e6:.1f} MB of JavaScript, {frames} frames", flush=True)
            time.sleep(60 if minute < minutes else 0)


def processor_seconds(pid):
    """The memory of a process and all its descendants."""
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    children = subprocess.run(["pgrep", "-P", str(pid)], capture_output=True, text=True).stdout.split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK") + sum(map(processor_seconds, children))


def drawing(carom, folder):
    """Frames per second while the camera turns about spheres at random positions, seen from outside and from near."""
    settings = {"particles__0__count": 108, "run__end_time": 0.1}
    subprocess.run(command(carom, folder / "small", **settings), check=True)
    page = folder / "page.html"
    subprocess.run([str(carom), "view", str(folder / "small"), "--export", str(page)], check=True, stdout=subprocess.DEVNULL)
    for width, height in ((1200, 640), (2560, 1300)):
        with chromium(width, height) as browser:
            browser.set_script_timeout(600)
            browser.get(page.as_uri())
            wait_for(browser, "panels.length && panels[0].frame")
            browser.execute_script("play(false); advance = () => {}; element('follow').checked = false")
            for count in (100000, 1000000):
                for distance in (1, 0.5):
                    before = processor_seconds(browser.service.process.pid)
                    milliseconds = browser.execute_script(DRAW, count, distance)
                    used = (processor_seconds(browser.service.process.pid) - before) / 12
                    print(f"{count} spheres, window of {width} by {height}, distance {distance}: {1000 / milliseconds:.1f} frames per second, "
                          f"at most {1000 * used:.0f} ms of processor time each", flush=True)


@one_line
def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=int, default=3)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--drawing", action="store_true", help="measure only how many frames are drawn a second")
    parser.add_argument("--carom")
    arguments = parser.parse_args()
    carom = find_carom(arguments.carom)
    with tempfile.TemporaryDirectory() as name:
        if not arguments.drawing:
            cost_of_a_run(carom, pathlib.Path(name), 108000, arguments.repeats)
            memory_of_a_page(carom, pathlib.Path(name), 10976, arguments.minutes)
        drawing(carom, pathlib.Path(name))


if __name__ == "__main__":
    main()
