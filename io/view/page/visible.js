// SPDX-License-Identifier: BSD-3-Clause
"use strict";
// Chooses which spheres are drawn. Of many spheres in a box only the outer ones are seen: a depth buffer in JavaScript finds
// them in a tenth of the time that a graphics library without a card takes for the vertices of all.
class Visible {
  constructor() {
    this.leaders = null;      // the spheres seen last: they hide most of the others, so they go first
    this.data = new Float32Array(0);
  }
  // `scene`: positions, radii, values, count, size (a factor for the radii), chosen (an id); `plane`: [nx, ny, nz, d], spheres with
  // n·x > d are left out. Afterwards `data` has five numbers for each sphere to be drawn (centre, radius, value), those small enough
  // for a point of `largest` pixels from the beginning (`points`), the others from `first` on (`squares`).
  choose(scene, camera, width, height, plane, largest, coarse) {
    this.seen = scene.count > Visible.few ? this.uncovered(scene, camera, width, height, plane, coarse) : null;
    const all = this.seen ? this.leaders.length : scene.count;
    if (this.data.length < 5 * all) this.data = new Float32Array(5 * all);
    const { data } = this, { positions, radii, values } = scene, [n0, n1, n2, limit] = plane;
    const [[a0, a1, a2], [b0, b1, b2], [c0, c1, c2]] = camera.axes(), [s0, s1, s2] = camera.shift();
    const scale = camera.scale(width, height), right = width / 2, top = height / 2, near = camera.distance / 100;
    let points = 0, first = data.length / 5;
    for (let k = 0; k < all; k++) {
      const i = this.seen ? this.leaders[k] : k, x = positions[3 * i], y = positions[3 * i + 1], z = positions[3 * i + 2];
      const r = radii[i] * scene.size, depth = -(c0 * x + c1 * y + c2 * z + s2);
      if (n0 * x + n1 * y + n2 * z > limit || depth <= Math.max(near, r)) continue;
      const q = scale / depth, px = Math.abs(q * (a0 * x + a1 * y + a2 * z + s0)), py = Math.abs(q * (b0 * x + b1 * y + b2 * z + s1));
      const reach = depth > 2 * r ? 2 * q * r : Infinity;  // no less than half the width of its picture
      if (px - reach > right || py - reach > top) continue;
      const at = 5 * (px < right && py < top && 2 * reach < largest ? points++ : --first);
      data[at] = x;
      data[at + 1] = y;
      data[at + 2] = z;
      data[at + 3] = r;
      data[at + 4] = i === scene.chosen ? Visible.mark : values[i];
    }
    Object.assign(this, { points, first, squares: data.length / 5 - first });
  }
  // For each sphere 1 where a pixel shows it. Spheres do not overlap, so that the nearer centre is the nearer surface.
  // `coarse`: pixels may be larger, while the picture moves.
  uncovered(scene, camera, width, height, plane, coarse) {
    const { positions, radii, count } = scene, blur = coarse ? Math.max(1, Math.sqrt((width * height) / Visible.pixels)) : 1;
    const [w, h] = [width, height].map((size) => Math.ceil(size / blur)), tiles = (w + 7) >> 3;
    if (!this.depths || this.depths.length !== w * h) {
      this.depths = new Float32Array(w * h);
      this.ids = new Int32Array(w * h);
      this.farthest = new Float32Array(tiles * ((h + 7) >> 3));  // in tiles of 8 by 8 pixels
    }
    const { depths, ids, farthest } = this, [n0, n1, n2, limit] = plane;
    const [[a0, a1, a2], [b0, b1, b2], [c0, c1, c2]] = camera.axes(), [s0, s1, s2] = camera.shift();
    const scale = camera.scale(width, height) / blur, cx = w / 2 - 0.5, cy = h / 2 - 0.5, near = camera.distance / 100;
    depths.fill(Infinity);
    ids.fill(-1);
    farthest.fill(Infinity);
    const put = (i) => {
      const x = positions[3 * i], y = positions[3 * i + 1], z = positions[3 * i + 2], depth = -(c0 * x + c1 * y + c2 * z + s2);
      if (depth <= Math.max(near, radii[i] * scene.size) || n0 * x + n1 * y + n2 * z > limit) return;
      const q = scale / depth, r = q * radii[i] * scene.size, px = cx + q * (a0 * x + a1 * y + a2 * z + s0), py = cy - q * (b0 * x + b1 * y + b2 * z + s1);
      const left = Math.max(0, Math.ceil(px - r)), right = Math.min(w - 1, Math.floor(px + r));
      const low = Math.max(0, Math.ceil(py - r)), high = Math.min(h - 1, Math.floor(py + r));
      if (left > right || low > high) return;
      let hidden = true;
      for (let v = low >> 3; v <= high >> 3 && hidden; v++)
        for (let k = v * tiles + (left >> 3), end = v * tiles + (right >> 3); k <= end && hidden; k++) hidden = depth >= farthest[k];
      if (hidden) return;
      for (let v = low; v <= high; v++) {
        const half = Math.sqrt(Math.max(0, r * r - (v - py) * (v - py)));
        const end = v * w + Math.min(right, Math.floor(px + half));
        for (let k = v * w + Math.max(left, Math.ceil(px - half)); k <= end; k++)
          if (depth < depths[k]) { depths[k] = depth; ids[k] = i; }
      }
    };
    const measure = () => {
      farthest.fill(0);
      for (let v = 0, k = 0; v < h; v++)
        for (let u = 0, row = (v >> 3) * tiles; u < w; u++, k++)
          if (depths[k] > farthest[row + (u >> 3)]) farthest[row + (u >> 3)] = depths[k];
    };
    for (const i of this.leaders || []) if (i < count) put(i);
    measure();
    for (let i = 0; i < count; i += 16) put(i);
    measure();
    for (let i = 0; i < count; i++) put(i);

    const seen = this.marks && this.marks.length === count ? this.marks.fill(0) : (this.marks = new Uint8Array(count)), leaders = [];
    for (const i of ids) if (i >= 0 && !seen[i]) { seen[i] = 1; leaders.push(i); }
    this.leaders = leaders;
    return seen;
  }
}
Visible.few = 50000;      // with no more spheres all are drawn
Visible.pixels = 400000;  // of the depth buffer while the picture moves
Visible.mark = -1e30;     // the value of the sphere that was clicked

// The id of the nearest sphere on the line of sight through a pixel, or -1.
function sphereAt(scene, camera, width, height, plane, px, py) {
  const { positions, radii, count } = scene, scale = camera.scale(width, height), axes = camera.axes(), from = camera.position();
  const slope = [(px - width / 2) / scale, (height / 2 - py) / scale, -1], norm = Math.hypot(...slope);
  const along = [0, 1, 2].map((k) => (axes[0][k] * slope[0] + axes[1][k] * slope[1] + axes[2][k] * slope[2]) / norm);
  let best = Infinity, id = -1;
  for (let i = 0; i < count; i++) {
    const x = positions[3 * i], y = positions[3 * i + 1], z = positions[3 * i + 2], r = radii[i] * scene.size;
    const [dx, dy, dz] = [x - from[0], y - from[1], z - from[2]], t = dx * along[0] + dy * along[1] + dz * along[2];
    const h2 = r * r - (dx * dx + dy * dy + dz * dz - t * t);
    if (h2 < 0 || t <= 0 || t - Math.sqrt(h2) >= best || plane[0] * x + plane[1] * y + plane[2] * z > plane[3]) continue;
    best = t - Math.sqrt(h2);
    id = i;
  }
  return id;
}
