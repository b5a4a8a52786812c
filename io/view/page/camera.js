// SPDX-License-Identifier: BSD-3-Clause
"use strict";
// One camera for all panels: it looks at `centre` from `distance`, turned by the angles `yaw` and `pitch` [rad].
class Camera {
  constructor() { this.fitted = false; }
  // Shows a cuboid from `corner` on, the box or a part of it. `aspect`: width over height of the panel. A two-dimensional box is
  // seen from far away, so that discs stay round.
  fit(corner, edges, flat, aspect) {
    const [x, y] = edges, half = flat ? 0.56 * (aspect < 1 ? Math.max(x, y * aspect) : Math.max(y, x / aspect)) : 0.56 * Math.hypot(...edges);
    this.flat = flat;
    this.slope = flat ? 0.02 : 0.365;  // tangent of half the angle of view
    this.home = { centre: edges.map((edge, k) => (flat && k === 2 ? 0 : corner[k] + edge / 2)), yaw: flat ? 0 : 0.6, pitch: flat ? 0 : -0.35,
                  distance: half / this.slope };
    this.reset();
    this.fitted = true;
  }
  reset() { if (this.home) Object.assign(this, this.home, { centre: [...this.home.centre] }); }
  // The axes of the camera: right, up, backwards.
  axes() {
    const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    return [[cy, 0, -sy], [sy * sp, cp, cy * sp], [sy * cp, -sp, cy * cp]];
  }
  position() { return this.axes()[2].map((a, k) => this.centre[k] + this.distance * a); }
  // Camera coordinates of a point are its products with the axes plus this.
  shift() {
    const shift = this.axes().map((axis) => -axis.reduce((sum, a, k) => sum + a * this.centre[k], 0));
    shift[2] -= this.distance;
    return shift;
  }
  view() {
    const axes = this.axes();
    return [0, 1, 2].flatMap((k) => [axes[0][k], axes[1][k], axes[2][k], 0]).concat([...this.shift(), 1]);
  }
  // Pixels for a slope of one, in a picture of this size.
  scale(width, height) { return Math.min(width, height) / 2 / this.slope; }
  projection(width, height) {
    const f = 2 * this.scale(width, height), near = this.distance / 100, far = this.distance * 100;
    return [f / width, 0, 0, 0, 0, f / height, 0, 0, 0, 0, (near + far) / (near - far), -1, 0, 0, (2 * near * far) / (near - far), 0];
  }
  turn(dx, dy) {
    this.yaw -= 0.006 * dx;
    this.pitch = Math.max(-1.55, Math.min(1.55, this.pitch - 0.006 * dy));
  }
  // Moves the scene by so many pixels of a picture of this size.
  move(dx, dy, width, height) {
    const [right, up] = this.axes(), length = this.distance / this.scale(width, height);
    for (let k = 0; k < 3; k++) this.centre[k] += length * (dy * up[k] - dx * right[k]);
  }
  zoom(factor) { this.distance *= factor; }
}
