// SPDX-License-Identifier: BSD-3-Clause
"use strict";
// Where data come from: the server that has sent this page, or the page itself where it was exported.
const source = (() => {
  const stored = JSON.parse(document.getElementById("stored").textContent);
  document.getElementById("stored").remove();

  async function fetched(path) {
    const answer = await fetch(path, { cache: "no-store" });
    if (!answer.ok) throw new Error((await answer.text()).trim());
    return answer;
  }
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  if (!stored) return {
    live: true,
    text: async (path) => (await fetched(path)).text(),
    binary: async (path) => (await fetched(path)).arrayBuffer(),
  };
  return {
    live: false,
    text: async (path) => stored[path],
    binary: async (path) => bytes(stored[path]),
  };
})();

// One frame: io/view/run_source.h has the layout.
function readFrame(buffer, particles) {
  const [time, step, collisions, x, y, z, counted] = new Float64Array(buffer, 0, 8);
  const floats = (first, n) => new Float32Array(buffer, 64 + 4 * first, n);
  return {
    time, step, collisions, edges: [x, y, z],
    position: floats(0, 3 * particles),
    speed: floats(3 * particles, particles),
    count: counted ? floats(4 * particles, particles) : null,
  };
}

// The columns of a table with numbers; names in quotes may hold commas.
function readTable(text, names) {
  const lines = text.split("\n").filter((line) => line);
  if (!names) names = lines.shift().match(/("([^"]|"")*"|[^,]+)/g).map((name) => name.replace(/^"|"$/g, ""));
  const columns = Object.fromEntries(names.map((name) => [name, new Float64Array(lines.length)]));
  lines.forEach((line, row) => line.split(",").forEach((cell, k) => { columns[names[k]][row] = parseFloat(cell); }));
  return { names, columns, rows: lines.length };
}
