#!/usr/bin/env python3
"""Every command on models that are wide and deep: none ends by a signal, a panic or without a word.

    cargo bench -p kardan --bench grown -- write target/deep 100000
    python3 tests/deep.py target/release/kardan target/deep [SECONDS]

A command that takes longer than SECONDS (10) is interrupted as by Ctrl-C and must then end; one that takes more than 4 GB counts as refused by the
system. Prints a line for each failure, then counts.
"""
import collections
import pathlib
import resource
import signal
import subprocess
import sys
import tempfile

COMMANDS = ["check", "equations", "linearise", "analyze", "design", "run", "safety", "sweep", "identify", "bench"]
MEMORY = 4 << 30


def limited():
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def outcome(kardan, command, model, folder, seconds):
    """How a command on a model ended, and what it wrote to its error output."""
    arguments = {
        "run": ["--out", "out", "--no-report"],
        "sweep": ["--samples", "2", "--out", "sweep"],
        "identify": ["log.csv"],
        "bench": ["--out", "logs"],
    }.get(command, [])
    process = subprocess.Popen([kardan, command, model, *arguments], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, preexec_fn=limited)
    try:
        _, wrong = process.communicate(timeout=seconds)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGINT)
        try:
            process.communicate(timeout=30)
            return "interrupted", b""
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            return "does not stop", b""
    if b"memory allocation of" in wrong:
        return "out of memory", b""
    if process.returncode < 0 or process.returncode > 2 or b"panicked" in wrong or b"overflowed its stack" in wrong:
        return f"ended with {process.returncode}", wrong
    if process.returncode != 0 and not wrong.strip():
        return "failed without a word", wrong
    return "ended", wrong


def main():
    kardan, models = str(pathlib.Path(sys.argv[1]).resolve()), pathlib.Path(sys.argv[2]).resolve()
    seconds = float(sys.argv[3]) if len(sys.argv) > 3 else 10.0
    counts = collections.Counter()
    for model in sorted(models.glob("*.toml")):
        for command in COMMANDS:
            with tempfile.TemporaryDirectory() as folder:
                pathlib.Path(folder, "log.csv").write_text("t,a.phi,m.tau\n0,0,1\n0.1,0,1\n0.2,0.1,1\n")
                word, wrong = outcome(kardan, command, str(model), folder, seconds)
            counts[word] += 1
            if word not in ("ended", "interrupted"):
                print(f"{model.name} {command}: {word} {wrong[-300:].decode(errors='replace')}", flush=True)
    print(dict(counts))
    sys.exit(any(word not in ("ended", "interrupted", "out of memory") for word in counts))


if __name__ == "__main__":
    main()
