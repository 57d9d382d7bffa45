"""Two commands at once on one file: both write it, both change it, or one reads it while the other replaces it.

No file may be lost or torn, and nothing that a command reports as done may be missing from the result. One of the two may be refused, and then says that
another process has the file. The second command begins after a random part of the time that the first one takes.
"""

import random
import time

from . import readers
from .bench import IMAGE

SIMULATE = "simulate --layout l.toml --scene s.csv --freq 94GHz --bandwidth 8GHz --channels 2 --duration 40s --sefd 3000Jy -o out/w.uvh5 --overwrite --seed"
READER = ["dirty out/w.uvh5 " + IMAGE + " -o out/d.fits", "info out/w.uvh5", "convert out/w.uvh5 out/x.uvfits",
          "corrupt out/w.uvh5 --phase-rms 1rad -o out/c.uvh5",
          "closure out/w.uvh5 -o out/c.csv", "plot out/w.uvh5 -o out/p.png"]
COLUMNS = [f"predict out/w.uvh5 --model s.csv --into {column} -o out/w.uvh5 --overwrite" for column in ("model", "residual")]
CALIBRATE = "applycal out/w.uvh5 g.calh5 -o out/w.uvh5 --overwrite"
CORRUPT = "corrupt v.uvh5 --phase-rms 1rad -o out/w.uvh5 --overwrite --seed"
# What is made first, the first command, the second one, and what must hold afterwards.
KINDS = {
    "two appends": ("convert v.uvh5 out/w.uvh5", ["convert v.uvh5 out/w.uvh5 --append"], ["convert v.uvh5 out/w.uvh5 --append"], "rows"),
    "two columns": ("convert v.uvh5 out/w.uvh5", COLUMNS[:1], COLUMNS[1:], "columns"),
    "a column and calibrated data": ("convert c.uvh5 out/w.uvh5", COLUMNS[:1], [CALIBRATE], "columns"),
    "calibrated data and an append": ("convert c.uvh5 out/w.uvh5", [CALIBRATE], ["convert c.uvh5 out/w.uvh5 --append"], "rows"),
    "two new sets": ("convert v.uvh5 out/w.uvh5", [SIMULATE + " 1"], [SIMULATE + " 2"], "whole"),
    "two first sets": (None, [SIMULATE.replace(" --overwrite", "") + " 1"], [SIMULATE.replace(" --overwrite", "") + " 2"], "whole"),
    "a reader and a new set": ("convert v.uvh5 out/w.uvh5", [SIMULATE + " 3"], READER, "whole"),
    "a reader and a change": ("convert v.uvh5 out/w.uvh5", COLUMNS, READER, "whole"),
    "two cleans": (None, [f"clean v.uvh5 {IMAGE} --niter 50 -o out/k --overwrite"], [f"clean v.uvh5 {IMAGE} --niter 30 -o out/k --overwrite"], "one clean"),
    "two corrupts": (None, [CORRUPT + " 1"], [CORRUPT + " 2"], "one truth"),
    "two runs": ("run c.toml -o out/r", ["run c.toml -o out/r --overwrite"], ["run c.toml -o out/r --overwrite"], "folder"),
    "two studies": (None, ["study u.toml -o out/r"], ["study u.toml -o out/r"], "folder"),
    "two new studies": ("study u.toml -o out/r", ["study u.toml -o out/r --overwrite"], ["study u.toml -o out/r --overwrite"], "folder"),
}
REFUSED = ("another process", "locked", "another command", "exists", "in use", "has changed", "was replaced", "changed while")


def history(bench, file):
    """The lines of the history of a file, and its facts."""
    done = bench.call(["--json", "info", file])
    facts = readers.strict(done.out) if done.code == 0 else None
    return (facts or {}).get("history", []), facts, done


def rows_wrong(bench, done, lines):
    _, facts, said = history(bench, "out/w.uvh5")
    _, one, _ = history(bench, "v.uvh5")
    expected = one["n_blts"] * (1 + sum(d.code == 0 and "--append" in line for d, line in zip(done, lines)))
    return said.err if facts is None else "" if facts["n_blts"] == expected else f"{facts['n_blts']} rows instead of {expected}"


def columns_wrong(bench, done, lines):
    for d, line in zip(done, lines):
        if d.code == 0 and "--into" in line:
            column = line.split("--into ")[1].split()[0]
            said = bench.call(f"dirty out/w.uvh5 --column {column} {IMAGE} -o out/{column}.fits".split())
            if said.code:
                return f"the column {column} is lost: {said.err}"
    lost = [line for d, line in zip(done, lines) if d.code == 0 and "applycal" in line and not any("applycal" in h for h in history(bench, "out/w.uvh5")[0])]
    return f"lost: {lost}" if lost else whole_wrong(bench, done, lines)


def whole_wrong(bench, done, _):
    said = bench.call(f"dirty out/w.uvh5 {IMAGE} -o out/check.fits".split())
    return said.err if said.code else ""


def one_clean_wrong(bench, done, _):
    """All images are of the same CLEAN, that of the command that ended last."""
    niters = {end: [h for h in history(bench, f"out/k-{end}.fits")[0] if "--niter" in h] for end in ("image", "model", "residual")}
    kinds = {"50" if any("--niter 50" in h for h in found) else "30" if found else "none" for found in niters.values()}
    return "" if len(kinds) == 1 and "none" not in kinds else f"images of both commands: {niters}"


def one_truth_wrong(bench, done, _):
    """The gains are those of the data: calibrated with them, the data are the data before the errors."""
    said = bench.call("applycal out/w.uvh5 out/w.calh5 -o out/a.uvh5".split())
    if said.code:
        return said.err
    seeds = {end: [word for h in history(bench, f"out/w.{end}")[0] for word in h.split("--seed ")[1:]] for end in ("uvh5", "calh5")}
    return "" if [s[0] for s in seeds["uvh5"]] == [s[0] for s in seeds["calh5"]] else f"data and gains of two commands: {seeds}"


def folder_wrong(bench, done, _):
    page = bench.out / "r" / "report.html"
    return "" if page.is_file() and b"</html>" in page.read_bytes() and (bench.out / "r" / "metrics.json").is_file() else "the folder is not whole"


CHECKS = {
    "rows": rows_wrong, "columns": columns_wrong, "whole": whole_wrong, "one clean": one_clean_wrong, "one truth": one_truth_wrong, "folder": folder_wrong,
}


def campaign(bench, count, seed):
    times = {}
    for case in bench.cases(count):
        rng = random.Random(f"pairs {seed} {case}")
        name = list(KINDS)[case % len(KINDS)]
        first, ones, others, check = KINDS[name]
        if first:
            bench.whole(first)
        lines = [rng.choice(ones), rng.choice(others)]
        if name not in times:
            begun = time.monotonic()
            bench.call(lines[0].split())
            times[name] = time.monotonic() - begun
            bench.clear()
            if first:
                bench.whole(first)
        one = bench.start(lines[0].split(), "one")
        time.sleep(rng.uniform(0, 1.1) * times[name] * rng.choice((0, 1, 1)))
        two = bench.start(lines[1].split(), "two")
        done = [bench.finish(one), bench.finish(two)]
        faults = [f for d in done for f in d.faults()]
        for d in done:
            if d.code and not any(word in d.err for word in REFUSED):
                faults.append(("message", f"{d.line} is refused by words that do not tell of another process: {d.err.strip()[:300]}"))
        if all(d.code for d in done):
            faults.append(("both", f"both were refused: {done[0].err.strip()[:150]} / {done[1].err.strip()[:150]}"))
        elif text := CHECKS[check](bench, done, lines):
            faults.append(("lost", text.strip()[:300]))
        faults += bench.check_results()
        if bench.left():
            faults.append(("leftover", f"left {bench.left()}"))
        bench.counts["one refused" if any(d.code for d in done) else "both done"] += 1
        for kind, text in faults:
            bench.fail(kind, f"{done[0].line}  &  {done[1].line}", f"({name}) {text}", f"{name} {text[:30]}")
        bench.clear()
        odd = bench.restore()
        if odd:
            bench.fail("input", done[0].line, f"changed or made {odd}")
