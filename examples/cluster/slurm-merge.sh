#!/bin/bash
# The merge of all shards of a study. slurm.sh submits it behind slurm-array.sh; alone:
#   sbatch slurm-merge.sh SHARDS OUT
# Ends as FAILED with 1 where a limit is violated (the result is there), with 2 where a shard is
# missing or not as it was written.
#SBATCH --job-name=mbverify-merge
#SBATCH --mem=1G
#SBATCH --time=00:30:00
set -u
read -ra mbverify <<<"${MBVERIFY:-mbverify}"
"${mbverify[@]}" study merge "$2"/shards/*.shard-*-of-"$1" -o "$2"
