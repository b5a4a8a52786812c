// SPDX-License-Identifier: BSD-3-Clause
"use strict";
// Saves what the page shows: a picture (PNG), or a film of all frames (WebM).

// Draws the panels and curves with their texts on one canvas, as they are on the page.
function compose(target) {
  const ratio = window.devicePixelRatio || 1, area = document.querySelector("main").getBoundingClientRect(), pen = target.getContext("2d");
  const even = (size) => 2 * Math.round((size * ratio) / 2);  // films need even numbers
  const [width, height] = [even(area.width), even(area.height)];
  if (target.width !== width || target.height !== height) [target.width, target.height] = [width, height];
  pen.setTransform(ratio, 0, 0, ratio, -area.left * ratio, -area.top * ratio);
  pen.fillStyle = "#14161a";
  pen.fillRect(area.left, area.top, area.width, area.height);
  drawAll(false);
  for (const canvas of document.querySelectorAll("#curves canvas")) {
    const at = canvas.getBoundingClientRect();
    pen.drawImage(canvas, at.left, at.top, at.width, at.height);
  }
  for (const panel of panels) {
    const at = panel.canvas.getBoundingClientRect();
    pen.drawImage(panel.canvas, at.left, at.top, at.width, at.height);
    composeTexts(pen, panel);
  }
}

function composeTexts(pen, panel) {
  pen.textBaseline = "middle";
  for (const node of panel.box.querySelectorAll(".bar, .dot")) {
    const at = node.getBoundingClientRect(), colours = node.className === "bar" ? VIRIDIS.map(hex) : [node.style.background];
    const fill = pen.createLinearGradient(at.left, 0, at.right, 0);
    colours.forEach((colour, k) => fill.addColorStop(k / Math.max(1, colours.length - 1), colour));
    pen.fillStyle = fill;
    pen.fillRect(at.left, at.top, at.width, at.height);
  }
  const walker = document.createTreeWalker(panel.box, NodeFilter.SHOW_TEXT), range = document.createRange();
  for (let node; (node = walker.nextNode());) {
    const style = getComputedStyle(node.parentElement);
    pen.font = `${style.fontWeight} ${style.fontSize} ${style.fontFamily}`;
    pen.fillStyle = style.color;
    // A text may be broken into several lines: its characters are gathered by their heights.
    const lines = new Map();
    [...node.data].forEach((character, k) => {
      range.setStart(node, k);
      range.setEnd(node, k + 1);
      const at = range.getBoundingClientRect(), key = Math.round(at.top);
      if (at.width) lines.set(key, { at: lines.get(key)?.at || at, text: (lines.get(key)?.text || "") + character });
    });
    for (const { at, text } of lines.values()) pen.fillText(text, at.left, (at.top + at.bottom) / 2);
  }
}

function download(blob, kind) {
  const link = document.createElement("a"), name = (panels[0]?.state.name || "carom").split("/").filter(Boolean).pop() || "carom";
  Object.assign(link, { href: URL.createObjectURL(blob), download: `${name}.${kind}` });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}

function savePicture() {
  const canvas = document.createElement("canvas");
  compose(canvas);
  canvas.toBlob((blob) => download(blob, "png"), "image/png");
}

// Records all frames, or those until the button is pressed again, as many a second as are chosen.
let filming = false;
async function saveFilm() {
  if (filming) { filming = false; return; }
  const type = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm"].find((kind) => window.MediaRecorder?.isTypeSupported(kind));
  if (!type) throw new Error("this browser cannot record films");
  filming = true;
  element("film").classList.add("on");
  const canvas = document.createElement("canvas"), pause = 1000 / element("speed").value, parts = [];
  goTo(0);
  compose(canvas);
  const stream = canvas.captureStream(), recorder = new MediaRecorder(stream, { mimeType: type, videoBitsPerSecond: 8e6 });
  recorder.ondataavailable = (event) => parts.push(event.data);
  const ended = new Promise((done) => { recorder.onstop = done; });
  recorder.start(200);
  for (let k = 0; k < frames() && filming; k++) {
    const start = performance.now();
    wanted = k;
    await Promise.all(panels.map((panel) => panel.show(k)));
    compose(canvas);
    await new Promise(requestAnimationFrame);
    await new Promise((done) => setTimeout(done, Math.max(0, pause - (performance.now() - start))));
  }
  const recorded = () => parts.reduce((sum, part) => sum + part.size, 0) > 1000;
  for (const end = performance.now() + 20000; !recorded() && performance.now() < end;) {  // a slow encoder has not begun yet
    compose(canvas);
    await new Promise((done) => setTimeout(done, 200));
  }
  recorder.stop();
  await ended;
  filming = false;
  element("film").classList.remove("on");
  download(new Blob(parts, { type: "video/webm" }), "webm");
}
