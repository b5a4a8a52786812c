# SPDX-License-Identifier: BSD-3-Clause
"""The page of `carom view` in a real browser: spheres that move, curves that grow. Its controls: test_view_controls.py."""

import contextlib
import pathlib
import subprocess
import time

import numpy as np
import pytest

from browsing import colour_by, differing, label, lit, picture, wait_for
from runs import CAROM, ROOT, ROUGH, SPHERES, needs_carom, run, write_deck
from test_view import page

pytestmark = needs_carom


def points(browser, curve):
    return browser.execute_script(f"return charts.{curve}.curves[0].x.length")


def curve_ends(browser):
    return browser.execute_script("return ['error', 'temperature', 'pressure'].map(name => charts[name].curves[0].x.at(-1))")


@contextlib.contextmanager
def running(tmp_path, *overrides):
    deck = write_deck(tmp_path, SPHERES)
    sets = [part for override in overrides for part in ("--set", override)]
    with page("run", deck, "-o", tmp_path / "run", "--view", "--no-browser", "--quiet", *sets) as (_, port, path):
        yield f"http://127.0.0.1:{port}{path}"


def requested(browser):
    """The addresses that the page has requested."""
    import json
    messages = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    return {message["params"]["request"]["url"] for message in messages if message["method"] == "Network.requestWillBeSent"}


def test_a_run_is_seen_while_it_goes_on(browser, tmp_path):
    browser.get_log("performance")
    with running(tmp_path, "run.end_time=1e5", "particles.0.count=864", "output.frame_interval=0.5", "output.thermo_interval=0.5",
                 "output.rdf_interval=0.5", "output.events=true") as address:
        browser.get(address)
        wait_for(browser, "frames() > 3 && panels[0].frame")
        first, curve, ends = picture(browser, settled=False), picture(browser, "#curves canvas", False), curve_ends(browser)
        assert lit(first) > 0.05 and lit(curve) > 0.005
        shown = browser.execute_script("return panels[0].shown")
        wait_for(browser, f"panels[0].shown > {shown} + 3")
        assert differing(first, picture(browser, settled=False)) > 0.02, "the spheres stand still"
        assert all(now > before for now, before in zip(curve_ends(browser), ends)), "the curves do not grow"
        assert differing(curve, picture(browser, "#curves canvas", False)) > 0.0005
        assert browser.execute_script("return charts[\"g(r)\"].curves[0].x.length > 5 && Math.max(...charts[\"g(r)\"].curves[0].y) > 1")
        assert browser.execute_script("return charts[\"g(r)\"].curves.length") == 1  # without its error

        # The slider goes back to the first frame, which stays.
        browser.execute_script("element('frame').value = 0; element('frame').dispatchEvent(new Event('input'))")
        wait_for(browser, "panels[0].shown === 0")
        start = picture(browser)
        time.sleep(1)
        assert differing(start, picture(browser)) == 0
        assert "0 collisions" in label(browser)
        assert "frame 1 of" in browser.execute_script("return element('time').textContent")

        # Colours by speed, species and collisions: no sphere moves, all are of one species, none has collided yet.
        colour_by(browser, "species")
        kinds = picture(browser)
        assert differing(start, kinds) > 0.02 and abs(lit(start) - lit(kinds)) < 0.1
        colour_by(browser, "collisions")
        assert differing(kinds, picture(browser)) > 0.02

        # The mouse turns the spheres; playing continues from here.
        from selenium.webdriver.common.action_chains import ActionChains
        from selenium.webdriver.common.by import By
        before = picture(browser)
        canvas = browser.find_element(By.CSS_SELECTOR, ".panel canvas")
        ActionChains(browser).drag_and_drop_by_offset(canvas, 90, 20).perform()
        assert differing(before, picture(browser)) > 0.02
        browser.find_element(By.ID, "play").click()
        wait_for(browser, "panels[0].shown > 3")
    asked = requested(browser)
    assert asked and all(url.startswith(address) for url in asked if not url.endswith("/favicon.ico")), asked
    assert all(url.startswith("http://127.0.0.1") for url in asked)
    wait_for(browser, "element('message').textContent === 'carom has ended' && !dirty")
    assert browser.execute_script("return panels[0].label.textContent.split('\\n').at(-1)") in ("ended", "interrupted"), "it does not run any more"


def test_a_wrong_token_gets_nothing(browser, tmp_path):
    with running(tmp_path, "run.end_time=1e5") as address:
        browser.get(address[:-3] + "xx/")
        assert browser.execute_script("return typeof panels") == "undefined"
        assert "take the whole one" in browser.execute_script("return document.body.textContent")


def test_an_export_works_without_a_server(browser, tmp_path):
    run(write_deck(tmp_path, ROUGH), tmp_path / "run", ["output.rdf_interval=0.5", "output.events=true"])
    target = tmp_path / "page.html"
    subprocess.run([CAROM, "view", str(tmp_path / "run"), str(tmp_path / "run"), "--export", str(target)], check=True, stdout=subprocess.DEVNULL)
    browser.get("about:blank")
    browser.get_log("performance"), browser.get_log("browser")
    browser.get(target.as_uri())
    wait_for(browser, "panels.length === 2 && panels.every(p => p.frame)")
    browser.execute_script("play(false); wanted = 0")
    first = picture(browser)
    browser.execute_script("wanted = 6")
    assert lit(first) > 0.05 and differing(first, picture(browser)) > 0.02
    assert lit(picture(browser, "#curves canvas")) > 0.005 and points(browser, "pressure") > 20
    assert browser.execute_script("return [...element('colour').options].map(o => o.text).join()") == "speed,species,spin,collisions"
    colour_by(browser, "spin")
    spin = "panels[0].frame.spin"
    assert browser.execute_script(f"return panels[0].spheres.range[1] / Math.sqrt({spin}.reduce((s, w) => s + w * w, 0) / 108)") == pytest.approx(2.2)
    assert browser.execute_script("return panels[0].key.textContent").startswith("spin 0 ")
    assert requested(browser) == {target.as_uri()}
    assert not [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"]


def test_discs_in_two_dimensions(browser, tmp_path):
    run(pathlib.Path(ROOT / "inputs" / "five-springs.toml"), tmp_path / "run", ["run.steps=200"])
    with page("view", tmp_path / "run", "--no-browser") as (_, port, path):
        browser.get(f"http://127.0.0.1:{port}{path}")
        wait_for(browser, "panels.length && panels[0].frame")
        browser.execute_script("play(false); wanted = 0")
        colour_by(browser, "species")
        browser.execute_script("panels[0].key.hidden = true")
        pixels = picture(browser)
        blue = (pixels[:, :, 2] > pixels[:, :, 0] + 60)
        columns = np.flatnonzero(np.diff(np.concatenate([[0], blue.any(axis=0).astype(int)])) == 1)
        assert len(columns) == 5 and np.ptp(np.diff(columns)) <= 3, "five discs at equal distances in a row"
        # The box is 12 by 6 and stands upright: the discs are 2 apart.
        rows = np.flatnonzero(blue.any(axis=1))
        assert abs(len(rows) * 2 - np.diff(columns).mean()) < 0.1 * len(rows) * 2


def test_curves_of_two_runs_have_their_names_and_each_average_its_chart(browser, tmp_path):
    for name in "first", "second":
        run(write_deck(tmp_path, SPHERES), tmp_path / name, [f"output.{each}_interval=0.1" for each in ("rdf", "sk", "profile")])
    with page("view", tmp_path / "first", tmp_path / "second", "--no-browser") as (_, port, path):
        browser.get(f"http://127.0.0.1:{port}{path}")
        wait_for(browser, "panels.length === 2 && charts['g(r)']?.curves.length === 2 && charts['temperature across the box']?.curves.length === 2")
        names = browser.execute_script("return Object.entries(charts).map(([title, { curves }]) => [title, curves.map((curve) => curve.name)])")
        assert {title for title, _ in names} >= {"temperature", "g(r)", "S(k)", "density across the box", "temperature across the box"}
        assert all(each == ["first", "second"] for _, each in names), names


TALL = """
format = 1
[system]
dimension = 2
box = [8.0, 200.0]
boundary = ["wall", "wall"]
[[particles]]
name = "disc"
position = [[2.0, 1.0], [6.0, 5.0]]
velocity = [[1.0, 0.0], [0.0, 1.0]]
radius = 0.5
[integrator]
type = "free-flight"
step = 0.1
[run]
steps = 1
"""


def test_a_pile_in_a_tall_box_is_shown_large(browser, tmp_path):
    """Two discs near the floor of a box with walls; without walls the whole box is shown."""
    for boundary, height in ("wall", 3), ("periodic", 100):
        run(write_deck(tmp_path, TALL.replace('"wall"', f'"{boundary}"')), tmp_path / boundary)
        with page("view", tmp_path / boundary, "--no-browser") as (_, port, path):
            browser.get(f"http://127.0.0.1:{port}{path}")
            wait_for(browser, "camera.fitted")
            assert browser.execute_script("return camera.home.centre[1]") == pytest.approx(height, abs=2), boundary


def test_a_long_table_becomes_a_short_curve(browser, tmp_path):
    """A page that stays open does not grow: rows are merged, the largest error is kept."""
    run(write_deck(tmp_path, SPHERES), tmp_path / "run")
    thermo = tmp_path / "run" / "thermo.csv"
    head, *rows = thermo.read_text().splitlines()
    cells = rows[0].split(",")
    with thermo.open("w") as file:
        print(head, file=file)
        for k in range(100001):
            print(",".join([str(k), *cells[1:7], str(1e-3 if k == 7001 else 1e-9), *cells[8:]]), file=file)
    with page("view", tmp_path / "run", "--no-browser") as (_, port, path):
        browser.get(f"http://127.0.0.1:{port}{path}")
        wait_for(browser, "panels.length && charts.error?.curves[0]?.x.at(-1) > 99900")
        assert 1000 < points(browser, "error") < 4001
        assert browser.execute_script("return Math.max(...charts.error.curves[0].y)") == 1e-3
