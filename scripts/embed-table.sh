#!/usr/bin/env bash
# Embeds layouts and prints a Markdown table row for each: the initial embedding beside the optimised one.
#
#   scripts/embed-table.sh SCRIPT|DESIGN|MESH...   a mesh is woven by suggestions first, until no region is orange
#   IMPROVE=60 scripts/embed-table.sh …            layouts are improved first, in that many rounds; a mesh is then woven
#                                                  until no region is red
#
# Needs Python for reading the reports.
set -u
cd "$(dirname "$0")/.."
cargo build --quiet -p plait || exit 1
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
echo "| layout | triangles | patches | steps | seconds | E | flipped | E_confor | E_planar | E° | |"
echo "|---|---|---|---|---|---|---|---|---|---|---|"
for input in "$@"; do
  name=$(basename "$input")
  design=$input
  first=()
  case $input in
  *.json | *.plait | *.layout) ;;
  *) first=(--suggest --until "$([ -n "${IMPROVE:-}" ] && echo red || echo orange)") ;;
  esac
  if [ -n "${IMPROVE:-}" ]; then first+=(--improve "$IMPROVE"); fi
  if [ ${#first[@]} -gt 0 ]; then
    design="$out/w/design.plait"
    rm -rf "${out:?}/w"
    start=$(date +%s.%N)
    target/debug/plait weave "$input" "${first[@]}" --no-optimise --out "$out/w" >/dev/null 2>"$out/woven"
    seconds=$(echo "$(date +%s.%N) $start" | awk '{printf "%.0f", $1 - $2}')
    grep -h 'alignment error .* objective' "$out/woven" | sed "s|^plait:|$name, woven in $seconds s:|" >&2
  fi
  rm -rf "${out:?}/e"
  message=$(timeout "${LIMIT:-600}" target/debug/plait embed "$design" --out "$out/e" --quiet 2>&1)
  if [ -f "$out/e/report.json" ]; then
    python3 - "$name" "$out/e/report.json" <<'PY'
import json, sys
name, path = sys.argv[1:]
report = json.load(open(path))
layout = report["layout"]
e = layout["embedding"]
seconds = report["seconds"].get("embed", 0)
if e["optimised"]:
    b = e["initial"]
    print(f"| {name} | {report['faces']} | {layout['patches']} | {e['steps']} | {seconds:.1f} "
          f"| {e['energy_before']:.3f} → {e['energy_after']:.3f} "
          f"| {e['flipped_initially']} → {e['flipped_after_least_squares']} → {len(e['remaining_flipped_triangles'])} "
          f"| {b['conformal']:.2f} → {e['conformal']:.3f} | {b['planar']:.2f} → {e['planar']:.2f} "
          f"| {b['alignment']:.1f} → {e['alignment']:.1f} | |")
else:
    print(f"| {name} | {report['faces']} | {layout['patches']} | | {seconds:.1f} | | | {e['conformal']:.2f} "
          f"| {e['planar']:.2f} | {e['alignment']:.1f} | initial embedding kept: {e['error']} |")
PY
  else
    echo "| $name | | | | | | | | | | $(grep -v XDG <<<"$message" | head -n 1) |"
  fi
done
