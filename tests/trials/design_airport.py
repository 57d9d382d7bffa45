"""Do 64 optimised elements image a warm scene as well as 100 in a golden-angle disc?

Every layout stands in a disc of 0.6 m, has elements of 10 mm with a system temperature of 600 K and a Gaussian pattern of 9 degrees, and observes each
scene for 10 ms in 16 channels of an 8 GHz band at 94 GHz. `mem` models the scene through the pattern; its prior is the mean temperature that a single element
sees. The error is the rms difference of image and scene in kelvin within the half-power width of the pattern. It needs Python 3 and nothing else:

    CITTERT=target/release/cittert python3 tests/trials/design_airport.py
"""

import argparse
import json
import math
import os
import struct
import subprocess
import tempfile
from pathlib import Path

CITTERT = os.path.abspath(os.environ.get("CITTERT", "target/release/cittert"))
SCENES = Path(__file__).resolve().parents[2] / "phenomenology/scenes"
WIDTH_RAD, PIXELS, CELL_RAD = math.radians(9.0), 256, 1.6e-3
BLOCK = 2880


def cittert(folder, *words):
    run = subprocess.run([CITTERT, "--json", *map(str, words)], cwd=folder, capture_output=True, text=True)
    if run.returncode:
        raise RuntimeError(f"{' '.join(map(str, words))}: {run.stderr[-400:]}")
    return json.loads(run.stdout)


def read(path):
    """The cards of a FITS image and its last plane of pixels."""
    data = path.read_bytes()
    cards, at = {}, 0
    while "END" not in cards:
        cards[data[at:at + 8].decode().strip()] = data[at + 8:at + 80].decode()
        at += 80
    at = -(-at // BLOCK) * BLOCK
    bits, n = (int(cards[k].split("=")[1].split("/")[0]) for k in ("BITPIX", "NAXIS1"))
    code, size = {-32: ("f", 4), -64: ("d", 8)}[bits]
    return data[:at], at, code, struct.unpack(f">{n * n}{code}", data[at:at + n * n * size])


def pattern(n):
    """The power pattern of an element at each pixel."""
    out = []
    for i in range(n):
        for j in range(n):
            l, m = (j - n // 2) * CELL_RAD, (i - n // 2) * CELL_RAD
            out.append(math.exp(-4.0 * math.log(2.0) * math.asin(min(1.0, math.hypot(l, m))) ** 2 / WIDTH_RAD ** 2))
    return out


def error(truth, image, gain):
    inside = [k for k, g in enumerate(gain) if g >= 0.5]
    return math.sqrt(sum((truth[k] - image[k]) ** 2 for k in inside) / len(inside))


def layouts(folder, args):
    made = {}
    for n in (64, 100):
        name = f"optimised{n}"
        cittert(folder, "layout", "optimize", "--elements", n, "--aperture", "0.6m", "--restarts", args.restarts, "--seed", args.seed,
                "--diameter", "10mm", "--tsys", "600K", "-o", f"{name}.toml")
        made[name] = f"{name}.toml"
        for kind, word in (("golden", "fermat"), ("reuleaux", "reuleaux"), ("ring", "ring")):
            cittert(folder, "layout", "make", word, "--elements", n, "--aperture", "0.6m", "--diameter", "10mm", "--tsys", "600K", "-o", f"{kind}{n}.toml")
            made[f"{kind}{n}"] = f"{kind}{n}.toml"
    return made


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", default=["airport", "t-72", "ship", "bmp-1", "security", "runway-fog-3", "runway-fog-1"])
    parser.add_argument("--restarts", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        made = layouts(folder, args)
        gain = pattern(PIXELS)
        print(f"{'scene':14} {'grey card':>9} " + " ".join(f"{k:>12}" for k in made), flush=True)
        for scene in args.scenes:
            # The scene is finer than the pixels of the image; the truth is the mean over each pixel.
            cittert(folder, "scene", "render", SCENES / f"{scene}.toml", "--scene-size", 2 * PIXELS, "--scene-cell", f"{CELL_RAD / 2}rad", "-o", "fine.fits", "--overwrite")
            _, _, _, fine = read(folder / "fine.fits")
            n = 2 * PIXELS
            # Pixel k of the image covers the fine pixels 2 k - 1 (half), 2 k, and 2 k + 1 (half).
            def mean(i, j):
                total = weight = 0.0
                for a, wa in ((-1, 0.5), (0, 1.0), (1, 0.5)):
                    for b, wb in ((-1, 0.5), (0, 1.0), (1, 0.5)):
                        r, c = 2 * i + a, 2 * j + b
                        if 0 <= r < n and 0 <= c < n:
                            total, weight = total + wa * wb * fine[r * n + c], weight + wa * wb
                return total / weight
            truth = [mean(i, j) for i in range(PIXELS) for j in range(PIXELS)]
            seen = sum(t * g for t, g in zip(truth, gain)) / sum(gain)
            half = [t for t, g in zip(truth, gain) if g >= 0.5]
            grey = math.sqrt(sum((t - sum(half) / len(half)) ** 2 for t in half) / len(half))
            line = []
            for file in made.values():
                cittert(folder, "simulate", "--layout", file, "--scene", "fine.fits", "--freq", "94GHz", "--bandwidth", "8GHz", "--channels", 16,
                        "--method", "degrid", "--element", "gaussian", "--element-width", "9deg", "--noise", "--seed", args.seed,
                        "--integration", "10ms", "-o", "v.uvh5", "--overwrite")
                words = ["--size", PIXELS, "--cell", f"{CELL_RAD}rad"]
                cittert(folder, "mem", "v.uvh5", *words, "--prior", f"{seen}K", "--hold-out", 0, "-o", "m", "--overwrite")
                line.append(error(truth, read(folder / "m-image.fits")[3], gain))
            print(f"{scene:14} {grey:9.1f} " + " ".join(f"{e:12.2f}" for e in line), flush=True)


if __name__ == "__main__":
    main()
