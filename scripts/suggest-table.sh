#!/usr/bin/env bash
# Weaves meshes unattended by suggestions and prints a Markdown table row for each.
#
#   scripts/suggest-table.sh MESH...          until no region is red
#   UNTIL=orange scripts/suggest-table.sh …   until none is orange either
set -u
cd "$(dirname "$0")/.."
cargo build --quiet -p plait || exit 1
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
echo "| mesh | triangles | strips | patches | irregular nodes | red regions | seconds | |"
echo "|---|---|---|---|---|---|---|---|"
for mesh in "$@"; do
  name=$(basename "$mesh")
  rm -rf "${out:?}/w"
  start=$(date +%s.%N)
  message=$(timeout "${LIMIT:-300}" target/debug/plait weave "$mesh" --suggest --until "${UNTIL:-red}" --out "$out/w" 2>&1)
  seconds=$(echo "$(date +%s.%N) $start" | awk '{printf "%.1f", $1 - $2}')
  report="$out/w/report.json"
  value() { grep -m1 -oE "\"$1\": [0-9]+" "$report" | grep -oE '[0-9]+$'; }
  if [ -f "$report" ] && grep -q '"valid": true' "$report"; then
    strips=$(grep -c '"elastica_cost":' "$report")
    note=$(grep -o 'stopped early.*' <<<"$message" | head -n 1)
    echo "| $name | $(value faces) | $strips | $(value patches) | $(value irregular_nodes) | $(value red) | $seconds | $note |"
  else
    echo "| $name | | | | | | $seconds | $(grep -v XDG <<<"$message" | head -n 1) |"
  fi
done
