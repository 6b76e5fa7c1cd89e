#!/usr/bin/env bash
# The tiny study on a real SLURM, against the same study without it.
#
# usage (as root): tests/machines/slurm.sh RESULTS [FOLDER]
#
# RESULTS is the folder of the tiny study made without SLURM (.../results/studies/tiny). HEAD is cloned into FOLDER (else a temporary one) and
# run there by the profile of the project. While the first command runs, one of its jobs is cancelled: the run, which may not
# submit it again, has to say so. The same command goes on from there; another job is cancelled, which has to be submitted again.
# Tables (without what a clock says) and runs must then be those of RESULTS, bit by bit.
set -euo pipefail

project=$(cd "$(dirname "$0")/../.." && pwd -P)
service=$project/tests/machines/slurm_service.sh
expected=$(realpath "${1:?the folder of the results made without SLURM is missing}")
[ -d "$expected/tables" ] || {
    echo "slurm: no tables in $expected; the tiny study's are in results/studies/tiny" >&2
    exit 1
}
folder=${2-}

step() { printf '\n== %s (%s s)\n' "$*" "$SECONDS"; }
fail() {
    echo "slurm: $*" >&2
    exit 1
}

[ -n "$folder" ] || folder=$(mktemp -d)/checkout
"$service" start
trap '"$service" stop' EXIT

step "a clone of HEAD in $folder"
[ -d "$folder" ] || git -c safe.directory='*' clone --quiet --no-hardlinks "$project" "$folder"
cd "$folder"
command=(./reproduce --profile workflow/profiles/slurm --configfile config/tiny.yaml --jobs 4)
running() { [ -n "$(squeue --noheader --states=RUNNING --format=%i)" ]; }
wait_for_job() { # PROCESS LOG
    until running; do
        kill -0 "$1" || fail "the run ended before a job ran: $(tail -n 20 "$2")"
        sleep 1
    done
}
cancel() {
    local victim
    victim=$(squeue --noheader --states=RUNNING --format=%i | tail -n 1)
    scancel "$victim"
    echo "cancelled job $victim"
}
./reproduce run pip install --quiet --no-deps --require-hashes -r requirements-cluster.lock

step "a run, one job of which is cancelled"
"${command[@]}" --retries 0 >"$folder/.cache/first.log" 2>&1 &
run=$!
wait_for_job "$run" "$folder/.cache/first.log"
cancel
if wait "$run"; then fail "the run did not notice"; fi
tail -n 6 "$folder/.cache/first.log"
grep -qi "cancelled" "$folder/.cache/first.log" || fail "the run does not say that a job was cancelled"

step "the same command, and a job that is cancelled"
"${command[@]}" >"$folder/.cache/second.log" 2>&1 &
run=$!
wait_for_job "$run" "$folder/.cache/second.log"
cancel
wait "$run" || fail "the run failed: $(tail -n 20 "$folder/.cache/second.log")"
tail -n 8 "$folder/.cache/second.log"

step "against $expected"
./reproduce run python tests/machines/same_results.py "$expected" results/studies/tiny

step "passed"
