"""The commands that write, with what they read and what they make. The classes about files share this table.

`@` is the output or, with several files, their prefix; `made` lists endings that are added to it, and none where `@` is the only file or a folder.
"""

from .bench import IMAGE

BAND = "--freq 94GHz --bandwidth 8GHz"


class Writer:
    def __init__(self, line, ending="", made=None, inputs=(), folder=False):
        self.line, self.ending, self.made, self.folder = line, ending, made, folder
        self.inputs = list(inputs) or [w for w in line.split() if "." in w and w.rsplit(".", 1)[1] in ENDINGS and "@" not in w]
        self.name = " ".join(line.split()[:2] if line.split()[0] in ("scene", "layout") else line.split()[:1])

    def outputs(self, at):
        return [at + end for end in self.made] if self.made else [at + self.ending]

    def words(self, at):
        return self.line.replace("@", at + self.ending).split()


ENDINGS = ("uvh5", "uvfits", "fits", "calh5", "csv", "toml", "txt")
CLEAN = ["-psf.fits", "-dirty.fits", "-model.fits", "-residual.fits", "-image.fits", "-components.csv"]
MEM = ["-model.fits", "-residual.fits", "-image.fits"]
SELFCAL = [".uvh5", ".calh5", "-image.fits", "-components.csv"]
WRITERS = [
    Writer(f"simulate --layout l.toml --scene s.csv {BAND} --channels 2 -o @", ".uvh5"),
    Writer(f"simulate --layout l.toml --scene k.fits {BAND} -o @", ".uvh5"),
    Writer("corrupt v.uvh5 --phase-rms 1rad -o @.uvh5", made=[".uvh5", ".calh5"], inputs=["v.uvh5"]),
    Writer("corrupt v.uvh5 --config x.toml -o @.uvh5", made=[".uvh5", ".calh5"], inputs=["v.uvh5", "x.toml"]),
    Writer("applycal c.uvh5 g.calh5 -o @", ".uvh5"),
    Writer("predict v.uvh5 --model s.csv -o @", ".uvh5"),
    Writer("predict v.uvh5 --model m-model.fits --residual -o @", ".uvh5"),
    Writer("convert v.uvh5 @", ".uvfits"),
    Writer("convert e.uvfits @", ".uvh5"),
    Writer("convert g.calh5 @", ".calh5"),
    Writer("convert d.fits @", ".png"),
    Writer(f"grid v.uvh5 {IMAGE} -o @", ".h5"),
    Writer(f"beam v.uvh5 {IMAGE} -o @", ".fits"),
    Writer(f"dirty v.uvh5 {IMAGE} -o @", ".fits"),
    Writer(f"clean v.uvh5 {IMAGE} --niter 50 -o @", made=CLEAN),
    Writer(f"mem v.uvh5 {IMAGE} --tolerance 9 --kkt 0.9 -o @", made=MEM),
    Writer(f"selfcal c.uvh5 {IMAGE} --niter 50 --rounds 2 --algorithm hogbom --force -o @", made=SELFCAL),
    Writer("closure e.uvh5 -o @.csv --plot @.png", made=[".csv", ".png"], inputs=["e.uvh5"]),
    Writer(f"mask l.toml {BAND} {IMAGE} -o @.fits", made=[".fits", ".png"], inputs=["l.toml"]),
    Writer("plot d.fits -o @", ".png"),
    Writer("plot g.calh5 --truth g.calh5 -o @", ".png"),
    Writer("compare d.fits t.fits --difference @-d.fits --fidelity @-f.fits", made=["-d.fits", "-f.fits"], inputs=["d.fits", "t.fits"]),
    Writer("layout convert l.toml -o @", ".toml"),
    Writer("layout show l.toml --png @", ".png"),
    Writer("scene render b.toml --scene-size 16 -o @.fits --material @-m.fits", made=[".fits", "-m.fits"], inputs=["b.toml"]),
    Writer("scene convert b.toml @", ".toml"),
    Writer("scene sky --atmosphere a.csv --freq 94GHz --plot @", ".png"),
    Writer("scene fly f.toml --size 8 --no-video -o @", folder=True, inputs=["f.toml", "b.toml"]),
    Writer("film f.toml --size 8 --frames 2 -o @", ".png", inputs=["f.toml", "b.toml"]),
    Writer("film f.toml --size 24 --rates 5,10 --tsys 500K -o @.csv", made=[".csv", ".png"], inputs=["f.toml", "b.toml"]),
    Writer("run c.toml -o @", folder=True, inputs=["c.toml", "s.csv", "l.toml"]),
    Writer("study u.toml -o @", folder=True, inputs=["u.toml", "s.csv", "l.toml"]),
    Writer("man -o @", folder=True),
]
