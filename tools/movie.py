#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""A moving picture of a trajectory: discs, or spheres seen along an axis, with the box around them.

    tools/movie.py runs/five-springs
    tools/movie.py runs/nine-gravity -o nine.mp4 --frames-per-second 25 --every 2
    tools/movie.py runs/bound-cluster-3d --along y

Writes a GIF, or an MP4 if the name ends with .mp4 and ffmpeg is installed. Walls are drawn solid, periodic edges dashed, open
ones dotted, with their lengths at the axes; a disc that extends beyond a periodic edge is drawn on both sides. Marks above and below a sheared
box show where its images begin. Spheres farther away are paler.
"""

import argparse
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.animation import FFMpegWriter, FuncAnimation, PillowWriter
from matplotlib.collections import EllipseCollection

from carom_files import Trajectory, one_line
from carom_plot import caption

LINE = {"wall": "-", "periodic": "--", "open": ":"}


def with_images(x, radius, edges, periodic, tilt=0.0):
    """The indices and positions of all discs to draw: discs over a periodic edge appear again on the other side, displaced by the tilt."""
    index, x = np.arange(len(x)), x.copy()
    for axis in np.flatnonzero(periodic)[::-1]:
        below = x[:, axis] < radius[index]
        above = x[:, axis] > edges[axis] - radius[index]
        shift = np.zeros(x.shape[1])
        shift[axis] = edges[axis]
        shift[0] += tilt if axis == 1 else 0.0
        index = np.concatenate([index, index[below], index[above]])
        x = np.concatenate([x, x[below] + shift, x[above] - shift])
        if axis == 1 and tilt:
            x[:, 0] %= edges[0]
    return index, x


class Scene:
    """One frame at a time, projected onto the two axes of `plane`."""

    def __init__(self, trajectory, along):
        self.trajectory = trajectory
        self.depth = "xyz".index(along) if trajectory.dimension == 3 else None
        self.plane = [axis for axis in range(trajectory.dimension) if axis != self.depth]
        self.edges = trajectory.edges()[self.plane]
        self.periodic = trajectory.periodic[self.plane]
        species = trajectory.species - trajectory.species.min()
        self.colour = plt.get_cmap("tab10")(species % 10)
        self.low, self.high = self._window()
        size = 6.0 * (self.high - self.low) / max(self.high - self.low)
        self.figure, self.axes = plt.subplots(figsize=np.maximum(size, 3.0) + [0.6, 1.2])
        self.discs = None

    def _window(self):
        """The visible region: the box, and the whole motion along open axes."""
        low, high = np.zeros(2), self.edges.copy()
        is_open = np.array([self.trajectory.boundary[axis] == "open" for axis in self.plane])
        if is_open.any():
            radius = self.trajectory.radius[:, None]
            for frame in range(len(self.trajectory)):
                x = self.trajectory.position(frame)[:, self.plane]
                low = np.where(is_open, np.minimum(low, (x - radius).min(axis=0)), low)
                high = np.where(is_open, np.maximum(high, (x + radius).max(axis=0)), high)
        return low, high

    def draw(self, frame):
        x = self.trajectory.position(frame)
        colour = self.colour.copy()
        order = np.arange(len(x))
        if self.depth is not None:
            order = np.argsort(x[:, self.depth])
            near = np.clip(x[:, self.depth] / self.trajectory.edges(frame)[self.depth], 0, 1)
            colour[:, :3] = 1 - (1 - colour[:, :3]) * (0.25 + 0.75 * near[:, None])
        radius = self.trajectory.radius[order]
        tilt = self.trajectory.tilt(frame) if self.plane == [0, 1] else 0.0
        index, centres = with_images(x[order][:, self.plane], radius, self.edges, self.periodic, tilt)
        if self.discs is not None:
            self.discs.remove()
        else:
            self._draw_box()
        self._draw_images(self.trajectory.tilt(frame))
        diameter = 2 * radius[index]
        self.discs = self.axes.add_collection(EllipseCollection(
            diameter, diameter, np.zeros(len(index)), units="xy", offsets=centres, transOffset=self.axes.transData,
            facecolors=colour[order][index], edgecolors="black", linewidths=0.5))
        self.axes.set_title(f"{self.trajectory.title}\nt = {self.trajectory.time[frame]:.4g} [time]".strip(), fontsize=10)
        return [self.discs]

    def _draw_images(self, tilt):
        """Marks where the boxes above and below begin, in a sheared box that shows the plane of the flow."""
        if tilt and self.plane == [0, 1]:
            part, (x, y) = 0.04 * self.edges[1], self.edges
            self.images.set_data([tilt, tilt, np.nan, x - tilt, x - tilt], [y, y + part, np.nan, 0, -part])

    def _draw_box(self):
        margin = 0.01 * max(self.high - self.low)
        self.axes.set(xlim=(self.low[0] - margin, self.high[0] + margin),
                      ylim=(self.low[1] - margin, self.high[1] + margin), aspect="equal",
                      xticks=[0, self.edges[0]], xlabel=f"{'xyz'[self.plane[0]]} [length]",
                      yticks=[0, self.edges[1]], ylabel=f"{'xyz'[self.plane[1]]} [length]")
        for axis in (self.axes.xaxis, self.axes.yaxis):
            axis.set_major_formatter("{x:.4g}")
        self.axes.set_frame_on(False)
        self.axes.set_title("title\ntime", fontsize=10)
        caption(self.figure, 80)
        self.figure.tight_layout()  # only once: frames must not move
        style = [LINE[self.trajectory.boundary[axis]] for axis in self.plane]
        for end in (0.0, 1.0):
            self.axes.plot(np.full(2, end * self.edges[0]), [0, self.edges[1]], style[0], color="black", linewidth=1.5)
            self.axes.plot([0, self.edges[0]], np.full(2, end * self.edges[1]), style[1], color="black", linewidth=1.5)
        self.images, = self.axes.plot([], [], "-", color="black", linewidth=1.5, clip_on=False)


@one_line
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=pathlib.Path, help="directory of a run, or its trajectory")
    parser.add_argument("--every", type=int, default=1, help="draw every n-th frame")
    parser.add_argument("--frames-per-second", type=float, default=20)
    parser.add_argument("--along", choices="xyz", default="z", help="3-D: the axis to look along")
    parser.add_argument("-o", "--output", type=pathlib.Path, help="default: movie.gif in the run's directory")
    options = parser.parse_args(arguments)
    if options.every < 1:
        parser.error("--every must be at least 1")
    folder = options.run if options.run.is_dir() else options.run.parent
    file = options.output or folder / "movie.gif"
    if file.suffix not in (".gif", ".mp4"):
        parser.error(f"{file}: give a name that ends with .gif or .mp4")
    writer = FFMpegWriter if file.suffix == ".mp4" else PillowWriter
    if not writer.isAvailable():
        parser.error("an MP4 needs ffmpeg (apt-get install ffmpeg); a GIF doesn't")
    with Trajectory(options.run) as trajectory:
        scene = Scene(trajectory, options.along)
        frames = range(0, len(trajectory), options.every)
        animation = FuncAnimation(scene.figure, scene.draw, frames, init_func=lambda: [], cache_frame_data=False)
        animation.save(file, writer=writer(fps=options.frames_per_second), dpi=100)
        plt.close(scene.figure)
    print(f"Results: {file}")


if __name__ == "__main__":
    main()
