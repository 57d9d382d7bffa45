//! Gridding and prediction in visibilities per second, for several numbers of visibilities and sizes of the image.
// A benchmark that cannot be set up stops at once. criterion generates items without documentation.
#![allow(missing_docs, clippy::expect_used)]

mod tracks;

use cittert::fourier::{Degridder, GridOptions, Gridder, UvwExtent};
use cittert_arrays::{SkyFrame, SkyGrid};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use ndarray::Array2;
use num_complex::Complex32;
use tracks::{CELL_RAD, Tracks, tracks};

fn grid(n: usize) -> SkyGrid {
    SkyGrid::new(n, n, CELL_RAD, SkyFrame::Sky { ra_rad: 0.0, dec_rad: 0.5, frame: "icrs".into() }).expect("a small field")
}

fn to_image(t: &Tracks, n: usize) -> Array2<f64> {
    let extent = UvwExtent::of(t.uvw_m.view());
    let mut g = Gridder::<f32>::new(&grid(n), &t.freq_hz, extent, &GridOptions::default()).expect("options");
    g.add(t.uvw_m.view(), t.vis.view()).expect("rows");
    g.finish()
}

fn from_image(t: &Tracks, image: &Array2<f64>, out: &mut Array2<Complex32>) {
    let extent = UvwExtent::of(t.uvw_m.view());
    let d = Degridder::<f32>::new(&grid(image.ncols()), image.view(), &t.freq_hz, extent, &GridOptions::default(), None).expect("options");
    d.predict(t.uvw_m.view(), out.view_mut()).expect("rows");
}

fn against_visibilities(c: &mut Criterion) {
    let mut group = c.benchmark_group("visibilities at 512 x 512");
    group.sample_size(10);
    for n_times in [18, 180, 720] {
        let t = tracks(0..n_times, n_times, 16);
        group.throughput(Throughput::Elements(t.vis.len() as u64));
        group.bench_with_input(BenchmarkId::new("to image", t.vis.len()), &t, |b, t| b.iter(|| to_image(t, 512)));
        let image = to_image(&t, 512);
        let mut out = Array2::default(t.vis.dim());
        group.bench_with_input(BenchmarkId::new("from image", t.vis.len()), &t, |b, t| b.iter(|| from_image(t, &image, &mut out)));
    }
    group.finish();
}

fn against_pixels(c: &mut Criterion) {
    let mut group = c.benchmark_group("pixels with one million visibilities");
    group.sample_size(10);
    let t = tracks(0..178, 178, 16);
    for n in [256, 512, 1024, 2048, 4096] {
        group.throughput(Throughput::Elements((n * n) as u64));
        group.bench_with_input(BenchmarkId::new("to image", n), &n, |b, n| b.iter(|| to_image(&t, *n)));
    }
    group.finish();
}

criterion_group!(benches, against_visibilities, against_pixels);
criterion_main!(benches);
