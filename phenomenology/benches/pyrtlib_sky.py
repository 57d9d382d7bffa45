"""Seconds (median of three) that pyrtlib takes for the sky profile of the bench: 10 frequencies x 8 angles,
on the levels of its own climatology."""
import time
import warnings
from statistics import median

import numpy as np
from pyrtlib.climatology import AtmosphericProfiles as atmp
from pyrtlib.tb_spectrum import TbCloudRTE
from pyrtlib.utils import mr2rh, ppmv2gkg

warnings.simplefilter("ignore")
FREQS = np.array([10.0, 19.0, 35.0, 37.0, 89.0, 94.0, 140.0, 183.0, 220.0, 340.0])
ZENITHS = np.array([0.0, 30.0, 45.0, 60.0, 70.0, 75.0, 80.0, 85.0])

z, p, _, t, md = atmp.gl_atm(atmp.MIDLATITUDE_SUMMER)
rh = mr2rh(p, t, ppmv2gkg(md[:, atmp.H2O], atmp.H2O))[0] / 100

def once():
    start = time.perf_counter()
    rte = TbCloudRTE(z, p, t, rh, FREQS, 90.0 - ZENITHS)
    rte.init_absmdl("R98")
    rte.satellite = False
    rte.execute()
    return time.perf_counter() - start


print(median(once() for _ in range(3)))
