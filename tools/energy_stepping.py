#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Energy-stepping beside edda: discs on springs in a hard box, such as inputs/five-springs.toml.

    tools/python tools/energy_stepping.py inputs/five-springs.toml --heights 0.1,0.01,0.001 --end-time 6 --starts 8

Energy-stepping (Gonzalez, Schmidt, Ortiz, Int. J. Numer. Meth. Engng 82 (2010) 205) replaces V by terraces, V_h = h floor(V/h).
Particles fly straight between the level sets of V. At a level set the momentum changes along grad V so that K + V_h keeps its value, or
is reflected if K is too small for the next terrace. The hard contacts, which are not in the paper, are elastic collisions on the way.

A crossing is found by safe steps, which a bound of the second derivative of V along the path gives; each evaluates V and its slope: a force
pass. The table has geometric means over --starts (start 0 is the deck, others have velocities changed by up to 0.01) of the largest
|H - H_0| over H_0 = K_0 + V_0, and of the largest error of a coordinate at the end, against cdda of order 4.
"""

import argparse
import tomllib

import numpy as np

try:
    import carom  # before the tools, which would import its sources without the compiled part
    carom.Simulation
except ImportError as missing:
    raise SystemExit("This study needs the built Python module: tools/python tools/energy_stepping.py DECK") from missing

from carom_files import one_line, reading

CROSSED = 1e-11  # [time] a safe step this short ends at the level; rounding of positions may hide shorter ones


class Discs:
    """Discs on springs: the deck, with the velocities of one start."""

    def __init__(self, deck, start):
        (group,), (spring,) = deck["particles"], deck["interaction"]
        if spring["type"] != "harmonic-bond" or set(deck["system"]["boundary"]) != {"wall"}:
            raise SystemExit("Energy-stepping is written for harmonic bonds in a hard box.")
        self.x, self.radius, self.mass = np.array(group["position"]), group["radius"], group["mass"]
        self.v = group["velocity"] + 0.01 * (start > 0) * np.random.default_rng(start).uniform(-1, 1, self.x.shape)
        self.edges = np.array(deck["system"]["box"])
        self.bonds, self.stiffness, self.length = np.array(spring["pairs"]).T, spring["stiffness"], spring["rest_length"]
        self.pairs = np.triu_indices(len(self.x), 1)

    def kinetic(self):
        return 0.5 * self.mass * (self.v ** 2).sum()

    def potential(self):
        """V, its gradient, its slope along v and a bound of its second derivative along v."""
        i, j = self.bonds
        d, u = self.x[i] - self.x[j], self.v[i] - self.v[j]
        r = np.sqrt((d ** 2).sum(1))
        pull = (self.stiffness * (r - self.length) / r)[:, None] * d
        gradient = np.zeros_like(self.x)
        np.add.at(gradient, i, pull)
        np.add.at(gradient, j, -pull)
        steepest = self.stiffness * max(1, self.length / (2 * self.radius) - 1)  # r is at least the contact distance
        return 0.5 * self.stiffness * ((r - self.length) ** 2).sum(), gradient, (pull * u).sum(), steepest * (u ** 2).sum()

    def next_contact(self):
        """The time until the next contact, and what touches: (i, j), or (i, axis) of a wall."""
        i, j = self.pairs
        d, u = self.x[i] - self.x[j], self.v[i] - self.v[j]
        b, c, uu = (d * u).sum(1), np.maximum((d ** 2).sum(1) - (2 * self.radius) ** 2, 0), (u ** 2).sum(1)
        root = np.sqrt(np.maximum(b * b - uu * c, 0))
        time = np.where((b < 0) & (b * b >= uu * c), c / np.where(b < 0, root - b, 1), np.inf)
        with np.errstate(divide="ignore", invalid="ignore"):
            room = np.where(self.v > 0, self.edges - self.radius - self.x, self.x - self.radius)
            walls = np.where(self.v != 0, np.maximum(room, 0) / abs(self.v), np.inf)
        first, wall = time.argmin(), np.unravel_index(walls.argmin(), walls.shape)
        return (time[first], (i[first], j[first]), False) if time[first] <= walls[wall] else (walls[wall], wall, True)

    def collide(self, who, at_wall):
        if at_wall:
            self.v[who] *= -1
        else:
            i, j = who
            d = self.x[i] - self.x[j]
            change = d @ (self.v[i] - self.v[j]) / (d @ d) * d
            self.v[[i, j]] += [-change, change]


def safe_step(gap, slope, bend):
    """The time in which V cannot yet have moved by `gap`, from its slope and the bound of its second derivative."""
    root = np.sqrt(slope ** 2 + 2 * bend * gap)
    if slope > 0:
        return 2 * gap / (root + slope)
    return (root - slope) / bend if bend > 0 else np.inf


def energy_stepping(discs, height, end):
    """Moves the discs to the end. Returns the largest |H - H_0| / H_0, the number of crossings and that of force passes."""
    v, gradient, slope, bend = discs.potential()
    terrace, start, largest, crossings, passes = int(v // height), discs.kinetic() + v, 0.0, 0, 1
    contact, who, at_wall = discs.next_contact()
    while True:
        up = safe_step(max((terrace + 1) * height - v, 0), slope, bend)
        down = safe_step(max(v - terrace * height, 0), -slope, bend) if terrace > 0 else np.inf  # V has no level below zero
        step = min(up, down, contact, end)
        discs.x += step * discs.v
        contact, end = contact - step, end - step
        if end == 0:
            return largest / start, crossings, passes
        if contact == 0:
            discs.collide(who, at_wall)
        elif step < CROSSED:
            crossings += 1
            climb = height if up < down else -height
            weight, before = (gradient ** 2).sum() / discs.mass, discs.kinetic()
            left = slope ** 2 - 2 * weight * climb  # the square of the slope beyond the level
            new_slope = np.sign(climb) * np.sqrt(left) if left >= 0 else -slope
            discs.v += (new_slope - slope) / weight / discs.mass * gradient
            terrace += (left >= 0) * (1 if climb > 0 else -1)
            largest = max(largest, abs(before + v - start), abs(discs.kinetic() + v - start))
        v, gradient, slope, bend = discs.potential()
        passes += 1
        if contact == 0 or step < CROSSED:
            contact, who, at_wall = discs.next_contact()


@one_line
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("deck")
    parser.add_argument("--heights", default="0.1,0.03,0.01,0.003", help="of the terraces [energy]")
    parser.add_argument("--end-time", type=float, default=6.0)
    parser.add_argument("--starts", type=int, default=8)
    options = parser.parse_args(arguments)
    with reading(options.deck), open(options.deck, "rb") as file:
        deck = tomllib.load(file)
    exact = []
    for start in range(options.starts):
        sim = carom.Simulation.from_deck(options.deck, set={"integrator.type": "cdda", "integrator.order": 4, "integrator.step": 0.002})
        sim.velocity = Discs(deck, start).v
        sim.run(time=options.end_time)
        exact.append(sim.position.copy())
    print("height    error of energy    of positions    crossings    force passes")
    for height in map(float, options.heights.split(",")):
        rows = []
        for start, positions in enumerate(exact):
            discs = Discs(deck, start)
            error, *counts = energy_stepping(discs, height, options.end_time)
            rows.append((error, abs(discs.x - positions).max(), *counts))
        energy, position, crossings, passes = np.exp(np.log(rows).mean(0))
        print(f"{height:6g}    {energy:15.1e}    {position:12.1e}    {crossings:9.1e}    {passes:12.0e}", flush=True)


if __name__ == "__main__":
    main()
