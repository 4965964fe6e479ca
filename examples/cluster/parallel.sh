#!/bin/bash
# A study in shards by GNU parallel, on this machine or on those of a --sshloginfile, then the merge.
#   parallel.sh STUDY SHARDS OUT [options of parallel, e.g. --sshloginfile nodes --workdir .]
# A shard that was killed is tried again, twice, and goes on where it was stopped.
# MBVERIFY="…" is what runs the program, where it is not in PATH: the one of a bundle
# (scripts/bundle), or "apptainer run mbverify.sif".
# Exit code: that of the merge; or of parallel, where a shard could not be computed.
set -eu
read -ra mbverify <<<"${MBVERIFY:-mbverify}"
study=$1 shards=$2 out=$3
shift 3
seq "$shards" | parallel --line-buffer --retries 3 "$@" --quote \
  "${mbverify[@]}" study "$study" --shard "{}/$shards" --jobs 1 --out "$out/shards" --resume
"${mbverify[@]}" study merge "$out"/shards/*.shard-*-of-"$shards" -o "$out"
