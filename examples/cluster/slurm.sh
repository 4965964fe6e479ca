#!/bin/bash
# A study in shards by Slurm (slurm-array.sh), then the merge (slurm-merge.sh), which waits for them.
#   slurm.sh STUDY SHARDS OUT [options of sbatch for the shards, e.g. --cpus-per-task=4 --time=1-0]
# SBATCH_PARTITION, SBATCH_ACCOUNT … count for both. Prints the numbers of both jobs. Called again
# after a failure it computes what is not finished.
set -eu
here=$(dirname "$0") study=$1 shards=$2 out=$3
shift 3
array=$(sbatch --parsable --array="1-$shards" "$@" "$here/slurm-array.sh" "$study" "$shards" "$out")
merge=$(sbatch --parsable --dependency="afterok:${array%%;*}" "$here/slurm-merge.sh" "$shards" "$out")
echo "${array%%;*} ${merge%%;*}"
