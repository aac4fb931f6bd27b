#!/usr/bin/env python3
"""Whether the commands still answer the same: every built-in model and every wrong model of `tests/bad`, through each command.

    tests/frozen.py target/release/kardan            compares with tests/frozen.txt
    tests/frozen.py target/release/kardan --write    writes tests/frozen.txt anew
    tests/frozen.py KARDAN --only run                only lines with that word

One line for each answer: its name, a hash of its numbers and a hash of all of it. A change of words changes the second hash
alone; a change that should not show changes neither. Exit code 1 where numbers differ, 3 where words alone do.
"""

import hashlib
import json
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
EXPECTED = ROOT / "tests" / "frozen.txt"
COMMANDS = [
    ["check", "--json"],
    ["check"],
    ["equations"],
    ["analyze", "--json"],
    ["analyze"],
    ["linearise", "--json"],
    ["design", "--json"],
    ["design"],
]
# The same with files.
WRITING = [
    ["run", "--json", "--force"],
    ["sweep", "--json", "--samples", "24"],
    ["bench", "--json", "--repetitions", "1"],
]


def short(data):
    return hashlib.sha256(data).hexdigest()[:16]


def numbers(value):
    """The numbers of an answer in their order, without names and texts."""
    if isinstance(value, dict):
        for inner in value.values():
            yield from numbers(inner)
    elif isinstance(value, list):
        yield "["
        for inner in value:
            yield from numbers(inner)
        yield "]"
    elif not isinstance(value, str):
        yield repr(value)


def hashes(data):
    """A hash of the numbers of a JSON answer, `-` of other texts, and one of all of it."""
    try:
        parsed = json.loads(data)
    except ValueError:
        return "-", short(data)
    return short(" ".join(numbers(parsed)).encode()), short(data)


def run(kardan, folder, arguments):
    """What a command prints and ends with, without the paths of this machine."""
    done = subprocess.run([kardan, *arguments], cwd=folder, capture_output=True, check=False)
    text = done.stdout + done.stderr
    return done.returncode, text.replace(str(folder).encode(), b"FOLDER")


def built_in(kardan):
    listed = subprocess.run([kardan, "models", "--json"], capture_output=True, check=True).stdout
    return [entry["name"] for entry in json.loads(listed)]


def answers(kardan):
    """Name, hash of numbers and hash of all, of each answer."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for model in built_in(kardan):
            for command in COMMANDS:
                code, text = run(kardan, folder, [command[0], model, *command[1:], "--quiet"])
                yield f"{' '.join(command)} {model} -> {code}", *hashes(text)
            for command in WRITING:
                code, text = run(kardan, folder, [command[0], model, *command[1:], "--quiet", "--out", "out"])
                yield f"{' '.join(command)} {model} -> {code}", *hashes(text)
                for path in sorted((folder / "out").rglob("*")):
                    if path.is_file():
                        data = path.read_bytes()
                        of_numbers = short(data) if path.suffix == ".csv" else hashes(data)[0]
                        yield f"{command[0]} {model} {path.relative_to(folder / 'out')}", of_numbers, short(data)
                        path.unlink()
        for model in sorted((ROOT / "crates/kardan/tests/bad").glob("*.toml")):
            code, text = run(kardan, folder, ["check", str(model), "--quiet"])
            yield f"check bad/{model.name} -> {code}", "-", short(text.replace(str(ROOT).encode(), b"ROOT"))


def main():
    arguments = [argument for argument in sys.argv[1:] if not argument.startswith("--")]
    kardan = str(pathlib.Path(arguments[0]).resolve())
    word = arguments[1] if "--only" in sys.argv else ""
    found = {}
    for name, of_numbers, of_all in answers(kardan):
        if word in name:
            found[name] = (of_numbers, of_all)
    if "--write" in sys.argv:
        EXPECTED.write_text("".join(f"{a} {b} {name}\n" for name, (a, b) in found.items()))
        return 0
    lines = [line.split(" ", 2) for line in EXPECTED.read_text().splitlines()]
    expected = {name: (a, b) for a, b, name in lines if word in name}
    other_numbers = other_words = 0
    for name in sorted(expected.keys() | found.keys()):
        before, now = expected.get(name), found.get(name)
        if before is None or now is None:
            print(f"{'new' if before is None else 'gone'}: {name}")
            other_numbers += 1
        elif before[0] != now[0]:
            print(f"other numbers: {name}")
            other_numbers += 1
        elif before != now:
            print(f"other words: {name}")
            other_words += 1
    print(f"{len(found)} answers: {other_numbers} with other numbers, {other_words} with other words alone")
    return 1 if other_numbers else 3 if other_words else 0


if __name__ == "__main__":
    sys.exit(main())
