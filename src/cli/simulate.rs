//! `simulate`: visibilities of a scene seen by an array.

use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result};
use super::options::{BandArgs, OutputArgs, SceneArgs, TrackArgs, load_layout};
use crate::simulate::{ElementPattern, Method, NoiseOptions, Pedestal, SimulateOptions, Simulator};
use cittert_arrays::quantity::{Angle, FluxDensity, Length, Temperature};
use cittert_arrays::{ArrayLayout, PhaseCenter, Polarization, Sensitivity, SpectralWindow, VisUnit, VisibilityHeader};
use clap::Args;

/// Options of `simulate`.
#[derive(Debug, Args)]
pub struct SimulateArgs {
    /// Name of a built-in layout, or a layout file.
    #[arg(long, value_name = "NAME|FILE")]
    layout: String,
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    band: BandArgs,
    #[command(flatten)]
    track: TrackArgs,
    #[command(flatten)]
    how: MethodArgs,
    #[command(flatten)]
    noise: NoiseArgs,
    /// Polarisation products of the set, such as RR,LL or XX,YY or I.
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "I")]
    pols: Vec<Polarization>,
    /// Seed of every random draw.
    #[arg(long, default_value_t = 1, value_name = "N")]
    seed: u64,
    #[command(flatten)]
    out: OutputArgs,
}

/// How visibilities are made.
#[derive(Debug, Args)]
struct MethodArgs {
    /// degrid (to --epsilon), dft (exact sum, slow) or mask (nearest cell of the FFT of the scene).
    #[arg(long, default_value = "degrid")]
    method: Method,
    /// Accuracy of degrid, relative to the total flux.
    #[arg(long, default_value_t = 1e-7, value_name = "X")]
    epsilon: f64,
    /// Frequencies averaged in each channel (bandwidth smearing).
    #[arg(long, default_value_t = 1, value_name = "N")]
    subchannels: usize,
    /// Element pattern: none, airy (with the layout's or the given diameter), gaussian (with --element-width), cos^N.
    #[arg(long, default_value = "none", value_name = "KIND")]
    element: String,
    /// Diameter of an airy element.
    #[arg(long, value_name = "LENGTH")]
    element_diameter: Option<Length>,
    /// Full width at half maximum of a gaussian element.
    #[arg(long, value_name = "ANGLE")]
    element_width: Option<Angle>,
    /// Constant removed from a scene in kelvin before the transform: auto, none, or a temperature.
    #[arg(long, default_value = "auto", value_name = "auto|none|TEMP")]
    pedestal: String,
    /// Leave out the w term.
    #[arg(long)]
    no_w: bool,
    /// Unit of the visibilities: jy, or ksr (K sr, the default for scenes in kelvin).
    #[arg(long, value_name = "jy|ksr")]
    unit: Option<String>,
}

/// Thermal noise.
#[derive(Debug, Args)]
struct NoiseArgs {
    /// Add thermal noise by each antenna's SEFD or Tsys, the channel width and the integration time.
    #[arg(long)]
    noise: bool,
    /// SEFD of every antenna (implies --noise).
    #[arg(long, value_name = "FLUX", conflicts_with = "tsys")]
    sefd: Option<FluxDensity>,
    /// System temperature of every antenna (implies --noise).
    #[arg(long, value_name = "TEMP")]
    tsys: Option<Temperature>,
    /// Aperture efficiency, for noise from Tsys.
    #[arg(long, value_name = "X")]
    aperture_efficiency: Option<f64>,
}

impl NoiseArgs {
    fn options(&self, seed: u64) -> Option<NoiseOptions> {
        let sensitivity = match (self.sefd, self.tsys) {
            (Some(sefd), _) => Some(Sensitivity::SefdJy(sefd.si())),
            (_, Some(tsys)) => Some(Sensitivity::TsysK(tsys.si())),
            _ => None,
        };
        if !self.noise && sensitivity.is_none() {
            return None;
        }
        let mut options = NoiseOptions::seeded(seed);
        options.sensitivity = sensitivity;
        if let Some(e) = self.aperture_efficiency {
            options.aperture_efficiency = e;
        }
        Some(options)
    }
}

impl MethodArgs {
    fn options(&self, layout: &ArrayLayout) -> Result<SimulateOptions> {
        Ok(SimulateOptions {
            method: self.method,
            epsilon: self.epsilon,
            w_term: !self.no_w,
            pattern: self.pattern(layout)?,
            subchannels: self.subchannels,
            pedestal: self.pedestal()?,
            ..SimulateOptions::default()
        })
    }

    fn pattern(&self, layout: &ArrayLayout) -> Result<ElementPattern> {
        let expected = || Failure::usage(format!("--element is {:?}, expected none, airy, gaussian or cos^N such as cos^2", self.element));
        Ok(match (self.element.as_str(), self.element_diameter, self.element_width) {
            ("none", _, _) => ElementPattern::None,
            ("airy", Some(d), _) => ElementPattern::Airy { diameter_m: d.si() },
            ("airy", None, _) => ElementPattern::airy_of(layout).context("--element airy")?,
            ("gaussian", _, Some(w)) => ElementPattern::Gaussian { fwhm_rad: w.si(), ref_freq_hz: None },
            ("gaussian", _, None) => return Err(Failure::usage("--element gaussian needs --element-width")),
            (text, _, _) => {
                let exponent = text.strip_prefix("cos^").and_then(|e| e.parse::<f64>().ok()).ok_or_else(expected)?;
                ElementPattern::CosPower { exponent }
            }
        })
    }

    fn pedestal(&self) -> Result<Pedestal> {
        Ok(match self.pedestal.as_str() {
            "auto" => Pedestal::Auto,
            "none" => Pedestal::None,
            text => {
                Pedestal::Kelvin(text.parse::<Temperature>().map_err(|e| Failure::usage(format!("--pedestal: {e} (or auto, or none)")))?.si())
            }
        })
    }

    fn unit(&self, scene: VisUnit) -> Result<VisUnit> {
        match self.unit.as_deref() {
            None => Ok(scene),
            Some("jy") => Ok(VisUnit::Jy),
            Some("ksr") => Ok(VisUnit::KelvinSr),
            Some(other) => Err(Failure::usage(format!("--unit is {other:?}, expected jy or ksr"))),
        }
    }
}

fn header(layout: ArrayLayout, spectrum: SpectralWindow, pols: &[Polarization], center: PhaseCenter, unit: VisUnit) -> VisibilityHeader {
    VisibilityHeader {
        telescope: layout.name.clone(),
        instrument: layout.name.clone(),
        layout,
        spectrum,
        polarizations: pols.to_vec(),
        phase_centers: vec![center],
        unit,
        pedestal_k: None,
        history: Vec::new(),
    }
}

/// Rows made at a time.
const BLOCK_ROWS: usize = 16_384;

/// Simulate and write UVH5.
///
/// # Errors
/// Anything wrong with the layout, the scene, the options or the disk.
pub fn run(args: &SimulateArgs, context: &Context) -> Result<Outcome> {
    args.out.check(&args.out.output)?;
    let layout = load_layout(&args.layout)?;
    let spectrum = args.band.spectrum()?;
    let (mut center, plan) = args.track.plan(&layout)?;
    let options = SimulateOptions { noise: args.noise.options(args.seed), ..args.how.options(&layout)? };
    let scene = args.scene.load(&center, &spectrum, context)?;
    if center.ra_dec_rad().is_some() {
        center.name.clone_from(&scene.name);
    }
    let mut head = header(layout, spectrum, &args.pols, center, args.how.unit(scene.unit)?);
    head.history.push(context.history());
    let mut simulator = Simulator::new(head, &scene.sky, &options, &context.console).context(format!("{}", args.scene.scene.display()))?;
    let path = &args.out.output;
    let created = cittert_formats::create_visibilities(path, simulator.header(), args.out.overwrite)?;
    for note in &created.notes {
        context.console.note(note);
    }
    let mut sink = created.sink;
    let summary = simulator.run(&mut plan.blocks(BLOCK_ROWS), sink.as_mut(), &context.console)?;
    sink.finish().context(format!("{}", path.display()))?;
    let header = simulator.header();
    let json = serde_json::json!({
        "output": path,
        "n_blts": summary.rows,
        "n_visibilities": summary.visibilities,
        "n_flagged": summary.flagged,
        "unit": header.unit.name(),
        "pedestal_k": header.pedestal_k,
        "seed": args.seed,
    });
    let text = format!("{}: {} rows, {} visibilities in {}", path.display(), summary.rows, summary.visibilities, header.unit.name());
    Ok(Outcome::new(json, text).wrote(path))
}
