"""Makes volume_brightness_smrt.csv and volume_layers_smrt.csv: brightness of scattering snow and ice by smrt.

Run with smrt 1.7 in a Python environment of its own: `python volume_smrt.py`. smrt's solver `dort` has 128 streams here, Rayleigh-Jeans
temperatures, and as substrate a half-space of a given permittivity. The angles are the streams of smrt next to round ones, because it
interpolates linearly between its streams, which costs up to 3 K at 78 degrees over sea ice. The stacks are those of phenomenology/src/surfaces/volume/oracle_tests.rs.
No row with `unseen` = 1 was looked at before the code was finished.
"""

import csv
import sys
import warnings

import numpy as np
import smrt
from smrt import make_atmosphere, make_ice_column, make_model, make_snowpack, sensor_list
from smrt.core.layer import layer_properties
from smrt.emmodel.iba import derived_IBA
from smrt.rtsolver.streams import compute_stream
from smrt.substrate.flat import Flat

warnings.filterwarnings("ignore")
PSU = 1e-3
SEEN = ([10.65, 18.7, 36.5, 89.0, 94.0], [10.0, 30.0, 53.0, 70.0])
UNSEEN = ([6.925, 23.8, 150.0], [20.0, 40.0, 60.0, 78.0])


def ground(eps, temperature):
    """A half-space of permittivity real + j loss."""
    return Flat(temperature=temperature, permittivity_model=complex(*eps))


def oblate(fraction):
    """Maetzler 1996, eq. 10, below a fraction of 0.33. smrt 1.7 has 1.0 in place of 0.1."""
    a = 0.1 + 0.5 * fraction
    return np.array([a, a, 1.0 - 2.0 * a])


@layer_properties("frac_volume")
def oblate_mixing(frac_volume, e0, eps):
    """Polder & van Santen 1946 with these factors, which the function of smrt 1.7 takes and does not use."""
    mixed = e0 * (1 - frac_volume) + eps * frac_volume
    for _ in range(500):
        mixed = e0 + frac_volume * (eps - e0) * mixed * np.mean(1 / (mixed + oblate(frac_volume) * (eps - mixed)))
    return mixed


SOIL = ((5.0, 0.5), 268.0)
WATER = ((10.0, 17.0), 271.3)


def snow(rows, below=SOIL, model="iba", **more):
    """rows: thickness m, density kg/m3, temperature K, then the grain: ("exp", length m) or ("shs", radius m, stickiness)."""
    thickness, density, temperature, grain = zip(*rows)
    kinds = {g[0] for g in grain}
    assert len(kinds) == 1
    if kinds == {"exp"}:
        micro = dict(microstructure_model="exponential", corr_length=[g[1] for g in grain])
    else:
        micro = dict(microstructure_model="sticky_hard_spheres", radius=[g[1] for g in grain], stickiness=[g[2] for g in grain])
    pack = make_snowpack(thickness=list(thickness), density=list(density), temperature=list(temperature), **micro, **more)
    pack.substrate = ground(*below)
    return pack, model


def ice(kind, thickness, temperature, length, below=WATER, **more):
    column = make_ice_column(kind, thickness=[thickness], temperature=[temperature], microstructure_model="exponential",
                             corr_length=[length], add_water_substrate=False, substrate=ground(*below), **more)
    return column, "iba"


def on_ice(rows, column):
    pack, _ = snow(rows)
    pack.substrate = None
    return pack + column[0], "iba"


def cases():
    yield "exp-fine", 0, 0, snow([(0.5, 200.0, 260.0, ("exp", 5e-5))])
    yield "exp-medium", 0, 0, snow([(1.0, 300.0, 255.0, ("exp", 1e-4))])
    yield "exp-coarse", 0, 0, snow([(0.7, 350.0, 265.0, ("exp", 2e-4))])
    yield "exp-deep", 0, 0, snow([(100.0, 320.0, 250.0, ("exp", 1.5e-4))])
    yield "shs-fine", 0, 0, snow([(0.5, 250.0, 260.0, ("shs", 1e-4, 0.2))])
    yield "shs-medium", 0, 0, snow([(1.0, 320.0, 258.0, ("shs", 2e-4, 0.3))])
    yield "shs-coarse", 0, 0, snow([(0.4, 280.0, 263.0, ("shs", 3.5e-4, 1000.0))])
    yield "several", 0, 0, snow([
        (0.1, 120.0, 252.0, ("exp", 6e-5)), (0.2, 220.0, 257.0, ("exp", 9e-5)),
        (0.3, 310.0, 262.0, ("exp", 1.4e-4)), (0.15, 260.0, 266.0, ("exp", 2.2e-4))])
    yield "dense-over-light", 0, 0, snow([(0.1, 420.0, 250.0, ("exp", 8e-5)), (0.6, 180.0, 262.0, ("exp", 1.8e-4))])
    yield "under-sky", 0, 60, snow([(0.8, 290.0, 258.0, ("exp", 1.2e-4))])
    yield "oblate", 0, 0, snow([(0.6, 270.0, 259.0, ("exp", 1.1e-4))], depolarization_factors=[oblate(270.0 / 916.7)],
                                    model=derived_IBA(oblate_mixing))
    yield "dmrt", 0, 0, snow([(0.8, 280.0, 260.0, ("shs", 1.2e-4, 0.25))], model="dmrt_qcacp_shortrange")
    yield "first-year", 0, 0, on_ice([(0.15, 310.0, 255.0, ("exp", 1.2e-4))],
                                     ice("firstyear", 1.2, 261.0, 1.5e-4, salinity=6 * PSU))
    yield "multi-year", 0, 0, on_ice([(0.25, 330.0, 250.0, ("exp", 1.6e-4))],
                                     ice("multiyear", 2.5, 258.0, 2.5e-4, salinity=1 * PSU, porosity=0.15))
    yield "lake-ice", 0, 0, ice("fresh", 0.5, 268.0, 3e-4, porosity=0.05)
    # Only these have no row that was looked at while the code was written.
    yield "later-exp", 1, 0, snow([(0.9, 230.0, 247.0, ("exp", 1.3e-4))])
    yield "later-shs", 1, 25, snow([(0.3, 380.0, 267.0, ("shs", 1.5e-4, 0.15))])
    yield "later-several", 1, 0, snow([
        (0.05, 90.0, 249.0, ("exp", 4e-5)), (0.02, 450.0, 253.0, ("exp", 7e-5)),
        (0.5, 280.0, 259.0, ("exp", 1.7e-4)), (0.4, 340.0, 265.0, ("exp", 2.5e-4)), (0.3, 200.0, 268.0, ("exp", 1e-4))])
    yield "later-sea-ice", 1, 15, on_ice([(0.1, 250.0, 253.0, ("exp", 9e-5)), (0.1, 360.0, 256.0, ("exp", 2e-4))],
                                         ice("multiyear", 3.0, 260.0, 3.5e-4, salinity=2 * PSU, porosity=0.08))


def main():
    only = sys.argv[1] if len(sys.argv) > 1 else ""
    with open("volume_brightness_smrt.csv", "w", newline="") as brightness, open("volume_layers_smrt.csv", "w", newline="") as layers:
        tb, em = csv.writer(brightness, lineterminator="\n"), csv.writer(layers, lineterminator="\n")
        tb.writerow(["case", "unseen", "freq_ghz", "theta_deg", "sky_k", "tb_h_k", "tb_v_k"])
        em.writerow(["case", "layer", "freq_ghz", "eps_re", "eps_loss", "ks_per_m", "ka_per_m"])
        for name, unseen, sky, (pack, model) in cases():
            if only not in name:
                continue
            air = make_atmosphere("simple_isotropic_atmosphere", tb_down=float(sky), tb_up=0.0, transmittance=1.0)
            points = [(1, *UNSEEN)] if unseen else [(0, *SEEN), (1, *UNSEEN)]
            for late, freqs, angles in points:
                for f in freqs:
                    options = dict(n_max_stream=128, rayleigh_jeans_approximation=True, phase_normalization=True)
                    m = make_model(model, "dort", rtsolver_options=options)
                    ems = m.prepare_emmodels(sensor_list.passive(f * 1e9, 30.0), pack)
                    streams = compute_stream(options["n_max_stream"], np.array([e.effective_permittivity() for e in ems])).outmu
                    thetas = [float(np.degrees(np.arccos(streams[np.argmin(abs(streams - np.cos(np.radians(a))))]))) for a in angles]
                    result = m.run(sensor_list.passive(f * 1e9, thetas), air + pack if sky else pack)
                    for a in thetas:
                        t = [float(result.Tb(theta=a, polarization=p)) for p in "HV"]
                        tb.writerow([name, late, f, f"{a:.8f}", sky, f"{t[0]:.4f}", f"{t[1]:.4f}"])
                    for i, e in enumerate(ems):
                        eps = complex(e.effective_permittivity())
                        ks = float(np.mean(e.ks(np.array([0.5])).values if callable(e.ks) else e.ks))
                        em.writerow([name, i + 1, f, f"{eps.real:.8g}", f"{eps.imag:.8g}", f"{ks:.8g}", f"{e.ka:.8g}"])
            print(name, file=sys.stderr, flush=True)


if __name__ == "__main__":
    print("smrt", smrt.__version__ if hasattr(smrt, "__version__") else "1.7", file=sys.stderr)
    main()
