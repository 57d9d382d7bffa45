#!/bin/bash
# Measure all peers on the common workloads. This takes about 25 minutes on 2 idle cores.
# EHTDATA must name the folder of data files that ehtim_bench.py lists.
# usage: . $PEERS/env.sh; measure/run_all.sh
cd "$(dirname "$0")"
P=${CITTERT_PY:?is not set: run ". $PEERS/env.sh" first}
uptime
$P wsclean_bench.py -n 3 a c --only '^(?!.*(5000-natural|clean10000-natural))'
$P wsclean_bench.py -n 1 c --only '5000-natural|clean10000-natural'
$P ducc_bench.py -n 3 a c b
$P casa_bench.py -n 3 a --only 'dirty|1000-'
$P casa_bench.py -n 3 a --only 'dirty-natural|clark1000-' --threads 2
$P wsclean_bench.py -n 3 b --only 'psf|dirty-natural|clean1000-|clean10000-briggs0$|predict'
$P ehtim_bench.py -n 3 --only 'gs'
$P ehtim_bench.py -n 3 --only 'simple'
$P ehtim_bench.py -n 1 --only 'obs'
$P casa_bench.py -n 1 b --only 'dirty-natural|hogbom1000-|clark1000-'
$P casa_bench.py -n 1 d
$P casa_bench.py -n 1 a --only '10000|multiscale|mem'
$P casa_bench.py -n 1 c
$P wsclean_bench.py -n 1 b --only 'uniform|briggs0-precise|hogbom|multiscale|wgridder$'
$P predict_truth.py; $P predict_truth.py inner
uptime
