#!/usr/bin/env bash
# A real SLURM on this one machine: munge, a controller and a daemon, which `stop` ends again.
#
# usage (as root): tests/machines/slurm_service.sh start | stop
#
# Debian: apt-get install slurmctld slurmd slurm-client munge. The configuration goes to /etc/slurm,
# where srun looks for it also inside a job; a configuration that this script has not written is left alone, and so it fails there.
set -euo pipefail

configuration=/etc/slurm/slurm.conf
mark="# written by slurm_service.sh of pdrom's tests"
state=/var/tmp/pdrom-slurm

fail() {
    echo "slurm_service: $*" >&2
    exit 1
}

wait_until() { # SECONDS WHAT COMMAND...
    local left=$1 what=$2
    shift 2
    until "$@" >/dev/null 2>&1; do
        left=$((left - 1))
        [ "$left" -gt 0 ] || fail "$what"
        sleep 1
    done
}

own() { grep -qF "$mark" "$1"; }
gone() { [ ! -e "$1" ] || ! kill -0 "$(cat "$1")" 2>/dev/null; }
idle() { sinfo --noheader --format=%T | grep -qE '^(idle|mixed|allocated)$'; }

write_configuration() {
    local node
    [ ! -e "$configuration" ] || own "$configuration" || fail "$configuration belongs to somebody else"
    node=$(slurmd -C | head -n 1)
    mkdir -p "$(dirname "$configuration")" "$state/spool"
    cat >"$configuration" <<EOF
$mark
ClusterName=one
SlurmctldHost=$(hostname -s)
SlurmUser=root
StateSaveLocation=$state/control
SlurmdSpoolDir=$state/spool
SlurmctldPidFile=$state/slurmctld.pid
SlurmdPidFile=$state/slurmd.pid
SlurmctldLogFile=$state/slurmctld.log
SlurmdLogFile=$state/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
JobAcctGatherType=jobacct_gather/linux
AccountingStorageType=accounting_storage/none
MailProg=/bin/true
ReturnToService=2
MinJobAge=600
$node State=UNKNOWN
PartitionName=main Nodes=ALL Default=YES MaxTime=4:00:00 State=UP
EOF
}

start_munge() {
    [ -s /etc/munge/munge.key ] || fail "no key of munge in /etc/munge (Debian's package makes one)"
    ! munge -n >/dev/null 2>&1 || return 0
    install -d -o munge -g munge /run/munge /var/log/munge
    setpriv --reuid=munge --regid=munge --clear-groups munged
    touch "$state/own-munge"
}

case "${1-}" in
start)
    for program in munged slurmctld slurmd sbatch setpriv; do
        command -v "$program" >/dev/null || fail "$program is missing (Debian: slurmctld slurmd slurm-client munge)"
    done
    mkdir -p "$state"
    write_configuration
    start_munge
    wait_until 20 "munge does not answer" munge -n
    slurmctld
    wait_until 60 "the controller does not answer, see $state/slurmctld.log" scontrol ping
    slurmd
    wait_until 60 "the node does not become idle, see $state" idle
    sinfo
    ;;
stop)
    [ -e "$configuration" ] && own "$configuration" || fail "no SLURM of this script"
    scontrol shutdown || true
    wait_until 60 "the controller does not end" gone "$state/slurmctld.pid"
    wait_until 60 "the daemon does not end" gone "$state/slurmd.pid"
    if [ -e "$state/own-munge" ]; then
        setpriv --reuid=munge --regid=munge --clear-groups munged --stop
    fi
    rm -rf "$state" "$configuration"
    ;;
*) fail "start or stop is asked for" ;;
esac
