// SPDX-License-Identifier: BSD-3-Clause
"use strict";
// Spheres by WebGL 2, all by one call: a square for each, turned towards the eye; the fragment shader meets the ray with the sphere.
const VERTEX = `#version 300 es
precision highp float;
uniform mat4 view, projection;
uniform highp sampler2D positions, radii, values;
const vec2 corners[6] = vec2[](vec2(-1, -1), vec2(1, -1), vec2(-1, 1), vec2(-1, 1), vec2(1, -1), vec2(1, 1));
out vec3 ray;
flat out vec3 centre;
flat out float r, shade;
void main() {
  ivec2 at = ivec2((gl_VertexID / 6) % 2048, gl_VertexID / 6 / 2048);
  vec2 corner = corners[gl_VertexID % 6];
  centre = (view * vec4(texelFetch(positions, at, 0).xyz, 1.0)).xyz;
  r = texelFetch(radii, at, 0).x;
  shade = texelFetch(values, at, 0).x;
  float d2 = dot(centre, centre), behind = step(-r, centre.z);
  vec3 ahead = centre * inversesqrt(d2);
  vec3 right = normalize(cross(ahead, vec3(0.0, 1.0, 0.0))), up = cross(right, ahead);
  float half_width = r * sqrt(d2 / max(d2 - r * r, 1e-3 * r * r));  // what the cone around the sphere spans at its centre
  ray = centre + half_width * (corner.x * right + corner.y * up);
  gl_Position = mix(projection * vec4(ray, 1.0), vec4(2.0, 2.0, 2.0, 1.0), behind);
}`;
const FRAGMENT = `#version 300 es
precision highp float;
uniform mat4 projection;
uniform vec3 palette[8];
uniform vec2 range;
uniform bool categories;
in vec3 ray;
flat in vec3 centre;
flat in float r, shade;
out vec4 colour;
void main() {
  vec3 along = normalize(ray);
  float t = dot(along, centre);
  vec3 nearest = t * along - centre;
  float h2 = r * r - dot(nearest, nearest);
  if (h2 < 0.0) discard;
  vec3 hit = (t - sqrt(h2)) * along, normal = (hit - centre) / r;
  float depth = (projection[2].z * hit.z + projection[3].z) / -hit.z;
  gl_FragDepth = 0.5 * depth + 0.5;
  float x = 7.0 * clamp((shade - range.x) / max(range.y - range.x, 1e-30), 0.0, 1.0);
  vec3 base = categories ? palette[int(mod(shade, 8.0))] : mix(palette[int(x)], palette[min(int(x) + 1, 7)], fract(x));
  float light = max(dot(normal, normalize(vec3(-0.3, 0.5, 0.8))), 0.0);
  colour = vec4(base * (0.35 + 0.65 * light) + 0.25 * pow(light, 40.0), 1.0);
}`;
const LINE_VERTEX = `#version 300 es
uniform mat4 view, projection;
layout(location = 0) in vec3 position;
void main() { gl_Position = projection * view * vec4(position, 1.0); }`;
const LINE_FRAGMENT = `#version 300 es
precision highp float;
out vec4 colour;
void main() { colour = vec4(0.55, 0.6, 0.68, 1.0); }`;

const rgb = (hex) => [0, 8, 16].map((shift) => ((hex >> (16 - shift)) & 255) / 255);
const VIRIDIS = [0x440154, 0x46327e, 0x365c8d, 0x277f8e, 0x1fa187, 0x4ac16d, 0xa0da39, 0xfde725].flatMap(rgb);
const KINDS = [0x4e9af1, 0xf28e2b, 0x59c16a, 0xe15759, 0xb07aa1, 0xedc948, 0x76d7d0, 0xff9da7].flatMap(rgb);

// The eye, for all panels: `centre` it looks at, angles [rad], distance.
class Camera {
  constructor() { this.fitted = false; }
  fit(edges, flat) {
    this.home = { centre: edges.map((edge, k) => (flat && k === 2 ? 0 : edge / 2)), yaw: flat ? 0 : 0.6, pitch: flat ? 0 : -0.35,
                  distance: 1.35 * Math.hypot(...edges.slice(0, flat ? 2 : 3)) };
    this.reset();
    this.fitted = true;
  }
  reset() { Object.assign(this, this.home, { centre: [...this.home.centre] }); }
  axes() {  // of the eye: right, up, backwards
    const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    return [[cy, 0, -sy], [sy * sp, cp, cy * sp], [sy * cp, -sp, cy * cp]];
  }
  view() {
    const axes = this.axes();
    const shift = axes.map((axis) => -axis.reduce((sum, a, k) => sum + a * this.centre[k], 0));
    shift[2] -= this.distance;
    return [0, 1, 2].flatMap((k) => [axes[0][k], axes[1][k], axes[2][k], 0]).concat([...shift, 1]);
  }
  projection(aspect) {
    const f = (aspect < 1 ? aspect : 1) / Math.tan(0.35), near = this.distance / 100, far = this.distance * 100;
    return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (near + far) / (near - far), -1, 0, 0, (2 * near * far) / (near - far), 0];
  }
  turn(dx, dy) {
    this.yaw -= 0.006 * dx;
    this.pitch = Math.max(-1.55, Math.min(1.55, this.pitch - 0.006 * dy));
  }
  move(dx, dy, height) {
    const [right, up] = this.axes(), scale = (2 * this.distance * Math.tan(0.35)) / height;
    for (let k = 0; k < 3; k++) this.centre[k] += scale * (dy * up[k] - dx * right[k]);
  }
}

class Spheres {
  constructor(canvas, camera) {
    this.canvas = canvas;
    this.camera = camera;
    const gl = this.gl = canvas.getContext("webgl2", { antialias: false, powerPreference: "high-performance" });
    if (!gl) throw new Error("this browser has no WebGL 2, which the spheres need");
    this.spheres = this.program(VERTEX, FRAGMENT);
    this.lines = this.program(LINE_VERTEX, LINE_FRAGMENT);
    this.array = gl.createVertexArray();
    this.textures = [0, 1, 2].map((unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
      for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
      return gl.getUniformLocation(this.spheres.program, ["positions", "radii", "values"][unit]);
    });
    this.lineArray = gl.createVertexArray();
    gl.bindVertexArray(this.lineArray);
    this.lineBuffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.lineBuffer);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
    gl.enable(gl.DEPTH_TEST);
    this.count = 0;
    this.corners = 0;
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
    const place = (name) => gl.getUniformLocation(program, name);
    return { program, view: place("view"), projection: place("projection"), palette: place("palette"), range: place("range"),
             categories: place("categories") };
  }
  // Numbers of all spheres as a texture, in rows of 2048.
  load(unit, values, columns) {
    const gl = this.gl, rows = Math.ceil(values.length / columns / 2048), all = new Float32Array(rows * 2048 * columns);
    all.set(values);
    gl.activeTexture(gl.TEXTURE0 + unit);
    const [stored, format] = columns === 3 ? [gl.RGB32F, gl.RGB] : [gl.R32F, gl.RED];
    gl.texImage2D(gl.TEXTURE_2D, 0, stored, 2048, rows, 0, format, gl.FLOAT, all);
  }
  setRadii(radii) { this.load(1, radii, 1); }
  setPositions(positions) {
    this.load(0, positions, 3);
    this.count = positions.length / 3;
  }
  // `range`: the values of the ends of the colours, or nothing where values are numbers of kinds.
  setValues(values, range) {
    this.load(2, values, 1);
    this.range = range;
  }
  setBox(edges, flat) {
    const corner = (bits) => edges.map((edge, k) => (bits & (1 << k) ? edge : 0)), ends = [];
    for (let bits = 0; bits < (flat ? 4 : 8); bits++)
      for (let k = 0; k < (flat ? 2 : 3); k++)
        if (!(bits & (1 << k))) ends.push(...corner(bits), ...corner(bits | (1 << k)));
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, this.lineBuffer);
    this.gl.bufferData(this.gl.ARRAY_BUFFER, new Float32Array(ends), this.gl.DYNAMIC_DRAW);
    this.corners = ends.length / 3;
  }
  draw() {
    const gl = this.gl, canvas = this.canvas, ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((size) => Math.max(1, Math.round(size * ratio)));
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    gl.viewport(0, 0, width, height);
    gl.clearColor(0.078, 0.086, 0.102, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (!this.count || !this.camera.fitted || !this.range) return;
    const view = this.camera.view(), projection = this.camera.projection(width / height);
    for (const [use, array] of [[this.spheres, this.array], [this.lines, this.lineArray]]) {
      gl.useProgram(use.program);
      gl.uniformMatrix4fv(use.view, false, view);
      gl.uniformMatrix4fv(use.projection, false, projection);
      gl.bindVertexArray(array);
      if (use === this.lines) { gl.drawArrays(gl.LINES, 0, this.corners); continue; }
      gl.uniform3fv(use.palette, this.range.kinds ? KINDS : VIRIDIS);
      gl.uniform2fv(use.range, this.range.kinds ? [0, 1] : this.range);
      gl.uniform1i(use.categories, this.range.kinds ? 1 : 0);
      this.textures.forEach((place, unit) => gl.uniform1i(place, unit));
      gl.drawArrays(gl.TRIANGLES, 0, 6 * this.count);
    }
  }
}
