#!/usr/bin/env bash
# Makes .venv and installs the package with its development extras. Safe to run again and again:
# work is done only where pyproject.toml or the interpreter changed. Needs python3 >= 3.11.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

say() { printf 'setup: %s\n' "$*" >&2; }
fail() { say "$*"; exit 1; }

# The OpenCASCADE wheels (cadquery-ocp) link to these and do not carry them.
declare -A package_of=(
  [libGL.so.1]=libgl1
  [libX11.so.6]=libx11-6
  [libexpat.so.1]=libexpat1
  [libstdc++.so.6]=libstdc++6
)

install_packages() { # Debian packages, if this user may
  if [ "$(id -u)" -eq 0 ] && command -v apt-get >/dev/null; then
    say "installing $*"
    export DEBIAN_FRONTEND=noninteractive
    apt-get install -y --no-install-recommends "$@" >&2 ||
      { apt-get update >&2 && apt-get install -y --no-install-recommends "$@" >&2; }
  else
    fail "system packages are missing: run 'sudo apt-get install $*', then this again"
  fi
}

find_python() { # the first interpreter that is new enough
  local candidate
  for candidate in "${PYTHON:-python3}" python3.13 python3.12 python3.11; do
    if command -v "$candidate" >/dev/null &&
      "$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
      command -v "$candidate"
      return
    fi
  done
  return 1
}

python=$(find_python) || { install_packages python3 python3-venv; python=$(find_python); } ||
  fail "Python 3.11 or newer is needed; name it with PYTHON=/path/to/python ./setup.sh"

missing=()
for library in "${!package_of[@]}"; do
  "$python" -c "import ctypes; ctypes.CDLL('$library')" 2>/dev/null || missing+=("${package_of[$library]}")
done
"$python" -c 'import ensurepip, venv' 2>/dev/null || missing+=(python3-venv)
[ ${#missing[@]} -eq 0 ] || install_packages "${missing[@]}"

stamp=$({ "$python" -VV; pwd; cat pyproject.toml; } | sha256sum | cut -d' ' -f1)
if [ "$(cat .venv/stamp 2>/dev/null)" != "$stamp" ]; then
  say "installing into .venv (the first time takes some minutes)"
  [ -x .venv/bin/python ] && .venv/bin/python -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
    2>/dev/null || { rm -rf .venv; "$python" -m venv .venv; }
  .venv/bin/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]' >&2
  .venv/bin/python -c 'import cadquery' 2>/dev/null || # build123d brought the smaller build of OCP, which came last
    .venv/bin/python -m pip install --quiet --disable-pip-version-check --force-reinstall --no-deps \
      "cadquery-ocp==$(.venv/bin/python -c 'from importlib.metadata import version; print(version("cadquery-ocp"))')" >&2
  .venv/bin/python -c 'import build123d, cadquery, manifold3d' ||
    fail "the geometry kernels do not load; the message above names the library that is missing"
  .venv/bin/vmachining warm || say "continuing without"
  printf '%s\n' "$stamp" >.venv/stamp
fi
