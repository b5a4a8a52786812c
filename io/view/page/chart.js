// SPDX-License-Identifier: BSD-3-Clause
"use strict";
const element = (id) => document.getElementById(id);

// A curve that grows: when it has too many points, pairs of them are merged into one, with the mean of the two values or, where
// `largest` is set, the larger one.
class Curve {
  constructor(name, colour, largest) { Object.assign(this, { name, colour, largest, x: [], y: [], every: 1, waiting: [] }); }
  add(x, y) {
    this.waiting.push([x, y]);
    if (this.waiting.length < this.every) return;
    const ys = this.waiting.map((point) => point[1]);
    this.x.push(x);
    this.y.push(this.largest ? Math.max(...ys) : ys.reduce((a, b) => a + b) / ys.length);
    this.waiting = [];
    if (this.x.length >= Curve.most) this.halve();
  }
  halve() {
    const pairs = this.x.length >> 1, merged = (k) => this.largest
      ? Math.max(this.y[2 * k], this.y[2 * k + 1]) : (this.y[2 * k] + this.y[2 * k + 1]) / 2;
    this.y = Array.from({ length: pairs }, (_, k) => merged(k));
    this.x = Array.from({ length: pairs }, (_, k) => this.x[2 * k + 1]);
    this.every *= 2;
  }
}
Curve.most = 4000;

// Curves over one axis. `log`: the other axis is logarithmic, and zeros are drawn at its lower end.
class Chart {
  constructor(parent, title, xLabel, log) {
    Object.assign(this, { title, xLabel, log, curves: [], canvas: document.createElement("canvas") });
    this.canvas.dataset.title = title;
    parent.append(this.canvas);
  }
  ticks(low, high) {
    if (this.log) {
      const every = Math.max(1, Math.ceil((high - low) / 5));
      return Array.from({ length: Math.floor((high - low) / every) + 1 }, (_, k) => Math.ceil(low) + k * every).filter((t) => t <= high);
    }
    return Chart.round(low, high);
  }
  static round(low, high) {
    const raw = (high - low) / 4, power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].find((factor) => factor * power >= raw) * power, all = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) all.push(k * step);
    return all;
  }
  range() {
    let [x0, x1, y0, y1] = [Infinity, -Infinity, Infinity, -Infinity];
    for (const curve of this.curves)
      for (let k = 0; k < curve.x.length; k++) {
        const y = this.log ? Math.log10(curve.y[k]) : curve.y[k];
        if (!isNaN(y)) [x0, x1] = [Math.min(x0, curve.x[k]), Math.max(x1, curve.x[k])];
        if (isFinite(y)) [y0, y1] = [Math.min(y0, y), Math.max(y1, y)];
      }
    if (isFinite(x0) && !(y1 >= y0)) [y0, y1] = this.log ? [-16, -15] : [0, 0];  // zeros only
    if (this.log) [y0, y1] = [Math.floor(y0), Math.max(Math.floor(y0) + 1, Math.ceil(y1))];
    if (!(x1 > x0)) [x0, x1] = [x0 - 0.5, x0 + 0.5];
    // A quantity that is constant up to rounding is drawn as a straight line.
    const margin = this.log ? 0 : Math.max(0.05 * (y1 - y0), 1e-3 * Math.max(Math.abs(y0), Math.abs(y1))) || 1;
    return [x0, x1, y0 - margin, y1 + margin];
  }
  // The names of the curves, beside the title if there is room, otherwise in lines below it; returns where the diagram begins.
  legend(pen, left, right) {
    const gap = 12, widths = this.curves.map((curve) => pen.measureText(curve.name).width + gap), all = widths.reduce((a, b) => a + b, 0);
    const beside = left + pen.measureText(this.title).width + gap + all <= right + gap;
    let [x, y] = beside ? [right + gap - all, 14] : [left, 28];
    this.names = this.curves.map((curve, k) => {
      if (x > left && x + widths[k] > right + gap) [x, y] = [left, y + 14];
      const place = { x, y, width: widths[k] - gap };
      x += widths[k];
      return place;
    });
    pen.textAlign = "left";
    this.curves.forEach((curve, k) => {
      pen.fillStyle = curve.colour;
      pen.fillText(curve.name, this.names[k].x, this.names[k].y, right - this.names[k].x);
    });
    return (this.curves.length ? y : 14) + 10;
  }
  draw(now) {
    const canvas = this.canvas, ratio = window.devicePixelRatio || 1, pen = canvas.getContext("2d");
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    const drawn = [now, width, height, ratio, ...this.curves.flatMap((curve) => [curve.name, curve.x.length, curve.every])].join();
    if (drawn === this.drawn) return;
    this.drawn = drawn;
    [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
    pen.scale(ratio, ratio);
    pen.font = "11px system-ui, sans-serif";
    pen.fillStyle = "#d8dce2";
    const [x0, x1, y0, y1] = this.range();
    if (!isFinite(x0)) return pen.fillText(this.title, 52, 14);
    const text = (tick) => (this.log ? `1e${tick}` : String(+tick.toPrecision(4))), ticks = this.ticks(y0, y1);
    const left = Math.max(52, ...ticks.map((tick) => pen.measureText(text(tick)).width + 8));
    pen.fillText(this.title, left, 14);
    const [right, bottom] = [width - 10, height - 24], top = this.legend(pen, left, right);
    const px = (x) => left + ((x - x0) / (x1 - x0)) * (right - left);
    const py = (y) => bottom - ((y - y0) / (y1 - y0)) * (bottom - top);
    pen.strokeStyle = "#2a2e35";
    pen.fillStyle = "#8b93a1";
    for (const tick of ticks) {
      pen.strokeRect(left, py(tick), right - left, 0);
      pen.textAlign = "right";
      pen.fillText(text(tick), left - 5, py(tick) + 4);
    }
    for (const tick of Chart.round(x0, x1)) {
      pen.strokeRect(px(tick), top, 0, bottom - top);
      pen.textAlign = "center";
      const number = String(+tick.toPrecision(4));
      pen.fillText(number, Math.min(px(tick), width - 2 - pen.measureText(number).width / 2), bottom + 13);
    }
    pen.textAlign = "right";
    pen.fillText(this.xLabel, right, height - 1);
    for (const curve of this.curves) {
      pen.strokeStyle = curve.colour;
      pen.beginPath();
      curve.x.forEach((x, k) => {
        const y = this.log ? Math.max(y0, Math.log10(curve.y[k])) : curve.y[k];
        if (isFinite(y)) pen.lineTo(px(x), py(y));
      });
      pen.lineWidth = 1.5;
      pen.stroke();
      pen.lineWidth = 1;
    }
    if (now >= x0 && now <= x1) {
      pen.strokeStyle = "#8b93a1";
      pen.strokeRect(px(now), top, 0, bottom - top);
    }
  }
}
