//! Time of the surface integrals, one angle of incidence each.

use cittert_phenomenology::dielectrics::{Extrapolation, Material};
use cittert_phenomenology::surfaces::{Sky, StackDescription, SurfaceError, SurfaceModel};
use criterion::Criterion;
use std::hint::black_box;
use std::time::Duration;

const STACK: &str = r#"
coherent = true
[[layer]]
material = "paint"
thickness_m = 2e-4
[[layer]]
material = "fresh-ice"
thickness_m = 3e-3
[[layer]]
material = "steel"
"#;

fn surface(stack: &StackDescription, roughness: &str) -> Result<SurfaceModel, SurfaceError> {
    let stack = stack.resolve(94e9, Extrapolation::Documented)?;
    Ok(SurfaceModel::new(stack, roughness.parse()?))
}

fn main() -> Result<(), SurfaceError> {
    let mut criterion = Criterion::default()
        .sample_size(20)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(1500))
        .configure_from_args();
    let sea = Material::by_name("sea-water")?;
    let sea = StackDescription::of_material(sea, sea.state(), None);
    let painted = StackDescription::from_toml(STACK)?;
    let sky = |zenith: f64| 280.0 * (1.0 - (-0.1 / zenith.cos().max(1e-9)).exp());
    for (name, stack, roughness) in [
        ("sea, smooth", &sea, "smooth"),
        ("sea, facets, one bounce", &sea, "go:0.15,0.15"),
        ("sea, facets of unequal slopes", &sea, "go:0.2,0.1"),
        (
            "sea, facets, second bounce",
            &sea,
            "go:0.15,0.15,second-bounce",
        ),
        ("three layers, smooth", &painted, "smooth"),
        ("three layers, facets", &painted, "go:0.15,0.15"),
    ] {
        let model = surface(stack, roughness)?;
        criterion.bench_function(name, |b| {
            b.iter(|| model.brightness_k(black_box(0.9), 0.3, Sky::Symmetric(&sky)))
        });
    }
    criterion.final_summary();
    Ok(())
}
