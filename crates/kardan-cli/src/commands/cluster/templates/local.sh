#!/bin/sh
# As many shards at a time as there are cores for them.
printf '%s\n' {{list}} | xargs -n 1 -P {{processes}} {{shard}}
