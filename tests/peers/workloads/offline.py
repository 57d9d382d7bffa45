"""Make astropy and pyuvdata work without a network. Import this module before pyuvdata.

astropy 8 has no built-in list of observatories. The readers of pyuvdata call EarthLocation.get_site_names(), which tries to download
the list and raises an exception. This module fills the list from the table Observatories, which the wheel of python-casacore carries.
"""
import os
import warnings

warnings.simplefilter("ignore")
import astropy.units as u
import casacore
from astropy.coordinates import EarthLocation
from astropy.coordinates.sites import SiteRegistry
from astropy.utils import iers

iers.conf.auto_download = False
iers.conf.iers_degraded_accuracy = "warn"


def _registry():
    from casacore.tables import table

    path = os.path.join(os.path.dirname(casacore.__file__), "data", "geodetic", "Observatories")
    reg = SiteRegistry()
    t = table(path, ack=False)
    typ = t.getcol("Type")
    for i, name in enumerate(t.getcol("Name")):
        if typ[i] == "ITRF":
            loc = EarthLocation.from_geocentric(
                t.getcell("X", i) * u.m, t.getcell("Y", i) * u.m, t.getcell("Z", i) * u.m)
        else:
            loc = EarthLocation.from_geodetic(
                t.getcell("Long", i) * u.deg, t.getcell("Lat", i) * u.deg, t.getcell("Height", i) * u.m)
        reg.add_site([name], loc)
    t.close()
    return reg


if not EarthLocation._site_registry:
    EarthLocation._site_registry = _registry()
