"""pyuvdata reads and applies the gains that cittert writes as CalH5, and CASA's gaincal finds the same gains as cittert in the same data."""
import warnings

import numpy as np
import pytest
from pyuvdata import UVCal, UVData
from pyuvdata.utils import uvcalibrate

TRACK = ["--phase-center", "13h31m08.288s,+30d30m32.96s", "--start", "2025-06-01T01:30:00", "--duration", "4min", "--integration", "20s"]
VLA = ["--layout", "vla-c", "--freq", "1.4GHz", "--bandwidth", "64MHz", "--channels", "4", "--method", "dft", "--pols", "RR,LL", *TRACK]


@pytest.fixture
def point(cittert):
    """A set of a point of 1 Jy at the phase centre with noise (v), and the same with gains that change every minute (c)."""
    with open(cittert.path("s.csv"), "w") as f:
        f.write("l_rad,m_rad,flux_jy\n0.0,0.0,1.0\n")
    cittert("simulate", *VLA, "--scene", "s.csv", "--sefd", "420Jy", "-o", "v.uvh5")
    cittert("corrupt", "v.uvh5", "-o", "c.uvh5", "--gains", "t.calh5", "--seed", "5", "--phase-rms", "1rad", "--amp-rms", "0.2",
            "--variation", "interval:60s")  # fmt: skip
    return cittert


def strictly(read, *words, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return read(*words, **options)


def gains(path):
    uvc = UVCal()
    strictly(uvc.read_calh5, path)
    strictly(uvc.check)
    return uvc


def data(path):
    uvd = UVData()
    strictly(uvd.read_uvh5, path)
    return uvd


@pytest.mark.parametrize("inverted", [False, True])
def test_pyuvdata_applies_gains_as_applycal_does(point, inverted):
    uvc = gains(point.path("t.calh5"))
    assert uvc.Nants_data == 27 and uvc.cal_type == "gain" and np.ptp(np.abs(uvc.gain_array)) > 0.1
    of, flag = ("v.uvh5", ["--invert"]) if inverted else ("c.uvh5", [])
    point("applycal", of, "t.calh5", *flag, "-o", "ours.uvh5")
    before = data(point.path(of))
    theirs = uvcalibrate(before, uvc, inplace=False, undo=inverted)
    ours = data(point.path("ours.uvh5"))
    scale = np.abs(before.data_array).max()
    assert not ours.flag_array.any() and not theirs.flag_array.any()
    assert np.abs(ours.data_array - before.data_array).max() > 0.1 * scale
    assert np.abs(ours.data_array - theirs.data_array).max() < 3e-7 * scale


def test_pyuvdata_reads_the_gains_of_selfcal(point):
    point("selfcal", "c.uvh5", "-o", "sc", "--start", "point", "--rounds", "1", "--solint", "60s", "--size", "64", "--cell", "5arcsec",
          "--niter", "50", "--refant", "W02")  # fmt: skip
    uvc = gains(point.path("sc.calh5"))
    names = list(uvc.telescope.antenna_names[[list(uvc.telescope.antenna_numbers).index(a) for a in uvc.ant_array]])
    assert names[0] == "W02" and np.abs(np.angle(uvc.gain_array[0])).max() < 1e-9, "the phases are those against the reference"
    theirs = uvcalibrate(data(point.path("c.uvh5")), uvc, inplace=False)
    assert np.abs(theirs.data_array - data(point.path("sc.uvh5")).data_array).max() < 1e-6


def test_casa_finds_the_same_phases(point):
    from casacore.tables import table
    from casatasks import casalog, gaincal, importuvfits

    casalog.filter("SEVERE")
    ms, cal = point.path("c.ms"), point.path("c.gcal")
    point("convert", "c.uvh5", "c.uvfits")
    importuvfits(fitsfile=point.path("c.uvfits"), vis=ms)
    # CASA names the antennas of the VLA by numbers, cittert by their pads.
    names = table(ms + "/ANTENNA", ack=False).getcol("NAME")
    pads = [antenna.split(":")[-1] for antenna in table(ms + "/ANTENNA", ack=False).getcol("STATION")]
    reference = pads.index("W02")
    # Without a model column gaincal uses a point of 1 Jy at the phase centre as its model.
    gaincal(vis=ms, caltable=cal, solint="60s", refant=names[reference], calmode="p", gaintype="T", minsnr=0.0)
    # One round without a judgement solves the gains of all baselines against the point.
    point("selfcal", "c.uvh5", "-o", "sc", "--start", "point", "--rounds", "1", "--hold-out", "0", "--solint", "60s", "--feeds", "joined",
          "--size", "64", "--cell", "5arcsec", "--niter", "50", "--refant", "W02", "--minsnr", "0")  # fmt: skip
    ours = gains(point.path("sc.calh5"))
    t = table(cal, ack=False)
    times, ant, g = t.getcol("TIME"), t.getcol("ANTENNA1"), t.getcol("CPARAM")[:, 0, 0]
    assert not t.getcol("FLAG").any()
    our_names = [str(ours.telescope.antenna_names[list(ours.telescope.antenna_numbers).index(a)]) for a in ours.ant_array]
    our = ours.gain_array[..., 0]  # [ant, chan, time]
    apart = []
    for k, when in enumerate(np.unique(times)):
        theirs = dict(zip((pads[a] for a in ant[times == when]), g[times == when]))
        # uvw is r1 - r2 in UVFITS and r2 - r1 in UVH5. The visibilities and the gains in CASA are therefore conjugated.
        apart += [np.angle(our[j, 0, k] * theirs[n] / theirs["W02"]) for j, n in enumerate(our_names)]
    apart = np.array(apart)
    # Both programs minimise the same sum of squares. The noise of one phase is 0.005 rad; the two solutions must differ by much less.
    assert len(apart) == 4 * 27 and np.abs(apart).max() < 5e-4, np.abs(apart).max()
