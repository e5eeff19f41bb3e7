#!/bin/bash
# Create an environment from a lock file, install this package in it and compile the solver, for `make setup`.
# Usage: tools/setup.sh VENV LOCK, where LOCK is requirements.lock, or requirements-small.lock, which any newer Python takes too.
set -euo pipefail
venv=$1 lock=$2
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
extras=$([ $name = setup ] && echo train,cluster,lab,tables,dev || echo tables)
# Without an index: this fails if the lock file does not hold what pyproject.toml asks for.
"$venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-index --no-build-isolation --editable ".[$extras]" || {
    echo "$lock does not hold what pyproject.toml asks for; run make lock" >&2
    exit 1
}
echo "Compiling the solver for this processor: about 100 seconds of one core"
"$venv/bin/bem" compile
"$venv/bin/python" -c "import bem; bem.Contact(bem.Scene(1.0)).advance(0.1, indentation=-1.0)"  # and what steps alone need
"$venv/bin/surrogate" predict fast --tabor 1 --peak-indentation 10 --loading-rate 10 --dwell-time 0.1 --unloading-rate 10 > /dev/null
echo "$venv is ready, $(du -sh "$venv" | cut -f 1)"
