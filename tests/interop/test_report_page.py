"""A browser opens the report of a run and measures it: nothing is wider than the window, every picture is loaded, and the page is not blank."""
import json
import os
import shutil
import subprocess

import pytest

# Debian's name of the browser comes first.
BROWSER = next((b for b in ("chromium", "chromium-browser", "google-chrome") if shutil.which(b)), None)

# Measures the page and writes the numbers into it, where --dump-dom shows them.
MEASURE = """
<script>
window.addEventListener("load", () => {
  const wide = [...document.querySelectorAll("body *")].filter(
    (e) => !e.closest(".scroll, pre, dialog") && e.getBoundingClientRect().right > window.innerWidth + 1);
  const pictures = [...document.querySelectorAll("figure img")];
  const first = document.querySelector("figure a");
  if (first) first.click();
  const out = {
    width: document.documentElement.scrollWidth, window: window.innerWidth, height: document.documentElement.scrollHeight,
    wide: wide.map((e) => e.tagName + " " + e.textContent.slice(0, 60)), pictures: pictures.length,
    empty: pictures.filter((p) => !(p.complete && p.naturalWidth > 300)).length,
    verdict: [...document.querySelectorAll(".verdict p")].map((p) => p.textContent),
    background: getComputedStyle(document.body).backgroundColor, color: getComputedStyle(document.body).color,
    enlarged: document.getElementById("zoom").open, text: document.body.innerText.length,
    raw: [...document.querySelectorAll("td, th")].map((e) => e.textContent).filter((t) => /^[a-z0-9]+(_[a-z0-9]+)+$/.test(t)),
  };
  const place = document.createElement("pre");
  place.id = "measured";
  place.textContent = "BEGIN" + JSON.stringify(out) + "END";
  document.body.append(place);
});
</script>
"""

RUN = """
title = "A page for a browser"
seed = 3
layout = { name = "mm-y" }
scene = { file = "apron.toml", scene-size = 192, scene-cell = "1.2mrad" }
[simulate]
freq = "94GHz"
bandwidth = "4GHz"
channels = 2
noise = true
[image]
size = 192
cell = "1.2mrad"
[[clean]]
algorithm = "hogbom"
niter = 300
[mem]
[corrupt]
phase-rms = "40deg"
[selfcal]
solint = "inf"
rounds = 2
"""


def browse(page, tmp_path, width, *flags):
    """What the browser measures of a page in a window of this width."""
    measured = page.parent / "measured.html"
    measured.write_text(page.read_text().replace("</body>", MEASURE + "</body>"))
    words = [
        BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
        "--disable-component-update", "--disable-sync", f"--user-data-dir={tmp_path / 'browser'}", f"--window-size={width},2400", *flags,
    ]
    dom = subprocess.run([*words, "--dump-dom", measured.as_uri()], capture_output=True, text=True, timeout=120)
    assert dom.returncode == 0, dom.stderr
    text = dom.stdout.split("BEGIN{", 1)[1].split("}END", 1)[0]
    for written, char in (("&lt;", "<"), ("&gt;", ">"), ("&amp;", "&")):
        text = text.replace(written, char)
    shot = page.parent / f"page-{width}.png"
    subprocess.run([*words, f"--screenshot={shot}", page.as_uri()], capture_output=True, timeout=120, check=True)
    return json.loads("{" + text + "}"), shot


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """The report of a small run with errors and self-calibration, or the one that CITTERT_REPORT names."""
    if os.environ.get("CITTERT_REPORT"):
        folder = tmp_path_factory.mktemp("given")
        shutil.copytree(os.path.dirname(os.environ["CITTERT_REPORT"]), folder, dirs_exist_ok=True)
        return folder / "report.html"
    folder = tmp_path_factory.mktemp("run")
    (folder / "run.toml").write_text(RUN)
    docs = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "docs", "examples")
    shutil.copy(os.path.join(docs, "apron.toml"), folder)
    subprocess.run([os.environ["CITTERT"], "run", "run.toml", "-o", "out"], cwd=folder, check=True, capture_output=True)
    return folder / "out" / "report.html"


def test_there_is_a_browser():
    assert BROWSER, "install chromium, as `make interop` does"


@pytest.mark.parametrize("width", [1280, 500])
def test_the_page_fits_its_window(report, tmp_path, width):
    found, shot = browse(report, tmp_path, width)
    assert found["wide"] == [] and found["width"] <= found["window"] + 1, found
    assert found["pictures"] >= 12 and found["empty"] == 0, found
    assert found["height"] > 2000 and found["text"] > 1500
    assert 2 <= len(found["verdict"]) <= 5 and found["raw"] == [], found
    # A click on a picture opens it.
    assert found["enlarged"] is True
    assert distinct_colours(shot) > 100


def test_the_page_is_dark_where_the_reader_wants_it(report, tmp_path):
    light, _ = browse(report, tmp_path, 1280)
    dark, _ = browse(report, tmp_path, 1280, "--force-dark-mode", "--blink-settings=preferredColorScheme=0")

    def level(text):
        return sum(int(part) for part in text[4:-1].split(","))

    assert level(light["background"]) > 600 > 300 > level(light["color"])
    assert level(dark["background"]) < 150 and level(dark["color"]) > 500


def test_the_page_is_small_and_loads_nothing(report):
    text = report.read_text()
    assert len(text) < 3_000_000
    assert "http://" not in text and "https://" not in text


def distinct_colours(path):
    import matplotlib.image

    pixels = (255 * matplotlib.image.imread(path)[:, :, :3]).astype(int)
    return len(set((pixels[::7, ::7, 0] * 65536 + pixels[::7, ::7, 1] * 256 + pixels[::7, ::7, 2]).ravel().tolist()))
