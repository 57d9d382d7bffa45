"""The machines whose speeds the forecasts know, each with a file in src/cost/machines."""

import os, platform, re, tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
MACHINES, TERMS = ROOT / "src/cost/machines", ROOT / "src/cost/term.rs"


def processor():
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return f"{line.split(':', 1)[1].strip()}, {os.cpu_count()} processors"
    return platform.processor() or "unknown"


def own_file():
    """The file of this kind of processor."""
    words = re.sub(r"\((r|tm)\)|processor|cpu|@.*|,.*", " ", processor().lower()).split()
    return MACHINES / f"{'-'.join(words[:2])}.toml"


def read_old(gauges):
    """What is known of this machine, or else of another one as if it were as fast as this one."""
    if own_file().exists():
        return tomllib.loads(own_file().read_text())
    old = tomllib.loads((MACHINES / "intel-xeon.toml").read_text())
    kinds = dict(re.findall(r'^    \w+ = "([a-z0-9.-]+)", (\w+);', TERMS.read_text(), re.M))
    for term, s in old["seconds"].items():
        gauge = f"{kinds[term].lower()}-s"
        old["seconds"][term] = s * gauges[gauge] / old["gauges"][gauge]
    return old
