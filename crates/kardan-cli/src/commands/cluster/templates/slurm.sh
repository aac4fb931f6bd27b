#!/bin/sh
#SBATCH --job-name={{name}}
#SBATCH --array={{array}}
#SBATCH --cpus-per-task={{threads}}
#SBATCH --output={{logs}}/%a.slurm
exec {{shard}} "$SLURM_ARRAY_TASK_ID"
