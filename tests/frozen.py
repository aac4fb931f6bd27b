#!/usr/bin/env python3
"""What the commands answer to all built-in models, as hashes: whether a change that should change nothing did.

    python3 tests/frozen.py target/release/kardan            compares with tests/frozen.txt
    python3 tests/frozen.py target/release/kardan --update   writes it

One line an output: model, command, file, hash of its numbers, hash of its words. Tables count with every bit, objects with their numbers
in order, whatever their keys; the numbers of a page are those of its text. Three minutes on two cores.
"""
import concurrent.futures
import hashlib
import json
import pathlib
import re
import subprocess
import sys
import tempfile

EXPECTED = pathlib.Path(__file__).with_name("frozen.txt")
COMMANDS = {
    "check": ["check", "{model}"],
    "check-json": ["check", "{model}", "--json"],
    "run": ["run", "{model}", "--out", "out", "--quiet"],
    "run-json": ["run", "{model}", "--out", "out", "--json", "--markdown", "--quiet"],
    "analyze": ["analyze", "{model}", "--report", "page.html", "--quiet"],
    "analyze-json": ["analyze", "{model}", "--json", "--parity", "--quiet"],
    "design": ["design", "{model}", "--report", "page.html", "--quiet"],
    "design-json": ["design", "{model}", "--json", "--quiet"],
    "equations": ["equations", "{model}"],
    "equations-json": ["equations", "{model}", "--symbolic", "--json"],
    "linearise": ["linearise", "{model}"],
    "safety": ["safety", "{model}", "--report", "page.html", "--csv", "rows.csv", "--quiet"],
    "safety-json": ["safety", "{model}", "--json", "--quiet"],
    "sweep": ["sweep", "{model}", "--samples", "12", "--out", "sweep", "--quiet", "--threads", "1"],
    "bench": ["bench", "{model}", "--out", "logs", "--study", "--quiet"],
    "bench-json": ["bench", "{model}", "--out", "logs", "--json", "--quiet"],
}
ALONE = [["--help"], ["elements"], ["elements", "--json"], ["schema"], ["schema", "run"], ["schema", "model"]] + [
    [name, "--help"] for name in "run analyze design identify bench safety sweep equations linearise check models".split()
]
# Those that take minutes without more to show, and what no table of a model asks for.
LEFT_OUT = {("afs-steering", "safety"), ("afs-steering", "safety-json")}
# What differs from run to run: times, threads, addresses of files.
VARYING = re.compile(
    rb"\d+(\.\d+)?( ?(?:[mun]|\xc2\xb5)s| s| min)\b(?= (of|per|for|to)? ?(comput|run|simul|wall|prepar))|/tmp/[^\s\"'<,)]*|"
    rb"\"(elapsed|wall|seconds|duration_of_run)[a-z_]*\": ?[-+.e0-9]+"
)
NUMBER = re.compile(rb"(?<![A-Za-z_#])[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
TABLES = {".csv", ".parquet", ".mat", ".mf4"}


def leaves(value):
    """Numbers, truths and nothings of a JSON value, in their order; keys and texts are words."""
    if isinstance(value, (dict, list)):
        for one in value.values() if isinstance(value, dict) else value:
            yield from leaves(one)
    elif not isinstance(value, str):
        yield repr(value)


def hashes(data, is_table):
    if is_table:
        head, _, rows = data.partition(b"\n")
        return short(rows), short(head)
    data = VARYING.sub(b"", data)
    if data[:1] == b"{":
        return short(" ".join(leaves(json.loads(data))).encode()), short(data)
    return short(b" ".join(NUMBER.findall(data))), short(data)


def short(data):
    return hashlib.sha256(data).hexdigest()[:16]


def outputs(binary, model, name, arguments):
    """The lines of one command."""
    with tempfile.TemporaryDirectory() as folder:
        ran = subprocess.run(
            [binary] + [part.format(model=model) for part in arguments],
            cwd=folder, capture_output=True, env={"PATH": "/usr/bin:/bin", "NO_COLOR": "1", "COLUMNS": "120"},
        )
        files = {f"exit {ran.returncode}": (b"", False), "stdout": (ran.stdout, False), "stderr": (ran.stderr, False)}
        for path in sorted(pathlib.Path(folder).rglob("*")):
            if path.is_file() and path.suffix not in {".lock"}:
                files[str(path.relative_to(folder))] = (path.read_bytes(), path.suffix in TABLES)
    return [" ".join([model or "-", name, key.replace(" ", "_"), *hashes(*value)]) for key, value in files.items()]


def main():
    binary = str(pathlib.Path(sys.argv[1]).resolve())
    listed = subprocess.run([binary, "models"], capture_output=True, check=True, text=True).stdout
    models = re.findall(r"^([a-z][a-z0-9-]+)", listed, re.M)
    jobs = [(m, n, a) for m in models for n, a in COMMANDS.items() if (m, n) not in LEFT_OUT]
    jobs += [("", " ".join(a).replace(" ", "_"), a) for a in ALONE]
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        lines = [line for found in pool.map(lambda job: outputs(binary, *job), jobs) for line in found]
    if "--update" in sys.argv:
        EXPECTED.write_text("\n".join(lines) + "\n")
        print(f"{len(lines)} outputs written to {EXPECTED}")
        return 0
    place = lambda line: tuple(line.split()[:3])
    expected = {place(line): line.split()[3:] for line in EXPECTED.read_text().splitlines()}
    found = {place(line): line.split()[3:] for line in lines}
    changed = {"numbers": 0, "words": 0, "gone": 0, "new": 0}
    for key in sorted(expected.keys() | found.keys()):
        before, after = expected.get(key), found.get(key)
        if before == after:
            continue
        what = "gone" if after is None else "new" if before is None else "numbers" if before[0] != after[0] else "words"
        changed[what] += 1
        if what != "words" or "--words" in sys.argv:
            print(what, *key)
    print(f"{len(found)} outputs;", ", ".join(f"{n} {what}" for what, n in changed.items()), "differ")
    return 1 if changed["numbers"] + changed["gone"] + changed["new"] else 0


if __name__ == "__main__":
    sys.exit(main())
