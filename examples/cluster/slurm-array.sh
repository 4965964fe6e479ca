#!/bin/bash
# One task per shard of a study, then the merge (docs/studies.md):
#   job=$(sbatch --parsable --array=1-8 slurm-array.sh my_study.yaml)
#   sbatch --dependency=afterok:$job --wrap 'mbverify study merge shards/*.shard-*-of-8 -o out'
#SBATCH --job-name=mbverify-study
#SBATCH --array=1-8
#SBATCH --cpus-per-task=2
#SBATCH --mem=1G
#SBATCH --time=04:00:00
#SBATCH --requeue
set -u
# --resume: a task that was requeued goes on where it was stopped.
srun mbverify study "$1" --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT" \
  --jobs "$SLURM_CPUS_PER_TASK" --out shards --resume
