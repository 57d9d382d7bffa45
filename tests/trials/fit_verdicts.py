"""Good fits and fits that are spoilt on purpose: does each bad one draw a finding, and no good one?

Each case draws, from its seed alone, an array (a snapshot of 24 to 100 elements at 94 GHz, or a track of the VLA or ALMA), a scene, noise, and a command
(`clean`, `mem` or `selfcal`). A good case images the data as they are. A bad case has one of these faults: a wrong pedestal, no short spacings, a
wrong model, two swapped antennas, time that runs backwards, or interference on 2 percent of the samples. The truth says whether a fit is in fact good:
the error of its image from that of data without noise, errors and faults is at most a third of the error of a grey card. A set without a fault can
have a poor fit, because of noise or of its array, and a fault can do no harm. A wrong pedestal always does. It needs Python 3 with h5py:

    CITTERT=target/release/cittert python3 tests/trials/fit_verdicts.py --cases 100
"""

import argparse
import collections
import concurrent.futures
import math
import random
import tempfile
from pathlib import Path

import h5py
import numpy as np
from selfcal_cases import BAND_HZ, CHANNELS, FREQ_HZ, PIXELS, WAVE_M, cittert, layout, scene

FAULTS = ["pedestal", "short spacings", "wrong model", "swapped antennas", "time", "interference"]


def points(rng, folder, name, field, count, wide):
    lines = ["l_rad,m_rad,flux_jy,major_rad,minor_rad,pa_rad"]
    total = 0.0
    for _ in range(count):
        flux = 10 ** rng.uniform(-0.5, 0.5)
        major = rng.uniform(*wide) * field if wide else 0.0
        lines.append(f"{rng.uniform(-0.2, 0.2) * field},{rng.uniform(-0.2, 0.2) * field},{flux},{major},{major * rng.uniform(0.5, 1)},{rng.uniform(0, 3)}")
        total += flux
    (folder / name).write_text("\n".join(lines) + "\n")
    return total


def snapshot(rng, folder, seed, sky, pedestal=False):
    kind = rng.choice(["y", "golden", "random", "reuleaux", "spiral"])
    n = rng.randint(24, 100) // 3 * 3
    diameter = rng.uniform(0.5, 2.0)
    field = PIXELS * WAVE_M / diameter / 5
    rows = "".join(f'[[antenna]]\nname = "A{k}"\nposition_m = [{x}, {y}, 0.0]\ntsys_k = 600.0\ndiameter_m = 0.008\n\n' for k, (x, y) in enumerate(layout(rng, kind, n, diameter)))
    (folder / "layout.toml").write_text(f'name = "case {seed}"\nframe = "boresight"\nsource = "drawn"\n\n{rows}')
    look = ["simulate", "--layout", "layout.toml", "--freq", f"{FREQ_HZ}Hz", "--bandwidth", f"{BAND_HZ}Hz", "--channels", CHANNELS, "--seed", seed]
    if sky == "kelvin":
        words, _ = scene(rng, "kelvin", folder, field)
        if rng.random() < 0.5 or pedestal:
            # A warm background up to the edge of the frame.
            warm = rng.uniform(150, 250)
            words = [*words[:-4], "--scene-min", f"{warm}K", "--scene-max", f"{warm + rng.choice([60, 90, 120])}K"]
            if pedestal:
                words += ["--pedestal", f"{warm + rng.choice([-1, 1]) * rng.uniform(60, 140)}K"]
        look += [*words, "--noise", "--integration", f"{10 ** rng.uniform(-2, 1)}s"]
    else:
        wide = None if sky == "points" else (0.02, 0.08)
        total = points(rng, folder, "scene.csv", field, rng.randint(1, 6), wide)
        snr = 10 ** rng.uniform(0.7, 2.5)
        look += ["--scene", "scene.csv", "--sefd", f"{total / snr * math.sqrt(2 * BAND_HZ / CHANNELS * 0.1)}Jy", "--integration", "100ms"]
    cittert(folder, *look, "-o", "good.uvh5")
    ideal = [w for k, w in enumerate(look) if w not in ("--noise", "--sefd", "--pedestal") and look[k - 1] not in ("--sefd", "--pedestal")]
    cittert(folder, *ideal, "-o", "ideal.uvh5")
    return f"{kind} {n}", field, ["--size", PIXELS, "--cell", f"{field / PIXELS}rad"]


def track(rng, folder, seed, sky):
    name, freq = rng.choice([("vla-a", 1.4e9), ("vla-b", 5e9), ("vla-c", 8.4e9), ("vla-d", 22e9)])
    longest = {"vla-a": 36e3, "vla-b": 11e3, "vla-c": 3.4e3, "vla-d": 1.03e3}[name]
    cell = 299792458.0 / freq / longest / 4
    field = PIXELS * cell
    wide = None if sky == "points" else (0.02, 0.08)
    total = points(rng, folder, "scene.csv", field, rng.randint(1, 6), wide)
    channels, width, time = 4, 32e6, 60
    snr = 10 ** rng.uniform(0.3, 2)
    sefd = total / snr * math.sqrt(2 * width / channels * time)
    look = ["simulate", "--layout", name, "--freq", f"{freq}Hz", "--bandwidth", f"{width}Hz", "--channels", channels, "--scene", "scene.csv", "--phase-center",
            f"10h00m00s,{rng.choice([10, 25, 40, 55])}d00m00s", f"--hour-angle={rng.uniform(-4, -1)}h,{rng.uniform(0, 3)}h", "--start", "2025-06-01T00:00:00", "--integration", f"{time}s", "--seed", seed]
    cittert(folder, *look, "--sefd", f"{sefd}Jy", "-o", "good.uvh5")
    cittert(folder, *look, "-o", "ideal.uvh5")
    return name, field, ["--size", PIXELS, "--cell", f"{cell}rad"]


def spoil(rng, path, fault):
    with h5py.File(path, "r+") as f:
        vis, a1, a2 = f["Data/visdata"][...], f["Header/ant_1_array"][...], f["Header/ant_2_array"][...]
        uvw, time, flags = f["Header/uvw_array"][...], f["Header/time_array"][...], f["Data/flags"][...]
        if fault == "short spacings":
            length = np.hypot(uvw[:, 0], uvw[:, 1])
            flags[length < np.quantile(length, rng.uniform(0.3, 0.5))] = True
        elif fault == "swapped antennas":
            p, q = rng.sample(sorted(set(a1) | set(a2)), 2)
            swap = {p: q, q: p}
            place = {(a, b, t): k for k, (a, b, t) in enumerate(zip(a1, a2, time))}
            new = vis.copy()
            for k, (a, b, t) in enumerate(zip(a1, a2, time)):
                x, y = swap.get(a, a), swap.get(b, b)
                new[k] = vis[place[x, y, t]] if (x, y, t) in place else vis[place[y, x, t]].conj()
            vis = new
        elif fault == "time":
            place = {(a, b, t): k for k, (a, b, t) in enumerate(zip(a1, a2, time))}
            times = sorted(set(time))
            mirror = dict(zip(times, reversed(times)))
            vis = vis[[place.get((a, b, mirror[t]), k) for k, (a, b, t) in enumerate(zip(a1, a2, time))]]
        elif fault == "interference":
            g = np.random.default_rng(rng.randrange(10**9))
            hit = g.random(vis.shape) < 0.02
            size = np.sqrt(np.mean(np.abs(vis) ** 2)) * 10 ** rng.uniform(0.7, 2)
            vis = vis + hit * size * np.exp(2j * np.pi * g.random(vis.shape))
        f["Data/visdata"][...] = vis.astype(f["Data/visdata"].dtype)
        f["Data/flags"][...] = flags


def error(folder, sky, image, command):
    """Error of the image from that of ideal data, over that of a grey card."""
    if sky == "kelvin":
        cittert(folder, "mem", "ideal.uvh5", "-o", "ideal", *image)
    else:
        cittert(folder, "clean", "ideal.uvh5", "-o", "ideal", *image, "--algorithm", "hogbom" if sky == "points" else "multiscale", "--niter", 100000, "--nsigma", 3)
    # Self-calibration leaves the position of the image open.
    shift = ["--shift"] if command == "selfcal" else []
    return cittert(folder, "compare", "out-image.fits", "ideal-image.fits", *shift)[0]["error_over_grey_card"]


def case(seed, bad):
    rng = random.Random(2 * seed + bad)
    fault = FAULTS[seed % len(FAULTS)] if bad else "none"
    tracked = fault == "time" or (fault != "pedestal" and rng.random() < 0.4)
    sky = "kelvin" if fault == "pedestal" else "extended" if fault == "short spacings" else rng.choice(["points", "extended"] + ([] if tracked else ["kelvin"]))
    command = "selfcal" if fault == "wrong model" else rng.choice(["clean", "mem"] if sky == "kelvin" else ["clean", "clean", "selfcal"])
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        array, field, image = track(rng, folder, seed, sky) if tracked else snapshot(rng, folder, seed, sky, fault == "pedestal")
        data = "good.uvh5"
        words = []
        if fault == "wrong model":
            cittert(folder, "corrupt", data, "-o", "bad.uvh5", "--gains", "truth.calh5", "--phase-rms", f"{rng.uniform(10, 60)}deg", "--seed", seed + 1)
            data = "bad.uvh5"
            points(rng, folder, "wrong.csv", field, rng.randint(2, 5), None)
            words = ["--model", "wrong.csv"]
        elif fault not in ("none", "pedestal"):
            spoil(rng, folder / data, fault)
        if command == "clean":
            words += ["--algorithm", "hogbom" if sky == "points" else "multiscale", "--niter", 100000, "--nsigma", 3]
        if command == "selfcal":
            words += ["--solint", "inf" if not tracked else "10min"]
            if fault == "none":
                cittert(folder, "corrupt", data, "-o", "bad.uvh5", "--gains", "truth.calh5", "--phase-rms", f"{rng.uniform(5, 40)}deg", "--seed", seed + 1)
                data = "bad.uvh5"
        try:
            result, _ = cittert(folder, command, data, "-o", "out", *image, *words)
            off = error(folder, sky, image, command)
        except RuntimeError as e:
            return {"seed": seed, "fault": fault, "what": f"{array} {sky} {command}", "findings": ["error"], "says": str(e)[-300:], "accepted": None, "json": {}, "error": None}
    return {"seed": seed, "fault": fault, "error": off, "what": f"{array} {sky} {command}", "findings": [f["name"] for f in result["findings"]], "says": result["verdict"],
            "accepted": result.get("accepted"), "json": {k: result.get(k) for k in ("stop_reason", "dynamic_range", "residuals")}}


def main():
    options = argparse.ArgumentParser()
    options.add_argument("--cases", type=int, default=100, help="of each kind, good and bad")
    options.add_argument("--first", type=int, default=1)
    options.add_argument("--jobs", type=int, default=2)
    options.add_argument("--only", choices=["good", "bad"])
    args = options.parse_args()
    kinds = [bad for bad in (False, True) if args.only in (None, "bad" if bad else "good")]
    found = collections.Counter()
    with concurrent.futures.ProcessPoolExecutor(args.jobs) as pool:
        jobs = {pool.submit(case, seed, bad): (seed, bad) for seed in range(args.first, args.first + args.cases) for bad in kinds}
        for job in concurrent.futures.as_completed(jobs):
            try:
                c = job.result()
            except Exception as e:
                print("FAILED", jobs[job], str(e)[-300:], flush=True)
                continue
            right = c["error"] is not None and c["error"] <= 1 / 3 and c["fault"] != "pedestal"
            found[c["fault"], right, bool(c["findings"])] += 1
            print(f"{c['seed']:4d} {c['fault']:16s} {c['what']:32s} error {c['error']} {c['accepted']} {c['json']} {c['findings']}: {c['says'][:400]}", flush=True)
    for fault in ["none", *FAULTS]:
        for right in (True, False):
            yes, no = found[fault, right, True], found[fault, right, False]
            if yes + no:
                print(f"{fault:16s}, {'good' if right else 'poor'} image: {yes} of {yes + no} draw a finding")


if __name__ == "__main__":
    main()
