#!/bin/bash
# One task per shard of a study. slurm.sh submits it with the merge behind it; alone:
#   sbatch --array=1-8 slurm-array.sh my_study.yaml [SHARDS [OUT]]
# MBVERIFY="…" in the environment of sbatch is what runs the program, where it is not in PATH: the one
# of a bundle (scripts/bundle) in a folder that all nodes see, or "apptainer run mbverify.sif".
# Shards are written to OUT/shards. Options of sbatch win over those that follow.
#SBATCH --job-name=mbverify-study
#SBATCH --array=1-8
#SBATCH --cpus-per-task=2
#SBATCH --mem=1G
#SBATCH --time=04:00:00
#SBATCH --requeue
#SBATCH --open-mode=append
set -u
read -ra mbverify <<<"${MBVERIFY:-mbverify}"
study=$1 shards=${2:-$SLURM_ARRAY_TASK_COUNT} out=${3:-.} code=0
# --resume: a task that was requeued goes on where it was stopped. Since Slurm 22.05 srun does not
# ask for the task's processors by itself.
srun --cpus-per-task="$SLURM_CPUS_PER_TASK" "${mbverify[@]}" study "$study" \
  --shard "$SLURM_ARRAY_TASK_ID/$shards" --jobs "$SLURM_CPUS_PER_TASK" --out "$out/shards" --resume || code=$?
# Killed, by want of memory say: once more, twice. Slurm does not by itself, and a merge that waits
# for a task that failed never runs. The job is named by its place: the number of the last task is
# that of the whole array.
if [ $code = 137 ] && [ "${SLURM_RESTART_COUNT:-0}" -lt 2 ]; then
  scontrol requeue "${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID" && sleep 60  # it ends in here
fi
exit $code
