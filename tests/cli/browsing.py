# SPDX-License-Identifier: BSD-3-Clause
"""Functions for the tests of the page of `carom view`: they read its pixels, press keys and click."""

import base64
import contextlib
import io
import subprocess
import sys

import numpy as np

from runs import CAROM, ROOT, SPRINGS, run, write_deck

sys.path.insert(0, str(ROOT / "tools"))

from view_picture import wait_for

BACKGROUND = np.array([20, 22, 26])


def picture(browser, selector=".panel canvas", settled=True):
    """The pixels of the first such element, after everything new is drawn unless `settled` is false. The pixels of a canvas are read from
    the page: a screenshot of a page that draws all the time may take longer on a busy machine than the driver waits."""
    from PIL import Image
    from selenium.webdriver.common.by import By
    if settled:
        wait_for(browser, "!dirty && !showing && panels.every(p => p.shown === Math.min(Math.floor(wanted), p.state.frames - 1))")
    if selector.endswith("canvas"):
        address = browser.execute_script("drawAll(false); return document.querySelector(arguments[0]).toDataURL('image/png')", selector)
        image = base64.b64decode(address.split(",")[1])
    else:
        image = browser.find_element(By.CSS_SELECTOR, selector).screenshot_as_png
    return np.asarray(Image.open(io.BytesIO(image)).convert("RGB")).astype(int)


def lit(pixels):
    """The fraction of the pixels that are not background."""
    return (abs(pixels - BACKGROUND).max(axis=2) > 40).mean()


def differing(one, other):
    return (abs(one - other).max(axis=2) > 40).mean()


def colour_by(browser, name):
    browser.execute_script("element('colour').value = arguments[0]; element('colour').dispatchEvent(new Event('change'))", name)
    wait_for(browser, "!dirty")


def label(browser):
    return browser.execute_script("return panels[0].label.textContent")


# The position of a sphere's centre on the page [pixels].
PLACE = """
const canvas = panels[0].canvas.getBoundingClientRect(), x = arguments[0], axes = camera.axes(), shift = camera.shift();
const [right, up, back] = axes.map((axis, k) => axis[0] * x[0] + axis[1] * x[1] + axis[2] * x[2] + shift[k]);
const q = camera.scale(canvas.width, canvas.height) / -back;
return [canvas.left + canvas.width / 2 + q * right, canvas.top + canvas.height / 2 - q * up].map(Math.round);
"""


@contextlib.contextmanager
def exported(browser, folder, deck=SPRINGS, *overrides):
    """The exported page of a run, at its first frame."""
    run(write_deck(folder, deck), folder / "run", list(overrides))
    target = folder / "page.html"
    subprocess.run([CAROM, "view", str(folder / "run"), "--export", str(target)], check=True, stdout=subprocess.DEVNULL)
    browser.get("about:blank")
    browser.get_log("browser")
    browser.get(target.as_uri())
    wait_for(browser, "playing && panels.every(p => p.frame)")  # an exported page plays as soon as it has read everything
    browser.execute_script("goTo(0)")
    wait_for(browser, "panels[0].shown === 0 && !dirty && !showing")
    yield
    assert not [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"]


def press(browser, key):
    from selenium.webdriver.common.by import By
    browser.find_element(By.TAG_NAME, "body").send_keys(key)


def pixel(browser, pixels, x, y=None, z=0.0):
    column, row = browser.execute_script(PLACE, [x, y, z])
    return pixels[row, column]


def click(browser, column, row):
    for kind in ("mousePressed", "mouseReleased"):
        browser.execute_cdp_cmd("Input.dispatchMouseEvent", {"type": kind, "x": column, "y": row, "button": "left", "clickCount": 1,
                                                             "buttons": int(kind == "mousePressed")})
