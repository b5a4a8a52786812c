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

matplotlib.use("Agg")
import matplotlib.pyplot as plt


def caption(figure, columns):
    """Writes the command that draws the figure below it, in `columns` columns of text."""
    words = [f"tools/{pathlib.Path(sys.argv[0]).name}", *sys.argv[1:]]
    # The output file does not change the figure.
    command = shlex.join(word for before, word in zip(["", *words], words) if not {before, word} & {"-o", "--output"})
    figure.supxlabel(textwrap.fill(command, columns), fontsize=6, family="monospace", color="grey")


@contextlib.contextmanager
def panels(file, *labels):
    """Axes side by side, one for each dictionary of labels; the picture is written at the end, with a legend if there are labels and
    the command that draws it."""
    figure, row = plt.subplots(ncols=len(labels), figsize=(6.4 * len(labels), 4.8), squeeze=False)
    yield row[0]
    for axes, named in zip(row[0], labels):
        axes.set(**named)
        axes.grid(True, alpha=0.3)
        if axes.get_legend_handles_labels()[0]:
            axes.legend()
    caption(figure, 110 * len(labels))
    figure.tight_layout()
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
