"""Every example of the book runs, and reaches the quality that it states."""
import glob
import json
import os
import tomllib

import pytest

EXAMPLES = os.path.join(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))), "docs", "examples")


def configurations():
    """Names of the examples that `run` or `study` takes, with their contents. The others are scenes and flights."""
    found = {}
    for path in sorted(glob.glob(os.path.join(EXAMPLES, "*.toml"))):
        with open(path, "rb") as f:
            content = tomllib.load(f)
        if "simulate" in content:
            found[os.path.basename(path)] = content
    return found


@pytest.mark.parametrize("name", configurations())
def test_an_example_reaches_its_quality(cittert, name):
    content = configurations()[name]
    assert content.get("quality"), f"{name} states no quality"
    command = "study" if "seeds" in content else "run"
    said = cittert(command, os.path.join(EXAMPLES, name), "-o", "out").stdout
    with open(cittert.path("out/metrics.json")) as f:
        metrics = json.load(f)
    assert metrics["quality"].keys() == content["quality"].keys()
    for key, entry in metrics["quality"].items():
        assert entry["met"], f"{key}: {entry}"
        assert f"quality: {key} is" in said
    assert os.path.getsize(cittert.path("out/report.html")) > 10_000


def test_the_flight_has_a_frame_for_every_moment(cittert):
    path = os.path.join(EXAMPLES, "airport-flight.toml")
    cittert("scene", "fly", path, "--size", 32, "-o", "flight")
    with open(path, "rb") as f:
        content = tomllib.load(f)
    wanted = content["key"][-1]["time_s"] * content["frames_per_second"] + 1
    assert len(glob.glob(cittert.path("flight/frame-*.png"))) == wanted
