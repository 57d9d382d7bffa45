"""Commands that are killed, or ended by a signal, at a random moment. Two classes: `kills` (SIGKILL) and `signals` (SIGINT, SIGTERM, SIGHUP).

After it this must hold, with old outputs there (`--overwrite`) and without, and for changes in place:

- Each output is the old one, the new one as a whole, or (where there was no old one) none. A mixture of old and new bytes in one file is an error in any case.
- Inputs are as they were.
- A signal leaves nothing else, and either all outputs of a command are new or none is.
- Between SIGKILL and the names of several files lies a moment that no file system closes, so a SIGKILL may leave some outputs new and others old. Such a
  case is counted. A SIGKILL leaves at most the hidden folders `.NAME.RANDOM.partial` and `.NAME.lock`. The same command then runs to its end, tells which
  folders it removes, and leaves none.

A new file is whole if its bytes are those of an undisturbed run. Where two such runs differ (a log with durations), its size and its end are judged, and
`info` must read it.
"""

import hashlib
import os
import random
import re
import shutil
import signal
import time

from . import readers
from .writers import BAND, WRITERS, Writer

PARTIAL = re.compile(r"^\..+\.[0-9A-Za-z]{12}\.partial$")
# Larger outputs, which take longer to write, and changes in place of `w.uvh5`.
MORE = [
    Writer(f"simulate --layout l.toml --scene s.csv {BAND} --channels 64 --duration 600s -o @", ".uvh5"),
    Writer("clean v.uvh5 --size 256 --cell 0.2mrad --niter 20 -o @", made=["-psf.fits", "-dirty.fits", "-model.fits", "-residual.fits", "-image.fits"]),
    Writer("closure e.uvh5 --all --channels each -o @.csv --plot @.png", made=[".csv", ".png"]),
    Writer("layout convert e.toml -o @", ".cfg"),
]
EDITS = [
    ("v.uvh5", "predict out/o.uvh5 --model s.csv --into model -o out/o.uvh5"), ("c.uvh5", "applycal out/o.uvh5 g.calh5 -o out/o.uvh5"),
    ("v.uvh5", "convert v.uvh5 out/o.uvh5 --append"), ("v.uvh5", "predict out/o.uvh5 --model m-model.fits --into residual -o out/o.uvh5"),
]
CASES = [(writer.line, None, writer.words("out/o")) for writer in WRITERS + MORE] + [(line, first, line.split()) for first, line in EDITS]


def digest(path):
    """One hash for the bytes of a file, or for the names and bytes in a folder. None where there is neither."""
    if path.is_dir():
        parts = [(str(p.relative_to(path)), digest(p)) for p in sorted(path.rglob("*")) if p.is_file()]
        return hashlib.sha256(repr(parts).encode()).hexdigest()
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.exists() else None


class Reference:
    """What an undisturbed run of a line takes and makes: the digest of each output, or its size where two runs differ. The line is in the history of the
    outputs, so a reference holds for exactly one line."""

    def __init__(self, bench, words, first):
        seen = []
        for _ in range(2):
            bench.clear()
            prepare(bench, first)
            begun = time.monotonic()
            done = bench.finish(bench.start(words, quiet=False))
            if done.code:
                raise SystemExit(f"{done.line}: {done.err}")
            self.seconds = time.monotonic() - begun
            seen.append({p.name: digest(p) for p in bench.out.iterdir()})
        self.digests = {name: value if seen[1].get(name) == value else None for name, value in seen[0].items()}
        self.sizes = {p.name: p.stat().st_size for p in bench.out.iterdir()}
        bench.clear()

    def whole(self, bench, path):
        if self.digests[path.name]:
            return digest(path) == self.digests[path.name]
        if path.is_dir():
            page = path / "report.html"
            return path.joinpath(".cittert-files").is_file() and (not page.exists() or b"</html>" in page.read_bytes())
        if path.suffix == ".jsonl":
            return path.read_bytes().endswith(b"\n")
        same = abs(path.stat().st_size - self.sizes[path.name]) < 4096
        return same and not readers.fault(path, lambda p: bench.call(["--json", "info", str(p)]))


def prepare(bench, first):
    if first:
        shutil.copy(bench.folder / first, bench.out / "o.uvh5")


def mark_old(bench, names):
    """Old outputs that cannot be taken for new ones. In a folder that this program has made, one of its files is marked."""
    for name in names:
        path = bench.out / name
        path = min(p for p in path.iterdir() if p.name == "report.html" or p.suffix in (".1", ".png")) if path.is_dir() else path
        path.write_bytes(b"old " + name.encode())


class References:
    """The references of all lines so far."""

    def __init__(self, bench):
        self.bench, self.known = bench, {}

    def of(self, words, first):
        key = (*words, first)
        if key not in self.known:
            self.known[key] = Reference(self.bench, words, first)
        return self.known[key]


def interrupt(bench, case, references, which, rng):
    """Interrupt the command of a case once. Returns its line and what is wrong."""
    line, first, words = case
    old = bool(first) or rng.random() < 0.5
    words = ["--threads", "1", *words]
    over = words if "--append" in words else [*words, "--overwrite"]
    words = over if old else words
    reference, next_reference = references.of(words, first), references.of(over, first)
    if first:
        prepare(bench, first)
    elif old:
        bench.whole(" ".join(words))
        mark_old(bench, reference.digests)
    before = {name: digest(bench.out / name) for name in reference.digests}
    process = bench.start(words, quiet=False)
    # Folders and locks are made first, and files are written last.
    time.sleep(rng.choice((rng.uniform(0, 1.05), rng.uniform(0.5, 1.05), rng.uniform(0, 0.15))) * reference.seconds)
    # `send_signal` would take the exit code of a command that has ended.
    os.kill(process.pid, which)
    done = bench.finish(process)
    wrong, states = [] if done.code in (0, -which) else [("exit", f"exit code {done.code} after {which.name}: {done.err.strip()[:200]}")], {}
    for name in reference.digests:
        path = bench.out / name
        now = digest(path)
        states[name] = "old" if now == before[name] else "lost" if now is None else "new" if reference.whole(bench, path) else "torn"
        if states[name] == "torn" and path.is_dir() and (path.joinpath("journal.jsonl").is_file() or (words[2] == "man" and which == signal.SIGKILL)):
            # A study goes on where it was killed, so its folder is not exchanged but grows. Manual pages go one by one into a folder that may be of others.
            states[name] = "begun"
    if {"lost", "torn"} & set(states.values()):
        wrong.append(("lost", f"after {which.name}: {states}"))
    mixed = len(set(states.values())) > 1
    if mixed and which != signal.SIGKILL:
        wrong.append(("mixed", f"some outputs are new and some are old after {which.name}: {states}"))
    left = [p.name for p in bench.out.iterdir() if p.name not in reference.digests]
    partial = leftovers(bench)
    strange = [name for name in left if not PARTIAL.match(name) and not (name.startswith(".") and name.endswith(".lock"))]
    if strange or ((left or partial) and which != signal.SIGKILL):
        wrong.append(("leftover", f"left after {which.name}: {left + partial}"))
    bench.counts["ended before"] += done.code == 0
    bench.counts["some new, some old"] += mixed
    bench.counts["with leftovers"] += bool(left or partial)
    bench.counts["old outputs"] += set(states.values()) == {"old"}
    bench.counts["new outputs"] += set(states.values()) == {"new"}
    wrong += next_call(bench, over, partial, next_reference, first)
    return done.line, wrong


def leftovers(bench):
    """Hidden folders of unfinished outputs, also inside of folders of results. What lies in a hidden folder goes with it."""
    found = [p for p in bench.out.rglob("*") if PARTIAL.match(p.name)]
    return [p.name for p in found if not any(PARTIAL.match(parent.name) for parent in p.relative_to(bench.out).parents)]


def next_call(bench, words, partial, reference, first):
    """Make the call again that was interrupted. Returns what is wrong: it must work, tell what it removes, and leave nothing."""
    wrong = []
    again = bench.finish(bench.start(words, quiet=False))
    if again.code:
        wrong.append(("blocked", f"the next call fails: {again.err.strip()[:300]}"))
    untold = [name for name in partial if name not in again.err]
    if untold:
        wrong.append(("untold", f"the next call does not tell of {untold}"))
    after = [p.name for p in bench.out.iterdir() if p.name not in reference.digests] + leftovers(bench)
    if after:
        wrong.append(("leftover", f"left after the next call: {after}"))
    if not first:
        torn = [name for name in reference.digests if not (bench.out / name).exists() or not reference.whole(bench, bench.out / name)]
        if torn:
            wrong.append(("torn", f"not whole after the next call: {torn}"))
    return wrong


def campaign(bench, count, seed, signals, name):
    references = References(bench)
    for k in bench.cases(count):
        rng = random.Random(f"{name} {seed} {k}")
        case = CASES[k % len(CASES)]
        line, wrong = interrupt(bench, case, references, rng.choice(signals), rng)
        for kind, text in wrong:
            bench.fail(kind, line, text, f"{case[0]} {kind}")
        bench.clear()
        odd = bench.restore()
        if odd:
            bench.fail("input", line, f"changed or made {odd}")


def kills(bench, count, seed):
    campaign(bench, count, seed, [signal.SIGKILL], "kills")


def signals(bench, count, seed):
    campaign(bench, count, seed, [signal.SIGINT, signal.SIGTERM, signal.SIGHUP], "signals")
