"""Real sets of many makers, changed in place: what the command does not name stays bit for bit as it was."""
import os
import shutil
import subprocess
import sys
import tarfile
import warnings

import h5py
import numpy as np
import pytest
from casacore import tables
from contents import changed, contents
from pyuvdata import UVData

VISIBILITIES = os.path.join(os.environ["CITTERT_DATA"], "visibilities")
EHT, EHT_2 = "eht_m87_2017_096_lo.uvfits", "eht_m87_2017_100_lo.uvfits"
HERA, MWA, PAPER, PYUVSIM = "hera_zen.2458432.34569.uvh5", "mwa_birli.ms.tar.gz", "paper_redundant.uvfits", "pyuvsim_ref_1.1_uniform.uvfits"
# Who wrote the file that is changed: the maker of the public file, pyuvdata, or CASA from the public file.
SETS = {
    "hera": (HERA, "as it is", "uvh5"),
    "mwa": (MWA, "as it is", "ms"),
    "eht-casa": (EHT, "casa", "ms"),
    "eht-2-casa": (EHT_2, "casa", "ms"),
    "pyuvsim-casa": (PYUVSIM, "casa", "ms"),
    "vla-casa": ("simulated", "casa", "ms"),
    "eht-2-pyuvdata": (EHT_2, "pyuvdata", "uvh5"),
    "paper-pyuvdata": (PAPER, "pyuvdata", "uvh5"),
    "pyuvsim-pyuvdata": (PYUVSIM, "pyuvdata", "uvh5"),
    "pyuvsim-pyuvdata-ms": (PYUVSIM, "pyuvdata", "ms"),
    "eht-2": (EHT_2, "as it is", "uvfits"),
    "pyuvsim": (PYUVSIM, "as it is", "uvfits"),
}
MODEL = "l_rad,m_rad,flux_jy\n0.0,0.0,2.0\n"
HISTORY_OF_MS = {"HISTORY: rows"} | {
    f"HISTORY.{c}" for c in ("APP_PARAMS", "APPLICATION", "CLI_COMMAND", "MESSAGE", "OBJECT_ID", "OBSERVATION_ID", "ORIGIN", "PRIORITY", "TIME")
}
HISTORY = {"ms": HISTORY_OF_MS, "uvh5": {"Header/history", "Header/history: storage"}, "uvfits": {"history"}}


def placed(cittert, kind):
    """The set under the name x.FORMAT, with things that no program knows."""
    name, maker, form = SETS[kind]
    source, path = os.path.join(VISIBILITIES, name), cittert.path(f"x.{form}")
    if name == "simulated":
        here = os.path.dirname(os.path.abspath(__file__))
        subprocess.run([sys.executable, os.path.join(here, "simulated_set.py"), path], cwd=cittert.folder, check=True, capture_output=True)
        fill(path)
    elif name.endswith(".tar.gz"):
        with tarfile.open(source) as tar:
            tar.extractall(cittert.folder, filter="data")
        os.rename(cittert.path("1090008640_birli.ms"), path)
    elif maker == "as it is":
        shutil.copyfile(source, path)
    elif maker == "casa":
        from casatasks import importuvfits

        importuvfits(source, path)
    else:
        uv = UVData()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            uv.read(source, run_check=False)
            uv.extra_keywords |= {"foo": 3, "comment_of_mine": "a text", "ratio": 0.25}
            getattr(uv, f"write_{form}")(path, run_check=False)
    with open(cittert.path("s.csv"), "w") as f:
        f.write(MODEL)
    if form == "ms":
        add_to_ms(path)
    elif form == "uvh5":
        with h5py.File(path, "a") as f:
            f["Mine/numbers"] = np.arange(1000.0)
            f["Mine"].attrs["mine"] = "kept"
            f["Data/visdata"].attrs["units"] = "Jy"
            if "x_orientation" not in f["Header"]:
                f["Header/x_orientation"] = np.bytes_("north")
    return path, form


def fill(path):
    """Give a simulated set data, weights that differ between channels, flags and an observer."""
    rng = np.random.default_rng(2)
    with tables.table(path, readonly=False, ack=False) as t:
        for row in range(t.nrows()):
            shape = t.getcell("DATA", row).shape
            for column in ("DATA", "CORRECTED_DATA"):
                t.putcell(column, row, (rng.normal(size=shape) + 1j * rng.normal(size=shape)).astype("c8"))
            t.putcell("WEIGHT_SPECTRUM", row, rng.uniform(1, 2, size=shape).astype("f4"))
            t.putcell("FLAG", row, rng.uniform(size=shape) < 0.1)
    with tables.table(f"{path}/OBSERVATION", readonly=False, ack=False) as t:
        t.putcell("OBSERVER", 0, "A. Nobody")


def add_to_ms(path):
    """An additional column, keywords and a subtable."""
    with tables.table(path, readonly=False, ack=False) as t:
        t.addcols(tables.maketabdesc(tables.makescacoldesc("MINE", 0.0)))
        t.putcol("MINE", np.random.default_rng(1).normal(size=t.nrows()))
        t.putkeyword("MY_KEYWORD", {"one": 1, "list": np.arange(3.0)})
        t.putcolkeyword("UVW", "MY_NOTE", "kept")
        notes = tables.table(os.path.join(path, "MY_NOTES"), tables.maketabdesc(tables.makescacoldesc("TEXT", "")), nrow=2, ack=False)
        notes.putcol("TEXT", ["one", "two"])
        t.putkeyword("MY_NOTES", notes)
        notes.close()


def assert_history_grew(path, form, before):
    if form != "ms":
        return
    with tables.table(f"{path}/HISTORY", ack=False) as t:
        lines = t.getcol("MESSAGE")
    assert "cittert" in lines[-1] and len(lines) > int(before["HISTORY: rows"])


def added(name, form):
    """Everything about a new column."""
    return {f"MAIN.{name}", f"MAIN.{name}: keywords", f"MAIN.{name}: description"} if form == "ms" else {name, f"{name}: storage", f"{name}: attributes"}


def written(name, form, before):
    """What differs after a column was written: everything about a new one, the values alone of one that was there."""
    names = added(name, form)
    values = f"MAIN.{name}" if form == "ms" else name
    return {values} if values in before else names


@pytest.mark.parametrize("kind", [k for k, v in SETS.items() if v[2] != "uvfits"])
def test_a_prediction_changes_its_columns_alone(cittert, kind):
    path, form = placed(cittert, kind)
    before = contents(path)
    model, residual = ("MODEL_DATA", "CORRECTED_DATA") if form == "ms" else ("Data/model", "Data/residual")
    cittert("predict", path, "--model", "s.csv", "--into", "model", "-o", path, "--overwrite")
    once = contents(path)
    assert changed(before, once) - HISTORY[form] == written(model, form, before)
    assert changed(before, once) >= HISTORY[form] - {"HISTORY.OBJECT_ID", "HISTORY.OBSERVATION_ID"}
    assert_history_grew(path, form, before)
    # A column that is there is replaced, and a copy in another place is the same.
    cittert("predict", path, "--model", "s.csv", "--into", "model,residual", "-o", cittert.path(f"y.{form}"))
    assert contents(path) == once
    twice = contents(cittert.path(f"y.{form}"))
    assert changed(once, twice) - HISTORY[form] == written(residual, form, once)


@pytest.mark.parametrize("kind", SETS)
def test_calibration_changes_data_flags_and_weights_alone(cittert, kind):
    path, form = placed(cittert, kind)
    cittert("corrupt", path, "-o", "c.uvh5", "--gains", "g.calh5", "--seed", 5, "--phase-rms", "1rad", "--amp-rms", "0.2")
    if form != "uvfits":
        cittert("predict", path, "--model", "s.csv", "--into", "model", "-o", path, "--overwrite")
    before = contents(path)
    cittert("applycal", path, "g.calh5", "-o", path, "--overwrite")
    after = contents(path)
    named = {
        "ms": {"MAIN.DATA", "MAIN.FLAG", "MAIN.WEIGHT", "MAIN.SIGMA", "MAIN.SIGMA_SPECTRUM"} | added("WEIGHT_SPECTRUM", "ms"),
        "uvh5": {"Data/visdata", "Data/visdata: storage", "Data/flags"} | added("Data/weights", "uvh5"),
        "uvfits": {"rest"},
    }[form]
    if kind == "hera":
        # Integers cannot hold calibrated data: the dataset is made anew.
        named |= {"Data/visdata: attributes"}
    assert changed(before, after) - HISTORY[form] <= named, changed(before, after) - HISTORY[form] - named
    assert {"ms": "MAIN.DATA", "uvh5": "Data/visdata", "uvfits": "rest"}[form] in changed(before, after)
    assert_history_grew(path, form, before)
    if form == "uvfits":
        assert_only_groups_change(path, before["rest"], after["rest"])
    # The gains are put back: to rounding, the data are those of the beginning.
    cittert("applycal", path, "g.calh5", "--invert", "-o", path, "--overwrite")
    back = contents(path)
    assert changed(after, back) - HISTORY[form] <= named
    old, new = (data_of(p, form) for p in (placed_again(cittert, kind)[0], path))
    good = np.isfinite(old)
    assert np.abs(new - old)[good].max() <= 1e-5 * np.abs(old[good]).max()


def data_of(path, form):
    """The visibilities of a file, in its own order."""
    if form == "ms":
        with tables.table(path, ack=False) as t:
            return np.concatenate([t.getcell("DATA", row).ravel() for row in range(t.nrows())])
    if form == "uvh5":
        with h5py.File(path) as f:
            values = f["Data/visdata"][()]
        return values["r"] + 1j * values["i"] if values.dtype.names else values
    uv = UVData()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        uv.read(path, run_check=False)
    return uv.data_array


def placed_again(cittert, kind):
    """The set as it was, in a folder of its own."""
    os.makedirs(cittert.path("again"), exist_ok=True)
    other = type(cittert)(cittert.folder / "again")
    return placed(other, kind)


def assert_only_groups_change(path, before, after):
    """The tables after the groups, and the parameters of each group, are as they were."""
    from astropy.io import fits

    with fits.open(path) as f, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        h = f[0].header
        numbers = int(h["PCOUNT"] + np.prod([h[f"NAXIS{k}"] for k in range(2, h["NAXIS"] + 1)]))
        count, groups = h["PCOUNT"], h["GCOUNT"]
    size = 4 * numbers * groups
    assert before[size:] == after[size:]
    parameters = [np.frombuffer(b[:size], ">u4").reshape(groups, numbers)[:, :count] for b in (before, after)]
    assert np.array_equal(*parameters)


@pytest.mark.parametrize("kind", ["hera", "mwa", "pyuvsim", "eht-2-pyuvdata"])
def test_a_conversion_to_the_same_format_loses_nothing(cittert, kind):
    path, form = placed(cittert, kind)
    before = contents(path)
    said = cittert.json("convert", path, cittert.path(f"y.{form}"))
    assert said["lost"] == []
    assert changed(before, contents(cittert.path(f"y.{form}"))) <= HISTORY[form]
    assert contents(path) == before
