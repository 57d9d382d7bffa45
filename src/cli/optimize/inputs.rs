//! The places that `layout optimize` reads: layouts to begin with, fixed elements, pads, and polygons.

use crate::cli::failure::{Failure, Result, ensure};
use crate::cli::options::load_layout;
use crate::design::{DesignOptions, Ground, MethodKind, Pads, Polygon, Problem, SiteTracks};
use crate::values::{bad_value, need};
use crate::{ChainError, Result as ChainResult};
use cittert_arrays::quantity::Angle;
use cittert_arrays::{Antenna, ArrayLayout, LayoutFrame, Sensitivity};
use clap::Args;
use std::path::{Path, PathBuf};

/// Differences of height up to this part of the aperture are a slope, such as that of a mountain site, and the side lobes are nearly those of a plane.
const NEARLY_FLAT: f64 = 0.1;

/// Where elements stand, or may stand.
#[derive(Debug, Args)]
pub struct PlaceArgs {
    /// Layout at which the first attempt begins. Its number of elements and its aperture are the defaults of --elements and --aperture.
    #[arg(long, value_name = "LAYOUT", conflicts_with = "pads")]
    start: Option<String>,
    /// Layout whose elements all stay where they are.
    #[arg(long, value_name = "LAYOUT")]
    fixed: Option<String>,
    /// Layout of pads, of which some are chosen.
    #[arg(long, value_name = "LAYOUT", requires = "choose")]
    pads: Option<String>,
    /// Number of pads to choose.
    #[arg(long, value_name = "N", requires = "pads")]
    choose: Option<usize>,
    /// Polygons in which the elements must stand: a text file with one corner `x,y` in metres a line, and empty lines between polygons.
    #[arg(long, value_name = "FILE", conflicts_with = "pads")]
    inside: Vec<PathBuf>,
    /// Polygons in which no element may stand, in the same form.
    #[arg(long, value_name = "FILE", conflicts_with = "pads")]
    keep_out: Vec<PathBuf>,
}

impl PlaceArgs {
    /// The files that are read, where the names are files.
    pub(super) fn files(&self) -> Vec<PathBuf> {
        let layouts = [&self.start, &self.fixed, &self.pads].into_iter().flatten().map(PathBuf::from);
        layouts.chain(self.inside.iter().cloned()).chain(self.keep_out.iter().cloned()).collect()
    }
}

/// What was read.
pub(super) struct Inputs {
    start: Option<ArrayLayout>,
    fixed: Option<ArrayLayout>,
    pads: Option<(ArrayLayout, usize)>,
    ground: Ground,
    /// Unit of length of the search.
    pub(super) aperture_m: f64,
}

/// A problem of one of two kinds.
pub(super) enum Kind {
    /// Elements move freely.
    Free { problem: Box<Problem>, method: &'static MethodKind, start: Option<Vec<f64>> },
    /// Pads are chosen.
    Pads { problem: Box<Problem>, pads: Pads },
}

impl Kind {
    pub(super) fn problem_mut(&mut self) -> &mut Problem {
        match self {
            Self::Free { problem, .. } | Self::Pads { problem, .. } => problem,
        }
    }

    pub(super) fn into_problem(self) -> Problem {
        match self {
            Self::Free { problem, .. } | Self::Pads { problem, .. } => *problem,
        }
    }

    pub(super) fn problem(&self) -> &Problem {
        match self {
            Self::Free { problem, .. } | Self::Pads { problem, .. } => problem,
        }
    }
}

fn places(layout: &ArrayLayout) -> Vec<[f64; 2]> {
    layout.antennas().iter().map(|a| [a.position_m[0], a.position_m[1]]).collect()
}

/// The polygons of a text file.
fn polygons(path: &Path) -> Result<Vec<Polygon>> {
    let text = cittert_formats::read_text(path)?;
    let (mut all, mut corners) = (Vec::new(), Vec::new());
    for (number, line) in text.lines().map(str::trim).enumerate().chain([(usize::MAX, "")]) {
        if line.starts_with('#') {
            continue;
        }
        if line.is_empty() {
            if !corners.is_empty() {
                let name = format!("{} of {}", all.len() + 1, path.display());
                all.push(Polygon::new(&name, std::mem::take(&mut corners))?);
            }
            continue;
        }
        let pair = line.split_once(',').and_then(|(x, y)| Some([x.trim().parse().ok()?, y.trim().parse().ok()?]));
        let corner: [f64; 2] = pair.ok_or_else(|| {
            Failure::message(format!("{}: line {} is {line:?}, expected a corner x,y in metres", path.display(), number + 1))
        })?;
        corners.push(corner);
    }
    ensure!(!all.is_empty(), Failure::message(format!("{}: it holds no polygon", path.display())));
    Ok(all)
}

impl Inputs {
    /// Read the files, and find the aperture.
    pub(super) fn read(args: &PlaceArgs, design: &DesignOptions) -> Result<Self> {
        let load = |name: &Option<String>| name.as_deref().map(load_layout).transpose();
        let (start, fixed, pads) = (load(&args.start)?, load(&args.fixed)?, load(&args.pads)?);
        let all = |files: &[PathBuf]| -> Result<Vec<Polygon>> {
            let each: Vec<Vec<Polygon>> = files.iter().map(|f| polygons(f)).collect::<Result<_>>()?;
            Ok(each.concat())
        };
        let fixed_places = fixed.as_ref().map(places).unwrap_or_default();
        let ground = Ground { fixed: fixed_places, inside: all(&args.inside)?, outside: all(&args.keep_out)? };
        let pads = pads.zip(args.choose);
        let mut inputs = Self { start, fixed, pads, ground, aperture_m: 0.0 };
        inputs.aperture_m = inputs.aperture(design).map_err(Failure::call)?;
        Ok(inputs)
    }

    /// A layout in memory as the start, polygons to keep out of, and nothing else.
    pub(super) fn starting(start: ArrayLayout, outside: Vec<Polygon>, design: &DesignOptions) -> Result<Self> {
        let ground = Ground { outside, ..Ground::default() };
        let mut inputs = Self { start: Some(start), fixed: None, pads: None, ground, aperture_m: 0.0 };
        inputs.aperture_m = inputs.aperture(design).map_err(Failure::call)?;
        Ok(inputs)
    }

    fn aperture(&self, design: &DesignOptions) -> ChainResult<f64> {
        let given = design.aperture.map(|a| a.si());
        Ok(match (&self.pads, &self.start) {
            (Some((pads, _)), _) => given.unwrap_or(pads.extent().longest_m),
            (None, Some(start)) if given.is_none() => {
                start.aperture_m.unwrap_or_else(|| 2.0 * places(start).iter().map(|p| p[0].hypot(p[1])).fold(0.0, f64::max))
            }
            _ => design.aperture_m(&self.ground)?,
        })
    }

    fn layouts(&self) -> impl Iterator<Item = &ArrayLayout> {
        self.pads.as_ref().map(|p| &p.0).into_iter().chain(&self.fixed).chain(&self.start)
    }

    /// False for stations that are so far apart that the Earth between them is no plane.
    pub(super) fn flat(&self) -> bool {
        let heights = |l: &ArrayLayout| {
            let z = l.antennas().iter().map(|a| a.position_m[2]);
            z.clone().fold(f64::NEG_INFINITY, f64::max) - z.fold(f64::INFINITY, f64::min)
        };
        self.layouts().all(|l| heights(l) <= NEARLY_FLAT * self.aperture_m)
    }

    /// The problem.
    pub(super) fn kind(&self, design: &DesignOptions) -> ChainResult<Kind> {
        let mut design = design.clone();
        design.aperture = Some(cittert_arrays::quantity::Length(self.aperture_m));
        if design.declination.is_some() {
            design.latitude = design.latitude.or_else(|| self.layouts().find_map(ArrayLayout::site).map(|s| Angle(s.latitude_rad)));
        }
        let on_sites = |name: &str| self.pads.is_some() && name == "coverage";
        if !self.flat() && (design.objective.0.iter().any(|(name, _)| !on_sites(name)) || design.beam.is_some_and(|b| b > 0.0)) {
            return Err(ChainError::Incompatible(
                "these stations stand on no plane, and the beam of a layout is that of a plane: choose among them with --objective coverage, \
                 which follows each pair over the Earth"
                    .into(),
            ));
        }
        let follows = design.objective.0.iter().any(|(name, _)| on_sites(name));
        if let Some(limit) = design.elevation_limit.filter(|_| !follows) {
            return bad_value("elevation-limit", limit, "none: only the objective coverage knows when a station sees the source");
        }
        if let Some((pads, choose)) = &self.pads {
            let (mut problem, chosen) = design.problem_of_pads(&places(pads), *choose, &self.ground)?;
            if follows {
                problem.setting.coverage = Some(SiteTracks::new(pads, chosen.places.clone(), &design)?.figure());
            }
            return Ok(Kind::Pads { problem: Box::new(problem), pads: chosen });
        }
        if let (Some(start), None) = (&self.start, design.elements) {
            design.elements = Some(start.n_ant() + self.ground.fixed.len());
        }
        let problem = design.problem(&self.ground)?;
        let method = design.method_for(&problem)?;
        let start = self.start.as_ref().map(|s| self.variables(s, &problem)).transpose()?;
        Ok(Kind::Free { problem: Box::new(problem), method, start })
    }

    /// The variables at which the first attempt begins.
    fn variables(&self, start: &ArrayLayout, problem: &Problem) -> ChainResult<Vec<f64>> {
        let (places, free, symmetry) = (places(start), problem.freedom.free, problem.freedom.symmetry);
        need("symmetry", symmetry, symmetry == 1, "1 for a search that begins at a given layout")?;
        let expected = free * symmetry;
        crate::ensure!(
            places.len() == expected,
            ChainError::Incompatible(format!("the start has {} elements, but {expected} are to be placed", places.len()))
        );
        let x: Vec<f64> = places.iter().take(free).flat_map(|p| p.map(|v| v / self.aperture_m)).collect();
        for p in x.as_chunks::<2>().0 {
            crate::ensure!(
                problem.limits.region.nearest(*p).is_some(),
                ChainError::Incompatible(format!(
                    "the start has an element at {:?} m, far from where elements may stand",
                    p.map(|v| v * self.aperture_m)
                ))
            );
        }
        Ok(x)
    }

    /// All that the result depends on besides the options.
    pub(super) fn fingerprint(&self) -> String {
        let layout = |l: &Option<ArrayLayout>| l.as_ref().map(places);
        let pads = self.pads.as_ref().map(|(p, n)| (places(p), *n));
        format!("{:?} {:?} {pads:?} {:?} {:?}", layout(&self.start), layout(&self.fixed), self.ground, self.aperture_m)
    }

    /// The layout of the result. Elements keep what is known of the pads, fixed elements or elements of the start that they are. New elements
    /// beside fixed ones that are all alike are like these; a diameter and a system temperature `of_new` elements come before that.
    pub(super) fn layout(
        &self,
        name: String,
        xy: &[[f64; 2]],
        source: String,
        of_new: (Option<f64>, Option<Sensitivity>),
    ) -> Result<ArrayLayout> {
        let kind = |a: &Antenna| (a.diameter_m, a.sensitivity);
        let fixed = self.fixed.as_ref().map_or(&[][..], ArrayLayout::antennas);
        let alike = fixed.first().map(kind).filter(|first| fixed.iter().all(|a| kind(a) == *first)).unwrap_or_default();
        let known = self.pads.as_ref().map(|p| &p.0).or(self.fixed.as_ref()).or(self.start.as_ref());
        let frame = known.map_or(LayoutFrame::Boresight, |l| l.frame);
        let place = |p: &[f64; 2]| p.map(|v| v * self.aperture_m);
        let same = |a: &Antenna, p: [f64; 2]| (a.position_m[0] - p[0]).hypot(a.position_m[1] - p[1]) <= 1e-6 * self.aperture_m;
        let mut antennas: Vec<Antenna> = Vec::with_capacity(xy.len());
        for (k, p) in xy.iter().map(place).enumerate() {
            let of = |l: &Option<ArrayLayout>| l.as_ref().and_then(|l| l.antennas().iter().find(|a| same(a, p)).cloned());
            let pad = self.pads.as_ref().and_then(|(l, _)| l.antennas().iter().find(|a| same(a, p)).cloned());
            let like = || self.start.as_ref().and_then(|l| l.antennas().get(k)).cloned();
            let mut antenna = match pad.or_else(|| of(&self.fixed)) {
                Some(antenna) => antenna,
                None => {
                    let mut a = like().unwrap_or_else(|| Antenna::new("", 0, [0.0; 3]));
                    (a.name, a.position_m) = (format!("E{}", k + 1), [p[0], p[1], a.position_m[2]]);
                    a.diameter_m = of_new.0.or(a.diameter_m).or(alike.0);
                    a.sensitivity = of_new.1.or(a.sensitivity).or(alike.1);
                    a
                }
            };
            // Pads and fixed elements that state neither take what is given for new elements.
            antenna.diameter_m = antenna.diameter_m.or(of_new.0);
            antenna.sensitivity = antenna.sensitivity.or(of_new.1);
            if antennas.iter().any(|a| a.name == antenna.name) {
                antenna.name = format!("{}-{}", antenna.name, k + 1);
            }
            antenna.number = k as u32;
            antennas.push(antenna);
        }
        let mut layout = ArrayLayout::new(name, frame, antennas)?;
        layout.source = Some(source);
        layout.aperture_m = Some(self.aperture_m);
        Ok(layout)
    }
}
