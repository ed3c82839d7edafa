#!/bin/sh
# Fetches MuJoCo's own build of libmujoco 2.2.2 into build/physics: it is faster than Debian's and gave
# the same results. With PHYSICS=debian, or when it cannot be fetched, Debian's stays in use.
set -eu
cd "$(dirname "$0")/.."

wheel_sha256=a074ea3d63ecc504367df46aa73b3066cd9e7d7ebfe8a48261fba04a9ca232ea
library_sha256=63bb16223b4ef9b86485aea53a9c83d61506ed3131dfd4b62c001f24809d4d61
dir=build/physics
library=$dir/libmujoco.so.2.2.2

is() { [ -f "$2" ] && echo "$1  $2" | sha256sum --check --status; }

case ${PHYSICS:-upstream} in
  upstream) ;;
  debian)
    rm -rf "$dir"
    echo "deps: physics is Debian's libmujoco (PHYSICS=debian)"
    exit 0
    ;;
  *)
    echo "deps: PHYSICS: expected upstream or debian, got '$PHYSICS'" >&2
    exit 2
    ;;
esac

if [ -e "$library" ]; then
  is "$library_sha256" "$library" && exit 0
  rm -f "$library"
  echo "deps: $library had a wrong SHA-256 and was removed" >&2
  exit 1
fi

mkdir -p "$dir"
fetched=$(mktemp -d "$dir/fetch.XXXXXX")
trap 'rm -rf "$fetched"' EXIT
# One short attempt, so that a machine without a network waits for seconds only.
if ! timeout 120 python3 -m pip download --quiet --disable-pip-version-check --no-cache-dir \
    --retries 0 --timeout 10 --no-deps --only-binary=:all: --python-version 3.10 \
    --implementation cp --platform manylinux_2_17_x86_64 --dest "$fetched" mujoco==2.2.2 \
    >"$fetched/log" 2>&1; then
  echo "deps: MuJoCo's own library cannot be fetched from PyPI; physics is Debian's libmujoco, slower"
  exit 0
fi
wheel=$(ls "$fetched"/mujoco-2.2.2-*.whl)
if ! is "$wheel_sha256" "$wheel"; then
  echo "deps: the wheel of mujoco 2.2.2 has a wrong SHA-256: not used" >&2
  exit 1
fi
python3 -m zipfile -e "$wheel" "$fetched"
is "$library_sha256" "$fetched/mujoco/libmujoco.so.2.2.2" || {
  echo "deps: libmujoco.so.2.2.2 has a wrong SHA-256: not used" >&2
  exit 1
}
mv "$fetched/mujoco/libmujoco.so.2.2.2" "$library"
