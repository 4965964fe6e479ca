#!/bin/bash
# The examples of GNU parallel and Snakemake for real: two shards at once on this machine, one of
# which is killed while it computes, and the merge; then a shard that was altered.
#   local.sh MBVERIFY SOURCE_DIR parallel|snakemake
set -u
. "$(dirname "$(realpath "$0")")/study.sh"
case $3 in
  parallel)
    need parallel
    compute() { "$cluster/parallel.sh" "$1" $shards "$2" --jobs 2; } ;;
  snakemake)
    # 683 MB with all that it needs: scripts/setup leaves it out, so it may be missing anywhere.
    MBV_NO_SKIP='' need snakemake
    compute() {
      snakemake --quiet all --snakefile "$cluster/Snakefile" --cores 2 \
        --config file="$1" shards=$shards out="$2"
    } ;;
esac
work=$(mktemp -d) && mkdir "$work/a study" && cd "$work/a study" || exit 1
watch_over $$ "$work"
make_study

compute 'my study.yaml' 'all results' >log.txt 2>&1 &
example=$!
hold 'all results' 2
watch_rows 'all results' 2 &
watcher=$!
kill -KILL "$(process_of 2)" || fail "cannot kill"
wait $example || fail "$3 gave up: $(cat log.txt)"
wait $watcher
cat begun_anew.* 2>/dev/null && fail "the shard that was killed began anew"
same_as_at_once 'all results'

# parallel asks every shard again, which computes an altered one anew; Snakemake merges alone.
alter 'all results' 4
compute 'my study.yaml' 'all results' >again.txt 2>&1
code=$?
case $3 in
  parallel) [ $code = 0 ] && same_as_at_once 'all results' ;;
  snakemake) [ $code != 0 ] && grep -q 'shard-4-of-6: error: its points are not all there' again.txt ;;
esac || fail "with an altered shard: $code, $(cat again.txt)"

compute 'no study.yaml' none >none.txt 2>&1 && fail "a study that is not there was computed"
[ ! -e none ] || fail "it left $(find none)"
echo "the example does what it says, in $SECONDS s"
