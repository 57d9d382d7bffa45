"""Sources outside the image: does the verdict name them, and where they are?

Each case draws an array, a scene and noise as `fit_verdicts.py` does, adds a point outside the image, and makes an image by `clean`. A point that is fainter
than what the image leaves anyway need not be named. `fit_verdicts.py` tells how often a source is named where there is none. It needs Python 3 with h5py:

    CITTERT=target/release/cittert python3 tests/trials/outside_sources.py --cases 60
"""

import argparse
import concurrent.futures
import math
import random
import re
import tempfile
from pathlib import Path

import fit_verdicts
from selfcal_cases import PIXELS, cittert

points = fit_verdicts.points


def case(seed):
    rng = random.Random(seed)
    sky = rng.choice(["points", "extended"])
    place = {}

    def with_one_outside(own, folder, name, field, count, wide):
        total = points(own, folder, name, field, count, wide)
        far, along = rng.uniform(0.52, 1.3) * field, rng.uniform(-1, 1)
        l, m = rng.choice([(far, far * along), (-far, far * along), (far * along, far), (far * along, -far)])
        ratio = 10 ** rng.uniform(-1.3, 0.3)
        place.update(l=l, m=m, flux=total * ratio, ratio=ratio, cell=field / PIXELS)
        with open(folder / name, "a") as file:
            file.write(f"{l},{m},{place['flux']},0,0,0\n")
        return total

    fit_verdicts.points = with_one_outside
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        array, _, image = (fit_verdicts.track if rng.random() < 0.5 else fit_verdicts.snapshot)(rng, folder, seed, sky)
        words = ["--algorithm", "hogbom" if sky == "points" else "multiscale", "--niter", 100000, "--nsigma", 3]
        result, _ = cittert(folder, "clean", "good.uvh5", "-o", "out", *image, *words)
        told = {f["name"]: f for f in result["findings"]}
        line = f"{seed:4d} {array:14s} {sky:8s} {place['ratio']:.2f} of the flux"
        if "outside" not in told:
            return line + f" {'NOT NAMED' if 'chi_squared' in told else 'no misfit'} {sorted(told)} {result['residuals']['mean_square']:.2f}", "chi_squared" in told, False, False
        l, m, flux = (float(re.search(rf"{what} (\S+?)( Jy|,| \()", told["outside"]["says"]).group(1)) for what in ("l =", "m =", "about"))
        off = math.hypot(l - place["l"], m - place["m"]) / place["cell"]
        right = off < 6
        size, cell = re.search(r"--size (\d+) --cell (\S+)", told["outside"]["next"]).groups()
        again, _ = cittert(folder, "clean", "good.uvh5", "-o", "again", "--size", size, "--cell", cell, *words)
        better = "outside" not in [f["name"] for f in again["findings"]]
        line += f" off by {off:.1f} pixels, flux {flux / place['flux']:.2f}, mean square {result['residuals']['mean_square']:.2f} then {again['residuals']['mean_square']:.2f} {[f['name'] for f in again['findings']]}"
        return line, True, right, better


def main():
    options = argparse.ArgumentParser()
    options.add_argument("--cases", type=int, default=60)
    options.add_argument("--first", type=int, default=1)
    options.add_argument("--jobs", type=int, default=2)
    args = options.parse_args()
    total, named, right, better = 0, 0, 0, 0
    with concurrent.futures.ProcessPoolExecutor(args.jobs) as pool:
        for job in concurrent.futures.as_completed([pool.submit(case, seed) for seed in range(args.first, args.first + args.cases)]):
            line, misfit, place, after = job.result()
            print(line, flush=True)
            total, named, right, better = total + misfit, named + (misfit and "off by" in line), right + place, better + after
    print(f"of {args.cases} images {total} do not explain their data: a source is named for {named}, {right} of them within 6 pixels of it; the size that is proposed holds it for {better}")


if __name__ == "__main__":
    main()
