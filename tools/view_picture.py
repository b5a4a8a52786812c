#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""A picture of the page of `carom view`, taken by a Chromium without a window.

    tools/view_picture.py runs/five-springs -o five-springs.png
    tools/view_picture.py --demo -o io/view/demo.png        # the picture in io/view/README.md
    tools/view_picture.py runs/melt -o melt.png --width 500 --height 700 --then "panels[0].choose(17)"

Needs Debian's chromium, chromium-driver and python3-selenium (tools/test-packages.txt), and python3-matplotlib's Pillow.
"""

import argparse
import contextlib
import io
import pathlib
import subprocess
import sys
import tempfile
import time

from PIL import Image

from carom_files import find_carom, one_line


@contextlib.contextmanager
def chromium(width=1200, height=640):
    """A browser as an object of selenium, with a page of this size in pixels; WebGL is computed by the processor."""
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service
    options = webdriver.ChromeOptions()
    for argument in ("headless=new", "no-sandbox", "disable-dev-shm-usage", "use-angle=swiftshader", "enable-unsafe-swiftshader",
                     "enable-precise-memory-info", "js-flags=--expose-gc", f"window-size={width},{height}", "hide-scrollbars"):
        options.add_argument("--" + argument)
    options.set_capability("goog:loggingPrefs", {"performance": "ALL", "browser": "ALL"})
    browser = webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)
    try:
        resize(browser, width, height)
        yield browser
    finally:
        browser.quit()


def resize(browser, width, height):
    """Sets the size of the page, without the frame of its window."""
    frame = browser.execute_script("return [outerWidth - innerWidth, outerHeight - innerHeight]")
    browser.set_window_size(width + frame[0], height + frame[1])
    wait_for(browser, f"innerWidth === {width} && innerHeight === {height}")


def wait_for(browser, condition, seconds=300):
    """Waits until an expression of JavaScript is true, and returns its value."""
    deadline = time.monotonic() + seconds
    while not (value := browser.execute_script("return " + condition)):
        if time.monotonic() > deadline:
            raise TimeoutError(f"not true after {seconds} s: {condition}; {browser.get_log('browser')}")
        time.sleep(0.05)
    return value


@one_line
def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="*", help="directories of runs")
    parser.add_argument("--demo", action="store_true", help="show carom demo instead, when it has come half of the way")
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True)
    parser.add_argument("--frame", type=int, default=-1, help="-1 is the last")
    parser.add_argument("--width", type=int, default=1200)
    parser.add_argument("--height", type=int, default=640)
    parser.add_argument("--then", default="", help="JavaScript to run before the picture is taken")
    parser.add_argument("--carom")
    arguments = parser.parse_args()
    carom = str(find_carom(arguments.carom))
    with tempfile.TemporaryDirectory() as folder:
        runs = arguments.runs
        if arguments.demo:
            demo = subprocess.Popen([carom, "demo", folder, "--no-browser"], stdout=subprocess.DEVNULL)
            summaries = [pathlib.Path(folder) / name / "summary.json" for name in ("psa", "edda")]
            while demo.poll() is None and not all(summary.exists() for summary in summaries):
                time.sleep(0.1)
            demo.terminate()
            demo.wait()
            runs = [str(summary.parent) for summary in summaries]
        page = pathlib.Path(folder) / "page.html"
        if subprocess.run([carom, "view", *runs, "--export", str(page), "--max-size", "200"], stdout=subprocess.DEVNULL).returncode:
            sys.exit(1)
        with chromium(arguments.width, arguments.height) as browser:
            browser.get(page.as_uri())
            wait_for(browser, "panels.length && panels.every(p => p.frame)")
            browser.execute_script(f"play(false); wanted = (arguments[0] + frames()) % frames(); {arguments.then}", arguments.frame)
            wait_for(browser, "panels.every(p => p.shown === Math.min(wanted, p.state.frames - 1)) && !dirty")
            picture = Image.open(io.BytesIO(browser.get_screenshot_as_png()))
            picture.convert("RGB").quantize(256, method=Image.Quantize.MAXCOVERAGE).save(arguments.output, optimize=True)


if __name__ == "__main__":
    main()
