#!/usr/bin/env python3
"""Thousands of hostile calls of the program, as a user could make them, on a tiny data set.

    cargo build --release && tests/trials/hostile_cases.py [CLASS ...] [--count N] [--seed 1] [--program target/release/cittert]

| class | what is drawn | calls |
|---|---|---|
| `numbers` | numeric options of all subcommands and keys of configurations: NaN, infinity, 1e300, no unit, a wrong unit, other digits | 20,000 |
| `damage` | files with changed, lost or doubled bytes, and texts with hostile numbers, for the commands that read them | 5,000 |
| `kills` | SIGKILL at a random moment | 500 |
| `signals` | SIGINT, SIGTERM or SIGHUP at a random moment | 100 |
| `disks` | outputs on a disk that becomes full | 100 |
| `pairs` | two commands at once on one file | 100 |
| `paths` | outputs and logs that are inputs, under other names | 200 |

The heads of the modules in `hostile/` say what must hold. Each case is drawn from the seed and its number, so a failure comes again with the same seed.
Each failure is one line with the command; the same failure of the same option is printed once and counted. Calls of more than 10 s are printed as slow: a
person judges whether they made progress. The exit code is 1 where anything failed. Only Python and the program are needed. `--count 100` gives a first
impression in a few minutes.
"""

import argparse
import signal
import sys
import time

from hostile import damage, disks, kills, numbers, pairs, paths
from hostile.bench import Bench

CLASSES = {
    "numbers": (numbers.campaign, 20000),
    "damage": (damage.campaign, 5000),
    "kills": (kills.kills, 500),
    "signals": (kills.signals, 100),
    "disks": (disks.campaign, 100),
    "pairs": (pairs.campaign, 100),
    "paths": (paths.campaign, 200),
}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("classes", nargs="*", metavar="CLASS", help="by default all of them")
    parser.add_argument("--count", type=int, help="number of cases of each class")
    parser.add_argument("--seconds", type=float, help="time after which a class draws no more cases")
    parser.add_argument("--limit", type=float, default=60.0, help="time in seconds after which a call counts as one that never ends")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--program", default="target/release/cittert")
    args = parser.parse_args()
    unknown = [name for name in args.classes if name not in CLASSES]
    if unknown:
        parser.error(f"unknown class {unknown[0]}; the classes are {', '.join(CLASSES)}")
    # A script in the background of a shell ignores these, and so would the program.
    for ignored in (signal.SIGINT, signal.SIGHUP):
        signal.signal(ignored, signal.SIG_DFL)
    bench, rows, failed = Bench(args.program, args.limit, args.seconds), [], 0
    for name in args.classes or CLASSES:
        campaign, count = CLASSES[name]
        count = count if args.count is None else args.count
        bench.counts.clear()
        bench.reported.clear()
        begun = time.monotonic()
        campaign(bench, count, args.seed)
        failures = sum(n for what, n in bench.counts.items() if what.startswith("failed"))
        failed += failures
        details = ", ".join(f"{what} {n}" for what, n in sorted(bench.counts.items()))
        rows.append(f"{name:8} {bench.drawn:6} {failures:7}  {time.monotonic() - begun:6.0f} s  {details}")
    slow = bench.slowest
    bench.close()
    print("class     cases  failed      time  counts")
    print("\n".join(rows))
    print(f"slowest: {slow.seconds:.1f} s, {slow.line}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
