"""Sets converted to another format and back, and real files converted to every format. pyuvdata compares the contents."""
import os
import subprocess
import tarfile
import warnings

import h5py
import numpy as np
import pytest
from pyuvdata import UVData
from test_ms import assert_same, sky_set, strict

VISIBILITIES = os.path.join(os.environ["CITTERT_DATA"], "visibilities")
FILES = sorted(os.listdir(VISIBILITIES))


@pytest.mark.parametrize("form", ["uvfits", "ms"])
@pytest.mark.parametrize("pols", [("xx", "yy"), ("rr", "ll", "rl", "lr")], ids=["linear", "circular"])
def test_there_and_back(cittert, form, pols):
    # Antennas of UVFITS are counted from 1.
    uv = sky_set(pols, first=1, spread=True)
    uv.write_uvh5(cittert.path("x.uvh5"))
    cittert("convert", "x.uvh5", f"y.{form}")
    assert_same(uv, strict(f"read_{form}", cittert.path(f"y.{form}")))
    cittert("convert", f"y.{form}", "z.uvh5")
    assert_same(uv, strict("read_uvh5", cittert.path("z.uvh5")))


@pytest.mark.parametrize("form", ["uvfits", "ms"])
def test_weights_come_back(cittert, form):
    """Simulated noise sets weights, which pyuvdata does not read. The test compares them as they are stored in the files."""
    with open(cittert.path("s.csv"), "w") as f:
        f.write("ra_deg,dec_deg,flux_jy\n202.9,30.6,1.0\n")
    track = ["--phase-center", "202.7845deg,30.5092deg", "--start", "2025-06-01T01:30:00", "--duration", "5min", "--integration", "60s"]
    band = ["--freq", "1.4GHz", "--bandwidth", "10MHz", "--channels", 2, "--method", "dft", "--noise", "--sefd", "420Jy"]
    cittert("simulate", "--layout", "vla-d", "--scene", "s.csv", *band, *track, "-o", "x.uvh5")
    cittert("convert", "x.uvh5", f"y.{form}")
    cittert("convert", f"y.{form}", "z.uvh5")
    read = []
    for name in ("x.uvh5", "z.uvh5"):
        uv = strict("read_uvh5", cittert.path(name))
        with h5py.File(cittert.path(name)) as f:
            weights = f["Data/weights"][()] if "Data/weights" in f else f["Data/nsamples"][()]
            key = list(zip(f["Header/time_array"][()].round(6), f["Header/ant_1_array"][()], f["Header/ant_2_array"][()]))
            pols = list(f["Header/polarization_array"][()])
        order = sorted(range(len(key)), key=lambda k: key[k])
        read.append((uv, weights[order], pols))
    (a, wa, pa), (b, wb, pb) = read
    assert wa.max() > 0
    # A set of Stokes I is exported as two hands of half the weight each.
    if pa != pb:
        assert pa == [1] and pb == [-1, -2]
        assert np.allclose(wb.sum(axis=2), wa[:, :, 0], rtol=1e-6)
    else:
        assert np.allclose(wa, wb, rtol=1e-6)
    assert np.abs(a.telescope.antenna_positions - b.telescope.antenna_positions).max() < 1e-4


def read(path):
    uv = UVData()
    with warnings.catch_warnings():
        # Real files have old keywords, and autocorrelations that are not exactly real.
        warnings.simplefilter("ignore")
        more = {"ignore_single_chan": False} if str(path).endswith(".ms") else {}
        uv.read(str(path), run_check=False, **more)
    return uv


def phased_alike(theirs, ours):
    """Let pyuvdata phase a drift scan to the phase centres of the export."""
    for time in np.unique(theirs.time_array):
        center = ours.phase_center_catalog[ours.phase_center_id_array[np.abs(ours.time_array - time) < 1e-8][0]]
        theirs.phase(lon=center["cat_lon"], lat=center["cat_lat"], phase_frame="icrs", epoch=2000, cat_name=f"t{time}",
                     select_mask=theirs.time_array == time)  # fmt: skip


def phase_if_drifting(theirs, ours, form):
    """Return True where the format needs phased visibilities and the set had none. `theirs` is then phased as well."""
    if form == "uvh5" or all(c["cat_type"] == "sidereal" for c in theirs.phase_center_catalog.values()):
        return False
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        phased_alike(theirs, ours)
    return True


def by_row(uv):
    """The order of rows by time (to 10 ms) and baseline, and for each row whether its antennas must be exchanged to put the lower number first."""
    a, b = uv.ant_1_array, uv.ant_2_array
    order = np.lexsort((np.maximum(a, b), np.minimum(a, b), np.round(uv.time_array * 8.64e6)))
    return order, (a > b)[order]


def assert_equal_sets(theirs, ours, note):
    names = [dict(zip(uv.telescope.antenna_numbers, map(str, uv.telescope.antenna_names))) for uv in (theirs, ours)]
    (i, turn_i), (k, turn_k) = by_row(theirs), by_row(ours)
    assert len(i) == len(k), note
    for one, other in (("ant_1_array", "ant_2_array"),):
        for row in (0, len(i) // 2, len(i) - 1):
            pair = [{names[0][getattr(theirs, c)[i[row]]] for c in (one, other)}, {names[1][getattr(ours, c)[k[row]]] for c in (one, other)}]
            assert pair[0] == pair[1], note
    longest = np.abs(theirs.uvw_array).max()
    sign = [np.where(t, -1.0, 1.0)[:, None] for t in (turn_i, turn_k)]
    assert np.abs(theirs.uvw_array[i] * sign[0] - ours.uvw_array[k] * sign[1]).max() <= 1e-6 * longest, note
    assert np.abs(theirs.time_array[i] - ours.time_array[k]).max() < 1e-3 / 86400, note
    frequencies = [np.ravel(uv.freq_array) for uv in (theirs, ours)]
    channel = [np.argsort(f) for f in frequencies]
    np.testing.assert_allclose(frequencies[0][channel[0]], frequencies[1][channel[1]], rtol=1e-12)
    ours_of = {p: n for n, p in enumerate(ours.polarization_array)}
    # Stokes I is exported as two equal hands.
    hands = 1 in theirs.polarization_array and 1 not in ours_of
    if hands:
        ours_of[1] = ours_of[-1]
    crossed = {-3: -4, -4: -3, -7: -8, -8: -7}
    for n, p in enumerate(theirs.polarization_array):
        vis, flag, samples = [], [], []
        for uv, order, turn, chans, place in ((theirs, i, turn_i, channel[0], lambda q, own=theirs: list(own.polarization_array).index(q)),
                                              (ours, k, turn_k, channel[1], ours_of.get)):  # fmt: skip
            straight, other = place(p), place(crossed.get(p, p))
            other = straight if other is None else other
            pick = lambda x: np.where(turn[:, None], x[order][:, chans, other], x[order][:, chans, straight])  # noqa: E731
            v = pick(uv.data_array)
            vis.append(np.where(turn[:, None], v.conj(), v))
            flag.append(pick(uv.flag_array))
            samples.append(pick(uv.nsample_array))
        # In some formats a weight that is not positive means a flag. Samples without weight therefore count as flagged.
        bad, worse = [f | ~np.isfinite(s) | (s <= 0) | ~np.isfinite(v) for f, s, v in zip(flag, samples, vis)]
        assert (bad == worse).all(), (note, p)
        if (~bad).any():
            scale = np.abs(vis[0][~bad]).max()
            assert np.abs(vis[0] - vis[1])[~bad].max() <= 2e-6 * scale, (note, p)
            assert hands or np.allclose(samples[0][~bad], samples[1][~bad], rtol=1e-5), (note, p)


def where(uv):
    positions = uv.telescope.antenna_positions + uv.telescope._location.xyz()
    return dict(zip(map(str, uv.telescope.antenna_names), positions))


@pytest.mark.parametrize("form", ["uvh5", "uvfits", "ms"])
@pytest.mark.parametrize("name", FILES)
def test_real_files_keep_their_content(cittert, name, form):
    path = os.path.join(VISIBILITIES, name)
    if name.endswith(".tar.gz"):
        with tarfile.open(path) as tar:
            tar.extractall(cittert.folder, filter="data")
        (path,) = [cittert.path(n) for n in os.listdir(cittert.folder) if n.endswith(".ms")]
    out = cittert.path(f"out.{form}")
    theirs = read(path)
    # With a compression a UVH5 file is written anew. Otherwise it would be copied.
    said = cittert("convert", path, out, *(["--compression", "none"] if form == "uvh5" else [])).stderr
    ours = read(out)
    if phase_if_drifting(theirs, ours, form):
        assert "does not follow the sky" in said and "does not follow the sky" in ours.history
    assert_equal_sets(theirs, ours, f"{name} as {form}")
    places = [where(uv) for uv in (theirs, ours)]
    for antenna in places[0].keys() & places[1].keys():
        assert np.abs(places[0][antenna] - places[1][antenna]).max() < 1e-3, (antenna, places[0][antenna], places[1][antenna])
    assert len(places[0].keys() & places[1].keys()) == len(places[0])


def test_the_samples_of_the_library_are_read(cittert):
    """pyuvdata and astropy read the sets, gains and images of the library's example `samples`. Every warning is an error."""
    root = os.path.join(os.path.dirname(__file__), "..", "..")
    subprocess.run([os.environ["CITTERT_SAMPLES"], cittert.folder], check=True)
    script = os.path.join(root, "formats", "tests", "interop", "read_samples.py")
    run = subprocess.run([os.environ["CITTERT_PY"], script, str(cittert.folder)], capture_output=True, text=True)
    assert run.returncode == 0, run.stdout + run.stderr


def test_casa_reads_the_images_of_cittert(cittert):
    import casatools

    subprocess.run([os.environ["CITTERT_SAMPLES"], cittert.folder], check=True)
    from casatasks import importfits

    importfits(cittert.path("cube.fits"), cittert.path("cube.image"))
    image = casatools.image()
    image.open(cittert.path("cube.image"))
    data, coordinates = image.getchunk(), image.coordsys()
    row, column = np.unravel_index(np.argmax(data[:, :, 0, 0]), data.shape[:2])
    at = image.toworld([row, column, 0, 0], "n")["numeric"]
    image.close()
    assert coordinates.names()[:2] == ["Right Ascension", "Declination"]
    ra, dec = at[:2]
    l = np.cos(dec) * np.sin(ra - 1.0)
    m = np.sin(dec) * np.cos(0.5) - np.cos(dec) * np.sin(0.5) * np.cos(ra - 1.0)
    assert abs(l - 0.012) < 1e-9 and abs(m - 0.005) < 1e-9
