# SPDX-License-Identifier: BSD-3-Clause
"""The common style of the pictures of tools/.

    with picture("msd.png", xlabel="lag", ylabel="msd", title="...") as axes:
        axes.loglog(lag, msd)
"""

import contextlib
import pathlib
import shlex
import sys
import textwrap

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt


def caption(figure, columns):
    """Writes the command that draws the figure below it, in `columns` columns of text."""
    words = [f"tools/{pathlib.Path(sys.argv[0]).name}", *sys.argv[1:]]
    # The output file does not change the figure.
    command = shlex.join(word for before, word in zip(["", *words], words) if not {before, word} & {"-o", "--output"})
    figure.supxlabel(textwrap.fill(command, columns), fontsize=6, family="monospace", color="grey")


def label_ends(axes, room=0.3, size=9):
    """Instead of a legend, writes the label of each curve beside its right end, in its colour; the labels keep their distance.

    room: of the width of the axes, for the labels. Called by panels() for axes whose `at_ends` is set to it.
    """
    axes.figure.canvas.draw()
    lines = [line for line in axes.get_lines() if not line.get_label().startswith("_")]
    ticks, most = axes.get_xticks(), axes.get_xlim()[1]
    low, high = axes.transLimits.inverted().transform([[0, 0], [1 + room, 0]])[:, 0]
    scale = axes.xaxis.get_transform().inverted()
    axes.set_xlim(*scale.transform([low, high]))
    axes.set_xticks([tick for tick in ticks if axes.get_xlim()[0] <= tick <= most])
    axes.figure.canvas.draw()
    ends = [line.get_xydata()[np.isfinite(line.get_ydata())][-1] for line in lines]
    heights = axes.transData.transform(ends)[:, 1] * 72 / axes.figure.dpi  # in points
    last = -np.inf
    for k in np.argsort(heights):
        last = max(heights[k], last + 1.25 * size)
        axes.annotate(lines[k].get_label(), ends[k], (size, last - heights[k]), textcoords="offset points", color=lines[k].get_color(),
                      fontsize=size, va="center")


@contextlib.contextmanager
def panels(file, *labels):
    """Axes side by side, one for each dictionary of labels; the picture is written at the end, with a legend if there are labels and
    the command that draws it."""
    figure, row = plt.subplots(ncols=len(labels), figsize=(6.4 * len(labels), 4.8), squeeze=False)
    yield row[0]
    for axes, named in zip(row[0], labels):
        axes.set(**named)
        axes.grid(True, alpha=0.3)
        if axes.get_legend_handles_labels()[0] and not hasattr(axes, "at_ends"):
            axes.legend()
    caption(figure, 110 * len(labels))
    figure.tight_layout()
    for axes in row[0]:
        if hasattr(axes, "at_ends"):
            label_ends(axes, axes.at_ends)
    try:
        figure.savefig(file, dpi=150 / len(labels))
    except ValueError as error:  # an unknown format
        raise SystemExit(f"{file}: {error}") from error
    plt.close(figure)


@contextlib.contextmanager
def picture(file, **labels):
    """One panel: axes to draw on."""
    with panels(file, labels) as (axes,):
        yield axes
