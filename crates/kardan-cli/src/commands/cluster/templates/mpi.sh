#!/bin/sh
# Each rank runs every n-th shard of the list. Without a rank in the environment this starts the ranks.
rank=${OMPI_COMM_WORLD_RANK:-$PMI_RANK}
ranks=${OMPI_COMM_WORLD_SIZE:-$PMI_SIZE}
[ -n "$rank" ] || exec mpirun sh "$0"
turn=0
for shard in {{list}}; do
  if [ "$turn" -eq "$rank" ]; then {{shard}} "$shard"; fi
  turn=$(((turn + 1) % ranks))
done
exit 0
