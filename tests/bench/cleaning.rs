//! Minor cycles on a crowded field, in components per second, and the convolutions that they use.
// A benchmark that cannot be set up stops at once. criterion generates items without documentation.
#![allow(missing_docs, clippy::expect_used)]

mod tracks;

use cittert::deconvolve::{CleanTuning, Minor, MinorLimits, Scales, TABLE};
use cittert::fourier::{Convolver, GridOptions, Gridder, UvwExtent};
use cittert_arrays::{SkyFrame, SkyGrid};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use ndarray::{ArcArray2, Array2, s};
use num_complex::Complex32;
use tracks::{CELL_RAD, tracks};

/// The dirty beam of a short observation, and the dirty image of a field of points.
fn beam_and_field(n: usize) -> (ArcArray2<f32>, Array2<f32>) {
    let t = tracks(0..12, 12, 8);
    let frame = SkyFrame::Sky { ra_rad: 0.0, dec_rad: 0.5, frame: "icrs".into() };
    let grid = SkyGrid::new(n, n, CELL_RAD, frame).expect("a small field");
    let mut g = Gridder::<f32>::new(&grid, &t.freq_hz, UvwExtent::of(t.uvw_m.view()), &GridOptions::default()).expect("options");
    g.add(t.uvw_m.view(), Array2::from_elem(t.vis.dim(), Complex32::new(1.0, 0.0)).view()).expect("rows");
    let mut psf: Array2<f32> = g.finish();
    let peak = psf[(n / 2, n / 2)];
    psf /= peak;
    psf[(n / 2, n / 2)] = 1.0;
    let mut points = Array2::zeros((n, n));
    for k in 0..60 {
        points[(n / 8 + k * 7919 % (3 * n / 4), n / 8 + k * 104_729 % (3 * n / 4))] = 1.0 / (1.0 + k as f32);
    }
    let engine = Convolver::<f32>::new((n, n), n / 2 + 1);
    let field = engine.convolve(points.view(), &engine.kernel(psf.view()));
    (psf.into_shared(), field)
}

fn minor_cycles(c: &mut Criterion) {
    let mut group = c.benchmark_group("1000 components");
    group.sample_size(10);
    group.throughput(Throughput::Elements(1000));
    for n in [512, 2048] {
        let (psf, field) = beam_and_field(n);
        for entry in TABLE.iter().filter(|e| n == 512 || e.name != "multiscale") {
            let mut d = (entry.make)(&psf, &Scales::default(), &CleanTuning::default()).expect("a beam");
            group.bench_with_input(BenchmarkId::new(entry.name, n), &field, |b, field| {
                b.iter(|| {
                    let mut residual = field.clone();
                    let limits = MinorLimits { gain: 0.1, level: 0.0, iterations: 1000, negative: true };
                    d.minor(Minor { residual: &mut residual, mask: None, limits }).expect("a cycle")
                });
            });
        }
    }
    group.finish();
}

fn convolutions(c: &mut Criterion) {
    let mut group = c.benchmark_group("convolution");
    group.sample_size(10);
    for n in [512, 2048] {
        let (psf, field) = beam_and_field(n);
        let engine = Convolver::<f32>::new((n, n), n / 2 + 1);
        let spectrum = engine.kernel(psf.view());
        group.throughput(Throughput::Elements((n * n) as u64));
        group.bench_with_input(BenchmarkId::new("f32", n), &field, |b, f| b.iter(|| engine.convolve(f.slice(s![.., ..]), &spectrum)));
    }
    group.finish();
}

criterion_group!(benches, minor_cycles, convolutions);
criterion_main!(benches);
