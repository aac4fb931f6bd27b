"""Random sparse integer systems with what SLICOT finds of their zeros and indices.

ab08nd: rank of the transfer matrix, finite invariant zeros, orders of the zeros at infinity; tb01pd: order of the minimal
realisation. Kept are systems for which SLICOT gives the same for two tolerances.
"""
import json

import numpy as np
import scipy
import slycot

rng = np.random.default_rng(7)
systems = []
while len(systems) < 40:
    n, m, p = (int(x) for x in rng.integers(2, 6, 3) - [0, 1, 1])
    m, p = min(m, 3), min(p, 3)
    a, b, c, d = (rng.integers(-2, 3, size) * (rng.random(size) < 0.5) for size in [(n, n), (n, m), (p, n), (p, m)])
    if rng.random() < 0.6:
        d = np.zeros((p, m), dtype=int)
    a, b, c, d = (x.astype(float) for x in (a, b, c, d))

    def look(tol):
        nu, rank, dinfz, _, _, infz, _, _, af, bf = slycot.ab08nd(n, m, p, a, b, c, d, equil="N", tol=tol)
        zeros = scipy.linalg.eigvals(af[:nu, :nu], bf[:nu, :nu]) if nu else np.zeros(0)
        k = max(m, p)
        bb, cc = np.zeros((n, k)), np.zeros((k, n))
        bb[:, :m], cc[:p] = b, c
        order = slycot.tb01pd(n, m, p, a.copy(), bb, cc, tol=tol)[3]
        orders = [i + 1 for i in range(dinfz) for _ in range(infz[i])]
        return {"rank": int(rank), "zeros": sorted([[z.real, z.imag] for z in zeros]), "infinite": orders, "minimal": int(order)}

    loose, tight = look(1e-9), look(1e-12)
    same = all(loose[key] == tight[key] for key in ["rank", "infinite", "minimal"]) and len(loose["zeros"]) == len(tight["zeros"])
    if same and np.any(b) and np.any(c):
        systems.append({"A": a.tolist(), "B": b.tolist(), "C": c.tolist(), "D": d.tolist(), **loose})
json.dump({"slycot": slycot.__version__, "systems": systems}, open("systems.json", "w"))
print(len(systems), sum(bool(s["infinite"]) for s in systems), sum(s["minimal"] < len(s["A"]) for s in systems))
