"""The machines whose speeds the forecasts know, each with a file in src/cost/machines."""

import os, platform, re, tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
MACHINES, TERMS = ROOT / "src/cost/machines", ROOT / "src/cost/term.rs"


def of_processor(what):
    """A line of /proc/cpuinfo of the first processor."""
    lines = (line.split(":", 1) for line in Path("/proc/cpuinfo").read_text().splitlines() if ":" in line)
    return next((value.strip() for name, value in lines if name.strip() == what), "")


def processor():
    return f"{of_processor('model name') or platform.processor() or 'unknown'}, {os.cpu_count()} processors"


def own_file():
    """The file of this kind of processor. Processors of one name may be of several families, of which the first to be measured has the short name."""
    words = re.sub(r"\((r|tm)\)|processor|cpu|@.*|,.*", " ", processor().lower()).split()
    name = "-".join(words[:2])
    exact = MACHINES / f"{name}-{of_processor('cpu family')}-{of_processor('model')}.toml"
    short = MACHINES / f"{name}.toml"
    return short if short.exists() and not exact.exists() else exact


def read_old(gauges):
    """What is known of this machine, or else of another one as if it were as fast as this one."""
    if own_file().exists():
        return tomllib.loads(own_file().read_text())
    old = tomllib.loads((MACHINES / "intel-xeon.toml").read_text())
    kinds = dict(re.findall(r'^    \w+ = "([a-z0-9.-]+)", (\w+);', TERMS.read_text(), re.M))
    for term, s in old["seconds"].items():
        gauge = f"{kinds[term].lower()}-s"
        if gauge in gauges:
            old["seconds"][term] = s * gauges[gauge] / old["gauges"][gauge]
    return old
