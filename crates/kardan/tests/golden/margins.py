"""Writes margins.json: margins, singular values and norms of plain loops by python-control and Slycot.

The loops are the examples of the documentation and of the tests of these two packages, and some of them sampled with a hold. To
write the file anew:

    python3 -m venv venv && venv/bin/pip install control==0.10.2 slycot==0.7.1
    venv/bin/python margins.py > margins.json
"""

import json
import sys

import control
import numpy as np
import slycot

s = control.tf("s")


def matrices(system):
    return {name: np.atleast_2d(getattr(system, name)).tolist() for name in "ABCD"} | {"dt": system.dt or None}


def loop(origin, system):
    """All gain and phase margins, and the smallest distance of the loop gain from -1."""
    gains, phases, distances, at_gain, at_phase, at_distance = control.stability_margins(system, returnall=True)
    at = np.atleast_1d(at_distance)
    distances = np.atleast_1d(distances)
    least = int(np.argmin(distances)) if len(distances) else None
    return {
        "origin": origin,
        "system": matrices(control.ss(system)),
        "gain": [[float(a), float(b)] for a, b in zip(gains, at_gain)],
        "phase_deg": [[float(a), float(b)] for a, b in zip(phases, at_phase)],
        "distance": None if least is None else [float(distances[least]), float(at[least])],
    }


def loops():
    plain = {
        "docstring of control.margin": 1 / (s**3 + 2 * s**2 + s),
        "docstring of control.disk_margins, one loop at a time": 25 / (s**3 + 10 * s**2 + 10 * s + 10),
        "control/tests/margin_test.py, tsys, stability_margins with three crossovers": (8.75 * (4 * s**2 + 0.4 * s + 1))
        / ((100 * s + 1) * (s**2 + 0.22 * s + 1))
        / (s**2 / 10.0**2 + 2 * 0.04 * s / 10.0 + 1),
        "control/tests/margin_test.py, tsys, with a zero on the right": 0.01 * (10 - s) / (2 + s) / (1 + s),
        "control/tests/margin_test.py, tsys, three poles": control.tf([2], [1, 3, 2, 0]),
    }
    for origin, system in plain.items():
        yield loop(origin, system)
        # Of the long one python-control says that its sampled polynomials are not accurate, and falls back to a table of few digits;
        # the one with a zero on the right has no phase margin.
        if "stability_margins" not in origin and "zero on the right" not in origin:
            held = control.c2d(control.ss(system), 0.05, "zoh")
            yield loop(origin + ", sampled at 0.05 s with a hold", held)


def disks():
    """docstring of control.disk_margins: two loops at once; the least over a dense grid."""
    plant = control.ss([[0, 10], [-10, 0]], np.eye(2), [[1, 10], [-10, 1]], np.zeros((2, 2)))
    gain = control.ss([], [], [], [[1, -2], [0, 1]])
    system = plant * gain
    frequencies = np.logspace(-3, 3, 4001)
    found = control.disk_margins(system, frequencies, skew=0.0, returnall=True)[0]
    least = int(np.argmin(found))
    return {
        "origin": "docstring of control.disk_margins, skew 0",
        "system": matrices(control.ss(system)),
        "disk": float(found[least]),
        "frequency": float(frequencies[least]),
    }


def singular_values():
    """docstring of control.singular_values_response, and its norm by control.linfnorm (slycot.ab13dd)."""
    den = [75, 1]
    system = control.ss(control.tf([[[87.8], [-86.4]], [[108.2], [-109.6]]], [[den, den], [den, den]]))
    for origin, one in [("", system), (", sampled at 2 s with a hold", control.c2d(system, 2.0, "zoh"))]:
        frequencies = [1e-4, 1e-3, 0.0133, 0.1, 1.0]
        response = control.singular_values_response(one, omega=frequencies)
        norm, at = control.linfnorm(one, tol=1e-12)
        yield {
            "origin": "docstring of control.singular_values_response" + origin,
            "system": matrices(one),
            "frequencies": frequencies,
            "values": np.abs(response.magnitude).reshape(2, -1).T.tolist(),
            "norm": float(norm),
            "norm_at": float(at),
        }


def norms():
    """slycot.examples.ab13dd_example and ab13fd_example."""
    a = [
        [0, 1, 0, 0, 0, 0], [-0.5, -0.0002, 0, 0, 0, 0], [0, 0, 0, 1, 0, 0],
        [0, 0, -1, -0.00002, 0, 0], [0, 0, 0, 0, 0, 1], [0, 0, 0, 0, -2, -0.000002],
    ]
    b, c = [[1], [0], [1], [0], [1], [0]], [[1, 0, 1, 0, 1, 0]]
    value, at = slycot.ab13dd("C", "I", "N", "D", 6, 1, 1, np.array(a), np.eye(6), np.array(b), np.array(c), np.zeros((1, 1)))
    yield {
        "origin": "slycot.examples.ab13dd_example: the norm of a lightly damped system",
        "system": {"A": a, "B": b, "C": c, "D": [[0.0]], "dt": None},
        "norm": float(value),
        "norm_at": float(at),
    }
    a = [
        [246.5, 242.5, 202.5, -197.5], [-252.5, -248.5, -207.5, 202.5],
        [-302.5, -297.5, -248.5, 242.5], [-307.5, -302.5, -252.5, 246.5],
    ]
    radius, at = slycot.ab13fd(4, np.array(a), 0.0)
    unit = np.eye(4).tolist()
    yield {
        "origin": "slycot.examples.ab13fd_example: the distance to instability is one over the norm of the resolvent",
        "system": {"A": a, "B": unit, "C": unit, "D": np.zeros((4, 4)).tolist(), "dt": None},
        "norm": float(1 / radius),
        "norm_at": float(at),
    }


def structured():
    """slycot.ab13md with one complex number for each channel."""
    generator = np.random.default_rng(18)
    matrices = {"slycot/tests/test_ab13md.py, test_sp85_part2": np.array([[2, 2], [-1, -1]], dtype=complex)}
    for size in (2, 3, 4, 5):
        drawn = generator.standard_normal((size, size)) + 1j * generator.standard_normal((size, size))
        matrices[f"numpy.random.default_rng(18), {size} channels"] = np.round(drawn, 3)
    for origin, matrix in matrices.items():
        size = len(matrix)
        bound = slycot.ab13md(matrix, np.ones(size, dtype=int), 2 * np.ones(size, dtype=int))[0]
        yield {"origin": origin, "re": matrix.real.tolist(), "im": matrix.imag.tolist(), "bound": float(bound)}


json.dump(
    {
        "origin": f"python-control {control.__version__}, slycot {slycot.__version__}; written by margins.py",
        "loops": list(loops()),
        "disk": disks(),
        "singular_values": list(singular_values()),
        "norms": list(norms()),
        "structured": list(structured()),
    },
    sys.stdout,
    indent=None,
)
print()
