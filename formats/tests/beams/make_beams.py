"""Write two small beam files and their power at some of their samples: the reference of `formats/tests/patterns.rs`.

Made with pyuvdata 3.2.8: python make_beams.py (in this folder).
"""
import csv
import gzip
import io

import numpy as np
import pyuvdata
from pyuvdata import UVBeam
from pyuvdata.analytic_beam import AiryBeam, ShortDipoleBeam

FREQ_HZ = np.array([9.0e9, 9.5e9, 10.0e9])
AZ_RAD = np.radians(np.arange(0.0, 360.0, 45.0))
ZA_RAD = np.radians(np.arange(0.0, 91.0, 6.0))


def beam_of(analytic, kind):
    beam = analytic.to_uvbeam(
        freq_array=FREQ_HZ, beam_type=kind, pixel_coordinate_system="az_za", axis1_array=AZ_RAD, axis2_array=ZA_RAD
    )
    if isinstance(analytic, ShortDipoleBeam):
        beam.select(polarizations=["xx"])
    beam.history = "made for a test"
    return beam


def power_of(beam):
    """Mean over feeds of the power [freq, za, az], 1 at the zenith."""
    data = beam.data_array
    if beam.beam_type == "efield":
        power = (np.abs(data) ** 2).sum(axis=0).mean(axis=0)
    else:
        power = data[0].real.mean(axis=0)
    return power / power[:, :1, :].mean(axis=2, keepdims=True)


rows = []
for name, analytic, kind in [
    ("airy-efield", AiryBeam(diameter=0.1), "efield"),
    ("dipole-power", ShortDipoleBeam(), "power"),
]:
    beam = beam_of(analytic, kind)
    beam.write_beamfits(f"{name}.beamfits", clobber=True)
    again = UVBeam.from_file(f"{name}.beamfits")
    power = power_of(again)
    with open(f"{name}.beamfits", "rb") as plain:
        packed = io.BytesIO()
        with gzip.GzipFile(fileobj=packed, mode="wb", mtime=0) as out:
            out.write(plain.read())
    with open(f"{name}.beamfits.gz", "wb") as out:
        out.write(packed.getvalue())
    for f in range(len(FREQ_HZ)):
        for z in range(0, len(ZA_RAD), 3):
            for a in range(0, len(AZ_RAD), 3):
                rows.append([name, FREQ_HZ[f], np.degrees(ZA_RAD[z]), np.degrees(AZ_RAD[a]), f"{power[f, z, a]:.12e}"])

with open("beams.csv", "w", newline="") as out:
    out.write(f"# power of the beam files in this folder at some of their samples, by pyuvdata {pyuvdata.__version__}; made by make_beams.py\n")
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["beam", "freq_hz", "za_deg", "az_deg", "power"])
    writer.writerows(rows)
