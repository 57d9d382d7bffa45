#!/usr/bin/env python3
"""Kill commands at random moments, and look at what is left.

    cargo build && tests/trials/kills.py [--kills 60] [--seed 1] [--program target/debug/cittert]

Each command writes over results of an earlier call of itself. It is run once to its end to measure its time, and then killed after a random part of that
time, by SIGKILL, SIGTERM or SIGINT in turn. After each kill this must hold:

- Each output is the old one or the new one, as a whole; all outputs of a command that has not ended are the old ones. Between SIGKILL and the
  names of several files lies a moment that no file system closes, so a SIGKILL may leave some outputs new and others old. Such a case is counted and
  printed, and a mixture of old and new bytes in one file is an error in any case.
- Inputs are as they were.
- SIGTERM and SIGINT leave nothing else. SIGKILL leaves at most the hidden folders `.NAME.RANDOM.partial` and `.NAME.lock`, and the same command
  then runs to its end and removes the folders of its outputs.

A new output is whole if it has the size of the output of an undisturbed run and `info` reads it, where it is of a kind that `info` knows. Only Python
and the program are needed. The exit code is 1 where something was lost.
"""

import argparse
import hashlib
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

LEFTOVER = re.compile(r"^\..+\.[0-9A-Za-z]{12}\.partial$|^\..+\.lock$")

# Name, command line, outputs: files, a folder, or all files that begin so.
CASES = [
    ("simulate", "simulate --layout mm-u --scene s.csv --freq 94GHz --bandwidth 8GHz --channels 16 --duration 200s --integration 10s -o big.uvh5", ["big.uvh5"]),
    ("corrupt", "corrupt v.uvh5 --phase-rms 1rad -o c.uvh5 --gains c.calh5", ["c.uvh5", "c.calh5"]),
    ("convert", "convert v.uvh5 w.uvfits", ["w.uvfits"]),
    ("predict", "predict v.uvh5 --model s.csv --residual -o p.uvh5", ["p.uvh5"]),
    ("clean", "clean v.uvh5 --size 256 --cell 1mrad --niter 500 -o k", ["k-*"]),
    ("selfcal", "selfcal c0.uvh5 --size 128 --cell 1mrad --rounds 2 --niter 100 --force -o x", ["x*"]),
    ("closure", "closure v.uvh5 -o cl.csv --plot cl.png", ["cl.csv", "cl.png"]),
    ("run", "run c.toml -o out", ["out"]),
]

CONFIG = """
title = "a small run"
layout = { name = "mm-y" }
scene = { file = "s.csv" }
[simulate]
freq = "94GHz"
bandwidth = "4GHz"
channels = 4
[image]
size = 64
cell = "1mrad"
[[clean]]
niter = 100
"""


def digest(path):
    """One hash for the bytes of a file, or for the names and bytes in a folder."""
    if path.is_dir():
        parts = [(str(p.relative_to(path)), digest(p)) for p in sorted(path.rglob("*")) if p.is_file()]
        return hashlib.sha256(repr(parts).encode()).hexdigest()
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.exists() else None


class Trial:
    def __init__(self, program, folder):
        self.program, self.folder = program, Path(folder)

    def command(self, line, **more):
        words = [self.program, "-q", *line.split(), "--overwrite"]
        return subprocess.Popen(words, cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, **more)

    def whole(self, line):
        process = self.command(line)
        _, err = process.communicate()
        if process.returncode != 0:
            sys.exit(f"{line}: {err.decode()}")

    def prepare(self):
        (self.folder / "s.csv").write_text("l_rad,m_rad,flux_jy\n0.01,0.005,1.0\n")
        (self.folder / "c.toml").write_text(CONFIG)
        self.whole("simulate --layout mm-y --scene s.csv --freq 94GHz --bandwidth 8GHz --channels 16 --duration 60s --integration 10s -o v.uvh5")
        self.whole("corrupt v.uvh5 --phase-rms 0.5rad -o c0.uvh5")

    def is_whole(self, path, size):
        if path.is_dir():
            page = path / "report.html"
            return page.is_file() and b"</html>" in page.read_bytes() and (path / ".cittert-files").is_file()
        if path.suffix == ".jsonl":
            # The log of rounds holds durations.
            return path.is_file() and path.read_bytes().endswith(b"\n")
        if not path.is_file() or path.stat().st_size != size:
            return False
        known = path.suffix in (".uvh5", ".uvfits", ".fits", ".calh5")
        return not known or subprocess.run([self.program, "info", path], cwd=self.folder, capture_output=True).returncode == 0

    def leftovers(self):
        return sorted(p.name for p in self.folder.iterdir() if p.name.startswith("."))


def kill_once(trial, case, seconds, which, rng):
    """Kill the command of a case once. Returns what is wrong, and how far the command had come."""
    name, line, patterns = case
    outputs = sorted(p.name for pattern in patterns for p in trial.folder.glob(pattern))
    known = {p.name: digest(p) for p in trial.folder.iterdir()}
    sizes = {out: (trial.folder / out).stat().st_size for out in outputs}
    # Old outputs are marked, so that they differ from new ones.
    for out in outputs:
        path = trial.folder / out
        if path.is_dir():
            (path / "report.html").write_text("old")
        else:
            path.write_bytes(b"old " + name.encode())
    old = {out: digest(trial.folder / out) for out in outputs}
    process = trial.command(line)
    time.sleep(rng.uniform(0.0, 1.05) * seconds)
    process.send_signal(which)
    process.communicate()
    done = process.returncode == 0
    wrong, states = [], {}
    for out in outputs:
        path = trial.folder / out
        states[out] = "old" if digest(path) == old[out] else "new" if trial.is_whole(path, sizes[out]) else "torn"
    if "torn" in states.values():
        wrong.append(f"a torn or lost output: {states}")
    kinds = set(states.values())
    mixed = len(kinds) > 1
    if mixed and which != signal.SIGKILL:
        wrong.append(f"some outputs are new and some are old: {states}")
    for path, was in known.items():
        if path not in outputs and not path.startswith(".") and digest(trial.folder / path) != was:
            wrong.append(f"{path} has changed")
    left = trial.leftovers()
    strange = [n for n in left if not LEFTOVER.match(n)] + [p.name for p in trial.folder.iterdir() if not p.name.startswith(".") and p.name not in known]
    if strange:
        wrong.append(f"strange files are left: {strange}")
    if left and which != signal.SIGKILL:
        wrong.append(f"leftovers after {which.name}: {left}")
    trial.whole(line)
    after = trial.leftovers()
    if after:
        wrong.append(f"leftovers after a whole run: {after}")
    for out in outputs:
        if not trial.is_whole(trial.folder / out, sizes[out]):
            wrong.append(f"{out}: not whole after a whole run")
    return wrong, {"done": done, "mixed": mixed, "left": len(left), "states": kinds}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--program", default="target/debug/cittert")
    args = parser.parse_args()
    rng = random.Random(args.seed)
    folder = tempfile.mkdtemp(prefix="kills-")
    trial = Trial(str(Path(args.program).resolve()), folder)
    trial.prepare()
    times = {}
    for name, line, _ in CASES:
        trial.whole(line)
        begun = time.monotonic()
        trial.whole(line)
        times[name] = time.monotonic() - begun
        print(f"{name}: {times[name]:.2f} s")
    counts = {"kills": 0, "ended before the kill": 0, "old outputs": 0, "new outputs": 0, "some of each": 0, "kills with leftovers": 0}
    errors = 0
    signals = [signal.SIGKILL, signal.SIGTERM, signal.SIGINT]
    for k in range(args.kills):
        case, which = CASES[k % len(CASES)], signals[rng.randrange(3)]
        wrong, facts = kill_once(trial, case, times[case[0]], which, rng)
        counts["kills"] += 1
        counts["ended before the kill"] += facts["done"]
        counts["some of each"] += facts["mixed"]
        counts["old outputs"] += facts["states"] == {"old"}
        counts["new outputs"] += facts["states"] == {"new"}
        counts["kills with leftovers"] += facts["left"] > 0
        for text in wrong:
            errors += 1
            print(f"{case[0]} after {which.name}: {text}")
    shutil.rmtree(folder)
    print(", ".join(f"{n} {what}" for what, n in counts.items()) + f"; {errors} errors")
    sys.exit(1 if errors else 0)


if __name__ == "__main__":
    main()
