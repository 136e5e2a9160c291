#!/usr/bin/env bash
# Brings what the features `embree` and `oiio` need: Embree >= 4.3, OpenImageIO >= 3.1.4, and libclang, which reads
# Embree's headers at build time. Each is looked for on the system, then in the distribution's packages, and last
# put into a private prefix, `.native/` (pinned versions, checked by SHA-256, no root, nothing compiled). Does
# nothing when all is there. See docs/setup.md.
#
#   scripts/setup.sh             the above
#   scripts/setup.sh --browser   Chromium as well, for the test of reports, where packages may be installed
#   scripts/setup.sh --private   install no packages even when root
#   scripts/setup.sh --force     look again even when an earlier run found everything
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
prefix=$root/.native
stamp=$prefix/stamp

# Pinned for the private prefix. Embree's structs are the same in the 4.3.3 headers and the 4.4.0 library.
wheels="embreex==4.4.0.post1 --hash=sha256:2cd0f7d5c6342e6247e31f700761689cae7829454d8c6de0c41e62124a023e1f
openimageio==3.1.18.1 --hash=sha256:f6093b80484c8df645a2168ece9f5f866153acebad97b7b2f0830945e1e5ec81
libclang==18.1.1 --hash=sha256:c533091d8a3bbf7460a00cb6c1a71da93bffe148f172c7d03b1c31fbf8aa2a0b"
oiio_version=(3 1 18 1)
oiio_source="openimageio==3.1.18.1 --hash=sha256:4d8b4fc876e47be47b3724c8e4a8a2fe381142cdcfd9624a23477691e58783a2"
header_suite=trixie
header_sha256="libembree-dev 674a8b3d1a00612f46730da29f4cc146267b4917bbf0242113d0568429e78726
libimath-dev 586350a1b47f754a63132f5aadd426d8d2cc49f00fa873a268fa84041bca0616
libfmt-dev c084df80e2842bc57157e8def529f4ca6bc8743d005550b56a5ef96c9bc92f0f"

private='' force='' browser=''
for argument in "$@"; do
    case $argument in
    --private) private=1 ;;
    --force) force=1 ;;
    --browser) browser=1 ;;
    *) echo "setup: unknown argument $argument (known: --browser, --private, --force)" >&2 && exit 2 ;;
    esac
done

say() { echo "setup: $*" >&2; }
# Before `exit 1`: what is missing, and the ways out.
give_up() {
    local name
    say "could not bring: ${missing[*]}"
    say "$*"
    [ ! -s "$scratch/log" ] || tail -n 5 "$scratch/log" | sed 's/^/    /' >&2
    for name in "${missing[@]}"; do
        case $name in
        embree) say "  Embree >= 4.3: package libembree-dev (Debian >= 13, Ubuntu >= 24.04), or set EMBREE4_ROOT" ;;
        oiio) say "  OpenImageIO >= 3.1.4: where pkg-config finds it, or set OIIO_ROOT" ;;
        libclang) say "  libclang: package libclang-dev, or set LIBCLANG_PATH to its directory" ;;
        esac
    done
    say "  or build without them: cargo build --no-default-features  (docs/setup.md)"
    exit 1
}

# The stamp's first line tells what was asked for, the others name files that must still be there.
identity() {
    echo "$wheels $oiio_source $header_sha256 ${EMBREE4_ROOT-} ${OIIO_ROOT-} ${LIBCLANG_PATH-}" | cksum
}
up_to_date() (
    cd "$prefix" 2>/dev/null && [ -r stamp ] || return 1
    {
        read -r line && [ "$line" = "$(identity)" ] || return 1
        while read -r line; do [ -e "$line" ] || return 1; done
    } <stamp
)
browser_there() { command -v chromium chromium-browser google-chrome; }
[ -z "$browser" ] || ! browser_there >/dev/null || browser=''
[ -z "$force$browser" ] && up_to_date && exit 0

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cxx=${CXX:-c++}
missing=(embree oiio libclang)
command -v "$cxx" >/dev/null || give_up "a C++ compiler is needed: package g++, or set CXX"

# ---- What is there. Each prints a file that shows it.

embree_there() {
    local flags=()
    [ -z "${EMBREE4_ROOT-}" ] || flags=(-I"$EMBREE4_ROOT/include" -L"$EMBREE4_ROOT/lib" -L"$EMBREE4_ROOT/lib64")
    cat >"$scratch/embree.cpp" <<'END'
#include <embree4/rtcore.h>
static_assert(RTC_VERSION >= 40300, "too old");
int main() { rtcReleaseDevice(rtcNewDevice(nullptr)); }
END
    "$cxx" "${flags[@]}" "$scratch/embree.cpp" -lembree4 -o "$scratch/embree" 2>/dev/null || return 1
    "$cxx" "${flags[@]}" -M "$scratch/embree.cpp" | grep -o '[^ ]*embree4/rtcore\.h' | head -n 1
}
oiio_there() {
    local include
    if [ -n "${OIIO_ROOT-}" ]; then
        include=$OIIO_ROOT/include
    else
        pkg-config --atleast-version=3.1.4 OpenImageIO 2>/dev/null || return 1
        include=$(pkg-config --variable=includedir OpenImageIO)
    fi
    [ -e "$include/OpenImageIO/imageio.h" ] && echo "$include/OpenImageIO/imageio.h"
}
libclang_there() {
    local directory file
    for directory in ${LIBCLANG_PATH:+"$LIBCLANG_PATH"} /usr/lib/llvm-*/lib /usr/lib/*-linux-gnu /usr/lib64 /usr/lib \
        /usr/local/lib; do
        for file in "$directory"/libclang.so* "$directory"/libclang-[0-9]*.so*; do
            [ -e "$file" ] && echo "$file" && return
        done
    done
    return 1
}
found=()
look() {
    local name file
    missing=() found=()
    for name in embree oiio libclang; do
        if file=$("${name}_there"); then found+=("$file"); else missing+=("$name"); fi
    done
}
lacks() { [[ " ${missing[*]} " == *" $1 "* ]]; }

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
    as_root env DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends "$@" >"$scratch/log" 2>&1
}

# ---- What the private prefix is made from, in $scratch/{wheels,source,headers}.

# apt-get on sources of our own choice; neither the system's package lists nor its packages change.
private_apt() { # sources file, arguments
    local state=$1.apt options=()
    mkdir -p "$state/lists/partial" "$state/cache/archives/partial"
    [ "$(id -u)" != 0 ] || options=(-o APT::Sandbox::User=root)
    apt-get -qq -o Dir::State="$state" -o Dir::State::status=/var/lib/dpkg/status -o Dir::Cache="$state/cache" \
        -o Dir::Etc::sourcelist="$1" -o Dir::Etc::sourceparts=/dev/null -o Acquire::Languages=none \
        -o Acquire::IndexTargets::deb::DEP-11::DefaultEnabled=false -o Debug::NoLocking=true \
        "${options[@]}" "${@:2}" >>"$scratch/log" 2>&1
}
# Addresses and suites of the archives from which this machine's apt takes its release.
own_archives() {
    local release
    release=$(. /etc/os-release && echo "${VERSION_CODENAME:-sid}")
    apt-get update --print-uris 2>/dev/null |
        sed -n "s,^'\(.*\)/dists/\($release\|stable\|oldstable\|testing\|unstable\|sid\)/InRelease'.*,\1 \2,p" | sort -u
}

# Python with pip: the machine's, else from the distribution's packages, installed or only unpacked into $scratch.
python='' pip=()
find_pip() {
    python=python3 pip=(python3 -m pip)
    "${pip[@]}" --version >/dev/null 2>&1 && return
    if may_install && install_packages python3-pip; then return; fi
    local sources=$scratch/tools.list tools=$scratch/tools archive suite package
    own_archives | while read -r archive suite; do echo "deb $archive $suite main"; done >"$sources"
    private_apt "$sources" update
    private_apt "$sources" install -y --download-only --no-install-recommends python3-minimal libpython3-stdlib \
        python3-pip-whl ca-certificates || return 1
    mkdir -p "$tools"
    for package in "$sources.apt/cache/archives/"*.deb; do
        # A C library of another version than the running one would break every program.
        [[ $(basename "$package") == libc6_* ]] || dpkg-deb -x "$package" "$tools"
    done
    if ! command -v python3 >/dev/null; then
        python=$(echo "$tools"/usr/bin/python3.*[0-9])
        export PYTHONHOME=$tools/usr
        LD_LIBRARY_PATH=$(echo "$tools"/usr/lib/*-linux-gnu):$(echo "$tools"/lib/*-linux-gnu)
        export LD_LIBRARY_PATH
    fi
    # A wheel is a program, too.
    pip=("$python" "$(echo "$tools"/usr/share/python-wheels/pip-*.whl)/pip")
    "${pip[@]}" --version >>"$scratch/log" 2>&1
}
fetch() { # directory, requirements, further arguments
    echo "$2" >"$scratch/requirements.txt"
    "${pip[@]}" download --quiet --disable-pip-version-check --no-cache-dir --no-deps --require-hashes \
        --requirement "$scratch/requirements.txt" --dest "$1" "${@:3}" >"$scratch/log" 2>&1
}
fetch_wheels() { # names; the tags make the choice independent of the Python at hand
    local name lines
    lines=$(for name in "$@"; do grep "^$name==" <<<"$wheels"; done)
    fetch "$scratch/downloads" "$lines" --only-binary=:all: --implementation cp --python-version 3.11 --abi cp311 \
        --abi none --platform manylinux_2_28_x86_64 --platform manylinux2010_x86_64 || return 1
    for name in "$@"; do "$python" -m zipfile -e "$scratch/downloads/$name"-*.whl "$scratch/wheels"; done
}
fetch_oiio_source() {
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
    PYTHONPATH=$scratch/backend \
        fetch "$scratch/downloads" "$oiio_source" --no-binary=:all: --no-build-isolation || return 1
    mkdir -p "$scratch/source"
    tar -xzf "$scratch"/downloads/openimageio-*.tar.gz -C "$scratch/source" --strip-components=1
}
# Headers out of Debian's packages, whatever Debian the machine runs.
fetch_headers() { # packages
    local keyring=/usr/share/keyrings/debian-archive-keyring.gpg sources=$scratch/headers.list archive sum package
    [ -r "$keyring" ] || { echo "Debian's archive keyring is not there: $keyring" >"$scratch/log" && return 1; }
    mkdir -p "$scratch/headers"
    while read -r archive _; do
        echo "deb [arch=amd64 signed-by=$keyring] $archive $header_suite main" >"$sources"
        private_apt "$sources" update && (cd "$scratch/headers" && private_apt "$sources" download "$@") && break
    done < <(own_archives)
    for package in "$@"; do
        sum=$(sed -n "s/^$package //p" <<<"$header_sha256")
        sha256sum --check --quiet <<<"$sum  $(echo "$scratch/headers/$package"_*.deb)" >>"$scratch/log" 2>&1 || return 1
        dpkg-deb -x "$scratch/headers/$package"_*.deb "$scratch/headers"
    done
}

# ---- The private prefix, in $new.

new=$prefix/new
place_embree() {
    cp "$scratch"/wheels/embreex.libs/*.so* "$new/lib/"
    ln -s "$(cd "$new/lib" && echo libembree4-*.so.4)" "$new/lib/libembree4.so"
    cp -rp "$scratch/headers/usr/include/embree4" "$new/include/"
    echo 'EMBREE4_ROOT = { value = ".native", relative = true }' >>"$new/cargo.toml"
}
place_oiio() {
    local library version=${oiio_version[0]}.${oiio_version[1]}.${oiio_version[2]} include=$new/include/OpenImageIO
    for library in libOpenImageIO libOpenImageIO_Util; do
        cp "$scratch/wheels/OpenImageIO/lib/$library.so.$version" "$new/lib/"
        ln -s "$library.so.$version" "$new/lib/$library.so"
    done
    cp -rp "$scratch/source/src/include/OpenImageIO" "$include"
    sed -e "s/@PROJECT_VERSION_MAJOR@/${oiio_version[0]}/; s/@PROJECT_VERSION_MINOR@/${oiio_version[1]}/" \
        -e "s/@PROJECT_VERSION_PATCH@/${oiio_version[2]}/; s/@PROJECT_VERSION_TWEAK@/${oiio_version[3]}/" \
        -e "s/@PROJECT_VERSION_RELEASE_TYPE@//; s/@PROJ_NAMESPACE@/OpenImageIO/g" \
        -e "s/@PROJ_VERSION_NAMESPACE@/v${oiio_version[0]}_${oiio_version[1]}/g" \
        -e "s/@Imath_VERSION_MAJOR@/3/; s/@Imath_VERSION_MINOR@/1/; s/@CMAKE_CXX_STANDARD@/17/g" \
        -e "s/^#cmakedefine01 OIIO_TBB/#define OIIO_TBB 0/" "$include/oiioversion.h.in" >"$include/oiioversion.h"
    ! grep '@\|cmakedefine' "$include/oiioversion.h" >"$scratch/log"
    touch -r "$include/oiioversion.h.in" "$include/oiioversion.h"
    cp -rp "$scratch/headers/usr/include/Imath" "$new/include/"
    cp -rp "$scratch/headers/usr/include/fmt" "$include/detail/"
    echo 'OIIO_ROOT = { value = ".native", relative = true }' >>"$new/cargo.toml"
}
place_libclang() {
    cp "$scratch"/wheels/libclang-*.data/platlib/clang/native/libclang.so "$new/lib/"
    echo 'LIBCLANG_PATH = { value = ".native/lib", relative = true }' >>"$new/cargo.toml"
}
make_prefix() {
    local names=() headers=() name
    if lacks embree; then names+=(embreex) && headers+=(libembree-dev); fi
    if lacks oiio; then names+=(openimageio) && headers+=(libimath-dev libfmt-dev); fi
    if lacks libclang; then names+=(libclang); fi
    say "putting a private copy into $prefix: ${missing[*]}"
    [ "$(uname -sm)" = "Linux x86_64" ] || give_up "the private copies are for Linux on x86_64"
    command -v apt-get >/dev/null && command -v dpkg-deb >/dev/null ||
        give_up "the private copies are made of Debian's and Python's packages: apt-get and dpkg-deb are needed"
    find_pip || give_up "Python with pip is needed: package python3-pip"
    fetch_wheels "${names[@]}" || give_up "pip could not download ${names[*]}"
    lacks oiio && { fetch_oiio_source || give_up "pip could not download OpenImageIO's headers"; }
    [ ${#headers[@]} = 0 ] || fetch_headers "${headers[@]}" ||
        give_up "apt-get could not download ${headers[*]} of Debian $header_suite"
    rm -rf "$new"
    mkdir -p "$new/include" "$new/lib"
    echo "[env]" >"$new/cargo.toml"
    for name in "${missing[@]}"; do "place_$name"; done
}

# ---- The way through.

# A fresh container has no package lists yet.
update_lists() { offers libc6 0 || as_root apt-get update -qq >"$scratch/log" 2>&1 || true; }
bring_libraries() {
    local packages=()
    look
    if [ ${#missing[@]} -gt 0 ] && command -v apt-get >/dev/null; then
        if may_install; then
            update_lists
            read -r -a packages < <(wanted_packages | tr '\n' ' ') || true
            if [ ${#packages[@]} -gt 0 ]; then
                install_packages "${packages[@]}" || say "apt-get could not"
                look
            fi
        elif [ -z "$private" ]; then
            read -r -a packages < <(wanted_packages | tr '\n' ' ') || true
            [ ${#packages[@]} = 0 ] || say "(with root's rights, these packages would be used: ${packages[*]})"
        fi
    fi
    mkdir -p "$prefix"
    if [ ${#missing[@]} -gt 0 ]; then make_prefix; fi
    rm -rf "$prefix/include" "$prefix/lib" "$prefix/cargo.toml" "$stamp"
    if [ ${#missing[@]} -gt 0 ]; then
        mv "$new"/* "$prefix/" && rmdir "$new"
        found+=(lib include cargo.toml)
    fi
    { identity && printf '%s\n' "${found[@]}"; } >"$stamp"
}
# Not needed to build: what cannot be brought is said, and no more.
bring_browser() {
    if may_install; then
        update_lists
        if offers chromium 0 && install_packages chromium; then return; fi
    fi
    say "could not bring Chromium (package chromium)"
}

if [ -n "$force" ] || ! up_to_date; then bring_libraries; fi
if [ -n "$browser" ]; then bring_browser; fi
say "done"
