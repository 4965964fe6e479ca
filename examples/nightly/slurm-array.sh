#!/bin/bash
# One task per shard, then the merge:
#   job=$(sbatch --parsable slurm-array.sh)
#   sbatch --dependency=afterany:$job --wrap 'mbverify merge regression/shard* --out regression/all --history history.sqlite --fail-on-missing'
#SBATCH --job-name=mbverify
#SBATCH --array=1-8
#SBATCH --cpus-per-task=2
#SBATCH --mem=1G
#SBATCH --time=00:30:00
#SBATCH --requeue
set -u
# --resume: a task that was requeued goes on where it was stopped.
srun mbverify regress --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT" \
  --jobs "$SLURM_CPUS_PER_TASK" --out "regression/shard$SLURM_ARRAY_TASK_ID" --resume
