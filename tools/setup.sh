#!/bin/bash
# Create an environment from a lock file, install this package in it and compile the solver, for `make setup`.
# Usage: tools/setup.sh VENV LOCK, where LOCK is requirements/work.lock, or requirements/use.lock, which any newer Python takes too.
set -euo pipefail
venv=$1 lock=$2
case $lock in
*work.lock) name=setup which="3.12" below="(3, 13)" size="3 GB: 3 to 10" pythons="python3.11 python3.12 python3" extras=train,cluster,lab,tables ;;
*) name=setup-small which=newer below="(4,)" size="1 GB: 1 to 3" pythons="python3 python3.14 python3.13 python3.12 python3.11" extras=tables ;;
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
[ -x "$venv/bin/python" ] || "$python" -m venv "$venv"
total=$(grep -c '^[A-Za-z0-9].*==' "$lock")
echo "Step 1 of 2: installing $total packages into $venv, $size minutes with a fast network"
pip() { "$venv/bin/python" -m pip install --disable-pip-version-check --require-hashes --requirement "$lock"; }
count() {  # what pip has downloaded and installed, and the seconds left if it goes on as until now
    while sleep 1; do
        downloaded=$(grep -cE '^Collecting' "$log" || true)
        installed=$(find "$venv"/lib/python*/site-packages -maxdepth 1 -name '*.dist-info' 2>/dev/null | wc -l || true)
        left=$((SECONDS * (2 * total - downloaded - installed) / (downloaded + installed + 1)))
        printf '\r  %d of %d downloaded, %d installed, %d s left  ' "$downloaded" "$total" "$installed" $((left > 0 ? left : 0))
    done
}
if [ -t 1 ]; then
    log=$(mktemp)
    count &
    trap 'kill $! 2>/dev/null || true; rm -f "$log"' EXIT
    pip > "$log" || { printf '\n'; tail -n 20 "$log"; exit 1; }
    kill $!
    printf '\n'
else
    pip
fi
# Without an index: this fails if the lock file does not hold what pyproject.toml asks for.
"$venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-index --no-build-isolation --editable ".[$extras]" || {
    echo "$lock does not hold what pyproject.toml asks for; run make lock" >&2
    exit 1
}
echo "Step 2 of 2: $venv/bin/bem compile"
"$venv/bin/bem" compile
"$venv/bin/surrogate" predict fast --tabor 1 --peak-indentation 10 --loading-rate 10 --dwell-time 0.1 --unloading-rate 10 > /dev/null
echo "$venv is ready, $(du -sh "$venv" | cut -f 1)"
