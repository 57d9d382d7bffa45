//! The commands that image the same scene with every layout.

use super::args::CompareArgs;
use super::design::Design;
use super::vary::Variant;
use crate::cli::failure::{Failure, Result};
use crate::cli::run::command::{DIR, Step};
use crate::imaging::{ImageSize, SizeTuning};
use crate::simulate::Element;
use cittert_arrays::quantity::{Angle, Frequency};
use cittert_arrays::{SPEED_OF_LIGHT_M_S, SkyGrid, Weighting};
use clap::ValueEnum;

/// A point at the centre. Its dirty image is the dirty beam.
pub(super) const POINT: &str = "point.csv";
/// Its source list.
pub(super) const POINT_TEXT: &str = "l_rad,m_rad,flux_jy\n0,0,1\n";
/// Folder of what the images of variants write.
pub(super) const WORK: &str = "varied";
/// The scene as an image.
pub(super) const TRUTH: &str = "scene.fits";
/// Pixels along each side of a dirty beam. With a quarter of a fringe in each they reach 32 fringes from the centre.
const BEAM_SIZE: usize = 256;
/// Width of a channel over its frequency, where no bandwidth is given: data without noise do not depend on it.
const NARROW: f64 = 1e-3;

/// One kind of images: the command that makes it and its key in the results, its file, and the title of its section.
pub(super) struct Made {
    pub(super) key: &'static str,
    pub(super) file: &'static str,
    pub(super) title: &'static str,
}

/// From the data to the best image.
pub(super) const IMAGES: [Made; 3] = [
    Made { key: "dirty", file: "dirty.fits", title: "Dirty images" },
    Made { key: "clean", file: "clean-image.fits", title: "Images of CLEAN" },
    Made { key: "mem", file: "mem-model.fits", title: "Images of maximum entropy" },
];

/// The file of the difference between an image and the scene.
pub(super) fn error_file(made: &Made) -> String {
    format!("{}-error.fits", made.key)
}

/// The pixels of all images.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pixels {
    pub(super) size: ImageSize,
    pub(super) cell: Angle,
}

/// The layout with the longest baseline.
pub(super) fn finest(designs: &[Design]) -> Option<&Design> {
    designs.iter().max_by(|a, b| a.extent.longest_m.total_cmp(&b.extent.longest_m))
}

/// Pixels that suit the finest layout, at the highest frequency of the band.
fn cell_rad(args: &CompareArgs, designs: &[Design]) -> f64 {
    let highest_hz = args.freq.si() + 0.5 * args.figures.bandwidth.map_or(0.0, Frequency::si);
    let longest_m = finest(designs).map_or(0.0, |d| d.extent.longest_m);
    SPEED_OF_LIGHT_M_S / highest_hz / longest_m / SizeTuning::default().cells_per_fringe
}

/// Pixels of the dirty beams.
pub(super) fn beam_pixels(args: &CompareArgs, designs: &[Design]) -> Pixels {
    Pixels { size: ImageSize::square(BEAM_SIZE), cell: Angle(cell_rad(args, designs)) }
}

/// Pixels of the images: those of the options, or pixels that suit the finest layout and cover the scene.
///
/// # Errors
/// Without a size: a source list, or a scene of too many pixels.
pub(super) fn image_pixels(args: &CompareArgs, designs: &[Design], truth: Option<&SkyGrid>) -> Result<Pixels> {
    let cell = args.observed.cell.unwrap_or_else(|| Angle(cell_rad(args, designs)));
    if let Some(size) = args.observed.size {
        return Ok(Pixels { size, cell });
    }
    let Some(grid) = truth else {
        return Err(Failure::usage("a source list has no frame: give the images a --size, and a --cell if they shall not be chosen"));
    };
    let most = SizeTuning::default().largest_side;
    let side = |n: usize| {
        let needed = (n as f64 * grid.cell_rad / cell.si()).ceil();
        if needed <= most as f64 { Ok((needed as usize).next_multiple_of(2)) } else { Err(needed) }
    };
    match (side(grid.n_l), side(grid.n_m)) {
        (Ok(columns), Ok(rows)) => Ok(Pixels { size: ImageSize { columns, rows }, cell }),
        (Err(needed), _) | (_, Err(needed)) => Err(Failure::usage(format!(
            "images of {needed} pixels a side would cover the scene, more than {most}: give a --size, and a --cell if fewer pixels shall cover it"
        ))),
    }
}

/// Whether the scene has an image with which others can be compared. A source list has none.
pub(super) fn has_truth(args: &CompareArgs) -> bool {
    let ending = args.observed.scene.as_ref().and_then(|s| s.extension());
    args.observed.scene.is_some() && ending.is_none_or(|e| !e.eq_ignore_ascii_case("csv"))
}

fn band(args: &CompareArgs) -> [String; 2] {
    let width = args.figures.bandwidth.unwrap_or(Frequency(NARROW * args.freq.si()));
    [format!("--freq={}", args.freq), format!("--bandwidth={width}")]
}

fn word(name: &str, value: Option<impl ToString>) -> Option<String> {
    value.map(|v| format!("--{name}={}", v.to_string()))
}

/// The scene as an image.
pub(super) fn truth(args: &CompareArgs) -> Option<Step> {
    let file = args.observed.scene.as_ref().filter(|_| has_truth(args))?;
    let how = &args.observed.how;
    let own = [
        word("scene-cell", how.scene_cell),
        word("scene-size", how.scene_size),
        word("scene-min", how.scene_min),
        word("scene-max", how.scene_max),
    ];
    let step = Step::new("Scene", "scene", "", "scene render").with(band(args)).with(own.into_iter().flatten());
    Some(step.to(TRUTH).with(["--".to_owned(), file.display().to_string()]))
}

/// The dirty beam of a layout.
pub(super) fn beam(name: &str, args: &CompareArgs, pixels: Pixels) -> Vec<Step> {
    let simulate = Step::new("Dirty beams", format!("{name}: a point"), "", "simulate").with(seen(name, args));
    let f = &args.figures;
    vec![
        simulate.with([format!("--scene={DIR}/{POINT}")]).to(&format!("{name}/point.uvh5")),
        Step::new("Dirty beams", format!("{name}: dirty beam"), "", "beam")
            .with([format!("{DIR}/{name}/point.uvh5")])
            .with(sized(pixels))
            .with([weighting(f.weighting)])
            .with(word("robust", f.robust))
            .to(&format!("{name}/psf.fits")),
    ]
}

/// How a layout observes: what it is, and the band.
fn seen(name: &str, args: &CompareArgs) -> Vec<String> {
    let of = [format!("--layout={DIR}/{name}/layout.toml"), format!("--channels={}", args.figures.channels)];
    of.into_iter().chain(band(args)).collect()
}

fn weighting(scheme: Weighting) -> String {
    format!("--weighting={}", scheme.to_possible_value().map(|v| v.get_name().to_owned()).unwrap_or_default())
}

fn sized(pixels: Pixels) -> [String; 2] {
    [format!("--size={}", pixels.size), format!("--cell={}", pixels.cell)]
}

/// The file with which the images of a layout are compared: the scene, or the scene as the elements of the layout see it.
pub(super) fn scene_file(name: &str, args: &CompareArgs) -> String {
    if args.observed.element == Element::None { TRUTH.to_owned() } else { format!("{name}/{TRUTH}") }
}

/// The visibilities of the scene that a layout file sees. `vis` is the output.
fn simulate(name: &str, args: &CompareArgs, seen: Vec<String>, vis: &str) -> Option<Step> {
    let (o, f) = (&args.observed, &args.figures);
    let scene = o.scene.as_ref()?;
    let own = [
        word("scene-cell", o.how.scene_cell),
        word("scene-size", o.how.scene_size),
        word("scene-min", o.how.scene_min),
        word("scene-max", o.how.scene_max),
        o.how.scene_channels.then(|| "--scene-channels".to_owned()),
        Some(format!("--element={}", o.element)),
        word("element-diameter", o.element_diameter),
        word("element-width", o.element_width),
        Some(format!("--integration={}", f.time)),
        Some(format!("--seed={}", o.seed)),
        o.noise.then(|| "--noise".to_owned()),
        word("tsys", f.tsys.filter(|_| o.noise)),
        word("sefd", f.sefd.filter(|_| o.noise)),
    ];
    let step = Step::new("Scene", format!("{name}: visibilities"), "", "simulate").with(seen);
    Some(step.with([format!("--scene={}", scene.display())]).with(own.into_iter().flatten()).to(vis))
}

/// One image of a set of visibilities. All layouts have the same words but for their files.
fn image(made: &Made, name: &str, args: &CompareArgs, pixels: Pixels, (vis, out): (&str, &str)) -> Step {
    let o = &args.observed;
    let step = Step::new(made.title, format!("{name}: {}", made.key), made.key, made.key).with([format!("{DIR}/{vis}")]);
    let step = step.with(sized(pixels)).with([weighting(o.image_weighting)]);
    step.with((made.key == "clean").then(|| format!("--algorithm={}", o.algorithm))).to(out)
}

/// The comparison of an image with the truth at the common resolution.
fn judged(made: &Made, name: &str, args: &CompareArgs, resolution_rad: f64, file: &str) -> Step {
    let step = Step::new(made.title, format!("{name}: error of {}", made.key), format!("compare.{}", made.key), "compare");
    let files = [format!("{DIR}/{file}"), format!("{DIR}/{}", scene_file(name, args))];
    step.with(files).with([format!("--resolution={}", Angle(resolution_rad))]).with(word("disc", args.observed.disc))
}

/// The images of a layout.
pub(super) fn images(name: &str, args: &CompareArgs, pixels: Pixels) -> Vec<Step> {
    let vis = format!("{name}/vis.uvh5");
    let made = |made: &Made| {
        let out = format!("{name}/{}", if made.key == "dirty" { made.file } else { made.key });
        image(made, name, args, pixels, (&vis, &out))
    };
    simulate(name, args, seen(name, args), &vis)
        .into_iter()
        .flat_map(|first| std::iter::once(first).chain(IMAGES.iter().map(made)))
        .collect()
}

/// The errors of the images of a layout.
pub(super) fn errors(name: &str, args: &CompareArgs, resolution_rad: f64) -> Vec<Step> {
    let one = |made: &Made| {
        let difference = format!("--difference={DIR}/{name}/{}", error_file(made));
        judged(made, name, args, resolution_rad, &format!("{name}/{}", made.file)).with([difference])
    };
    IMAGES.iter().map(one).collect()
}

/// The image of maximum entropy of a variant of a layout, and its error. What they write is in the folder `work` of the layout, which does not stay.
pub(super) fn varied(
    name: &str,
    args: &CompareArgs,
    pixels: Pixels,
    resolution_rad: f64,
    (variant, section): (&Variant, &'static str),
) -> Vec<Step> {
    let Some(made) = IMAGES.iter().find(|m| m.key == "mem") else { return Vec::new() };
    let work = format!("{name}/{WORK}");
    let file = variant.layout_file(name);
    let width = variant.bandwidth.unwrap_or(Frequency(NARROW * args.freq.si()));
    let seen = vec![
        format!("--layout={DIR}/{file}"),
        format!("--channels={}", variant.channels),
        format!("--freq={}", args.freq),
        format!("--bandwidth={width}"),
    ];
    let vis = format!("{work}/vis.uvh5");
    let all = [
        simulate(name, args, seen, &vis),
        Some(image(made, name, args, pixels, (&vis, &format!("{work}/{}", made.key)))),
        Some(judged(made, name, args, resolution_rad, &format!("{work}/{}", made.file))),
    ];
    all.into_iter().flatten().map(|step| Step { section, title: format!("{} of {}", step.title, variant.told()), ..step }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::command;
    use cittert_arrays::SkyFrame;
    use clap::FromArgMatches;

    fn args(line: &str) -> CompareArgs {
        let all = command().try_get_matches_from(line.split(' ')).unwrap();
        let (_, layout) = all.subcommand().unwrap();
        CompareArgs::from_arg_matches(layout.subcommand().unwrap().1).unwrap()
    }

    #[test]
    fn all_layouts_get_the_same_words() {
        let args = args("cittert layout compare a b --freq 94GHz --bandwidth 8GHz --noise --tsys 600K --seed 7 --scene s.toml -o d");
        let pixels = Pixels { size: ImageSize::square(64), cell: Angle(1e-3) };
        let words =
            |name: &str| -> Vec<String> { images(name, &args, pixels).iter().map(|s| s.shown("d").replace(name, "NAME")).collect() };
        let found = words("first");
        assert_eq!(found, words("second"));
        assert_eq!(found.len(), 4);
        assert!(found[0].contains("--seed=7") && found[0].contains("--noise --tsys=600K"), "{}", found[0]);
        assert!(found[2].contains("--size=64") && found[2].contains("-o d/NAME/clean"), "{}", found[2]);
        let judged = errors("first", &args, 2e-3);
        assert!(
            judged.len() == 3 && judged[2].shown("d").contains("compare d/first/mem-model.fits d/scene.fits --resolution=2mrad"),
            "{}",
            judged[2].shown("d")
        );
        assert!(!found.join(" ").contains("--sefd"));
    }

    #[test]
    fn images_cover_the_scene_with_pixels_of_the_options() {
        let args = args("cittert layout compare a b --freq 94GHz --cell 2mrad --scene s.toml -o d");
        let grid = |n: usize| SkyGrid::new(n, 50, 1e-3, SkyFrame::Boresight).unwrap();
        let found = image_pixels(&args, &[], Some(&grid(101))).unwrap();
        assert_eq!(found.size, ImageSize { columns: 52, rows: 26 });
        assert!(image_pixels(&args, &[], None).unwrap_err().to_string().contains("--size"));
    }
}
