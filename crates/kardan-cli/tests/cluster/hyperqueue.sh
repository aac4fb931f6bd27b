#!/bin/bash
# HyperQueue on loopback: a server and two workers. `hq` on the PATH: a release of HyperQueue, or `cargo build --release --bin hq` of its sources
# (the package `hyperqueue` of PyPI has the Python API alone, without `hq`).
# A worker killed with -9, a worker without disk, a folder without space, the server restarted with and without its journal: always the bytes of one process.
command -v hq >/dev/null || { echo "hq is missing: https://github.com/It4innovations/hyperqueue/releases" >&2; exit 2; }
. "$(dirname "$0")/common.sh"
export HQ_SERVER_DIR=$at/hq
before_the_end() { hq job cancel all >/dev/null 2>&1; hq server stop >/dev/null 2>&1; }
server() { hq server start --host 127.0.0.1 "$@" >server.log 2>&1 & hqd=$!; services="$services $hqd"; until_holds hq job list; }
worker() { hq worker start --cpus 1 --hostname "$1" --heartbeat 500ms >"worker.$1.log" 2>&1 & eval "worker_$1=$!"; services="$services $!"; }
server --journal "$at/journal"
worker a; worker b
echo "$(hq --version) with two workers of one core on loopback"

begun=$(seconds)
sweep --on hyperqueue --shards $SHARDS --out plain --quiet >/dev/null; [ $? -le 1 ] || fail plain
echo "$SHARDS shards on two workers: $(took "$begun" "$(seconds)")"; same plain

# A worker is killed in the middle of a shard; HyperQueue gives the shard to another one.
start --on hyperqueue --shards $SHARDS --out killed >/dev/null 2>killed.err & kardan=$!
until_holds at_least killed 3
kill -9 "$worker_a" && echo "worker a is killed with -9"
wait $kardan; [ $? -le 1 ] || { cat killed.err; fail killed; }
same killed

# A worker whose files may not grow: its shards fail at their first block, until it is gone.
(ulimit -f 2; exec hq worker start --cpus 1 --hostname small >/dev/null 2>&1) & small=$!; services="$services $small"
start --on hyperqueue --shards $SHARDS --out small --retries 3 >/dev/null 2>small.err & kardan=$!
until_holds grep -a "failed" small.err
kill "$small"; echo "the worker without disk is ended"
wait $kardan; [ $? -le 1 ] || { cat small.err; fail small; }
grep -a "failed" small.err; same small

# One folder has no space for rows, until somebody makes some.
if [ "$(id -u)" = 0 ]; then
  mkdir -p full/parts/3 && mount -t tmpfs -o size=4k tmpfs full/parts/3
  sweep --on hyperqueue --shards $SHARDS --out full --retries 1 --resume >/dev/null 2>full.err && fail "a full disk went unseen"
  grep -a "space left" full.err || { cat full.err; fail "a full disk is not told"; }
  umount full/parts/3
  sweep --on hyperqueue --shards $SHARDS --out full --resume >/dev/null 2>&1; [ $? -le 1 ] || fail full
  same full
fi

# The server is killed and comes back, with its journal; then without, so that it knows of no job.
for journal in "--journal $at/journal" ""; do
  name=server${journal:+-journal}
  worker c
  start --on hyperqueue --shards $SHARDS --out $name >/dev/null 2>$name.err & kardan=$!
  until_holds at_least $name 4
  kill -9 "$hqd"; echo "the server is killed with -9 (${journal:-no journal})"; sleep 1
  # shellcheck disable=SC2086
  server $journal; worker a; worker b
  wait $kardan; [ $? -le 1 ] || { cat $name.err; fail $name; }
  grep -a "answer\|failed" $name.err; same $name
done

# Ctrl-C leaves the job, `--resume` follows it.
start --on hyperqueue --shards $SHARDS --out left >/dev/null 2>left.err & kardan=$!
until_holds at_least left 2
kill -INT $kardan; wait $kardan; grep -a "stays in the queue" left.err || { cat left.err; fail "the job is not told"; }
sweep --on hyperqueue --out left --resume >/dev/null 2>left.err; [ $? -le 1 ] || fail left
grep -a "follows job" left.err; same left
[ "$(grep -c ^job left/jobs.txt)" = 1 ] || fail "the job was submitted twice"

# The overhead of a task: arrays that do nothing.
begun=$(seconds)
hq submit --wait --array=1-1000 --stdout=none --stderr=none true >/dev/null
echo "overhead: 1000 tasks that do nothing on two workers: $(took "$begun" "$(seconds)")"
echo "$passed passed, 0 failed"
