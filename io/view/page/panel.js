// SPDX-License-Identifier: BSD-3-Clause
"use strict";
// A panel: the picture of one run, what it is, the key to its colours, and the numbers of the sphere that was clicked.
const COLOURS = ["#f28e2b", "#4e9af1", "#59c16a", "#e15759", "#b07aa1", "#edc948"];
// The averages that are drawn: title and columns, of which species have their own.
const AVERAGES = { rdf: [["g(r)", "g"]], sk: [["S(k)", "S"]],
                   profile: [["density across the box", "density"], ["temperature across the box", "temperature"]] };
const hex = (colour) => "#" + colour.toString(16).padStart(6, "0");

class Panel {
  constructor(number) {
    this.number = number;
    const add = (parent, tag, name) => parent.appendChild(Object.assign(document.createElement(tag), { className: name }));
    this.box = add(element("panels"), "div", "panel");
    this.canvas = add(this.box, "canvas", "");
    for (const part of ["label", "key", "numbers"]) this[part] = add(this.box, "div", part);
    this.spheres = new Spheres(this.canvas, camera);
    this.state = { frames: 0 };
    this.curves = {};
    this.thermoBytes = 0;
    this.path = null;
    steer(this);
  }
  // Reads what is new: the run's state, rows of thermo, averages, and once what does not change.
  async update(state) {
    const [old, other] = [this.state, state.id !== this.state.id];
    if (other || state.thermo < this.thermoBytes) this.forget();
    this.state = state;
    if (state.thermo > this.thermoBytes) await this.readThermo();
    for (const [name, version] of Object.entries(state.averages || {}))
      if (version && (other || version !== old.averages[name])) await this.readAverages(name);
    if (state.frames && !this.radii) {
      const values = new Float32Array(await source.binary(`${this.number}/particles`)), n = state.particles;
      [this.radii, this.species, this.mass, this.charge] = [0, 1, 2, 3].map((k) => values.subarray(k * n, (k + 1) * n));
      this.spheres.setRadii(this.radii);
      this.spheres.setBonds(state.bonds ? new Uint32Array(await source.binary(`${this.number}/bonds`)) : new Uint32Array(0));
    }
  }
  forget() {
    Object.assign(this, { names: null, thermoBytes: 0, radii: null, frame: null, shown: -1 });
    this.choose(-1);
    for (const chart of Object.values(charts)) chart.curves = chart.curves.filter((curve) => curve.panel !== this);
    this.curves = {};
  }
  // A curve is named after the run, or, where averages of one run are drawn, the column.
  curve(chart, column, largest) {
    const curve = new Curve("", COLOURS[(chart.average ? chart.curves.length : this.number) % 6], largest);
    curve.panel = this;
    const own = column === chart.column ? [] : [column];
    const name = () => (!chart.average ? [this.runName] : panels.length > 1 ? [this.runName, ...own] : [column]);
    Object.defineProperty(curve, "name", { get: () => name().join(" ") });
    chart.curves.push(curve);
    return curve;
  }
  async readThermo() {
    const text = await source.text(`${this.number}/thermo/${this.thermoBytes}`);
    const { names, columns, rows } = readTable(text, this.names);
    this.names = names;
    this.thermoBytes += new TextEncoder().encode(text).length;
    for (const { column, chart, title, logarithmic } of this.state.curves || []) {
      if (!columns[column]) continue;
      charts[chart] = charts[chart] || new Chart(element("curves"), title, "time", logarithmic);
      const curve = this.curves[column] = this.curves[column] || this.curve(charts[chart], column, logarithmic);
      for (let row = 0; row < rows; row++) curve.add(columns.time[row], columns[column][row]);
    }
    dirty = true;
  }
  async readAverages(table) {
    const { names, columns, rows } = readTable(await source.text(`${this.number}/${table}`));
    for (const [title, column] of AVERAGES[table]) {
      const chart = charts[title] = charts[title] || new Chart(element("curves"), title, names[0]);
      Object.assign(chart, { average: true, column, drawn: null, curves: chart.curves.filter((curve) => curve.panel !== this) });
      for (const name of names.filter((each) => each === column || each.startsWith(`${column}_`))) {  // not their errors
        const curve = this.curve(chart, name);
        for (let row = 0; row < rows; row++) curve.add(columns[names[0]][row], columns[name][row]);
      }
    }
    dirty = true;
  }
  // What tells this run from the others: its integrator, or its directory where several runs have the same integrator.
  get runName() {
    const { integrator, name } = this.state;
    return panels.some((other) => other !== this && other.state.integrator === integrator) ? (name || "").split("/").at(-1) : integrator || "";
  }
  get flat() { return this.state.dimension === 2; }
  get noun() { return this.flat ? "disc" : "sphere"; }
  async show(number) {
    number = Math.min(number, this.state.frames - 1);
    if (number < 0 || number === this.shown || !this.radii) return;
    const frame = readFrame(await source.binary(`${this.number}/frame/${number}`), this.state.particles);
    if (!camera.fitted) camera.fit(...this.content(frame), this.flat, this.canvas.clientWidth / Math.max(1, this.canvas.clientHeight));
    Object.assign(this, { frame, shown: number });
    this.spheres.setPositions(frame.position);
    this.spheres.setBox(frame.edges, frame.tilt, this.state.boundary, this.flat,
                        this.state.walls.filter(({ shape }) => !shape?.[0]).map((wall) => planeOf(wall, frame.time)),
                        this.state.walls.filter(({ shape }) => shape?.[0]).map(({ shape }) => shape));
    offerColours();
    this.colour();
    await this.follow();
  }
  // The corner and the lengths of what is shown at first: the box, or, along axes that are not periodic and of whose length the spheres
  // take less than half, the spheres with a radius around them.
  content(frame) {
    const corner = [0, 0, 0], lengths = [...frame.edges];
    for (let axis = 0; axis < (this.flat ? 2 : 3); axis++) {
      let [low, high] = [Infinity, -Infinity];
      for (let i = 0; i < this.radii.length; i++) {
        low = Math.min(low, frame.position[3 * i + axis] - 2 * this.radii[i]);
        high = Math.max(high, frame.position[3 * i + axis] + 2 * this.radii[i]);
      }
      if (this.state.boundary[axis] === "periodic" || !(high > low) || high - low > frame.edges[axis] / 2) continue;
      [corner[axis], lengths[axis]] = [low, high - low];
    }
    return [corner, lengths];
  }
  colour() {
    if (!this.frame) return;
    const { speed, spin, count } = this.frame, choice = element("colour").value;
    if (choice === "species") this.spheres.setValues(this.species, { kinds: true });
    else if (choice === "collisions" && count) this.spheres.setValues(count, [0, Math.max(1, count.reduce((a, b) => Math.max(a, b), 0))]);
    else {
      const values = choice === "spin" && spin ? spin : speed;
      this.spheres.setValues(values, [0, 2.2 * Math.sqrt(values.reduce((sum, v) => sum + v * v, 0) / values.length) || 1]);
    }
    this.drawKey();
    dirty = true;
  }
  // The key: a colour bar with the values at its ends, or the species that occur.
  drawKey() {
    const { range } = this.spheres, tag = (name, more) => Object.assign(document.createElement(name), more);
    if (!range.kinds) {
      const bar = tag("span", { className: "bar" });
      bar.style.background = `linear-gradient(to right, ${VIRIDIS.map(hex).join()})`;
      const choice = element("colour").value, open = choice === "collisions" ? "" : "≥ ";
      this.key.replaceChildren(`${choice} ${rounded(range[0])} `, bar, ` ${open}${rounded(range[1])}`);
      return;
    }
    this.occurring = this.occurring || [...new Set(this.species)].sort((a, b) => a - b);
    const names = this.occurring.slice(0, 12).map((kind) => {
      const dot = tag("span", { className: "dot" }), name = tag("span", { className: "kind" });
      dot.style.background = hex(KINDS[kind % 8]);
      name.append(dot, (this.state.species || [])[kind] || `species ${kind}`);
      return name;
    });
    this.key.replaceChildren(...names, this.occurring.length > 12 ? `and ${this.occurring.length - 12} more` : "");
  }
  // Marks a particle, or none (-1).
  choose(id) {
    Object.assign(this, { chosen: id, path: null });
    this.spheres.chosen = id;
    this.spheres.lines("path", []);
    this.numbers.replaceChildren();
    dirty = true;
    return this.follow();
  }
  // Shows the numbers of the chosen particle, and its path so far, up to a thousand frames of it.
  async follow() {
    const { chosen, frame, shown, path } = this;
    if (chosen < 0 || !frame) return;
    const x = [...frame.position.subarray(3 * chosen, 3 * chosen + 3)], name = (this.state.species || [])[this.species[chosen]];
    const rows = [["position", x.slice(0, this.flat ? 2 : 3).map(rounded).join(", ")], ["speed", rounded(frame.speed[chosen])],
                  ["radius", rounded(this.radii[chosen])], ["mass", rounded(this.mass[chosen])], ["charge", rounded(this.charge[chosen])],
                  ...(frame.spin ? [["spin", rounded(frame.spin[chosen])]] : []),
                  ...(frame.count ? [["collisions", frame.count[chosen]]] : [])];
    this.numbers.textContent = [`${this.noun} ${chosen}${name ? `, ${name}` : ""}`, ...rows.map((row) => row.join(" "))].join("\n");
    if (path && shown === path.first + path.positions.length / 3) path.positions = Float32Array.of(...path.positions, ...x);
    else if (!path || shown < path.first || shown >= path.first + path.positions.length / 3) {
      const first = Math.max(0, shown - 999), positions = await source.path(this.number, chosen, first);
      if (this.chosen !== chosen) return;
      this.path = { first, positions };
    }
    this.drawPath();
  }
  // A particle that crosses a periodic boundary comes in on the other side: no line is drawn between these two frames.
  drawPath() {
    const { first, positions } = this.path, ends = [];
    for (let k = 3; k <= 3 * (this.shown - first); k += 3) {
      const [a, b] = [positions.subarray(k - 3, k), positions.subarray(k, k + 3)];
      if (this.frame.edges.every((edge, axis) => Math.abs(b[axis] - a[axis]) < edge / 2)) ends.push(...a, ...b);
    }
    this.spheres.lines("path", ends);
    dirty = true;
  }
  draw(coarse) {
    const { state, frame } = this;
    this.spheres.plane = clipPlane(frame ? frame.edges : [1, 1, 1], this.flat);
    this.spheres.lines("cut", frame ? clipOutline(frame.edges) : []);
    this.spheres.draw(coarse);
    const walls = (state.boundary || []).map((kind, axis) => (kind === "wall" ? "xyz"[axis] : "")).join("");
    const lines = [state.title, frame ? `${counted(state.particles, this.noun)}, ${counted(frame.collisions, "collision")}` : "",
                   [walls && `walls along ${[...walls].join(", ")}`, state.status].filter(Boolean).join("; ")];
    this.label.replaceChildren(Object.assign(document.createElement("b"), { textContent: state.integrator || state.name || "" }),
      ...lines.filter((line) => line).map((line) => `\n${line}`));
  }
}
