# SPDX-License-Identifier: BSD-3-Clause
"""Carom from Python: event-driven molecular dynamics of hard spheres with smooth forces.

    import carom
    sim = carom.Simulation(box=[12, 6], boundary="wall")
    sim.add_particles(position=x, velocity=v, radius=0.5)      # numpy arrays of shape (N, D)
    sim.add_force("harmonic-bond", pairs=[[0, 1], [1, 2]], stiffness=1.0, rest_length=2.0)
    sim.integrator("edda", step=0.01)
    sim.run(time=50, every=0.1, callback=lambda s: print(s.time, s.energy_error))
    run = carom.open("runs/five-springs")                      # the files of a run

Names and defaults are those of decks; carom.describe("edda") prints them. Units are your own, with k_B = 1. All errors are
carom.Error, and their messages say what to do. `Simulation` and `describe` need the compiled part of the package, and `open` does not.
"""

from carom.errors import CaromWarning, Error, FileError, InitialStateError, NumericalError, UsageError
from carom.files import Run, open

__all__ = ["Simulation", "Run", "open", "describe", "version",  # in the order of the reference (tools/site/conf.py)
           "Error", "UsageError", "InitialStateError", "NumericalError", "FileError", "CaromWarning"]


def __getattr__(name):
    """Loads the compiled part when it is first used."""
    if name not in ("Simulation", "describe", "version"):
        raise AttributeError(f"module 'carom' has no attribute '{name}'")
    from carom import simulation
    return getattr(simulation, name)


def __dir__():
    return __all__
