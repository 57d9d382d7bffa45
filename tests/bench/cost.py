"""Fits the cost model of `cittert --dry-run` to whole runs, and checks it with runs that are not in the fit.

    python3 tests/bench/cost.py fit PROGRAM      measure the cases of the fit, write its file in src/cost/machines
    python3 tests/bench/cost.py check PROGRAM    measure other cases, print the table of docs/algorithms/cost.md
    python3 tests/bench/cost.py check PROGRAM --speeds FILE

Cases are drawn from a seed: arrays, tracks, channels, sizes of images, commands, threads. The seeds of the two differ. Only the standard library of
Python is needed. Files lie in a temporary folder. Times are wall times: the machine must be quiet.
"""

import argparse, datetime, json, math, os, random, re, statistics, subprocess, sys, tempfile, time
from pathlib import Path

from machines import TERMS, own_file, processor, read_old

HERE = Path(__file__).resolve().parent
PAGE = HERE.parent.parent / "docs/algorithms/cost.md"
FIT_SEED, CHECK_SEED = 1, 20_261_127


def run(words, cwd):
    """Wall seconds, largest resident size in bytes, JSON and stderr of a run."""
    err = tempfile.TemporaryFile("w+")
    out = tempfile.TemporaryFile("w+")
    start = time.perf_counter()
    process = subprocess.Popen([str(w) for w in words], cwd=cwd, stdout=out, stderr=err)
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - start
    for f in (out, err):
        f.seek(0)
    told, said = out.read(), err.read()
    # The constraints of maximum entropy may not be met within the evaluations that are allowed: code 1 with results.
    if os.waitstatus_to_exitcode(status) != 0 and not told.startswith("{"):
        sys.exit(f"{' '.join(map(str, words))}\n{said}")
    return seconds, usage.ru_maxrss * 1024, json.loads(told), said


def phases(said):
    """Seconds of each phase, in order of their first appearance."""
    sums = {}
    for name, s in re.findall(r"^([a-z][a-z ]*): (\d+\.\d+) s", said, re.M):
        sums[name] = sums.get(name, 0.0) + float(s)
    return sums


class Sets:
    """Visibility sets of random arrays, made when they are first needed."""

    def __init__(self, program, folder):
        self.program, self.folder, self.made = program, folder, {}

    def words(self, name, of):
        """The command that simulates a set."""
        layout = self.folder / f"{name}.toml"
        if not layout.exists():
            draw = random.Random(of["seed"])
            lines = [f'name = "random {name}"', 'frame = "enu"', "[site]", "latitude_deg = 34.0", "longitude_deg = -107.6", "altitude_m = 2100.0"]
            for k in range(of["antennas"]):
                r, angle = 0.5 * of["aperture"] * math.sqrt(draw.random()), draw.uniform(0, 2 * math.pi)
                lines += ["[[antenna]]", f'name = "A{k}"', f"position_m = [{r * math.cos(angle):.3f}, {r * math.sin(angle):.3f}, 0.0]", "diameter_m = 12.0"]
            layout.write_text("\n".join(lines) + "\n")
        scene = self.folder / f"scene{of['sources']}.csv"
        if not scene.exists():
            draw = random.Random(of["sources"])
            lines = [f"{draw.gauss(0, 3e-4):.8f},{draw.gauss(0, 3e-4):.8f},{draw.expovariate(1):.6f}" for _ in range(of["sources"])]
            scene.write_text("l_rad,m_rad,flux_jy\n" + "\n".join(lines) + "\n")
        words = [self.program, "simulate", "--layout", layout, "--scene", scene, "--freq", "1.4GHz", "--bandwidth", "64MHz"]
        words += ["--channels", of["channels"], "--phase-center", "10h00m00s,+30d00m00s", "--hour-angle=-3h,3h"]
        return [*words, "--integration", f"{21600 / of['times']:.4f}s", "--pols", of["pols"], "--noise", "--sefd", "400Jy"]

    def path(self, name, all_sets):
        name, _, kind = name.partition(".")
        of = all_sets[name]
        if kind:
            other = self.folder / f"{name}.{kind}"
            if not other.exists():
                run([self.program, "convert", self.path(name, all_sets), other, "--json"], self.folder)
            return other
        path = self.folder / f"{name}.uvh5"
        if name not in self.made:
            if not path.exists():
                run([*self.words(name, of), "--json", "-o", path], self.folder)
            self.made[name] = path
        return path


def sets(draw, prefix, n):
    """Random sets of a tenth of a million to thirty million visibilities."""
    out = {}
    for k in range(n):
        antennas, channels = draw.choice([24, 32, 48, 64]), draw.choice([1, 4, 16, 64])
        wanted = 10 ** draw.uniform(5.0, 7.2)
        pairs = antennas * (antennas - 1) // 2
        times = max(2, min(900, round(wanted / pairs / channels)))
        pols = draw.choice(["I", "XX,YY"])
        sources, aperture = draw.choice([20, 100]), draw.choice([1000, 4000, 12000])
        out[f"{prefix}{k}"] = dict(antennas=antennas, channels=channels, times=times, pols=pols, sources=sources, aperture=aperture, seed=k)
    return out


def image_words(draw, largest):
    side = draw.choice([n for n in (256, 400, 512, 768, 1024, 1500, 2048, 3072) if n <= largest])
    words = ["--size", side, "--weighting", draw.choice(["natural", "uniform", "briggs"])]
    return words


def cases(seed, prefix, counts):
    """(name, set, words) of random runs. `counts` says how many of each command."""
    draw = random.Random(seed)
    all_sets = sets(draw, prefix, 10 if prefix == "f" else 6)
    names = list(all_sets)
    largest = max(names, key=lambda n: all_sets[n]["antennas"] ** 2 * all_sets[n]["channels"] * all_sets[n]["times"])
    out = []
    for command, n in counts.items():
        for k in range(n):
            name = draw.choice(names)
            threads = 1 + (k % 2)
            words = ["--threads", threads, command]
            if command in ("dirty", "beam", "grid"):
                words += image_words(draw, 3072 if command != "grid" else 2048)
                if command == "dirty" and k % 4 == 3:
                    # A set that does not stay in memory, or another format.
                    words, name = (words + ["--memory", "512MB"], largest) if k % 8 == 3 else (words, name + ".uvfits")
            elif command == "clean":
                words += image_words(draw, 2048) + ["--algorithm", draw.choice(["clark", "clark", "clark", "hogbom", "multiscale"])]
                words += ["--niter", draw.choice([300, 1000, 3000, 10000]), "--nsigma", "0", "--startmod", draw.choice(["auto", "never"])]
            elif command == "mem":
                words += image_words(draw, 768) + ["--niter", draw.choice([8, 12, 16])]
            out.append((f"{prefix}-{command}-{k}", name, words))
    return all_sets, out


def shortest(row, seconds, peak, told, said):
    """Keep the shortest time of a run and of each of its phases: other programs can only make them longer."""
    least = lambda old, new: {k: min(v, old.get(k, v)) for k, v in new.items()}
    row["phases"] = least(row.get("phases", {}), phases(said))
    row["bytes"] = max(row.get("bytes", 0), peak)
    row["seconds"] = min(row.get("seconds", math.inf), seconds)
    if "seconds" in told:
        told["seconds"] = least(row.get("told", {}).get("seconds", {}), told["seconds"])
    row["told"] = told


def measured(program, folder, all_sets, listed, turns=1, kept=None, until=math.inf, speeds=None, rehearse=True):
    """Rows of runs. Those of the file `kept` are not measured again, and no run begins after `until` seconds. A fit needs no rehearsals."""
    made = Sets(program, folder)
    rows = json.loads(kept.read_text()) if kept and kept.exists() else []
    have, begun = {r["label"] for r in rows}, time.perf_counter()
    for label, name, words in listed:
        if label in have:
            continue
        if time.perf_counter() - begun > until:
            break
        command = words[2]
        if command == "simulate":
            call = [program, *words[:2], *made.words(name, all_sets[name])[1:]]
        else:
            call = [program, *words[:3], made.path(name, all_sets), *words[3:]]
        for old in folder.glob("out*"):
            old.unlink()
        call = [*call, "-o", folder / ("out.uvh5" if command in ("simulate", "predict") else "out.fits" if command in ("dirty", "beam") else "out.h5" if command == "grid" else "out")]
        if command == "predict":
            call += ["--model", folder / f"scene{all_sets[name]['sources']}.csv"]
        options = [*(["--speeds", speeds.resolve()] if speeds else []), *([] if rehearse else ["--rehearse", "0s"])]
        forecast = run([*call, "--dry-run", "--json", *options], folder)[2]
        if any(folder.glob("out*")):
            sys.exit(f"{label}: the dry run has written something")
        row = dict(label=label, threads=words[1], command=command, forecast=forecast, words=" ".join(str(w) for w in words[2:]))
        for _ in range(turns):
            for old in folder.glob("out*"):
                old.unlink()
            shortest(row, *run([*call, "-v", "--json"], folder))
        seconds, peak = row["seconds"], row["bytes"]
        rows.append(row)
        f = forecast
        if kept:
            kept.write_text(json.dumps(rows))
        print(f"{label:16} {seconds:8.3f} s ({f['seconds'] / seconds:5.2f})  {peak / 1e6:8.1f} MB ({f['peak_bytes'] / peak:5.2f})  {rows[-1]['words']}", flush=True)
    return rows


# Phases are told in hundredths of a second: errors of shorter times are relative to this.
SHORT = 0.05


def nnls(rows, columns):
    """Numbers of 0 or more that minimise the squared errors of sums: rows are (counts by column, measured, what errors are relative to)."""
    a = [[counts.get(c, 0.0) / of for c in columns] for counts, _, of in rows]
    wanted = [y / of for _, y, of in rows]
    scale = [math.sqrt(sum(r[j] ** 2 for r in a)) or 1.0 for j in range(len(columns))]
    a = [[v / s for v, s in zip(r, scale)] for r in a]
    n = len(columns)
    gram = [[sum(r[i] * r[j] for r in a) for j in range(n)] for i in range(n)]
    right = [sum(r[i] * y for r, y in zip(a, wanted)) for i in range(n)]
    # A little damping keeps operations that always come together from taking turns.
    for i in range(n):
        gram[i][i] += 1e-6
    x = [0.0] * n
    for _ in range(20_000):
        moved = 0.0
        for i in range(n):
            if gram[i][i] <= 1e-6:
                continue
            new = max(0.0, x[i] + (right[i] - sum(gram[i][j] * x[j] for j in range(n))) / gram[i][i])
            moved = max(moved, abs(new - x[i]))
            x[i] = new
        if moved < 1e-12:
            break
    return {c: v / s for c, v, s in zip(columns, x, scale)}


def all_terms():
    return re.findall(r'^    \w+ = "([a-z0-9.-]+)", \w+;', TERMS.read_text(), re.M)


def work_of(row, wanted, stages=None):
    """Counts of the terms of these groups in a forecast."""
    sums = {}
    for s in row["forecast"]["stages"]:
        if stages is None or s["stage"] in stages:
            for term, n in s["work"].items():
                if term.split(".")[0] in wanted:
                    sums[term] = sums.get(term, 0.0) + n
    return sums


def fit(rows, gauges):
    """Fit group after group: each has its own phases; what no phase covers is fitted to the rest of the whole time."""
    old = read_old(gauges)
    seconds, serial = {}, dict(old["serial"])

    def group(names, samples):
        """samples: (row, counts, measured), and what errors are relative to where that is not what was measured. Fits seconds on one thread, then the part
        that a second thread does not shorten."""
        samples = [(r, c, y, max(SHORT, *whole, y)) for r, c, y, *whole in samples if y > 0 and c]
        columns = sorted({t for _, c, _, _ in samples for t in c})
        if not samples:
            return
        best = None
        for step in range(0, 21):
            s = step / 20
            part = {1: 1.0, 2: s + (1 - s) / 2}
            scaled = [({t: n * part[r["threads"]] for t, n in c.items()}, y, of) for r, c, y, of in samples]
            x = nnls(scaled, columns)
            error = sum(((sum(x[t] * n for t, n in c.items()) - y) / of) ** 2 for c, y, of in scaled)
            if best is None or error < best[0]:
                best = (error, s, x)
        error, s, x = best
        print(f"{'/'.join(names):28} rms {math.sqrt(error / len(samples)):.3f} over {len(samples)} samples, serial {s:.2f}")
        seconds.update(x)
        for name in names:
            serial[name] = s

    def phase(row, *names):
        return sum(row["phases"].get(n, 0.0) for n in names)

    imaging = [r for r in rows if r["command"] in ("dirty", "beam", "clean", "mem", "grid")]
    # Phases and seconds are told of the first image only.
    once = readers = imaging
    group(["read"], [(r, work_of(r, ["read"], ["read"]), phase(r, "reading")) for r in readers])
    group(["weigh"], [(r, {t: n for t, n in work_of(r, ["weigh"], ["weights"]).items() if t != "weigh.value"}, phase(r, "weights")) for r in readers])
    passes = ["pass", "to-image", "again"]
    there = [(r, work_of(r, passes, ["beam", "image"]), phase(r, "beam", "gridding")) for r in once if r["command"] in ("dirty", "beam")]
    there += [(r, work_of(r, passes, ["beam", "dirty image"]), phase(r, "beam", "gridding")) for r in once if r["command"] == "clean"]
    group(passes, there)
    # Major cycles are fitted by their real number.
    back = []
    for r in once:
        # The models of multiscale CLEAN are drawn with its scales, which takes as long as the passes.
        if r["command"] == "clean" and "multiscale" not in r["words"]:
            assumed, real = cycles(r), r["told"]["major_cycles"]
            counts = work_of(r, ["pass", "to-image", "predict", "from-image"], ["major cycles"])
            counts = {t: n * real / assumed for t, n in counts.items()}
            spent = sum(n * seconds.get(t, 0) * (serial["pass"] + (1 - serial["pass"]) / r["threads"]) for t, n in counts.items() if t in seconds)
            left = r["told"]["seconds"].get("major", 0.0) - spent
            back.append((r, {t: n for t, n in counts.items() if t not in seconds}, max(left, 0.2 * r["told"]["seconds"].get("major", 0.0))))
    group(["predict", "from-image"], back)
    minors = []
    for r in once:
        if r["command"] == "clean":
            # The rounds of multiscale CLEAN do not depend on the cycles.
            real = 1.0 if "multiscale" in r["words"] else r["told"]["major_cycles"] / cycles(r)
            counts = work_of(r, ["minor", "convolve"], ["minor cycles"])
            counts = {t: n * (real if t in ("minor.pixel", "convolve.log") else 1.0) for t, n in counts.items()}
            minors.append((r, counts, r["told"]["seconds"].get("minor", 0.0)))
    group(["minor", "convolve"], minors)
    group(["cells"], [(r, {t: n for t, n in work_of(r, ["cells"]).items() if t == "cells.value"}, phase(r, "gridding")) for r in once if r["command"] == "grid"])

    def known(row, skip=()):
        """Seconds that the fitted terms explain, with the real number of cycles."""
        total = 0.0
        for s in row["forecast"]["stages"]:
            for t, n in s["work"].items():
                if t in seconds and t not in skip:
                    g = serial.get(t.split(".")[0], 1.0)
                    total += n * seconds[t] * (g + (1 - g) / row["threads"])
        return total

    # The solver of maximum entropy, beside its passes.
    solvers = []
    for r in once:
        if r["command"] == "mem":
            real = r["told"]["evaluations"] / evaluations(r)
            spent = sum_of(r, seconds, serial, ["passes"]) * real
            # What is known of the solver so far are its convolutions.
            spent += sum_of(r, {"convolve.log": seconds["convolve.log"]}, serial, ["solver"]) * r["told"]["convolutions"] / convolutions(r)
            solve = r["told"]["seconds"]["solve"]
            solvers.append((r, work_of(r, ["entropy"]), max(solve - spent, 0.02 * solve), solve))
    group(["entropy"], solvers)
    last = lambda r: sum_of(r, seconds, serial, ["last evaluation"])
    maps = [(r, work_of(r, ["map"], ["uncertainty"]), r["told"]["seconds"]["uncertainty"] - last(r)) for r in once if r["command"] == "mem"]
    group(["map"], maps)
    group(["statistics"], [(r, work_of(r, ["statistics"], ["statistics"]), r["told"]["seconds"]["statistics"]) for r in once if r["command"] == "mem"])
    # What is left of the whole times.
    rest = []
    single = [r for r in imaging if "second image" not in [s["stage"] for s in r["forecast"]["stages"]]]
    for r in single:
        counts = {}
        for s in r["forecast"]["stages"]:
            for t, n in s["work"].items():
                if t in ("start.command", "weigh.value", "image.pixel", "image.write", "judge.value", "cells.write"):
                    counts[t] = counts.get(t, 0.0) + n
        spent = real_known(r, known, seconds, serial)
        rest.append((r, counts, r["seconds"] - spent))
    weighed = [(r, c, y) for r, c, y in rest if y > 0]
    left_over(weighed, seconds, serial)
    made = []
    for r in rows:
        if r["command"] in ("simulate", "predict"):
            counts = work_of(r, ["simulate", "write"])
            made.append((r, counts, max(r["seconds"] - known(r), 0.1 * r["seconds"])))
    group(["simulate", "write"], made)
    typical = dict(old["typical"])
    points = [(math.log(max(1.0, r["told"]["iterations"] * 0.1)), r["told"]["major_cycles"]) for r in once if r["command"] == "clean"]
    if len(points) > 3:
        n = len(points)
        mx, my = sum(x for x, _ in points) / n, sum(y for _, y in points) / n
        slope = sum((x - mx) * (y - my) for x, y in points) / max(1e-9, sum((x - mx) ** 2 for x, _ in points))
        first = my - slope * mx
        if slope < 0 or first < 0:
            # A line through no cycles for no components.
            first, slope = 0.0, sum(x * y for x, y in points) / sum(x * x for x, _ in points)
        typical["clean.cycles"], typical["clean.cycles-per-log"] = first, slope
    # Measurement Sets are read only by programs that are built with casacore.
    seconds.setdefault("read.ms", seconds.get("read.uvfits", 0.0))
    for t in all_terms():
        seconds.setdefault(t, old["seconds"].get(t, 0.0))
    # The first stage holds nothing but the program.
    base = sorted(r["bytes"] - (r["forecast"]["peak_bytes"] - r["forecast"]["stages"][0]["bytes"]) for r in rows)
    start = statistics.median(r["forecast"]["start_bytes"] for r in rows)
    return dict(seconds=seconds, serial=serial, typical=typical, base=max(1e6, base[len(base) // 2]), start=start, gauges=gauges)


def cycles(row):
    for text in row["forecast"]["assumptions"]:
        if m := re.match(r"(\d+\.\d+) major cycles", text):
            return float(m.group(1))
    return 1


def evaluations(row):
    for text in row["forecast"]["assumptions"]:
        if m := re.match(r"([\d.]+) evaluations", text):
            return float(m.group(1))
    return 1


def convolutions(row):
    for text in row["forecast"]["assumptions"]:
        if m := re.search(r"(\d+) convolutions", text):
            return int(m.group(1))
    return 1


def sum_of(row, seconds, serial, stages):
    total = 0.0
    for s in row["forecast"]["stages"]:
        if s["stage"] in stages:
            for t, n in s["work"].items():
                g = serial.get(t.split(".")[0], 1.0)
                total += n * seconds.get(t, 0.0) * (g + (1 - g) / row["threads"])
    return total


def real_known(row, known, seconds, serial):
    """The explained seconds, where those of the solver and the cycles are the measured ones."""
    total = known(row)
    told = row["told"].get("seconds", {})
    if row["command"] == "clean":
        total += told.get("major", 0.0) + told.get("minor", 0.0) - sum_of(row, seconds, serial, ["major cycles", "minor cycles"])
    if row["command"] == "mem":
        total += told.get("solve", 0.0) - sum_of(row, seconds, serial, ["passes", "solver"])
        total += told.get("uncertainty", 0.0) - sum_of(row, seconds, serial, ["uncertainty", "last evaluation"])
    return total


def left_over(samples, seconds, serial):
    """What no phase covers: fitted to the seconds that are left, weighted by the whole time of the run."""
    columns = sorted({t for _, c, _ in samples for t in c})
    rows = [({t: n / r["seconds"] for t, n in c.items()}, y / r["seconds"]) for r, c, y in samples]
    a = [([c.get(t, 0.0) for t in columns], y) for c, y in rows]
    scale = [math.sqrt(sum(r[j] ** 2 for r, _ in a)) or 1.0 for j in range(len(columns))]
    x = [0.0] * len(columns)
    for _ in range(20_000):
        for j in range(len(columns)):
            gram = sum((r[j] / scale[j]) ** 2 for r, _ in a) + 1e-9
            slope = sum(r[j] / scale[j] * (y - sum(r[k] / scale[k] * x[k] for k in range(len(columns)))) for r, y in a)
            x[j] = max(0.0, x[j] + slope / gram)
    for t, v, s in zip(columns, x, scale):
        seconds[t] = v / s
    for g in ("start", "image", "judge"):
        serial[g] = 1.0
    print(f"{'rest':28} {len(samples)} samples")


def write(found, path):
    lines = ["# Seconds of the operations of src/cost/term.rs on one machine. Written by `make bench-book`; do not edit."]
    lines += [f'machine = "{processor()}"', f'date = "{datetime.date.today()}"', f"base-bytes = {found['base']:.1f}"]
    lines += [f"start-bytes = {found['start']:.1f}", "", "[gauges]"]
    lines += [f"{k} = {v:.6e}" for k, v in found["gauges"].items()]
    for name in ("seconds", "serial", "typical"):
        lines += ["", f"[{name}]"]
        keys = all_terms() if name == "seconds" else sorted(found[name])
        lines += [f'"{k}" = {found[name][k]:.4e}' for k in keys]
    Path(path).write_text("\n".join(lines) + "\n")


FIT = {"dirty": 12, "beam": 4, "clean": 32, "mem": 10, "grid": 3, "simulate": 10, "predict": 6}
CHECK = {"dirty": 3, "clean": 3, "mem": 1, "beam": 1, "simulate": 1, "predict": 1}


def main():
    p = argparse.ArgumentParser()
    p.add_argument("what", choices=["fit", "check"])
    p.add_argument("program", type=Path)
    p.add_argument("--seed", type=int)
    p.add_argument("--speeds", type=Path, help="speeds for check, in place of those in the program")
    p.add_argument("--keep", type=Path, help="a folder for the files of the runs")
    p.add_argument("--rows", type=Path, help="a file of measured rows: runs that it holds are not measured again")
    p.add_argument("--turns", type=int, help="how often each case runs; the shortest time counts [default: 2]")
    p.add_argument("--until", type=float, default=math.inf, help="begin no run after so many seconds")
    p.add_argument("-o", "--output", type=Path, default=own_file(), help="where to write the fit; a new file needs a row in src/cost/speeds.rs")
    p.add_argument("--page", action="store_true", help="put the table of check into the book")
    a = p.parse_args()
    program = a.program.resolve()
    with tempfile.TemporaryDirectory() as temporary:
        folder = a.keep or Path(temporary)
        folder.mkdir(exist_ok=True)
        folder = folder.resolve()
        if a.what == "fit":
            rows = measured(program, folder, *cases(a.seed or FIT_SEED, "f", FIT), turns=a.turns or 2, kept=a.rows, until=a.until, rehearse=False)
            # What a single run finds: the smallest of many would make every later run look slower than it is.
            gauges = {k: statistics.median(r["forecast"]["gauges"][k] for r in rows) for k in rows[0]["forecast"]["gauges"]}
            write(fit(rows, gauges), a.output)
        else:
            rows = measured(program, folder, *cases(a.seed or CHECK_SEED, "c", CHECK), turns=a.turns or 2, speeds=a.speeds, kept=a.rows, until=a.until)
            table(rows, a.page)


def table(rows, page):
    lines = ["| command | threads | predicted, s | measured, s | ratio | predicted, MB | measured, MB | ratio |", "|---|---|---|---|---|---|---|---|"]
    for r in rows:
        f = r["forecast"]
        lines.append(f"| `{r['words']}` | {r['threads']} | {f['seconds']:.2f} | {r['seconds']:.2f} | {f['seconds'] / r['seconds']:.2f} "
                     f"| {f['peak_bytes'] / 1e6:.0f} | {r['bytes'] / 1e6:.0f} | {f['peak_bytes'] / r['bytes']:.2f} |")
    within = sum(abs(r["forecast"]["seconds"] / r["seconds"] - 1) <= 0.25 for r in rows)
    memory = sum(abs(r["forecast"]["peak_bytes"] / r["bytes"] - 1) <= 0.1 for r in rows)
    lines += ["", f"{within} of {len(rows)} times are within 25 %, and {memory} of {len(rows)} memories within 10 %."]
    text = "\n".join(lines)
    print(text)
    if page:
        old = PAGE.read_text()
        begin, end = "<!-- checked: written by `make bench-book` -->", "<!-- end of what was checked -->"
        head, rest = old.split(begin)
        PAGE.write_text(f"{head}{begin}\n\n{text}\n\n{end}{rest.split(end)[1]}")


if __name__ == "__main__":
    main()
