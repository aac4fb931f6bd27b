#!/bin/bash
# Slurm on loopback: munged, slurmctld and two slurmd, as root. Debian: apt-get install slurmctld slurmd slurm-client munge
# A shard killed with -9, a daemon of a node killed with -9, a folder without space, the controller restarted, one that was left and followed again: always the
# bytes of one process.
for program in slurmctld slurmd sbatch squeue munged; do
  PATH=$PATH:/usr/sbin command -v $program >/dev/null || { echo "$program is missing: apt-get install slurmctld slurmd slurm-client munge" >&2; exit 2; }
done
[ "$(id -u)" = 0 ] || { echo "slurmd needs root" >&2; exit 2; }
. "$(dirname "$0")/common.sh"
PATH=$PATH:/usr/sbin
mkdir -p slurm/state slurm/munge; chmod 755 "$at"; chmod 700 slurm/munge
dd if=/dev/urandom of=slurm/munge/key bs=1 count=1024 2>/dev/null; chmod 400 slurm/munge/key
chown root slurm/munge slurm/munge/key
munged --foreground --force --key-file="$at/slurm/munge/key" --socket="$at/slurm/munge.sock" --pid-file="$at/slurm/munge/pid" \
  --log-file="$at/slurm/munge/log" --seed-file="$at/slurm/munge/seed" 2>slurm/munged.err &
services="$services $!"
until_holds test -S slurm/munge.sock
host=$(hostname -s)
cat >slurm/slurm.conf <<CONF
ClusterName=loopback
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=16817
SlurmUser=root
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket=$at/slurm/munge.sock
StateSaveLocation=$at/slurm/state
SlurmdSpoolDir=$at/slurm/spool.%n
SlurmctldPidFile=$at/slurm/slurmctld.pid
SlurmdPidFile=$at/slurm/slurmd.%n.pid
SlurmctldLogFile=$at/slurm/slurmctld.log
SlurmdLogFile=$at/slurm/slurmd.%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=1,batch_sched_delay=0
MpiDefault=none
SlurmdTimeout=10
ReturnToService=2
JobRequeue=0
NodeName=n1 NodeAddr=127.0.0.1 NodeHostname=$host Port=16818 CPUs=1 State=UNKNOWN
NodeName=n2 NodeAddr=127.0.0.1 NodeHostname=$host Port=16819 CPUs=1 State=UNKNOWN
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$at/slurm/slurm.conf
before_the_end() { scancel --me 2>/dev/null && sleep 1; }
controller() { slurmctld -D "$@" 2>slurm/slurmctld.err & ctld=$!; services="$services $ctld"; }
node() { mkdir -p "slurm/spool.$1"; slurmd -D -N "$1" 2>"slurm/slurmd.$1.err" & eval "node_$1=$!"; services="$services $!"; }
controller -c
node n1; node n2
until_holds sh -c '[ "$(sinfo -h -N -o %t | grep -c idle)" = 2 ]'
echo "slurm $(sbatch --version) with two nodes of one core on loopback"

begun=$(seconds)
sweep --on slurm --shards $SHARDS --out plain --quiet >/dev/null; [ $? -le 1 ] || fail plain
echo "$SHARDS shards on two nodes: $(took "$begun" "$(seconds)")"; same plain

# A shard and a node are killed; the controller is restarted in the meantime.
start --on slurm --shards $SHARDS --out killed --retries 5 >/dev/null 2>killed.err & kardan=$!
shard() { pgrep -n -f "sweep $at/m.toml .*--out $at/killed/parts"; }
for many in 3 5 7; do
  until_holds at_least killed $many; until_holds shard; kill -9 "$(shard)" && echo "a shard is killed with -9"
done
kill -9 "$node_n1" && echo "slurmd of n1 is killed with -9"
kill "$ctld" && wait "$ctld"; echo "slurmctld has ended"
controller; node n1; echo "both are started again"
wait $kardan; [ $? -le 1 ] || { cat killed.err; fail killed; }
grep -a "failed\|answer" killed.err; same killed

# One folder has no space for rows, until somebody makes some.
mkdir -p full/parts/3 && mount -t tmpfs -o size=4k tmpfs full/parts/3
sweep --on slurm --shards $SHARDS --out full --retries 0 --resume >/dev/null 2>full.err && fail "a full disk went unseen"
grep -a "space left" full.err || { cat full.err; fail "a full disk is not told"; }
umount full/parts/3
sweep --on slurm --shards $SHARDS --out full --resume >/dev/null 2>&1; [ $? -le 1 ] || fail full
same full

# Ctrl-C leaves the job, `--resume` follows it.
start --on slurm --shards $SHARDS --out left >/dev/null 2>left.err & kardan=$!
until_holds at_least left 2
kill -INT $kardan; wait $kardan; grep -a "stays in the queue" left.err || { cat left.err; fail "the job is not told"; }
sweep --on slurm --out left --resume >/dev/null 2>left.err; [ $? -le 1 ] || fail left
grep -a "follows job" left.err; same left
[ "$(grep -c ^job left/jobs.txt)" = 1 ] || fail "the job was submitted twice"

# The overhead of a task: arrays that do nothing.
begun=$(seconds)
sbatch --parsable --wait --array=1-100 --output=/dev/null --wrap true >/dev/null
echo "overhead: 100 tasks that do nothing on two nodes: $(took "$begun" "$(seconds)")"
echo "$passed passed, 0 failed"
