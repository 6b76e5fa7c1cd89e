#!/usr/bin/env bash
# A real SLURM on this one machine: munge, a controller and a daemon, which `stop` ends again.
#
# usage (as root): tests/machines/slurm_service.sh start | start-unaccounted | stop | stop-controller | start-controller
#
# With accounting (slurmdbd and a database of its own), unless it is started unaccounted.
# Debian: apt-get install slurmctld slurmd slurm-client munge slurmdbd mariadb-server. The configuration goes to /etc/slurm,
# where srun looks for it also inside a job; a configuration that this script has not written is left alone, and so it fails there.
set -euo pipefail

configuration=/etc/slurm/slurm.conf
accounting=/etc/slurm/slurmdbd.conf
mark="# written by slurm_service.sh of pdrom's tests"
state=/var/tmp/pdrom-slurm
# of the database
port=33306

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

write_configuration() { # TYPE OF ACCOUNTING
    local node file
    for file in "$configuration" "$accounting"; do
        [ ! -e "$file" ] || own "$file" || fail "$file belongs to somebody else"
    done
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
AccountingStorageType=accounting_storage/$1
MailProg=/bin/true
ReturnToService=2
MinJobAge=600
$node State=UNKNOWN
PartitionName=main Nodes=ALL Default=YES MaxTime=4:00:00 State=UP
EOF
}

start_accounting() {
    local database=$state/database
    (umask 077 && cat >"$accounting") <<EOF
$mark
DbdHost=localhost
SlurmUser=root
AuthType=auth/munge
PidFile=$state/slurmdbd.pid
LogFile=$state/slurmdbd.log
StorageType=accounting_storage/mysql
StorageHost=127.0.0.1
StoragePort=$port
StorageUser=slurm
StoragePass=slurm
StorageLoc=accounting
EOF
    install -d -o mysql -g mysql "$database"
    mariadb-install-db --no-defaults --user=mysql --datadir="$database" >"$state/database.log"
    setpriv --reuid=mysql --regid=mysql --clear-groups mariadbd --no-defaults --datadir="$database" \
        --socket="$database/socket" --pid-file="$database/pid" --bind-address=127.0.0.1 --port="$port" \
        </dev/null >>"$state/database.log" 2>&1 &
    wait_until 60 "the database does not answer, see $state/database.log" mariadb-admin --socket="$database/socket" ping
    mariadb --socket="$database/socket" <<EOF
CREATE DATABASE accounting;
CREATE USER slurm@'127.0.0.1' IDENTIFIED BY 'slurm';
GRANT ALL ON accounting.* TO slurm@'127.0.0.1';
EOF
    slurmdbd
    wait_until 60 "slurmdbd does not answer, see $state/slurmdbd.log" sacctmgr --noheader show cluster
    sacctmgr --immediate --quiet add cluster one >/dev/null
}

stop_accounting() {
    kill "$(cat "$state/slurmdbd.pid")"
    wait_until 60 "slurmdbd does not end" gone "$state/slurmdbd.pid"
    mariadb-admin --socket="$state/database/socket" shutdown
    wait_until 60 "the database does not end" gone "$state/database/pid"
}

start_munge() {
    [ -s /etc/munge/munge.key ] || fail "no key of munge in /etc/munge (Debian's package makes one)"
    ! munge -n >/dev/null 2>&1 || return 0
    install -d -o munge -g munge /run/munge /var/log/munge
    setpriv --reuid=munge --regid=munge --clear-groups munged
    touch "$state/own-munge"
}

case "${1-}" in
start | start-unaccounted)
    packages="slurmctld slurmd slurm-client munge slurmdbd mariadb-server"
    for program in munged slurmctld slurmd slurmdbd mariadbd sbatch setpriv; do
        command -v "$program" >/dev/null || fail "$program is missing (Debian: $packages)"
    done
    mkdir -p "$state"
    case "$1" in
    start) write_configuration slurmdbd ;;
    *) write_configuration none ;;
    esac
    start_munge
    wait_until 20 "munge does not answer" munge -n
    [ "$1" = start-unaccounted ] || start_accounting
    "$0" start-controller
    slurmd
    wait_until 60 "the node does not become idle, see $state" idle
    sinfo
    ;;
start-controller)
    slurmctld
    wait_until 60 "the controller does not answer, see $state/slurmctld.log" scontrol ping
    ;;
stop-controller)
    scontrol shutdown slurmctld
    wait_until 60 "the controller does not end" gone "$state/slurmctld.pid"
    ;;
stop)
    [ -e "$configuration" ] && own "$configuration" || fail "no SLURM of this script"
    scontrol shutdown || true
    wait_until 60 "the controller does not end" gone "$state/slurmctld.pid"
    wait_until 60 "the daemon does not end" gone "$state/slurmd.pid"
    [ ! -e "$accounting" ] || stop_accounting
    if [ -e "$state/own-munge" ]; then
        setpriv --reuid=munge --regid=munge --clear-groups munged --stop
    fi
    rm -rf "$state" "$configuration" "$accounting"
    ;;
*) fail "start, start-unaccounted, stop, start-controller or stop-controller is asked for" ;;
esac
