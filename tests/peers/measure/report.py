#!/usr/bin/env python
"""Print the results in $CITTERT_RES as tables in Markdown. usage: report.py > tables.md"""
import json
import os

from bench import RES


def get(n):
    p = os.path.join(RES, n + ".json")
    return json.load(open(p)) if os.path.exists(p) else []


def row(*c):
    print("| " + " | ".join(str(x) for x in c) + " |")


def head(*c):
    row(*c)
    row(*["---"] * len(c))


print("## WSClean 3.1.0, -j 2\n")
head("job", "wall s (median)", "min", "CPU s", "RSS MiB", "inversion", "prediction", "deconv", "iterations / majors", "n", "load")
for r in get("wsclean"):
    p = (r["parsed"] or [{}])[-1] or {}
    row(r["tag"], f"{r['wall_s']:.2f}", f"{r['wall_min']:.2f}", f"{r['cpu_s']:.2f}", f"{r['rss_mib']:.0f}", f"{p.get('inversion', 0):.2f}", f"{p.get('prediction', 0):.2f}", f"{p.get('deconvolution', 0):.2f}",
        f"{p.get('iterations', 0)} / {p.get('major', 0)}", r["n"], max(r["load"]))
print("\n## CASA 6.7.0.31 tclean / gaincal\n\nwall and RSS of the whole process; `tclean s` is inside the call (the import costs about 2.5 s).\n")
head("job", "tclean s", "wall s", "CPU s", "RSS MiB", "iterations / majors", "peak", "residual rms", "peak / rms", "n", "load")
for r in get("casa"):
    p = (r["parsed"] or [{}])[-1] or {}
    if "steps" in p:
        row(r["tag"], "see below", f"{r['wall_s']:.1f}", f"{r['cpu_s']:.1f}", f"{r['rss_mib']:.0f}", "", "", "", "", r["n"], max(r["load"]))
    else:
        row(r["tag"], f"{p.get('tclean_s', 0):.2f}", f"{r['wall_s']:.2f}", f"{r['cpu_s']:.2f}", f"{r['rss_mib']:.0f}", f"{p.get('iterdone')} / {p.get('nmajordone')}", f"{p.get('peak', 0):.5g}", f"{p.get('resid_rms', 0):.3g}",
            f"{p.get('dr_peak_over_rms', 0):.0f}", r["n"], max(r["load"]))
for r in get("casa"):
    p = (r["parsed"] or [{}])[-1] or {}
    if "steps" in p:
        print(f"\n### {r['tag']}: phase-only self-cal on (d), solint 60 s\n")
        head("round", "CLEAN iterations", "peak Jy", "residual rms", "peak / rms", "tclean s", "gaincal s", "applycal s")
        for s in p["steps"]:
            row(s["round"], s["iterdone"], f"{s['peak']:.4f}", f"{s['resid_rms']:.2e}", f"{s['dr_peak_over_rms']:.0f}", f"{s['tclean_s']:.1f}", f"{s.get('gaincal_s', 0):.2f}", f"{s.get('applycal_s', 0):.2f}")
print("\n## ducc0 0.42 wgridder\n")
head("job", "wall s", "CPU s", "Mvis", "Mvis/s", "all")
for r in get("ducc"):
    if "mvis" in r:
        row(r["tag"], f"{r['wall_s']:.3f}", f"{r['cpu_s']:.2f}", f"{r['mvis']:.2f}", f"{r['mvis_per_s']:.2f}", r["wall_all"])
    else:
        row(r["tag"], "", "", "", "", f"max error against the direct sum {r['max_abs_err_24px']:.1e} (peak {r['peak']:.4g})")
print("\n## ehtim 1.3.2\n")
head("job", "imaging s", "process wall s", "CPU s", "RSS MiB", "n", "chi2 / other")
for r in get("ehtim"):
    p = (r["parsed"] or [{}])[-1] or {}
    row(r["tag"], f"{p.get('imaging_s', 0):.2f}", f"{r['wall_s']:.1f}", f"{r['cpu_s']:.1f}", f"{r['rss_mib']:.0f}", r["n"],
        json.dumps({k: (v if not isinstance(v, float) else round(v, 3)) for k, v in p.items() if k in ("chi2", "flux", "direct", "fast", "nvis", "nfft")}))
print("\n## Prediction against the direct Fourier sum (30 points on pixel centres, 2000 rows)\n")
head("predictor", "max error / total flux", "rms error / rms")
for r in get("predict_truth"):
    row(r["tag"], f"{r['max_abs_err_over_total_flux']:.1e}", f"{r['rms_err_over_rms']:.1e}")
print("\n## Dirty images and beams against ducc0 at 1e-12 (natural; over the peak; column 0 left out)\n")
head("image", "max", "rms", "max, inner half", "rms, inner half")
for r in get("quality_dirty"):
    row(r["tag"], f"{r['max_over_peak']:.1e}", f"{r['rms_over_peak']:.1e}", f"{r['inner_half_max']:.1e}", f"{r['inner_half_rms']:.1e}")
print("\n## CLEAN / MEM images against truth\n")
head("image (a, d)", "peak", "off-source rms", "DR", "Gaussian flux / true", "points flux / true (1, .5, .25, .1, .05, .03, .02 Jy)")
for r in get("quality_clean"):
    if "points" in r:
        row(r["tag"], f"{r['peak']:.4f}", f"{r['off_rms']:.2e}", f"{r['dr']:.0f}", f"{r['gauss_flux_ratio']:.3f}", " ".join(f"{q['flux_ratio']:.3f}" for q in r["points"][:7]))
print()
head("image (c)", "NRMSE", "rms error K", "mean K (true)", "correlation", "flux / true")
for r in get("quality_clean"):
    if "nrmse" in r:
        row(r["tag"], f"{r['nrmse']:.3f}", f"{r['rms_err_K']:.1f}", f"{r['mean_K']:.1f} ({r['true_mean_K']:.1f})", f"{r['corr']:.4f}", f"{r['flux_ratio']:.3f}")
print("\n## What each reader needs in an MS (one thing removed at a time from workload c's MS)\n")
head("removed", "WSClean", "CASA tclean", "pyuvdata")
for r in get("ms_needs"):
    if "wsclean" in r:
        row(r["removed"], *[r[k].replace("|", "/")[:110] for k in ("wsclean", "casa", "pyuvdata")])
