#!/usr/bin/env python
"""Run two commands in turn n times, and print the ratio of their median times and the ratio in each pair.

  pair.py -n 5 --ours "cittert image ..." --peer "wsclean -j 2 ..."  [--prep-ours cmd] [--prep-peer cmd] [--tag x]
The order alternates (ABBA), which removes slow changes of a shared machine's speed. The result is JSON. The exit code is 1 when a command fails."""
import argparse
import json
import statistics as st
import subprocess
import sys

from bench import once, save

ap = argparse.ArgumentParser()
ap.add_argument("--ours", required=True)
ap.add_argument("--peer", required=True)
ap.add_argument("--prep-ours", default="")
ap.add_argument("--prep-peer", default="")
ap.add_argument("-n", type=int, default=5)
ap.add_argument("--tag", default="pair")
a = ap.parse_args()
res = {"ours": [], "peer": []}
for i in range(a.n):
    for who in (("ours", "peer") if i % 2 == 0 else ("peer", "ours")):
        prep = getattr(a, "prep_" + who)
        if prep:
            subprocess.run(prep, shell=True, check=True)
        r = once(getattr(a, who), shell=True)
        if r["rc"]:
            print(who, "failed:", r["out"][-800:])
            sys.exit(1)
        r.pop("out")
        res[who].append(r)
f = lambda who, k: [x[k] for x in res[who]]
cpu = lambda who: [x["user"] + x["sys"] for x in res[who]]
ratios = [x / y for x, y in zip(f("ours", "wall"), f("peer", "wall"))]
row = dict(tag=a.tag, rc=0, ours=a.ours, peer=a.peer, n=a.n, wall_s=st.median(f("ours", "wall")), ours_wall=st.median(f("ours", "wall")), peer_wall=st.median(f("peer", "wall")),
           ratio_of_medians=st.median(f("ours", "wall")) / st.median(f("peer", "wall")), pair_ratios=[round(x, 3) for x in ratios], median_pair_ratio=st.median(ratios),
           ours_cpu=st.median(cpu("ours")), peer_cpu=st.median(cpu("peer")), ours_rss_mib=max(f("ours", "rss_mib")), peer_rss_mib=max(f("peer", "rss_mib")),
           load=[round(x["load"], 2) for x in res["ours"]])
print(json.dumps(row, indent=1))
save("pairs", [row])
