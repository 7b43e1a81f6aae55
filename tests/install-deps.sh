#!/bin/sh
# install-deps.sh [--check] PACKAGE...   (Debian's names)
# Installs those of the packages that are missing: on Debian and Ubuntu, as root or through sudo. Elsewhere, without the
# right to install, or with --check: names what is missing and how to get it, exit 1. Silent when all is there.
# What is there is found by trying it, so that a library from any other source counts.
set -u
check=no
[ "${1-}" = --check ] && check=yes && shift

has_command() { command -v "$1" >/dev/null 2>&1; }
has_library() { has_command pkg-config && pkg-config --exists "$1" 2>/dev/null; }
has_header() { echo "#include <$1>" | g++ -E -x c++ - >/dev/null 2>&1; }
has_file() { for file in $1; do [ -e "$file" ] && return 0; done; return 1; }

is_there() {
  case $1 in
    gnuplot-nox) has_command gnuplot ;;
    fonts-dejavu-core) has_file '/usr/share/fonts/*/dejavu*/*' || fc-list 2>/dev/null | grep -q 'DejaVu Sans' ;;
    libcgal-dev) has_header CGAL/version.h ;;
    libcmocka-dev) has_library cmocka ;;
    libgsl-dev) has_library gsl ;;
    libhdf5-dev) has_library hdf5 ;;
    libqhull-dev) has_library qhull_r ;;
    libxxhash-dev) has_library libxxhash ;;
    libyaml-dev) has_library yaml-0.1 ;;
    libomp-dev) echo | clang -fopenmp -E -x c -include omp.h - >/dev/null 2>&1 ;;
    libclang-rt-*-dev) has_file '/usr/lib/llvm-*/lib/clang/*/lib/linux/libclang_rt.tsan-*.a' ;;
    python3-*) "${PYTHON:-/usr/bin/python3}" -c "import ${1#python3-}" 2>/dev/null ;;
    *) has_command "$1" ;;
  esac
}

missing=
for package; do is_there "$package" || missing="$missing $package"; done
[ -n "$missing" ] || exit 0

refuse() {
  echo "talus: missing:$missing" >&2
  [ $# = 0 ] || echo "talus: $1" >&2
  echo "talus: on Debian or Ubuntu (elsewhere the packages of the same libraries), as root:" >&2
  echo "  apt-get install$missing" >&2
  [ $check = no ] || echo "talus: or, which does that: make deps" >&2
  exit 1
}

[ $check = no ] || refuse
has_command apt-get || refuse
if [ "$(id -u)" = 0 ]; then
  sudo=
elif has_command sudo && { [ -t 0 ] || sudo -n true 2>/dev/null; }; then
  sudo=sudo
else
  refuse "cannot install them: neither root nor sudo"
fi

log=$(mktemp)
trap 'rm -f "$log"' EXIT
apt() { $sudo env DEBIAN_FRONTEND=noninteractive apt-get -qq "$@" </dev/null >>"$log" 2>&1; }

echo "talus: installing$missing"
apt update # a failure shows in what follows
# shellcheck disable=SC2086 # one word each
if ! apt install -y --no-install-recommends $missing; then
  tail -n 20 "$log" >&2
  refuse "apt-get could not install them"
fi
