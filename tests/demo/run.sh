#!/usr/bin/env bash
# Build the demonstrator and use it in headless Chromium, which reads pages of the documentation too. Installs Debian's Chromium and Node packages when they are missing.
# Usage: tests/demo/run.sh [MODEL.onnx]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

model="${1:-published/models/M1-concat/model.onnx}"
if [ ! -f "$model" ]; then
	echo "The demonstrator cannot be tested: $model is missing; export it with \`surrogate export M1-concat --format onnx\`." >&2
	exit 1
fi

missing=()
command -v chromium >/dev/null || [ -n "${CHROMIUM:-}" ] || missing+=(chromium fonts-dejavu-core)
command -v node >/dev/null || missing+=(nodejs)
command -v npm >/dev/null || missing+=(npm)
if [ ${#missing[@]} -gt 0 ]; then
	if ! command -v apt-get >/dev/null; then
		echo "The demonstrator's test needs Chromium, Node 18 or newer and npm; install what is missing: ${missing[*]}" >&2
		exit 1
	fi
	run=()
	[ "$(id -u)" -eq 0 ] || run=(sudo)
	"${run[@]}" apt-get update -qq
	DEBIAN_FRONTEND=noninteractive "${run[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
fi

make --no-print-directory demo-build DEMO_MODEL="$model"
(cd demo && node_modules/.bin/tsc --noEmit)
.venv/bin/python -m pytest -q tests/demo/check_numbers.py tests/demo/check_in_browser.py tests/demo/check_site.py
