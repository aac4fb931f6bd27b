# What the tests on real clusters share. KARDAN: the command (default: the debug build of this tree). All services listen on loopback, and what was
# started is ended by its process id.
set -u
here=$(cd "$(dirname "$0")" && pwd)
KARDAN=${KARDAN:-${CARGO_TARGET_DIR:-$here/../../../../target}/debug/kardan}
[ -x "$KARDAN" ] || { echo "there is no $KARDAN: cargo build -p kardan-cli, or set KARDAN" >&2; exit 2; }
KARDAN=$(realpath "$KARDAN")
at=$(mktemp -d "${TMPDIR:-/tmp}/kardan-cluster.XXXXXX")
services=""
before_the_end() { :; }
finish() {
  code=$?
  before_the_end
  for pid in $services; do kill "$pid" 2>/dev/null; done
  mountpoint -q "$at/full/parts/3" 2>/dev/null && umount "$at/full/parts/3"
  if [ "$code" = 0 ]; then rm -rf "$at"; else echo "left for a look: $at" >&2; fi
}
trap finish EXIT
cd "$at" || exit 2

cat >m.toml <<'MODEL'
[shaft.a]
inertia = "2 kg m^2 ± 10 %"
[motor.m]
shaft = "a"
[scenario]
duration = "1 s"
[[scenario.event]]
signal = "m.tau"
at = "0 s"
to = "4 N m"
[[requirement]]
signal = "a.w"
measure = "final"
above = "2 rad/s"
MODEL
SAMPLES=${SAMPLES:-1600}
SHARDS=20
sweep() { "$KARDAN" sweep m.toml --samples "$SAMPLES" --seed 3 "$@"; }
# The same in the place of the shell: in the background its process id is that of the command.
start() { exec "$KARDAN" sweep m.toml --samples "$SAMPLES" --seed 3 "$@"; }
fail() { echo "FAILED: $*" >&2; exit 1; }
# Whether answers are those of one process, bit by bit; `folder` of the cluster, `whole` of one process.
same() {
  cmp "$1/sweep.json" whole/sweep.json || fail "$1 differs from one process"
  passed=$((${passed:-0} + 1))
  echo "ok: $1: sweep.json has the bytes of one process ($(sed -n 's/^job //p' "$1/jobs.txt" 2>/dev/null | grep -c .) jobs)"
}
# Waits until a command holds, for 60 s at most.
until_holds() {
  for _ in $(seq 600); do if "$@" >/dev/null 2>&1; then return 0; fi; sleep 0.1; done
  fail "60 s are over: $*"
}
done_shards() { find "$1/parts" -name 'shard-*.json' 2>/dev/null | grep -c .; }
at_least() { [ "$(done_shards "$1")" -ge "$2" ]; }
seconds() { date +%s.%N; }
took() { awk -v a="$1" -v b="$2" 'BEGIN { printf "%.2f s", b - a }'; }

begun=$(seconds)
sweep --out whole --quiet >/dev/null; [ $? -le 1 ] || fail "the sweep by one process"
echo "one process, all cores: $(took "$begun" "$(seconds)") for $SAMPLES samples"
