# SPDX-License-Identifier: BSD-3-Clause
"""The page of `carom view` in a real browser: bonds, walls, keys to the colours, clicks, keys, the clip plane, pictures, films."""

import time
import tomllib

import numpy as np

from browsing import BACKGROUND, PLACE, click, colour_by, differing, exported, label, lit, picture, pixel, press, wait_for
from carom_files import toml_text
from runs import SPHERES, SPRINGS, needs_carom
from test_view import page
from view_picture import resize

pytestmark = needs_carom


def test_bonds_and_walls_are_drawn(browser, tmp_path):
    with exported(browser, tmp_path):
        pixels = picture(browser)
        bond = pixel(browser, pixels, 2.5, 2.5)
        assert bond.min() > 100 and bond[0] > bond[2], "between the first two discs"
        assert abs(pixel(browser, pixels, 2.5, 1.5) - BACKGROUND).max() < 3
        wall = np.array([pixel(browser, pixels, x, 5.09) for x in np.linspace(1, 8, 100)])
        assert (wall.max(axis=1) > 50).all() and np.ptp(wall, axis=0).min() > 40, "the upper wall is hatched"
        assert "walls along x, y" in label(browser)
        # Periodic boundaries have no wall, and a bond across one is drawn as two halves.
        browser.execute_script("""const { spheres } = panels[0];
            spheres.setBox(spheres.edges, 0, ["periodic", "periodic"], true);
            spheres.setPositions(Float32Array.of(1, 2.5, 0, 7.8, 2.5, 0, 5.5, 2.5, 0, 7.5, 1, 0));
            spheres.setBonds(Uint32Array.of(0, 1));
            dirty = true;""")
        pixels = picture(browser)
        assert browser.execute_script("return panels[0].spheres.strips") == 2
        assert pixel(browser, pixels, 0.3, 2.5).min() > 100 and pixel(browser, pixels, 8.6, 2.5).min() > 100
        assert abs(pixel(browser, pixels, 4, 2.5) - BACKGROUND).max() < 3
        assert all(abs(pixel(browser, pixels, x, 5.09) - BACKGROUND).max() < 3 for x in np.linspace(1, 8, 20))
        # In a sheared box the image above is displaced, and lines above and below show where images begin.
        assert browser.execute_script("return panels[0].spheres.corners.box") == 8
        browser.execute_script("""const { spheres } = panels[0];
            spheres.setBox(spheres.edges, 2, ["periodic", "periodic"], true);
            spheres.setPositions(Float32Array.of(1, 0.4, 0, 3, spheres.edges[1] - 1.4, 0, 5.5, 2.5, 0, 7.5, 1, 0));
            dirty = true;""")
        pixels = picture(browser)
        height = browser.execute_script("return panels[0].spheres.edges[1]")
        assert browser.execute_script("return panels[0].spheres.corners.box") == 12
        assert pixel(browser, pixels, 3, height - 0.65).min() > 100 and abs(pixel(browser, pixels, 1, height - 0.65) - BACKGROUND).max() < 3


def brightest(browser, pixels, x, y):
    """The brightest pixel next to a point of a line."""
    column, row = browser.execute_script(PLACE, [x, y, 0.0])
    return pixels[row - 2:row + 3, column - 2:column + 3].max()


def test_round_walls_are_drawn(browser, tmp_path):
    with exported(browser, tmp_path, toml_text(tomllib.loads(SPRINGS) | {
            "wall": [{"name": "post", "shape": "sphere", "centre": [7.0, 3.9], "radius": 0.7, "inside": False}]}), "run.steps=2"):
        pixels = picture(browser)
        around = [(7 + 0.7 * np.cos(turn), 3.9 + 0.7 * np.sin(turn)) for turn in np.linspace(0, 6, 25)]
        assert min(brightest(browser, pixels, *place) for place in around) > 60, "a circle"
        assert abs(pixel(browser, pixels, 7.0, 3.9) - BACKGROUND).max() < 3
        # In three dimensions a sphere has three circles, and a cylinder along z five and eight lines.
        ends = browser.execute_script("""return [[0, 0, 0], [0, 0, 1]].map((along) => {
            const { spheres } = panels[0];
            spheres.setBox([4, 4, 4], 0, ["wall", "wall", "wall"], false, [], [[2, 2, 2, 2, ...along, 1]]);
            return spheres.corners.box;
        })""")
        assert ends == [24 + 3 * 96 * 2, 24 + 5 * 96 * 2 + 8 * 2]


def test_the_key_to_the_colours(browser, tmp_path):
    with exported(browser, tmp_path):
        words = "return panels[0].key.textContent"
        largest = 2.2 * np.sqrt(np.mean([0.3**2 + 0.1**2, 1.1**2 + 0.4**2, 0.9**2 + 0.7**2, 0.2**2 + 0.3**2]))
        assert browser.execute_script(words) == f"speed 0  ≥ {largest:.4g}"
        colour_by(browser, "species")
        assert browser.execute_script(words) == "disc"
        dot = browser.execute_script("const at = document.querySelector('.dot').getBoundingClientRect(); return [at.left + 5, at.top + 5]")
        pixels = picture(browser, "main")
        assert abs(pixels[int(dot[1]), int(dot[0])] - pixel(browser, pixels, 1.5, 2.5)).max() < 12, "the colour of the discs"


def test_a_click_shows_numbers_and_path(browser, tmp_path):
    with exported(browser, tmp_path):
        click(browser, *browser.execute_script(PLACE, [5.5, 2.6, 0]))
        wait_for(browser, "panels[0].chosen === 2 && panels[0].path")
        lines = browser.execute_script("return panels[0].numbers.textContent").split("\n")
        assert lines == ["disc 2, disc", "position 5.5, 2.6", f"speed {np.hypot(0.9, 0.7):.4g}", "radius 0.5", "mass 1.5", "charge 0"]
        assert pixel(browser, picture(browser), 5.5, 2.6).min() > 200, "it is marked in white"
        before = picture(browser)
        last = browser.execute_script("goTo(frames() - 1); return frames() - 1")
        wait_for(browser, f"panels[0].shown === {last} && !dirty")
        assert browser.execute_script("return panels[0].spheres.corners.path") == 2 * last
        yellow = picture(browser)
        assert ((yellow[:, :, 0] > 230) & (yellow[:, :, 2] < 120)).sum() > ((before[:, :, 0] > 230) & (before[:, :, 2] < 120)).sum() + 50
        path = browser.execute_script("return [...panels[0].path.positions]")
        click(browser, *browser.execute_script(PLACE, [4.5, 0.2, 0]))
        wait_for(browser, "panels[0].chosen === -1 && !panels[0].numbers.textContent && panels[0].spheres.corners.path === 0")
    with page("view", tmp_path / "run", "--no-browser") as (_, port, address):
        browser.get(f"http://127.0.0.1:{port}{address}")
        wait_for(browser, "panels.length && panels[0].frame")
        browser.execute_script("goTo(3); panels[0].choose(2)")
        wait_for(browser, "panels[0].path && panels[0].shown === 3")
        assert browser.execute_script("return [...panels[0].path.positions]") == path, "the server and the export tell the same path"
        press(browser, "\ue00c")
        wait_for(browser, "panels[0].chosen === -1")


def test_a_clip_plane_hides_what_is_beyond(browser, tmp_path):
    drawn = "return panels[0].spheres.visible.points + panels[0].spheres.visible.squares"
    with exported(browser, tmp_path, SPHERES):
        browser.execute_script("camera.zoom(2); moving()")
        wait_for(browser, "!dirty")
        all_drawn, before = browser.execute_script(drawn), picture(browser)
        press(browser, "c")
        wait_for(browser, "element('clip').value === 'x' && !dirty")
        left = browser.execute_script("return panels[0].frame.position.filter((x, k) => k % 3 === 0 && x <= panels[0].frame.edges[0] / 2).length")
        assert all_drawn == 108 and 20 < left < 90 and browser.execute_script(drawn) == left
        assert lit(picture(browser)) < lit(before)
        browser.execute_script("element('clip-at').value = 0; moving()")
        wait_for(browser, "!dirty")
        assert browser.execute_script(drawn) < 15
        browser.execute_script("element('clip').value = 'view'; element('clip-at').value = 500; moving()")
        wait_for(browser, "!dirty")
        assert 20 < browser.execute_script(drawn) < 90


def test_of_many_spheres_only_the_visible_ones_are_drawn(browser, tmp_path):
    with exported(browser, tmp_path, SPHERES, "particles.0.count=4000", "run.end_time=0.1"):
        every = picture(browser)
        browser.execute_script("Visible.few = 100; dirty = true")
        seen = picture(browser)
        number = browser.execute_script("return panels[0].spheres.visible.points")
        assert 200 < number < 2500
        assert differing(every, seen) < 2e-4
        browser.execute_script("camera.turn(300, 20); moving(); lastMove = -1e9")
        turned = picture(browser)
        browser.execute_script("Visible.few = 50000; dirty = true")
        assert differing(seen, turned) > 0.02 and differing(turned, picture(browser)) < 2e-4
        browser.execute_script("camera.zoom(0.2); Visible.few = 100; dirty = true")  # some are larger than the largest point
        near = picture(browser)
        assert browser.execute_script("return panels[0].spheres.visible.squares") > 0
        browser.execute_script("Visible.few = 50000; dirty = true")
        assert differing(near, picture(browser)) < 1e-3


def test_pictures_and_films_are_saved(browser, tmp_path):
    import base64
    from PIL import Image
    with exported(browser, tmp_path, SPHERES):
        browser.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(tmp_path)})
        shown = picture(browser, "main")
        press(browser, "p")
        saved = tmp_path / "run.png"
        deadline = time.monotonic() + 300
        while not saved.exists():
            assert time.monotonic() < deadline
            time.sleep(0.1)
        pixels = np.asarray(Image.open(saved).convert("RGB")).astype(int)
        assert abs(pixels.shape[0] - shown.shape[0]) < 3 and pixels.shape[1] == shown.shape[1]
        rows = min(len(pixels), len(shown))
        assert differing(pixels[:rows], shown[:rows]) < 0.03 and lit(pixels) > 0.05
        text = np.s_[8:60, 8:200]  # the title of the run
        assert abs(lit(pixels[text]) - lit(shown[text])) < 0.02 < lit(shown[text])

        browser.execute_script("element('speed').value = 10; element('film').click()")
        film = tmp_path / "run.webm"
        deadline = time.monotonic() + 300
        while not film.exists():
            assert time.monotonic() < deadline, browser.execute_script("return element('message').textContent")
            time.sleep(0.1)
        assert not browser.execute_script("return filming") and browser.execute_script("return panels[0].shown") == 6
        browser.get("about:blank")
        browser.set_script_timeout(600)
        size = browser.execute_async_script("""const done = arguments[1], video = document.createElement("video");
            video.oncanplay = () => done([video.videoWidth, video.videoHeight]);
            video.onerror = () => done(video.error.message);
            video.src = "data:video/webm;base64," + arguments[0];""", base64.b64encode(film.read_bytes()).decode())
        assert size == [pixels.shape[1], pixels.shape[0]]


def test_help_and_keys(browser, tmp_path):
    with exported(browser, tmp_path):
        rows = browser.execute_script("return element('help').innerText")
        press(browser, "?")
        wait_for(browser, "!element('help').hidden")
        rows = browser.execute_script("return element('help').innerText")
        assert "clip plane" in rows and "drag" in rows
        press(browser, "\ue00c")
        wait_for(browser, "element('help').hidden")
        press(browser, "\ue014")
        wait_for(browser, "panels[0].shown === 1")
        press(browser, "\ue010")
        wait_for(browser, "panels[0].shown === frames() - 1")
        before = picture(browser, "#play")
        press(browser, " ")
        wait_for(browser, "playing")
        browser.execute_script("playing = false")  # without a change of the button
        assert differing(before, picture(browser, "#play")) > 0.02, "the sign on the button"
        assert browser.execute_script("return element('play').textContent") == "", "the sign is drawn, not written"


def test_the_camera_is_fitted_to_the_first_frame(browser, tmp_path):
    with exported(browser, tmp_path):
        moved = browser.execute_script("""camera.fitted = false; wanted = 0; playing = true; advance(0.2);
            const moved = wanted; camera.fitted = true; playing = false; wanted = 0; return moved""")
        assert moved == 0, "playing waits for the camera"


def test_one_collision_and_discs(browser, tmp_path):
    with exported(browser, tmp_path):
        browser.execute_script("panels[0].frame.collisions = 1; dirty = true")
        wait_for(browser, "!dirty")
        assert "\n4 discs, 1 collision\n" in label(browser)


def test_axes_and_legends(browser, tmp_path):
    with exported(browser, tmp_path):
        span = browser.execute_script("""const curve = new Curve("zeros", "red", true);
            for (const x of [0, 1, 2, 3]) curve.add(x, x < 2 ? 0 : 1e-9);
            charts.error.curves = [curve];
            return charts.error.range();""")
        assert span == [0, 3, -9, -8], "zeros count on the axis of time"
        overlaps = """const chart = new Chart(element("curves"), "g(r)", "r"), names = arguments[0];
            chart.curves = names.map((name) => Object.assign(new Curve(name, "red"), { x: [0, 1], y: [0, 1] }));
            chart.draw();
            const pen = chart.canvas.getContext("2d"), title = { x: 52, y: 14, width: pen.measureText("g(r)").width };
            const all = [title, ...chart.names];
            return all.some((a, i) => all.some((b, j) => i < j && a.y === b.y && a.x < b.x + b.width && b.x < a.x + a.width)
                            || a.x + a.width > chart.canvas.clientWidth);"""
        for count in (1, 3, 10):
            assert not browser.execute_script(overlaps, [f"species {k}-another" for k in range(count)])


def test_narrow_windows(browser, tmp_path):
    try:
        with exported(browser, tmp_path):
            resize(browser, 500, 700)
            wait_for(browser, "innerWidth === 500 && !dirty")
            sizes = browser.execute_script("""const at = (name) => document.querySelector(name).getBoundingClientRect();
                return [document.documentElement.scrollWidth, document.documentElement.scrollHeight,
                        at(".panel canvas").width, at(".panel canvas").height, at("#curves").top - at("#panels").bottom, at("footer").bottom]""")
            assert sizes[0] <= 500 and sizes[1] <= 700 and sizes[2] > 450 and sizes[3] > 150 and sizes[4] >= -1 and sizes[5] <= 700
    finally:
        resize(browser, 1000, 600)
