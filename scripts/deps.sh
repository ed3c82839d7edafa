#!/bin/sh
# Installs the Debian packages of this list that are missing; does nothing when none is.
set -eu

# libgl-dev and libopengl-dev: the CMake file of libmujoco-dev asks for them, its package does not.
packages="
  g++ cmake ninja-build make git
  libeigen3-dev libmujoco-dev libgl-dev libopengl-dev libtomlplusplus-dev libcli11-dev nlohmann-json3-dev
  libgtest-dev libbenchmark-dev
  python3 python3-pip python3-numpy python3-scipy python3-matplotlib
  clang-format clang-tidy
"

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
  echo "deps: neither root nor sudo; please install:$missing" >&2
  exit 1
fi

echo "deps: installing$missing"
install() {
  # shellcheck disable=SC2086
  $sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends \
    -o DPkg::Lock::Timeout=120 $missing </dev/null
}
# The package lists may be absent or old: fetched when an installation without them fails.
install 2>/dev/null || { $sudo apt-get update -q </dev/null && install; }
