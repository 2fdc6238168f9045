#!/usr/bin/env bash
# Builds and runs Plait; installs the system packages it needs where it may, or names them.
#
#     scripts/run.sh [ARGUMENTS OF plait]
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=scripts/packages.sh
source "$root/scripts/packages.sh"

need "${linker[@]}" "${window[@]}"
# Built for its manifest, but run in the caller's folder, so that file names mean what the caller means.
exec cargo run --quiet --manifest-path "$root/Cargo.toml" --package plait --bin plait -- "$@"
