#!/bin/bash
# The ranks of a real mpirun on this machine; a rank killed with -9 in the middle, and one whose shard fails. Debian: apt-get install openmpi-bin
command -v mpirun >/dev/null || { echo "mpirun is missing: apt-get install openmpi-bin" >&2; exit 2; }
. "$(dirname "$0")/common.sh"
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
mpirun --version | head -1
begun=$(seconds)
sweep --on mpi --shards $SHARDS --out plain --quiet >/dev/null; [ $? -le 1 ] || fail plain
echo "$SHARDS shards on the ranks of this machine: $(took "$begun" "$(seconds)")"; same plain

start --on mpi --shards $SHARDS --out killed >/dev/null 2>killed.err & kardan=$!
until_holds at_least killed 3
rank() { pgrep -f "^sh $at/killed/job.sh" | tail -1; }
until_holds rank; kill -9 "$(rank)" && echo "a rank is killed with -9"
wait $kardan; [ $? -le 1 ] || { cat killed.err; fail killed; }
grep -a failed killed.err; same killed

start --on mpi --shards $SHARDS --out left >/dev/null 2>left.err & kardan=$!
until_holds at_least left 3
kill -INT $kardan; wait $kardan; [ $? = 2 ] || fail "Ctrl-C"
sweep --on mpi --out left --resume >/dev/null 2>&1; [ $? -le 1 ] || fail left
same left
echo "$passed passed, 0 failed"
