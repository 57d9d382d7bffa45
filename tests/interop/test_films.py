"""ffmpeg reads the films that cittert writes, and encodes those that it does not write itself."""
import os
import shutil
import subprocess

import numpy as np
import pytest

EXAMPLES = os.path.join(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))), "docs", "examples")
SIDE, FRAMES, RATE = 64, 6, 12


def frames(path):
    """Grey levels of all frames [frame, row, column], as ffmpeg decodes them, and the frames per second."""
    assert shutil.which("ffmpeg"), "install ffmpeg, as `make interop` does"
    words = ["ffprobe", "-v", "error", "-show_entries", "stream=r_frame_rate,width,height", "-of", "csv=p=0", path]
    width, height, rate = subprocess.run(words, check=True, capture_output=True, text=True).stdout.strip().split(",")
    words = ["ffmpeg", "-v", "error", "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24", "-fps_mode", "passthrough", "-"]
    raw = subprocess.run(words, check=True, capture_output=True).stdout
    levels = np.frombuffer(raw, np.uint8).reshape(-1, int(height), int(width), 3).mean(axis=3)
    numerator, denominator = map(int, rate.split("/"))
    return levels, numerator / denominator


@pytest.mark.parametrize("ending", ["apng", "gif", "mp4", "webm"])
def test_every_format_holds_the_same_film(cittert, ending):
    path = os.path.join(EXAMPLES, "airport-flight.toml")
    line = ["film", path, "--size", SIDE, "--frames", FRAMES, "--rate", RATE, "--tsys", "500K", "--detectors", 64]
    cittert(*line, "-o", "wanted.png")
    cittert(*line, "-o", f"film.{ending}")
    wanted, _ = frames(cittert.path("wanted.png"))
    found, rate = frames(cittert.path(f"film.{ending}"))
    assert found.shape == wanted.shape == (FRAMES, SIDE, SIDE)
    # A GIF has times in hundredths of a second.
    assert abs(rate / RATE - 1) < (0.05 if ending == "gif" else 1e-9)
    squares = np.mean((found - wanted) ** 2)
    if ending in ("apng", "gif"):
        assert squares == 0
    else:
        # Losses are hardly seen above a peak signal-to-noise ratio of 35 dB.
        assert 10 * np.log10(255**2 / squares) > 35, squares
