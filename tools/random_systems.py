# SPDX-License-Identifier: BSD-3-Clause
"""Random systems that are hard to integrate: masses 1:10⁶, sizes 1:50, spheres that touch others or walls, stiff springs, strong forces.

    deck = random_system(random.Random("1 17"))       # a deck of edda as a dictionary, for any method with hard cores

Touching spheres touch to rounding. No radius and no mass is larger than 1.
"""

import math

EDGE = 24.0  # the longest box: positions are rounded to 1e-13 of the smallest contact distance
ATTEMPTS = 60  # attempts to place a sphere
CLEAR_GAP = 1e-6  # relative gap of spheres that must not touch


def log_uniform(dice, least, most):
    return math.exp(dice.uniform(math.log(least), math.log(most)))


def unit_vector(dice, dimension):
    """A random direction; sometimes one along an axis."""
    if dice.random() < 0.3:
        along = [0.0] * dimension
        along[dice.randrange(dimension)] = dice.choice([-1.0, 1.0])
        return along
    vector = [dice.gauss(0, 1) for _ in range(dimension)]
    return [x / math.hypot(*vector) for x in vector]


class Spheres:
    """The spheres placed so far."""

    def __init__(self, dice, edges, boundary):
        self.dice, self.edges, self.boundary = dice, edges, boundary
        self.position, self.radius, self.touching = [], [], []

    def separation(self, x, y):
        apart = [a - b for a, b in zip(x, y)]
        return [d - edge * round(d / edge) if kind == "periodic" else d for d, edge, kind in zip(apart, self.edges, self.boundary)]

    def free(self, x, radius, partners):
        """Whether a sphere may be here: inside the walls, clear of all spheres but its partners, which it touches to rounding."""
        for each, edge, kind in zip(x, self.edges, self.boundary):
            if kind != "open" and not 0 <= each <= edge or kind == "wall" and not radius <= each <= edge - radius:
                return False
            if kind == "wall" and 0 < min(each - radius, edge - radius - each) < CLEAR_GAP * radius:
                return False
        for j, (y, other) in enumerate(zip(self.position, self.radius)):
            contact = radius + other
            distance, rounding = math.hypot(*self.separation(x, y)), max(5e-14 * contact, 2 * math.ulp(max(self.edges)))
            if distance < contact * (1 + CLEAR_GAP) and (j not in partners or abs(distance - contact) > rounding):
                return False
        return True

    def beside(self, radius):
        """A position in contact with one sphere, with a sphere and a wall, or with two spheres; and these spheres."""
        dice, dimension = self.dice, len(self.edges)
        j = dice.randrange(len(self.position))
        y, reach = self.position[j], radius + self.radius[j]
        how, fixed = dice.random(), {}
        walls = [k for k in range(dimension) if self.boundary[k] == "wall"]
        if how < 0.3 and walls:  # the coordinate along one axis is that of contact with the wall
            k = dice.choice(walls)
            fixed[k] = dice.choice([radius, self.edges[k] - radius])
            inside = reach**2 - (fixed[k] - y[k])**2
            if inside < 0:
                return None
            around = unit_vector(dice, dimension - 1)
            return [fixed[i] if i == k else y[i] + math.sqrt(inside) * around[i - (i > k)] for i in range(dimension)], [j]
        if how < 0.6 and len(self.position) > 1:
            other = dice.choice([i for i in range(len(self.position)) if i != j])
            second = radius + self.radius[other]
            axis = self.separation(self.position[other], y)
            apart = math.hypot(*axis)
            if not abs(reach - second) < apart < reach + second:
                return None
            axis = [each / apart for each in axis]
            along = (apart**2 + reach**2 - second**2) / (2 * apart)
            across = unit_vector(dice, dimension)
            share = sum(a * b for a, b in zip(across, axis))
            across = [a - share * b for a, b in zip(across, axis)]
            if math.hypot(*across) < 0.1:
                return None
            height = math.sqrt(max(0.0, reach**2 - along**2)) / math.hypot(*across)
            return [a + along * b + height * c for a, b, c in zip(y, axis, across)], [j, other]
        return [a + reach * b for a, b in zip(y, unit_vector(dice, dimension))], [j]

    def place(self, radius, touching):
        """Puts one more sphere anywhere or, with this probability, in contact; False: there is no room."""
        for _ in range(ATTEMPTS):
            partners = []
            if self.dice.random() < touching and self.position:
                if not (found := self.beside(radius)):
                    continue
                x, partners = found
            else:
                x = [self.dice.uniform(0, edge) for edge in self.edges]
                walls = [k for k, kind in enumerate(self.boundary) if kind == "wall"]
                if walls and self.dice.random() < touching:
                    k = self.dice.choice(walls)
                    x[k] = self.dice.choice([radius, self.edges[k] - radius])
            if self.free(x, radius, partners):
                self.touching += [[j, len(self.position)] for j in partners]
                self.position.append(x)
                self.radius.append(radius)
                return True
        return False


def on_lattice(dice, dimension, count, boundary):
    """Spheres of radius 1 on sites of a square lattice: all neighbours and the lower walls touch exactly. The box is longer than
    the rows are, because elastic spheres that fill it from end to end have no motion: their collisions never end."""
    rows = max(3, math.ceil((count / dice.uniform(0.3, 1))**(1 / dimension)))
    sites = [[1.0 + 2 * (site // rows**k % rows) for k in range(dimension)] for site in range(rows**dimension)]
    spheres = Spheres(dice, [2.0 * rows + dice.uniform(0.1, 1) for _ in range(dimension)], boundary)
    spheres.position, spheres.radius = dice.sample(sites, min(count, len(sites))), [1.0] * min(count, len(sites))
    spheres.touching = [[i, j] for j, y in enumerate(spheres.position) for i, x in enumerate(spheres.position[:j])
                        if math.dist(x, y) == 2.0]
    return spheres


def random_forces(dice, boundary, spheres, mass):
    """Terms of V, and 1/time² that they give the median mass, roughly."""
    periodic, sizes = "periodic" in boundary, sorted(spheres.radius)
    least, most, median = 2 * sizes[0], 2 * sizes[-1], sorted(mass)[len(mass) // 2]
    cutoff = {"cutoff": most * dice.uniform(1.2, 2.0)}
    cut = cutoff | {"cut": dice.choice(["switch", "shifted", "force-shifted"])} if periodic or dice.random() < 0.5 else {}
    strength, terms, rates = log_uniform(dice, 0.05, 20), [], []
    steep, sigma = most < 2 * least, least * dice.uniform(0.7, 1.1)  # steep potentials would be 0 for most pairs of very unequal spheres

    def add(rate, **term):
        terms.append(term)
        rates.append(rate)

    for kind in dice.sample(["field", "gravity", "charges", "yukawa", "lennard-jones", "morse", "inverse-power", "bonds", "trap"],
                            dice.choice([1, 1, 1, 2, 2, 3])):
        if kind == "field" and set(boundary) != {"periodic"}:
            along = [0.0 if end == "periodic" else dice.choice([0.0, dice.uniform(-5, 5)]) for end in boundary]
            add(math.hypot(*along) / most, type="uniform-field", acceleration=along)
        elif kind == "gravity" and not periodic:
            constant = log_uniform(dice, 0.01, 300)
            add(constant * max(mass) / most**3, type="gravity", constant=constant)
        elif kind == "charges":
            add(strength / (median * most**3), type="coulomb", form="damped-shifted", constant=strength, damping=dice.uniform(0.2, 1) / most, **cutoff)
        elif kind == "yukawa":
            amplitude = dice.choice([-1, 1]) * strength
            add(strength / (median * most**3), type="yukawa", amplitude=amplitude, kappa=dice.uniform(0.5, 3) / most, **cut)
        elif kind == "lennard-jones" and steep:
            add(strength / (median * most**2), type="lennard-jones", epsilon=strength, sigma=sigma, **cut)
        elif kind == "morse":
            alpha = dice.uniform(0.5, 3) / most
            add(strength * alpha**2 / median, type="morse", depth=strength, alpha=alpha, r0=most * dice.uniform(0.5, 1.5), **cut)
        elif kind == "inverse-power":
            signed, exponent = dice.choice([-1, 1]) * strength, dice.choice([1.0, 3.0, 6.0]) if steep else 1.0
            add(strength / (median * most**2), type="inverse-power", epsilon=signed, sigma=most, exponent=exponent, **cut)
        elif kind == "bonds" and spheres.touching and not periodic:  # bonds would stretch to half the box
            stiffness = log_uniform(dice, 0.1, 1e4)
            pairs = dice.sample(spheres.touching, dice.randint(1, len(spheres.touching)))
            add(stiffness / median, type="harmonic-bond", pairs=pairs, stiffness=stiffness, rest_length=most * dice.uniform(0.5, 1.2))
        elif kind == "trap" and not periodic:
            add(strength / median, type="harmonic-trap", stiffness=strength)
    return (terms, sum(rates)) if terms or dice.random() < 0.1 else random_forces(dice, boundary, spheres, mass)


def random_system(dice):
    """A deck of 1 to 40 particles."""
    dimension = dice.choice([2, 3])
    boundary = dice.choice([["wall"], ["open"], ["periodic"], ["wall", "periodic", "open"]])
    boundary = [dice.choice(boundary) for _ in range(dimension)]
    count, touching = dice.choice([dice.randint(1, 40), round(log_uniform(dice, 1, 40))]), dice.choice([0.0, 0.5, 0.9, 1.0])
    if dice.random() < 0.25:
        spheres = on_lattice(dice, dimension, count, boundary)
    else:
        ratio = dice.choice([1, 1, 5, 50, 50])
        radii = [log_uniform(dice, 1 / ratio, 1) for _ in range(count)]
        room = sum((2 * radius)**dimension for radius in radii)
        edge = max((room / dice.uniform(0.05, 0.5))**(1 / dimension), 5 * max(radii))
        spheres = Spheres(dice, [min(EDGE, edge * dice.uniform(1, 1.5)) for _ in range(dimension)], boundary)
        while not spheres.position:
            spheres.place(max(radii), touching)
        for radius in dice.sample(radii, count - 1):
            spheres.place(radius, touching)
    count = len(spheres.position)
    ratio = dice.choice([1, 10, 1e6, 1e6, 1e6])
    mass = [log_uniform(dice, 1 / ratio, 1) for _ in range(count)]
    terms, rate = random_forces(dice, boundary, spheres, mass)
    size, speed = 2 * max(spheres.radius), 0.0
    rest, thermal = dice.random() < 0.5, dice.random() < 0.5
    if not rest or not terms:
        speed = log_uniform(dice, 0.01, 1) * size * math.sqrt(rate or 1)
    median = sorted(mass)[count // 2]
    spread = [speed * math.sqrt(median / each) if thermal else speed for each in mass]
    velocity = [[dice.gauss(0, each) if each else 0.0 for _ in range(dimension)] for each in spread]
    tolerance = dice.choice([0.0, 1e-10, 1e-10, 1e-7, 1e-5])
    step = log_uniform(dice, 1e-3, 0.3) / math.sqrt(rate + (speed / size)**2 or 1)
    particles = {"name": "a", "position": spheres.position, "velocity": velocity, "radius": spheres.radius, "mass": mass,
                 "charge": [dice.choice([-1.0, 1.0]) for _ in mass]}
    return {"format": 1, "system": {"dimension": dimension, "box": spheres.edges, "boundary": boundary}, "particles": [particles],
            "interaction": terms, "integrator": {"type": "edda", "step": step, "tolerance": tolerance}, "run": {"steps": round(log_uniform(dice, 50, 400))},
            "output": {"frame_interval": 0.0, "thermo_interval": 5 * step}}
