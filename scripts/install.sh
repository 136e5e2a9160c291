#!/usr/bin/env bash
# Installs the C library: headers, libhrr.so, libhrr.a, hrr.pc. It is built without Embree and OpenImageIO, which the C
# interface does not use.
#
#   scripts/install.sh DIR [ARGUMENTS]     ARGUMENTS are cargo's, such as --locked or --features embree
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

[ $# -ge 1 ] || { echo "install: where to? (scripts/install.sh DIR)" >&2 && exit 2; }
prefix=$1 arguments=(--no-default-features "${@:2}")

# The shared library is known by its interface's number, so that programs notice a change.
abi=$(sed -n 's/^#define HRR_ABI //p' include/hrr.h)
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
build=$(mktemp -d)
trap 'rm -rf "$build"' EXIT
cargo rustc --release --lib --crate-type staticlib "${arguments[@]}" -- --print "native-static-libs=$build/needs"
cargo rustc --release --lib --crate-type cdylib "${arguments[@]}" -- -C "link-arg=-Wl,-soname,libhrr.so.$abi"
target=$(cargo metadata --format-version 1 --no-deps | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')/release

mkdir -p "$prefix/include" "$prefix/lib/pkgconfig"
prefix=$(cd "$prefix" && pwd)
install -m 644 include/hrr.h include/hrr.hpp "$prefix/include/"
install -m 644 "$target/libhrr.a" "$prefix/lib/"
install -m 755 "$target/libhrr.so" "$prefix/lib/libhrr.so.$version"
ln -sf "libhrr.so.$version" "$prefix/lib/libhrr.so.$abi"
ln -sf "libhrr.so.$abi" "$prefix/lib/libhrr.so"
needs=$(cat "$build/needs")
cat >"$prefix/lib/pkgconfig/hrr.pc" <<END
prefix=$prefix
Name: hrr
Description: Hierarchical Russian roulette for vertex connections
Version: $version
Cflags: -I\${prefix}/include
Libs: -L\${prefix}/lib -lhrr
Libs.private: ${needs#*: }
END
echo "install: libhrr $version is in $prefix" >&2
