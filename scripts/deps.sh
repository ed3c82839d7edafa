#!/bin/sh
# Installs the Debian packages of this list that are missing, or of those that are named.
set -eu

# The CMake file of libmujoco-dev needs libgl-dev and libopengl-dev, but its package does not name them.
packages="
  g++ cmake ninja-build make git
  libeigen3-dev libmujoco-dev libgl-dev libopengl-dev libtomlplusplus-dev libcli11-dev nlohmann-json3-dev
  libgtest-dev libbenchmark-dev
  python3 python3-pip python3-numpy python3-scipy python3-matplotlib
  clang-format clang-tidy
"
[ $# = 0 ] || packages=$*

# FILM=1: what draws and codes films.
[ "${FILM:-0}" = 1 ] && packages="$packages libosmesa6 ffmpeg"

missing=
for package in $packages; do
  status=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null) || status=
  [ "$status" = installed ] || missing="$missing $package"
done
[ -n "$missing" ] || exit 0

if [ "$(id -u)" = 0 ]; then
  sudo=
elif command -v sudo >/dev/null; then
  sudo=sudo
else
  echo "deps: neither root nor sudo; install:$missing" >&2
  exit 1
fi

echo "deps: installing$missing"
install() {
  # shellcheck disable=SC2086
  $sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends \
    -o DPkg::Lock::Timeout=120 $missing </dev/null
}
# The package lists may be absent or old. They are fetched when the installation fails.
install 2>/dev/null || { $sudo apt-get update -q </dev/null && install; }
