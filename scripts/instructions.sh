#!/usr/bin/env bash
# Compares the instructions that the hover search, a placement and an embedding execute with stored counts. Unlike times
# they hardly depend on the machine, so that a regression is seen wherever this runs. Without valgrind it only says so; with
# PLAIT_TEST_ALL set it fails.
#
#     scripts/instructions.sh [PROGRAM]
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
program=${1:-$root/target/debug/plait}

# Millions of instructions: hover and strips on the built-in creature, embed on the layout of the rounded cube; and by how many
# percent they may be exceeded: compilers and the vector units of the processor make a difference of some percent.
hover=1180
strips=816
embed=5040
margin=25

if ! command -v valgrind >/dev/null; then
    echo "skipped: instructions are not counted without valgrind" >&2
    [[ -z ${PLAIT_TEST_ALL:-} ]]
    exit
fi

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

# count NAME FUNCTION ARGUMENTS...: millions of instructions within FUNCTION, all calls together, on one thread.
count() {
    local name=$1 function=$2
    shift 2
    RAYON_NUM_THREADS=1 valgrind --tool=callgrind --callgrind-out-file="$scratch/$name.out" \
        --log-file="$scratch/$name.log" --toggle-collect="$function" "$program" "$@" >/dev/null 2>&1
    awk '/Collected/ { printf "%d\n", $NF / 1e6 }' "$scratch/$name.log" >"$scratch/$name"
}

bench=(creature --seed 1 --threads 1 --no-reference)
count embed plait_core::embed::pipeline::coarse_to_fine::optimise_embedding \
    embed "$root/tests/scripts/rounded-cube.json" --out "$scratch/out" --quiet --quads 1 &
other=$!
count hover plait_app::cli::bench::hover::searches bench hover "${bench[@]}" --points 20 --strips 0 --search-only
count strips plait_core::weave::session::Session::place bench strips "${bench[@]}" --strips 2
wait "$other"

status=0
for name in hover strips embed; do
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
