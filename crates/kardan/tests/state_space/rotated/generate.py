"""Thirty systems with one mode that the input does not reach, hidden by a random orthogonal change of states.

Writes systems.json: the matrices as Python writes floats, the number of reached states as SLICOT's tb01pd finds it with its
default tolerance, and the eigenvalue that was built in as not reached.
"""
import json

import numpy as np
import slycot

rng = np.random.default_rng(18)
systems = []
for k in range(30):
    n, m = 4 + k % 7, 1 + k % 2
    lost = -0.5 - 0.1 * k
    a = np.zeros((n, n))
    a[: n - 1, : n - 1] = rng.standard_normal((n - 1, n - 1))
    a[: n - 1, n - 1] = rng.standard_normal(n - 1)
    a[n - 1, n - 1] = lost
    b = np.vstack([rng.standard_normal((n - 1, m)), np.zeros((1, m))])
    q, _ = np.linalg.qr(rng.standard_normal((n, n)))
    a, b = q @ a @ q.T, q @ b
    c = np.eye(n)
    _, _, _, reached = slycot.tb01pd(n, m, n, a.copy(), np.asfortranarray(np.hstack([b, np.zeros((n, n - m))])), c.copy(), job="C")
    systems.append({"A": a.tolist(), "B": b.tolist(), "reached": int(reached), "lost": lost})
json.dump({"slycot": slycot.__version__, "numpy": np.__version__, "systems": systems}, open("systems.json", "w"))
print([s["reached"] == len(s["A"]) - 1 for s in systems].count(True))
