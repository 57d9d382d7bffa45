"""Write a Measurement Set as CASA makes them: two fields, two spectral windows, pads, WEIGHT_SPECTRUM, and the columns of a model and of corrected data.

    python simulated_set.py OUT.ms
"""
import sys

import numpy as np
from casatasks import initweights
from casatools import measures, simulator


def main(path, n=8):
    sm, me = simulator(), measures()
    sm.open(path)
    x, y = np.random.default_rng(1).normal(size=(2, n)) * 300
    names = {"antname": [f"ea{k:02}" for k in range(n)], "padname": [f"N{k}" for k in range(n)], "mount": ["alt-az"] * n}
    places = {"x": list(x), "y": list(y), "z": [0.0] * n, "coordsystem": "local", "referencelocation": me.observatory("VLA")}
    sm.setconfig(telescopename="VLA", dishdiameter=list(np.linspace(20, 25, n)), **names, **places)
    sm.setspwindow(spwname="a", freq="1.4GHz", deltafreq="1MHz", freqresolution="1MHz", nchannels=4, stokes="RR RL LR LL")
    sm.setspwindow(spwname="b", freq="1.6GHz", deltafreq="2MHz", freqresolution="2MHz", nchannels=3, stokes="RR RL LR LL")
    sm.setfeed("perfect R L")
    for name, ra in (("one", "19h59m28s"), ("two", "20h01m00s")):
        sm.setfield(sourcename=name, sourcedirection=me.direction("J2000", ra, "40d44m02s"))
    sm.setlimits(shadowlimit=0.001, elevationlimit="5deg")
    sm.setauto(autocorrwt=0.0)
    sm.settimes(integrationtime="60s", usehourangle=True, referencetime=me.epoch("UTC", "2020/01/01"))
    for field, window, start in (("one", "a", -600), ("one", "b", -600), ("two", "a", 0), ("two", "b", 0)):
        sm.observe(field, window, starttime=f"{start}s", stoptime=f"{start + 300}s")
    sm.close()
    initweights(vis=path, wtmode="weight", dowtsp=True)


main(sys.argv[1])
