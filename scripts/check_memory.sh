#!/usr/bin/env bash
# The C interface under memory and thread checkers: every function (tests/ffi/every_function.c), with good arguments and
# with bad ones, under valgrind and the address sanitizer, and a host whose threads query while others build
# (examples/c/threads.cpp) under the thread sanitizer. Needs a C and C++ compiler, and valgrind, or says what it skips.
#
#   scripts/check_memory.sh [ARGUMENTS]     ARGUMENTS are cargo's; default: --no-default-features
#   HRR_LIBRARY=libhrr.so scripts/check_memory.sh     checks a library that is there already
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

[ $# -gt 0 ] || set -- --no-default-features
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
say() { echo "check_memory: $*" >&2; }

library=${HRR_LIBRARY-}
if [ -z "$library" ]; then
    cargo rustc --lib --crate-type cdylib --message-format json-render-diagnostics "$@" >"$scratch/messages"
    library=$(sed -n 's/.*"filenames":\["\([^"]*\/libhrr[^"]*\)".*/\1/p' "$scratch/messages" | tail -n 1)
fi
cp "$library" "$scratch/libhrr.so"
# An installed library is looked for by its SONAME.
soname=$(readelf -d "$scratch/libhrr.so" | sed -n 's/.*(SONAME).*\[\(.*\)\]/\1/p')
[ -z "$soname" ] || ln -sf libhrr.so "$scratch/$soname"
link=(-g -O1 -Iinclude -L"$scratch" -Wl,-rpath,"$scratch" -lhrr -lpthread -lm)
every=(tests/ffi/every_function.c -std=c99 -D_POSIX_C_SOURCE=200809L)
arguments=("$scratch" scenes/cornell/scene.toml)

if command -v valgrind >/dev/null; then
    say "every function under valgrind"
    cc "${every[@]}" "${link[@]}" -o "$scratch/every"
    # What is only possibly lost is crossbeam-epoch's list of threads, whose pointers carry a mark.
    valgrind --quiet --error-exitcode=1 --leak-check=full --show-leak-kinds=definite,indirect \
        --errors-for-leak-kinds=definite,indirect \
        "$scratch/every" "${arguments[@]}"
else
    say "skipped: there is no valgrind"
fi

say "every function under the address sanitizer (with leaks, and undefined behaviour of the host)"
cc "${every[@]}" -fsanitize=address,undefined -fno-sanitize-recover=all "${link[@]}" -o "$scratch/every_asan"
ASAN_OPTIONS=detect_leaks=1 "$scratch/every_asan" "${arguments[@]}"

say "8 threads that query while others build, under the thread sanitizer"
c++ -std=c++17 -fsanitize=thread examples/c/threads.cpp "${link[@]}" -o "$scratch/threads_tsan"
# Fixed addresses: some kernels spread them further than the sanitizer knows.
fixed=()
if setarch --addr-no-randomize true 2>/dev/null; then fixed=(setarch --addr-no-randomize); fi
# The library's own locks are not seen, since Rust's are not pthread's: what it does with memory inside is left out, and
# what the host reads of it is not.
echo "called_from_lib:libhrr.so" >"$scratch/suppressions"
TSAN_OPTIONS="halt_on_error=1 suppressions=$scratch/suppressions" "${fixed[@]}" "$scratch/threads_tsan" "$scratch"
say "all is well"
