"""Outputs and logs that are inputs, the configuration or other outputs, under other names. Each is refused before any work, and every file is as it was.

The other names are `./`, a way through `..`, the whole path, a way through a folder that is a link, a symbolic link, a link to a link, a hard link, and for a
folder of results one that holds the inputs.
"""

import os
import random

from .bench import IMAGE
from .writers import WRITERS

LOGS = [
    ("clean v.uvh5 --niter 20 --log @ -o out/o", ["v.uvh5"]), (f"mem v.uvh5 {IMAGE} --log @ -o out/o", ["v.uvh5"]),
    (f"clean v.uvh5 {IMAGE} --mask m-model.fits --log @ -o out/o", ["m-model.fits"]), (f"mem v.uvh5 {IMAGE} --prior d.fits --log @ -o out/o", ["d.fits"]),
    (f"mem v.uvh5 {IMAGE} --terms vis --log @ -o out/o", ["v.uvh5"]), ("corrupt v.uvh5 --config x.toml -o out/o.uvh5 --gains @", ["v.uvh5", "x.toml"]),
    ("scene render b.toml --scene-size 8 -o out/o.fits --incidence @", ["b.toml"]), ("closure v.uvh5 --plot-amplitudes @", ["v.uvh5"]),
    ("compare d.fits t.fits --difference @", ["d.fits", "t.fits"]), ("scene render k.fits -o @", ["k.fits"]),
    ("scene emissivity --stack k.toml --freq 94GHz --plot @", ["k.toml"]),
    ("scene bistatic --stack k.toml --freq 94GHz --slopes 0.1,0.1 --incidence 30deg --scattered 30deg --plot @", ["k.toml"]),
    ("predict v.uvh5 --model m-model.fits --into model -o @", ["m-model.fits"]),
    ("applycal c.uvh5 g.calh5 -o @", ["g.calh5"]), ("plot v.uvh5 --what model --model s.csv -o @", ["v.uvh5", "s.csv"]),
    ("plot d.fits --like t.fits -o @", ["t.fits"]),
    ("plot d.fits --beam-of t.fits -o @", ["t.fits"]), ("convert v.uvh5 @ --append", ["v.uvh5"]),
]
# Two outputs of one command: the second one is given by name.
TWINS = [
    "corrupt v.uvh5 --phase-rms 1rad -o @ --gains &", "closure v.uvh5 -o @ --plot &", "closure v.uvh5 --plot-amplitudes @ --plot &",
    "compare d.fits t.fits --difference @ --fidelity &",
    "scene render b.toml --scene-size 8 -o @ --range &", f"clean v.uvh5 {IMAGE} -o out/z --log &-image.fits", f"mem v.uvh5 {IMAGE} -o out/z --log &-model.fits",
]


def spelled(bench, rng, name):
    """Another way to write the path of a file of the folder."""
    kind = rng.choice(("same", "dot", "parent", "whole", "linked folder", "double"))
    if kind == "linked folder":
        os.symlink(".", bench.folder / "way")
    ways = {"same": "", "dot": "./", "parent": "out/../", "whole": f"{bench.folder}/", "linked folder": "way/", "double": ".//./"}
    return ways[kind] + name


def linked(bench, rng, name, link):
    """Lead the name `link` to a file of the folder."""
    target, place = bench.folder / name, bench.folder / link
    kind = rng.choice(("hard", "symbolic", "whole", "twice"))
    if kind == "hard":
        os.link(target, place)
    elif kind == "twice":
        os.symlink(name, bench.folder / "between")
        os.symlink("between" if place.parent == bench.folder else "../between", place)
    else:
        os.symlink(target if kind == "whole" or place.parent != bench.folder else name, place)


def draw(bench, rng):
    """A command line, with the links that it needs."""
    choice = rng.random()
    if choice < 0.15:
        line = rng.choice(TWINS)
        first = "out/z" if "&-" in line else spelled(bench, rng, "z.fits")
        second = "out/../out/z" if "&-" in line else rng.choice(("z.fits", "./z.fits", "out/../z.fits"))
        return line.replace("@", first).replace("&", second).split()
    if choice < 0.45:
        line, inputs = rng.choice(LOGS)
        name = rng.choice(inputs)
        if rng.random() < 0.5:
            link = "linked." + name.split(".")[1]
            linked(bench, rng, name, link)
            name = link
        return line.replace("@", spelled(bench, rng, name)).split()
    # Those without inputs cannot collide, and the first file of a change in place may be its output.
    writer = rng.choice([w for w in WRITERS if w.inputs])
    candidates = [i for i in writer.inputs if not (writer.line.startswith(("applycal", "predict")) and i == writer.inputs[0])]
    name = rng.choice(candidates)
    if writer.folder:
        # The folder of results holds an input, or is it.
        at = rng.choice((".", "out/..", str(bench.folder), spelled(bench, rng, name)))
        return writer.line.replace("@", at).split()
    if writer.made or rng.random() < 0.5:
        made = rng.choice(writer.outputs("out/o"))
        linked(bench, rng, name, made)
        return writer.words("out/o")
    return writer.line.replace("@", spelled(bench, rng, name)).split()


def campaign(bench, count, seed):
    for case in bench.cases(count):
        rng = random.Random(f"paths {seed} {case}")
        words = draw(bench, rng) + (["--overwrite"] if rng.random() < 0.8 else [])
        before = bench.listing()
        links = [f"{n} -> {t}" for n, t in before.items() if n not in bench.inputs and t]
        done = bench.call(words)
        faults = done.faults()
        if done.code == 0:
            faults.append(("taken", "an output that is an input was not refused"))
        changed = [n for n, was in bench.inputs.items() if not (bench.folder / n).is_file() or (bench.folder / n).read_bytes() != was]
        if changed:
            faults.append(("lost", f"{changed} changed"))
        after = bench.listing()
        if after != before:
            faults.append(("made", f"the folder has changed: made {sorted(set(after) - set(before))}, lost {sorted(set(before) - set(after))}"))
        bench.counts[f"exit code {done.code}"] += 1
        for kind, text in faults:
            name = " ".join(words[:2]) if words[0] == "scene" else words[0]
            bench.fail(kind, f"{done.line}  (with {', '.join(links) or 'no link'})", f"{text}; {done.err.strip()[:200]}", f"{name} {kind}")
        bench.clear()
        bench.restore()
