#!/bin/bash
# The Slurm example for real: an array of six tasks, of which one is requeued and one killed while
# they compute, and the merge that waits for them; then shards that must not be merged.
#   slurm.sh MBVERIFY SOURCE_DIR
# slurmctld and slurmd run here, in a folder and in name spaces of their own: no other process reaches
# them, and they end with this script however it ends. Where a container forbids name spaces they
# listen on free ports of 127.0.0.1, and what is left of them is ended by watch_over.
set -u
here=$(dirname "$(realpath "$0")")
. "$here/study.sh"
. "$here/slurm_cluster.sh"

if [ -z "${MBV_SLURM_WORK:-}" ]; then
  need slurmctld slurmd sbatch srun scontrol squeue ip
  [ "$(id -u)" = 0 ] || MBV_NO_SKIP='' skip "slurmd drops its groups, which root alone may"
  enter_cluster "$0" "$@"
fi
work=$MBV_SLURM_WORK
cd "$work/a study" || exit 1
make_study
start_cluster

state_of() { scontrol --oneliner show job "$1" 2>/dev/null; }  # JOB
has() { state_of "$1" | grep -q "$2"; }                        # JOB PATTERN

# Two tasks at once; one is requeued and one killed when they have some of their rows: the last,
# whose number is also that of the array.
read -r array merge < <("$cluster/slurm.sh" 'my study.yaml' $shards out --cpus-per-task=1 --mem=100M)
[ -n "${merge:-}" ] || fail "nothing was submitted"
both_run() { [ "$(squeue --noheader --states=RUNNING --array | wc -l)" = 2 ]; }
wait_for 60 "two tasks run at once" both_run
hold out 2
scontrol requeue "${array}_2" || fail "cannot requeue"
watch_rows out 2 &
watchers=($!)
hold out 6
kill -KILL "$(process_of 6)" || fail "cannot kill"
watch_rows out 6 &
watchers+=($!)
wait_for 60 "the merge has ended" has "$merge" 'JobState=\(COMPLETED\|FAILED\|CANCELLED\)'
has "$merge" 'JobState=COMPLETED.*ExitCode=0:0' || fail "merge: $(state_of "$merge")"
wait "${watchers[@]}"
cat begun_anew.* 2>/dev/null && fail "a task that was requeued began anew"
for k in $(seq $shards); do
  case $k in 2|6) restarts=1 ;; *) restarts=0 ;; esac
  has "${array}_$k" "JobState=COMPLETED.*Restarts=$restarts" || fail "$(state_of "${array}_$k")"
done
# The log of the first attempt is still there.
grep -q 'DUE TO JOB REQUEUE' "slurm-${array}_2.out" && grep -q 'wrote out/shards' "slurm-${array}_2.out" ||
  fail "the log of task 2 is not whole: $(cat "slurm-${array}_2.out")"
same_as_at_once out

# Merges of shards that are not what was computed fail, which the queue shows; nothing is written.
refused() {  # OUT WORDS
  local job
  job=$(sbatch --parsable "$cluster/slurm-merge.sh" $shards "$1")
  wait_for 60 "the merge of $1 has failed" has "$job" 'JobState=FAILED.*ExitCode=2:0'
  grep -q "$2" "slurm-$job.out" || fail "it does not say '$2': $(cat "slurm-$job.out")"
  [ ! -e "$1/$name" ] || fail "$1 has a result"
}
mkdir altered missing
cp -r out/shards altered
cp -r out/shards missing
alter altered 4
refused altered 'shard-4-of-6: error: its points are not all there, or not as they were written'
rm -r "missing/shards/$name.shard-5-of-$shards"
refused missing 'shard 5/6 is missing'

# A step has all processors of its task. What is cancelled is not requeued.
read -r array merge < <("$cluster/slurm.sh" 'my study.yaml' $shards cancelled --cpus-per-task=2)
wait_for 60 "task 1 has rows" computes cancelled 1
scontrol --oneliner show step "${array}_1.0" | grep -q 'CPUs=2 ' || fail "$(scontrol show step)"
scancel "$array" && wait_for 60 "it is cancelled" has "${array}_1" 'JobState=CANCELLED.*Restarts=0'
scancel "$merge"

# Where a task fails for good, the merge does not run.
read -r array merge < <("$cluster/slurm.sh" 'no study.yaml' 2 none --cpus-per-task=1 --mem=100M)
wait_for 60 "task 1 has failed" has "${array}_1" 'JobState=FAILED.*Restarts=0.*ExitCode=2:0'
wait_for 60 "the merge never runs" has "$merge" 'JobState=PENDING Reason=DependencyNeverSatisfied'
echo "the example does what it says, in $SECONDS s"
