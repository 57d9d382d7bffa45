"""Damaged files for the commands that read them.

A file loses its end, gets zeros, other bytes or a block of its own at another place, or (a text) a hostile number or a line twice. The command must end,
without a panic and in little memory. Where it fails, its message names the file. Where it makes an image, the image is finite.
"""

import random
import re

from .bench import IMAGE
from .numbers import HOSTILE

BAND = "--freq 94GHz --bandwidth 8GHz"
# The file that is damaged, and the commands that read it as `@`.
READERS = [
    ("v.uvh5", [f"dirty @ {IMAGE} -o out/o.fits", f"clean @ {IMAGE} --niter 50 -o out/o", f"mem @ {IMAGE} --niter 20 -o out/o",
                "info @", "closure @ -o out/o.csv",
                f"selfcal @ {IMAGE} --niter 20 --rounds 1 --algorithm hogbom -o out/o", "corrupt @ --phase-rms 1rad -o out/o.uvh5", "convert @ out/o.uvfits",
                "convert @ out/o.uvh5", "predict @ --model s.csv -o out/o.uvh5", "predict @ --model s.csv --into model -o out/o.uvh5",
                "applycal @ g.calh5 -o out/o.uvh5",
                "plot @ -o out/o.png", f"grid @ {IMAGE} -o out/o.h5", f"beam @ {IMAGE} -o out/o.fits"]),
    ("e.uvfits", ["dirty @ --size 32 -o out/o.fits", "info @", "convert @ out/o.uvh5", "closure @ -o out/o.csv", "plot @ --what uv -o out/o.png"]),
    ("d.fits", ["info @", "plot @ -o out/o.png", "compare @ t.fits", "compare t.fits @ --convolve", "convert @ out/o.png", "convert @ out/o.fits"]),
    ("q-model.fits", [f"mem v.uvh5 {IMAGE} --tolerance 99 --kkt 0.9 --prior @ -o out/o", f"mem v.uvh5 {IMAGE} --tolerance 99 --kkt 0.9 --mask @ -o out/o"]),
    ("k.fits", ["simulate --layout l.toml --scene @ " + BAND + " -o out/o.uvh5", "info @", "convert @ out/o.png"]),
    ("m-model.fits", [f"clean v.uvh5 {IMAGE} --niter 50 --mask @ -o out/o", "predict v.uvh5 --model @ -o out/o.uvh5"]),
    ("g.calh5", ["info @", "applycal c.uvh5 @ -o out/o.uvh5", "compare @ g.calh5", "plot @ -o out/o.png", "convert @ out/o.calh5"]),
    ("s.csv", ["simulate --layout l.toml --scene @ " + BAND + " -o out/o.uvh5", "predict v.uvh5 --model @ -o out/o.uvh5"]),
    ("l.toml", ["layout show @ --freq 94GHz", "simulate --layout @ --scene s.csv " + BAND + " -o out/o.uvh5", "plot @ -o out/o.png",
                "layout convert @ -o out/o.csv"]),
    ("e.toml", ["layout show @", "layout convert @ -o out/o.cfg", "simulate --layout @ --scene s.csv --freq 8GHz --bandwidth 1GHz --phase-center 10deg,40deg "
                "--start 2025-06-01T15:00:00 -o out/o.uvh5"]),
    *((name, ["layout show @ --freq 8GHz", "layout convert @ -o out/o.toml"]) for name in ("l.cfg", "l.txt", "l.csv", "l.ant")),
    ("x.toml", ["corrupt v.uvh5 --config @ -o out/o.uvh5"]),
    ("c.toml", ["run @ -o out/o", "run --check @"]),
    ("u.toml", ["study @ -o out/o", "study --check @"]),
    ("b.toml", ["scene render @ --scene-size 8 -o out/o.fits", "scene probe @ --rays r.csv", "scene convert @ out/o.txt"]),
    ("f.toml", ["scene fly @ --size 8 --no-video -o out/o"]),
    ("b.txt", ["scene probe @ --points p.csv", "scene probe @ --rays r.csv"]),
    ("r.csv", ["scene probe b.txt --rays @"]),
    ("p.csv", ["scene probe b.txt --points @"]),
    ("a.csv", ["scene sky --atmosphere @ --freq 94GHz", "scene path --atmosphere @ --freq 94GHz --observer 1km"]),
    ("k.toml", ["scene emissivity --stack @ --freq 94GHz"]),
]
NUMBER = re.compile(rb"(?<![\w.])-?\d+(\.\d+)?(e-?\d+)?")
IMAGERS = ("dirty", "clean", "mem", "beam", "simulate", "scene")


def damaged(rng, data, is_text):
    """The bytes of a file after 1 to 3 accidents, and their names."""
    data, names = bytearray(data), []
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        size = max(len(data), 1)
        # Most of a set of data is data: its head is hit as often as all the rest.
        at = rng.randrange(size) if rng.random() < 0.5 else rng.randrange(min(size, 8192))
        long = rng.choice((1, 4, 8, 64, 512, 4096))
        kind = rng.choice(("bits", "bytes", "cut", "zeros", "ones", "block", "drop") + (("number",) * 5 + ("line", "lines") if is_text else ()))
        names.append(kind)
        if kind == "bits" and data:
            for _ in range(rng.choice((1, 1, 8, 64))):
                data[min(rng.randrange(size) if rng.random() < 0.3 else at + rng.randrange(64), len(data) - 1)] ^= 1 << rng.randrange(8)
        elif kind == "bytes":
            data[at:at + long] = rng.randbytes(min(long, len(data) - at))
        elif kind == "cut":
            del data[at:]
        elif kind in ("zeros", "ones"):
            data[at:at + long] = (b"\0" if kind == "zeros" else b"\xff") * min(long, len(data) - at)
        elif kind == "block":
            other = rng.randrange(size)
            data[other:other + (long if rng.random() < 0.5 else 0)] = data[at:at + long]
        elif kind == "drop":
            del data[at:at + long]
        elif kind == "number" and (found := list(NUMBER.finditer(data))):
            one = rng.choice(found)
            data[one.start():one.end()] = rng.choice(HOSTILE + ["3e38", "-1e-9", "65536", "0x10", "1.2.3"]).encode()
        elif kind in ("line", "lines"):
            lines = data.splitlines(keepends=True) or [b""]
            k = rng.randrange(len(lines))
            lines[k:k + 1] = [lines[k]] * rng.choice((0, 2)) if kind == "line" else rng.sample(lines[k:k + 5], len(lines[k:k + 5]))
            data = bytearray(b"".join(lines))
    return bytes(data), "+".join(names)


def campaign(bench, count, seed):
    for name, lines in READERS:
        for line in lines:
            bench.must_work(line.replace("@", name).split())
    keep = bench.folder.parent / f"{bench.folder.name}-kept"
    for case in bench.cases(count):
        rng = random.Random(f"damage {seed} {case}")
        name, lines = rng.choice(READERS)
        line = rng.choice(lines)
        data, how = damaged(rng, bench.inputs[name], name.endswith((".csv", ".toml", ".txt", ".cfg", ".ant")))
        file = "damaged." + name.split(".")[1]
        (bench.folder / file).write_bytes(data)
        done = bench.call(["--threads", "1", *line.replace("@", file).split()])
        faults = done.faults()
        # A step of a run is named by its own command, and constraints that are not met are no fault of one file.
        if done.code in (1, 2) and file not in done.err and not done.err.startswith(("error: cittert ", "error: the constraints are not met")):
            faults.append(("unnamed", f"the message does not name the file: {done.err.strip()[:300]}"))
        if done.code == 0 and line.split()[0] in IMAGERS:
            faults += [f for f in bench.check_results() if done.ended]
        if bench.left() and done.ended:
            faults.append(("leftover", f"left {bench.left()}"))
        bench.counts["refused" if done.code else "done"] += 1
        for kind, text in faults:
            before = bench.reported[(kind, f"{line} {text[:40]}")]
            if not before:
                # The first of its kind is kept, so that the call can be made again.
                keep.mkdir(exist_ok=True)
                kept = keep / f"{seed}-{case}-{file}"
                kept.write_bytes(data)
                text += f"  ({how} of {name}, kept as {kept})"
            bench.fail(kind, done.line, text, f"{line} {text[:40]}")
        (bench.folder / file).unlink()
        bench.clear()
        odd = bench.restore()
        if odd:
            bench.fail("input", done.line, f"changed or made {odd}")
