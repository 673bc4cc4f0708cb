#!/bin/bash
# A SLURM of one node on this machine, to try the recipe of sweep.py where there is no cluster.
#
#   apt-get install slurm-wlm munge           # as root, on Debian or Ubuntu; so are the lines below
#   bash workflows/slurm/one_node.sh start    # starts munged, slurmctld and slurmd by hand: no systemd is needed
#   export SLURM_CONF=/tmp/one_node_slurm/slurm.conf
#   sinfo                                     # one node, idle
#   bash workflows/slurm/one_node.sh stop
#
# Everything that it writes is in /tmp/one_node_slurm and /run/munge. It asks for no passwords, limits no memory and
# is for trials alone.
set -eu
at=${ONE_NODE_SLURM:-/tmp/one_node_slurm}
export SLURM_CONF=$at/slurm.conf

start() {
    mkdir -p "$at/state" "$at/spool" /run/munge
    chown munge: /run/munge
    chmod 755 /run/munge
    [ -s /etc/munge/munge.key ] || runuser -u munge -- /usr/sbin/mungekey
    munge -n >/dev/null 2>&1 || runuser -u munge -- /usr/sbin/munged
    # whole cores go to jobs, and a job that is told to leave gets KillWait seconds before it is killed
    cat >"$SLURM_CONF" <<-END
		ClusterName=one_node
		SlurmctldHost=$(hostname -s)
		SlurmUser=root
		AuthType=auth/munge
		ProctrackType=proctrack/linuxproc
		TaskPlugin=task/none
		SelectType=select/cons_tres
		SelectTypeParameters=CR_Core
		JobAcctGatherType=jobacct_gather/none
		AccountingStorageType=accounting_storage/none
		MpiDefault=none
		ReturnToService=2
		KillWait=30
		StateSaveLocation=$at/state
		SlurmdSpoolDir=$at/spool
		SlurmctldPidFile=$at/slurmctld.pid
		SlurmdPidFile=$at/slurmd.pid
		SlurmctldLogFile=$at/slurmctld.log
		SlurmdLogFile=$at/slurmd.log
		$(slurmd -C | head -n 1) State=UNKNOWN
		PartitionName=normal Nodes=ALL Default=YES MaxTime=INFINITE State=UP
	END
    slurmctld
    slurmd
    for _ in $(seq 30); do
        [ "$(sinfo -h -o %T 2>/dev/null)" = idle ] && break
        sleep 1
    done
    echo "export SLURM_CONF=$SLURM_CONF"
}

stop() {
    scancel --user "$(id -un)" || true
    for daemon in slurmd slurmctld; do
        [ -s "$at/$daemon.pid" ] && kill "$(cat "$at/$daemon.pid")" || true
    done
}

case ${1:-} in
    start | stop) "$1" ;;
    *) echo "usage: $0 start|stop" >&2 && exit 2 ;;
esac
