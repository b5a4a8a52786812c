// SPDX-License-Identifier: BSD-3-Clause
"use strict";
// The page: asks for what is new, decides which frame is shown, and draws a panel for each run and the curves of all runs.
const camera = new Camera();
const charts = {};        // by name; io/files/thermo.cc declares them, but for averages
const panels = [];
let dirty = true;         // something has changed since the last drawing
let playing = false;
let showing = false;      // a frame is being read
let wanted = 0;           // the frame to be shown; it has a fractional part while playing
let lastMove = -Infinity;  // when the camera last moved [ms]
const message = (text) => { element("message").textContent = text; };
const frames = () => Math.max(0, ...panels.map((panel) => panel.state.frames));
const running = () => panels.some((panel) => ["running", "awaited"].includes(panel.state.status));

// The quantities that spheres can be coloured by.
function offerColours() {
  const some = (name) => panels.some((panel) => panel.frame && panel.frame[name]);
  const choices = ["speed", "species", ...(some("spin") ? ["spin"] : []), ...(some("count") ? ["collisions"] : [])];
  const select = element("colour");
  if (select.length !== choices.length) {
    const chosen = select.value || "speed";
    select.replaceChildren(...choices.map((name) => new Option(name)));
    select.value = choices.includes(chosen) ? chosen : "speed";
    select.title = !some("count") ? "by collisions: if the run writes events (output.events = true)" : "";
  }
}

async function poll() {
  const states = JSON.parse(await source.text("runs"));
  while (panels.length < states.length) panels.push(new Panel(panels.length));
  for (const [number, state] of states.entries()) await panels[number].update(state);
  const slider = element("frame");
  if (+slider.max !== frames() - 1) slider.max = Math.max(0, frames() - 1);
  message("");
  dirty = true;
}

// The server ends with the run: what the runs do is no longer known.
function lost() {
  message("carom has ended");
  if (running()) dirty = true;
  for (const { state } of panels) if (["running", "awaited"].includes(state.status)) state.status = "ended";
}
const failed = (error) => (error instanceof TypeError ? lost() : message(error.message));

async function keepPolling() {
  for (let first = true; ; first = false) {
    await poll().catch(failed);
    if (!source.live || (first && !running())) play(true);
    if (!source.live) return;
    await new Promise((done) => setTimeout(done, running() ? 250 : 2000));
  }
}

// Which frame is shown next. Following the newest goes an eighth of the way there at a time, so that spheres move evenly.
function advance(seconds) {
  const last = frames() - 1;
  if (filming) return;
  if (element("follow").checked) wanted = Math.min(last, wanted + Math.max(1, (last - wanted) / 8));
  else if (playing && camera.fitted) wanted += seconds * element("speed").value;  // the camera is fitted to the first frame
  if (playing && wanted > last) wanted = running() ? last : 0;
  wanted = Math.max(0, Math.min(last, wanted));
}

function drawAll(coarse) {
  element("frame").value = Math.floor(wanted);
  const time = panels.find((panel) => panel.frame)?.frame.time;
  element("time").value = `frame ${Math.floor(wanted) + 1} of ${frames()}${time === undefined ? "" : `, t = ${+time.toPrecision(6)}`}`;
  panels.forEach((panel) => panel.draw(coarse));
  Object.values(charts).forEach((chart) => chart.draw(chart.average ? NaN : time));
}

// While the camera moves or frames follow each other pictures may be coarse; when they rest, the exact one follows.
async function animate() {
  for (let before = performance.now(), coarse = false; ;) {
    const now = await new Promise(requestAnimationFrame);
    advance(Math.min(0.2, (now - before) / 1000));
    before = now;
    showing = true;
    if (!filming) await Promise.all(panels.map((panel) => panel.show(Math.floor(wanted)))).catch(async (error) => {
      failed(error);
      await new Promise((done) => setTimeout(done, 250));
    });
    showing = false;
    const rests = !playing && now - lastMove > 250;
    if (!dirty && !(coarse && rests)) continue;
    dirty = false;
    coarse = !rests;
    drawAll(coarse);
  }
}

listen();
keepPolling();
animate();
