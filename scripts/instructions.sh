#!/usr/bin/env bash
# Compares the instructions that the hover search and a placement execute with stored counts. Unlike times they hardly
# depend on the machine, so that a regression is seen wherever this runs. Needs valgrind; without, it only says so.
#
#     scripts/instructions.sh [PROGRAM]
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
program=${1:-$root/target/debug/plait}

# Millions of instructions, on the built-in creature, and by how many percent they may be exceeded: compilers and the
# vector units that a processor offers make a difference of some percent.
hover=1180
strips=816
margin=25

if ! command -v valgrind >/dev/null; then
    echo "skipped: instructions are not counted without valgrind"
    exit 0
fi

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

# count NAME FUNCTION ARGUMENTS...: millions of instructions within FUNCTION, all calls together.
count() {
    local name=$1 function=$2
    shift 2
    valgrind --tool=callgrind --callgrind-out-file="$scratch/$name.out" --log-file="$scratch/$name.log" \
        --toggle-collect="$function" "$program" bench "$@" creature --seed 1 --threads 1 --no-reference >/dev/null
    awk '/Collected/ { printf "%d\n", $NF / 1e6 }' "$scratch/$name.log" >"$scratch/$name"
}

# One thread each.
count hover plait_app::cli::bench::hover::searches hover --points 20 --strips 0 --search-only &
other=$!
count strips plait_core::weave::session::Session::place strips --strips 2
wait "$other"

status=0
for name in hover strips; do
    found=$(<"$scratch/$name") stored=${!name}
    echo "$name: $found million instructions, stored $stored"
    if ((found == 0 || found * 100 > stored * (100 + margin))); then
        echo "$name executes more than $margin % more instructions than stored in scripts/instructions.sh" >&2
        status=1
    elif ((found * (100 + margin) < stored * 100)); then
        echo "$name has become faster: lower the stored count in scripts/instructions.sh"
    fi
done
exit "$status"
