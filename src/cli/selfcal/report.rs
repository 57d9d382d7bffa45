//! The results of `selfcal`: a JSON object for each round, one for all rounds, and a few lines of text.

use crate::calibrate::{Calibrated, ClosureSupport, ModelMetrics, Prediction, RoundRecord, Selfcal, SolutionInterval, Verdict};
use crate::cli::text::{chi2, number};
use crate::imaging::CleanProducts;
use crate::verdict::Finding;
use serde_json::{Map, Value, json};
use std::fmt::Write;
use std::path::Path;

/// The part of the power of the held-out baselines that a right image with right gains leaves at most. In random cases whose images came out right
/// it is below 0.06.
const UNPREDICTED: f64 = 0.1;
/// What to try where the gains are not supported.
const NEXT: &str = "a longer --solint, a --model, a --size that holds the whole source, or --force to apply the best round anyway";

fn metrics(m: &ModelMetrics) -> Value {
    json!({
        "peak": m.peak, "residual_rms": m.residual_rms, "dynamic_range": m.dynamic_range(), "model_flux": m.model_flux,
        "iterations": m.iterations,
    })
}

fn support(s: &ClosureSupport) -> Value {
    json!({
        "is_signal": s.is_signal(), "model_sigmas": s.model_sigmas, "halves_sigmas": s.halves_sigmas, "misfit_rad": s.misfit_rad,
        "triangles": s.triangles, "noise_scale": s.noise_scale,
    })
}

fn interval(solint: SolutionInterval) -> Value {
    match solint {
        SolutionInterval::Infinite => "inf".into(),
        SolutionInterval::Integration => "int".into(),
        SolutionInterval::Seconds(s) => s.into(),
    }
}

fn round(number: usize, r: &RoundRecord) -> Value {
    let flagged: Map<String, Value> = r.report.flagged.iter().map(|(why, n)| (why.name().to_owned(), (*n).into())).collect();
    let samples = &r.report.samples;
    let mut out = json!({
        "round": number, "mode": r.plan.mode.name(), "solint_s": interval(r.plan.solint), "depth": r.plan.depth,
        "gains_solved": r.report.solved, "gains_flagged": flagged, "not_converged": r.report.not_converged(),
        "worst_condition": r.report.worst_condition(), "reduced_chi2": r.report.reduced_chi2(), "held_out_misfit": r.prediction.as_ref().map(Prediction::misfit),
        "refant_fallbacks": r.report.refant_fallbacks, "samples_used": samples.used, "samples_flagged": samples.flagged,
        "samples_not_finite": samples.not_finite, "samples_bad_model": samples.bad_model, "closure": support(&r.support),
    });
    if let (Value::Object(to), Value::Object(from)) = (&mut out, metrics(&r.metrics)) {
        to.extend(from);
    }
    out
}

/// Every round, in order.
pub(super) fn rounds(result: &Selfcal) -> Vec<Value> {
    result.rounds.iter().enumerate().map(|(k, r)| round(k + 1, r)).collect()
}

/// The results of all rounds, without times.
pub(super) fn json(output: &Path, calibrated: &Calibrated, p: &CleanProducts, rounds: Vec<Value>) -> Value {
    let result = &calibrated.rounds;
    let (s, best) = (&p.statistics, result.best());
    let stops: Vec<&str> = s.stop.iter().map(|r| r.name()).collect();
    let refant = best.gains.refant.and_then(|r| best.gains.layout.antennas().get(r)).map(|a| a.name.clone());
    let mut out = json!({
        "output": output, "accepted": calibrated.verdict.accepted(), "verdict": sentence(calibrated), "judgement": judgement(calibrated),
        "algorithm": calibrated.algorithm, "rounds_algorithm": calibrated.best, "stop_reason": result.stop.to_string(), "clean_stop_reason": stops, "iterations": s.iterations,
        "major_cycles": s.major_cycles, "residual_rms": s.residual_rms, "residual_peak": s.residual_peak, "model_flux": s.model_flux,
        "dynamic_range": s.dynamic_range, "chi2_per_datum": s.chi2_per_datum, "unit": p.restored.unit.bunit(),
        "size": [p.restored.grid.n_l, p.restored.grid.n_m], "cell_rad": p.restored.grid.cell_rad,
        "n_rounds": result.rounds.len(), "best_round": result.best + 1, "refant": refant, "rounds": rounds,
        "before": result.before.as_ref().map(metrics), "warnings": result.warnings,
        "closure_supports_model": result.rounds.first().is_none_or(|r| r.support.is_signal()),
    });
    if let Some(b) = p.beams.first() {
        (out["bmaj_rad"], out["bmin_rad"], out["bpa_rad"]) = (b.bmaj_rad.into(), b.bmin_rad.into(), b.bpa_rad.into());
    }
    out
}

fn judgement(c: &Calibrated) -> Value {
    let candidates: Vec<Value> = c
        .candidates
        .iter()
        .map(|c| json!({ "algorithm": c.name, "misfit_before": c.before, "misfit_after": c.after, "failure": c.failure }))
        .collect();
    let mut out = json!({ "candidates": candidates, "judged": !matches!(c.verdict, Verdict::NotJudged) });
    if let (Some(e), Value::Object(to)) = (&c.evidence, &mut out) {
        let numbers = json!({
            "held_out_baselines": e.baselines, "misfit_before": e.before, "misfit_after": e.after, "sigmas": e.sigmas,
            "explained": e.explained, "gain_rms": e.gain_rms, "gain_sigma": e.gain_sigma,
        });
        if let Value::Object(numbers) = numbers {
            to.extend(numbers);
        }
    }
    out
}

/// The finding that the gains are not supported, or that they are and the image is poor all the same.
pub(super) fn doubt(calibrated: &Calibrated) -> Option<Finding> {
    match &calibrated.verdict {
        Verdict::Rejected(why) => {
            Some(Finding::new("not_accepted", format!("self-calibration is not accepted, and the data are left as they were: {why}"), NEXT))
        }
        Verdict::Forced(why) => Some(Finding::new("not_supported", format!("the gains are applied against the evidence: {why}"), NEXT)),
        Verdict::Accepted => calibrated.evidence.filter(|e| e.after > UNPREDICTED).map(|e| {
            let says = format!(
                "gains and image leave {:.0} % of the power of the held-out baselines unexplained: they are better than before, and not right yet",
                100.0 * e.after
            );
            Finding::new("not_predicted", says, "a longer --solint, a --model, a --size that holds the whole source, or another --algorithm")
        }),
        Verdict::NotJudged => None,
    }
}

/// The decision in a sentence.
fn sentence(c: &Calibrated) -> String {
    let misfit = c.evidence.map_or(String::new(), |e| {
        format!(
            "the misfit of the {} baselines held out is {:.4} without the gains and {:.4} with them ({:.1} sigma)",
            e.baselines, e.before, e.after, e.sigmas
        )
    });
    match &c.verdict {
        Verdict::Accepted => format!("accepted: {misfit}"),
        Verdict::Forced(why) => format!("applied because of --force, not supported: {why}"),
        Verdict::Rejected(why) => format!("NOT accepted, the data are as they were: {why}. Try {NEXT}"),
        Verdict::NotJudged => "not judged: no baselines were held out".into(),
    }
}

/// A line for each round, and the final results.
pub(super) fn text(calibrated: &Calibrated, p: &CleanProducts) -> String {
    let result = &calibrated.rounds;
    let unit = p.restored.unit.bunit();
    let mut out = String::from("round  mode       solved  flagged  dynamic range  residual rms\n");
    // Writing to a String does not fail.
    let mut line = |name: &str, mode: &str, solved: String, flagged: String, m: &ModelMetrics| {
        let _ = writeln!(out, "{name:6} {mode:10} {solved:>6}  {flagged:>7}  {:>13.1}  {:.4e}", m.dynamic_range(), m.residual_rms);
    };
    if let Some(m) = &result.before {
        line("before", "", String::new(), String::new(), m);
    }
    for (k, r) in result.rounds.iter().enumerate() {
        let flagged: usize = r.report.flagged.values().sum();
        line(&(k + 1).to_string(), r.plan.mode.name(), r.report.solved.to_string(), flagged.to_string(), &r.metrics);
    }
    let s = &p.statistics;
    let _ = write!(
        out,
        "stopped: {}; best round {}\nself-calibration {}\nimages by      {}\nresidual      rms {} {unit}, peak {} {unit}\nmodel flux    {}\ndynamic range {:.0}\nchi2/datum    {}",
        result.stop,
        result.best + 1,
        sentence(calibrated),
        calibrated.algorithm,
        number(s.residual_rms),
        number(s.residual_peak),
        number(s.model_flux),
        s.dynamic_range,
        chi2(s.chi2_per_datum)
    );
    out
}
