# SPDX-License-Identifier: BSD-3-Clause
"""Runs the real command on bad decks: each error has an exit code, a position and advice."""

import pytest

from decks import FLUID, GOOD, bathed, carom, changed, lennard_jones, rough, stepped, table, touching, validate, walled
from runs import needs_carom

pytestmark = needs_carom


def test_good_decks_are_valid(tmp_path):
    for deck in (GOOD, FLUID):
        answer = validate(tmp_path, deck)
        assert (answer.returncode, answer.stderr) == (0, "")
        assert "deck.toml: valid" in answer.stdout


# name: (deck, line of the message, required parts of the message)
DECK_ERRORS = {
    "malformed TOML": (changed("step = 0.01", "step = = 0.01"), 24, ["not valid TOML"]),
    "TOML key twice": (changed("step = 0.01", "step = 0.01\nstep = 0.02"), 25, ["not valid TOML"]),
    "unknown key": (
        changed("radius = 0.5", "raduis = 0.5\nradius = 0.5"),
        13, ["unknown key 'raduis'", "did you mean 'radius'?"]),
    "unknown table": (
        changed("[run]", "[outptu]\nevents = true\n[run]"),
        26, ["unknown key 'outptu'", "did you mean 'output'?"]),
    # Numbers whose products cannot be computed: one error, at the line of the number.
    "huge velocity": (changed("velocity = [[1.0, 0.0]", "velocity = [[1e160, 0.0]"), 12, ["'velocity' is 1e+160", "would be infinite"]),
    "huge box": (changed("box = [10.0, 10.0]", "box = [1e308, 10.0]"), 6, ["'box' is 1e+308", "would be infinite", "take units"]),
    "huge radius": (changed("radius = 0.5", "radius = 1e300"), 13, ["'radius' is 1e+300", "would be infinite"]),
    "tiny radius": (changed("radius = 0.5", "radius = 1e-160"), 13, ["'radius' is 1e-160", "would be 0"]),
    "huge mass": (changed("mass = 1.0", "mass = 1e300"), 14, ["'mass' is 1e+300", "would be infinite"]),
    "huge charge": (changed("mass = 1.0", "mass = 1.0\ncharge = 1e300"), 15, ["'charge' is 1e+300", "would be infinite"]),
    "huge stiffness": (changed("stiffness = 1.0", "stiffness = 1e300"), 19, ["'stiffness' is 1e+300", "would be infinite"]),
    "huge step": (changed("step = 0.01", "step = 1e300"), 24, ["'step' is 1e+300", "would be infinite"]),
    "integer beyond 64 bits": (changed("steps = 10", "steps = 99999999999999999999"), 27, ["not valid TOML", "99999999999999999999"]),
    "distance of spheres": (
        changed('type = "fcc"', 'type = "random"\ndistance = 0.5', FLUID), 16, ["'distance' is for points", "leave it out"]),
    "points compressed": (
        lennard_jones("cutoff = 2.0").replace('"fcc"', '"compressed"'), 15, ["treats particles as points, which cannot be compressed"]),
    "wrong type": (
        changed("steps = 10", 'steps = "ten"'),
        27, ["'steps' has the wrong type: string", "give a positive integer"]),
    "fraction for an integer": (changed("steps = 10", "steps = 10.5"), 27, ["'steps' has the wrong type", "integer"]),
    "wrong type in a list": (changed("[[2.0, 5.0]", '[[2.0, "5"]'), 11, ["'position' has the wrong type: string"]),
    "single table for a list": (changed("[[particles]]", "[particles]"), 9, ["write [[particles]]"]),
    "integrator that is no more": (
        changed('type = "cdda"', 'type = "acdda"'), 23, ["unknown integrator 'acdda'", 'write "edda"']),
    "key that is no more": (
        changed('type = "cdda"', 'type = "edda"\nadaptive = 1e-6'),
        24, ["unknown key 'adaptive' in [integrator]", "take a shorter 'step'"]),
    "accuracy of a method with fixed steps": (
        changed('type = "cdda"', 'type = "psa"\naccuracy = 1e-6'),
        24, ["unknown key 'accuracy' in [integrator]", "this method has fixed steps", "or take edda or cdda"]),
    "missing key": (changed('type = "cdda"\nstep = 0.01\n', 'type = "psa"\n'), 22, ["missing key 'step' in [integrator]", "positive number"]),
    "missing position and count": (
        changed("position = [[2.0, 5.0], [5.0, 5.0]]\nvelocity = [[1.0, 0.0], [0.0, 0.0]]\n", ""),
        9, ["missing key 'position' or 'count'"]),
    "missing box": (changed("box = [10.0, 10.0]\n", ""), 4, ["missing key 'box'", "packing_fraction"]),
    "negative radius": (changed("radius = 0.5", "radius = -0.5"), 13, ["'radius' must be positive (is -0.5)"]),
    "zero radius in a list": (changed("radius = 0.5", "radius = [0.5, 0]"), 13, ["'radius' must be positive (is 0)"]),
    "zero mass": (changed("mass = 1.0", "mass = 0"), 14, ["'mass' must be positive (is 0)"]),
    "zero step": (changed("step = 0.01", "step = 0.0"), 24, ["'step' must be positive (is 0)"]),
    "negative step": (changed("step = 0.01", "step = -1"), 24, ["'step' must be positive (is -1)"]),
    "longest step below the step": (
        changed("step = 0.01", "step = 0.01\nlongest_step = 0.005"),
        25, ["'longest_step' is shorter than 'step'", "give a longer one"]),
    "infinite stiffness": (changed("stiffness = 1.0", "stiffness = inf"), 19, ["'stiffness' must be finite"]),
    "position not a number": (changed("[[2.0, 5.0]", "[[nan, 5.0]"), 11, ["'position' must be finite (is nan)"]),
    "unknown integrator": (changed('"cdda"', '"cddaa"'), 23, ["unknown integrator 'cddaa'", "did you mean 'cdda'?"]),
    "unknown interaction": (
        changed('"harmonic-bond"', '"harmonic-bnd"'),
        17, ["unknown interaction 'harmonic-bnd'", "did you mean 'harmonic-bond'?"]),
    "unknown placement": (changed('"fcc"', '"fc"', FLUID), 15, ["unknown placement 'fc'", "did you mean 'fcc'?"]),
    "unknown boundary": (
        changed('["wall", "wall"]', '["wall", "periodical"]'),
        7, ["'boundary' cannot be 'periodical'", "did you mean 'periodic'?"]),
    "box that is full": (
        changed("box = [6.0, 6.0, 6.0]\n", "", changed('"fcc"', '"fcc"\npacking_fraction = 1', FLUID)),
        15, ["'packing_fraction' must be below 1"]),
    "unknown order": (changed("step = 0.01", "step = 0.01\norder = 3"), 25, ["'order' cannot be '3'"]),
    "wall without a name": (walled("velocity = 1.0"), 9, ["missing key 'name' in [[wall]]"]),
    "wall of a periodic boundary": (
        walled('name = "x-"').replace('["wall", "wall"]', '["periodic", "wall"]'),
        9, ["the wall 'x-' does not exist", "make that boundary a wall"]),
    "wall without a normal": (
        walled('name = "ramp"'), 9, ["'ramp' is no face of the box and has no normal", "x-, x+, y-, y+"]),
    "wall with a normal of zeros": (walled('name = "ramp"\nnormal = [0, 0]'), 9, ["give a normal that is not zero"]),
    "wall with a normal in three dimensions": (
        walled('name = "ramp"\nnormal = [0, 0, 1]'), 9, ["a normal of 3 numbers", "give 2"]),
    "face with a normal": (walled('name = "y+"\nnormal = [0, 1]'), 9, ["'y+' is a face of the box", "leave shape, normal"]),
    "wall across a periodic axis": (
        walled('name = "lid"\nnormal = [1, 0]').replace('["wall", "wall"]', '["periodic", "wall"]'),
        9, ["the wall 'lid' is not the same in all images", "make that boundary wall or open"]),
    "one-way wall with two sides": (
        walled('name = "valve"\nnormal = [1, 0]\none_way = true\none_sided = false'), 9, ["'valve' is one-way and has two sides"]),
    "one-way face": (walled('name = "y+"\none_way = true'), 9, ["'y+' is a face of the box and cannot be one-way", "give a normal"]),
    "one-way wall that is shaken": (
        walled('name = "valve"\nnormal = [1, 0]\none_way = true\nvelocity = {amplitude = 0.1, frequency = 1}'),
        9, ["is one-way and shaken", "give a constant velocity"]),
    "wall of an unknown shape": (walled('name = "egg"\nshape = "egg"'), 11, ["'shape' cannot be 'egg'", "sphere"]),
    "round wall without a radius": (
        walled('name = "cavity"\nshape = "sphere"\ncentre = [5, 5]'), 9, ["'cavity' is a sphere without radius", "give centre and radius"]),
    "round wall with a centre in three dimensions": (
        walled('name = "cavity"\nshape = "sphere"\ncentre = [5, 5, 5]\nradius = 5'), 9, ["a centre of 3 numbers", "give 2"]),
    "round wall in a periodic box": (
        walled('name = "cavity"\nshape = "sphere"\ncentre = [5, 5]\nradius = 5').replace('["wall", "wall"]', '["periodic", "wall"]'),
        9, ["along axis 0, which is periodic", "make that boundary wall or open"]),
    "round wall that moves": (
        walled('name = "cavity"\nshape = "sphere"\ncentre = [5, 5]\nradius = 5\nvelocity = 0.1'), 9, ["is round and moves"]),
    "cylinder in two dimensions": (
        walled('name = "tube"\nshape = "cylinder"\ncentre = [5, 5]\nradius = 5\naxis = [0, 1]'),
        9, ["is a cylinder in two dimensions", 'shape = "sphere"']),
    "plane with a radius": (walled('name = "lid"\nnormal = [0, 1]\nradius = 5'), 9, ["is a plane and has keys of a round wall"]),
    "motion that ends before the start": (
        walled('name = "y+"\nvelocity = 0.1\nuntil = -1'), 12, ["'until' must be zero or positive (is -1)"]),
    "fixed particles with velocities": (
        changed("mass = 1.0", "mass = 1.0\nfixed = true"), 12, ["'velocity' of fixed particles", "leave it out"]),
    "fixed particles with a temperature": (
        changed("temperature = 1.0", "temperature = 1.0\nfixed = true", FLUID), 11, ["'temperature' of fixed particles"]),
    "nothing but fixed particles": (
        changed("temperature = 1.0", "fixed = true", FLUID), 8, ["all particles are fixed, and nothing would move"]),
    "wall that is given twice": (
        walled('name = "y+"\n[[wall]]\nname = "y+"'), 11, ["'y+' is given twice", "its own name"]),
    "walls that cross": (
        walled('name = "lid"\nnormal = [0, -1]\noffset = 0.5'), 9, ["the wall 'lid' leave no room", "move them apart"]),
    "thermal wall without heat": (
        walled('name = "y+"\ntemperature = 0'), 11, ["'temperature' must be positive (is 0)"]),
    "contact that gains energy": (
        touching('between = ["disc", "disc"]\nrestitution = 1.01'), 11, ["'restitution' is 1.01; take at most 1"]),
    "contact with a negative restitution": (
        touching('between = ["disc", "disc"]\nrestitution = -0.1'), 11, ["'restitution' must be zero or positive (is -0.1)"]),
    "contact without partners": (touching("restitution = 0.5"), 9, ["missing key 'between' in [[contact]]"]),
    "contact of one partner": (touching('between = ["disc"]'), 9, ["a contact is between two partners", "give two species"]),
    "contact of an unknown species": (
        touching('between = ["disc", "sand"]\nrestitution = 0.5'),
        9, ["'sand' is neither a species nor a wall", "give one of: disc, x-, x+, y-, y+, *"]),
    "contact of two walls": (touching('between = ["x-", "x+"]\nrestitution = 0.5'), 9, ["are both walls", "give at least one species"]),
    "contact by an unknown law": (
        touching('between = ["*", "*"]\nrestitution = { form = "spring", v0 = 1, exponent = 1 }'), 11, ["'form' cannot be 'spring'", "power"]),
    "contact without an exponent": (
        touching('between = ["*", "*"]\nrestitution = { form = "power", v0 = 1 }'), 11, ["'restitution' has no 'exponent'"]),
    "contact with a speed of 0": (
        touching('between = ["*", "*"]\nrestitution = { form = "power", v0 = 0, exponent = 1 }'), 11, ["'v0' must be positive (is 0)"]),
    "contact with an unknown key": (
        touching('between = ["*", "*"]\nrestituton = 0.5'), 11, ["unknown key 'restituton'", "did you mean 'restitution'?"]),
    "contact with a negative rest speed": (
        touching('between = ["*", "*"]\nrest_speed = -1'), 11, ["'rest_speed' must be zero or positive (is -1)"]),
    "contact rougher than rough": (rough("tangential = 1.5"), 11, ["'tangential' is 1.5; take at most 1"]),
    "contact smoother than smooth": (rough("tangential = -1.5"), 9, ["at least -1 (is -1.5)", "from -1, smooth"]),
    "negative friction": (rough("tangential = 0.5\nfriction = -0.1"), 12, ["'friction' must be zero or positive (is -0.1)"]),
    "friction of smooth spheres": (rough("friction = 0.1"), 9, ["'friction' without 'tangential'", "give both"]),
    "spin of smooth spheres": (
        rough("restitution = 0.5", "spin = [[1.0], [0.0]]"), 18, ["'spin' has no effect, all contacts are smooth", "give a [[contact]]"]),
    "spin of one of two": (rough("tangential = 0.5", "spin = [[1.0]]"), 18, ["'spin' has 1 vector for 2 particles"]),
    "spin about x and y": (
        rough("tangential = 0.5", "spin = [[1.0, 0.0], [1.0, 0.0]]"), 18, ["of 'spin' has 2 numbers", "asks for 1"]),
    "rotational temperature of smooth spheres": (
        rough("restitution = 0.5", "rotational_temperature = 1.0"),
        18, ["'rotational_temperature' has no effect, all contacts are smooth", "give a [[contact]]"]),
    "rotational temperature below 0": (
        rough("tangential = 0.5", "rotational_temperature = -1.0"), 18, ["must be zero or positive (is -1)"]),
    "spin and rotational temperature": (
        rough("tangential = 0.5", "spin = [[1.0], [0.0]]\nrotational_temperature = 1.0"),
        19, ["'spin' and 'rotational_temperature' exclude each other", "leave one of them out"]),
    "inertia of more than a ring": (
        rough("tangential = 0.5", "inertia = 1.5"), 18, ["'inertia' is 1.5, more than the 1 of a ring", "has 0.5"]),
    "no inertia": (rough("tangential = 0.5", "inertia = 0"), 18, ["'inertia' must be positive (is 0)"]),
    "rough points": (
        rough("tangential = 0.5").replace("radius = 0.5", "display_radius = 0.5").replace('"cdda"', '"verlet"'),
        11, ["'verlet' treats particles as points", "take psa or edda"]),
    "bath without a type": (bathed("temperature = 1.0\nrate = 1.0"), 9, ["missing key 'type' in [[bath]]"]),
    "bath of an unknown type": (
        bathed('type = "berendsen"\ntemperature = 1.0\nrate = 1.0'), 10, ["'berendsen'", "andersen, rescaling"]),
    "bath that is cold": (
        bathed('type = "andersen"\ntemperature = -1.0\nrate = 1.0'), 11, ["'temperature' must be positive (is -1)"]),
    "bath without kicks": (
        bathed('type = "andersen"\ntemperature = 1.0\nrate = 0'), 12, ["'rate' must be positive (is 0)"]),
    "bath with three temperatures": (
        bathed('type = "andersen"\ntemperature = [1.0, 2.0, 3.0]\nrate = 1.0'), 9, ["3 numbers", "the first and the last"]),
    "bath with a ramp to no end": (
        bathed('type = "andersen"\ntemperature = [1.0, 2.0]\nrate = 1.0').replace("steps = 10", "collisions = 10"),
        9, ["a ramp over a run without a last time", "run.end_time"]),
    "two baths": (
        bathed('type = "andersen"\ntemperature = 1.0\nrate = 1.0\n[[bath]]\ntype = "rescaling"\ntemperature = 1.0\nrate = 1.0'),
        13, ["a second [[bath]]", "give one"]),
    "bath without friction": (
        bathed('type = "langevin"\ntemperature = 1.0'), 9, ["a bath of type langevin needs 'friction'", "add it"]),
    "bath with a rate instead of friction": (
        bathed('type = "langevin"\ntemperature = 1.0\nrate = 1.0\nfriction = 1.0'), 9, ["has no 'rate'", "give 'friction'"]),
    "bath with too many frictions": (
        bathed('type = "langevin"\ntemperature = 1.0\nfriction = [1.0, 2.0]'), 12, ["'friction' has 2 numbers for 1 species"]),
    "step of no pairs": (stepped("range = 1.5\ndepth = 1.0"), 9, ["a step names no pairs", "give 'between'"]),
    "step within the core": (
        stepped('between = ["*", "*"]\nrange = 0.9\ndepth = 1.0'), 9, ["range 0.9 is not above the contact distance", "a larger range"]),
    "steps out of order": (
        stepped('between = ["*", "*"]\nrange = [1.5, 1.2]\ndepth = [1.0, 2.0]'), 9, ["range 1.2 is not above the range 1.5", "ascending"]),
    "step of an infinite depth": (
        stepped('between = ["*", "*"]\nrange = 1.5\ndepth = inf'), 12, ["'depth'", "finite"]),
    "step of an unknown species": (
        stepped('between = ["*", "ion"]\nrange = 1.5\ndepth = 1.0'), 9, ["'ion' is no species", "give one of"]),
    "tether between species": (stepped('between = ["*", "*"]\ntether = 1.5'), 9, ["'tether' joins listed pairs", "'pairs', 'chain' or 'within'"]),
    "steps next to a law of contacts": (
        stepped('between = ["*", "*"]\nrange = 1.5\ndepth = 1.0\n[[contact]]\nbetween = ["*", "*"]\nrestitution = 0.9'),
        9, ["come to rest at the ranges", "take free-flight"]),
    "tethers without pairs": (stepped("within = 2.0\ntether = 4.0"), 9, ["no particles stand within 2", "a larger 'within'"]),
    "steps with cva": (
        stepped('between = ["*", "*"]\nrange = 1.5\ndepth = 1.0', "cva"), 9, ["'cva' does not know steps", "take one of: free-flight, psa, cdda, edda"]),
    "wall that is shaken without a frequency": (
        walled('name = "y+"\nvelocity = {amplitude = 1}'), 11, ["'velocity' has no 'frequency'", "positive number"]),
    "wall with a frequency of 0": (
        walled('name = "y+"\nvelocity = {amplitude = 1, frequency = 0}'), 11, ["'frequency' must be positive (is 0)"]),
    "wall with an unknown motion": (
        walled('name = "y+"\nvelocity = {amplitude = 1, frequency = 1, phase = 1}'), 11, ["unknown key 'phase'"]),
    "wall with the velocity of a text": (
        walled('name = "y+"\nvelocity = "fast"'), 11, ["'velocity' has the wrong type: string", "table of amplitude and frequency"]),
    "boundary for too few axes": (
        changed('["wall", "wall"]', '["wall"]'),
        7, ["'boundary' has the wrong length (1)", "give 2"]),
    "box of too many axes": (
        changed("box = [10.0, 10.0]", "box = [10, 10, 10]"),
        6, ["'box' has the wrong length (3)", "give 2"]),
    "dimension 4": (changed("dimension = 2", "dimension = 4"), 5, ["'dimension' must be 2 or 3 (is 4)"]),
    "format of the future": (changed("format = 1", "format = 2"), 1, ["unknown deck format 2"]),
    "position in three dimensions": (
        changed("[5.0, 5.0]]", "[5.0, 5.0, 5.0]]"),
        11, ["vector 1 (from 0) of 'position' has 3 numbers", "asks for 2"]),
    "too few velocities": (
        changed("[[1.0, 0.0], [0.0, 0.0]]", "[[1.0, 0.0]]"),
        12, ["'velocity' has 1 vector for 2 particles"]),
    "too many masses": (changed("mass = 1.0", "mass = [1, 1, 1]"), 14, ["'mass' has 3 numbers for 2 particles"]),
    "bond to a missing particle": (
        changed("[[0, 1]]", "[[0, 2]]"),
        18, ["names particle 2, which is not there", "there are 2 particles"]),
    "bond to itself": (changed("[[0, 1]]", "[[1, 1]]"), 18, ["joins a particle to itself"]),
    "bond of three": (changed("[[0, 1]]", "[[0, 1, 1]]"), 18, ["'pairs' has the wrong type"]),
    "no bonds": (changed("pairs = [[0, 1]]\n", ""), 16, ["harmonic-bond: no bonds are given"]),
    "run without end": (changed("steps = 10\n", ""), 26, ["the run has no end", "end_time"]),
    "negative end": (changed("steps = 10", "end_time = -1"), 27, ["'end_time' must be positive"]),
    "count without placement": (
        changed('[placement]\ntype = "fcc"\n', "", FLUID),
        8, ["no [placement]", "simple-cubic"]),
    "count without temperature": (changed("temperature = 1.0\n", "", FLUID), 8, ["missing key 'temperature'"]),
    "box and packing fraction": (
        changed('"fcc"', '"fcc"\npacking_fraction = 0.3', FLUID),
        16, ["exclude each other"]),
    "compression in an open box": (
        changed('"fcc"', '"compressed"', changed('["periodic", "periodic", "periodic"]', '["periodic", "open", "wall"]', FLUID)),
        15, ["nothing is compressed in an open box", "wall or periodic"]),
    "compression of explicit positions": (
        changed('"fcc"', '"compressed"', changed(
            "[placement]", '[[particles]]\nname = "b"\nposition = [[1, 1, 1]]\nradius = 0.5\n[placement]', FLUID)),
        19, ["compression moves all particles", "by count"]),
    "growth that stands still": (
        changed('"fcc"', '"compressed"\ngrowth_rate = 0', FLUID), 16, ["'growth_rate' must be positive (is 0)"]),
    "growth of a lattice": (changed('"fcc"', '"fcc"\ngrowth_rate = 1', FLUID), 16, ["unknown key 'growth_rate'"]),
    "flat lattice in 3-D": (changed('"fcc"', '"square"', FLUID), 15, ["'square' is a lattice of 2 dimensions"]),
    "gravity in a periodic box": (
        changed("[integrator]\ntype = \"free-flight\"", '[[interaction]]\ntype = "gravity"\n[integrator]\ntype = "cva"\nstep = 0.1', FLUID),
        17, ["gravity", "periodic", "boundaries"]),
    "forces in free flight": (
        changed("[integrator]", '[[interaction]]\ntype = "wca"\nepsilon = 1\nsigma = 1\n[integrator]', FLUID),
        17, ["free-flight knows no forces but a uniform-field", "leave the interaction out"]),
    "the cut of earlier versions": (
        lennard_jones('cutoff = 2\ncut = "smooth"'), 22, ["'cut' can no longer be 'smooth'", 'write cut = "switch"']),
    "unknown cut": (lennard_jones('cutoff = 2\ncut = "swicth"'), 22, ["'cut' cannot be 'swicth'", "did you mean 'switch'?"]),
    "switch beyond the cutoff": (lennard_jones("cutoff = 2\nswitch_from = 2.5"), 17, ["'switch_from' is not below the cutoff"]),
    "switch of a shifted potential": (
        lennard_jones('cutoff = 2\ncut = "shifted"\nswitch_from = 1'), 17, ["'switch_from' belongs to cut = \"switch\""]),
    "negative switch": (lennard_jones("cutoff = 2\nswitch_from = -1"), 22, ["'switch_from' must be positive (is -1)"]),
    "tail that diverges": (
        lennard_jones("exponent = 3\ncutoff = 2\ntail = true").replace("lennard-jones", "inverse-power"),
        17, ["the long-range correction diverges", "leave 'tail' out"]),
    "tail of a shifted force": (
        lennard_jones('cutoff = 2\ncut = "force-shifted"\ntail = true'), 17, ["'tail' does not go with", 'take "switch"']),
    "tail between walls": (
        lennard_jones("cutoff = 2\ntail = true").replace('"periodic"]', '"wall"]'), 17, ["for a fluid without borders"]),
    "bonds left out that are not there": (
        lennard_jones('cutoff = 2\nexclude = "bonded"'), 17, ["there are no bonds", "add a harmonic-bond"]),
    "unknown exclusion": (
        lennard_jones('cutoff = 2\nexclude = "bonds"'), 22, ["'exclude' cannot be 'bonds'", "did you mean 'bonded'?"]),
    "table without points": (table(""), 17, ["no points are given", "'file'"]),
    "table out of order": (table("r = [1, 3, 2]\nvalue = [2, 1, 0]"), 17, ["the distances do not ascend"]),
    "table with a distance of zero": (table("r = [0, 1]\nvalue = [1, 0]"), 19, ["'r' must be positive (is 0)"]),
    "cutoff beyond the table": (table("r = [1, 2]\nvalue = [1, 0]\ncutoff = 3"), 17, ["'cutoff' lies beyond the last point"]),
    "table twice": (table('r = [1, 2]\nvalue = [1, 0]\nfile = "v.csv"'), 21, ["'file' and the points themselves exclude each other"]),
    "unknown species": (
        changed("[integrator]", '[[interaction]]\ntype = "wca"\nepsilon = 1\nsigma = 1\nspecies = ["sphere", "spere"]\n[integrator]', FLUID),
        21, ["unknown species 'spere'", "did you mean 'sphere'?"]),
    "equilibrated": (GOOD + '[output]\nstart = "equilibrated"\n', 29, ["looks at the rows of thermo.csv", "give a thermo_interval"]),
    "unknown start": (GOOD + '[output]\nstart = "never"\n', 29, ["first", "equilibrated"]),
    "waves": (GOOD + '[output]\nsk_interval = 1.0\n', 29, ["axis 0 is not periodic", "set sk_interval = 0"]),
    "checkpoint time": (GOOD + '[output]\ncheckpoint_wall = "soon"\n', 29, ["'soon' is not a time", "hh:mm:ss"]),
}


@pytest.mark.parametrize("name", DECK_ERRORS)
def test_deck_error(tmp_path, name):
    deck, line, wanted = DECK_ERRORS[name]
    answer = validate(tmp_path, deck)
    messages = answer.stderr.splitlines()
    found = [m for m in messages if m.startswith(f"deck.toml:{line}:") and all(w in m for w in wanted)]
    assert found, f"no message at line {line} with {wanted} in:\n{answer.stderr}"
    assert all(": error: " in m and "; " in m for m in messages)
    assert answer.returncode == 2
    assert answer.stdout == ""


# name: (deck, required parts of the message)
# Chains of four along the rows of a cubic lattice of spacing 1.5.
CHAINS = FLUID.replace('"fcc"', '"simple-cubic"').replace('type = "free-flight"', 'type = "edda"\nstep = 0.01').replace("[integrator]", """\
[[interaction]]
type = "harmonic-bond"
chain = true
chain_length = 4
stiffness = 100.0
rest_length = 1.5
[integrator]""")

IMPOSSIBLE_STATES = {
    "overlap": (
        changed("[5.0, 5.0]]", "[2.8, 5.0]]"),
        ["1 pair of spheres overlaps", "particles 0 and 1 at distance 0.8, contact distance 1"]),
    "overlap through the boundary": (
        changed('["wall", "wall"]', '["periodic", "wall"]').replace("[[2.0, 5.0], [5.0, 5.0]]", "[[0.25, 5.0], [9.5, 5.0]]"),
        ["1 pair of spheres overlaps", "distance 0.75"]),
    "lattice too dense": (
        changed("box = [6.0, 6.0, 6.0]", "box = [3.6, 3.6, 3.6]", FLUID),
        ["pairs of spheres overlap", "contact distance 1"]),
    "tether that is too short": (
        stepped("pairs = [[0, 1]]\ntether = 2.0"), ["particles 0 and 1 start at a distance of 3", "their tether is 2 long", "a longer tether"]),
    "tether that is no longer than the contact distance": (
        stepped("pairs = [[0, 1]]\ntether = 0.8"), ["not above their contact distance 1"]),
    "step at a length within the core": (
        stepped('between = ["*", "*"]\nrange = 0.9\ndepth = 1.0\nunit = "length"'), ["the step at the distance 0.9", "contact distance 1"]),
    "bond that starts within its core": (
        stepped("pairs = [[0, 1]]\ntether = 5.0\ncore = 4.0"), ["particles 0 and 1 at distance 3, contact distance 4"]),
    "outside a wall": (
        changed("[[2.0, 5.0]", "[[0.25, 5.0]"),
        ["1 sphere is not inside the walls", "particle 0", "0.25 beyond the lower wall of axis 0"]),
    "wall that runs into a sphere": (
        walled('name = "ramp"\nnormal = [2, 0]\noffset = 4.5'),
        ["1 sphere is not inside the walls", "particle 0", "0.75 beyond the wall 'ramp'"]),
    "outside of a cavity": (
        walled('name = "cavity"\nshape = "sphere"\ncentre = [5, 5]\nradius = 3'),
        ["1 sphere is not inside the walls", "particle 0", "0.5 beyond the wall 'cavity'"]),
    "periodic box too small": (
        changed('["wall", "wall"]', '["wall", "periodic"]').replace("[10.0, 10.0]", "[10.0, 0.9]").replace("5.0]", "0.45]"),
        ["the periodic box is 0.9 long on axis 1, less than a diameter of 1"]),
    "more spheres than box": (
        changed("box = [6.0, 6.0, 6.0]", "box = [2.0, 2.0, 2.0]", FLUID),
        ["of the box", "enlarge the box"]),
    "a box too large for the digits of positions": (
        changed("box = [10.0, 10.0]", "box = [10.0, 1e20]"),
        ["deck.toml:6:7: ", "distances in a box of 1e+20 are known to 6.6e+04 only, and the smallest radius is 0.5", "shorten the longest edge"]),
    "spheres wider than the box": (
        changed("box = [6.0, 6.0, 6.0]", "box = [8e-9, 8e-9, 8e-9]", FLUID.replace('"fcc"', '"random"')),
        ["the largest diameter is 1, and the box is 8e-09 long on axis 0", "enlarge the box"]),
    "no room for points": (
        lennard_jones("cutoff = 2.0").replace('"fcc"', '"random"\ndistance = 3.0').replace("collisions", "steps"),
        ["random insertion found no place for particle", "at the distance 3 from all others", "give a smaller placement.distance"]),
    "a distance beyond the box": (
        lennard_jones("cutoff = 2.0").replace('"fcc"', '"random"\ndistance = 7.0').replace("collisions", "steps"),
        ["placement.distance is 7, and the box is 6 long on axis 0", "give a smaller one"]),
    "a position 3e9 boxes away": (
        changed('["wall", "wall"]', '["periodic", "wall"]').replace("[5.0, 5.0]]", "[3e10, 5.0]]"),
        ["deck.toml:9:1: ", "particle 1 is more than 2147483647 periodic boxes away", "give a position in the box"]),
    "a rescaling bath of particles at rest": (
        FLUID.replace("temperature = 1.0", "temperature = 0.0") + '[[bath]]\ntype = "rescaling"\ntemperature = 1.0\nrate = 1.0\n',
        ["deck.toml:22:1: ", "a rescaling bath multiplies velocities, and all particles are at rest", "andersen"]),
    "chains through vacancies": (
        CHAINS.replace("count = 64", "count = 63"),
        ["deck.toml:14:1: ", "type = \"simple-cubic\" does not look at bonds: the longest bond is", "its rest length is 1.5", "32 kT"]),
    "chains at random": (
        CHAINS.replace('"simple-cubic"', '"random"'),
        ["deck.toml:14:1: ", "type = \"random\" does not look at bonds", "half an edge of the periodic box or more", "type = \"file\""]),
    "random insertion jams": (
        changed('"fcc"', '"random"', FLUID).replace("count = 64", "count = 200"),
        ["random insertion found no place for sphere", "of 200", "0.384"]),
}


@pytest.mark.parametrize("name", IMPOSSIBLE_STATES)
def test_impossible_state(tmp_path, name):
    deck, wanted = IMPOSSIBLE_STATES[name]
    answer = validate(tmp_path, deck)
    assert all(w in answer.stderr for w in wanted), answer.stderr
    assert answer.stderr.startswith("deck.toml:")
    assert answer.returncode == 3


def test_stretched_bonds_are_warned_of_where_the_deck_gives_the_positions(tmp_path):
    """Bonds near their rest length are not, nor those of cold particles, whose energy is compared with nothing."""
    springs = changed("velocity = [[1.0, 0.0], [0.0, 0.0]]", "temperature = 1.0")
    assert validate(tmp_path, springs).stderr == ""
    stiff = validate(tmp_path, springs.replace("stiffness = 1.0", "stiffness = 100.0"))  # k (3 - 2)^2 / 2 = 50
    assert stiff.returncode == 0 and stiff.stderr.startswith("deck.toml:16:1: warning: the longest bond is 3 long")
    assert "its energy is 50 kT" in stiff.stderr
    assert validate(tmp_path, changed("stiffness = 1.0", "stiffness = 100.0")).stderr == ""
    assert validate(tmp_path, CHAINS).stderr == ""
    bath = '[[bath]]\ntype = "andersen"\ntemperature = 1.0\nrate = 1.0\n'
    heated = validate(tmp_path, CHAINS.replace("rest_length = 1.5", "rest_length = 0.5") + bath)
    assert heated.returncode == 0 and "its energy is 50 kT" in heated.stderr


def test_particles_that_come_to_rest_cannot_be_heated(tmp_path):
    still = changed("[1.0, 0.0], [0.0, 0.0]]", "[1.0, 0.0], [-1.0, 0.0]]").replace('["wall", "wall"]', '["periodic", "periodic"]')
    still = still[:still.index("[[interaction]]")] + """\
[[contact]]
between = ["*", "*"]
restitution = 0.0
[[bath]]
type = "rescaling"
temperature = 1.0
rate = 1e-9
[integrator]
type = "psa"
step = 0.01
[run]
end_time = 5.0
"""
    (tmp_path / "deck.toml").write_text(still)
    done = carom("run", "deck.toml", "-o", "out", "--quiet", cwd=tmp_path)
    assert done.returncode == 4 and "have come to rest, and a rescaling bath cannot heat" in done.stderr, done.stderr


def test_images_are_counted_with_32_bits(tmp_path):
    """2147483640 boxes away at the start; it crosses seven more, but not ten."""
    far = changed('["wall", "wall"]', '["periodic", "wall"]').replace("[2.0, 5.0]", "[21474836402.0, 5.0]").replace("[1.0, 0.0]", "[500.0, 0.0]")
    far = far[:far.index("[[interaction]]")] + '[integrator]\ntype = "psa"\nstep = 0.01\n[run]\nsteps = 10\n'
    (tmp_path / "deck.toml").write_text(far.replace("[5.0, 5.0]", "[5.0, 8.0]"))
    assert carom("run", "deck.toml", "-o", "near", "--quiet", cwd=tmp_path).returncode == 0
    done = carom("run", "deck.toml", "-o", "far", "--quiet", "--set", "run.steps=20", cwd=tmp_path)
    assert done.returncode == 4 and "has crossed the periodic box 2.14748e+09 times along axis 0" in done.stderr, done.stderr


def test_g_of_r_without_a_density_or_room(tmp_path):
    sampled = GOOD + "\n[output]\nrdf_interval = 1.0\n" if "[output]" not in GOOD else changed("[output]", "[output]\nrdf_interval = 1.0")
    assert validate(tmp_path, sampled).returncode == 0
    open_box = validate(tmp_path, changed('["wall", "wall"]', '["wall", "open"]', sampled))
    assert open_box.returncode == 2 and "error: g(r) needs a density" in open_box.stderr
    many = validate(tmp_path, sampled.replace("rdf_interval = 1.0", "rdf_bins = 1000001"))
    assert many.returncode == 2 and "error: 'rdf_bins' is 1000001; take at most 1000000" in many.stderr
    too_far = validate(tmp_path, sampled.replace("rdf_interval = 1.0", "rdf_interval = 1.0\nrdf_range = 9.1"))
    assert too_far.returncode == 2 and "error: g(r) cannot be taken to 9.1 in this box; take at most 9" in too_far.stderr


def test_profile_without_its_axis(tmp_path):
    sampled = GOOD + "\n[output]\nprofile_interval = 1.0\nprofile_axis = 1\n"
    assert validate(tmp_path, sampled).returncode == 0
    no_axis = validate(tmp_path, sampled.replace("profile_axis = 1", "profile_axis = 2"))
    place = f"deck.toml:{len(sampled.splitlines())}:"
    assert no_axis.returncode == 2 and no_axis.stderr.startswith(place) and "error: there is no such axis" in no_axis.stderr


def test_every_problem_is_reported_in_the_order_of_the_deck(tmp_path):
    deck = GOOD.replace("radius = 0.5", "radius = -1").replace("step = 0.01", "step = 0").replace("[[0, 1]]", "[[0, 7]]")
    messages = validate(tmp_path, deck).stderr.splitlines()
    assert [m.split(":")[1] for m in messages] == ["13", "18", "24"]


def test_touching_spheres_are_no_overlap(tmp_path):
    assert validate(tmp_path, changed("[5.0, 5.0]]", "[3.0, 5.0]]")).returncode == 0


def test_points_may_overlap(tmp_path):
    deck = changed("[5.0, 5.0]]", "[2.8, 5.0]]").replace('"cdda"', '"verlet"').replace('["wall", "wall"]', '["open", "open"]')
    answer = validate(tmp_path, deck.replace("radius", "display_radius"))
    assert (answer.returncode, answer.stderr) == (0, "")
    cores = validate(tmp_path, deck)
    assert cores.returncode == 2
    assert ": 'verlet' treats particles as points and would ignore 'radius'; take psa or edda, where spheres collide, or write display_radius" in cores.stderr
    pictures = validate(tmp_path, changed("radius", "display_radius"))
    assert pictures.returncode == 2
    assert "missing key 'radius' in [[particles]]" in pictures.stderr and "'display_radius' is for points" in pictures.stderr


def test_averages_of_the_initial_lattice(tmp_path):
    """They are warned of, unless the samples start later."""
    sampled = FLUID + "\n[output]\nrdf_interval = 1.0\n"
    assert "the averages include the initial lattice" in validate(tmp_path, sampled).stderr
    assert "lattice" not in validate(tmp_path, sampled + "sample_start = 2.0\n").stderr
    assert "lattice" not in validate(tmp_path, sampled + 'start = "equilibrated"\nthermo_interval = 0.1\n').stderr
    (tmp_path / "deck.toml").write_text(FLUID)
    for place, says in (("fcc", True), ("random", False)):
        assert carom("run", "deck.toml", "-o", place, "--set", f"placement.type={place}", cwd=tmp_path).returncode == 0
        assert (", from the initial lattice on, collision rate" in (tmp_path / place / "run.log").read_text()) == says


def test_warnings(tmp_path):
    answer = validate(tmp_path, changed("stiffness = 1.0", "stiffness = 1e4"))
    assert answer.returncode == 0
    assert answer.stderr.startswith("deck.toml:24:8: warning: step 0.01 is long for the shortest period")


SET_ERRORS = {
    "zero step": ("integrator.step=0", "--set integrator.step: error: 'step' must be positive (is 0); "),
    "unknown key": ("integrator.stp=1", "--set integrator.stp: error: unknown key 'stp' in [integrator]; did you mean 'step'?"),
    "negative radius by index": ("particles.0.radius=-1", "--set particles.0.radius: error: 'radius' must be positive"),
    "no such table": ("particles.3.radius=1", "--set particles.3.radius: error: there is no such table; "),
    "no index in a list of several": ("interaction.stiffness=2", "--set interaction.stiffness: error: there is no such table; count the tables"),
    "no value": ("integrator.step", "--set integrator.step: error: no value; "),
    "integer beyond 64 bits": ("run.steps=99999999999999999999", "--set run.steps: error: cannot read the value"),
    "malformed value": ("system.box=[1, 2", "--set system.box: error: cannot read the value"),
}


@pytest.mark.parametrize("name", SET_ERRORS)
def test_set_error(tmp_path, name):
    override, message = SET_ERRORS[name]
    two_terms = GOOD.replace("[integrator]", '[[interaction]]\ntype = "harmonic-trap"\nstiffness = 1.0\n[integrator]')
    answer = validate(tmp_path, two_terms, "--set", override)
    assert answer.stderr.startswith(message)
    assert answer.returncode == 2


@pytest.mark.parametrize("arguments", [[], ["frobnicate"], ["run"], ["validate"], ["validate", "a", "--bogus"], ["run", "a", "--max-wall", "soon"]])
def test_usage(arguments):
    answer = carom(*arguments)
    assert answer.returncode == 2
    assert answer.stderr != ""


@pytest.mark.parametrize("arguments, wanted", [
    (["--version"], "git"), (["--help"], "validate"), (["methods"], "Mol. Phys. 98"), (["schema"], "[[particles]]"),
    (["schema", "--markdown"], "| `radius` |"),
])
def test_pages(arguments, wanted):
    answer = carom(*arguments)
    assert answer.returncode == 0
    assert wanted in answer.stdout


@pytest.mark.parametrize("name", DECK_ERRORS)
def test_run_and_validate_refuse_the_same(name, tmp_path):
    text = DECK_ERRORS[name][0]
    answer = validate(tmp_path, text)
    done = carom("run", "deck.toml", "-o", "out", "--quiet", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (answer.returncode, answer.stderr)
    assert not (tmp_path / "out").exists()
