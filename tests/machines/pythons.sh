#!/usr/bin/env bash
# The tests, the tiny study and its verification in fresh clones of HEAD with empty homes, one for each version of Python.
#
# usage: tests/machines/pythons.sh [--only STEP] [--targets "TARGET ..."] [--folder FOLDER] [PYTHON...] [-- ARGUMENT...]
#
#   PYTHON      programs; without any: python3.11 python3.12 python3.13
#   --only      tiny (with its verification) or tests; may be repeated
#   --targets   these of the tiny study only, which are then not verified
#   --folder    keeps the clones in FOLDER, for the versions 3.11, 3.12 ..., and goes on where a call before this one ended
#   ARGUMENT    of pytest, as in: --only tests -- tests/unit/pdrom/core
#
# The clones get the caller's settings of pip, of proxies and of certificates, and nothing else. Every version is tried, and the
# last lines say which passed.
set -euo pipefail

project=$(cd "$(dirname "$0")/../.." && pwd -P)
folder='' targets='' steps=() pythons=() arguments=()

fail() {
    echo "pythons: $*" >&2
    exit 1
}

while [ $# -gt 0 ]; do
    case "$1" in
    --only)
        case ${2-} in tiny | tests) steps+=("$2") ;; *) fail "--only takes tiny or tests, not '${2-}'" ;; esac
        shift 2
        ;;
    --targets) targets=${2:?targets are missing} && shift 2 ;;
    --folder) folder=$(realpath -m "${2:?a folder is missing}") && shift 2 ;;
    --) shift && arguments=("$@") && break ;;
    -*) fail "unknown option '$1', see the head of $0" ;;
    *) pythons+=("$1") && shift ;;
    esac
done
[ ${#steps[@]} -gt 0 ] || steps=(tests tiny)
[ ${#pythons[@]} -gt 0 ] || pythons=(python3.11 python3.12 python3.13)
if [ -z "$folder" ]; then
    folder=$(mktemp -d)
    trap 'rm -rf "$folder"' EXIT
fi

settings=("PATH=/usr/local/bin:/usr/bin:/bin" "LANG=C")
for name in ${!PIP_@} http_proxy https_proxy no_proxy HTTP_PROXY HTTPS_PROXY NO_PROXY SSL_CERT_FILE REQUESTS_CA_BUNDLE; do
    [ -z "${!name-}" ] || settings+=("$name=${!name}")
done

# One step in a clone, with the interpreter and the home of this version.
run() {
    (cd "$folder/$version/clone" && env -i "${settings[@]}" HOME="$folder/$version/home" PYTHON="$python" "$@" </dev/null)
}

attempt() {
    mkdir -p "$folder/$version/home"
    [ -d "$folder/$version/clone" ] || git clone --quiet "$project" "$folder/$version/clone" || return
    git -C "$folder/$version/clone" fetch --quiet "$project" HEAD || return
    git -C "$folder/$version/clone" checkout --quiet --detach FETCH_HEAD || return
    for step in "${steps[@]}"; do
        printf '\n== %s with Python %s (%s s)\n' "$step" "$version" "$SECONDS"
        case "$step" in
        tests) run ./reproduce test ${arguments[@]+"${arguments[@]}"} || return ;;
        tiny)
            # shellcheck disable=SC2086 # words
            run ./reproduce --configfile config/tiny.yaml ${targets:+-- $targets} || return
            [ -n "$targets" ] || run ./reproduce verify --configfile config/tiny.yaml || return
            ;;
        esac
    done
}

outcomes=() status=0
for name in "${pythons[@]}"; do
    # a program of a version manager finds its interpreter by the caller's home
    python=$("$name" -c 'import sys; print(sys.executable)') || fail "$name cannot be run"
    version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
    if attempt; then outcomes+=("Python $version passed"); else outcomes+=("Python $version failed") status=1; fi
done
printf '\n'
printf '%s\n' "${outcomes[@]}"
exit $status
