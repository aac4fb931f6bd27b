#!/usr/bin/env python3
"""Checks the certificate of `kardan analyze --json` (standard input or a file); see certificate.md. Standard library only."""
import json, re, secrets, sys
from fractions import Fraction as F


def need(holds, what):
    if not holds:
        raise ValueError(what)


def times(a, b):
    return [[sum((x * b[k][j] for k, x in enumerate(row) if x), F(0)) for j in range(len(b[0]) if b else 0)] for row in a]


def echelon(rows, p=None):
    """Rank and, of a square matrix, the determinant; over the rationals, or modulo a prime."""
    rows, rank, det = [list(row) for row in rows], 0, F(1) if p is None else 1
    for column in range(len(rows[0]) if rows else 0):
        pivot = next((i for i in range(rank, len(rows)) if rows[i][column]), None)
        if pivot is None:
            continue
        det = -det if pivot != rank else det
        rows[rank], rows[pivot] = rows[pivot], rows[rank]
        det *= rows[rank][column]
        inverse = 1 / rows[rank][column] if p is None else pow(rows[rank][column], -1, p)
        for i in range(rank + 1, len(rows)):
            factor = rows[i][column] * inverse
            if factor:
                rows[i] = [x - factor * y if p is None else (x - factor * y) % p for x, y in zip(rows[i], rows[rank])]
        rank += 1
    return rank, 0 if rank < len(rows) else det if p is None else det % p


def solve(e, right):
    """E⁻¹ · right, exact."""
    n, rows = len(e), [list(a) + list(b) for a, b in zip(e, right)]
    for k in range(n):
        pivot = next(i for i in range(k, n) if rows[i][k])
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [x / rows[k][k] for x in rows[k]]
        rows = [row if i == k or not row[k] else [x - row[k] * y for x, y in zip(row, rows[k])] for i, row in enumerate(rows)]
    return [row[n:] for row in rows]


def polynomial(text):
    """Coefficients of 1, s, s², … of `s^2 - 3/2 s + 2`; None where it is not written out."""
    if text.startswith("("):
        return None
    found = {}
    for sign, number, s, power in re.findall(r"([+-]?)\s*(\d+(?:/\d+)?)?\s*(s?)(?:\^(\d+))?", text):
        if number or s:
            degree = int(power or 1) if s else 0
            found[degree] = found.get(degree, 0) + F(number or 1) * (-1 if sign == "-" else 1)
    return [F(found.get(k, 0)) for k in range(max(found) + 1)]


def value(p, s):
    return sum(c * s**k for k, c in enumerate(p))


def minor(g, b, stated):
    """The order of a minor of [b, Gb, G²b, …] that does not vanish modulo its prime."""
    p = stated["prime"]
    need(2 <= p < 1 << 64 and all(pow(x, p - 1, p) == 1 for x in (2, 3, 5, 7, 11) if x % p), "no prime")
    g, b, columns = residues(g, p), residues(b, p), []
    for place, power in stated["columns"]:
        v = [row[place] for row in b]
        for _ in range(power):
            v = [sum(x * y for x, y in zip(row, v)) % p for row in g]
        columns.append([v[i] for i in stated["rows"]])
    rank, det = echelon(columns, p)
    need(len(stated["rows"]) == len(columns) == rank and det == stated["value"] % p, "a minor")
    return rank


def side(found, e, a, b, keys):
    good, rank, least, count, reached, missed = keys
    n, g, proof, at_b = len(a), solve(e, a), found["certificate"], solve(e, b)
    fractions = lambda rows: [[F(x) for x in row] for row in rows]
    need(found[good] == (found[rank] == n) and minor(g, at_b, proof[reached]) == found[rank], rank)
    if found[rank] < n:
        y, m = fractions(proof[missed]["rows"]), fractions(proof[missed]["action"])
        need(len(y) == n - found[rank] == echelon(y)[0] and times(y, a) == times(times(m, y), e), missed)
        need(not any(x for row in times(y, b) for x in row), missed)
    number, witness = proof[count]["number"], fractions(proof[count]["witness"])
    need(number == found[least] and all_len(witness, number) and minor(g, solve(e, witness), proof[count]["minor"]) == n, count)
    if number > 1:
        q, y = [F(x) for x in proof[count]["common_factor"]], fractions(proof[count]["rows"])
        d = len(q) - 1
        need(d > 0 and q[d] == 1 and len(y) == number * d == echelon(y)[0], count)
        last = lambda i: (i + 1) % d == 0
        entry = lambda i, j: -q[j % d] if last(i) and i // d == j // d else F(j == i + 1 and not last(i))
        m = [[entry(i, j) for j in range(len(y))] for i in range(len(y))]
        need(times(y, a) == times(times(m, y), e), count)
    return g, at_b


def all_len(rows, width):
    return all(len(row) == width for row in rows)


def check(found):
    n, m, p = len(found["state_names"]), len(found["inputs"]), len(found["outputs"])

    def read(name, rows, columns):
        out = [[F(0)] * columns for _ in range(rows)]
        for i, j, x in found["certificate"]["pencil"][name]:
            out[i][j] = F(x)
        return out

    e, a, b, c, d = (read(*x) for x in [("E", n, n), ("A", n, n), ("B", n, m), ("C", p, n), ("D", p, m)])
    turn = lambda x, width: [[row[j] for row in x] for j in range(width)]
    g, at_b = side(found, e, a, b, ["controllable", "controllable_rank", "min_inputs", "inputs", "controllability_minor", "uncontrollable_invariant"])
    h, at_c = side(found, turn(e, n), turn(a, n), turn(c, n), ["observable", "observable_rank", "min_outputs", "outputs", "observability_minor", "unobservable_invariant"])
    need(not found["certificate"]["proven"] or found["certificate"]["failure_probability"] == 0, "proven with a probability of failure")
    told = ["ranks", "least numbers"]
    # Relative degrees: D, CB, CGB, … vanish before, and not then.
    table, v, open = found["relative_degrees"]["table"], at_b, d
    for power in range(n + 1):
        for i in range(p):
            for j in range(m):
                late = table[i][j] is None or table[i][j] > power
                need(late <= (open[i][j] == 0) and (table[i][j] != power or open[i][j] != 0), "relative degree")
        open, v = times(c, v) if n else open, times(g, v)
    told.append("relative degrees")
    # Multiplicities: det(sE − A) at n + 1 points; nullity of f(G), and of it what inputs miss and outputs do not show.
    factors = [(polynomial(f["polynomial"]), f) for f in found["factors"]]
    if all(f for f, _ in factors):
        need(sum((len(f) - 1) * x["algebraic"] for f, x in factors) == n, "multiplicities")
        ratio = lambda s: echelon([[s * x - y for x, y in zip(*rows)] for rows in zip(e, a)])[1]
        for s in range(-1, n + 1):
            product = echelon(e)[1]
            for f, x in factors:
                product *= value(f, F(s)) ** x["algebraic"]
            need(ratio(F(s)) == product, "multiplicities")
        for f, x in factors:
            for matrix, extra, key in [(g, [], "geometric"), (turn(g, n), turn(at_b, m), "input_defect"), (g, c, "output_defect")]:
                need(nullity(f, matrix, extra) == (len(f) - 1) * x[key], key)
        told.append("multiplicities")
    # Zeros: the greatest common divisor of the largest minors of the system matrix s X - Y that do not all vanish.
    x = [e[i] + [F(0)] * m for i in range(n)] + [[F(0)] * (n + m)] * p
    y = [a[i] + b[i] for i in range(n)] + [[-v for v in c[i] + d[i]] for i in range(p)]
    at = lambda s: [[s * v - w for v, w in zip(*rows)] for rows in zip(x, y)]
    rank = max(echelon(at(F(k, 7)))[0] for k in range(2, n + 5))
    need(rank - n == found["zeros"]["normal_rank"], "normal rank")
    told.append("normal rank")
    z = polynomial(found["zeros"]["polynomial"])
    if z:
        prime = next(q for q in iter(lambda: secrets.randbits(60) | 1 << 60 | 1, 0) if all(pow(k, q - 1, q) == 1 for k in (2, 3, 5, 7)))
        need(z[-1] == 1 and common_minor(x, y, rank, n, prime) == residues([z], prime)[0], "zeros")
        told.append("zeros")
    properties, proofs = found.get("properties"), found["certificate"]["stability"]
    if properties:
        action = lambda key: [[F(x) for x in row] for row in (found["certificate"][key] or {"action": []})["action"]]
        blocks = {"stable": g, "stabilisable": action("uncontrollable_invariant"), "detectable": action("unobservable_invariant")}
        for key, zeros in [("stable", None), ("stabilisable", "input_decoupling_zeros"), ("detectable", "output_decoupling_zeros")]:
            if proofs[key] or properties[key] is not None:
                stability(properties[key], proofs[key], blocks[key], found["discrete"] is not None)
                need(not zeros or proofs[key]["polynomial"] == properties[zeros]["polynomial"], zeros)
                told.append(key)
        reached, ci = nested(g, at_b)
        seen, oi = nested(turn(g, n), turn(c, n))
        need(ci == properties["controllability_indices"] and oi == properties["observability_indices"], "indices")
        told.append("indices")
        if properties["minimal_order"] is not None:
            need(properties["minimal_order"] == echelon(times(seen, turn(reached, n)) if seen and reached else [])[0], "minimal order")
            told.append("minimal order")
        if properties["infinite_zeros"] is not None and (n + 1) * max(p, m) <= 60:
            need(properties["infinite_zeros"] == infinite(g, at_b, c, d), "zeros at infinity")
            told.append("zeros at infinity")
    if found.get("descriptor"):
        at_infinity(found["descriptor"])
        told.append("verdicts at infinity")
        separated(found["descriptor"], (a, b, c, d))
        told.append("separation of the singular E")
    for key, g1, b1 in [("controllability", g, at_b), ("observability", turn(g, n), turn(c, n))]:
        near = (found.get("matrix_distance") or {}).get(key)
        if near:
            nearest(near, g1, b1)
            told.append("distance, " + key)
    return told


def stability(verdict, proof, action, discrete):
    """p = det(s - M), and the first column of Routh's table: n + 1 numbers above zero if and only if all roots are in the left half-plane."""
    p, n = polynomial(proof["polynomial"]), len(action)
    need(p[-1] == 1 and len(p) == n + 1, "degree")
    for s in range(n):
        need(value(p, F(s)) == echelon([[s * F(i == j) - x for j, x in enumerate(row)] for i, row in enumerate(action)])[1] if n else 1, "polynomial")
    if discrete:
        # (1 - w)^n p((1 + w) / (1 - w)): the inside of the unit circle is the left half-plane.
        q = [F(0)] * (n + 1)
        for k, x in enumerate(p):
            term = [x]
            for sign in [1] * k + [-1] * (n - k):
                term = [a + sign * b for a, b in zip(term + [F(0)], [F(0)] + term)]
            q = [a + b for a, b in zip(q, term)]
        p = q
    column = [F(0)] if not p[-1] else routh([-x for x in p] if p[-1] < 0 else p)
    need(column == [F(x) for x in proof["routh"]], "Routh's table")
    need(verdict == (len(column) == n + 1 and all(x > 0 for x in column)), "stability")


def routh(p):
    """The first column of Routh's table, down to the first number that is not above zero."""
    upper, lower = p[::-1][::2], p[::-1][1::2]
    column = [upper[0]]
    for _ in range(len(p) - 1):
        lead = lower[0] if lower else F(0)
        column.append(lead)
        if lead <= 0:
            break
        lower = lower + [F(0)] * (len(upper) - len(lower))
        upper, lower = lower, [x - upper[0] / lead * y for x, y in zip(upper[1:], lower[1:])]
    return column


def nested(g, b):
    """A basis of what b, Gb, ... span, and how many columns of each input are independent of those before, power by power."""
    basis, counts, inputs = [], [0] * (len(b[0]) if b else 0), range(len(b[0]) if b else 0)
    open = [(j, [row[j] for row in b]) for j in inputs]
    while open:
        after = []
        for j, v in open:
            for at, row in basis:
                v = [x - v[at] * y for x, y in zip(v, row)] if v[at] else v
            at = next((i for i, x in enumerate(v) if x), None)
            if at is not None:
                basis.append((at, [x / v[at] for x in v]))
                counts[j] += 1
                after.append((j, [sum((x * y for x, y in zip(row, basis[-1][1]) if x), F(0)) for row in g]))
        open = after
    return [row for _, row in basis], counts


def infinite(g, b, c, d):
    """Orders of the zeros at infinity: k of the ranks of the block Toeplitz matrices of D, Cb, CGb, ... tell how many are of order k at most."""
    n, markov, v = len(g), [d], b
    for _ in range(n):
        markov.append(times(c, v) if n and c else d)
        v = times(g, v)
    orders, before, known = [], 0, 0
    for k in range(n + 1):
        blocks = [[markov[i - j] if i >= j else None for j in range(k + 1)] for i in range(k + 1)]
        rows = [[x for block in line for x in (block[i] if block else [F(0)] * (len(d[0]) if d else 0))] for line in blocks for i in range(len(d))]
        rank = echelon(rows)[0]
        orders += [k] * (rank - before - known)
        before, known = rank, rank - before
    return [k for k in orders if k]


def at_infinity(found):
    """Ranks of [E, A K, B] with K a basis of the kernel of E, and of [E, B]; for outputs those of the transposed pencil."""
    n, given = found["variables"], found["proof"]["pencil"]
    full = lambda key, i, j: next((F(x) for k, l, x in given[key] if (k, l) == (i, j)), F(0))
    widths = {key: 1 + max([l for _, l, _ in given[key]], default=-1) for key in "BC"}
    outputs = 1 + max([k for k, _, _ in given["C"]], default=-1)
    e, a = ([[full(key, i, j) for j in range(n)] for i in range(n)] for key in "EA")
    b, c = [[full("B", i, j) for j in range(widths["B"])] for i in range(n)], [[full("C", i, j) for j in range(n)] for i in range(outputs)]
    turn = lambda x, width: [[row[j] for row in x] for j in range(width)]
    for key, e, a, b in [("controllability", e, a, b), ("observability", turn(e, n), turn(a, n), turn(c, n))]:
        # Columns of A K by the echelon of [E^T, 1]: rows whose left part vanishes are the kernel.
        rows = [[e[i][j] for i in range(n)] + [F(j == k) for k in range(n)] for j in range(n)]
        kernel, left = [], []
        for row in rows:
            for at, other in left:
                row = [x - row[at] * y for x, y in zip(row, other)] if row[at] else row
            at = next((i for i in range(n) if row[i]), None)
            if at is None:
                kernel.append(row[n:])
            else:
                left.append((at, [x / row[at] for x in row]))
        moved = [[sum((x * v[j] for j, x in enumerate(row)), F(0)) for v in kernel] for row in a]
        stated = found[key]
        impulses = n - echelon([x + y + z for x, y, z in zip(e, moved, b)])[0]
        need(impulses == stated["impulse_defect"] and stated["impulse"] == (impulses == 0), "impulses")
        missed = n - echelon([x + z for x, z in zip(e, b)])[0]
        complete = None if stated["finite"] is None else stated["finite"] and missed == 0
        need(stated["complete"] == complete and (stated["infinite_defect"] == 0) == (missed == 0), "completeness")
    need(found["rank_of_e"] == echelon([[full("E", i, j) for j in range(n)] for i in range(n)])[0], "rank of E")
    need(found["index"] == max(found["infinite_blocks"], default=0) and found["impulse_free"] == (found["index"] <= 1), "index")


def separated(found, explicit):
    """S E T = diag(I, N), S A T = diag(J, I), and the state space of the certificate made of them."""
    proof, n, k = found["proof"], found["variables"], found["finite_eigenvalues"]
    s, t = ([[F(x) for x in row] for row in proof[key]] for key in ("left", "right"))
    given = lambda key: {(i, j): F(x) for i, j, x in proof["pencil"][key]}
    full = lambda key, rows, columns: [[given(key).get((i, j), F(0)) for j in range(columns)] for i in range(rows)]
    a, b, c, d = explicit
    inputs, outputs = len(b[0]) if k else len(d[0]) if d else 0, 1 + max([i for key in "CD" for i, _ in given(key)], default=-1)
    need(echelon(s)[0] == echelon(t)[0] == n, "regular factors")
    left, right = (times(times(s, full(key, n, n)), t) for key in "EA")
    unit = lambda m, span: all(m[i][j] == (i == j) for i in span for j in span)
    apart = lambda m: not any(m[i][j] or m[j][i] for i in range(k) for j in range(k, n))
    need(apart(left) and apart(right) and unit(left, range(k)) and unit(right, range(k, n)), "separation")
    block = power = [row[k:] for row in left[k:]]
    for order in range(1, n - k + 2):
        need(echelon(power)[0] == sum(max(0, size - order) for size in found["infinite_blocks"]), "blocks at infinity")
        power = times(power, block)
    at_b, at_c = times(s, full("B", n, inputs)), times(full("C", outputs, n), t)
    chain, step = [], at_b[k:]
    for _ in range(n - k):
        chain.append(times([row[k:] for row in at_c], step))
        step = times(block, step)
    kept = [i for i in range(outputs) if not any(x for later in chain[1:] for x in later[i])]
    need(a == [row[:k] for row in right[:k]] and b == at_b[:k] and c == [at_c[i][:k] for i in kept], "state space")
    direct = full("D", outputs, inputs)
    need(d == [[x - y for x, y in zip(direct[i], chain[0][i] if chain else [0] * inputs)] for i in kept], "feedthrough")


def nearest(found, a, b):
    """The change of [a, b] after which the rows Y are not reached is not larger than `upper`."""
    y, m = ([[F(x) for x in row] for row in found["proof"][key]] for key in ("rows", "action"))
    kept, turned = times(m, y), [list(column) for column in zip(*y)]
    miss = [[v - w for v, w in zip(*rows)] + list(at_b) for *rows, at_b in zip(times(y, a), kept, times(y, b))]
    change = times(turned, solve(times(y, turned), miss))
    need(echelon(y)[0] == len(y) and sum(x * x for row in change for x in row) <= F(found["upper"]) ** 2, "distance")
    need(0 <= found["lower"] <= found["upper"], "bounds of the distance")


def residues(rows, p):
    return [[v.numerator * pow(v.denominator, -1, p) % p for v in row] for row in rows]


def common_minor(x, y, rank, n, p):
    """Monic common divisor, modulo p, of det U(s X - Y)V for three random U and V: of all minors of that order, unless by accident."""
    product = lambda left, right: [[sum(v * w for v, w in zip(row, column)) % p for column in zip(*right)] for row in left]
    draw = lambda rows, columns: [[secrets.randbelow(p) for _ in range(columns)] for _ in range(rows)]
    common, x, y = [], residues(x, p), residues(y, p)
    for _ in range(3):
        u, v = draw(rank, len(x)), draw(len(x[0]), rank)
        x1, y1 = product(product(u, x), v), product(product(u, y), v)
        # Newton's interpolation through s = 0, 1, ..., n.
        values = [echelon([[(s * a - b) % p for a, b in zip(*rows)] for rows in zip(x1, y1)], p)[1] for s in range(n + 1)]
        for k in range(1, n + 1):
            for s in range(n, k - 1, -1):
                values[s] = (values[s] - values[s - 1]) * pow(k, -1, p) % p
        found = []
        for s in range(n, -1, -1):
            found = [(a - s * b) % p for a, b in zip([0] + found, found + [0])]
            found[0] = (found[0] + values[s]) % p
        while any(found):
            last = max(k for k, a in enumerate(found) if a)
            found = [a * pow(found[last], -1, p) % p for a in found[: last + 1]]
            while len(common) > last:
                lead, shift = common[-1], len(common) - last - 1
                common = [(a - lead * (found[i - shift] if i >= shift else 0)) % p for i, a in enumerate(common)][:-1]
            common, found = found, common
    return common


def nullity(f, g, extra):
    """Vectors that f(G) annihilates and, with all their images, `extra` too."""
    n, rows, power = len(g), [[F(0)] * len(g) for _ in g], [[F(i == j) for j in range(len(g))] for i in range(len(g))]
    tests, hidden = [list(row) for row in extra], []
    for k in range(max(len(f), n) if extra else len(f)):
        if k < len(f):
            rows = [[x + f[k] * y for x, y in zip(*both)] for both in zip(rows, power)]
        hidden, tests, power = hidden + tests, times(tests, g) if tests else [], times(power, g)
    return n - echelon(rows + hidden)[0]


def verdict(text):
    """Whether a certificate is right, and the sentence that says so."""
    try:
        return True, "confirmed: " + ", ".join(check(json.loads(text)))
    except (ValueError, KeyError, IndexError, TypeError, StopIteration, ZeroDivisionError) as wrong:
        return False, f"refused: {wrong}"


if __name__ == "__main__":
    confirmed, sentence = verdict(open(sys.argv[1]).read() if len(sys.argv) > 1 else sys.stdin.read())
    print(sentence, file=sys.stdout if confirmed else sys.stderr)
    sys.exit(not confirmed)
