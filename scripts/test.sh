#!/usr/bin/env bash
# Runs all tests, with what they need: a software GPU, a virtual screen, valgrind to count instructions, and Python for
# an independent check.
#
#     scripts/test.sh [ARGUMENTS OF cargo test]
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root"
# shellcheck source=scripts/packages.sh
source scripts/packages.sh

packages=("${linker[@]}" "${window[@]}" xvfb xdotool imagemagick valgrind)
# The independent check of quad meshes lies beside the repository, if at all. A Python from elsewhere may come first on the
# path; the packages then belong to the system's, which the tests try next.
if [[ -f ../shared/check/check_quads.py ]] && ! python3 -c 'import numpy, scipy' 2>/dev/null; then
    packages+=(python3 python3-numpy python3-scipy)
fi
need "${packages[@]}"

# Licences are checked where the tool for it is installed.
if cargo deny --version >/dev/null 2>&1; then
    cargo deny --offline check licenses || cargo deny check licenses
fi
# Random tests draw the same cases in every run, unless another seed is asked for.
export PROPTEST_RNG_SEED=${PROPTEST_RNG_SEED:-1}
# No example needs documentation tests: the public items are shown in use by the tests.
cargo test --workspace --lib --bins --tests "$@"
# Only where everything is tested: it takes half a minute.
(($#)) || scripts/instructions.sh
