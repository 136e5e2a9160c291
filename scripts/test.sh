#!/usr/bin/env bash
# Everything that must hold before a change is accepted: set-up, formatting, lints, documentation and all tests, with
# the C libraries and without them.
#
#   scripts/test.sh           all of it
#   scripts/test.sh --pure    only what needs no C library (and no set-up)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# Sets of features: the default ones, and none.
builds=("" "--no-default-features")
case "${*-}" in
"") scripts/setup.sh --browser ;;
--pure) builds=("--no-default-features") ;;
*) echo "test: unknown arguments: $* (known: --pure)" >&2 && exit 2 ;;
esac

# On a build machine, Cargo.lock is what was committed.
locked=${CI:+--locked}
run() {
    echo "test: $*" >&2
    "$@"
}

run cargo fmt --all --check
for build in "${builds[@]}"; do
    # shellcheck disable=SC2086 # one word or none
    run cargo clippy $locked --all-targets $build -- -D warnings
done
# shellcheck disable=SC2086
RUSTDOCFLAGS="-D warnings" run cargo doc $locked --no-deps ${builds[-1]}
for build in "${builds[@]}"; do
    # shellcheck disable=SC2086
    run cargo test $locked $build
done
if command -v chromium chromium-browser google-chrome >/dev/null; then
    # shellcheck disable=SC2086
    run cargo test $locked ${builds[-1]} --test main reports_work_in_a_browser -- --ignored
else
    echo "test: no Chromium here: how reports work in a browser was not tested" >&2
fi
echo "test: all is well" >&2
