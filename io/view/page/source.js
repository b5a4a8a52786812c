// SPDX-License-Identifier: BSD-3-Clause
"use strict";
// Where the data come from: the server that sent this page, or, in an exported page, the page itself.
const source = (() => {
  const stored = JSON.parse(document.getElementById("stored").textContent);
  document.getElementById("stored").remove();

  async function fetched(path) {
    const answer = await fetch(path, { cache: "no-store" });
    if (!answer.ok) throw new Error((await answer.text()).trim());
    return answer;
  }
  const decoded = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  // `count` bytes from byte `first` on of what the text encodes; three bytes are four characters.
  function part(text, first, count) {
    const start = Math.floor(first / 3), end = Math.ceil((first + count) / 3);
    return decoded(text.slice(4 * start, 4 * end)).slice(first - 3 * start, first - 3 * start + count);
  }
  if (!stored) return {
    live: true,
    text: async (path) => (await fetched(path)).text(),
    binary: async (path) => (await fetched(path)).arrayBuffer(),
    path: async (run, particle, frame) => new Float32Array(await (await fetched(`${run}/path/${particle}/${frame}`)).arrayBuffer()),
  };
  return {
    live: false,
    text: async (path) => stored[path],
    binary: async (path) => decoded(stored[path]).buffer,
    // The positions of one particle in a frame and in those that follow, as the server answers it.
    path: async (run, particle, frame) => {
      const positions = [];
      for (let text; (text = stored[`${run}/frame/${frame}`]); frame++)
        positions.push(...new Float32Array(part(text, FRAME_HEAD + 12 * particle, 12).buffer));
      return Float32Array.from(positions);
    },
  };
})();

// One frame; io/view/run_source.h describes the bytes.
const FRAME_HEAD = 72;
function readFrame(buffer, particles) {
  const [time, step, collisions, x, y, z, counted, spins, tilt] = new Float64Array(buffer, 0, 9);
  const floats = (first, n) => new Float32Array(buffer, FRAME_HEAD + 4 * first, n);
  return {
    time, step, collisions, edges: [x, y, z], tilt,
    position: floats(0, 3 * particles),
    speed: floats(3 * particles, particles),
    spin: spins ? floats(4 * particles, particles) : null,
    count: counted ? floats((spins ? 5 : 4) * particles, particles) : null,
  };
}

// The columns of a table of numbers; names in quotation marks may contain commas.
function readTable(text, names) {
  const lines = text.split("\n").filter((line) => line);
  if (!names) names = lines.shift().match(/("([^"]|"")*"|[^,]+)/g).map((name) => name.replace(/^"|"$/g, ""));
  const columns = Object.fromEntries(names.map((name) => [name, new Float64Array(lines.length)]));
  lines.forEach((line, row) => line.split(",").forEach((cell, k) => { columns[names[k]][row] = parseFloat(cell); }));
  return { names, columns, rows: lines.length };
}

// "1 collision", "2 collisions".
const counted = (number, noun) => `${number} ${noun}${number === 1 ? "" : "s"}`;
const rounded = (number) => String(+number.toPrecision(4));
