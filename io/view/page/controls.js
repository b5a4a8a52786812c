// SPDX-License-Identifier: BSD-3-Clause
"use strict";
// What the mouse, the keys and the buttons do.
const HELP = [
  ["drag", "turn (in two dimensions: move)"], ["shift and drag, or another button", "move"], ["wheel, + and −", "zoom"],
  ["double click, r", "show the whole box again"], ["click", "numbers and path of a sphere; beside all spheres: no longer"],
  ["space", "play or pause"], ["← and →", "one frame back or on"], ["Home, End", "first or last frame"], ["c", "next clip plane"],
  ["p", "save a picture (PNG)"], ["f", "save a film (WebM), or end it early"], ["? or h", "this help"], ["Esc", "close this help; unmark the sphere"],
];

// Dragging, the wheel and clicks on a panel.
function steer(panel) {
  const { canvas } = panel;
  let moved = 0;
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    moved = 0;
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!event.buttons) return;
    moved += Math.abs(event.movementX) + Math.abs(event.movementY);
    if (event.shiftKey || event.buttons !== 1 || camera.flat) camera.move(event.movementX, event.movementY, canvas.clientWidth, canvas.clientHeight);
    else camera.turn(event.movementX, event.movementY);
    moving();
  });
  canvas.addEventListener("pointerup", (event) => {
    if (moved > 4 || event.button !== 0 || !panel.frame) return;
    const at = canvas.getBoundingClientRect(), { spheres } = panel;
    const id = sphereAt(spheres, camera, at.width, at.height, spheres.plane, event.clientX - at.left, event.clientY - at.top);
    for (const each of panels) each.choose(id < each.state.particles ? id : -1).catch((error) => message(error.message));
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    camera.zoom(Math.exp(0.001 * event.deltaY));
    moving();
  }, { passive: false });
  canvas.addEventListener("dblclick", () => { camera.reset(); moving(); });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
}

// The clip plane [nx, ny, nz, d]: spheres whose centres are beyond it are not drawn. The slider goes through the whole box.
function clipPlane(edges, flat) {
  const axis = element("clip").value, part = element("clip-at").value / 1000;
  if (axis === "off") return [0, 0, 0, 1];
  if (axis !== "view") return [..."xyz"].map((name) => (name === axis ? 1 : 0)).concat(part * edges["xyz".indexOf(axis)]);
  const normal = camera.axes()[2], middle = edges.map((edge, k) => (flat && k === 2 ? 0 : edge / 2));
  return [...normal, normal.reduce((sum, n, k) => sum + n * middle[k], 0) + (part - 0.5) * Math.hypot(...edges)];
}

// The lines in which a clip plane along an axis cuts the box.
function clipOutline(edges) {
  const axis = "xyz".indexOf(element("clip").value), at = element("clip-at").value / 1000;
  if (axis < 0) return [];
  const corners = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]].map(([s, t]) => {
    const x = [0, 0, 0];
    x[axis] = at * edges[axis];
    x[(axis + 1) % 3] = s * edges[(axis + 1) % 3];
    x[(axis + 2) % 3] = t * edges[(axis + 2) % 3];
    return x;
  });
  return corners.slice(1).flatMap((corner, k) => [...corners[k], ...corner]);
}

function help(open) {
  element("help").hidden = !open;
}

// A change of the camera or the clip plane.
function moving() {
  lastMove = performance.now();
  dirty = true;
}

function goTo(frame) {
  element("follow").checked = false;
  play(false);
  wanted = Math.max(0, Math.min(frames() - 1, frame));
}

function play(on) {
  playing = on;
  element("play").className = on ? "playing" : "";
  element("play").setAttribute("aria-label", on ? "Pause" : "Play");
  if (on) element("follow").checked = false;
}

function listen() {
  const on = (id, event, act) => element(id).addEventListener(event, act);
  for (const [action, effect] of HELP) {
    const row = element("help-rows").insertRow();
    row.insertCell().textContent = action;
    row.insertCell().textContent = effect;
  }
  const clip = (axis) => {
    element("clip").value = axis;
    element("clip-at").hidden = axis === "off";
    moving();
  };
  on("play", "click", () => play(!playing));
  on("frame", "input", (event) => goTo(+event.target.value));
  on("follow", "change", () => play(false));
  on("colour", "change", () => panels.forEach((panel) => panel.colour()));
  on("size", "change", () => { panels.forEach((panel) => { panel.spheres.size = element("size").value / 100; }); dirty = true; });
  on("clip", "change", () => clip(element("clip").value));
  on("clip-at", "input", moving);
  on("picture", "click", savePicture);
  on("film", "click", () => saveFilm().catch((error) => message(error.message)));
  on("help-button", "click", () => help(element("help").hidden));
  on("help-close", "click", () => help(false));
  const nextClip = () => {
    const axes = [...element("clip").options].map((option) => option.value);
    clip(axes[(axes.indexOf(element("clip").value) + 1) % axes.length]);
  };
  const keys = {
    " ": () => play(!playing), ArrowLeft: () => goTo(Math.floor(wanted) - 1), ArrowRight: () => goTo(Math.floor(wanted) + 1),
    Home: () => goTo(0), End: () => goTo(frames() - 1), "+": () => { camera.zoom(0.9); moving(); }, "-": () => { camera.zoom(1 / 0.9); moving(); },
    r: () => { camera.reset(); moving(); }, c: nextClip, p: savePicture, f: () => element("film").click(),
    h: () => help(element("help").hidden), "?": () => help(element("help").hidden),
    Escape: () => { if (element("help").hidden) panels.forEach((panel) => panel.choose(-1)); else help(false); },
  };
  document.addEventListener("keydown", (event) => {
    const typed = event.target !== document.body && (event.key === " " || event.key.startsWith("Arrow") || event.target.tagName === "SELECT");
    if (!keys[event.key] || event.ctrlKey || event.altKey || event.metaKey || (typed && event.key !== "Escape")) return;
    event.preventDefault();
    keys[event.key]();
  });
  window.addEventListener("resize", () => { dirty = true; });
}
