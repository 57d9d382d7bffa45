"""Random cases of self-calibration with default options: does it ever make the gains worse?

Each case draws, from its seed alone, a layout of 12 to 100 elements (Y, golden spiral, random disc, ring, Reuleaux triangle or log spiral),
a scene (points in Jy, extended sources in Jy, both, or a thermal scene in kelvin), phase errors of 0 to 180 degrees, in half of the cases
amplitude errors of up to 50 percent, and noise that gives a visibility a signal to noise ratio of 3 to 1000. It needs Python 3 and nothing else:

    CITTERT=target/release/cittert python3 tests/trials/selfcal_cases.py --cases 200 --markdown docs/algorithms/selfcal-cases.md

A case is a failure if the rms phase error after self-calibration exceeds the error before by more than the noise explains.
"""

import argparse
import concurrent.futures
import json
import math
import os
import random
import struct
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path

CITTERT = os.environ.get("CITTERT", "target/release/cittert")
FREQ_HZ, BAND_HZ, CHANNELS = 94e9, 8e9, 8
WAVE_M = 299792458.0 / FREQ_HZ
PIXELS = 256


def cittert(folder, *words):
    run = subprocess.run([os.path.abspath(CITTERT), "--json", "--threads", "1", *map(str, words)], cwd=folder, capture_output=True, text=True)
    if run.returncode:
        raise RuntimeError(f"{' '.join(map(str, words))}: {run.stderr[-400:]}")
    return json.loads(run.stdout), run.stderr


def layout(rng, kind, n, diameter):
    r = diameter / 2
    if kind == "y":
        arm = n // 3
        return [(r * ((k + 1) / arm) ** 1.7 * math.sin(a), r * ((k + 1) / arm) ** 1.7 * math.cos(a))
                for a in (0, 2 * math.pi / 3, 4 * math.pi / 3) for k in range(arm)]
    if kind == "golden":
        return [(r * math.sqrt((k + 0.5) / n) * math.cos(2.399963 * k), r * math.sqrt((k + 0.5) / n) * math.sin(2.399963 * k)) for k in range(n)]
    if kind == "spiral":
        return [(r * 10 ** (k / (n - 1) - 1) * math.cos(9.0 * k / n * 2), r * 10 ** (k / (n - 1) - 1) * math.sin(9.0 * k / n * 2)) for k in range(n)]
    if kind == "ring":
        return [(r * math.cos(2 * math.pi * k / n + rng.gauss(0, 0.3 / n)), r * math.sin(2 * math.pi * k / n + rng.gauss(0, 0.3 / n))) for k in range(n)]
    if kind == "reuleaux":
        corners = [(math.cos(a), math.sin(a)) for a in (math.pi / 2, math.pi / 2 + 2 * math.pi / 3, math.pi / 2 + 4 * math.pi / 3)]
        out = []
        for k in range(n):
            t = 3 * (k + rng.uniform(-0.2, 0.2)) / n % 3
            c, (p, q) = corners[int(t)], (corners[(int(t) + 1) % 3], corners[(int(t) + 2) % 3])
            a, b = math.atan2(p[1] - c[1], p[0] - c[0]), math.atan2(q[1] - c[1], q[0] - c[0])
            b = a + (b - a + math.pi) % (2 * math.pi) - math.pi
            side, w = math.sqrt(3), a + (t % 1) * (b - a)
            out.append((r * (c[0] + side * math.cos(w)), r * (c[1] + side * math.sin(w))))
        return out
    out = []
    while len(out) < n:
        x, y = rng.uniform(-r, r), rng.uniform(-r, r)
        if math.hypot(x, y) <= r and all(math.hypot(x - a, y - b) > 0.02 * diameter for a, b in out):
            out.append((x, y))
    return out


def png(path, pixels):
    rows = b"".join(b"\0" + bytes(row) for row in pixels)
    chunk = lambda tag, data: struct.pack(">I", len(data)) + tag + data + struct.pack(">I", zlib.crc32(tag + data))
    head = struct.pack(">IIBBBBB", len(pixels[0]), len(pixels), 8, 0, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def scene(rng, kind, folder, field):
    if kind == "kelvin":
        blobs = [(rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3), rng.uniform(0.02, 0.15), rng.uniform(0.02, 0.15), rng.uniform(40, 220)) for _ in range(rng.randint(2, 8))]
        boxes = [(rng.uniform(-0.3, 0.2), rng.uniform(-0.3, 0.2), rng.uniform(0.02, 0.2), rng.uniform(0.02, 0.2), rng.uniform(40, 220)) for _ in range(rng.randint(0, 5))]
        pixels = []
        for i in range(PIXELS):
            row = []
            for j in range(PIXELS):
                x, y = j / PIXELS - 0.5, i / PIXELS - 0.5
                v = sum(t * math.exp(-((x - a) / p) ** 2 - ((y - b) / q) ** 2) for a, b, p, q, t in blobs)
                v += sum(t for a, b, p, q, t in boxes if a < x < a + p and b < y < b + q)
                row.append(min(255, int(v)))
            pixels.append(row)
        png(folder / "scene.png", pixels)
        return ["--scene", "scene.png", "--scene-cell", f"{field / PIXELS}rad", "--scene-min", "0K", "--scene-max", "300K"], None
    lines, total = ["l_rad,m_rad,flux_jy,major_rad,minor_rad,pa_rad"], 0.0
    for k in range(rng.randint(1, 8)):
        l, m, flux = rng.uniform(-0.25, 0.25) * field, rng.uniform(-0.25, 0.25) * field, 10 ** rng.uniform(-1, 1)
        wide = kind == "extended" or (kind == "mixed" and k % 2 == 0)
        major = rng.uniform(0.02, 0.1) * field if wide else 0.0
        lines.append(f"{l},{m},{flux},{major},{major * rng.uniform(0.3, 1)},{rng.uniform(0, 3)}")
        total += flux
    (folder / "scene.csv").write_text("\n".join(lines) + "\n")
    return ["--scene", "scene.csv"], total


def case(seed):
    rng = random.Random(seed)
    kind = rng.choice(["y", "golden", "random", "ring", "reuleaux", "spiral"])
    n = int(12 * (100 / 12) ** rng.random())
    n = n // 3 * 3 if kind == "y" else n
    sky = rng.choice(["points", "extended", "mixed", "kelvin"])
    degrees = rng.uniform(0, 180)
    # Small errors are where the most harm can be done, so a third of the cases has them.
    degrees = rng.uniform(0, 10) if rng.random() < 0.33 else degrees
    amplitude = rng.uniform(0, 0.5) if rng.random() < 0.5 else 0.0
    snr = 10 ** rng.uniform(math.log10(3), 3)
    diameter = rng.uniform(0.5, 2.0)
    field = PIXELS * WAVE_M / diameter / 5
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rows = "".join(f'[[antenna]]\nname = "A{k}"\nposition_m = [{x}, {y}, 0.0]\ntsys_k = 600.0\ndiameter_m = 0.008\n\n' for k, (x, y) in enumerate(layout(rng, kind, n, diameter)))
        (folder / "layout.toml").write_text(f'name = "case {seed}"\nframe = "boresight"\nsource = "drawn"\n\n{rows}')
        words, total = scene(rng, sky, folder, field)
        observe = ["simulate", "--layout", "layout.toml", *words, "--freq", f"{FREQ_HZ}Hz", "--bandwidth", f"{BAND_HZ}Hz", "--channels", CHANNELS]
        if total is None:
            # Thermal noise of 600 K. 100 ms give a visibility of such scenes a ratio of about 30.
            noise = ["--noise", "--integration", f"{0.1 * (snr / 30) ** 2}s"]
        else:
            sefd = total / snr * math.sqrt(2 * BAND_HZ / CHANNELS * 0.1)
            noise = ["--sefd", f"{sefd}Jy", "--integration", "100ms"]
        cittert(folder, *observe, *noise, "--seed", seed, "-o", "good.uvh5")
        errors = ["--phase-rms", f"{degrees}deg", *(["--amp-rms", amplitude] if amplitude else []), "--seed", seed + 1]
        cittert(folder, "corrupt", "good.uvh5", "-o", "bad.uvh5", "--gains", "truth.calh5", *errors)
        cittert(folder, "corrupt", "good.uvh5", "-o", "same.uvh5", "--gains", "unity.calh5", "--phase-rms", "0deg")
        mode = ["--mode", "amp-phase"] if amplitude else []
        image = ["--size", PIXELS, "--cell", f"{field / PIXELS}rad"]
        result, _ = cittert(folder, "selfcal", "bad.uvh5", "-o", "sc", "--solint", "inf", *mode, *image)
        free = ["--gradient", *(["--flux-scale"] if amplitude else [])]
        before, _ = cittert(folder, "compare", "unity.calh5", "truth.calh5", *free)
        after, _ = cittert(folder, "compare", "sc.calh5", "truth.calh5", *free)
        for data in ("good", "bad", "sc"):
            cittert(folder, "dirty", f"{data}.uvh5", "-o", f"{data}-seen.fits", *image)
        seen = [cittert(folder, "compare", f"{data}-seen.fits", "good-seen.fits", "--shift")[0]["error_over_grey_card"] for data in ("bad", "sc")]
    judgement = result["judgement"]
    return {
        "seed": seed, "layout": kind, "n": n, "scene": sky, "phase_deg": degrees, "amplitude": amplitude, "snr": snr,
        "before_rad": before["rms_phase_rad"], "after_rad": after["rms_phase_rad"],
        "amp_before": before["rms_amplitude"], "amp_after": after["rms_amplitude"], "accepted": result["accepted"], "algorithm": result["rounds_algorithm"],
        **{k: judgement.get(k) for k in ("misfit_before", "misfit_after", "sigmas", "explained", "gain_rms", "gain_sigma")},
        "verdict": result["verdict"], "image_before": seen[0], "image_after": seen[1],
    }


# A difference below this is noise of the solution.
SAME_RAD = 0.01


def page(done, failed):
    """The page of the book: what was drawn, and every case."""
    kinds = ["points", "extended", "mixed", "kelvin"]
    median = lambda values: sorted(values)[len(values) // 2] if values else float("nan")
    rows = []
    for kind in kinds:
        of = [c for c in done if c["scene"] == kind]
        yes = [c for c in of if c["accepted"]]
        worse = [c for c in of if c["after_rad"] > c["before_rad"] + SAME_RAD]
        better = [c for c in yes if c["image_after"] < c["image_before"]]
        rows.append(f"| {kind} | {len(of)} | {len(yes)} | {median([c['before_rad'] for c in yes]):.3f} | {median([c['after_rad'] for c in yes]):.4f} | {len(worse)} | "
                    f"{median([c['image_before'] for c in yes]):.3f} | {median([c['image_after'] for c in yes]):.3f} | {len(better)} |")
    cases = [
        f"| {c['seed']} | {c['layout']} {c['n']} | {c['scene']} | {c['phase_deg']:.0f}, {c['amplitude']:.2f} | {c['snr']:.0f} | {c['before_rad']:.3f} | {c['after_rad']:.3f} | "
        f"{c['amp_before']:.3f} | {c['amp_after']:.3f} | {c['image_before']:.3f} | {c['image_after']:.3f} | {'yes, ' + c['algorithm'] if c['accepted'] else 'no'} |"
        for c in sorted(done, key=lambda c: c["seed"])
    ]
    worse = [c for c in done if c["after_rad"] > c["before_rad"] + SAME_RAD]
    told = "; ".join(
        f"case {c['seed']} from {c['before_rad']:.3f} to {c['after_rad']:.3f} with a stated standard deviation of a gain of {c['gain_sigma']:.3f}, "
        f"its amplitude error from {c['amp_before']:.3f} to {c['amp_after']:.3f}, the error of its image from {c['image_before']:.2f} to {c['image_after']:.2f}" for c in worse)
    return "\n".join([
        "# Self-calibration of random cases", "",
        "Each case is drawn from its seed: a layout of 12 to 100 elements, a scene of points, of extended sources, of both (in Jy) or a thermal scene (in kelvin), phase errors",
        "of 0 to 180 degrees rms, in half of the cases amplitude errors of up to 50 per cent, and noise that gives a visibility a signal to noise ratio of 3 to 1000. All elements",
        "look once at 94 GHz, 8 channels over 8 GHz. `selfcal` has default options, a solution interval of `inf`, and mode `amp-phase` where there are amplitude errors. Errors of",
        "phases are rms, without the common phase and the phase gradient that shifts the image. `tests/trials/selfcal_cases.py` draws the cases and writes this page.", "",
        f"{len(done)} cases, {len(failed)} that ended in an error. Worse by more than {SAME_RAD} rad after self-calibration: {len(worse)}{': ' + told if worse else ''}.", "",
        "The error of an image is that of the dirty image, with natural weights, against the dirty image of the data without errors, shifted onto it; in units of the",
        "error of a grey card.", "",
        "| scene | cases | accepted | median phase error before, rad, of those accepted | after | worse | median error of the image before, of those accepted | after | better images |",
        "|---|---|---|---|---|---|---|---|---|", *rows, "",
        "Where the calibration is not accepted, the data are as they were. This is right where there is nothing to win, and the price of caution elsewhere: few elements, large errors",
        "or a scene that fills much of the field leave the held-out baselines unpredicted.", "",
        "| case | layout | scene | phases (deg), amplitudes | S/N | phase error before, rad | after | amplitude error before | after | image before | after | accepted |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|", *cases, "",
    ])


def main():
    options = argparse.ArgumentParser()
    options.add_argument("--cases", type=int, default=200)
    options.add_argument("--first", type=int, default=1)
    options.add_argument("--jobs", type=int, default=2)
    options.add_argument("--json", type=Path)
    options.add_argument("--markdown", type=Path, help="write the page of the book")
    args = options.parse_args()
    done, failed = [], []
    with concurrent.futures.ProcessPoolExecutor(args.jobs) as pool:
        jobs = {pool.submit(case, seed): seed for seed in range(args.first, args.first + args.cases)}
        for job in concurrent.futures.as_completed(jobs):
            try:
                c = job.result()
            except Exception as e:
                c = {"seed": jobs[job], "error": str(e)}
                failed.append(c)
                print(c, flush=True)
                continue
            done.append(c)
            worse = "WORSE" if c["after_rad"] > c["before_rad"] + SAME_RAD else ""
            number = lambda x: "-" if x is None else f"{x:.4f}"
            print(f"{c['seed']:4d} {c['layout']:8s} {c['n']:3d} {c['scene']:8s} {c['phase_deg']:6.1f} deg amp {c['amplitude']:.2f} snr {c['snr']:6.1f}: "
                  f"{c['before_rad']:.3f} -> {c['after_rad']:.3f} rad, amp {c['amp_before']:.3f} -> {c['amp_after']:.3f} {'yes' if c['accepted'] else 'no '} {c['algorithm']:10s} "
                  f"misfit {number(c['misfit_before'])} {number(c['misfit_after'])} z {number(c['sigmas'])} E {number(c['explained'])} g {number(c['gain_rms'])} s {number(c['gain_sigma'])} {worse}", flush=True)
            if args.json:
                args.json.write_text("\n".join(json.dumps(d) for d in sorted(done, key=lambda d: d["seed"])) + "\n")
    if args.markdown:
        args.markdown.write_text(page(done, failed))
    sys.exit(any(c["after_rad"] > c["before_rad"] + SAME_RAD for c in done))


if __name__ == "__main__":
    main()
