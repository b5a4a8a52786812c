#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""How the relaxation time of a freely jointed chain in a bath grows with the number of its beads, without and with excluded volume.

    tools/python tools/chain_relaxation.py                                               # 20 minutes
    tools/python tools/chain_relaxation.py --beads 4,8,16 --times 60                       # half a minute

The distance of neighbours is between 1 and 1.2. Beads are points that pass through each other, or spheres of diameter 1. Each chain is
alone, and an Andersen bath kicks its beads at a rate that is their friction. The slowest Rouse mode of a chain of n beads is

    X = sum over k of c[k] r[k],    c[k] = sqrt(2/n) cos(pi (k + 1/2) / n),

and its relaxation time is the time in which the correlation <X(t) X(0)> falls to 1/e. The table compares it with that of the Rouse model, b^2 m rate /
(12 kT sin^2(pi/2n)), where b^2 is the mean square of a bond, and with m rate <X^2> / (3 kT), which is the same for bonds that are
independent. Errors are standard errors from the chains (jackknife). The exponent is fitted to all n.
"""

import argparse

import numpy as np

try:
    import carom
    carom.Simulation
except ImportError as missing:
    raise SystemExit("This study needs the built Python module: tools/python tools/chain_relaxation.py") from missing

CORE, TETHER = 1.0, 1.2
BOND = 3 / 5 * (TETHER**5 - CORE**5) / (TETHER**3 - CORE**3)    # the mean square of a bond
SAMPLES = 16                                                    # in the relaxation time of the Rouse model


def rouse(n, rate):
    return BOND * rate / (12 * np.sin(np.pi / (2 * n))**2)


def modes(n, radius, seed, rate, times):
    """The slowest mode of a chain at equal intervals, for some relaxation times of the Rouse model."""
    sim = carom.Simulation(dimension=3, box=[100.0] * 3, boundary="open")
    sim.add_particles(position=[[50, 50, 50 + 1.1 * k] for k in range(n)], radius=radius)
    sim.thermalize(1.0, seed=seed)
    sim.add_step(chain=True, core=CORE, tether=TETHER)
    sim.add_bath("andersen", temperature=1.0, rate=rate, seed=seed)
    sim.integrator("free-flight", step=4.0)
    form = np.sqrt(2 / n) * np.cos(np.pi * (np.arange(n) + 0.5) / n)
    tau, rows = rouse(n, rate), []
    sim.run(time=16 * tau)
    sim.run(time=(16 + times) * tau, every=tau / SAMPLES, callback=lambda sim: rows.append(form @ sim.position))
    return np.array(rows)


def correlation(X, most):
    """<X(t) X(0)> at lags up to most."""
    spectrum = np.fft.rfft(X, 2 * len(X), axis=0)
    return np.fft.irfft((abs(spectrum)**2).sum(axis=1))[:most] / (len(X) - np.arange(most))


def fall(correlations):
    """The lag at which the mean of the correlations is 1/e of its start, the mean square, and its ratio to it."""
    mean = np.mean(correlations, axis=0)
    logs = np.log(np.maximum(mean / mean[0], 1e-9))
    after = np.argmax(logs < -1)
    if after == 0:
        raise SystemExit("The runs are too short: the correlation does not fall to 1/e.")
    lag = after - 1 + (logs[after - 1] + 1) / (logs[after - 1] - logs[after])
    return np.array([lag, mean[0], lag / mean[0]])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--beads", default="4,8,16,32")
    parser.add_argument("--rate", type=float, default=4.0, help="of the kicks of a bead")
    parser.add_argument("--chains", type=int, default=16)
    parser.add_argument("--times", type=float, default=150.0, help="length of a run of a chain, in relaxation times of the Rouse model")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    beads = np.array([int(n) for n in options.beads.split(",")])
    for name, radius in (("points", 0.01), ("spheres", 0.5)):
        found = []
        print(f"{name:7}    n   relaxation time   over Rouse      over m rate <X^2> / 3kT")
        for n in beads:
            tau = rouse(n, options.rate)
            each = [correlation(modes(n, radius, options.seed + chain, options.rate, options.times), int(options.times * SAMPLES / 4))
                    for chain in range(options.chains)]
            without = np.array([fall(each[:chain] + each[chain + 1:]) for chain in range(options.chains)])
            time, _, ratio = fall(each) * [tau / SAMPLES, 1, 3 * tau / SAMPLES / options.rate]
            error, _, ratio_error = without.std(axis=0) * (options.chains - 1)**0.5 * [tau / SAMPLES, 1, 3 * tau / SAMPLES / options.rate]
            found.append((time, error))
            print(f"{n:12d}   {time:7.2f} +- {error:<5.2f}  {time / tau:5.3f} +- {error / tau:5.3f}  {ratio:5.3f} +- {ratio_error:5.3f}", flush=True)
        time, error = np.array(found).T
        fit, covariance = np.polyfit(np.log(beads), np.log(time), 1, w=time / error, cov="unscaled")
        print(f"exponent {fit[0]:.3f} +- {covariance[0, 0]**0.5:.3f}")
    model = np.polyfit(np.log(beads), np.log(rouse(beads, 1.0)), 1)
    print(f"exponent of the Rouse model at these n {model[0]:.3f}")


if __name__ == "__main__":
    main()
