"""The look that the pictures of tools/ share.

    with picture("msd.png", xlabel="lag", ylabel="msd", title="...") as axes:
        axes.loglog(lag, msd)
"""

import contextlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt


@contextlib.contextmanager
def picture(file, **labels):
    """Axes to draw on; the picture is written at the end, with a legend where anything has a label."""
    figure, axes = plt.subplots(figsize=(6.4, 4.8))
    yield axes
    axes.set(**labels)
    axes.grid(True, alpha=0.3)
    if axes.get_legend_handles_labels()[0]:
        axes.legend()
    figure.tight_layout()
    figure.savefig(file, dpi=150)
    plt.close(figure)
