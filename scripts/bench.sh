#!/usr/bin/env bash
# Benchmarks the meshes of docs/benchmarks.md and one family of models from a thousand to a million triangles; prints
# Markdown tables and draws docs/pictures/scaling.svg.
#
#     scripts/bench.sh [FOLDER OF MESHES]
#
# POINTS: points at which proposals are timed. OUT: a folder for the reports, kept; what is there is not measured
# again. Nothing else should run meanwhile.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
meshes=${1:-$root/../shared/meshes}
cd "$root"
# shellcheck source=scripts/packages.sh
source scripts/packages.sh
need "${linker[@]}"
cargo build --quiet -p plait --bin plait

if [[ -n ${OUT:-} ]]; then
    mkdir -p "$OUT"
    out=$OUT
else
    out=$(mktemp -d)
    trap 'rm -rf "$out"' EXIT
fi

# bench NAME ARGUMENTS...: one report, in a process of its own, so that its peak memory is its own.
bench() {
    local report=$out/$1.json
    shift
    [[ -s $report ]] && return
    echo "plait bench $*" >&2
    target/debug/plait bench "$@" --json >"$report.part" && mv "$report.part" "$report" ||
        echo "failed: plait bench $*" >&2
}

# table NAME...: a table of those reports that exist.
table() {
    local reports=()
    for name in "$@"; do
        [[ -s $out/$name.json ]] && reports+=("$out/$name.json")
    done
    ((${#reports[@]})) && target/debug/plait bench table "${reports[@]}"
}

points=${POINTS:-200}
named=()
for file in bunny_7k.off fertility_28k.obj botijo.obj rolling_stage_100k.obj; do
    [[ -f $meshes/$file ]] || continue
    named+=("${file%.*}")
    bench "${file%.*}" all "$meshes/$file" --points "$points"
done

# The rocker arm of the folder, or else a model that comes with the program. Embedding is left out: it is done once, not
# while somebody points.
family=("$meshes/rockerarm_1k.off" 0 1 2 3 4 5)
[[ -f ${family[0]} ]] || family=(torus 0 1 2 3)
sizes=()
for levels in "${family[@]:1}"; do
    sizes+=("size-$levels")
    bench "size-$levels" all "${family[0]}" --subdivide "$levels" --points "$points" --strips 0,4 --limit 60 --no-embed
done

table "${named[@]}"
echo
table "${sizes[@]}"
reports=()
for name in "${sizes[@]}"; do
    [[ -s $out/$name.json ]] && reports+=("$out/$name.json")
done
target/debug/plait bench plot "${reports[@]}" --out docs/pictures/scaling.svg
