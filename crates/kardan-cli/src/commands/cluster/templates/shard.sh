#!/bin/sh
# `sh shard.sh 3` runs the third of {{shards}} shards, or what is missing of it.
part={{out}}/parts/$1
kardan=${KARDAN:-{{kardan}}}
export RAYON_NUM_THREADS={{threads}}
"$kardan" {{arguments}} --shard "$1/{{shards}}" --out "$part" --resume --quiet >/dev/null 2>{{logs}}/"$1".log
# A requirement that fails (exit code 1) is an answer: the shard is done when its manifest is there.
test -e "$part/shard-$1-of-{{shards}}.json"
