//! Small sets for tests: one observation by a random array, point sources, and noise.

use crate::progress::{Event, Observer};
use cittert_arrays::{
    Alone, Antenna, ArrayLayout, LayoutFrame, Part, PhaseCenter, Polarization, Ranks, SPEED_OF_LIGHT_M_S, SpectralWindow, UvCoverage,
    VisUnit, VisibilityBlock, VisibilityHeader, VisibilitySet, VisibilitySource,
};
use ndarray::{Array2, Axis};
use num_complex::{Complex, Complex64};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Barrier, Mutex, PoisonError};

/// Numbers in [-1, 1), the same in every run.
pub(crate) struct Noise(pub(crate) u64);

impl Noise {
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// Antennas spread evenly over a disc of this radius in m, with small heights.
pub(crate) fn positions(n: usize, radius_m: f64, height_m: f64, seed: u64) -> Vec<[f64; 3]> {
    let mut noise = Noise(seed);
    let place = |k: usize| {
        let r = radius_m * ((k as f64 + 0.5) / n as f64).sqrt();
        let a = 2.399_963 * k as f64 + 0.2 * noise.next();
        [r * a.cos(), r * a.sin(), height_m * noise.next()]
    };
    (0..n).map(place).collect()
}

/// Exchange the visibilities of two antennas, as if their cables were swapped. The set is one of [`snapshot`].
pub(crate) fn swap_antennas(set: &mut VisibilitySet, one: u32, other: u32) {
    let coverage = &set.data.coverage;
    let swapped = |a: u32| match a {
        a if a == one => other,
        a if a == other => one,
        a => a,
    };
    let row_of = |a: u32, b: u32| (0..coverage.n_rows()).find(|r| (coverage.ant1[*r], coverage.ant2[*r]) == (a.min(b), a.max(b))).unwrap();
    let vis = ndarray::Array3::from_shape_fn(set.data.vis.dim(), |(r, c, p)| {
        let (a, b) = (swapped(coverage.ant1[r]), swapped(coverage.ant2[r]));
        let v = set.data.vis[(row_of(a, b), c, p)];
        if a < b { v } else { v.conj() }
    });
    set.data.vis = vis;
}

/// A snapshot again and again, 10 s apart. All baselines move along u by `step_m` from one time to the next.
pub(crate) fn repeated(one: VisibilitySet, times: usize, step_m: f64) -> VisibilitySet {
    let (n, c) = (one.data.n_rows(), &one.data.coverage);
    let rows: Vec<usize> = (0..times * n).map(|k| k % n).collect();
    let mut uvw_m = c.uvw_m.select(Axis(0), &rows);
    uvw_m.column_mut(0).iter_mut().enumerate().for_each(|(k, u)| *u += step_m * (k / n) as f64);
    let time_jd = rows.iter().enumerate().map(|(k, r)| c.time_jd[*r] + (k / n) as f64 * 10.0 / 86400.0).collect();
    let integration_s = c.integration_s.repeat(times);
    let coverage =
        UvCoverage::new(uvw_m, c.ant1.repeat(times), c.ant2.repeat(times), time_jd, integration_s, c.phase_center.repeat(times)).unwrap();
    let d = &one.data;
    let (vis, weights) = (d.vis.select(Axis(0), &rows), d.weights.select(Axis(0), &rows));
    let (flags, nsamples) = (d.flags.select(Axis(0), &rows), d.nsamples.select(Axis(0), &rows));
    let data = VisibilityBlock::new(coverage, vis, weights, flags, nsamples).unwrap();
    VisibilitySet::new(one.header, data).unwrap()
}

/// One integration of all baselines at a boresight, with sources (l, m, flux). The noise has this standard deviation in each real part.
pub(crate) fn snapshot(
    positions: &[[f64; 3]],
    freq_hz: &[f64],
    pols: &[Polarization],
    sources: &[(f64, f64, f64)],
    (sigma, unit): (f64, VisUnit),
) -> VisibilitySet {
    let antennas = positions.iter().enumerate().map(|(k, p)| Antenna::new(format!("a{k}"), k as u32, *p)).collect();
    let layout = ArrayLayout::new("test", LayoutFrame::Boresight, antennas).unwrap();
    let header = VisibilityHeader {
        layout,
        spectrum: SpectralWindow::new(freq_hz.to_vec(), vec![1e6; freq_hz.len()]).unwrap(),
        polarizations: pols.to_vec(),
        phase_centers: vec![PhaseCenter::unprojected("boresight")],
        unit,
        telescope: "test".into(),
        instrument: "test".into(),
        pedestal_k: None,
        scene_pedestal_k: None,
        scene_width_rad: None,
        antenna_temperature_k: None,
        near_field: Default::default(),
        annotations: Default::default(),
        history: Vec::new(),
    };
    let pairs: Vec<(usize, usize)> = (0..positions.len()).flat_map(|a| (a + 1..positions.len()).map(move |b| (a, b))).collect();
    let uvw = Array2::from_shape_fn((pairs.len(), 3), |(r, k)| positions[pairs[r].1][k] - positions[pairs[r].0][k]);
    let n = pairs.len();
    let coverage = UvCoverage::new(
        uvw.clone(),
        pairs.iter().map(|p| p.0 as u32).collect(),
        pairs.iter().map(|p| p.1 as u32).collect(),
        vec![2_460_000.5; n],
        vec![1.0; n],
        vec![0; n],
    )
    .unwrap();
    let mut data = VisibilityBlock::zeros(coverage, freq_hz.len(), pols.len());
    let mut noise = Noise(99);
    // The sum of three even deviates on [-1, 1) has unit variance.
    let mut gauss = || noise.next() + noise.next() + noise.next();
    for r in 0..n {
        for (c, f) in freq_hz.iter().enumerate() {
            let mut v = Complex64::default();
            for (l, m, s) in sources {
                let depth = (1.0 - l * l - m * m).sqrt() - 1.0;
                let turns = (uvw[(r, 0)] * l + uvw[(r, 1)] * m + uvw[(r, 2)] * depth) * f / SPEED_OF_LIGHT_M_S;
                v += Complex64::from_polar(*s, std::f64::consts::TAU * turns);
            }
            for p in 0..pols.len() {
                let z = v + Complex64::new(sigma * gauss(), sigma * gauss());
                data.vis[(r, c, p)] = Complex::new(z.re as f32, z.im as f32);
                if sigma > 0.0 {
                    data.weights[(r, c, p)] = (1.0 / (sigma * sigma)) as f32;
                }
            }
        }
    }
    VisibilitySet::new(header, data).unwrap()
}

/// Collects notes and warnings of a computation.
#[derive(Debug, Default)]
pub(crate) struct Recorder {
    messages: Mutex<Vec<String>>,
    cancel: AtomicBool,
}

impl Recorder {
    /// The notes and warnings received so far.
    pub(crate) fn messages(&self) -> Vec<String> {
        self.messages.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Ask the computation to stop.
    pub(crate) fn cancel(&self) {
        self.cancel.store(true, Ordering::Relaxed);
    }
}

impl Observer for Recorder {
    fn event(&self, event: Event<'_>) {
        if let Event::Note(text) | Event::Warning(text) = event {
            self.messages.lock().unwrap_or_else(PoisonError::into_inner).push(text.to_owned());
        }
    }

    fn cancelled(&self) -> bool {
        self.cancel.load(Ordering::Relaxed)
    }
}

/// A message that nobody has taken yet.
struct Letter {
    from: usize,
    to: usize,
    content: Vec<u8>,
}

/// Threads of this process that play the processes of a set.
struct Threads {
    rank: usize,
    size: usize,
    barrier: Arc<Barrier>,
    table: Arc<Mutex<Vec<Vec<f64>>>>,
    bytes: Arc<Mutex<Vec<Vec<u8>>>>,
    mail: Arc<Mutex<Vec<Letter>>>,
}

impl Threads {
    fn reduce(&self, values: &mut [f64], with: fn(f64, f64) -> f64) {
        let lock = || self.table.lock().unwrap_or_else(PoisonError::into_inner);
        lock()[self.rank] = values.to_vec();
        self.barrier.wait();
        for (k, v) in values.iter_mut().enumerate() {
            *v = lock().iter().map(|of| of[k]).reduce(with).unwrap();
        }
        self.barrier.wait();
    }

    /// The first message for this process whose sender is `wanted`.
    fn next(&self, wanted: impl Fn(usize) -> bool) -> Option<(usize, Vec<u8>)> {
        let mut mail = self.mail.lock().unwrap_or_else(PoisonError::into_inner);
        let at = mail.iter().position(|letter| letter.to == self.rank && wanted(letter.from))?;
        let Letter { from, content, .. } = mail.remove(at);
        Some((from, content))
    }
}

impl Ranks for Threads {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.size
    }

    fn sum(&self, values: &mut [f64]) {
        self.reduce(values, |a, b| a + b);
    }

    fn largest(&self, values: &mut [f64]) {
        self.reduce(values, f64::max);
    }

    fn meet(&self) {
        self.barrier.wait();
    }

    fn exchange(&self, own: Vec<u8>) -> Vec<Vec<u8>> {
        let lock = || self.bytes.lock().unwrap_or_else(PoisonError::into_inner);
        lock()[self.rank] = own;
        self.barrier.wait();
        let all = lock().clone();
        self.barrier.wait();
        all
    }

    fn deal(&self, own: &[u8], lengths: &[usize], all: &mut [u8]) {
        let (first, length) = (lengths[..self.rank].iter().sum::<usize>(), lengths[self.rank]);
        let given = self.exchange(own.to_vec()).concat();
        let of_each = given.chunks_exact(own.len().max(1)).map(|g| &g[first..first + length]);
        all.copy_from_slice(&of_each.collect::<Vec<_>>().concat());
    }

    fn send(&self, to: usize, message: &[u8]) {
        self.mail.lock().unwrap_or_else(PoisonError::into_inner).push(Letter { from: self.rank, to, content: message.to_vec() });
    }

    fn take(&self) -> Option<(usize, Vec<u8>)> {
        self.next(|_| true)
    }

    fn awaited(&self, from: usize) -> Vec<u8> {
        loop {
            if let Some((_, message)) = self.next(|f| f == from) {
                return message;
            }
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
    }
}

/// What `work` makes of a set in each of `size` processes, played by threads. One process has the plain set.
pub(crate) fn in_processes<R: Send>(size: usize, set: &VisibilitySet, work: impl Fn(&mut dyn VisibilitySource) -> R + Sync) -> Vec<R> {
    if size == 1 {
        return vec![work(&mut set.clone())];
    }
    as_processes(size, |ranks| work(&mut Part::new(Box::new(set.clone()), ranks)))
}

/// What `work` makes in each of `size` processes, played by threads.
pub(crate) fn as_processes<R: Send>(size: usize, work: impl Fn(Arc<dyn Ranks>) -> R + Sync) -> Vec<R> {
    if size == 1 {
        return vec![work(Arc::new(Alone))];
    }
    let (barrier, mail) = (Arc::new(Barrier::new(size)), Arc::default());
    let (table, bytes) = (Arc::new(Mutex::new(vec![Vec::new(); size])), Arc::new(Mutex::new(vec![Vec::new(); size])));
    std::thread::scope(|scope| {
        let begin = |rank| {
            let (barrier, table, bytes, mail) = (barrier.clone(), table.clone(), bytes.clone(), Arc::clone(&mail));
            let ranks = Arc::new(Threads { rank, size, barrier, table, bytes, mail });
            let work = &work;
            // A pool of its own, as processes have, so that one that waits keeps no other from work.
            scope.spawn(move || rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(|| work(ranks)))
        };
        let all: Vec<_> = (0..size).map(begin).collect();
        all.into_iter().map(|t| t.join().unwrap()).collect()
    })
}
