"""Read the files of `cargo run -p cittert-formats --example samples -- FOLDER` with pyuvdata and astropy; any warning is an error.

    python read_samples.py FOLDER

Checks that pyuvdata's own uvw, sidereal times and apparent places agree with ours, that the UVFITS holds what the UVH5 holds, that gain
tables are understood, and that the bright cell of each image is where it was put (l = +0.012, m = +0.005).
"""
import sys
import warnings
from pathlib import Path

import numpy as np

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    from astropy.io import fits
    from astropy.wcs import WCS
    from pyuvdata import UVCal, UVData

warnings.simplefilter("error")
folder = Path(sys.argv[1])


def close(what, difference, tolerance):
    """Fail with the numbers where a difference is too large."""
    print(f"{what}: {difference:.3g} (at most {tolerance:g})")
    if not difference <= tolerance:
        sys.exit(f"{what}: {difference} is more than {tolerance}")


def largest(a, b):
    return float(np.abs(np.asarray(a) - np.asarray(b)).max())


sets = {}
for name in ("earth.uvh5", "boresight.uvh5", "earth.uvfits", "boresight.uvfits"):
    uv = sets[name] = UVData.from_file(folder / name)
    uv.check(strict_uvw_antpos_check=True)
    again = uv.copy()
    again.set_uvws_from_antenna_positions()
    again.set_lsts_from_time_array()
    again._set_app_coords_helper()
    # 32-bit uvw in UVFITS; its boresight uvw are not turned by the precession of the frame (2 mm on a metre).
    tolerance = {"earth.uvh5": 1e-9, "boresight.uvh5": 1e-9, "earth.uvfits": 1e-4, "boresight.uvfits": 5e-3}[name]
    close(f"{name} uvw, m", largest(again.uvw_array, uv.uvw_array), tolerance)
    close(f"{name} lst, rad", largest(again.lst_array, uv.lst_array), 1e-8)
    close(f"{name} apparent ra, rad", largest(again.phase_center_app_ra, uv.phase_center_app_ra), 1e-8)
    close(f"{name} apparent dec, rad", largest(again.phase_center_app_dec, uv.phase_center_app_dec), 1e-8)
    close(f"{name} frame angle, rad", largest(again.phase_center_frame_pa, uv.phase_center_frame_pa), 1e-8)

h5, fs = sets["earth.uvh5"], sets["earth.uvfits"]
for item in ("data_array", "flag_array", "nsample_array", "freq_array", "time_array", "integration_time", "ant_1_array", "ant_2_array"):
    close(f"UVFITS against UVH5, {item}", largest(getattr(h5, item).astype(complex), getattr(fs, item)), 0.0)
close("UVFITS against UVH5, positions, m", largest(h5.telescope.antenna_positions, fs.telescope.antenna_positions), 1e-9)
assert list(h5.telescope.antenna_names) == list(fs.telescope.antenna_names)
assert h5.vis_units == fs.vis_units == "Jy"

for name, reference in (("gains", "A01"), ("truth", None), ("joined", None)):
    cal = UVCal.from_file(folder / f"{name}.calh5")
    cal.check()
    assert cal.gain_convention == "divide" and cal.ref_antenna_name == reference, (cal.gain_convention, cal.ref_antenna_name)

for name in ("sky", "cube", "bore"):
    with fits.open(folder / f"{name}.fits") as hdus:
        hdus.verify("exception")
        header, data = hdus[0].header, hdus[0].data
        wcs = WCS(header)
    row, column = np.unravel_index(np.argmax(data[0, 0]), data[0, 0].shape)
    x, y = np.radians(wcs.wcs_pix2world([[column, row, 0, 0]], 0)[0][:2])
    if "RA" in header["CTYPE1"]:
        ra, dec = 1.0, 0.5
        x, y = np.cos(y) * np.sin(x - ra), np.sin(y) * np.cos(dec) - np.cos(y) * np.sin(dec) * np.cos(x - ra)
    close(f"{name}.fits l, m", max(abs(x - 0.012), abs(y - 0.005)), 1e-9)
print("all samples are read as they were written")
