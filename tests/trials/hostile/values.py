"""How values of options and keys are written. `@` stands for a number; a tuple holds the units of a quantity."""

QUANTITIES = {
    "ANGLE": ("deg", "arcsec", "mrad"), "FREQ": ("GHz", "MHz", "Hz"), "TIME": ("s", "min", "h"), "TEMP": ("K", "mK"), "FLUX": ("Jy", "mJy"),
    "LENGTH": ("m", "km", "mm"), "SPEED": ("m/s",), "PRESSURE": ("hPa",), "DENSITY": ("g/m3",), "RATE": ("mm/h",), "SIZE": ("GB", "MB"),
}
PLAIN = ["@"]
ANGLE, FREQ, TIME, TEMP, FLUX, LENGTH = ([QUANTITIES[q]] for q in ("ANGLE", "FREQ", "TIME", "TEMP", "FLUX", "LENGTH"))
VARIATION = ["walk:@s", "interval:@s", "jumps:@s", "coherent:@s"]
BEAM, BOX = ["@mrad,@mrad,@deg"], ["@mrad,@mrad,@mrad,@mrad", "-@mrad,-@mrad,@mrad,@mrad"]
IMAGE_SIZE = ["@", "@x@"]
LAYER = ["cloud:@km-@km:@g/m3", "rain:0km-@km:@mm/h"]

# By the word that help prints for the value.
PATTERNS = {name: [units] for name, units in QUANTITIES.items()} | {
    "X": PLAIN, "N": PLAIN, "R": PLAIN, "PSU": PLAIN, "PERCENT": [("%",)], "FRACTION": ["@", "@%"], "F": FLUX, "LEVEL": FLUX, "PRIOR": FLUX,
    "RA,DEC": ["@deg,@deg", "@h@m@s,@d@m@s"], "FROM,TO": ["@h,@h", "-@h,@h"], "BEAM": BEAM, "L0,M0,L1,M1": BOX, "KIND[:TIME]": VARIATION,
    "LENGTH|layout": LENGTH, "auto|none|TEMP": TEMP, "TIME|int|inf": TIME, "scan|none|TIME": TIME, "SU,SC": ["@,@"], "REAL,LOSS": ["@,@"],
    "KIND:BASE-TOP:AMOUNT": LAYER, "KIND:VALUES": ["qh:@,@,@", "go:@,@"], "RANGE": ["@,@"], "UTC": ["2025-06-01T01:30:@", "@"],
    "THREADS": PLAIN,
}

# By the name of the option, where the word is also that of other values. The pair names one subcommand.
BY_NAME = {
    "size": IMAGE_SIZE, ("mask", "size"): PLAIN, ("fly", "size"): PLAIN, ("film", "size"): PLAIN, "element": ["cos^@"], "scales": ["@", "@,@"],
    "penalties": ["entropy=@", "tv=@,flux=@"], "terms": ["cphase=@,logcamp=@", "vis=@"], ("mem", "noise"): FLUX, "density": [("kg/m3",), "@g/cm3"],
    "uncertainty": ["@"], "vapour-pressure": [("hPa",)], "compression": ["gzip-@"], "region": ["@"], "robust": PLAIN,
}

# These are no numbers, or none with which anything can be computed. A time of 1e300 s is as wrong as an infinite one.
REFUSED = {"nan", "NaN", "inf", "-inf", "1e300", "-1e300", "", "１２", "٣"}

# By the type of a key in a schema.
TYPES = {
    "number": PLAIN, "integer": PLAIN, "Angle": ANGLE, "Duration": TIME, "Frequency": FREQ, "Temperature": TEMP, "FluxDensity": FLUX, "DataFlux": FLUX,
    "Length": LENGTH, "Speed": [("m/s",)], "Level": FLUX, "Direction": ["@deg,@deg"], "HourAngles": ["@h,@h", "-@h,@h"], "BeamShape": BEAM, "SkyBox": BOX,
    "SolutionInterval": TIME, "Variation": VARIATION, "PositionRms": LENGTH, "PriorChoice": FLUX, "ImageSize": IMAGE_SIZE, "Element": ["cos^@"],
    "UtcTime": ["2025-06-01T01:30:@", "@"], "Pedestal": TEMP, "NoiseChoice": FLUX,
}

# What makes an option count: options without effect are refused. A pair names one subcommand.
COMPANIONS = {
    "robust": "--weighting briggs", "scales": "--algorithm multiscale", "scale-bias": "--algorithm multiscale", "element-diameter": "--element airy",
    "element-width": "--element gaussian", "outlier-scale": "--outliers huber", ("selfcal", "prior"): "--algorithm mem", "step": "--mode realtime",
    "spread": "--mode realtime", "tilt": "--elevation=30deg", "elevation": "--tilt=45deg",
    "troposphere-baseline": "--troposphere=1rad", "wind": "--troposphere=1rad",
    "wind-to": "--troposphere=1rad", "screen-height": "--troposphere=1rad", "outer-scale": "--troposphere=1rad", "bandpass-period": "--bandpass-ripple=0.1",
    "dropout-length": "--dropout=0.1", "phase-variation": "--phase-rms=1rad", "amp-variation": "--amp-rms=0.1", "delay-variation": "--delay-rms=1ps",
    "variation": "--phase-rms=1rad", "diameter": "--tsys=100K", "super-uniform": "--weighting uniform", "aperture-efficiency": "--tsys=600K",
    "start-seed": "--starts=2",
    ("fly", "step"): "", ("fly", "spread"): "", ("film", "step"): "", ("film", "spread"): "", "ice": "--temperature=260K",
    "max-rise": "--method constant", ("mem", "seed"): "--uncertainty=2", ("simulate", "seed"): "--noise",
}

BAND = "--freq 94GHz --bandwidth 8GHz"
IMAGE = "--size 32 --cell 1mrad"
# The lines to which options are added. Outputs lie in the folder `out`.
LINES = [
    f"mask l.toml {BAND} --channels 2 {IMAGE} --no-png -o out/o.fits",
    "mask e.toml --freq 8GHz --bandwidth 1GHz --phase-center 10deg,40deg --start 2025-06-01T15:00:00 --size 32 --cell 10arcsec --no-png -o out/o.fits",
    f"simulate --layout l.toml --scene s.csv {BAND} --channels 2 -o out/o.uvh5",
    f"simulate --layout l.toml --scene k.fits {BAND} -o out/o.uvh5",
    f"simulate --layout l.toml --scene b.toml --scene-size 8 {BAND} -o out/o.uvh5",
    "simulate --layout e.toml --scene s.csv --freq 8GHz --bandwidth 1GHz --phase-center 10deg,40deg --start 2025-06-01T15:00:00 -o out/o.uvh5",
    "corrupt v.uvh5 --seed 1 --phase-rms 1deg -o out/o.uvh5",
    f"grid v.uvh5 {IMAGE} -o out/o.h5",
    f"beam v.uvh5 {IMAGE} -o out/o.fits",
    f"dirty v.uvh5 {IMAGE} -o out/o.fits",
    f"clean v.uvh5 {IMAGE} --niter 50 -o out/o",
    f"clean v.uvh5 {IMAGE} --niter 50 --box=-9mrad,-9mrad,9mrad,9mrad -o out/o",
    f"mem v.uvh5 {IMAGE} --niter 20 -o out/o",
    f"mem v.uvh5 {IMAGE} --terms cphase,logcamp -o out/o",
    f"selfcal c.uvh5 {IMAGE} --niter 50 --rounds 2 --force -o out/o",
    "closure e.uvh5 -o out/o.csv",
    f"identify l.toml {BAND}",
    "predict v.uvh5 --model s.csv -o out/o.uvh5",
    "plot d.fits -o out/o.png",
    "plot l.toml --what uv --freq 94GHz -o out/o.png",
    "compare d.fits t.fits",
    "convert v.uvh5 out/o.uvh5",
    "layout show l.toml --freq 94GHz",
    "scene render b.toml --scene-size 8 -o out/o.fits",
    "scene fly f.toml --size 8 --no-video -o out/o",
    "film f.toml --size 8 --frames 2 -o out/o.png",
    "film f.toml --size 24 --rates 5,10 --tsys 500K -o out/o.csv",
    "scene sky --freq 94GHz",
    "scene attenuation --freq 94GHz",
    "scene path --freq 94GHz --observer 1km",
    "scene permittivity --freq 94GHz --material sea-water --extrapolate",
    "scene emissivity --freq 94GHz --eps 4,0.6",
    "scene permittivity --freq 94GHz --material soil --extrapolate",
    "scene emissivity --freq 94GHz --material sea-water --extrapolate",
    "scene emissivity --freq 94GHz --material soil --extrapolate",
    "scene bistatic --freq 94GHz --material soil --extrapolate --slopes 0.1,0.1 --incidence 30deg --scattered 30deg",
    "scene bistatic --freq 94GHz --eps 4,0.6 --slopes 0.1,0.1 --incidence 30deg --scattered 30deg",
]

# The tables of the configurations. A key of the last column is set beside the one that is drawn.
FIRST = {
    "": {"title": '"x"'}, "layout": {"name": '"l.toml"'}, "scene": {"file": '"s.csv"'}, "image": {"size": "32", "cell": '"1mrad"'},
    "simulate": {"freq": '"94GHz"', "bandwidth": '"8GHz"', "channels": "2"},
}
LAST = FIRST | {"": FIRST[""] | {"seeds": "1"}, "clean": {"niter": "20"}, "corrupt": {"phase-rms": '"10deg"', "sefd": '"3000Jy"'},
                "axis": {"parameter": '"corrupt.phase-rms"', "values": '["10deg"]'}}
TABLES = {"run": FIRST, "study": LAST, "corrupt": {"error": {}}}
# Tables that are there only where one of their keys is drawn.
OTHERS = {
    "points": {"flux": '"1Jy"', "l": '"3mrad"', "m": '"2mrad"'},
    "question": {"keep": '"dynamic_range"', "at-least": "5", "parameter": '"corrupt.phase-rms"', "from": '"1deg"', "to": '"90deg"'},
}
TROPOSPHERE = {"troposphere": '"1rad"'}
CHAIN = {
    "robust": {"weighting": '"briggs"'}, "scales": {"algorithm": '"multiscale"'}, "scale-bias": {"algorithm": '"multiscale"'},
    "element-diameter": {"element": '"airy"'}, "element-width": {"element": '"gaussian"'}, "outlier-scale": {"outliers": '"huber"'},
    "troposphere-baseline": TROPOSPHERE, "wind": TROPOSPHERE, "wind-to": TROPOSPHERE, "screen-height": TROPOSPHERE, "outer-scale": TROPOSPHERE,
    "bandpass-period": {"bandpass-ripple": "0.1"}, "dropout-length": {"dropout": "0.1"}, "amp-variation": {"amp-rms": "0.1"},
    "delay-variation": {"delay-rms": '"1ps"'}, "diameter": {"tsys": '"100K"'},
    ("axis", "from"): {"to": '"20deg"', "count": "2", "values": "[]"}, ("axis", "to"): {"from": '"10deg"', "count": "2", "values": "[]"},
    ("axis", "count"): {"from": '"10deg"', "to": '"20deg"', "values": "[]"}, "variation": {"phase-rms": '"10deg"'}, "phase-variation": {"phase-rms": '"10deg"'},
    "aperture-efficiency": {"tsys": '"600K"'}, ("mem", "seed"): {"uncertainty": "2"}, ("selfcal", "prior"): {"algorithm": '"mem"'},
}
