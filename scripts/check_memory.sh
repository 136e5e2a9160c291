#!/usr/bin/env bash
# The C interface under memory and thread checkers, in steps:
#
#   valgrind   every function (tests/ffi/every_function.c), with good arguments and with bad ones
#   asan       the same under the address sanitizer, with leaks and the host's undefined behaviour
#   tsan       a host whose 8 threads query while others build (examples/c/threads.cpp), under the thread sanitizer
#   tsan_rust  the same with the library under the thread sanitizer, too: every access on either side, nothing left out
#   miri       the tests of the interface (tests/ffi) in Rust's interpreter, which sees undefined behaviour
#
#   scripts/check_memory.sh [STEP...] [-- ARGUMENTS]     all steps by default; ARGUMENTS are cargo's for the library of
#                                                        the first three steps; default: --no-default-features
#   HRR_LIBRARY=libhrr.so scripts/check_memory.sh STEP   checks a library that is there already in these three
#
# A step that lacks a tool says so and is left out; one that was asked for by name fails then.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

steps=() named=yes skipped=()
while [ $# -gt 0 ] && [ "$1" != -- ]; do steps+=("$1") && shift; done
[ $# -eq 0 ] || shift
[ ${#steps[@]} -gt 0 ] || { steps=(valgrind asan tsan tsan_rust miri) && named=; }
arguments=("$@")
[ $# -gt 0 ] || arguments=(--no-default-features)

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
say() { echo "check_memory: $*" >&2; }
missing() { # STEP WHAT
    say "$1: SKIPPED: there is no $2"
    skipped+=("$1")
    [ -z "$named" ] || exit 1
}
made() { # the library that cargo's messages on the standard input name
    sed -n 's/.*"filenames":\["\([^"]*\/libhrr[^"]*\)".*/\1/p' | tail -n 1
}
library() { # builds the library once and says how to link it
    link=(-g -O1 -Iinclude -L"$scratch" -Wl,-rpath,"$scratch" -lhrr -lpthread -lm)
    [ ! -e "$scratch/libhrr.so" ] || return 0
    local from=${HRR_LIBRARY-}
    [ -n "$from" ] || from=$(cargo rustc --lib --crate-type cdylib --message-format json-render-diagnostics \
        "${arguments[@]}" | made)
    cp "$from" "$scratch/libhrr.so"
    # An installed library is looked for by its SONAME.
    local soname
    soname=$(readelf -d "$scratch/libhrr.so" | sed -n 's/.*(SONAME).*\[\(.*\)\]/\1/p')
    [ -z "$soname" ] || ln -sf libhrr.so "$scratch/$soname"
}
every=(tests/ffi/every_function.c -std=c99 -D_POSIX_C_SOURCE=200809L)
every_arguments=("$scratch" scenes/cornell/scene.toml)
# Fixed addresses: some kernels spread them further than the thread sanitizer knows.
fixed=()
if setarch --addr-no-randomize true 2>/dev/null; then fixed=(setarch --addr-no-randomize); fi

valgrind_() {
    command -v valgrind >/dev/null || { missing valgrind valgrind && return; }
    library
    cc "${every[@]}" "${link[@]}" -o "$scratch/every"
    # What is only possibly lost is crossbeam-epoch's list of threads, whose pointers carry a mark.
    valgrind --quiet --error-exitcode=1 --leak-check=full --show-leak-kinds=definite,indirect \
        --errors-for-leak-kinds=definite,indirect "$scratch/every" "${every_arguments[@]}"
}

asan_() {
    library
    cc "${every[@]}" -fsanitize=address,undefined -fno-sanitize-recover=all "${link[@]}" -o "$scratch/every_asan"
    ASAN_OPTIONS=detect_leaks=1 "$scratch/every_asan" "${every_arguments[@]}"
}

tsan_() {
    library
    c++ -std=c++17 -fsanitize=thread examples/c/threads.cpp "${link[@]}" -o "$scratch/threads"
    # The library's own locks are not seen, since Rust's are not pthread's: what it does with memory inside is left out,
    # and what the host reads of it is not.
    echo "called_from_lib:libhrr.so" >"$scratch/suppressions"
    TSAN_OPTIONS="halt_on_error=1 suppressions=$scratch/suppressions" "${fixed[@]}" "$scratch/threads" "$scratch"
}

tsan_rust_() {
    command -v clang++ >/dev/null || { missing tsan_rust clang++ && return; }
    local rust runtime target
    rust=$(rustc +nightly --print sysroot 2>/dev/null)/lib/rustlib || true
    [ -d "$rust/src/rust/library/std" ] || { missing tsan_rust "nightly toolchain with rust-src" && return; }
    target=$(rustc +nightly -vV | sed -n 's/^host: //p')
    mkdir -p "$scratch/whole"
    # The standard library, too, or its locks are not seen. The runtime is one for both: Rust's, in the program.
    cp "$(RUSTFLAGS=-Zsanitizer=thread cargo +nightly rustc -Zbuild-std --target "$target" --no-default-features \
        --lib --crate-type cdylib --message-format json-render-diagnostics | made)" "$scratch/whole/libhrr.so"
    nm -D "$scratch/whole/libhrr.so" | grep __tsan_ >/dev/null || { say "the library is not instrumented" && exit 1; }
    runtime=$(echo "$rust/$target"/lib/librustc-*_rt.tsan.a)
    clang++ -std=c++17 -fsanitize=thread -g -O1 -Iinclude -c examples/c/threads.cpp -o "$scratch/threads.o"
    clang++ "$scratch/threads.o" -Wl,--whole-archive "$runtime" -Wl,--no-whole-archive -Wl,--export-dynamic \
        -L"$scratch/whole" -Wl,-rpath,"$scratch/whole" -lhrr -lpthread -lm -ldl -lrt -o "$scratch/threads_whole"
    TSAN_OPTIONS=halt_on_error=1 "${fixed[@]}" "$scratch/threads_whole" "$scratch"
}

miri_() {
    cargo +nightly miri --version >/dev/null 2>&1 || { missing miri "nightly toolchain with miri" && return; }
    # Tree borrows: under stacked ones, crossbeam-epoch 0.9 finds its list's nodes by pointers to their links, which is
    # not allowed there. Leaks are valgrind's: that list lives until the end. Sines and powers as they are, since tests
    # compare bits. Left out: what starts compilers, what counts a million vertices, and whole renders. Some twelve minutes.
    MIRIFLAGS="-Zmiri-disable-isolation -Zmiri-tree-borrows -Zmiri-ignore-leaks -Zmiri-deterministic-floats" \
        cargo +nightly miri test --no-default-features --test main ffi:: -- \
        --skip ffi::header --skip ffi::programs --skip ffi::installed --skip ffi::allocations --skip ffi::renders
}

for step in "${steps[@]}"; do
    declare -F "${step}_" >/dev/null || { say "there is no step $step" && exit 2; }
    say "$step"
    "${step}_"
done
say "all is well${skipped:+; SKIPPED: ${skipped[*]}}"
