#!/usr/bin/env bash
# Brings what the features `embree` and `oiio` need: Embree >= 4.3, OpenImageIO >= 3.1.4, and libclang, which reads
# Embree's headers at build time. Each is looked for on the system, then in the distribution's packages, and last
# put into a private prefix, `.native/` (pinned versions, checked by SHA-256, no root, nothing compiled). Does
# nothing when all is there. See docs/setup.md.
#
#   scripts/setup.sh             the above
#   scripts/setup.sh --private   leave the distribution's packages alone even when root
#   scripts/setup.sh --force     look again even when an earlier run found everything
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
prefix=$root/.native
stamp=$prefix/stamp

# Pinned for the private prefix. Embree's structs are the same in the 4.3.3 headers and the 4.4.0 library.
wheels="embreex==4.4.0.post1 --hash=sha256:2cd0f7d5c6342e6247e31f700761689cae7829454d8c6de0c41e62124a023e1f
openimageio==3.1.18.1 --hash=sha256:f6093b80484c8df645a2168ece9f5f866153acebad97b7b2f0830945e1e5ec81
libclang==18.1.1 --hash=sha256:c533091d8a3bbf7460a00cb6c1a71da93bffe148f172c7d03b1c31fbf8aa2a0b"
oiio_source="openimageio==3.1.18.1 --hash=sha256:4d8b4fc876e47be47b3724c8e4a8a2fe381142cdcfd9624a23477691e58783a2"
oiio_version=(3 1 18 1)
header_suite=trixie
declare -A header_sha256=(
    [libembree-dev]=674a8b3d1a00612f46730da29f4cc146267b4917bbf0242113d0568429e78726
    [libimath-dev]=586350a1b47f754a63132f5aadd426d8d2cc49f00fa873a268fa84041bca0616
    [libfmt-dev]=c084df80e2842bc57157e8def529f4ca6bc8743d005550b56a5ef96c9bc92f0f
)

private= force=
for argument in "$@"; do
    case $argument in
    --private) private=1 ;;
    --force) force=1 ;;
    *) echo "setup.sh: unknown argument $argument (known: --private, --force)" >&2 && exit 2 ;;
    esac
done

say() { echo "setup: $*"; }

# The stamp's first line names this script's text and place; the others are files that must still be there.
identity() { echo "$(cksum <"${BASH_SOURCE[0]}") ${EMBREE4_ROOT-} ${OIIO_ROOT-} ${LIBCLANG_PATH-} $root"; }
up_to_date() {
    local line
    [ -r "$stamp" ] || return 1
    {
        read -r line && [ "$line" = "$(identity)" ] || return 1
        while read -r line; do [ -e "$line" ] || return 1; done
    } <"$stamp"
}
[ -z "$force" ] && up_to_date && exit 0

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

# ---- What is there. Each prints the file that shows it.

embree_there() {
    local flags=() header
    [ -n "${EMBREE4_ROOT-}" ] && flags=(-I"$EMBREE4_ROOT/include" -L"$EMBREE4_ROOT/lib" -L"$EMBREE4_ROOT/lib64")
    cat >"$scratch/embree.cpp" <<'END'
#include <embree4/rtcore.h>
static_assert(RTC_VERSION >= 40300, "too old");
int main() { rtcReleaseDevice(rtcNewDevice(nullptr)); }
END
    "${CXX:-c++}" "${flags[@]}" "$scratch/embree.cpp" -lembree4 -o "$scratch/embree" 2>/dev/null || return 1
    header=$("${CXX:-c++}" "${flags[@]}" -M "$scratch/embree.cpp" | grep -o '[^ ]*embree4/rtcore\.h' | head -n1)
    echo "$header"
}

oiio_there() {
    if [ -n "${OIIO_ROOT-}" ]; then
        [ -e "$OIIO_ROOT/include/OpenImageIO/imageio.h" ] && echo "$OIIO_ROOT/include/OpenImageIO/imageio.h"
    else
        pkg-config --atleast-version=3.1.4 OpenImageIO 2>/dev/null &&
            echo "$(pkg-config --variable=includedir OpenImageIO)/OpenImageIO/imageio.h"
    fi
}

libclang_there() {
    local directory file
    for directory in ${LIBCLANG_PATH:+"$LIBCLANG_PATH"} /usr/lib/llvm-*/lib /usr/lib/*-linux-gnu /usr/lib64 \
        /usr/lib /usr/local/lib; do
        for file in "$directory"/libclang.so* "$directory"/libclang-[0-9]*.so*; do
            [ -e "$file" ] && echo "$file" && return
        done
    done
    return 1
}

missing=()
found=()
look() {
    local file
    missing=() found=()
    if file=$(embree_there); then found+=("$file"); else missing+=(embree); fi
    if file=$(oiio_there); then found+=("$file"); else missing+=(oiio); fi
    if file=$(libclang_there); then found+=("$file"); else missing+=(libclang); fi
}
lacks() { case " ${missing[*]} " in *" $1 "*) return 0 ;; *) return 1 ;; esac; }

# ---- The distribution's packages.

as_root() { if [ "$(id -u)" = 0 ]; then "$@"; else sudo -n "$@"; fi; }
may_install() {
    [ -z "$private" ] && command -v apt-get >/dev/null && { [ "$(id -u)" = 0 ] || sudo -n true 2>/dev/null; }
}
offers() { # package, least version
    local version
    version=$(LC_ALL=C apt-cache policy "$1" 2>/dev/null | sed -n 's/^ *Candidate: *//p')
    [ -n "$version" ] && [ "$version" != "(none)" ] && dpkg --compare-versions "$version" ge "$2"
}
wanted_packages() {
    if lacks embree && offers libembree-dev 4.3; then echo libembree-dev; fi
    if lacks oiio && offers libopenimageio-dev 3.1.4; then echo libopenimageio-dev pkg-config; fi
    if lacks libclang && offers libclang-dev 1:14; then echo libclang-dev; fi
}
install_packages() {
    say "installing with apt-get: $*"
    as_root env DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends "$@" \
        >"$scratch/apt.log" 2>&1 || { tail -n5 "$scratch/apt.log" >&2 && return 1; }
}

# ---- The private prefix.

# apt-get on sources of our own choice; neither the system's package lists nor its packages change.
private_apt() { # sources file, arguments
    local sources=$1 state=$scratch/apt-$(basename "$1")
    shift
    mkdir -p "$state/lists/partial" "$state/cache/archives/partial"
    local user=()
    [ "$(id -u)" = 0 ] && user=(-o APT::Sandbox::User=root)
    apt-get -qq -o Dir::State="$state" -o Dir::State::status=/var/lib/dpkg/status -o Dir::Cache="$state/cache" \
        -o Dir::Etc::sourcelist="$sources" -o Dir::Etc::sourceparts=/nonexistent -o Acquire::Languages=none \
        -o Acquire::IndexTargets::deb::DEP-11::DefaultEnabled=false -o Debug::NoLocking=true \
        "${user[@]}" "$@" >>"$scratch/apt.log" 2>&1
}

# The addresses of the archives that this machine's apt is set up with and that carry its release.
own_archives() {
    apt-get update --print-uris 2>/dev/null |
        sed -n "s,^'\(.*\)/dists/\($1\|stable\|oldstable\|testing\|unstable\|sid\)/InRelease'.*,\1 \2,p" | sort -u
}

# Headers out of Debian's packages, whatever Debian the machine runs.
debian_headers() { # directory, packages
    local directory=$1 codename archive package ok
    shift
    codename=$(. /etc/os-release && echo "${VERSION_CODENAME:-sid}")
    local keyring=/usr/share/keyrings/debian-archive-keyring.gpg
    [ -r "$keyring" ] || { echo "Debian's archive keyring ($keyring) is not there" >&2 && return 1; }
    mkdir -p "$scratch/debs"
    while read -r archive _; do
        echo "deb [arch=amd64 signed-by=$keyring] $archive $header_suite main" >"$scratch/headers.list"
        ok=1
        private_apt "$scratch/headers.list" update || ok=
        for package in "$@"; do
            [ -n "$ok" ] && (cd "$scratch/debs" && private_apt "$scratch/headers.list" download "$package") || ok=
        done
        [ -n "$ok" ] && break
    done < <(own_archives "$codename")
    [ -n "${ok-}" ] || { echo "no package archive of this machine has $* of Debian $header_suite" >&2 && return 1; }
    for package in "$@"; do
        echo "${header_sha256[$package]}  $(echo "$scratch/debs/$package"_*.deb)" | sha256sum --check --quiet >&2 || return 1
        dpkg-deb -x "$scratch/debs/$package"_*.deb "$directory"
    done
}

# Python with pip: the machine's, else the distribution's packages, unpacked into the scratch directory.
pip=()
find_pip() {
    if python3 -m pip --version >/dev/null 2>&1; then
        pip=(python3 -m pip)
    elif may_install && install_packages python3-pip; then
        pip=(python3 -m pip)
    else
        local sources=$scratch/tools.list tools=$scratch/tools codename archive suite deb
        codename=$(. /etc/os-release && echo "${VERSION_CODENAME:-sid}")
        own_archives "$codename" | while read -r archive suite; do echo "deb $archive $suite main"; done >"$sources"
        private_apt "$sources" update
        private_apt "$sources" install -y --download-only --no-install-recommends python3-minimal libpython3-stdlib \
            python3-pip-whl || return 1
        mkdir -p "$tools"
        for deb in "$scratch/apt-tools.list/cache/archives/"*.deb; do
            case $(basename "$deb") in libc6_* | libc-bin_*) continue ;; esac
            dpkg-deb -x "$deb" "$tools"
        done
        local python=python3
        if ! command -v python3 >/dev/null; then
            python=$(echo "$tools"/usr/bin/python3.*[0-9])
            export PYTHONHOME=$tools/usr
            LD_LIBRARY_PATH=$(echo "$tools"/usr/lib/*-linux-gnu):$(echo "$tools"/lib/*-linux-gnu)
            export LD_LIBRARY_PATH
        fi
        pip=("$python" "$(echo "$tools"/usr/share/python-wheels/pip-*.whl)/pip")
        "${pip[@]}" --version >/dev/null
    fi
}
unzip_wheel() { "${pip[0]}" -m zipfile -e "$1" "$2"; }
fetch() { # directory, requirement lines, further arguments
    local directory=$1 requirements=$2
    shift 2
    echo "$requirements" >"$scratch/requirements.txt"
    "${pip[@]}" download --quiet --disable-pip-version-check --no-cache-dir --no-deps --require-hashes \
        --requirement "$scratch/requirements.txt" --dest "$directory" "$@" 2>"$scratch/pip.log" ||
        { tail -n5 "$scratch/pip.log" >&2 && return 1; }
}
fetch_wheels() { # names; the tags make the choice independent of the Python at hand
    local lines
    lines=$(for name in "$@"; do echo "$wheels" | grep "^$name=="; done)
    fetch "$scratch/wheels" "$lines" --only-binary=:all: --implementation cp --python-version 3.11 --abi cp311 \
        --abi none --platform manylinux_2_28_x86_64 --platform manylinux2010_x86_64
    for name in "$@"; do unzip_wheel "$scratch"/wheels/"$name"-*.whl "$scratch/unpacked"; done
}

private_embree() { # new prefix
    fetch_wheels embreex
    cp "$scratch"/unpacked/embreex.libs/*.so* "$1/lib/"
    ln -s "$(basename "$1"/lib/libembree4-*.so.4)" "$1/lib/libembree4.so"
    debian_headers "$scratch/headers" libembree-dev
    cp -r "$scratch/headers/usr/include/embree4" "$1/include/"
    echo 'EMBREE4_ROOT = { value = ".native", relative = true }' >>"$1/cargo.toml"
}

private_oiio() { # new prefix
    fetch_wheels openimageio
    local library version=${oiio_version[0]}.${oiio_version[1]}.${oiio_version[2]}
    for library in libOpenImageIO libOpenImageIO_Util; do
        cp "$scratch/unpacked/OpenImageIO/lib/$library.so.$version" "$1/lib/"
        ln -s "$library.so.$version" "$1/lib/$library.so"
    done
    # pip asks a source archive's build backend for metadata even when it only downloads; this one answers without
    # building anything.
    mkdir -p "$scratch/backend/scikit_build_core"
    touch "$scratch/backend/scikit_build_core/__init__.py"
    cat >"$scratch/backend/scikit_build_core/build.py" <<END
import pathlib
def prepare_metadata_for_build_wheel(directory, settings=None):
    info = pathlib.Path(directory, "openimageio.dist-info")
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: openimageio\nVersion: $(IFS=. && echo "${oiio_version[*]}")\n")
    return info.name
END
    PYTHONPATH=$scratch/backend fetch "$scratch/source" "$oiio_source" --no-binary=:all: --no-build-isolation
    tar -xzf "$scratch"/source/openimageio-*.tar.gz -C "$scratch" --strip-components=1 --wildcards '*/src/include/OpenImageIO'
    local headers=$1/include/OpenImageIO
    cp -r "$scratch/src/include/OpenImageIO" "$headers"
    sed -e "s/@PROJECT_VERSION_MAJOR@/${oiio_version[0]}/; s/@PROJECT_VERSION_MINOR@/${oiio_version[1]}/" \
        -e "s/@PROJECT_VERSION_PATCH@/${oiio_version[2]}/; s/@PROJECT_VERSION_TWEAK@/${oiio_version[3]}/" \
        -e "s/@PROJECT_VERSION_RELEASE_TYPE@//; s/@PROJ_NAMESPACE@/OpenImageIO/g" \
        -e "s/@PROJ_VERSION_NAMESPACE@/v${oiio_version[0]}_${oiio_version[1]}/g" \
        -e "s/@Imath_VERSION_MAJOR@/3/; s/@Imath_VERSION_MINOR@/1/; s/@CMAKE_CXX_STANDARD@/17/g" \
        -e "s/^#cmakedefine01 OIIO_TBB/#define OIIO_TBB 0/" "$headers/oiioversion.h.in" >"$headers/oiioversion.h"
    ! grep -n '@\|cmakedefine' "$headers/oiioversion.h" >&2
    debian_headers "$scratch/headers" libimath-dev libfmt-dev
    cp -r "$scratch/headers/usr/include/Imath" "$1/include/"
    cp -r "$scratch/headers/usr/include/fmt" "$headers/detail/"
    echo 'OIIO_ROOT = { value = ".native", relative = true }' >>"$1/cargo.toml"
}

private_libclang() { # new prefix
    fetch_wheels libclang
    cp "$scratch"/unpacked/libclang-*.data/platlib/clang/native/libclang.so "$1/lib/"
    echo 'LIBCLANG_PATH = { value = ".native/lib", relative = true }' >>"$1/cargo.toml"
}

give_up() {
    local name
    {
        echo "setup: could not bring: ${missing[*]}"
        [ $# = 0 ] || echo "setup: $*"
        [ -s "$scratch/apt.log" ] && grep -h '^[EW]:' "$scratch/apt.log" | sort -u | head -n5
        for name in "${missing[@]}"; do
            case $name in
            embree) echo "  Embree >= 4.3: libembree-dev (Debian >= 13, Ubuntu >= 24.04), or set EMBREE4_ROOT to one" ;;
            oiio) echo "  OpenImageIO >= 3.1.4: where pkg-config finds it, or set OIIO_ROOT to one" ;;
            libclang) echo "  libclang: libclang-dev, or set LIBCLANG_PATH to its directory" ;;
            esac
        done
        echo "  Without any of these: cargo build --no-default-features  (docs/setup.md)"
    } >&2
    exit 1
}

# ---- The way through.

command -v "${CXX:-c++}" >/dev/null || { echo "setup: a C++ compiler is needed (c++, or CXX)" >&2 && exit 1; }
look
if [ ${#missing[@]} -gt 0 ] && command -v apt-get >/dev/null; then
    if may_install; then
        # A fresh container has no package lists yet.
        offers libc6 0 || as_root apt-get update -qq >"$scratch/apt.log" 2>&1 || true
        mapfile -t packages < <(wanted_packages | tr ' ' '\n')
        if [ ${#packages[@]} -gt 0 ] && install_packages "${packages[@]}"; then look; fi
    elif [ -z "$private" ]; then
        packages=$(wanted_packages | tr '\n' ' ')
        [ -z "$packages" ] || say "not root, so a private copy instead of the distribution's $packages"
    fi
fi

rm -f "$stamp"
new=$prefix/new
rm -rf "$new" "$prefix/include" "$prefix/lib" "$prefix/cargo.toml"
if [ ${#missing[@]} -gt 0 ]; then
    say "putting a private copy of ${missing[*]} into $prefix"
    [ "$(uname -sm)" = "Linux x86_64" ] || give_up "the private copies are for Linux on x86_64"
    command -v apt-get >/dev/null && command -v dpkg-deb >/dev/null || give_up "the private copies need Debian's apt and dpkg"
    find_pip || give_up "Python with pip is needed: python3-pip"
    mkdir -p "$new/include" "$new/lib"
    echo "[env]" >"$new/cargo.toml"
    for name in "${missing[@]}"; do
        # A subshell of its own: `set -e` is off inside a condition.
        set +e
        (set -e && "private_$name" "$new")
        status=$?
        set -e
        [ $status = 0 ] || give_up
    done
    mv "$new"/* "$prefix/" && rmdir "$new"
    found+=("$prefix/lib" "$prefix/include" "$prefix/cargo.toml")
fi
mkdir -p "$prefix"
{ identity && printf '%s\n' "${found[@]}"; } >"$stamp"
say "done"
