//! Simulations by several processes have the bytes of one.

use super::engine_tests::{coverage, header, scene};
use super::*;
use crate::fixtures::as_processes;
use crate::memory::MemoryBudget;
use crate::progress::Silent;
use cittert_arrays::{BrightnessUnit, InTurn, Polarization, Source, SpectralWindow, VisUnit, VisibilitySet, VisibilitySink};

/// The set of process 0 and the rows that it counts, in several blocks and passes.
fn simulated(processes: usize, sky: &SkyModel, options: &SimulateOptions) -> (VisibilitySet, Summary) {
    let h = header(VisUnit::Jy, SpectralWindow::band(1e9, 2e8, 2).unwrap(), &[Polarization::RR, Polarization::LL]);
    let rows = coverage(700, 30.0);
    let run = |ranks: std::sync::Arc<dyn cittert_arrays::Ranks>| {
        let mut simulator = Simulator::new(h.clone(), sky, options, &Silent).unwrap();
        // A pass has 200 rows.
        simulator.memory = MemoryBudget::new(16 << 20).unwrap();
        let mut set = simulate_set(h.clone(), &rows.rows(0..1).unwrap(), sky, options, &Silent).unwrap();
        set.data = set.data.rows(0..0).unwrap();
        let mut blocks = [0..300, 300..301, 301..700].into_iter().map(|r| rows.rows(r));
        let sink = (ranks.rank() == 0).then_some(&mut set as &mut dyn VisibilitySink);
        let summary = simulator.run_in_turn(&mut blocks, None, &mut InTurn::new(ranks, sink), &Silent).unwrap();
        (set, summary)
    };
    as_processes(processes, run).swap_remove(0)
}

#[test]
fn processes_in_turn_simulate_the_bytes_of_one() {
    let image = scene(64, 4e-3, BrightnessUnit::JyPerPixel, |r, c| ((r * 31 + c * 17) % 13) as f64);
    let sky = SkyModel { images: vec![image], sources: vec![Source::point(0.01, 0.0, 3.0)], surface: None };
    for method in [Method::Degrid, Method::Dft, Method::Mask] {
        let options = SimulateOptions { method, noise: true, seed: 5, ..SimulateOptions::default() };
        let (one, counts) = simulated(1, &sky, &options);
        assert_eq!((one.data.n_rows(), counts.rows, counts.visibilities), (700, 700, 2800));
        for processes in [2, 3, 5] {
            let (several, other) = simulated(processes, &sky, &options);
            assert_eq!(other, counts);
            assert!(several == one, "{method:?} by {processes} processes");
        }
    }
}
