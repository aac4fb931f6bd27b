#!/bin/bash
# What shards cost: HyperQueue with two workers of one core against two threads of one process, at 1000 samples a shard; the overhead of a task; the merge.
# Best of three, in turns, since other work on the machine slows both. MEASURED: the command that runs shards and merges, a release build (default: KARDAN).
command -v hq >/dev/null || { echo "hq is missing" >&2; exit 2; }
SAMPLES=640
. "$(dirname "$0")/common.sh"
MEASURED=$(realpath "${MEASURED:-$KARDAN}")
command -v /usr/bin/time >/dev/null || { echo "GNU time is missing: apt-get install time" >&2; exit 2; }
export HQ_SERVER_DIR=$at/hq
hq server start --host 127.0.0.1 >server.log 2>&1 & services="$services $!"
until_holds hq job list
for name in a b; do KARDAN=$MEASURED hq worker start --cpus 1 --hostname $name >"worker.$name.log" 2>&1 & services="$services $!"; done
measured() { /usr/bin/time -f "%e s, %U s of cores, %M KiB" "$@" 2>&1 >/dev/null | tail -1; }

begun=$(seconds); hq submit --wait --array=1-1000 --stdout=none --stderr=none true >/dev/null
echo "overhead of a task of HyperQueue: $(took "$begun" "$(seconds)") for 1000 that do nothing, on two workers"
echo "a process that runs 64 samples: $(measured "$MEASURED" sweep m.toml --samples 64 --shard 1/1 --out one --quiet)"
N=${N:-8000}
for turn in 1 2 3; do
  rm -rf threads on
  echo "two threads, $N samples: $(RAYON_NUM_THREADS=2 measured "$MEASURED" sweep m.toml --samples "$N" --seed 3 --out threads --quiet)"
  "$KARDAN" sweep m.toml --samples "$N" --seed 3 --on hyperqueue --shards $((N / 1000)) --out on --dry-run --quiet >/dev/null
  begun=$(seconds); hq submit --wait on/job.sh >/dev/null
  echo "two workers, $((N / 1000)) shards: $(took "$begun" "$(seconds)")"
done
echo "merge of $N rows: $(measured "$MEASURED" sweep merge m.toml on/parts/* --out all)"
cmp all/sweep.json threads/sweep.json || fail "differs"
LARGE=${LARGE:-40000}
"$KARDAN" sweep m.toml --samples "$LARGE" --seed 3 --on hyperqueue --shards $((LARGE / 1000)) --out large --dry-run --quiet >/dev/null
begun=$(seconds); hq submit --wait large/job.sh >/dev/null
echo "two workers, $((LARGE / 1000)) shards: $(took "$begun" "$(seconds)")"
echo "seconds of shards: $(sed 's/.*"seconds":\([0-9.]*\).*/\1/' large/parts/*/shard-*.json | awk '{ s += $1 } END { printf "%.1f in all, %.3f each", s, s / NR }')"
echo "merge of $LARGE rows: $(measured "$MEASURED" sweep merge m.toml large/parts/* --out all)"
echo "bytes of rows: $(cat large/parts/*/rows-*.parquet | wc -c)"
