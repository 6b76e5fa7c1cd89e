#!/usr/bin/env bash
# The README's two commands on a bare Debian: nothing but python3, python3-venv, git and ca-certificates, an unprivileged
# user, a folder with a blank and a letter beyond ASCII in its path, LANG=C.
#
# usage (as root, with debootstrap): tests/machines/clean_machine.sh [--root FOLDER] [--same-as RESULTS] [STEP...] [-- ARGUMENT...]
#
#   plan     ./reproduce -n
#   tiny     ./reproduce --configfile config/tiny.yaml
#   verify   ./reproduce verify --configfile config/tiny.yaml, of a tiny study that has been run
#   quick    ./reproduce test on the tests that take little
#   study    ./reproduce
#   tests    ./reproduce test, with the arguments that follow two hyphens, as in: tests -- tests/physics
#
# Without a step: tiny, verify and quick. HEAD of this repository is what runs. --root keeps the machine in FOLDER, where a second
# call finds it; --same-as compares the tables and runs of the tiny study, bit by bit, with those in RESULTS.
#
# The machine gets the caller's settings of pip (variables PIP_*, files of configuration, local folders that they name), of
# proxies and of certificates, and nothing else. DEBIAN_MIRROR, if set, is where debootstrap downloads from.
set -euo pipefail

project=$(cd "$(dirname "$0")/../.." && pwd -P)
user=visitor
folder="/home/$user/Étude du projet"
exchange=/srv # in the bare machine: what it is handed
root='' same_as='' steps=() arguments=()

fail() {
    echo "clean_machine: $*" >&2
    exit 1
}

while [ $# -gt 0 ]; do
    case "$1" in
    --root) root=${2:?a folder is missing} && shift 2 ;;
    --same-as) same_as=$(realpath "${2:?a folder is missing}") && shift 2 ;;
    --) shift && arguments=("$@") && break ;;
    plan | tiny | verify | quick | study | tests) steps+=("$1") && shift ;;
    *) fail "unknown argument '$1'; steps are plan, tiny, verify, quick, study and tests" ;;
    esac
done
[ ${#steps[@]} -gt 0 ] || steps=(tiny verify quick)
[ "$(id -u)" -eq 0 ] || fail "root is needed: debootstrap and chroot ask for it"
command -v debootstrap >/dev/null || fail "debootstrap is missing (apt-get install debootstrap)"

# Mounts belong to a namespace of this script alone and go with it, however it ends.
if [ -z "${CLEAN_MACHINE_INSIDE-}" ]; then
    made=''
    [ -n "$root" ] || made=$(mktemp -d)
    status=0
    CLEAN_MACHINE_INSIDE=1 unshare --mount --pid --fork --kill-child "$0" --root "${root:-$made}" \
        ${same_as:+--same-as "$same_as"} "${steps[@]}" -- ${arguments[@]+"${arguments[@]}"} || status=$?
    [ -z "$made" ] || rm -rf --one-file-system "$made"
    exit "$status"
fi

step() { printf '\n== %s (%s s)\n' "$*" "$SECONDS"; }

step "a bare Debian in $root"
mkdir -p "$root"
root=$(realpath "$root")
if [ ! -e "$root/complete" ]; then
    debootstrap --variant=minbase --include=python3,python3-venv,git,ca-certificates bookworm "$root" \
        ${DEBIAN_MIRROR:+"$DEBIAN_MIRROR"} >"$root.log" 2>&1 || fail "debootstrap failed, see $root.log"
    chroot "$root" useradd --create-home "$user"
    touch "$root/complete"
fi
mount --make-rprivate /
mount -t proc proc "$root/proc"
mount -t tmpfs -o mode=1777 tmpfs "$root/tmp"
mkdir -p "$root/dev/shm"
mount -t tmpfs -o mode=1777 tmpfs "$root/dev/shm"
for file in /etc/resolv.conf /etc/hosts; do
    [ ! -e "$file" ] || cp --remove-destination -L "$file" "$root$file"
done

# What the caller's pip is told, files and folders that it is told of included.
settings=()
share() {
    [ -e "$1" ] || return 0
    if [ -d "$1" ]; then
        mkdir -p "$root$1" && mount --bind -o ro "$1" "$root$1"
    else
        mkdir -p "$root$(dirname "$1")" && cp --remove-destination -L "$1" "$root$1"
    fi
}
for name in ${!PIP_@} http_proxy https_proxy no_proxy HTTP_PROXY HTTPS_PROXY NO_PROXY SSL_CERT_FILE REQUESTS_CA_BUNDLE; do
    [ -z "${!name-}" ] || [ "$name" = PIP_CONFIG_FILE ] || settings+=("$name=${!name}")
done
kept=()
keep() {
    [ -f "$1" ] || return 0
    mkdir -p "$(dirname "$root$2")" && cp -L "$1" "$root$2" && kept+=("$1")
}
keep "${PIP_CONFIG_FILE:-/etc/pip.conf}" /etc/pip.conf
for file in .pip/pip.conf .config/pip/pip.conf; do keep "$HOME/$file" "/home/$user/$file"; done
# the pages of a local index (file://) link to files beside its folder
named=$({ [ ${#kept[@]} -eq 0 ] || cat "${kept[@]}"; printf '%s\n' "${settings[@]+"${settings[@]}"}"; } |
    grep -oE '(^|[= ]|file://)/[^ ,:]+' | sed -E 's,^file://(.*)/[^/]+/?$,\1,; s,^[= ],,' | sort -u || true)
for path in $named; do share "$path"; done

as_user() {
    chroot "$root" /usr/bin/setpriv --reuid="$user" --regid="$user" --clear-groups --no-new-privs \
        /usr/bin/env -i HOME="/home/$user" USER="$user" PATH=/usr/local/bin:/usr/bin:/bin LANG=C \
        ${settings[@]+"${settings[@]}"} "$@"
}
run() { as_user /bin/sh -c 'cd "$1" && shift && exec "$@"' sh "$folder" "$@"; }

step "a clone of HEAD in $folder"
commit=$(git -c safe.directory='*' -C "$project" rev-parse HEAD)
git -c safe.directory='*' -C "$project" bundle create --quiet "$root$exchange/project.bundle" HEAD
if [ -d "$root$folder/.git" ]; then
    run git fetch --quiet "$exchange/project.bundle" HEAD
    run git checkout --quiet "$commit"
else
    as_user git clone --quiet "$exchange/project.bundle" "$folder"
fi
echo "commit $commit, $(run python3 --version)"

for name in "${steps[@]}"; do
    step "$name"
    case "$name" in
    plan) run ./reproduce -n --quiet rules </dev/null ;;
    tiny)
        run ./reproduce --configfile config/tiny.yaml </dev/null
        run ./reproduce --configfile config/tiny.yaml </dev/null 2>&1 | grep -q "Nothing to be done" ||
            fail "a second run has something to do"
        [ -z "$(run git status --porcelain)" ] || fail "the run left files that git does not ignore"
        ;;
    verify) run ./reproduce verify --configfile config/tiny.yaml </dev/null ;;
    quick) run ./reproduce test -q tests/unit/pdrom/core tests/unit/study/pipeline tests/physics/test_patch.py </dev/null ;;
    study) run ./reproduce </dev/null ;;
    tests) run ./reproduce test ${arguments[@]+"${arguments[@]}"} </dev/null ;;
    esac
done

if [ -n "$same_as" ]; then
    step "against $same_as"
    mkdir -p "$root$exchange/other"
    mount --bind -o ro "$same_as" "$root$exchange/other"
    run ./reproduce run python tests/machines/same_results.py "$exchange/other" results/studies/tiny
fi
step "passed"
