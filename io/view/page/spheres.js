// SPDX-License-Identifier: BSD-3-Clause
"use strict";
// Draws the spheres of a run, their bonds, the box with its walls, and the path of a sphere, with WebGL 2.
const rgb = (hex) => [0, 8, 16].map((shift) => ((hex >> (16 - shift)) & 255) / 255);
const VIRIDIS = [0x440154, 0x46327e, 0x365c8d, 0x277f8e, 0x1fa187, 0x4ac16d, 0xa0da39, 0xfde725];
const KINDS = [0x4e9af1, 0xf28e2b, 0x59c16a, 0xe15759, 0xb07aa1, 0xedc948, 0x76d7d0, 0xff9da7];
const GREY = [0.55, 0.6, 0.68, 1], BOND = [0.83, 0.8, 0.72, 1], WALL = [0.62, 0.66, 0.74], PATH = [1, 0.8, 0.3, 1];

class Spheres {
  constructor(canvas, camera) {
    Object.assign(this, { canvas, camera, positions: null, radii: null, values: null, count: 0, size: 1, chosen: -1, range: null,
                          plane: [0, 0, 0, 1], bonds: new Uint32Array(0), walls: [], flat: false });
    const gl = this.gl = canvas.getContext("webgl2", { antialias: false, powerPreference: "high-performance" });
    if (!gl) throw new Error("this browser has no WebGL 2, which the spheres need");
    this.visible = new Visible();
    this.largest = Math.min(256, gl.getParameter(gl.ALIASED_POINT_SIZE_RANGE)[1]);
    this.programs = { spheres: this.program(SPHERE_VERTEX, SPHERE_FRAGMENT), bonds: this.program(BOND_VERTEX, BOND_FRAGMENT),
                      lines: this.program(LINE_VERTEX, LINE_FRAGMENT), walls: this.program(LINE_VERTEX, WALL_FRAGMENT) };
    this.buffers = Object.fromEntries(["spheres", "bonds", "box", "walls", "path", "cut"].map((name) => [name, gl.createBuffer()]));
    this.corners = { box: 0, path: 0, cut: 0 };  // vertices in the buffers of lines
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  }
  program(vertex, fragment) {
    const gl = this.gl, program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    const uniforms = {};
    for (let k = 0; k < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); k++) {
      const name = gl.getActiveUniform(program, k).name;
      uniforms[name.replace("[0]", "")] = gl.getUniformLocation(program, name);
    }
    return { program, uniforms };
  }
  setRadii(radii) { this.radii = radii; }
  setPositions(positions) { Object.assign(this, { positions, count: positions.length / 3 }); }
  // `range`: the values at the two ends of the colours, or { kinds: true } where values are numbers of species.
  setValues(values, range) { Object.assign(this, { values, range }); }
  // `pairs`: two ids for each bond.
  setBonds(pairs) { this.bonds = pairs; }
  // `tilt`: where the image above is along x. `boundary`: wall, periodic or open, for each axis. `planes`: further walls and walls that have moved. `round`: the shapes of the
  // others, drawn as circles and lines.
  setBox(edges, tilt, boundary, flat, planes = [], round = []) {
    const corner = (bits) => edges.map((edge, k) => (bits & (1 << k) ? edge : 0)), ends = [], dimension = flat ? 2 : 3;
    for (let bits = 0; bits < 1 << dimension; bits++)
      for (let k = 0; k < dimension; k++) if (!(bits & (1 << k))) ends.push(...corner(bits), ...corner(bits | (1 << k)));
    if (tilt) {  // where the boxes above and below begin
      const [x, y, z] = edges, part = 0.08 * y;
      for (const at of flat ? [0] : [0, z]) ends.push(tilt, y, at, tilt, y + part, at, x - tilt, 0, at, x - tilt, -part, at);
    }
    for (const shape of round) ends.push(...outlineOf(shape, edges, flat).flat());
    if (flat) for (let k = 2; k < ends.length; k += 3) ends[k] = 0;
    this.lines("box", ends);
    Object.assign(this, { edges, tilt, boundary, flat, walls: [...wallsOf(edges, boundary, flat), ...planes.map((plane) => partOf(plane, edges, flat))] });
  }
  // `ends`: the two ends of each line, three coordinates each.
  lines(name, ends) {
    this.fill(name, new Float32Array(ends));
    this.corners[name] = ends.length / 3;
  }
  fill(name, numbers) {
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, this.buffers[name]);
    this.gl.bufferData(this.gl.ARRAY_BUFFER, numbers, this.gl.DYNAMIC_DRAW);
  }
  // A program with its uniforms set, and the columns of the buffer that it reads; `divisor` 1: a row for each instance.
  use(name, buffer, columns, divisor, first = 0) {
    const gl = this.gl, { program, uniforms } = this.programs[name], stride = 4 * columns.reduce((a, b) => a + b, 0);
    gl.useProgram(program);
    for (const [uniform, set] of Object.entries(this.frameUniforms)) if (uniforms[uniform]) set(uniforms[uniform]);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[buffer]);
    let at = first * stride;
    for (let k = 0; k < 3; k++) {
      if (k >= columns.length) { gl.disableVertexAttribArray(k); continue; }
      gl.enableVertexAttribArray(k);
      gl.vertexAttribPointer(k, columns[k], gl.FLOAT, false, stride, at);
      gl.vertexAttribDivisor(k, divisor);
      at += 4 * columns[k];
    }
    return uniforms;
  }
  pixels() {
    const ratio = window.devicePixelRatio || 1;
    return [this.canvas.clientWidth, this.canvas.clientHeight].map((size) => Math.max(1, Math.round(size * ratio)));
  }
  // `coarse`: among very many spheres, slivers of one or two pixels may be missing.
  draw(coarse) {
    const { gl, canvas, camera } = this, [width, height] = this.pixels();
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    gl.viewport(0, 0, width, height);
    gl.clearColor(0.078, 0.086, 0.102, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (!this.count || !camera.fitted || !this.range) return;
    const [view, projection] = [camera.view(), camera.projection(width, height)], kinds = Boolean(this.range.kinds);
    this.frameUniforms = {
      view: (at) => gl.uniformMatrix4fv(at, false, view), projection: (at) => gl.uniformMatrix4fv(at, false, projection),
      half_size: (at) => gl.uniform2f(at, width / 2, height / 2), flat_: (at) => gl.uniform1i(at, this.flat ? 1 : 0),
      palette: (at) => gl.uniform3fv(at, (kinds ? KINDS : VIRIDIS).flatMap(rgb)), categories: (at) => gl.uniform1i(at, kinds ? 1 : 0),
      range: (at) => gl.uniform2fv(at, kinds ? [0, 1] : this.range), colour: (at) => gl.uniform4fv(at, GREY),
    };
    this.drawSpheres(width, height, coarse);
    this.drawBonds();
    for (const name of ["box", "cut"]) this.drawLines(name, GREY);
    this.drawWalls();
    gl.disable(gl.DEPTH_TEST);  // no sphere hides the path
    this.drawLines("path", PATH);
    gl.enable(gl.DEPTH_TEST);
  }
  drawSpheres(width, height, coarse) {
    const { gl, visible } = this;
    visible.choose(this, this.camera, width, height, this.plane, this.largest, coarse);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.spheres);
    gl.bufferData(gl.ARRAY_BUFFER, visible.data, gl.STREAM_DRAW);
    gl.uniform1i(this.use("spheres", "spheres", [4, 1], 0).squares, 0);
    if (visible.points) gl.drawArrays(gl.POINTS, 0, visible.points);
    gl.uniform1i(this.use("spheres", "spheres", [4, 1], 1, visible.first).squares, 1);
    if (visible.squares) gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, visible.squares);
  }
  drawLines(name, colour) {
    this.gl.uniform4fv(this.use("lines", name, [3], 0).colour, colour);
    this.gl.drawArrays(this.gl.LINES, 0, this.corners[name]);
  }
  // A bond across a periodic boundary is drawn as two halves, each towards the nearest image of the other end.
  drawBonds() {
    const { gl, bonds, positions, edges, tilt, plane, radii } = this, { seen } = this.visible, numbers = [];
    const gone = (i) => plane[0] * positions[3 * i] + plane[1] * positions[3 * i + 1] + plane[2] * positions[3 * i + 2] > plane[3];
    for (let k = 0; k < bonds.length; k += 2) {
      const i = bonds[k], j = bonds[k + 1];
      if ((seen && !seen[i] && !seen[j]) || gone(i) || gone(j)) continue;
      const a = [0, 1, 2].map((axis) => positions[3 * i + axis]), b = [0, 1, 2].map((axis) => positions[3 * j + axis]);
      const thickness = 0.3 * Math.min(radii[i], radii[j]) * Math.min(1, this.size);
      const boxes = (axis, d) => (this.boundary[axis] === "periodic" ? Math.round(d / edges[axis]) : 0);
      const above = boxes(1, b[1] - a[1]), image = edges.map((edge, axis) => edge * boxes(axis, b[axis] - a[axis] - (axis ? 0 : above * tilt)));
      image[0] += above * tilt;
      if (!image.some((shift) => shift)) { numbers.push(...a, ...b, thickness); continue; }
      const half = [0, 1, 2].map((axis) => (b[axis] - image[axis] - a[axis]) / 2);
      if (Math.hypot(...half) < 1.3 * this.size * Math.max(radii[i], radii[j])) continue;  // it would barely leave the sphere
      numbers.push(...a, ...a.map((x, axis) => x + half[axis]), thickness, ...b.map((x, axis) => x - half[axis]), ...b, thickness);
    }
    this.strips = numbers.length / 7;
    if (!numbers.length) return;
    this.fill("bonds", new Float32Array(numbers));
    gl.uniform4fv(this.use("bonds", "bonds", [3, 3, 1], 1).colour, BOND);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, this.strips);
  }
  // Only walls behind the particles are drawn, hatched and translucent.
  drawWalls() {
    const gl = this.gl, eye = this.camera.position(), numbers = [];
    for (const { normal, level, corners } of this.walls) if (this.flat || dot(normal, eye) > level) numbers.push(...corners.flat());
    this.facing = numbers.length / 18;
    if (!numbers.length) return;
    this.fill("walls", new Float32Array(numbers));
    const uniforms = this.use("walls", "walls", [3], 0);
    gl.uniform4fv(uniforms.colour, [...WALL, this.flat ? 0.6 : 0.22]);
    gl.uniform1f(uniforms.spacing, Math.max(...this.edges) / (this.flat ? 60 : 12));
    gl.enable(gl.BLEND);
    gl.depthMask(false);
    gl.drawArrays(gl.TRIANGLES, 0, numbers.length / 3);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }
}

// The walls of a box, as two triangles each: faces of the box, or in two dimensions a band along the outside of an edge.
function wallsOf(edges, boundary, flat) {
  const walls = [], band = 0.02 * Math.max(edges[0], edges[1]);
  for (let axis = 0; axis < (flat ? 2 : 3); axis++) {
    if (boundary[axis] !== "wall") continue;
    const [u, v] = flat ? [1 - axis, axis] : [(axis + 1) % 3, (axis + 2) % 3];
    for (const upper of [0, 1]) {
      const at = upper * edges[axis];
      const corner = (s, t) => {
        const x = [0, 0, 0];
        x[axis] = at;
        x[u] = flat ? (s ? edges[u] + band : -band) : s * edges[u];
        if (flat) x[axis] += t * (upper ? band : -band);
        else x[v] = t * edges[v];
        return x;
      };
      const side = upper ? -1 : 1;
      walls.push({ normal: [0, 1, 2].map((k) => (k === axis ? side : 0)), level: side * at,
                   corners: [[0, 0], [1, 0], [0, 1], [0, 1], [1, 0], [1, 1]].map(([s, t]) => corner(s, t)) });
    }
  }
  return walls;
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
// Where a wall is at a time: normal·x = level.
function planeOf({ normal, motion: [offset, velocity, amplitude, frequency, phase = 0, until] }, now) {
  const time = Math.min(now, until ?? Infinity);
  return { normal, level: offset + velocity * time + amplitude * Math.sin(2 * Math.PI * (frequency * time + phase)) };
}
// The ends of the lines that show a sphere (three great circles), a cylinder (circles and lines along it) or, in two dimensions, a circle.
function outlineOf([radius, ...numbers], edges, flat) {
  const centre = numbers.slice(0, 3), along = numbers.slice(3, 6), ends = [], corners = 96;
  const at = (...terms) => [0, 1, 2].map((k) => centre[k] + terms.reduce((sum, [length, vector]) => sum + length * vector[k], 0));
  const circle = (u, v, ...terms) => {
    for (let k = 0; k < corners; k++)
      for (const turn of [k, k + 1].map((corner) => 2 * Math.PI * corner / corners))
        ends.push(at([radius * Math.cos(turn), u], [radius * Math.sin(turn), v], ...terms));
  };
  const axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
  if (flat) circle(axes[0], axes[1]);
  else if (!along.some((x) => x)) for (let k = 0; k < 3; k++) circle(axes[k], axes[(k + 1) % 3]);
  else {
    const [u, v] = across(along), heights = [0, 1, 2, 3, 4, 5, 6, 7].map((bits) => along.reduce((sum, x, k) => sum + x * ((bits & (1 << k) ? edges[k] : 0) - centre[k]), 0));
    const [low, high] = [Math.min(...heights), Math.max(...heights)];
    for (let part = 0; part <= 4; part++) circle(u, v, [low + part * (high - low) / 4, along]);
    for (let k = 0; k < 8; k++) {
      const turn = Math.PI * k / 4, out = [[radius * Math.cos(turn), u], [radius * Math.sin(turn), v]];
      ends.push(at(...out, [low, along]), at(...out, [high, along]));
    }
  }
  return ends;
}
// Two unit vectors that are normal to a unit vector and to each other.
function across(normal) {
  const other = Math.abs(normal[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const u = cross(normal, other), length = Math.hypot(...u), unit = u.map((x) => x / length);
  return [unit, cross(normal, unit)];
}
// The part of a plane that is in the box, as triangles; in two dimensions a band behind it.
function partOf({ normal, level }, edges, flat) {
  const ends = [];
  for (let axis = 0; axis < (flat ? 2 : 3); axis++)
    for (let bits = 0; bits < (flat ? 4 : 8); bits++) {
      if (bits & (1 << axis)) continue;
      const x = [0, 1, 2].map((k) => (bits & (1 << k) ? edges[k] : 0));
      const at = (level - dot(normal, x)) / normal[axis];
      if (at >= 0 && at <= edges[axis]) ends.push(x.map((each, k) => (k === axis ? at : each)));
    }
  if (flat) {
    const band = 0.02 * Math.max(edges[0], edges[1]), far = (a) => Math.max(...ends.map((b) => Math.hypot(a[0] - b[0], a[1] - b[1])));
    if (ends.length < 2) return { normal, level, corners: [] };
    const p = ends.reduce((a, b) => (far(b) > far(a) ? b : a));
    const q = ends.reduce((a, b) => (Math.hypot(b[0] - p[0], b[1] - p[1]) > Math.hypot(a[0] - p[0], a[1] - p[1]) ? b : a));
    const behind = (x) => x.map((each, k) => each - band * normal[k]);
    return { normal, level, corners: [p, q, behind(p), behind(p), q, behind(q)] };
  }
  const middle = [0, 1, 2].map((k) => ends.reduce((sum, x) => sum + x[k], 0) / ends.length);
  const [u, v] = across(normal);
  const angle = (x) => { const d = x.map((each, k) => each - middle[k]); return Math.atan2(dot(d, v), dot(d, u)); };
  ends.sort((a, b) => angle(a) - angle(b));
  return { normal, level, corners: ends.flatMap((x, k) => [middle, x, ends[(k + 1) % ends.length]]) };
}
