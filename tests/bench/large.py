"""Prints the tables of docs/algorithms/cost.md that no machine at hand can measure: many threads, 10^10 visibilities, and the size of SKA-Low.

    python3 tests/bench/large.py PROGRAM b.uvh5 [--speeds FILE]

`b.uvh5` is workload b (tests/peers/workloads). All speeds are those of the fit. Nothing but the set that stands for SKA-Low is made: 0.6 GB in a temporary folder.
"""

import argparse, json, math, random, subprocess, tempfile
from pathlib import Path

MACHINE = Path(__file__).resolve().parent.parent.parent / "src/cost/machines/intel-xeon.toml"
B = ["--size", 2048, "--cell", "0.25arcsec"]
# The course of a rehearsal counts, on every number of threads.
B_CLEAN = [*B, "--rehearse", "10min", "--weighting", "briggs", "--robust", 0, "--algorithm", "clark", "--niter", 10000, "--mgain", 0.85]
LARGE = ["--size", 16384, "--cell", "0.05arcsec", "--visibilities", "1e10", "--node-memory", "128GiB", "--network", "25Gbit/s", "--storage", "20GB/s"]
SKA = ["--size", 16384, "--cell", "1.5arcsec", "--visibilities", "1.2e13", "--nodes", 256, "--network", "100Gbit/s", "--storage", "1TB/s"]
# In double precision, the default under mpirun, the planes of these images do not fit.
CLEAN = ["--niter", 100000, "--algorithm", "clark", "--startmod", "never", "--epsilon", "1e-5"]


def shown(seconds):
    """A time as the page shows it."""
    for limit, unit, one in [(120, "s", 1), (7200, "min", 60), (172800, "h", 3600), (math.inf, "d", 86400)]:
        if seconds < limit:
            return f"{seconds / one:.{0 if seconds / one >= 10 else 1}f} {unit}"


class Forecasts:
    def __init__(self, program, speeds):
        self.program, self.speeds = program, speeds

    def of(self, command, file, options, threads):
        words = [self.program, "--json", "--threads", threads, command, file, "-o", "none.fits" if command == "dirty" else "none", *options]
        told = subprocess.run([*map(str, words), "--dry-run", "--speeds", self.speeds], capture_output=True, text=True, check=True)
        return json.loads(told.stdout.splitlines()[-1])

    def on_nodes(self, file, options, threads):
        """The cells of a row: time and memory of `dirty`, of the same with natural weights and of `clean`, and what breaks first."""
        row, limits = [], []
        for command, more in [("dirty", []), ("dirty", ["--weighting", "natural"]), ("clean", CLEAN)]:
            cluster = self.of(command, file, [*options, *more], threads)["cluster"]
            row += [shown(cluster["seconds"]), f"{cluster['rank_bytes'] / 1e9:.3g} GB"]
            limits.append(f"{cluster['limit']} {100 * cluster['limit_part']:.0f} %")
        return " | ".join(row) + f" |    first: {', '.join(limits)}"


def ska_low(folder, program):
    """512 stations, half of them even over a core of 1 km, half with even logarithms of the distance to 65 km across, seen for four hours."""
    draw, lines = random.Random(1), ['name = "512 stations"', 'frame = "enu"', "[site]", "latitude_deg = -26.82", "longitude_deg = 116.76", "altitude_m = 365.0"]
    for k in range(512):
        distance = 500 * math.sqrt(draw.random()) if k < 256 else 500 * 65 ** draw.random()
        angle = math.tau * draw.random()
        east, north = distance * math.cos(angle), distance * math.sin(angle)
        lines += ["", "[[antenna]]", f'name = "S{k}"', f"position_m = [{east:.3f}, {north:.3f}, 0.0]", "diameter_m = 38.0"]
    (folder / "low.toml").write_text("\n".join(lines) + "\n")
    (folder / "one.csv").write_text("l_rad,m_rad,flux_jy\n0.001,0.002,1\n")
    words = ["simulate", "--layout", "low.toml", "--scene", "one.csv", "--freq", "140MHz", "--bandwidth", "50MHz", "--channels", 64, "--phase-center",
             "12h00m00s,-27d00m00s", "--hour-angle", "-2h,2h", "--start", "2026-06-01T00:00:00", "--integration", "30min", "-o", "low.uvh5"]
    subprocess.run([str(program), *map(str, words)], cwd=folder, check=True, capture_output=True)
    return folder / "low.uvh5"


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("program", type=lambda path: Path(path).resolve())
    p.add_argument("b")
    p.add_argument("--speeds", default=MACHINE)
    args = p.parse_args()
    forecasts = Forecasts(args.program, args.speeds)
    print("threads | dirty | clean")
    for threads in [1, 2, 4, 8, 16, 64]:
        dirty = forecasts.of("dirty", args.b, [*B, "--weighting", "natural"], threads)["seconds"]
        print(f"| {threads} | {dirty:.2f} | {forecasts.of('clean', args.b, B_CLEAN, threads)['seconds']:.1f} |")
    print("machines | dirty | memory | natural | memory | clean | memory")
    for nodes in [1, 8, 64]:
        print(f"| {nodes} | {forecasts.on_nodes(args.b, [*LARGE, '--nodes', nodes], 16)}")
    with tempfile.TemporaryDirectory() as folder:
        low = ska_low(Path(folder), args.program)
        print("memory of a machine | dirty | memory | natural | memory | clean | memory")
        for memory in ["512GiB", "2TiB"]:
            print(f"| {memory} | {forecasts.on_nodes(low, [*SKA, '--node-memory', memory], 64)}")


if __name__ == "__main__":
    main()
