#!/bin/bash
# Create an environment from a lock file, install this package in it and compile the solver, for `make setup`.
# Usage: tools/setup.sh VENV LOCK, where LOCK is requirements.lock, or requirements-small.lock, which any newer Python takes too,
# or requirements-newest.txt, for the tests with the newest Keras beside the other environment.
set -euo pipefail
venv=$1 lock=$2
if [ "$lock" = requirements-newest.txt ]; then
    .venv/bin/python -m venv --clear "$venv"
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check --require-hashes --requirement "$lock"
    # PyTorch has no hash here: its builds for processors and for graphics cards share one version.
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check torch==2.13.0
    exit
fi
case $lock in
requirements.lock) name=setup which="3.12" below="(3, 13)" size="3 GB on disk, 3 to 10" pythons="python3.11 python3.12 python3" ;;
*) name=setup-small which=newer below="(4,)" size="1 GB on disk, 1 to 3" pythons="python3 python3.14 python3.13 python3.12 python3.11" ;;
esac
suits() { "$1" -c "import ensurepip, sys, venv; sys.exit(not (3, 11) <= sys.version_info[:2] < $below)" >/dev/null 2>&1; }

if [ ! -x "$venv/bin/python" ]; then
    for python in "${PYTHON:-}" $pythons python ""; do
        [ -z "$python" ] || ! suits "$python" || break
    done
    [ -n "$python" ] || { echo "Python 3.11 or $which (with venv) not found; install one, or name it: make $name PYTHON=/path/to/python" >&2; exit 1; }
elif ! suits "$venv/bin/python"; then
    echo "make $name needs Python 3.11 or $which, and $venv has another one; remove $venv first" >&2
    exit 1
fi
echo "Installing the locked packages into $venv: about $size minutes with a fast network"
[ -x "$venv/bin/python" ] || "$python" -m venv "$venv"
"$venv/bin/python" -m pip install --disable-pip-version-check --require-hashes --requirement "$lock"
"$venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
echo "Compiling the solver for this processor: about 100 seconds of one core"
"$venv/bin/bem" compile
"$venv/bin/python" -c "import bem; bem.Contact(bem.Scene(1.0)).advance(0.1, indentation=-1.0)"  # and what steps alone need
"$venv/bin/surrogate" predict fast --tabor 1 --peak-indentation 10 --loading-rate 10 --dwell-time 0.1 --unloading-rate 10 > /dev/null
echo "$venv is ready, $(du -sh "$venv" | cut -f 1)"
