# A Slurm of one node with two processors, for one script; sourced by slurm.sh.

# Calls the script again where it and all that it starts are alone.
enter_cluster() {  # SCRIPT ARGUMENT…
  MBV_SLURM_WORK=$(mktemp -d) || exit 1
  export MBV_SLURM_WORK MBV_SLURM_ALONE=
  mkdir "$MBV_SLURM_WORK/a study" "$MBV_SLURM_WORK/state" "$MBV_SLURM_WORK/spool"
  watch_over $$ "$MBV_SLURM_WORK"
  local alone=(unshare --net --pid --mount-proc --fork --kill-child)
  "${alone[@]}" true 2>/dev/null && MBV_SLURM_ALONE=1 exec "${alone[@]}" "$@"
  exec "$@"
}

# A port without a listener, below those that the kernel gives away.
free_port() {
  local port
  while port=$((RANDOM % 12000 + 20000)); (: </dev/tcp/127.0.0.1/$port) 2>/dev/null; do :; done
  echo $port
}

# No munge: who reaches the daemons is believed. cred_expire is how long a task that was requeued
# waits. The node is what is written here, whatever the machine has.
write_slurm_conf() {
  cat >"$work/slurm.conf" <<CONF
ClusterName=mbverify_test
SlurmctldHost=localhost(127.0.0.1)
SlurmctldPort=$(free_port)
SlurmdPort=$(free_port)
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
SlurmUser=root
AuthType=auth/none
AuthInfo=cred_expire=5
CredType=cred/none
MpiDefault=none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SchedulerType=sched/builtin
SchedulerParameters=sched_interval=1
SlurmdParameters=config_overrides
ReturnToService=2
KillWait=2
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
NodeName=localhost NodeAddr=127.0.0.1 CPUs=2 RealMemory=2048
PartitionName=all Nodes=localhost Default=YES State=UP
CONF
}

stop_cluster() {
  local code=$?
  [ $code = 0 ] || squeue --array
  [ $code = 0 ] || tail -n 20 "$work"/*.log "$work/a study"/slurm-*.out
  kill "${daemons[@]}" 2>/dev/null
  wait "${daemons[@]}" 2>/dev/null
  exit $code
}

start_cluster() {
  # A second address: getaddrinfo finds nothing where there is 127.0.0.1 alone.
  [ -z "$MBV_SLURM_ALONE" ] || { ip link set lo up && ip address add 127.0.0.2/8 dev lo; }
  write_slurm_conf
  export SLURM_CONF=$work/slurm.conf
  slurmctld -D >"$work/slurmctld.log" 2>&1 &
  daemons=($!)
  slurmd -D -N localhost >"$work/slurmd.log" 2>&1 &
  daemons+=($!)
  trap stop_cluster EXIT
  trap 'exit 1' INT TERM HUP
  is_idle() { sinfo --noheader --format=%T 2>/dev/null | grep -qx idle; }
  wait_for 60 "the node is idle" is_idle
}
