#!/usr/bin/env bash
# Installs the C library for C and C++: headers, libhrr.so, libhrr.a, hrr.pc and a CMake package, all of which may be
# moved together. It is built without Embree and OpenImageIO, unless features say so.
#
#   scripts/install.sh DIR [ARGUMENTS]     ARGUMENTS are cargo's, such as --locked, --features embree or --profile dev
#
# DESTDIR, when set, stands before DIR on disk but not in any file, as packagers want it.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

[ $# -ge 1 ] || { echo "install: where to? (scripts/install.sh DIR)" >&2 && exit 2; }
prefix=$1 arguments=(--no-default-features "${@:2}")
case " ${arguments[*]} " in
*" --profile "*) ;;
*) arguments+=(--profile release) ;;
esac

# The shared library is known by its interface's number, so that programs notice a change.
abi=$(sed -n 's/^#define HRR_ABI //p' include/hrr.h)
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
build=$(mktemp -d)
trap 'rm -rf "$build"' EXIT
# Without incremental compilation: one library each, whole.
export CARGO_INCREMENTAL=0
made() { # the file that cargo's last message about the library names
    sed -n 's/.*"filenames":\["\([^"]*\/libhrr[^"]*\)".*/\1/p' "$build/messages" | tail -n 1
}
cargo rustc --lib --crate-type staticlib --message-format json-render-diagnostics "${arguments[@]}" -- \
    --print "native-static-libs=$build/needs" >"$build/messages"
cp "$(made)" "$build/libhrr.a"
cargo rustc --lib --crate-type cdylib --message-format json-render-diagnostics "${arguments[@]}" -- \
    -C "link-arg=-Wl,-soname,libhrr.so.$abi" >"$build/messages"
cp "$(made)" "$build/libhrr.so"
# What a static library needs beside itself; the C compiler brings the last one anyway.
needs=$(sed 's/^[^:]*: //; s/^ *//; s/ *$//' "$build/needs")

root=${DESTDIR:-}$prefix
mkdir -p "$root/include" "$root/lib/pkgconfig" "$root/lib/cmake/hrr"
install -m 644 include/hrr.h include/hrr.hpp "$root/include/"
install -m 644 "$build/libhrr.a" "$root/lib/"
install -m 755 "$build/libhrr.so" "$root/lib/libhrr.so.$version"
ln -sf "libhrr.so.$version" "$root/lib/libhrr.so.$abi"
ln -sf "libhrr.so.$abi" "$root/lib/libhrr.so"

cat >"$root/lib/pkgconfig/hrr.pc" <<END
prefix=\${pcfiledir}/../..
Name: hrr
Description: Hierarchical Russian roulette for vertex connections
Version: $version
Cflags: -I\${prefix}/include
Libs: -L\${prefix}/lib -lhrr
Libs.private: $needs
END

cat >"$root/lib/cmake/hrr/hrr-config.cmake" <<END
# find_package(hrr) gives hrr::hrr, the shared library, and hrr::static.
get_filename_component(_hrr_prefix "\${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
if(NOT TARGET hrr::hrr)
  add_library(hrr::hrr SHARED IMPORTED)
  set_target_properties(hrr::hrr PROPERTIES
    IMPORTED_LOCATION "\${_hrr_prefix}/lib/libhrr.so.$version"
    IMPORTED_SONAME "libhrr.so.$abi"
    INTERFACE_INCLUDE_DIRECTORIES "\${_hrr_prefix}/include")
  add_library(hrr::static STATIC IMPORTED)
  set_target_properties(hrr::static PROPERTIES
    IMPORTED_LOCATION "\${_hrr_prefix}/lib/libhrr.a"
    INTERFACE_LINK_LIBRARIES "${needs// /;}"
    INTERFACE_INCLUDE_DIRECTORIES "\${_hrr_prefix}/include")
endif()
unset(_hrr_prefix)
END

cat >"$root/lib/cmake/hrr/hrr-config-version.cmake" <<END
# Below 1.0 a change of the second number may break programs.
set(PACKAGE_VERSION "$version")
string(REGEX MATCH "^[0-9]+[.][0-9]+" _hrr_own "$version")
string(REGEX MATCH "^[0-9]+[.][0-9]+" _hrr_wanted "\${PACKAGE_FIND_VERSION}")
if(NOT _hrr_wanted OR (_hrr_wanted STREQUAL _hrr_own AND NOT PACKAGE_FIND_VERSION VERSION_GREATER PACKAGE_VERSION))
  set(PACKAGE_VERSION_COMPATIBLE TRUE)
  if(PACKAGE_FIND_VERSION VERSION_EQUAL PACKAGE_VERSION)
    set(PACKAGE_VERSION_EXACT TRUE)
  endif()
endif()
unset(_hrr_own)
unset(_hrr_wanted)
END
echo "install: libhrr $version is in $root" >&2
