# SPDX-License-Identifier: BSD-3-Clause
"""Makes MDAnalysis open trajectories of Carom unaided: with their bonds, and also without units.

    import MDAnalysis, carom.mdanalysis
    universe = MDAnalysis.Universe("runs/polymer/trajectory.h5md")

By itself, MDAnalysis reads no topology from H5MD files and refuses files without units. This module registers a reader that converts
no numbers if the file has no units, and a parser of the data that Carom writes beside the frames.
"""

import h5py
import numpy as np
from MDAnalysis.coordinates.H5MD import H5MDReader
from MDAnalysis.core import topologyattrs
from MDAnalysis.core.topology import Topology
from MDAnalysis.topology.base import TopologyReaderBase

from carom.files import Trajectory


def _has_units(file):
    with h5py.File(file, "r") as opened:
        return all("unit" in group["position/value"].attrs for group in opened["particles"].values() if "position" in group)


class Reader(H5MDReader):
    """The reader of MDAnalysis, which converts units only if the file has units."""

    format = "H5MD"

    def __init__(self, filename, convert_units=None, **more):
        if convert_units is None:
            convert_units = isinstance(filename, h5py.File) or _has_units(filename)
        super().__init__(filename, convert_units=convert_units, **more)


class Parser(TopologyReaderBase):
    """Reads the masses, charges, radii and bonds of a trajectory; names and types are the species."""

    format = ["H5MD"]

    def parse(self, **_):
        with Trajectory(self.filename) as run:
            names = np.array([run.species_names[kind] for kind in run.species], dtype=object)
            attributes = [topologyattrs.Atomnames(names), topologyattrs.Atomtypes(names.copy()), topologyattrs.Masses(run.mass),
                          topologyattrs.Charges(run.charge), topologyattrs.Radii(run.radius),
                          topologyattrs.Resids(np.array([1])), topologyattrs.Resnames(np.array(["carom"], dtype=object)),
                          topologyattrs.Segids(np.array(["carom"], dtype=object))]
            if len(run.bonds):
                attributes.append(topologyattrs.Bonds([tuple(map(int, pair)) for pair in run.bonds]))
            return Topology(len(run.mass), 1, 1, attrs=attributes)
