// SPDX-License-Identifier: BSD-3-Clause
"use strict";
// The page: a panel for each run, one eye for all, curves of all runs beside them.
const COLOURS = ["#f28e2b", "#4e9af1", "#59c16a", "#e15759", "#b07aa1", "#edc948"];
const element = (id) => document.getElementById(id);
const camera = new Camera();
const charts = {
  error: new Chart(element("curves"), "largest |H − H₁| so far", "time", true),
  temperature: new Chart(element("curves"), "temperature", "time"),
  pressure: new Chart(element("curves"), "pressure", "time"),
};
let dirty = true;      // something is to be drawn
let playing = false;
let wanted = 0;        // the frame to be shown; fractions while playing
const message = (text) => { element("message").textContent = text; };

class Panel {
  constructor(number) {
    this.number = number;
    this.box = document.createElement("div");
    this.box.className = "panel";
    this.canvas = document.createElement("canvas");
    this.label = document.createElement("div");
    this.box.append(this.canvas, this.label);
    element("panels").append(this.box);
    this.spheres = new Spheres(this.canvas, camera);
    this.state = { frames: 0 };
    this.names = null;
    this.thermoBytes = 0;
    steer(this.canvas);
  }
  // Takes what is new: the run's state, rows of thermo, g(r).
  async update(state) {
    const [old, other] = [this.state, state.id !== this.state.id];
    if (other || state.thermo < this.thermoBytes) this.forget();
    this.state = state;
    if (state.thermo > this.thermoBytes) await this.readThermo();
    if (state.rdf && (other || state.rdf !== old.rdf)) await this.readRdf();
    if (state.frames && !this.radii) {
      const values = new Float32Array(await source.binary(`${this.number}/particles`));
      this.radii = values.subarray(0, state.particles);
      this.species = values.subarray(state.particles);
      this.spheres.setRadii(this.radii);
    }
  }
  forget() {
    Object.assign(this, { names: null, thermoBytes: 0, radii: null, frame: null, shown: -1 });
    for (const chart of Object.values(charts)) chart.curves = chart.curves.filter((curve) => curve.panel !== this);
    this.curves = {};
    for (const name of ["error", "temperature", "pressure"]) this.curves[name] = this.curve(charts[name], this.state.integrator, name === "error");
  }
  curve(chart, name, largest) {
    const curve = new Curve(name || "", COLOURS[(chart === charts.rdf ? chart.curves.length : this.number) % 6], largest);
    curve.panel = this;
    chart.curves.push(curve);
    return curve;
  }
  async readThermo() {
    const text = await source.text(`${this.number}/thermo/${this.thermoBytes}`);
    const { names, columns, rows } = readTable(text, this.names);
    this.names = names;
    this.thermoBytes += new TextEncoder().encode(text).length;
    for (const [name, column] of [["error", "max_energy_error"], ["temperature", "temperature"], ["pressure", "pressure"]]) {
      this.curves[name].name = this.state.integrator || "";
      for (let row = 0; row < rows; row++) this.curves[name].add(columns.time[row], columns[column][row]);
    }
    dirty = true;
  }
  async readRdf() {
    const { names, columns, rows } = readTable(await source.text(`${this.number}/rdf`));
    charts.rdf = charts.rdf || new Chart(element("curves"), "g(r)", "r");
    charts.rdf.curves = charts.rdf.curves.filter((curve) => curve.panel !== this);
    for (const name of names.slice(1)) {
      const curve = this.curve(charts.rdf, name);
      for (let row = 0; row < rows; row++) curve.add(columns[names[0]][row], columns[name][row]);
    }
    dirty = true;
  }
  async show(number) {
    number = Math.min(number, this.state.frames - 1);
    if (number < 0 || number === this.shown || !this.radii) return;
    const frame = readFrame(await source.binary(`${this.number}/frame/${number}`), this.state.particles);
    const flat = this.state.dimension === 2;
    if (!camera.fitted) camera.fit(frame.edges, flat);
    Object.assign(this, { frame, shown: number });
    this.spheres.setPositions(frame.position);
    this.spheres.setBox(frame.edges, flat);
    offerColours();
    this.colour();
  }
  colour() {
    if (!this.frame) return;
    const { speed, count } = this.frame, choice = element("colour").value;
    if (choice === "species") this.spheres.setValues(this.species, { kinds: true });
    else if (choice === "collisions" && count) this.spheres.setValues(count, [0, Math.max(1, count.reduce((a, b) => Math.max(a, b), 0))]);
    else this.spheres.setValues(speed, [0, 2.2 * Math.sqrt(speed.reduce((sum, v) => sum + v * v, 0) / speed.length)]);
    dirty = true;
  }
  draw() {
    const { state, frame } = this;
    this.spheres.draw();
    this.label.replaceChildren(Object.assign(document.createElement("b"), { textContent: state.integrator || state.name || "" }),
      `\n${state.title || ""}\n${frame ? `${state.particles} spheres, ${frame.collisions} collisions` : ""}\n${state.status || ""}`);
  }
}

// The mouse: turn, with shift or another button move, wheel nearer, double click back.
function steer(canvas) {
  canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointermove", (event) => {
    if (!event.buttons) return;
    if (event.shiftKey || event.buttons !== 1) camera.move(event.movementX, event.movementY, canvas.clientHeight);
    else camera.turn(event.movementX, event.movementY);
    dirty = true;
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    camera.distance *= Math.exp(0.001 * event.deltaY);
    dirty = true;
  }, { passive: false });
  canvas.addEventListener("dblclick", () => { camera.reset(); dirty = true; });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
}

const panels = [];
const frames = () => Math.max(0, ...panels.map((panel) => panel.state.frames));
const running = () => panels.some((panel) => ["running", "awaited"].includes(panel.state.status));

// The quantities that spheres can be coloured by.
function offerColours() {
  const choices = ["speed", "species", ...(panels.some((panel) => panel.frame && panel.frame.count) ? ["collisions"] : [])];
  const select = element("colour");
  if (select.length !== choices.length) {
    const chosen = select.value || "speed";
    select.replaceChildren(...choices.map((name) => new Option(name)));
    select.value = choices.includes(chosen) ? chosen : "speed";
    select.title = choices.length < 3 ? "by collisions: where the run writes events (output.events = true)" : "";
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

async function keepPolling() {
  for (let first = true; ; first = false) {
    await poll().catch((error) => message(error instanceof TypeError ? "carom has ended" : error.message));
    if (!source.live || (first && !running())) play(true);
    if (!source.live) return;
    await new Promise((done) => setTimeout(done, running() ? 250 : 2000));
  }
}

// What is to be shown next: while the newest is followed, a part of the way there, so that spheres move evenly.
function advance(seconds) {
  const last = frames() - 1;
  if (element("follow").checked) wanted = Math.min(last, wanted + Math.max(1, (last - wanted) / 8));
  else if (playing) wanted += seconds * element("speed").value;
  if (playing && wanted > last) wanted = running() ? last : 0;
  wanted = Math.max(0, Math.min(last, wanted));
}

async function animate() {
  for (let before = performance.now(); ;) {
    const now = await new Promise(requestAnimationFrame);
    advance(Math.min(0.2, (now - before) / 1000));
    before = now;
    await Promise.all(panels.map((panel) => panel.show(Math.floor(wanted)))).catch((error) => message(error.message));
    if (!dirty) continue;
    dirty = false;
    element("frame").value = Math.floor(wanted);
    const time = panels.find((panel) => panel.frame)?.frame.time;
    element("time").value = `frame ${Math.floor(wanted) + 1} of ${frames()}${time === undefined ? "" : `, t = ${+time.toPrecision(6)}`}`;
    panels.forEach((panel) => panel.draw());
    Object.values(charts).forEach((chart) => chart.draw(chart === charts.rdf ? NaN : time));
  }
}

function play(on) {
  playing = on;
  element("play").textContent = on ? "⏸" : "▶";
  if (on) element("follow").checked = false;
}
element("play").addEventListener("click", () => play(!playing));
element("frame").addEventListener("input", (event) => {
  element("follow").checked = false;
  play(false);
  wanted = +event.target.value;
});
element("follow").addEventListener("change", () => play(false));
element("colour").addEventListener("change", () => panels.forEach((panel) => panel.colour()));
document.addEventListener("keydown", (event) => {
  if (event.key === " " && event.target === document.body) { event.preventDefault(); play(!playing); }
});
window.addEventListener("resize", () => { dirty = true; });

keepPolling();
animate();
