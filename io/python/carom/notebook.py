# SPDX-License-Identifier: BSD-3-Clause
"""Displays simulations, runs and progress in notebooks."""

import html

from carom.errors import Error


def in_notebook():
    """Whether this Python is the kernel of a notebook."""
    try:
        return get_ipython().has_trait("kernel")
    except NameError:  # no IPython
        return False


def show_progress(bar, done, text):
    """Shows a bar of progress below the cell, or updates `bar`; returns the bar."""
    from IPython.display import HTML, display

    shown = HTML(f"<progress value='{done:.4f}' max='1' style='width: 20em'></progress> {html.escape(text)}")
    if bar is None:
        return display(shown, display_id=True)
    bar.update(shown)
    return bar


def end_progress(bar):
    from IPython.display import HTML

    bar.update(HTML(""))


def table_of(sim):
    """An HTML table that describes a simulation."""
    rows = {"particles": f"{len(sim)} in {len(sim.box)} dimensions ({', '.join(sim.species_names)})",
            "box": f"{' × '.join(f'{edge:.6g}' for edge in sim.box)}, {', '.join(dict.fromkeys(sim.boundary))}",
            "forces": ", ".join(name for name, _ in sim._session.forces) or "none",
            "integrator": sim._session.method or "none", "files": sim.directory or "none"}
    try:
        rows |= {"time": f"{sim.time:.6g}, step {sim.step}", "collisions": str(sim.collisions),
                 "energy": f"{sim.energy:.10g}, error {sim.energy_error:.1e}", "temperature": f"{sim.temperature:.6g}"}
    except Error:  # there are no particles, or another thread is in run()
        pass
    return table(f"carom.Simulation {sim.title}", rows)


def table(title, rows):
    """An HTML table of names and values."""
    left = "style='text-align: left'"
    lines = "".join(f"<tr><th {left}>{html.escape(name)}</th><td {left}>{html.escape(value)}</td></tr>" for name, value in rows.items())
    return f"<table><caption>{html.escape(title)}</caption>{lines}</table>"
