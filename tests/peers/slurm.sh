#!/bin/bash
# Start or stop a Slurm cluster of one node on this machine, for tests. It must run as root.
#   eval "$(slurm.sh start DIR)"      slurm.sh stop DIR
# The script installs Debian's packages slurm-wlm and munge where they are missing. An array of four jobs ran within 8 s of the start.
set -euo pipefail
do=${1:?start or stop}; D=${2:?a folder}; H=$(hostname -s)
if [ "$do" = stop ]; then
  for p in slurmd slurmctld; do [ -f "$D/$p.pid" ] && kill "$(cat "$D/$p.pid")" 2>/dev/null || true; done; exit 0
fi
for p in slurm-wlm munge; do
  dpkg -s "$p" >/dev/null 2>&1 || DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "$p" >&2
done
mkdir -p "$D/state" "$D/spool" /run/munge
[ -f /etc/munge/munge.key ] || mungekey -c >&2
chown munge:munge /run/munge /etc/munge/munge.key
munge -n 2>/dev/null | unmunge >/dev/null 2>&1 || { runuser -u munge -- /usr/sbin/munged >&2; sleep 1; }
grep -q "[[:space:]]$H\$" /etc/hosts || echo "127.0.0.1 $H" >> /etc/hosts
cat > "$D/slurm.conf" <<CONF
ClusterName=one
SlurmctldHost=$H
SlurmUser=root
AuthType=auth/munge
StateSaveLocation=$D/state
SlurmdSpoolDir=$D/spool
SlurmctldPidFile=$D/slurmctld.pid
SlurmdPidFile=$D/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SchedulerType=sched/backfill
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
ReturnToService=2
NodeName=$H CPUs=$(nproc) RealMemory=$(awk '/MemTotal/ { print int($2 / 1024) }' /proc/meminfo) State=UNKNOWN
PartitionName=all Nodes=$H Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$D/slurm.conf
slurmctld -f "$SLURM_CONF" >&2; sleep 2; slurmd -f "$SLURM_CONF" >&2
for _ in $(seq 20); do sinfo -h -o %T 2>/dev/null | grep -q idle && break; sleep 1; done
echo "export SLURM_CONF=$SLURM_CONF"
